// Any bit patterns into every step of the fixed-point learners: no trap, and afterwards each object still learns a
// clean signal.
#include "dqw_learner_q15.h"
#include "dqw_ordinal_q15.h"
#include "dqw_random_q15.h"
#include "dqw_shaft_q15.h"
#include "dqw_test.h"
#include "dqw_transform_q15.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

static const int steps = 1000000;
static dqw_random_sample_q15 memory[50];

// Any of the 2^16 patterns; every fourth at an edge.
static int16_t bits(test_random *r)
{
    static const int16_t odd[] = {INT16_MIN, -INT16_MAX, -1, 0, 1, INT16_MAX, 16384, -16384};
    const uint64_t z = random_bits(r);
    return z % 4 == 0 ? odd[z / 4 % 8] : (int16_t)((int)(z >> 40 & 65535u) - 32768);
}

static int16_t clean(test_random *r) { return (int16_t)lrint(random_uniform(r, -30000, 30000)); }

static void test_transforms(void)
{
    test_random r = {1};
    long sum = 0;
    for (int k = 0; k < scaled(steps); k++) {
        const dqw_abc_q15 a = {bits(&r), bits(&r), bits(&r)};
        int16_t c = bits(&r);
        int16_t s = bits(&r);
        const dqw_dq_q15 y = dqw_park_q15(dqw_clarke_q15(a), c, s);
        const dqw_abc_q15 b = dqw_clarke_inverse_q15(dqw_park_inverse_q15(y, c, s));
        dqw_cosine_sine_q15((uint16_t)random_bits(&r), &c, &s);
        sum += dqw_park_paper_q15(dqw_clarke_q15(b), c, s).d;
    }
    TEST_ASSERT_TRUE(sum != 0);
}

static void test_plain_step(void)
{
    static const uint16_t step[] = {1, 33, 16384, 32768, 65535};
    for (int n = 1; n <= DQW_LEARNER_INPUTS_Q15; n++)
        for (int s = 0; s < 5; s++) {
            CASE("%d inputs, step size %d", n, step[s]);
            int32_t w_q31[DQW_LEARNER_INPUTS_Q15] = {0};
            test_random r = {(uint64_t)(10 * n + s)};
            for (int k = 0; k < scaled(steps) / 10; k++) {
                int16_t x[DQW_LEARNER_INPUTS_Q15];
                for (int i = 0; i < n; i++) {
                    x[i] = bits(&r);
                    if (k % 100 == 0) w_q31[i] = bits(&r) * 65536 + (int32_t)(random_bits(&r) & 65535u);
                    if (k % 300 == 0) w_q31[i] = k % 600 ? INT32_MAX : INT32_MIN;
                }
                const int32_t e_q28 = dqw_learner_step_pu_q15(w_q31, x, n, bits(&r), step[s]);
                HOLDS(llabs(e_q28) <= (1 + n) * ((int64_t)1 << 28));
            }
            if (step[s] != 16384) continue;
            for (int k = 0; k < 20000; k++) {
                int16_t x[DQW_LEARNER_INPUTS_Q15];
                int32_t y_q30 = 0;
                for (int i = 0; i < n; i++) {
                    x[i] = clean(&r);
                    y_q30 += x[i] * (i % 2 ? -5000 : 4000);
                }
                (void)dqw_learner_step_pu_q15(w_q31, x, n, dqw_q15_sat(dqw_q_round32(y_q30, 15)), step[s]);
            }
            for (int i = 0; i < n; i++) BETWEEN(-4, w_q31[i] / 65536.0 - (i % 2 ? -5000 : 4000), 4);
        }
}

