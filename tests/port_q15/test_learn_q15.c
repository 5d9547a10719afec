// One block through the joint neuron in whole numbers against least squares in double, from the state before it: what
// is excited, the sums, the weights that are solved, statistics, and what is handed back to the interrupt.
#include "dqw_estimator_block_q15.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

enum { N = DQW_PARAMETERS, SCORES = 4 };
#define SETTLED_PART 0.002
#define V_FULL 40.0
#define I_FULL 12.0
#define W_FULL 400.0
#define DT_S 1e-4
#define Q24 16777216.0
#define Q28 268435456.0
#define Q32 4294967296.0
#define Q34 17179869184.0
#define Q40 1099511627776.0
#define Q54 18014398509481984.0
#define Q56 72057594037927936.0
#define Q68 295147905179352825856.0

static dqw_estimator_q15_config config;
static dqw_estimator_q15 e;

static void begin(void)
{
    static const dqw_estimator_q15_config given = {
        .scale = {(uint32_t)(1000 * V_FULL), (uint32_t)(1000 * I_FULL), (uint32_t)(1000 * W_FULL), 100000, 5},
        .R_uohm = 400000,
        .Ld_nH = 1100000,
        .Lq_nH = 1700000,
        .psi_nWb = 15000000,
        .half_window = 20,
        .dead_time_width_mA = 100,
        .angle = true,
        .encoder_offset = true,
        .modulation = DQW_MODULATION_CLAMPED_LOW,
        .solve_blocks = 1,
        .noise_on_inputs = true};
    config = given;
}

static void start(void)
{
    memset(&e, 0, sizeof e);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&e, &config));
    e.stage.name = DQW_STAGE_ORDINAL;
}

static int32_t rounded(double x) { return (int32_t)lrint(x); }

// A machine a little off its nominal values; currents and speed of this part of the bases.
static dqw_estimator_q15_block drawn(test_random *r, double size, double noise_V)
{
    static const double truth[] = {1.12, 0.91, 1.06, 0.93, 0.22, 0.03, 0.08};
    dqw_estimator_q15_block b;
    memset(&b, 0, sizeof b);
    b.weight = 420;
    b.whole = random_bits(r) % 8 != 0;
    b.with.follow_q15 = (uint16_t)random_uniform(r, 10000, 32768);
    b.with.slopes = 1000, b.with.slope_q15 = (uint32_t)random_uniform(r, 1e6, 3e7);
    b.with.rows = 5000;
    const double one = 32768.0 * b.weight;
    for (int a = 0; a < 2; a++) {
        b.with.noise_q30[a] = -llrint(2 * 5000 * random_uniform(r, 3e-6, 1e-4) * 1073741824.0);
        b.sums[2 + a] = rounded(size * random_uniform(r, -1, 1) * one);
        b.sums[4 + a] = rounded(size * random_uniform(r, -0.03, 0.03) * one);
        b.sums[6 + a] = rounded(size * random_uniform(r, -1.5, 1.5) * one);
        b.sums[9 + a] = rounded(size * random_uniform(r, -2, 2) * one);
        b.sums[11 + a] = rounded(size * random_uniform(r, -2, 2) * one);
        b.v_step_q15[a] = rounded(random_uniform(r, -4, 4) * 32768);
    }
    b.with.answer_q30 = llrint((double)b.with.noise_q30[0] / 8 * random_uniform(r, -3, 3));
    b.with.noise_q30[2] = llrint(6 * 5000 * random_uniform(r, 3e-6, 1e-4) * 1073741824.0);
    b.sums[8] = rounded(size * random_uniform(r, -1.2, 1.2) * one);
    dqw_rows_q15 rows;
    dqw_estimator_rows_of_q15(&e, &b, &rows);
    for (int a = 0; a < 2; a++) {
        double v = noise_V / V_FULL * random_normal(r);
        for (int i = 0; i < N; i++) v += rows.x_q28[a][i] / Q28 * truth[i];
        b.sums[a] = rounded(v * one);
    }
    return b;
}

