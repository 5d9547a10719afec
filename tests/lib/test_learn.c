// One block through the joint neuron against the equations in double, from the state before it: what is excited, both
// rows, the noise of their inputs, statistics, and what is handed back to the interrupt.
#include "dqw_estimator_block.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

enum { N = DQW_PARAMETERS, SCORES = 4 };

static dqw_estimator_config config;
static dqw_estimator e;

static void begin(void)
{
    static const dqw_estimator_config given = {.dt_s = 1e-4f,
                                               .v_base_V = 24.0f,
                                               .i_base_A = 7.0f,
                                               .w_base_rad_s = 300.0f,
                                               .R_ohm = 0.4f,
                                               .Ld_H = 1.1e-3f,
                                               .Lq_H = 1.7e-3f,
                                               .psi_Wb = 0.015f,
                                               .half_window = 20,
                                               .pole_pairs = 5,
                                               .dead_time_width_A = 0.1f,
                                               .angle = true,
                                               .encoder_offset = true,
                                               .modulation = DQW_MODULATION_CLAMPED_LOW,
                                               .noise_on_inputs = true};
    config = given;
}

static void start(void)
{
    memset(&e, 0, sizeof e);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&e, &config));
    e.stage.name = DQW_STAGE_ORDINAL;
}

// A machine a little off its nominal values; currents and speed of this part of the bases.
static dqw_estimator_block drawn(test_random *r, double size, double noise_V)
{
    static const double truth[] = {0.45, 1.0e-3, 1.8e-3, 0.014, 6, 0.0004, 1.5};
    dqw_estimator_block b;
    memset(&b, 0, sizeof b);
    b.whole = random_bits(r) % 8 != 0;
    b.dead_slope_inv_A = (float)random_uniform(r, 0.1, 2);
    b.noise = (dqw_noise_variances){.i_d_A2 = (float)(3e-3 * random_uniform(r, 0.1, 4)),
                                    .i_q_A2 = (float)(3e-3 * random_uniform(r, 0.1, 4)),
                                    .w_rad2_s2 = (float)random_uniform(r, 5, 50),
                                    .rows = 5000};
    b.noise.answer_A2 = b.noise.i_d_A2 * (float)random_uniform(r, -3, 3);
    for (int a = 0; a < 2; a++) {
        b.sum[2 + a] = (float)(size * random_uniform(r, -10, 10));
        b.sum[4 + a] = (float)(size * random_uniform(r, -0.3, 0.3));
        b.sum[6 + a] = (float)(size * random_uniform(r, -2000, 2000));
        b.sum[9 + a] = (float)(size * random_uniform(r, -2, 2));
        b.sum[11 + a] = (float)(size * random_uniform(r, -2, 2));
        b.v_step_V[a] = (float)random_uniform(r, -400, 400);
    }
    b.sum[8] = (float)(size * random_uniform(r, -500, 500));
    dqw_estimator_rows rows;
    dqw_estimator_rows_of(&e, &b, &rows);
    for (int a = 0; a < 2; a++) {
        double v = noise_V * random_normal(r);
        for (int i = 0; i < N; i++)
            v += (double)rows.x[a][i] * truth[i] / (double)dqw_estimator_unit(&e, i) * (double)config.v_base_V;
        b.sum[a] = (float)v;
    }
    return b;
}

typedef struct state {
    double w[N], P[N][N], error2[2], recent2, score2[SCORES], lag[SCORES], last[SCORES];
    double late_w[N], late2, late_error;
} state;

static state state_of(void)
{
    state s;
    memset(&s, 0, sizeof s);
    for (int i = 0; i < N; i++) {
        s.w[i] = (double)e.w_pu[i];
        s.late_w[i] = (double)e.late_w[i];
        for (int j = 0; j < N; j++) s.P[i][j] = (double)dqw_gain_covariance(&e.gain, i, j);
    }
    for (int k = 0; k < SCORES; k++) {
        s.score2[k] = (double)e.score2[k], s.lag[k] = (double)e.score_lag[k];
        s.last[k] = (double)e.score_last[k];
    }
    for (int a = 0; a < 2; a++) s.error2[a] = (double)e.error_pu2[a];
    s.recent2 = (double)e.recent_pu2;
    s.late2 = (double)e.late_pu2, s.late_error = (double)e.late_error_pu2;
    return s;
}

