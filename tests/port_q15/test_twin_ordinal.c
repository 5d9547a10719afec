// The fixed-point Ordinal Learner beside the float one, epoch by epoch: weights, R in both readings, convergence, gaps,
// refusals.
#include "dqw_log_q15.h"
#include "dqw_ordinal.h"
#include "dqw_ordinal_q15.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

// The paper's machine at its sampling period, and full scales with which a period of full voltage is 0.19 of the full
// current.
#define TRUE_R_OHM 0.37
#define TRUE_L_H 0.326e-3
#define T_S 1e-4
#define X_FULL_V 5.0
#define Y_FULL_A 10.0
enum { SAMPLES = 301 };

static int16_t x_q15[SAMPLES], y_q15[SAMPLES];

static int16_t q15(double x) { return (int16_t)lrint(fmax(-32767.0, fmin(32767.0, 32768 * x))); }

// +-2 V drawn anew every few ms, held from sample to sample: the current is exact but for its rounding and the noise,
// in parts of 5 A.
static void make_signals(uint64_t seed, double noise)
{
    test_random r = {seed};
    const double a = exp(-TRUE_R_OHM * T_S / TRUE_L_H);
    double y = 0.0;
    double x = 0.0;
    for (int k = 0; k < SAMPLES; k++) {
        if (k % 20 == 0) x = random_bits(&r) & 1u ? 2.0 : -2.0;
        x_q15[k] = q15(x / X_FULL_V);
        y_q15[k] = q15((y + noise * 5.0 * random_normal(&r)) / Y_FULL_A);
        y = a * y + (1 - a) / TRUE_R_OHM * (x_q15[k] * X_FULL_V / 32768);
    }
}

typedef struct twins {
    dqw_ordinal f;
    dqw_ordinal_q15 q;
} twins;

static twins begin(int form, int discretisation, double R_start, double L_start)
{
    const dqw_ordinal_config c = {.dt_s = (float)T_S,
                                  .x_base = (float)X_FULL_V,
                                  .y_base = (float)Y_FULL_A,
                                  .R_ohm = (float)(1e-6 * (double)lrint(1e6 * R_start)),
                                  .L_H = (float)(1e-9 * (double)lrint(1e9 * L_start)),
                                  .form = (enum dqw_ordinal_form)form,
                                  .discretisation = (enum dqw_ordinal_discretisation)discretisation};
    const dqw_ordinal_config_q15 d = {.dt_ns = 100000,
                                      .x_full_mV = 5000,
                                      .y_full_mA = 10000,
                                      .R_uohm = (uint32_t)lrint(1e6 * R_start),
                                      .L_nH = (uint32_t)lrint(1e9 * L_start),
                                      .form = (enum dqw_ordinal_form_q15)form,
                                      .discretisation = (enum dqw_ordinal_discretisation_q15)discretisation};
    twins t;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_ordinal_init(&t.f, &c));
    HOLDS(dqw_ordinal_init_q15(&t.q, &d) == DQW_OK);
    return t;
}

static double a_of(const twins *t) { return t->q.a_q31 / 2147483648.0; }
static double b_of(const twins *t) { return t->q.b_q27 / 134217728.0; }
static double R_x(const twins *t) { return dqw_ordinal_R_from_x_q15(&t->q, 326000) * 1e-6; }
static double R_y(const twins *t) { return dqw_ordinal_R_from_y_q15(&t->q, 326000) * 1e-6; }

// One epoch of both.
static void epoch(twins *t, int samples)
{
    for (int k = 0; k < samples; k++) {
        dqw_ordinal_step(&t->f, (float)(x_q15[k] * X_FULL_V / 32768), (float)(y_q15[k] * Y_FULL_A / 32768));
        dqw_ordinal_step_q15(&t->q, x_q15[k], y_q15[k]);
    }
    const bool a = dqw_ordinal_end_epoch(&t->f);
    const bool b = dqw_ordinal_end_epoch_q15(&t->q);
    HOLDS(a == b && t->f.from_pairs == t->q.from_pairs);
    HOLDS(t->f.epochs == t->q.epochs && t->f.learned == t->q.learned && t->f.skipped == t->q.skipped);
}

