// Settled rows, each a point of its own: batch least squares in double, what they cannot teach, bad rows, a late
// background.
#include "dqw_estimator.h"
#include "dqw_estimator_block.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

enum { P_TRUE = 4 };
static const double TRUTH[] = {0.9, 2.2e-3, 2.8e-3, 0.12};
static const char *const NAME[] = {"R", "L_d", "L_q", "flux"};
enum { KNOWS_R = 1, KNOWS_LD = 2, KNOWS_LQ = 4, KNOWS_PSI = 8 };

static dqw_estimator_config config_of(void)
{
    const dqw_estimator_config c = {.dt_s = 1e-4f,
                                    .v_base_V = 180.0f,
                                    .i_base_A = 15.0f,
                                    .w_base_rad_s = 200.0f,
                                    .pole_pairs = P_TRUE,
                                    .settled = true};
    return c;
}

static dqw_estimator begin(const dqw_estimator_config *c)
{
    dqw_estimator e;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&e, c));
    return e;
}

static dqw_sample settled(double i_d, double i_q, double w_m)
{
    const double w = P_TRUE * w_m;
    const dqw_sample s = {.v_d_V = (float)(TRUTH[0] * i_d - w * TRUTH[2] * i_q),
                          .v_q_V = (float)(TRUTH[0] * i_q + w * (TRUTH[1] * i_d + TRUTH[3])),
                          .i_d_A = (float)i_d,
                          .i_q_A = (float)i_q,
                          .w_m_rad_s = (float)w_m};
    return s;
}

static double value_of(const dqw_estimator *e, int i)
{
    return (double)dqw_estimator_read(e, (enum dqw_parameter)i).value;
}
static double sd_of(const dqw_estimator *e, int i) { return (double)dqw_estimator_read(e, (enum dqw_parameter)i).sd; }

static unsigned known(const dqw_estimator *e)
{
    unsigned mask = 0;
    for (int i = 0; i < 4; i++) mask |= (sd_of(e, i) < 0.25 * fabs(value_of(e, i)) ? 1u : 0u) << i;
    return mask;
}

// No parameter may be known and be wrong: off by over 1 % and over 6 of its deviations.
static void no_wrong_number(const dqw_estimator *e)
{
    for (int i = 0; i < 4; i++) {
        const double off = fabs(value_of(e, i) - TRUTH[i]);
        char message[300];
        (void)snprintf(message, sizeof message, "%s is known as %g +- %g, is %g; %s", NAME[i], value_of(e, i),
                       sd_of(e, i), TRUTH[i], test_case);
        if ((known(e) >> i & 1u) && off > 0.01 * TRUTH[i] && off > 6 * sd_of(e, i)) TEST_FAIL_MESSAGE(message);
    }
}

static void test_settled_rows_are_batch_least_squares(void)
{
    for (int kind = 0; kind < 2; kind++) {
        CASE("%s", kind ? "standstill" : "steady");
        const dqw_estimator_config c = config_of();
        dqw_estimator e = begin(&c);
        test_random r = {(uint64_t)(2 + kind)};
        test_ls ls;
        ls_begin(&ls, kind ? 1 : 4, 0.0);
        for (int k = 0; k < 400; k++) {
            dqw_sample s = settled(random_uniform(&r, -8, 8), random_uniform(&r, -8, 8),
                                   kind ? 0.0 : random_uniform(&r, -200, 200));
            s.v_d_V += (float)(0.3 * random_normal(&r));
            s.v_q_V += (float)(0.3 * random_normal(&r));
            HOLDS(dqw_estimator_sample(&e, &s, false) == DQW_EVENT_BLOCK);
            HOLDS(dqw_estimator_background(&e));
            const double w = P_TRUE * (double)s.w_m_rad_s;
            const double row_d[] = {s.i_d_A, 0.0, -w * s.i_q_A, 0.0};
            const double row_q[] = {s.i_q_A, w * s.i_d_A, 0.0, w};
            ls_add(&ls, row_d, s.v_d_V);
            ls_add(&ls, row_q, s.v_q_V);
        }
        double w[LS_MAX];
        double inverse[LS_MAX][LS_MAX];
        const double variance = ls_solve(&ls, w, inverse) / (800 - ls.n);
        for (int i = 0; i < ls.n; i++) {
            CASE("%s, %s", kind ? "standstill" : "steady", NAME[i]);
            BETWEEN(-0.01, (value_of(&e, i) - w[i]) / sd_of(&e, i), 0.01);  // 0.0016
            BETWEEN(0.9, sd_of(&e, i) / sqrt(variance * inverse[i][i]), 1.25);
        }
        HOLDS(known(&e) == (kind ? KNOWS_R : 15u));
        TEST_ASSERT_EQUAL_UINT32(400, e.gate.blocks);
        TEST_ASSERT_EQUAL_UINT32(400, e.halves);
    }
}