// (E17), (E61), (E90): one axis' row.
static void row_of(state *s, const dqw_estimator_rows *r, int axis, uint32_t mask, double weigh, bool late, double part,
                   double score[])
{
    double x[N];
    double Px[N];
    double known = 0;
    double error = (double)r->y[axis];
    double rest = (double)r->late[axis] * weigh;
    for (int i = 0; i < N; i++) {
        error -= s->w[i] * (double)r->x[axis][i];
        x[i] = (mask >> i & 1u) != 0 ? (double)r->x[axis][i] * weigh : 0;
        rest -= s->late_w[i] * x[i];
    }
    for (int i = 0; i < N; i++) {
        Px[i] = 0;
        for (int j = 0; j < N; j++) Px[i] += s->P[i][j] * x[j];
    }
    for (int i = 0; i < N; i++) known += x[i] * Px[i];
    const double left = 1 / (1 + known);
    for (int i = 0; i < N; i++) {
        s->w[i] += Px[i] * left * error * weigh;
        if (late) s->late_w[i] += Px[i] * left * rest;
        for (int j = 0; j < N; j++) s->P[i][j] -= Px[i] * Px[j] * left;
    }
    for (int i = 0; i < SCORES; i++) score[i] += x[i] * error * left * weigh;
    s->error2[axis] += (error * error * left - s->error2[axis]) * part;
    s->recent2 += error * error / 64;
    if (!late) return;
    s->late2 += (rest * rest * left - s->late2) * part;
    s->late_error += (error * weigh * rest * left - s->late_error) * part;
}

// (E60): w += P C w, unless C is much of what is known.
static void noise_out(state *s, const dqw_estimator_rows *r, const double ratio[2], const uint32_t mask[2])
{
    double C[N][N] = {{0}};
    for (int a = 0; a < 2; a++) {
        const int cross = a == 0 ? DQW_LQ : DQW_LD;
        const int flux = a == 0 ? DQW_PSI_Q : DQW_PSI;
        for (int i = 0; i < N; i++)
            if ((mask[a] >> i & 1u) != 0) C[i][i] += (double)r->var[a][i] / ratio[a];
        C[DQW_R][DQW_DEAD_TIME] += (double)r->dead_in_R[a] / ratio[a];
        C[DQW_DEAD_TIME][DQW_R] += (double)r->R_in_dead[a] / ratio[a];
        if ((mask[a] >> cross & mask[a] >> flux & 1u) == 0) continue;
        C[cross][flux] += (double)r->speed[a] / ratio[a];
        C[flux][cross] += (double)r->speed[a] / ratio[a];
    }
    for (int i = 0; i < N; i++)
        if (C[i][i] * s->P[i][i] > 0.05) return;
    double z[N];
    for (int i = 0; i < N; i++) {
        z[i] = 0;
        for (int j = 0; j < N; j++) z[i] += C[i][j] * s->w[j];
    }
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) s->w[i] += s->P[i][j] * z[j];
}