// (E189): the part of noise in a block's slope that a first-order loop answers, which the library takes to 0.02.
static double answered(const dqw_estimator_q15_block *b)
{
    const double a = fabs((double)b->with.answer_q30 * 2 * e.window.half / floor((e.window.half + 1) / 4.0) /
                          (3 * (double)b->with.noise_q30[0])) *
                     e.window.half;
    return a > 0 ? 1 - (1.5 - 2 * exp(-a) + 0.5 * exp(-2 * a)) / a : 0;
}

static void alike(double expected, double value, double room, const char *what)
{
    test_between(expected - room, value, expected + room, what, __LINE__);
}

// (E19): the mean over 32 blocks of an input's power above what teaches, over that.
static void excited(const dqw_estimator_q15 *before, const dqw_rows_q15 *r)
{
    const double part = (config.excitation_q15 != 0 ? config.excitation_q15 : 328) / 32768.0;
    for (int i = 0; i < N; i++) {
        double need = pow(part * (double)dqw_estimator_whole_q40(&e, &r->unit, i) / Q40, 2) +
                      3 * (double)(r->noise_q56[0][i] + r->noise_q56[1][i]) / Q56;
        const double widths = config.dead_time_width_mA / 1000.0 / I_FULL * (double)r->unit.R_q40 / Q40;
        if (i == DQW_R) need += 16 * widths * widths;
        const double power = pow(r->x_q28[0][i] / Q28, 2) + pow(r->x_q28[1][i] / Q28, 2);
        const double excess = fmin(power / need, 8) - 1;
        const double expected = (31.0 * before->excess_q10[i] + 1024 * excess) / 32;
        CASE("input %d is excited by %g", i, expected);
        BETWEEN(expected - 1.1, e.excess_q10[i], expected + 1.1);
    }
    for (int a = 0; a < 2; a++)
        for (int L = 0; L < 2; L++) {
            const double least = 2 * (double)r->noise_q56[a][DQW_LD + L] / Q56;
            const double excess = fmin(pow(r->x_q28[a][DQW_LD + L] / Q28, 2) / least, 8) - 1;
            const double expected = (31.0 * before->above_q10[L][a] + 1024 * excess) / 32;
            CASE("axis %d, L %d, above its noise by %g", a, L, expected);
            BETWEEN(expected - 1.1, e.above_q10[L][a], expected + 1.1);
        }
}

// What of an axis teaches: what is excited; of an inductance what is above that axis' own noise, and beside the flux
// that even where it is little.
static bool teaches(int axis, int i)
{
    if (i != DQW_LD && i != DQW_LQ) return e.excess_q10[i] > 0;
    const bool beside = i == (axis == 0 ? DQW_LQ : DQW_LD) && e.excess_q10[axis == 0 ? DQW_PSI_Q : DQW_PSI] > 0;
    return e.above_q10[i - DQW_LD][axis] > 0 && (beside || e.excess_q10[i] > 0);
}

// What the interrupt takes: dt/L where that is known to a fifth, and (E60)'s w/(w + 0.7 sd).
static void published(const dqw_estimator_q15 *before, const dqw_estimator_q15_block *b)
{
    HOLDS(e.given.ready);
    bool anew = before->given.ready && before->given.noise_anew;
    const double nominal_H[2] = {1e-9 * config.Ld_nH, 1e-9 * config.Lq_nH};
    for (int a = 0; a < 2; a++) {
        const double w = e.w_q24[DQW_LD + a] / Q24;
        const double last = before->given.step_q15[a];
        double step = last;
        if (dqw_estimator_noise_sd_q24(&e, DQW_LD + a) / Q24 < 0.2 * w)
            step = DT_S * V_FULL / (nominal_H[a] * w * I_FULL) * 32768;
        const double by = e.given.step_q15[a] / last;
        anew = anew || by > 1.25 || by < 0.8;
        alike(step, e.given.step_q15[a], 1, "step");
    }
    HOLDS(e.given.noise_anew == anew);
    double variance = 0;
    for (int a = 0; a < 2; a++) variance -= (double)b->with.noise_q30[a] / (4 * 5000 * 1073741824.0);
    const double width = config.dead_time_width_mA / 1000.0 / I_FULL;
    const double late = fmin(0.35 * sqrt(variance) / width, 2);
    alike(1 / (1 + late), e.given.follow_q15 / 32768.0, 1.5e-3, "follow");
    alike(2 * late, e.given.lead_q12 / 4096.0, 8e-3, "lead");
}