// A settled row is a block of its own: what goes with it is its angle, not the one before it.
static void test_a_row_has_its_own_angle(void)
{
    dqw_estimator_config c = config_of();
    c.angle = true;
    dqw_estimator e = begin(&c);
    for (int k = 0; k < 5; k++) {
        dqw_sample s = settled(3, 2, 50);
        s.cosine = (float)cos(k);
        s.sine = (float)sin(k);
        HOLDS(dqw_estimator_sample(&e, &s, false) == DQW_EVENT_BLOCK);
        dqw_estimator_block b;
        HOLDS(dqw_estimator_take(&e, &b));
        HOLDS(b.cosine == s.cosine && b.sine == s.sine);
    }
}

static void test_ninety_five_percent_intervals_hold_the_truth(void)
{
    const int runs = scaled(200);
    int inside[4] = {0};
    for (int k = 0; k < runs; k++) {
        const dqw_estimator_config c = config_of();
        dqw_estimator e = begin(&c);
        test_random r = {(uint64_t)(2000 + k)};
        for (int n = 0; n < 60; n++) {
            dqw_sample s = settled(random_uniform(&r, -8, 8), random_uniform(&r, -8, 8), random_uniform(&r, -200, 200));
            s.v_d_V += (float)random_normal(&r);
            s.v_q_V += (float)random_normal(&r);
            (void)dqw_estimator_sample(&e, &s, false);
            (void)dqw_estimator_background(&e);
        }
        for (int i = 0; i < 4; i++) inside[i] += fabs(value_of(&e, i) - TRUTH[i]) < 1.96 * sd_of(&e, i);
    }
    for (int i = 0; i < 4; i++) {
        CASE("%s", NAME[i]);
        BETWEEN((runs == 200 ? 0.9 : 0.7) * runs, inside[i], (runs == 200 ? 0.99 : 1.0) * runs);
    }
}

// Logs that lack something: what is known is right, and what cannot be known is not.
static void test_what_cannot_be_taught_is_not_known(void)
{
    static const struct {
        const char *name;
        double i_d, i_q, w;     // means
        double di_d, di_q, dw;  // levels about them
        unsigned can;
    } kinds[] = {
        {"standstill without current", 0, 0, 0, 0, 0, 0, 0},
        {"no current at one speed", 0, 0, 100, 0, 0, 0, KNOWS_PSI},
        {"no current at many speeds", 0, 0, 100, 0, 0, 80, KNOWS_PSI},
        {"one operating point", 3, 5, 100, 0, 0, 0, 0},
        {"one operating point without i_d", 0, 5, 100, 0, 0, 0, KNOWS_LQ},
        {"one operating point without i_q", 5, 0, 100, 0, 0, 0, KNOWS_R},
        {"one current at standstill", 3, 0, 0, 0, 0, 0, KNOWS_R},
        {"d levels at standstill", 0, 0, 0, 6, 0, 0, KNOWS_R},
        {"q levels at standstill", 0, 0, 0, 0, 6, 0, KNOWS_R},
        {"q levels at one speed", 0, 0, 100, 0, 6, 0, KNOWS_R | KNOWS_LQ | KNOWS_PSI},
        {"d levels at one speed", 0, 0, 100, 6, 0, 0, KNOWS_R | KNOWS_LD | KNOWS_PSI},
        {"q levels at one speed, constant i_d", -3, 0, 100, 0, 6, 0, KNOWS_R | KNOWS_LQ},
        {"many speeds, constant currents", 3, 5, 100, 0, 0, 80, KNOWS_R | KNOWS_LQ},
        {"everything", 0, 0, 0, 6, 6, 150, 15},
    };
    static const double noises[] = {0.0, 0.01, 0.3};
    static const int counts[] = {1, 2, 10, 1000};
    for (int k = 0; k < (int)(sizeof kinds / sizeof kinds[0]); k++)
        for (int n = 0; n < 3; n++)
            for (int c = 0; c < 4; c++)
                for (int p = 0; p <= P_TRUE; p += P_TRUE) {
                    CASE("%s, noise %g V, %d rows, p %s", kinds[k].name, noises[n], counts[c],
                         p ? "given" : "not given");
                    dqw_estimator_config config = config_of();
                    config.pole_pairs = (uint16_t)p;
                    dqw_estimator e = begin(&config);
                    test_random r = {(uint64_t)(10 + k)};
                    for (int row = 0; row < counts[c]; row++) {
                        dqw_sample s = settled(kinds[k].i_d + kinds[k].di_d * random_uniform(&r, -1, 1),
                                               kinds[k].i_q + kinds[k].di_q * random_uniform(&r, -1, 1),
                                               kinds[k].w + kinds[k].dw * random_uniform(&r, -1, 1));
                        s.v_d_V += (float)(noises[n] * random_normal(&r));
                        s.v_q_V += (float)(noises[n] * random_normal(&r));
                        (void)dqw_estimator_sample(&e, &s, false);
                        (void)dqw_estimator_background(&e);
                    }
                    HOLDS(dqw_estimator_pole_pairs(&e) == p);
                    // From two rows with noise no deviation can be judged.
                    if (counts[c] >= 10 || noises[n] == 0.0) no_wrong_number(&e);
                    const unsigned can = p ? kinds[k].can : kinds[k].can & KNOWS_R;
                    if (getenv("DQW_TEST_VALUES") != NULL &&
                        (known(&e) & ~can || (counts[c] == 1000 && known(&e) != can)))
                        printf("%s: knows %u can %u\n", test_case, known(&e), can);
                    HOLDS((known(&e) & ~can) == 0);
                    if (counts[c] == 1000) HOLDS(known(&e) == can);
                }
}