// (E19): the mean over 32 blocks of an input's power above what teaches, over that; Q10 cut off.
static void excited(const dqw_estimator *before, const dqw_estimator_rows *r)
{
    const double least = config.excitation_pu > 0 ? (double)config.excitation_pu : 0.01;
    for (int i = 0; i < N; i++) {
        double need = least * least + 3 * (double)(r->var[0][i] + r->var[1][i]);
        const double widths = (double)(config.dead_time_width_A / config.i_base_A);
        if (i == DQW_R) need += 16 * widths * widths;
        const double power = pow((double)r->x[0][i], 2) + pow((double)r->x[1][i], 2);
        const double excess = fmin(power / need, 8) - 1;
        const double mean = before->excess_q10[i] / 1024.0;
        const double expected = (mean + (excess - mean) / 32) * 1024;
        CASE("input %d is excited by %g", i, expected);
        BETWEEN(expected - 1.01, e.excess_q10[i], expected + 1.01);
    }
    for (int a = 0; a < 2; a++)
        for (int L = 0; L < 2; L++) {
            const double noise = 2 * (double)r->var[a][DQW_LD + L];
            const double excess = fmin(pow((double)r->x[a][DQW_LD + L], 2) / noise, 8) - 1;
            const double expected = (31 * before->above_q10[L][a] + 1024 * excess) / 32;
            CASE("axis %d, L %d, above its noise by %g", a, L, expected);
            BETWEEN(expected - 1.01, e.above_q10[L][a], expected + 1.01);
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

// (E189): the part of noise in a block's slope that a first-order loop answers, which the library takes to 0.02.
static double answered(double answer, double variance, double half)
{
    const double a = fabs(answer) / (3 * variance) * half;
    return a > 0 ? 1 - (1.5 - 2 * exp(-a) + 0.5 * exp(-2 * a)) / a : 0;
}

static void alike(double expected, double value, double room, const char *what)
{
    test_between(expected - room, value, expected + room, what, __LINE__);
}

// What the interrupt takes: dt/L where that is known to a fifth, and (E60)'s 0.7 sd/w, 4 at most.
static void published(const dqw_estimator *before, const dqw_estimator_block *b)
{
    HOLDS(e.given_ready);
    bool anew = before->given_ready && before->given.noise_anew;
    for (int a = 0; a < 2; a++) {
        const double L_H = (double)dqw_estimator_value(&e, DQW_LD + a);
        const double last = (double)before->given.step_A_per_V[a];
        double step = last;
        if ((double)dqw_estimator_noise_sd(&e, DQW_LD + a) < 0.2 * L_H) step = (double)config.dt_s / L_H;
        anew = anew || step > 1.25 * last || last > 1.25 * step;
        alike(step, (double)e.given.step_A_per_V[a], 1e-6 * step, "step");
    }
    HOLDS(e.given.noise_anew == anew);
    const double sd = sqrt((double)(b->noise.i_d_A2 + b->noise.i_q_A2) / 2);
    const double width = (double)config.dead_time_width_A;
    alike(fmin(0.7 * sd / width, 4), (double)e.given.lead, 1e-6, "lead");
}

static void shown(int blocks, test_random *r, int *learned)
{
    for (int k = 0; k < blocks; k++) {
        CASE("block %d", k);
        // A drive that rests now and then: what is excited ends one after the other.
        const double size = k % 200 < 90 ? 1 : pow(10, random_uniform(r, -4, -1));
        const dqw_estimator_block b = drawn(r, size, k % 2 ? 0.1 : 0.3);
        if (k == 300) e.blocks = 5000;
        e.number = (uint32_t)k, e.elapsed = 1;
        e.across = 0;
        if (k % 9 == 0) e.given_ready = k % 2, e.given.noise_anew = k % 4 == 0;
        const dqw_estimator before = e;
        dqw_estimator_rows rows;
        dqw_estimator_rows_of(&e, &b, &rows);
        state s = state_of();
        const bool done = dqw_estimator_learn(&e, &b);
        excited(&before, &rows);
        uint32_t mask[2] = {0, 0};
        for (int i = 0; i < N; i++)
            for (int a = 0; a < 2; a++)
                if (teaches(a, i) && rows.x[a][i] != 0) mask[a] |= 1u << i;
        if (e.excess_q10[DQW_R] <= 0) mask[0] = mask[1] = 0;
        CASE("block %d", k);
        HOLDS(done == ((mask[0] | mask[1]) != 0));
        if (!done) {
            TEST_ASSERT_EQUAL_MEMORY(before.w_pu, e.w_pu, sizeof e.w_pu);
            TEST_ASSERT_EQUAL_MEMORY(&before.gain, &e.gain, sizeof e.gain);
            HOLDS(e.blocks == before.blocks && e.gate.blocks == before.gate.blocks);
            continue;
        }
        ++*learned;
        HOLDS(e.blocks == before.blocks + 1 && e.gate.blocks == before.gate.blocks + 1);
        const double part = fmax(2.0 / (e.blocks + 1), 0.001);
        const double floor2 = 1e-8;
        const double v[2] = {fmax(s.error2[0], floor2), fmax(s.error2[1], floor2)};
        double ratio[2] = {1, 1};
        for (int a = 0; a < 2 && e.blocks > 50; a++) ratio[a] = v[a] / ((v[0] + v[1]) / 2);
        double score[SCORES] = {0};
        const double start2[N] = {9e4, 9e4, 9e4, 9e4, 100, 9e4, 100};
        s.recent2 -= s.recent2 / 64;
        for (int a = 0; a < 2; a++) row_of(&s, &rows, a, mask[a], 1 / sqrt(ratio[a]), b.whole, part, score);
        if (config.noise_on_inputs) {
            noise_out(&s, &rows, ratio, mask);
            alike(answered((double)b.noise.answer_A2, (double)b.noise.i_d_A2, e.window.half), (double)e.answered, 0.02,
                  "answered");
        }
        for (int i = 0; i < SCORES; i++) {
            s.score2[i] += (score[i] * score[i] - s.score2[i]) * part;
            s.lag[i] += (score[i] * s.last[i] - s.lag[i]) * part;
            alike(s.score2[i], (double)e.score2[i], 1e-3 * s.score2[i] + 1e-9, "score");
            alike(s.lag[i], (double)e.score_lag[i], 1e-3 * s.score2[i] + 1e-9, "score by the last one");
            alike(score[i], (double)e.score_last[i], 1e-3 * sqrt(s.score2[i]) + 1e-6, "last score");
        }
        const bool young = before.blocks < 20;
        for (int i = 0; i < N; i++) {
            CASE("block %d, weight %d", k, i);
            const double sd = sqrt(s.P[i][i]);
            const double moved = fabs(s.w[i] - (double)before.w_pu[i]);
            if (!young) alike(s.w[i], (double)e.w_pu[i], 1e-6 * fabs(s.w[i]) + 2e-3 * moved + 1e-7, "weight");
            alike(sd, sqrt((double)dqw_gain_covariance(&e.gain, i, i)), (young ? 0.05 : 1e-3) * sd, "deviation");
            alike(s.late_w[i], (double)e.late_w[i], 1e-3 * fabs(s.late_w[i]) + 1e-3, "late voltage's weight");
            const bool known = s.P[i][i] < 0.01 * start2[i];
            if (fabs(s.P[i][i] / (0.01 * start2[i]) - 1) > 0.01)
                HOLDS((e.learned >> i & 1u) == (known || (before.learned >> i & 1u) != 0));
        }
        CASE("block %d", k);
        for (int a = 0; a < 2; a++)
            alike(s.error2[a], (double)e.error_pu2[a], (young ? 1e-2 : 1e-3) * s.error2[a] + 1e-9, "residual");
        alike(s.recent2, (double)e.recent_pu2, (young ? 1e-2 : 1e-3) * s.recent2 + 1e-9, "recent residual");
        alike(s.late2, (double)e.late_pu2, 2e-3 * s.late2 + 1e-9, "late voltage");
        alike(s.late_error, (double)e.late_error_pu2, 2e-3 * sqrt(s.late2 * s.error2[0]) + 1e-6, "late by");
        published(&before, &b);
    }
}

static void test_a_block_is_the_equations(void)
{
    test_random r = {740};
    int learned = 0;
    for (int way = 0; way < 4; way++) {
        begin();
        if (way == 1) config.excitation_pu = 0.2f;
        if (way == 2) config.noise_on_inputs = false, config.dead_time_width_A = 0.6f;
        if (way == 3) config.dead_time_width_A = 0.02f;
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
    const dqw_estimator before = e;
    dqw_estimator_block b = drawn(&r, 1, 0.1);
    b.noise.rows = DQW_NOISE_ROWS - 1;
    HOLDS(!dqw_estimator_learn(&e, &b) && e.blocks == before.blocks);
    e.mixed = 2;
    b.noise.rows = DQW_NOISE_ROWS;
    const dqw_estimator mixed = e;
    HOLDS(!dqw_estimator_learn(&e, &b) && !dqw_estimator_learn(&e, &b) && e.mixed == 0);
    TEST_ASSERT_EQUAL_MEMORY(mixed.excess_q10, e.excess_q10, sizeof e.excess_q10);
    HOLDS(dqw_estimator_learn(&e, &b) && e.blocks == before.blocks + 1);
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
        dqw_estimator_block b = {.whole = true};
        b.sum[2] = b.sum[0] = 8.0f;
        CASE("%d blocks", blocks);
        HOLDS(dqw_estimator_learn(&e, &b) == (blocks + 1 < 800));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_block_is_the_equations);
    RUN_TEST(test_what_is_not_learned);
    RUN_TEST(test_when_a_search_begins);
    return UNITY_END();
}