static void test_init_refuses_and_leaves_the_object_alone(void)
{
    dqw_ordinal_q15 o;
    const dqw_ordinal_config_q15 good = {
        .dt_ns = 100000, .x_full_mV = 5000, .y_full_mA = 10000, .R_uohm = 370000, .L_nH = 326000};
    TEST_ASSERT_EQUAL_INT(DQW_ERR_NULL, dqw_ordinal_init_q15(NULL, &good));
    REFUSED(o, DQW_ERR_NULL, dqw_ordinal_init_q15(&o, NULL));
    for (int field = 0; field < 5; field++) {
        dqw_ordinal_config_q15 c = good;
        uint32_t *const fields[] = {&c.dt_ns, &c.x_full_mV, &c.y_full_mA, &c.R_uohm, &c.L_nH};
        *fields[field] = 0;
        REFUSED(o, DQW_ERR_RANGE, dqw_ordinal_init_q15(&o, &c));
        if (field > 2) continue;
        *fields[field] = UINT32_MAX;
        REFUSED(o, DQW_ERR_RANGE, dqw_ordinal_init_q15(&o, &c));
    }
    // Full scales with which the weight of x leaves its range, on either side.
    dqw_ordinal_config_q15 c = good;
    c.x_full_mV = 200000;
    REFUSED(o, DQW_ERR_RANGE, dqw_ordinal_init_q15(&o, &c));
    c = good;
    c.y_full_mA = 10000000;
    REFUSED(o, DQW_ERR_RANGE, dqw_ordinal_init_q15(&o, &c));
    // The largest full scales, 10 kV and 10 kA, and what is just beyond; the longest period, of a slow winding.
    const dqw_ordinal_config_q15 most = {
        .dt_ns = 1000000000, .x_full_mV = 10000000, .y_full_mA = 10000000, .R_uohm = 1000000, .L_nH = 4000000000u};
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_ordinal_init_q15(&o, &most));
    for (int field = 0; field < 3; field++) {
        c = most;
        ++*(uint32_t *[]){&c.dt_ns, &c.x_full_mV, &c.y_full_mA}[field];
        REFUSED(o, DQW_ERR_RANGE, dqw_ordinal_init_q15(&o, &c));
    }
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_ordinal_init_q15(&o, &good));
}

static void test_start_values_are_those_of_the_float_one(void)
{
    test_random r = {1};
    for (int k = 0; k < scaled(3000); k++) {
        const double R = 0.37 * pow(10, random_uniform(&r, -0.4, 0.5));
        const double L = R * T_S / pow(10, random_uniform(&r, -2.8, 0.7));
        CASE("R %g, L %g", R, L);
        twins t = begin(k % 2, 0, R, L);
        BETWEEN(-1.5e-7, a_of(&t) - (double)t.f.a, 1.5e-7);
        BETWEEN(-6e-5, b_of(&t) / (double)t.f.b_pu - 1, 6e-5);  // 1 - a of single precision: 2^-24 / 1e-3
        BETWEEN(-1e-4, R_x(&t) / R - 1, 1e-4);
    }
}

static void test_exponential_and_logarithm(void)
{
    double worst[2] = {0};
    for (int k = 1; k < 20000; k++) {
        const double x = exp(-18 + 20.0 * k / 20000);
        CASE("%g", x);
        const int64_t q40 = (int64_t)ldexp(x, 40);
        const double exact = -expm1(-ldexp((double)q40, -40));
        worst[0] = fmax(worst[0],
                        fabs(ldexp((double)dqw_one_less_exp_q40(q40), -40) / exact - 1) - ldexp(1, -40) / exact);
        const int32_t y = (int32_t)lrint(2147483648.0 * exp(-4.7 * k / 20000)) - (k % 3) * 7;
        worst[1] = fmax(worst[1], fabs(ldexp((double)dqw_minus_log_q40(y), -40) / -log(y / 2147483648.0) - 1));
    }
    test_case[0] = 0;
    BETWEEN(1e-10, worst[0], 5e-9);  // 1.2e-9
    BETWEEN(1e-10, worst[1], 8e-9);  // 2.7e-9
    TEST_ASSERT_TRUE(dqw_one_less_exp_q40(0) == 0 && dqw_one_less_exp_q40(-5) == 0 &&
                     dqw_one_less_exp_q40(INT64_MAX) == (int64_t)1 << 40);
    TEST_ASSERT_TRUE(dqw_minus_log_q40(0) == 0 && dqw_minus_log_q40(INT32_MIN) == 0);
    BETWEEN(-2e-9, ldexp((double)dqw_minus_log_q40(1), -40) - 31 * log(2), 2e-9);
}