static void shown(int blocks, test_random *r, int *learned)
{
    for (int k = 0; k < blocks; k++) {
        CASE("block %d", k);
        // A drive that rests now and then: what is excited ends one after the other.
        const double size = k % 200 < 90 ? 1 : pow(10, random_uniform(r, -4, -1));
        const dqw_estimator_q15_block b = drawn(r, size, k % 2 ? 0.1 : 0.3);
        if (k == 300) e.blocks = 5000;
        e.number = (uint32_t)k, e.elapsed = 1;
        e.across = 0;
        if (k % 9 == 0) e.given.ready = k % 2, e.given.noise_anew = k % 4 == 0;
        const dqw_estimator_q15 before = e;
        dqw_rows_q15 rows;
        dqw_estimator_rows_of_q15(&e, &b, &rows);
        const bool done = dqw_estimator_learn_q15(&e, &b);
        excited(&before, &rows);
        uint32_t mask[2] = {0, 0};
        for (int i = 0; i < N; i++)
            for (int a = 0; a < 2; a++)
                if (teaches(a, i) && rows.x_q28[a][i] != 0) mask[a] |= 1u << i;
        if (e.excess_q10[DQW_R] <= 0) mask[0] = mask[1] = 0;
        CASE("block %d", k);
        HOLDS(done == ((mask[0] | mask[1]) != 0));
        if (!done) {
            TEST_ASSERT_EQUAL_MEMORY(before.w_q24, e.w_q24, sizeof e.w_q24);
            TEST_ASSERT_EQUAL_MEMORY(&before.normal, &e.normal, sizeof e.normal);
            HOLDS(e.blocks == before.blocks && e.gate.blocks == before.gate.blocks);
            continue;
        }
        ++*learned;
        if (config.noise_on_inputs) alike(answered(&b), e.answered_q15 / 32768.0, 0.02, "answered");
        HOLDS(e.blocks == before.blocks + 1 && e.gate.blocks == before.gate.blocks + 1);
        const double v[2] = {fmax((double)before.error_q56[0] / Q56, 1e-8),
                             fmax((double)before.error_q56[1] / Q56, 1e-8)};
        double by[2] = {1, 1};
        for (int a = 0; a < 2 && e.blocks > 50; a++) by[a] = fmin(64, (v[0] + v[1]) / 2 / v[a]);
        // Both rows to the sums; the late voltage behind them.
        test_ls s;
        ls_begin(&s, N, 0);
        double late_x[N] = {0};
        double late_late = (double)before.normal.a_q32[DQW_NORMAL_A(N, N)] / Q32;
        double late_error = (double)before.normal.b_q32[N] / Q32;
        double C[N][N] = {{0}};
        double w[N];
        double error[2];
        for (int i = 0; i < N; i++) {
            w[i] = before.w_q24[i] / Q24;
            s.b[i] = (double)before.normal.b_q32[i] / Q32;
            late_x[i] = (double)before.normal.a_q32[DQW_NORMAL_A(i, N)] / Q32;
            for (int j = 0; j < N; j++)
                s.a[i][j] = (double)before.normal.a_q32[i < j ? DQW_NORMAL_A(i, j) : DQW_NORMAL_A(j, i)] / Q32;
        }
        for (int a = 0; a < 2; a++) {
            const double weigh = sqrt(by[a]);
            double x[N];
            error[a] = rows.y_q28[a] / Q28;
            for (int i = 0; i < N; i++) {
                error[a] -= rows.x_q28[a][i] / Q28 * w[i];
                x[i] = (mask[a] >> i & 1u) != 0 ? rows.x_q28[a][i] / Q28 * weigh : 0;
            }
            alike(error[a], e.e_q28[a] / Q28, 4e-8, "error");
            ls_add(&s, x, error[a] * weigh);
            const double u = rows.late_q28[a] / Q28 * weigh;
            for (int i = 0; i < N; i++) late_x[i] += x[i] * u;
            late_late += u * u;
            late_error += u * error[a] * weigh;
            // (E60)
            const int cross = a == 0 ? DQW_LQ : DQW_LD;
            const int flux = a == 0 ? DQW_PSI_Q : DQW_PSI;
            const double q56 = by[a] / Q56;
            for (int i = 0; i < N; i++)
                if ((mask[a] >> i & 1u) != 0) C[i][i] += (double)rows.noise_q56[a][i] * q56;
            C[DQW_R][DQW_DEAD_TIME] += (double)rows.noise_q56[a][DQW_NOISE_Q15_DEAD_IN_R] * q56;
            C[DQW_DEAD_TIME][DQW_R] += (double)rows.noise_q56[a][DQW_NOISE_Q15_R_IN_DEAD] * q56;
            if ((mask[a] >> cross & mask[a] >> flux & 1u) == 0) continue;
            C[cross][flux] += (double)rows.noise_q56[a][DQW_NOISE_Q15_SPEED] * q56;
            C[flux][cross] += (double)rows.noise_q56[a][DQW_NOISE_Q15_SPEED] * q56;
        }
        bool much = !config.noise_on_inputs;
        for (int i = 0; i < N; i++) much = much || C[i][i] * (double)before.cov_q40[i] / Q40 > 0.05;
        for (int i = 0; i < N && !much; i++)
            for (int j = 0; j < N; j++) s.b[i] += C[i][j] * w[j];
        double move[N];
        double inverse[LS_MAX][LS_MAX];
        (void)ls_solve(&s, move, inverse);
        // Sums that are nearly empty say next to nothing in their last places.
        const bool young = before.blocks < 30;
        for (int i = 0; i < N; i++) {
            late_error -= late_x[i] * move[i];
            CASE("block %d, weight %d", k, i);
            const double sd = sqrt(inverse[i][i]);
            if (!young) {
                alike(w[i] + move[i], e.w_q24[i] / Q24, 2e-3 * fabs(move[i]) + 1e-6, "weight");
                alike(sd, sqrt((double)e.cov_q40[i] / Q40), 1e-3 * sd, "deviation");
            }
            const double few = (double)dqw_estimator_start_cov_q40(&e, &rows.unit, i) / 100;
            if (fabs((double)e.cov_q40[i] / few - 1) > 0.01)
                HOLDS((e.learned >> i & 1u) == ((double)e.cov_q40[i] < few || (before.learned >> i & 1u) != 0));
        }
        CASE("block %d", k);
        alike(late_late, (double)e.normal.a_q32[DQW_NORMAL_A(N, N)] / Q32, 1e-6 * late_late + 2 / Q32, "late voltage");
        if (!young)
            alike(late_error, (double)e.normal.b_q32[N] / Q32, 1e-3 * fabs(late_error) + 1e-5,
                  "late voltage's gradient");
        // Before the correction and after it, by what it came to.
        const double part = fmax(2.0 / (e.blocks + 1), 0.001);
        double after[2];
        double both = 0;
        for (int a = 0; a < 2; a++) {
            after[a] = rows.y_q28[a] / Q28;
            for (int i = 0; i < N; i++) after[a] -= rows.x_q28[a][i] / Q28 * e.w_q24[i] / Q24;
            const double was = (double)before.error_q56[a] / Q56;
            const double now = was + (error[a] * after[a] - was) * part;
            alike(now, (double)e.error_q56[a] / Q56, 1e-4 * fabs(now) + 1e-9, "residual");
            both += error[a] * error[a];
        }
        const double recent = (double)before.recent_q54 / Q54;
        alike(recent + (both - recent) / 64, (double)e.recent_q54 / Q54, 1e-5 * recent + 1e-9, "recent residual");
        for (int i = 0; i < SCORES; i++) {
            double score = 0;
            for (int a = 0; a < 2; a++)
                if ((mask[a] >> i & 1u) != 0) score += rows.x_q28[a][i] / Q28 * after[a] * by[a];
            const double was2 = (double)before.score2_q68[i] / Q68;
            const double was = (double)before.score_lag_q68[i] / Q68;
            const double last = before.score_last_q34[i] / Q34;
            alike(score, e.score_last_q34[i] / Q34, 1e-3 * fabs(score) + 1e-8, "last score");
            alike(was2 + (score * score - was2) * part, (double)e.score2_q68[i] / Q68, 2e-3 * was2 + 1e-12, "score");
            alike(was + (score * last - was) * part, (double)e.score_lag_q68[i] / Q68, 2e-3 * was2 + 1e-12,
                  "score by the last one");
        }
        published(&before, &b);
    }
}