static void test_learner(void)
{
    for (int mode = 0; mode < 4; mode++) {
        CASE("mode %d", mode);
        const dqw_learner_config_q15 c = {
            .inputs = 3, .step_size_q15 = 16384, .noisy_inputs = (mode & 1) != 0, .indicator = (mode & 2) != 0};
        dqw_learner_q15 l;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_init_q15(&l, &c));
        test_random r = {(uint64_t)(2 + mode)};
        for (int k = 0; k < scaled(steps) / 4; k++) {
            const int16_t x[3] = {bits(&r), bits(&r), bits(&r)};
            if (k % 1000 == 0) l.step_size_q15 = (uint16_t)random_bits(&r);
            (void)dqw_learner_forward_q15(&l, x);
            (void)dqw_learner_learn_q15(&l, x, bits(&r));
            (void)dqw_learner_weight_q15(&l, (int)(random_bits(&r) % 5) - 1);
            if (k % 100 == 0) (void)dqw_learner_set_weight_q15(&l, (int)(random_bits(&r) % 5) - 1, bits(&r) * 65536);
        }
        l.step_size_q15 = 8192;
        for (int k = 0; k < 60000; k++) {
            const int16_t x[3] = {clean(&r), clean(&r), clean(&r)};
            (void)dqw_learner_learn_q15(&l, x,
                                        dqw_q15_sat(dqw_q_round32(x[0] * 16384 - x[1] * 8192 + x[2] * 4096, 15)));
        }
        BETWEEN(0.499, dqw_learner_weight_q15(&l, 0) / 2147483648.0, 0.501);
        BETWEEN(-0.251, dqw_learner_weight_q15(&l, 1) / 2147483648.0, -0.249);
        BETWEEN(0.124, dqw_learner_weight_q15(&l, 2) / 2147483648.0, 0.126);
    }
}

static void test_random_learner(void)
{
    const dqw_learner_config_q15 c = {.inputs = 1, .step_size_q15 = 16384, .indicator = true};
    const dqw_random_config_q15 rc = {
        .reservoir = memory, .capacity = 50, .draws = 50, .seed = 1, .tolerance_q15 = 328};
    dqw_learner_q15 l;
    dqw_random_q15 d;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_init_q15(&l, &c));
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_random_init_q15(&d, &rc));
    test_random r = {8};
    for (int k = 0; k < scaled(steps); k++) {
        const int16_t x = bits(&r);
        dqw_random_put_q15(&d, &x, (int)(random_bits(&r) % 2), bits(&r));
        (void)dqw_random_iterate_q15(&d, &l);
        if (k % 1000 == 0) (void)dqw_random_epoch_q15(&d, &l);
    }
    // The reservoir keeps what it was given; a new one on the same memory starts clean.
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_random_init_q15(&d, &rc));
    for (int k = 0; k < 50; k++) {
        const int16_t x = clean(&r);
        dqw_random_put_q15(&d, &x, 1, x / 2);
    }
    for (int k = 0; k < 200; k++) (void)dqw_random_epoch_q15(&d, &l);
    BETWEEN(0.499, l.w_q31[0] / 2147483648.0, 0.501);
}

static void test_ordinal(void)
{
    for (int mode = 0; mode < 4; mode++) {
        CASE("mode %d", mode);
        const dqw_ordinal_config_q15 c = {.dt_ns = 100000,
                                          .x_full_mV = 5000,
                                          .y_full_mA = 10000,
                                          .R_uohm = 300000,
                                          .L_nH = 300000,
                                          .form = (enum dqw_ordinal_form_q15)(mode & 1),
                                          .discretisation = (enum dqw_ordinal_discretisation_q15)(mode >> 1)};
        dqw_ordinal_q15 o;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_ordinal_init_q15(&o, &c));
        test_random r = {(uint64_t)(9 + mode)};
        for (int k = 0; k < scaled(steps) / 2; k++) {
            // Runs at the edges as well, where sums and outputs grow longest.
            const bool edge = k / 1000 % 3 == 0;
            dqw_ordinal_step_q15(&o, edge ? 32766 : bits(&r), edge ? (k / 3000 % 2 ? -32766 : 32766) : bits(&r));
            (void)dqw_ordinal_R_from_x_q15(&o, (uint32_t)random_bits(&r));
            (void)dqw_ordinal_R_from_y_q15(&o, (uint32_t)random_bits(&r));
            if (random_bits(&r) % 300 == 0) (void)dqw_ordinal_end_epoch_q15(&o);
            if (random_bits(&r) % 5000 == 0) {
                o.a_q31 = (int32_t)(random_bits(&r) % 2146409906u) + 1;
                o.b_q27 = (int32_t)(random_bits(&r) % (1u << 31)) - (1 << 30);
            }
        }
        (void)dqw_ordinal_end_epoch_q15(&o);
        HOLDS(o.a_q31 >= 21474836 && o.a_q31 <= 2146409906 && llabs(o.b_q27) <= 1 << 30);
        if (c.form == DQW_ORDINAL_PAIRS_Q15) continue;  // pairs keep all that they learned
        const double a = exp(-0.37e-4 / 0.326e-3);
        for (int epoch = 0; epoch < 60; epoch++) {
            double y = 0.0;
            test_random s = {10};
            double x = 0.4;
            for (int k = 0; k < 300; k++) {
                if (k % 20 == 0) x = random_bits(&s) & 1u ? 0.4 : -0.4;
                dqw_ordinal_step_q15(&o, (int16_t)lrint(32768 * x), (int16_t)lrint(32768 * y));
                y = a * y + (1 - a) / 0.37 * 0.5 * x;
            }
            (void)dqw_ordinal_end_epoch_q15(&o);
        }
        if (mode == 0) BETWEEN(369500, dqw_ordinal_R_from_x_q15(&o, 326000), 370500);
        HOLDS(o.converged);
    }
}