// Epoch for epoch. The float one carries single precision through a recursion of 300 steps, 1e-5 of a weight or so;
// with a start that is told but as 1e-6 of a sample's power, P0.
static void test_epochs_of_both_forms(void)
{
    static const double start[] = {0.1, 1.0, 3.0};
    static const double noise[] = {0.0, 0.02, 0.1, 0.2};
    double worst[2][4] = {{0}};
    for (int form = 0; form < 2; form++)
        for (int n = 0; n < 4; n++)
            for (int seed = 0; seed < scaled(60); seed++) {
                make_signals((uint64_t)(100 * n + seed), noise[n]);
                twins t = begin(form, 0, start[seed % 3] * TRUE_R_OHM, TRUE_L_H / start[seed % 3]);
                for (int e = 0; e < 15; e++) {
                    CASE("form %d, noise %g, seed %d, epoch %d", form, noise[n], seed, e);
                    epoch(&t, SAMPLES);
                    const double off = fmax(fabs(a_of(&t) - (double)t.f.a), fabs(b_of(&t) - (double)t.f.b_pu));
                    BETWEEN(0.0, off, 2e-4);
                    worst[form][n] = fmax(worst[form][n], off);
                }
                HOLDS(t.q.converged && t.f.converged);
                const double R = (double)dqw_ordinal_R_from_x(&t.f, NAN);
                BETWEEN(-1e-3, R_x(&t) / R - 1, 1e-3);
                BETWEEN(-1e-3, R_y(&t) / (double)dqw_ordinal_R_from_y(&t.f, (float)TRUE_L_H) - 1, 1e-3);
                if (noise[n] == 0.0) BETWEEN(-3e-4, R_x(&t) / TRUE_R_OHM - 1, 3e-4);
            }
    for (int form = 0; form < 2; form++)
        for (int n = 0; n < 4; n++) {
            CASE("form %d, noise %g", form, noise[n]);
            BETWEEN(1e-7, worst[form][n],
                    2e-4);  // 4e-7 to 2.7e-6; output error at a fifth 4.5e-5: two starts of Gauss and Newton's way
        }
}

static void test_backward_difference(void)
{
    make_signals(2, 0.0);
    for (int form = 0; form < 2; form++) {
        twins t = begin(form, 1, TRUE_R_OHM, TRUE_L_H);
        for (int e = 0; e < 4; e++) epoch(&t, 100);
        CASE("form %d", form);
        BETWEEN(-5e-4, R_y(&t) / (double)dqw_ordinal_R_from_y(&t.f, (float)TRUE_L_H) - 1, 5e-4);
        BETWEEN(-2e-3, R_x(&t) / (double)dqw_ordinal_R_from_x(&t.f, (float)TRUE_L_H) - 1, 2e-3);
        const double h = TRUE_R_OHM * T_S / TRUE_L_H;
        BETWEEN(-1e-3, R_y(&t) / (TRUE_L_H / T_S * (exp(h) - 1)) - 1, 1e-3);
    }
}

// Weights that no circuit has, have no resistance.
static void test_weights_without_a_meaning(void)
{
    static const int32_t none[] = {0, -1, INT32_MIN / 2};
    for (int discretisation = 0; discretisation < 2; discretisation++)
        for (int k = 0; k < 3; k++) {
            CASE("discretisation %d, weight %d", discretisation, (int)none[k]);
            dqw_ordinal_q15 o = begin(0, discretisation, 0.3, 3e-4).q;
            HOLDS(dqw_ordinal_R_from_x_q15(&o, 300000) > 0 && dqw_ordinal_R_from_y_q15(&o, 300000) > 0);
            o.b_q27 = none[k];
            HOLDS(dqw_ordinal_R_from_x_q15(&o, 300000) == 0 && dqw_ordinal_R_from_y_q15(&o, 300000) > 0);
            o.a_q31 = none[k];
            HOLDS(dqw_ordinal_R_from_y_q15(&o, 300000) == 0);
        }
}