static void test_a_block_is_the_equations(void)
{
    test_random r = {740};
    int learned = 0;
    for (int way = 0; way < 4; way++) {
        begin();
        if (way == 1) config.excitation_q15 = 6554;
        if (way == 2) config.noise_on_inputs = false, config.dead_time_width_mA = 600;
        if (way == 3) config.dead_time_width_mA = 20;
        start();
        shown(400, &r, &learned);
    }
    CASE("%d learned", learned);
    HOLDS(learned > 800 && learned < 1570);
}

// Before its noise was measured a block teaches nothing, and shortly after a change of legs.
static void test_what_is_not_learned(void)
{
    test_random r = {741};
    int learned = 0;
    begin(), start();
    shown(34, &r, &learned);
    const dqw_estimator_q15 before = e;
    dqw_estimator_q15_block b = drawn(&r, 1, 0.1);
    b.with.rows = DQW_NOISE_ROWS - 1;
    HOLDS(!dqw_estimator_learn_q15(&e, &b) && e.blocks == before.blocks);
    e.mixed = 2;
    b.with.rows = DQW_NOISE_ROWS;
    const dqw_estimator_q15 mixed = e;
    HOLDS(!dqw_estimator_learn_q15(&e, &b) && !dqw_estimator_learn_q15(&e, &b) && e.mixed == 0);
    TEST_ASSERT_EQUAL_MEMORY(mixed.excess_q10, e.excess_q10, sizeof e.excess_q10);
    HOLDS(dqw_estimator_learn_q15(&e, &b) && e.blocks == before.blocks + 1);
}