static dqw_ordinal_q15 ordinal_of(int form)
{
    const dqw_ordinal_config_q15 c = {.dt_ns = 10000,
                                      .x_full_mV = 5000,
                                      .y_full_mA = 10000,
                                      .R_uohm = 3000,
                                      .L_nH = 3000,
                                      .form = (enum dqw_ordinal_form_q15)form};
    dqw_ordinal_q15 o;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_ordinal_init_q15(&o, &c));
    return o;
}

// The longest sums that an epoch may hold, at the edges.
static void test_long_epochs(void)
{
    for (int form = 0; form < 2; form++) {
        dqw_ordinal_q15 o = ordinal_of(form);
        for (int epoch = 0; epoch < 2; epoch++) {
            if (epoch == 1) {
                o.a_q31 = 2146409906;
                o.b_q27 = 1 << 30;
                o.from_pairs = false;
            }
            for (int k = 0; k < 600000; k++) dqw_ordinal_step_q15(&o, 32766, epoch == 1 ? -32766 : 32766);
            for (int i = 0; i < 5; i++) HOLDS(llabs(o.sum[i]) < INT64_MAX / 4 * 3);
            (void)dqw_ordinal_end_epoch_q15(&o);
        }
    }
}

// An epoch of more than 2^18 pairs, or with pairs alone all epochs of more than 2^31, learns nothing from what is
// beyond.
static void test_sums_take_so_many_pairs(void)
{
    for (int form = 0; form < 2; form++) {
        dqw_ordinal_q15 o = ordinal_of(form);
        o.from_pairs = form == DQW_ORDINAL_PAIRS_Q15;
        const uint32_t most = (uint32_t)1 << (o.from_pairs ? 31 : 18);
        dqw_ordinal_step_q15(&o, 1000, 1000);
        o.summed = most - 1;
        for (int k = 0; k < 3; k++) {
            CASE("form %d, pair %d", form, k);
            const int64_t before = o.sum[0];
            dqw_ordinal_step_q15(&o, 1000, 1000);
            HOLDS((o.sum[0] > before) == (k == 0) && o.summed == most);
        }
    }
}

static void read_shaft(const dqw_shaft_q15 *s)
{
    int64_t w[DQW_EFFECT_STARTS];
    int64_t sd[DQW_EFFECT_STARTS];
    for (int i = 0; i < DQW_SHAFT_PARAMETERS; i++)
        HOLDS(dqw_shaft_read_q15(s, (enum dqw_shaft_parameter)i).sd_q40 >= 0);
    for (int k = 0; dqw_shaft_read_effect_q15(s, k, w, sd) >= 0; k++) HOLDS(sd[0] >= 0);
}

