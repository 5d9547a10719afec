// Which legs switch, in whole numbers: what a trial sums up against least squares in double, whose turn it is, and what
// is decided.
#include "dqw_estimator_block_q15.h"
#include "dqw_estimator_search_q15.h"
#include "legs_search.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

enum { N = DQW_PARAMETERS };

#define Q24 16777216.0
#define Q28 268435456.0
#define Q40 1099511627776.0

static dqw_estimator_q15_config config;
static dqw_estimator_q15 e;
static const dqw_estimator_q15_block still = {.whole = true, .weight = 420};

static void start(void)
{
    static const dqw_estimator_q15_config given = {.scale = {40000, 12000, 400000, 100000, 5},
                                                   .R_uohm = 400000,
                                                   .Ld_nH = 1100000,
                                                   .Lq_nH = 1700000,
                                                   .psi_nWb = 15000000,
                                                   .half_window = 20,
                                                   .dead_time_width_mA = 300,
                                                   .modulation = DQW_MODULATION_UNKNOWN,
                                                   .angle = true,
                                                   .encoder_offset = true};
    config = given;
    memset(&e, 0, sizeof e);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&e, &config));
    HOLDS(dqw_estimator_modulation_q15(&e) == DQW_MODULATION_UNKNOWN);
    for (int i = 0; i < N; i++) e.w_q24[i] = (int32_t)lrint(0.1 * (i + 1) * Q24);
}

// As the block before the last one of a round leaves it, when nothing more is seen in the last one.
static void end_round(int leader, int rounds, const double ratio[LEGS])
{
    e.leader = (uint8_t)leader;
    e.trial = (uint8_t)(3 * rounds);
    e.modulation = e.leader;
    for (int m = 0; m < LEGS; m++) {
        e.residual.alone_q31[m] = (uint32_t)(10000000 * (m + 1));
        e.residual.slow_alone_q31[m] = (uint32_t)lrint(ratio[m] * e.residual.alone_q31[m]);
    }
    e.residual.began = e.residual.began_before = 1000000000;
    e.residual.slow_at = 3;
    e.segment.blocks = 60000;
    e.normal.c_q32 = 1;
    e.score2_q68[0] = 1;
}

static void test_what_is_decided(void)
{
    static const uint32_t none[2] = {0, 0};
    test_random r = {720};
    int seen[LEGS_LEADS + LEGS + 1] = {0};
    for (int k = 0; k < 4000; k++) {
        start();
        double ratio[LEGS];
        legs_drawn(&r, ratio);
        const int leader = (int)(random_bits(&r) % LEGS);
        const int rounds = 1 + (int)(random_bits(&r) % 4);
        end_round(leader, rounds, ratio);
        dqw_rows_q15 rows = {.y_q28 = {0}};
        const int32_t L_q_q24 = e.w_q24[DQW_LQ];
        e.w_q24[DQW_DEAD_TIME] = 1234;
        e.learned = 0x3fu;
        CASE("leader %d, %d rounds, ratios %g, %g, %g, %g", leader, rounds, ratio[0], ratio[1], ratio[2], ratio[3]);
        dqw_estimator_try_q15(&e, &still, &rows, none);
        const int expected = legs_verdict(leader, rounds, ratio);
        seen[expected + 1]++;
        if (expected == LEGS_GO_ON) {
            HOLDS(e.trial == 3 * rounds + 1 && e.leader == leader && e.modulation == legs_rival(leader, e.trial));
            HOLDS(e.residual.alone_q31[1] > 0 && e.segment.blocks == 0 && e.residual.began == 0 &&
                  e.residual.began_before == 0);
        } else if (expected >= LEGS_LEADS) {
            HOLDS(e.trial == 1 && e.leader == expected - LEGS_LEADS && e.modulation == e.leader);
            for (int m = 0; m < LEGS; m++) HOLDS(e.residual.alone_q31[m] == 0 && e.residual.slow_alone_q31[m] == 0);
        } else {
            HOLDS(e.trial == 0 && e.modulation == expected && (int)dqw_estimator_modulation_q15(&e) == expected);
            // Weights stay, what was known of them does not.
            HOLDS(e.blocks == 0 && e.learned == 0 && e.w_q24[DQW_DEAD_TIME] == 1234 && e.w_q24[DQW_LQ] == L_q_q24);
        }
        HOLDS(e.mixed == 2);
    }
    // Each kind of verdict.
    for (int m = 0; m < LEGS; m++) HOLDS(seen[m + 1] > 30 && (m == 0 || seen[LEGS_LEADS + m + 1] > 50));
    HOLDS(seen[LEGS_GO_ON + 1] > 50);
}

// Inside a round nothing is decided.
static void test_a_round_has_three_trials(void)
{
    static const uint32_t none[2] = {0, 0};
    static const double clear[LEGS] = {2, 0.1, 2, 2};
    for (int trial = 1; trial < 6; trial++) {
        start();
        end_round(DQW_MODULATION_CENTRED, 1, clear);
        e.trial = (uint8_t)trial;
        const dqw_rows_q15 rows = {.y_q28 = {0}};
        CASE("trial %d", trial);
        dqw_estimator_try_q15(&e, &still, &rows, none);
        HOLDS(e.trial == trial + 1 && e.leader == 0 && e.modulation == legs_rival(0, trial + 1));
    }
}