// A settled row stands for itself: it teaches a weight where its input is the part of the whole that teaches.
static void test_what_a_settled_row_teaches(void)
{
    for (int own = 0; own < 2; own++)
        for (int i = 0; i < 2; i++)
            for (int k = -2; k <= 2; k++) {
                begin();
                config.settled = true, config.noise_on_inputs = config.encoder_offset = false;
                config.dead_time_width_mA = 0, config.modulation = DQW_MODULATION_CENTRED;
                config.excitation_q15 = own ? 2000 : 0;
                start();
                dqw_estimator_q15_block b;
                memset(&b, 0, sizeof b);
                b.weight = 1, b.whole = true;
                const double part = own ? 2000 / 32768.0 : SETTLED_PART;
                // A current alone teaches R, a speed alone the flux.
                const double x = part * (1 + 0.02 * k);
                if (i == 0) b.sums[3] = -rounded(2 * x * 32768);
                if (i == 1) b.sums[8] = rounded(2 * x * 32768);
                b.sums[1] = 1000;
                const int weight = i == 0 ? DQW_R : DQW_PSI;
                const int64_t before = e.normal.a_q32[DQW_NORMAL_A(weight, weight)];
                e.number = 1, e.elapsed = 1;
                const bool done = dqw_estimator_learn_q15(&e, &b);
                CASE("own %d, weight %d, %g of what teaches", own, weight, 1 + 0.02 * k);
                if (k == 0) continue;
                HOLDS(done == (k > 0));
                HOLDS((e.normal.a_q32[DQW_NORMAL_A(weight, weight)] != before) == (k > 0));
            }
}

// Where noise is more than a twentieth of what a weight was learned by, its gradient is left alone; below, C w is put
// back, weight by weight. (E60)
static void test_noise_is_taken_out_where_it_is_little(void)
{
    begin();
    for (int i = 0; i < N; i++)
        for (int high = 0; high < 2; high++) {
            start();
            static dqw_rows_q15 r;
            memset(&r, 0, sizeof r);
            // 1e-4 of an input's square, so a covariance of 500 is the bound: one per cent from it
            r.noise_q56[0][i] = llrint(1e-4 * Q56);
            const uint32_t mask[2] = {1u << i, 0};
            const int64_t by_q24[2] = {(int64_t)Q24, (int64_t)Q24};
            e.cov_q40[i] = llrint(500 * (high ? 1.01 : 0.99) * Q40);
            e.w_q24[i] = (int32_t)lrint(0.7 * Q24);
            const int64_t before = e.normal.b_q32[i];
            dqw_estimator_take_noise_out_q15(&e, &r, by_q24, mask);
            CASE("weight %d, %s the bound", i, high ? "above" : "below");
            BETWEEN(high ? 0 : 0.999 * 0.7e-4, (double)(e.normal.b_q32[i] - before) / Q32, high ? 0 : 1.001 * 0.7e-4);
        }
}