// A sample beyond the full scale breaks the chain: no pair spans it.
static void test_gaps(void)
{
    static const int16_t beyond[] = {INT16_MIN, -INT16_MAX, INT16_MAX};
    for (int form = 0; form < 2; form++) {
        make_signals(6, 0.0);
        twins t = begin(form, 0, 0.3, 3e-4);
        for (int e = 0; e < 8; e++) {
            test_random r = {7};
            uint32_t skipped = 0;
            uint32_t learned = 0;
            bool before = false;
            const dqw_ordinal_q15 was = t.q;
            for (int k = 0; k < SAMPLES; k++) {
                const uint64_t kind = random_bits(&r) % 20;
                dqw_ordinal_step_q15(&t.q, kind < 3 ? beyond[kind] : x_q15[k],
                                     kind > 2 && kind < 6 ? beyond[kind - 3] : y_q15[k]);
                if (kind < 6) skipped++;
                if (kind > 5 && before) learned++;
                before = kind > 5;
            }
            (void)dqw_ordinal_end_epoch_q15(&t.q);
            HOLDS(t.q.skipped - was.skipped == skipped && t.q.learned - was.learned == learned);
        }
        CASE("form %d", form);
        HOLDS(t.q.converged);
        BETWEEN(-1e-3, R_x(&t) / TRUE_R_OHM - 1, 1e-3);
        BETWEEN(-1e-3, R_y(&t) / TRUE_R_OHM - 1, 1e-3);
        BETWEEN(-1e-3, t.q.w_o_q27 / 134217728.0, 1e-3);
    }
}

// What a pair's model leaves is watched, in both: an operating point that the start weights do not hold.
static void test_what_is_left_of_a_pair(void)
{
    const double x = 1000 / 32768.0;
    const double y = 3000 / 32768.0;
    for (int form = 0; form < 2; form++) {
        CASE("form %d", form);
        twins t = begin(form, 0, 0.3, 3e-4);
        const double left = y - b_of(&t) * x - a_of(&t) * y;
        HOLDS(fabs(left) > 1e-3);
        double w = 0;
        for (int k = 0; k < 80; k++) {
            dqw_ordinal_step(&t.f, (float)(x * X_FULL_V), (float)(y * Y_FULL_A));
            dqw_ordinal_step_q15(&t.q, 1000, 3000);
            if (k > 0) w += 0.05 * (left - w);
            BETWEEN(-2e-5, t.q.w_o_q27 / 134217728.0 - w, 2e-5);
            if (k == 1) BETWEEN(-2e-5, (double)t.f.w_o - w, 2e-5);
        }
    }
}

static void test_what_teaches_nothing_changes_nothing(void)
{
    for (int form = 0; form < 2; form++) {
        twins t = begin(form, 0, 0.3, 3e-4);
        const dqw_ordinal_q15 before = t.q;
        for (int e = 0; e < 12; e++) {
            for (int k = 0; k < 100; k++) dqw_ordinal_step_q15(&t.q, 0, 0);
            (void)dqw_ordinal_end_epoch_q15(&t.q);
            // One operating point does not tell R from L.
            for (int k = 0; k < 100; k++) dqw_ordinal_step_q15(&t.q, 1000, 3000);
            (void)dqw_ordinal_end_epoch_q15(&t.q);
        }
        HOLDS(t.q.a_q31 == before.a_q31 && t.q.b_q27 == before.b_q27);
        HOLDS(form == DQW_ORDINAL_PAIRS_Q15 || !t.q.converged);
    }
    twins t = begin(0, 0, 0.3, 3e-4);
    t.q.b_q27 = 0;
    TEST_ASSERT_EQUAL_INT32(0, dqw_ordinal_R_from_x_q15(&t.q, 300000));
    t.q.a_q31 = 0;
    TEST_ASSERT_EQUAL_INT32(0, dqw_ordinal_R_from_y_q15(&t.q, 300000));
    t.q.learned = t.q.skipped = t.q.epochs = UINT32_MAX;
    dqw_ordinal_step_q15(&t.q, 1, 1);
    dqw_ordinal_step_q15(&t.q, 1, 1);
    dqw_ordinal_step_q15(&t.q, INT16_MIN, 1);
    (void)dqw_ordinal_end_epoch_q15(&t.q);
    TEST_ASSERT_TRUE(t.q.learned == UINT32_MAX && t.q.skipped == UINT32_MAX && t.q.epochs == UINT32_MAX);
}