// A single tiny current: above the threshold of excitation, so that it teaches; what it teaches must be right.
static void test_a_start_value_is_no_prior_even_at_the_threshold(void)
{
    static const double sizes[] = {0.0021, 0.005, 0.02, 0.1};
    for (int k = 0; k < 4; k++)
        for (int nominal = 0; nominal < 2; nominal++) {
            CASE("current of %g bases, %s", sizes[k], nominal ? "R nominal 30 % high" : "R not known");
            dqw_estimator_config c = config_of();
            c.R_ohm = nominal ? (float)(1.3 * TRUTH[0]) : 0.0f;
            dqw_estimator e = begin(&c);
            for (int n = 0; n < 3; n++) {
                const dqw_sample s = settled(15 * sizes[k], 0.0, 0.0);
                (void)dqw_estimator_sample(&e, &s, false);
                (void)dqw_estimator_background(&e);
            }
            no_wrong_number(&e);
        }
}

// Bad rows are counted, teach nothing, and each hands over no block; one more row while one waits is lost.
static void test_bad_rows_and_a_late_background(void)
{
    dqw_estimator_config c = config_of();
    c.stale_limit = 2;
    dqw_estimator e = begin(&c);
    test_random r = {20};
    dqw_sample last = {0};
    uint32_t expected[5] = {0};  // accepted, nonfinite, saturated, stale, missed
    for (int k = 0; k < 4000; k++) {
        dqw_sample s = settled(random_uniform(&r, -8, 8), random_uniform(&r, -8, 8), random_uniform(&r, -200, 200));
        const int kind = k % 11;
        if (kind == 1) (&s.v_d_V)[k % 5] = NAN;
        if (kind == 2) (&s.v_d_V)[k % 5] = 1e9f;
        if (kind == 5 || kind == 6 || kind == 7) s = last;
        if (kind == 7) s.v_d_V = s.v_q_V = 99.0f;
        last = s;
        const uint32_t event = dqw_estimator_sample(&e, &s, kind == 3);
        const bool late = kind == 9;
        expected[1] += kind == 1;
        expected[2] += kind == 2 || kind == 3;
        expected[3] += kind == 6 || kind == 7;
        expected[4] += late;
        expected[0] += kind != 1 && kind != 2 && kind != 3 && kind != 6 && kind != 7;
        CASE("row %d", k);
        HOLDS(event == (kind == 1                ? DQW_EVENT_NONFINITE
                        : kind == 2 || kind == 3 ? DQW_EVENT_SATURATED
                        : kind == 6 || kind == 7 ? DQW_EVENT_STALE
                        : late                   ? DQW_EVENT_MISSED
                                                 : DQW_EVENT_BLOCK));
        if (kind != 8) (void)dqw_estimator_background(&e);
    }
    TEST_ASSERT_EQUAL_UINT32(expected[0], e.gate.accepted);
    TEST_ASSERT_EQUAL_UINT32(expected[1], e.gate.nonfinite);
    TEST_ASSERT_EQUAL_UINT32(expected[2], e.gate.saturated);
    TEST_ASSERT_EQUAL_UINT32(expected[3], e.gate.stale);
    TEST_ASSERT_EQUAL_UINT32(expected[4] < 255 ? expected[4] : 255, e.missed);
    TEST_ASSERT_EQUAL_UINT32(e.gate.accepted - expected[4], e.gate.blocks);
    for (int i = 0; i < 4; i++) {
        CASE("%s", NAME[i]);
        BETWEEN(-1e-4, value_of(&e, i) / TRUTH[i] - 1, 1e-4);
    }
    // A jump in time is nothing to rows that stand alone.
    dqw_estimator_missing(&e, 0);
    const dqw_sample s = settled(3, 4, 100);
    HOLDS(dqw_estimator_sample(&e, &s, false) == DQW_EVENT_BLOCK);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_settled_rows_are_batch_least_squares);
    RUN_TEST(test_a_row_has_its_own_angle);
    RUN_TEST(test_ninety_five_percent_intervals_hold_the_truth);
    RUN_TEST(test_what_cannot_be_taught_is_not_known);
    RUN_TEST(test_a_start_value_is_no_prior_even_at_the_threshold);
    RUN_TEST(test_bad_rows_and_a_late_background);
    return UNITY_END();
}