// C w of both axes: each input's own, the two terms that dead time shares with R, and the two that the flux shares with
// the inductance across, which have the speed in common.
static void test_what_noise_took_is_put_back(void)
{
    test_random r = {734};
    begin();
    for (int k = 0; k < 200; k++) {
        start();
        static dqw_rows_q15 rows;
        memset(&rows, 0, sizeof rows);
        const uint32_t mask[2] = {(uint32_t)random_bits(&r) & 0x7fu, (uint32_t)random_bits(&r) & 0x7fu};
        int64_t by_q24[2];
        double noise[2][DQW_NOISE_Q15_COVARIANCES];
        double expected[N] = {0};
        double w[N];
        for (int i = 0; i < N; i++) {
            e.w_q24[i] = (int32_t)lrint(random_uniform(&r, -1, 2) * Q24);
            w[i] = e.w_q24[i] / Q24;
            e.cov_q40[i] = llrint(Q40);
        }
        for (int a = 0; a < 2; a++) {
            by_q24[a] = llrint(random_uniform(&r, 0.5, 2) * Q24);
            for (int i = 0; i < (int)DQW_NOISE_Q15_COVARIANCES; i++) {
                rows.noise_q56[a][i] = llrint(random_uniform(&r, -1e-4, 1e-4) * Q56);
                noise[a][i] = (double)rows.noise_q56[a][i] / Q56 * (double)by_q24[a] / Q24;
            }
            for (int i = 0; i < N; i++)
                if ((mask[a] >> i & 1u) != 0) expected[i] += noise[a][i] * w[i];
            const int L = a == 0 ? DQW_LQ : DQW_LD;
            const int flux = a == 0 ? DQW_PSI_Q : DQW_PSI;
            expected[DQW_R] += noise[a][DQW_NOISE_Q15_DEAD_IN_R] * w[DQW_DEAD_TIME];
            expected[DQW_DEAD_TIME] += noise[a][DQW_NOISE_Q15_R_IN_DEAD] * w[DQW_R];
            if ((mask[a] >> L & mask[a] >> flux & 1u) == 0) continue;
            expected[L] += noise[a][DQW_NOISE_Q15_SPEED] * w[flux];
            expected[flux] += noise[a][DQW_NOISE_Q15_SPEED] * w[L];
        }
        const dqw_estimator_q15 before = e;
        dqw_estimator_take_noise_out_q15(&e, &rows, by_q24, mask);
        double explained = 0;
        for (int i = 0; i < N; i++) {
            CASE("sample %d, weight %d", k, i);
            alike(expected[i], (double)(e.normal.b_q32[i] - before.normal.b_q32[i]) / Q32, 2e-8, "gradient");
            explained += fabs(expected[i] * w[i]);
        }
        alike(explained, (double)(e.normal.c_q32 - before.normal.c_q32) / Q32, 2e-8, "target");
    }
}