// Two unknowns are told apart where the sums' determinant is above 2^-22 of the product of their squares. Sums as one
// epoch leaves them; far below and above, and as near as whole numbers come.
static void test_how_far_apart_two_unknowns_must_be(void)
{
    const int64_t high = (int64_t)1 << 29;
    const struct {
        int64_t own[2], both;
        bool told;
    } sums[] = {{{high, high}, high - 64, false},  // 2^36 - 2^12 of 2^58
                {{high, high}, high - 65, true},
                {{high, high}, -(high - 64), false},
                {{high, high}, -(high - 65), true},
                {{2, 2099201}, 2049, false},  // 1 of 2^22, rounded down
                {{2, 2099202}, 2049, true},
                {{0, 0}, 0, false},
                {{1000, 0}, 0, false}};
    for (unsigned k = 0; k < sizeof sums / sizeof sums[0]; k++) {
        CASE("sums %u", k);
        dqw_ordinal_q15 o = begin(DQW_ORDINAL_PAIRS_Q15, 0, 0.3, 3e-4).q;
        const dqw_ordinal_q15 before = o;
        // As of a pole of 1/2 and a weight of 1/4 of the input.
        o.sum[0] = sums[k].own[0], o.sum[1] = sums[k].both, o.sum[2] = sums[k].own[1];
        o.sum[3] = sums[k].own[0] / 4 - sums[k].both / 2;
        o.sum[4] = sums[k].both / 4 - sums[k].own[1] / 2;
        (void)dqw_ordinal_end_epoch_q15(&o);
        HOLDS((o.a_q31 != before.a_q31 || o.b_q27 != before.b_q27) == sums[k].told);
    }
}

// Sums of many pairs and of few, of a large input beside a small one: the same weight and pole.
static void test_sums_of_any_size(void)
{
    for (int x = 44; x <= 60; x += 8)
        for (int y = 44; y <= 60; y += 8) {
            CASE("2^%d, 2^%d", x, y);
            dqw_ordinal_q15 o = begin(DQW_ORDINAL_PAIRS_Q15, 0, 0.3, 3e-4).q;
            o.sum[0] = (int64_t)1 << x, o.sum[2] = (int64_t)1 << y;
            // A quarter of what both could have in common.
            o.sum[1] = (int64_t)1 << ((x + y) / 2 - 2);
            o.sum[3] = o.sum[0] / 4 - o.sum[1] / 4;
            o.sum[4] = o.sum[1] / 4 - o.sum[2] / 4;
            (void)dqw_ordinal_end_epoch_q15(&o);
            BETWEEN(-1e-6, o.b_q27 / 134217728.0 - 0.25, 1e-6);
            BETWEEN(-1e-6, o.a_q31 / 2147483648.0 - 0.75, 1e-6);
        }
}

// A step of an epoch from the neuron's own output: the pole by 0.2 at most, the weight to ten times or a tenth.
static void test_how_far_an_epoch_goes(void)
{
    for (int way = -1; way <= 1; way += 2)
        for (int far = 0; far < 2; far++) {
            CASE("way %d, far %d", way, far);
            dqw_ordinal_q15 o = begin(DQW_ORDINAL_OUTPUT_ERROR_Q15, 0, 0.3, 3e-4).q;
            o.from_pairs = false;
            o.a_q31 = 1 << 30;
            o.b_q27 = 1 << 22;
            // What is found is in 2^-19 of 1 for the weight, 2^-23 for the pole: well inside, and well beyond.
            o.sum[0] = o.sum[2] = (int64_t)1 << 40;
            o.sum[3] = way * (o.sum[0] >> 19) * (far ? 1 << 26 : 1 << 20);
            o.sum[4] = way * (o.sum[2] >> 23) * (far ? 1 << 30 : 1 << 27);
            (void)dqw_ordinal_end_epoch_q15(&o);
            const double b = o.b_q27 / 4194304.0;
            const double a = o.a_q31 / 2147483648.0 - 0.5;
            BETWEEN(-1e-6, b - (!far ? 1 + 0.25 * way : way > 0 ? 10 : 0.1), 1e-6);
            BETWEEN(-1e-6, a - way * (far ? 0.2 : 0.0625), 1e-6);
        }
}