// A segment in which one of both was not seen goes on.
static void test_both_are_seen(void)
{
    static const uint32_t none[2] = {0, 0};
    static const double clear[LEGS] = {2, 0.1, 2, 2};
    for (int seen = 0; seen < 2; seen++) {
        start();
        end_round(DQW_MODULATION_CENTRED, 2, clear);
        e.residual.began = (uint32_t)seen, e.residual.began_before = (uint32_t)(1 - seen);
        // What is shown now is another block of the one that was seen.
        e.modulation = (uint8_t)(seen ? DQW_MODULATION_CENTRED : legs_rival(0, 6));
        const dqw_rows_q15 rows = {.y_q28 = {0}};
        CASE("seen %d", seen);
        dqw_estimator_try_q15(&e, &still, &rows, none);
        HOLDS(e.trial == 6 && e.leader == 0);
    }
}

// Runs of eight to fourteen blocks, and at the end the least squares' own cost of both.
static void test_a_trial(void)
{
    test_random r = {721};
    start();
    e.learned = 0x7fu;
    // Where sums are gathered stands what was learned.
    for (int i = 0; i < N * (N + 1) / 2; i++) e.segment.a[i] = e.normal.a_q32[i] = 1 << 30;
    for (int i = 0; i < N; i++) e.segment.b[i] = e.normal.b_q32[i] = 1 << 28;
    e.score2_q68[0] = (int64_t)1 << 40, e.residual.began = e.residual.began_before = 9;
    const uint32_t masks[2] = {0x5fu, 0x3eu};  // some input of each axis teaches nothing
    test_ls sums[2];
    double blocks[2] = {0, 0};
    for (int rival = 0; rival < 2; rival++) ls_begin(&sums[rival], N, 1e-9);
    int run = 0;
    int length = -1;
    int next = -1;
    int last = 0;
    double truth[2][N];
    for (int i = 0; i < N; i++) truth[0][i] = random_uniform(&r, -1, 1), truth[1][i] = random_uniform(&r, -1, 1);
    for (int k = 0; e.trial != 2; k++) {
        HOLDS(k < 400);
        const bool first = k == 0;
        const int now = first ? DQW_MODULATION_CENTRED : e.modulation;
        HOLDS(now == DQW_MODULATION_CENTRED || now == legs_rival(DQW_MODULATION_CENTRED, 1));
        const int rival = now != DQW_MODULATION_CENTRED;
        e.number = (uint32_t)(7 * k + k / 5);
        dqw_rows_q15 rows;
        memset(&rows, 0, sizeof rows);
        for (int axis = 0; axis < 2; axis++) {
            double y = 0.003 * random_normal(&r);
            double x[N];
            for (int i = 0; i < N; i++) {
                rows.x_q28[axis][i] = (int32_t)lrint(0.03 * random_uniform(&r, -1, 1) * Q28);
                x[i] = (masks[axis] >> i & 1u) != 0 ? rows.x_q28[axis][i] / Q28 : 0;
                y += x[i] * truth[rival][i];
            }
            // The weights as they stand; dead time's part is what is asked for.
            rows.y_q28[axis] = (int32_t)lrint(y * Q28);
            double error = rows.y_q28[axis] / Q28;
            for (int i = 0; i < N; i++)
                if (i != DQW_DEAD_TIME && i != DQW_DEAD_CONSTANT) error -= 0.1 * (i + 1) * rows.x_q28[axis][i] / Q28;
            ls_add(&sums[rival], x, error);
        }
        blocks[rival]++;
        if (!first && now != last) {
            HOLDS(length < 0 || run == length);
            run = 0;
            length = next;
        }
        run++;
        last = now;
        const int before = e.modulation;
        dqw_estimator_try_q15(&e, &still, &rows, masks);
        if (first) HOLDS(e.learned == 0 && e.w_q24[DQW_DEAD_TIME] == 0 && e.mixed == 0);
        if (!first && e.trial == 1 && e.modulation != before) {
            HOLDS(e.mixed == 2 && e.residual.slow_at == 8 + e.number % 7);
            next = e.residual.slow_at;
        }
    }
    // Both took their turns.
    HOLDS(fabs(blocks[0] - blocks[1]) < 30 && blocks[0] > 50 && blocks[1] > 50);
    const int m = legs_rival(DQW_MODULATION_CENTRED, 1);
    for (int rival = 0; rival < 2; rival++) {
        double w[N];
        double inverse[LS_MAX][LS_MAX];
        const double left = ls_solve(&sums[rival], w, inverse) / blocks[rival];
        CASE("rival %d", rival);
        BETWEEN(0.99 * left, (rival ? e.residual.slow_alone_q31[m] : e.residual.alone_q31[m]) / Q40, 1.01 * left);
    }
    for (int k = 0; k < LEGS; k++)
        if (k != m) HOLDS(e.residual.alone_q31[k] == 0 && e.residual.slow_alone_q31[k] == 0);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_what_is_decided);
    RUN_TEST(test_a_round_has_three_trials);
    RUN_TEST(test_both_are_seen);
    RUN_TEST(test_a_trial);
    return UNITY_END();
}