// After fifty blocks stage 2 ends. What is by more than a half off its start then, either way, had its part in them, and
// all begins anew; a weight that nothing has taught had none, wherever it stands. (E93)
static void test_where_stage_three_begins(void)
{
    begin();
    config.dead_time_width_mA = 0;
    config.noise_on_inputs = config.encoder_offset = false;
    for (int blocks = 48; blocks < 50; blocks++)
        for (int i = DQW_LD; i <= DQW_PSI; i++)
            for (int way = 0; way < 6; way++) {
                static const double by[] = {2, 0.5, 1.25};
                const bool taught = way < 3;
                const double of = by[way % 3];
                start();
                e.stage.name = DQW_STAGE_RANDOM;
                e.blocks = (uint16_t)blocks;
                e.excess_q10[DQW_R] = 8191;
                e.w_q24[i] = (int32_t)lrint(of * e.w_q24[i]);
                if (taught) e.learned |= 1u << i;
                // Currents alone: what they teach is R.
                dqw_estimator_q15_block b = {.weight = 420};
                b.sums[2] = b.sums[0] = 3000 * 420;
                const int32_t w_q24 = e.w_q24[i];
                CASE("%d blocks, weight %d by %g, taught %d", blocks, i, of, taught);
                HOLDS(dqw_estimator_learn_q15(&e, &b));
                const bool anew = blocks == 49 && taught && of != 1.25;
                TEST_ASSERT_EQUAL_INT_MESSAGE(anew ? 0 : blocks + 1, e.blocks, test_case);
                HOLDS((e.stage.name == DQW_STAGE_ORDINAL) == (blocks == 49));
                BETWEEN(-2, (double)e.w_q24[i] - w_q24, 2);
            }
}

// A score has its weight: none is kept behind the last one.
static void test_scores_are_of_weights(void)
{
    test_random r = {742};
    begin(), start();
    for (int k = 0; k < 20; k++) {
        for (int i = SCORES; i < (int)DQW_ESTIMATOR_Q15_SCORES; i++) e.score2_q68[i] = e.score_lag_q68[i] = 1000000;
        const dqw_estimator_q15_block b = drawn(&r, 1, 0.1);
        const int blocks = e.blocks;
        (void)dqw_estimator_learn_q15(&e, &b);
        for (int i = SCORES; i < (int)DQW_ESTIMATOR_Q15_SCORES; i++)
            HOLDS(e.score2_q68[i] == 1000000 && e.score_lag_q68[i] == 1000000);
        HOLDS(k < 10 || e.blocks == blocks + 1);
    }
}

// What runs away begins anew, and is counted as far as there is room.
static void test_a_weight_beyond_all_bounds(void)
{
    begin();
    config.dead_time_width_mA = 0;
    config.noise_on_inputs = config.encoder_offset = false;
    for (int restarts = 253; restarts <= 255; restarts++)
        for (int way = -1; way <= 1; way++) {
            start();
            e.restarts = (uint8_t)restarts;
            e.blocks = 100;
            e.excess_q10[DQW_R] = 8191;
            if (way != 0) e.w_q24[DQW_PSI] = way * ((int32_t)1 << 30);
            dqw_estimator_q15_block b = {.weight = 420};
            b.sums[2] = b.sums[0] = 3000 * 420;
            CASE("%d restarts, way %d", restarts, way);
            HOLDS(dqw_estimator_learn_q15(&e, &b) == (way == 0));
            HOLDS(e.restarts == (way != 0 && restarts < 255 ? restarts + 1 : restarts));
            HOLDS(e.blocks == (way == 0 ? 101 : 0));
        }
}

// Which legs switch is sought from the 800th block on; what comes before is learned. (E102)
static void test_when_a_search_begins(void)
{
    begin();
    config.modulation = DQW_MODULATION_UNKNOWN;
    config.noise_on_inputs = false;
    for (int blocks = 797; blocks < 801; blocks++) {
        start();
        e.blocks = (uint16_t)blocks;
        e.excess_q10[DQW_R] = 8191;
        dqw_estimator_q15_block b = {.weight = 420};
        b.sums[2] = b.sums[0] = 20000 * 420;
        CASE("%d blocks", blocks);
        HOLDS(dqw_estimator_learn_q15(&e, &b) == (blocks + 1 < 800));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_block_is_the_equations);
    RUN_TEST(test_what_is_not_learned);
    RUN_TEST(test_what_a_settled_row_teaches);
    RUN_TEST(test_noise_is_taken_out_where_it_is_little);
    RUN_TEST(test_what_noise_took_is_put_back);
    RUN_TEST(test_where_stage_three_begins);
    RUN_TEST(test_scores_are_of_weights);
    RUN_TEST(test_a_weight_beyond_all_bounds);
    RUN_TEST(test_when_a_search_begins);
    return UNITY_END();
}