// Any samples at any scale, with every effect of the shaft; then a clean shaft in the same object.
static void test_shaft(void)
{
    static const dqw_torque_q15_config effects[] = {
        {.effect = DQW_EFFECT_COULOMB_FRICTION, .width_urad_s = 1000000, .start_uNm = {INT32_MIN}},
        {.effect = DQW_EFFECT_DIRECTION_ASYMMETRY, .width_urad_s = 1000000},
        {.effect = DQW_EFFECT_STRIBECK_FRICTION, .width_urad_s = 20000, .fall_urad_s = 2000000},
        {.effect = DQW_EFFECT_COGGING_TORQUE, .periods = 1000, .start_uNm = {INT32_MAX, -1}},
        {.effect = DQW_EFFECT_LOAD_TORQUE},
    };
    static const dqw_shaft_scale scale[] = {{1500000, 150000, 1000000},
                                            {1, 150000, 1},
                                            {DQW_SHAFT_TORQUE_MAX, 150000, 1000000000},
                                            {DQW_SHAFT_TORQUE_MAX, 150000, 1},
                                            {1, 150000, 1000000000}};
    for (int s = 0; s < 5; s++)
        for (int mode = 0; mode < 4; mode++) {
            CASE("scale %d, mode %d", s, mode);
            dqw_shaft_q15_config c = {
                .scale = scale[s], .half_window = mode & 1 ? 100 : 3, .solve_blocks = 16, .coulomb = true};
            c.coulomb_width_urad_s = mode & 2 ? 300000 : 0;
            c.effects = effects;
            c.effect_count = mode & 2 ? 5 : 0;
            dqw_shaft_q15 m;
            const enum dqw_status status = dqw_shaft_init_q15(&m, &c);
            // Starts of 2 kNm are too many of the smallest full scale.
            if (scale[s].torque_full_uNm == 1 && c.effect_count > 0) {
                TEST_ASSERT_EQUAL_INT(DQW_ERR_UNIT, status);
                continue;
            }
            TEST_ASSERT_EQUAL_INT(DQW_OK, status);
            test_random r = {(uint64_t)(40 + 4 * s + mode)};
            int16_t torque = 0;
            int16_t w = 0;
            for (int k = 0; k < scaled(steps) / 8; k++) {
                // Some stay where they are: whole windows of edges, and of nothing.
                if (random_bits(&r) % 64 != 0 || k % 3000 < 1500) {
                    torque = bits(&r);
                    w = bits(&r);
                }
                (void)dqw_shaft_sample_q15(&m, torque, w, (uint16_t)random_bits(&r), random_bits(&r) % 50 == 0);
                if (random_bits(&r) % 8 != 0) (void)dqw_shaft_background_q15(&m);
                if (random_bits(&r) % 2500 == 0) dqw_shaft_missing_q15(&m, (uint32_t)(random_bits(&r) % 3));
                if (random_bits(&r) % 1000 == 0) read_shaft(&m);
            }
            read_shaft(&m);
            if (s != 0) continue;
            // The sums keep all that they learned: a new one on the same memory starts clean.
            c.effect_count = 0;
            TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_shaft_init_q15(&m, &c));
            for (int k = 0; k < 20000; k++) {
                const double angle = 0.01 * k;
                const double speed = 5000 + 24000 * sin(angle);
                const double drag = 12000 * cos(angle + 0.005) + 0.25 * speed + (speed > 0 ? 1000 : -1000);
                (void)dqw_shaft_sample_q15(&m, (int16_t)lrint(drag), (int16_t)lrint(speed), 0, false);
                (void)dqw_shaft_background_q15(&m);
            }
            HOLDS(dqw_shaft_read_q15(&m, DQW_J).usable && dqw_shaft_read_q15(&m, DQW_B).usable);
            BETWEEN(0.245, ldexp((double)dqw_shaft_read_q15(&m, DQW_B).value_q40, -40), 0.255);
            BETWEEN(49.0, ldexp((double)dqw_shaft_read_q15(&m, DQW_J).value_q40, -40), 51.0);  // 12000 / (24000 0.01)
        }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_transforms);
    RUN_TEST(test_plain_step);
    RUN_TEST(test_learner);
    RUN_TEST(test_random_learner);
    RUN_TEST(test_ordinal);
    RUN_TEST(test_long_epochs);
    RUN_TEST(test_sums_take_so_many_pairs);
    RUN_TEST(test_shaft);
    return UNITY_END();
}