// What pairs say beyond what a circuit can have is bounded: an input's weight of 8, a pole of 0.01 or 0.9995.
static void test_what_pairs_say_is_bounded(void)
{
    static const double weights[] = {-20, -7, 7, 20};
    static const double poles[] = {-0.5, 0.2, 0.9999};
    for (int k = 0; k < 4; k++)
        for (int n = 0; n < 3; n++) {
            CASE("weight %g, pole %g", weights[k], poles[n]);
            dqw_ordinal_q15 o = begin(DQW_ORDINAL_PAIRS_Q15, 0, 0.3, 3e-4).q;
            dqw_ordinal_q15 output = begin(DQW_ORDINAL_OUTPUT_ERROR_Q15, 0, 0.3, 3e-4).q;
            // Of pairs each by itself.
            test_random r = {8};
            for (int pair = 0; pair < 200; pair++) {
                const double x = random_uniform(&r, -0.03, 0.03);
                const double y = random_uniform(&r, -0.3, 0.3);
                const int16_t x_is = q15(x);
                const int16_t y_is = q15(y);
                for (int both = 0; both < 2; both++) {
                    dqw_ordinal_q15 *learner = both ? &output : &o;
                    dqw_ordinal_step_q15(learner, x_is, y_is);
                    dqw_ordinal_step_q15(learner, 0, (int16_t)lrint(weights[k] * x_is + poles[n] * y_is));
                    dqw_ordinal_step_q15(learner, INT16_MIN, 0);
                }
            }
            (void)dqw_ordinal_end_epoch_q15(&o);
            // What no circuit has is no start for the neuron's own output.
            (void)dqw_ordinal_end_epoch_q15(&output);
            HOLDS(output.from_pairs == !(weights[k] > 0 && n == 1));
            BETWEEN(-2e-3, o.b_q27 / 134217728.0 - fmax(-8, fmin(8, weights[k])), 2e-3);
            BETWEEN(-3e-4, o.a_q31 / 2147483648.0 - fmax(0.01, fmin(0.9995, poles[n])), 3e-4);
        }
}

// What nobody has shown is in no sum: at the start, and, but where pairs alone are learned, after each epoch.
static void test_sums_begin_at_nought(void)
{
    const dqw_ordinal_config_q15 good = {
        .dt_ns = 100000, .x_full_mV = 5000, .y_full_mA = 10000, .R_uohm = 370000, .L_nH = 326000};
    make_signals(9, 0.1);
    for (int form = 0; form < 2; form++) {
        dqw_ordinal_config_q15 c = good;
        c.form = (enum dqw_ordinal_form_q15)form;
        dqw_ordinal_q15 o;
        memset(&o, 0x5a, sizeof o);
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_ordinal_init_q15(&o, &c));
        CASE("form %d", form);
        for (int i = 0; i < 5; i++) HOLDS(o.sum[i] == 0);
        for (int epochs = 0; epochs < 3; epochs++) {
            for (int k = 0; k < SAMPLES; k++) dqw_ordinal_step_q15(&o, x_q15[k], y_q15[k]);
            for (int i = 0; i < 5; i++) HOLDS(o.sum[i] != 0);
            (void)dqw_ordinal_end_epoch_q15(&o);
            for (int i = 0; i < 5; i++) HOLDS((o.sum[i] == 0) == (form == DQW_ORDINAL_OUTPUT_ERROR_Q15));
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_and_leaves_the_object_alone);
    RUN_TEST(test_start_values_are_those_of_the_float_one);
    RUN_TEST(test_exponential_and_logarithm);
    RUN_TEST(test_epochs_of_both_forms);
    RUN_TEST(test_backward_difference);
    RUN_TEST(test_weights_without_a_meaning);
    RUN_TEST(test_gaps);
    RUN_TEST(test_how_far_apart_two_unknowns_must_be);
    RUN_TEST(test_what_pairs_say_is_bounded);
    RUN_TEST(test_sums_of_any_size);
    RUN_TEST(test_how_far_an_epoch_goes);
    RUN_TEST(test_what_is_left_of_a_pair);
    RUN_TEST(test_what_teaches_nothing_changes_nothing);
    RUN_TEST(test_sums_begin_at_nought);
    return UNITY_END();
}
