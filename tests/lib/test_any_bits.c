// Any bit patterns into every public step: no trap, and afterwards each object still learns a clean signal, where it
// can.
#include "dqw.h"
#include "dqw_change.h"
#include "dqw_estimator_block.h"
#include "dqw_estimator_random.h"
#include "dqw_fault.h"
#include "dqw_number.h"
#include "dqw_paper.h"
#include "dqw_shaft.h"
#include "dqw_test.h"
#include "dqw_transform.h"
#include "dqw_witness.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

static const int steps = 1000000;
static dqw_random_sample memory[3][50];

static void bits(test_random *r, float x[], int n)
{
    for (int i = 0; i < n; i++) x[i] = random_float_bits(r);
}

static void test_transforms(void)
{
    test_random r = {1};
    float sum = 0.0f;
    for (int k = 0; k < scaled(steps); k++) {
        float x[5];
        bits(&r, x, 5);
        const dqw_abc a = {x[0], x[1], x[2]};
        const dqw_dq y = dqw_park(dqw_clarke(a), x[3], x[4]);
        const dqw_abc b = dqw_clarke_inverse(dqw_park_inverse(y, x[3], x[4]));
        const dqw_dq z = dqw_park_paper(dqw_clarke(b), x[3], x[4]);
        sum += isfinite(z.d) ? 1.0f : 0.0f;
    }
    TEST_ASSERT_TRUE(sum > 0.0f);
}

static void test_learner(void)
{
    for (int mode = 0; mode < 4; mode++) {
        CASE("mode %d", mode);
        dqw_learner_config c = {.inputs = 3,
                                .step_size = 0.5f,
                                .x_base = {1.0f, 1.0f, 1.0f},
                                .y_base = 1.0f,
                                .noisy_inputs = (mode & 1) != 0,
                                .indicator = (mode & 2) != 0};
        dqw_learner l;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_init(&l, &c));
        test_random r = {(uint64_t)(2 + mode)};
        for (int k = 0; k < scaled(steps) / 4; k++) {
            float x[4];
            bits(&r, x, 4);
            (void)dqw_learner_forward(&l, x);
            (void)dqw_learner_learn(&l, x, x[3]);
            (void)dqw_learner_weight(&l, (int)(random_bits(&r) % 5) - 1);
            if (k % 1000 == 0) (void)dqw_learner_set_weight(&l, (int)(random_bits(&r) % 5) - 1, x[0] * 1e-36f);
        }
        for (int i = 0; i < 3; i++) HOLDS(isfinite(l.w_pu[i]));
        HOLDS(isfinite(l.w_o));
        // A weight that a set_weight or wild samples left at W takes as long as it takes: some steps per factor of ten.
        for (int k = 0; k < 100000; k++) {
            const float x[] = {(float)random_normal(&r), (float)random_normal(&r), (float)random_normal(&r)};
            (void)dqw_learner_learn(&l, x, 0.5f * x[0] - 0.25f * x[1] + 0.75f * x[2]);
        }
        BETWEEN(0.499, dqw_learner_weight(&l, 0), 0.501);
        BETWEEN(-0.251, dqw_learner_weight(&l, 1), -0.249);
        BETWEEN(0.749, dqw_learner_weight(&l, 2), 0.751);
    }
}

static void test_random_learner(void)
{
    const dqw_learner_config c = {.inputs = 1, .step_size = 0.5f, .x_base = {1.0f}, .y_base = 1.0f, .indicator = true};
    const dqw_random_config rc = {.reservoir = memory[0], .capacity = 50, .draws = 50, .seed = 1, .tolerance = 0.01f};
    dqw_learner l;
    dqw_random d;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_init(&l, &c));
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_random_init(&d, &rc));
    test_random r = {8};
    for (int k = 0; k < scaled(steps); k++) {
        float x[2];
        bits(&r, x, 2);
        dqw_random_put(&d, x, (int)(random_bits(&r) % 2), x[1]);
        (void)dqw_random_iterate(&d, &l);
        if (k % 1000 == 0) (void)dqw_random_epoch(&d, &l);
    }
    HOLDS(isfinite(l.w_pu[0]) && isfinite(l.w_o));
    // The reservoir keeps what it was given; a new one on the same memory starts clean.
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_random_init(&d, &rc));
    for (int k = 0; k < 50; k++) {
        const float x = (float)random_normal(&r);
        dqw_random_put(&d, &x, 1, 0.5f * x);
    }
    for (int k = 0; k < 5000; k++) (void)dqw_random_epoch(&d, &l);
    BETWEEN(0.49, dqw_learner_weight(&l, 0), 0.51);
}

static void test_ordinal(void)
{
    for (int mode = 0; mode < 4; mode++) {
        CASE("mode %d", mode);
        const dqw_ordinal_config c = {.dt_s = 1e-4f,
                                      .x_base = 2.0f,
                                      .y_base = 5.0f,
                                      .R_ohm = 0.3f,
                                      .L_H = 3e-4f,
                                      .form = (enum dqw_ordinal_form)(mode & 1),
                                      .discretisation = (enum dqw_ordinal_discretisation)(mode >> 1)};
        dqw_ordinal o;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_ordinal_init(&o, &c));
        test_random r = {(uint64_t)(9 + mode)};
        for (int k = 0; k < scaled(steps) / 4; k++) {
            float x[3];
            bits(&r, x, 3);
            dqw_ordinal_step(&o, x[0], x[1]);
            (void)dqw_ordinal_R_from_x(&o, x[2]);
            (void)dqw_ordinal_R_from_y(&o, x[2]);
            if (random_bits(&r) % 300 == 0) (void)dqw_ordinal_end_epoch(&o);
        }
        (void)dqw_ordinal_end_epoch(&o);
        HOLDS(isfinite(o.a) && isfinite(o.b_pu) && isfinite(o.w_o));
        if (c.form == DQW_ORDINAL_PAIRS) continue;  // pairs keep all that they learned
        const double a = exp(-0.37e-4 / 0.326e-3);
        for (int epoch = 0; epoch < 60; epoch++) {
            double y = 0.0;
            test_random s = {10};
            double x = 2.0;
            for (int k = 0; k < 301; k++) {
                if (k % 20 == 0) x = random_bits(&s) & 1u ? 2.0 : -2.0;
                dqw_ordinal_step(&o, (float)x, (float)y);
                y = a * y + (1 - a) / 0.37 * x;
            }
            (void)dqw_ordinal_end_epoch(&o);
        }
        BETWEEN(0.37 * 0.999, (1 - o.a) / (o.b_pu * 2.5), 0.37 * 1.001);
    }
}

static bool pair_of(dqw_window *w, dqw_window_rise *rise, const float x[], float block[])
{
    float sum[2];
    if (x != NULL) {
        for (int i = 0; i < 9; i++) dqw_window_gather(&dqw_window_cells(w)[i], x[i]);
        dqw_window_count(w);
    } else {
        dqw_window_refuse(w);
    }
    if (!dqw_window_full(w) || !dqw_window_turn(w)) return false;
    const bool ready = dqw_window_join(w, rise, block, sum) == DQW_EVENT_BLOCK;
    dqw_handover_release(&w->over);
    return ready;
}

static void test_window(void)
{
    dqw_window w;
    dqw_window_rise rise = {.has = false};
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_window_init(&w, 20, 9));
    test_random r = {14};
    float block[DQW_WINDOW_SIGNALS];
    for (int k = 0; k < scaled(steps); k++) {
        float x[9];
        bits(&r, x, 9);
        (void)pair_of(&w, &rise, random_bits(&r) % 8 ? x : NULL, block);
        if (random_bits(&r) % 1000 == 0) dqw_window_restart(&w);
    }
    // Two blocks later nothing of it is left.
    bool ready = false;
    for (int k = 0; k < 80; k++) {
        const float ones[9] = {1, 1, 1, 1, 1, 1, 1, 1, 1};
        ready = pair_of(&w, &rise, ones, block) || ready;
    }
    TEST_ASSERT_TRUE(ready);
    for (int i = 0; i < 9; i++) BETWEEN(0.999999, block[i], 1.000001);
}

static void test_model(void)
{
    test_random r = {15};
    int untouched = 0;
    for (int k = 0; k < scaled(steps); k++) {
        float x[24];
        bits(&r, x, 24);
        const dqw_sample s = {.v_d_V = x[0], .v_q_V = x[1], .i_d_A = x[2], .i_q_A = x[3], .w_m_rad_s = x[4]};
        const dqw_sample t = {.v_d_V = x[5], .v_q_V = x[6], .i_d_A = x[7], .i_q_A = x[8], .w_m_rad_s = x[9]};
        dqw_block b = dqw_model_pair(&s, &t, x[10]);
        const dqw_block before = b;
        const dqw_machine known = {x[11], x[12], x[13], x[14]};
        dqw_model_bow(&b, &known, x[10]);
        if (memcmp(&before, &b, sizeof b) == 0) untouched++;
        b = dqw_model_static(&s);
    }
    TEST_ASSERT_TRUE(untouched > scaled(steps) / 2);
}

static void test_gate_and_stage(void)
{
    test_random r = {16};
    dqw_gate g;
    dqw_stage s;
    dqw_gate_init(&g, 5);
    dqw_stage_init(&s, 50000);
    for (int k = 0; k < scaled(steps); k++) {
        const uint64_t z = random_bits(&r);
        const dqw_gate_sample in = {.finite = z & 1u, .saturated = z >> 1 & 1u, .repeated = z >> 2 & 1u};
        (void)dqw_gate_check(&g, in);
        (void)dqw_stage_step(&s, z >> 3 & 1u, (uint32_t)random_bits(&r) & 65535u);
        if (z % 32 == 0) dqw_stage_define(&s);
        HOLDS((unsigned)s.name <= DQW_STAGE_IN_SERVICE && (unsigned)s.back <= DQW_BACK_LEFT_BAND);
    }
    TEST_ASSERT_EQUAL_UINT32((uint32_t)scaled(steps), g.accepted + g.nonfinite + g.saturated + g.stale);
}

#define R_TRUE 0.9
#define LD_TRUE 2.2e-3
#define LQ_TRUE 2.8e-3
#define PSI_TRUE 0.12

static void test_effect_lists(void)
{
    test_random r = {33};
    for (int k = 0; k < scaled(steps) / 4; k++) {
        dqw_effect_config list[3];
        for (int n = 0; n < 3; n++) {
            list[n].effect = (enum dqw_effect_name)(random_bits(&r) % (DQW_EFFECT_NAMES + 1));
            bits(&r, list[n].shape, DQW_EFFECT_SHAPES);
            bits(&r, list[n].start, DQW_EFFECT_STARTS);
            if (random_bits(&r) & 1u)
                list[n] = (dqw_effect_config){.effect = list[n].effect, .shape = {0.5f, 1e-3f, 2e-3f}};
        }
        const int count = (int)(random_bits(&r) % 4);
        const dqw_effect_base base = {1e-4f, 100, 10, 100, 4, (random_bits(&r) & 1u) != 0};
        dqw_effect e;
        if (dqw_effect_init(&e, list, count, &base) == DQW_OK) {
            for (int n = 0; n < count; n++) HOLDS(dqw_effect_input_base(&e, n) >= 0.0f);
            float x[2][DQW_EFFECT_WEIGHTS];
            dqw_sample s[2];
            bits(&r, &s[0].v_d_V, 9);
            bits(&r, &s[1].v_d_V, 9);
            dqw_effect_heat(&e, s[0].i_d_A, s[0].i_q_A);
            dqw_effect_warm(&e, 1);
            (void)dqw_effect_pair(&e, NULL, &s[0], x[0], x[1]);
            (void)dqw_effect_pair(&e, &s[0], &s[1], x[0], x[1]);
            dqw_effect_static(&e, &s[0], x[0], x[1]);
            dqw_effect_dead_time(&e, &s[0], &s[1], x[0], x[1]);
        }
    }
}

static void test_shaft(void)
{
    const dqw_shaft_config c = {.dt_s = 1e-3f,
                                .torque_base_Nm = 1.0f,
                                .w_base_rad_s = 100.0f,
                                .half_window = 5,
                                .coulomb = true,
                                .standstill_rad_s = 0.5f};
    dqw_shaft m;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_shaft_init(&m, &c));
    test_random r = {21};
    const int wild = scaled(steps);
    for (int k = 0; k < wild; k++) {
        float x[3];
        bits(&r, x, 3);
        (void)dqw_shaft_sample(&m, x[0], x[1], x[2], random_bits(&r) % 50 == 0);
        if (random_bits(&r) % 8 != 0) (void)dqw_shaft_background(&m);
        if (k % 5000 == 0) dqw_shaft_missing(&m, 0);
        if (k % 100 == 0) HOLDS(dqw_shaft_read(&m, (enum dqw_shaft_parameter)(k / 100 % 3)).sd >= 0.0f);
    }
    TEST_ASSERT_EQUAL_UINT32((uint32_t)wild, m.gate.accepted + m.gate.nonfinite + m.gate.saturated);
    for (int i = 0; i < 3; i++) HOLDS(isfinite(m.w_pu[i]) && m.gain.d[i] > 0.0f && isfinite(m.gain.d[i]));
    HOLDS(isfinite(m.error_pu2) && m.error_pu2 >= 0.0f && isfinite(m.lag_pu2));
    dqw_shaft_missing(&m, 0);
    for (int k = 0; k < 400000; k++) {
        const double w0 = 50 * sin(0.01 * k) + 30 * sin(0.003 * k);
        const double w1 = 50 * sin(0.01 * (k + 1)) + 30 * sin(0.003 * (k + 1));
        const double d = 0.5 * ((w0 > 0.5) - (w0 < -0.5) + (w1 > 0.5) - (w1 < -0.5));
        (void)dqw_shaft_sample(&m, (float)(2e-3 * (w1 - w0) / 1e-3 + 4e-3 * 0.5 * (w0 + w1) + 0.1 * d), (float)w0, 0.0f,
                               false);
        (void)dqw_shaft_background(&m);
    }
    BETWEEN(-0.1, dqw_shaft_read(&m, DQW_J).value / 2e-3 - 1, 0.1);
    BETWEEN(-0.1, dqw_shaft_read(&m, DQW_B).value / 4e-3 - 1, 0.1);
    BETWEEN(-0.1, dqw_shaft_read(&m, DQW_COULOMB).value / 0.1 - 1, 0.1);
}

static void test_tapped(void)
{
    dqw_tapped_config c = {.taps = 3,
                           .x_base = {1, 1, 1},
                           .y_base = {1, 1, 1},
                           .step_size = 1.0f,
                           .reservoir = {memory[0], memory[1], memory[2]},
                           .capacity = 50,
                           .draws = 50,
                           .seed = 1,
                           .tolerance = 0.01f};
    dqw_tapped t;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_tapped_init(&t, &c));
    test_random r = {22};
    for (int k = 0; k < scaled(steps); k++) {
        float x[6];
        bits(&r, x, 6);
        dqw_tapped_put(&t, x, x + 3);
        (void)dqw_tapped_iterate(&t);
        (void)dqw_tapped_L_H(&t);
    }
    for (int i = 0; i < 3; i++) HOLDS(isfinite(t.learner[i].w_pu[0]) && isfinite(t.learner[i].w_o));
}

// A machine whose pairs of rows hold exactly.
static dqw_sample machine_row(int k)
{
    double i[2][2];
    double w[2];
    for (int n = 0; n < 2; n++) {
        const double t = (k + n) * 1e-4;
        i[n][0] = 3 * sin(2 * PI * 97 * t) + 4 * sin(2 * PI * 301 * t + 1);
        i[n][1] = 4 * sin(2 * PI * 153 * t + 2) + 1 + 3 * sin(2 * PI * 449 * t);
        w[n] = 100 + 60 * sin(2 * PI * 3 * t);
    }
    const double wd = 4 * 0.5 * (w[0] * i[0][0] + w[1] * i[1][0]);
    const double wq = 4 * 0.5 * (w[0] * i[0][1] + w[1] * i[1][1]);
    return dqw_sample_from_dq(
        (float)(R_TRUE * 0.5 * (i[0][0] + i[1][0]) + LD_TRUE * (i[1][0] - i[0][0]) / 1e-4 - LQ_TRUE * wq),
        (float)(R_TRUE * 0.5 * (i[0][1] + i[1][1]) + LQ_TRUE * (i[1][1] - i[0][1]) / 1e-4 + LD_TRUE * wd +
                4 * PSI_TRUE * 0.5 * (w[0] + w[1])),
        (float)i[0][0], (float)i[0][1], (float)w[0],
        (float)fmod(4 * (100 * k * 1e-4 - 60 / (2 * PI * 3) * cos(2 * PI * 3 * k * 1e-4)), 2 * PI));
}

// The voltage of a settled point at the same currents and speed.
static float machine_row_settled(const dqw_sample *s, int axis)
{
    const double w = 4 * (double)s->w_m_rad_s;
    return (float)(axis == 0 ? R_TRUE * (double)s->i_d_A - w * LQ_TRUE * (double)s->i_q_A
                             : R_TRUE * (double)s->i_q_A + w * (LD_TRUE * (double)s->i_d_A + PSI_TRUE));
}

// Electrical speed; the voltage of the next period as a vector in this sample's frame.
static dqw_sample machine_row_adapted(int k)
{
    dqw_sample s = machine_row(k);
    const dqw_sample next = machine_row(k + 1);
    const double turn = 1.5 * 4 * (double)next.w_m_rad_s * 1e-4;
    s.v_d_V = (float)(cos(turn) * (double)next.v_d_V - sin(turn) * (double)next.v_q_V);
    s.v_q_V = (float)(sin(turn) * (double)next.v_d_V + cos(turn) * (double)next.v_q_V);
    s.w_m_rad_s *= 4.0f;
    return s;
}

// A fifth of the time bits alone, else a machine's rows with some among them: blocks are learned, and what the wild
// ones taught is used.
static dqw_sample wild_sample(test_random *r, int k)
{
    dqw_sample s = {0};
    bits(r, &s.v_d_V, 9);
    if (k / 500 % 5 == 4) return s;
    const float odd = s.v_d_V;
    s = machine_row(k);
    if (random_bits(r) % 500 == 0) (&s.v_d_V)[random_bits(r) % 7] = odd;
    return s;
}

static dqw_estimator_config config_of(int way)
{
    const dqw_estimator_config c = {.dt_s = 1e-4f,
                                    .v_base_V = 180.0f,
                                    .i_base_A = 15.0f,
                                    .w_base_rad_s = 200.0f,
                                    .R_ohm = way & 4 ? 0.0f : (float)R_TRUE,
                                    .Ld_H = way & 4 ? 0.0f : (float)LD_TRUE,
                                    .Lq_H = way & 4 ? 0.0f : (float)LQ_TRUE,
                                    .psi_Wb = way & 4 ? 0.0f : (float)PSI_TRUE,
                                    .pole_pairs = 4,
                                    .half_window = 5,
                                    .stale_limit = 10,
                                    .v_limit_V = way & 1 ? 250.0f : 0.0f,
                                    .i_limit_A = way & 1 ? 30.0f : 0.0f,
                                    .dead_time_width_A = way & 2 ? 0.2f : 0.0f,
                                    .modulation = way & 1 ? DQW_MODULATION_MASK : DQW_MODULATION_CLAMPED_60,
                                    .angle = (way & 2) != 0,
                                    .encoder_offset = (way & 4) != 0,
                                    .follow = (way & 2) != 0,
                                    .noise_on_inputs = (way & 1) != 0};
    return c;
}

static void is_sound(const dqw_estimator *e, int samples)
{
    TEST_ASSERT_EQUAL_UINT32((uint32_t)samples,
                             e->gate.accepted + e->gate.nonfinite + e->gate.saturated + e->gate.stale);
    HOLDS(e->gate.blocks > 100 && e->gate.nonfinite > 100);
    for (int i = 0; i < e->inputs; i++) {
        HOLDS(isfinite(e->w_pu[i]) && e->gain.d[i] > 0.0f && isfinite(e->gain.d[i]));
        HOLDS(isfinite(dqw_estimator_value(e, i)));
        HOLDS(dqw_estimator_sd(e, i) >= 0.0f && dqw_estimator_sd(e, i) <= DQW_UNKNOWN);
        HOLDS(e->excess_q10[i] >= -1024 && e->excess_q10[i] <= 7 * 1024);
        for (int j = i + 1; j < e->inputs; j++) HOLDS(isfinite(e->gain.u[DQW_GAIN_U(i, j)]));
    }
    for (int axis = 0; axis < 2; axis++)
        HOLDS(isfinite(e->e_pu[axis]) && isfinite(e->error_pu2[axis]) && e->error_pu2[axis] >= 0.0f);
    HOLDS(isfinite(e->noise.of.i_d_A2) && isfinite(e->noise.of.i_q_A2) && isfinite(e->noise.of.w_rad2_s2));
    HOLDS(isfinite(dqw_estimator_residual_pu(e)) && isfinite(dqw_estimator_recent_pu(e)) && isfinite(e->late_pu2) &&
          isfinite(e->late_error_pu2));
}

// Everything that a caller may ask, of any parameter.
static void read_all(const dqw_estimator *e, uint64_t z)
{
    const dqw_reading x = dqw_estimator_read(e, (enum dqw_parameter)((int)(z % 9) - 1));
    HOLDS(isfinite(x.value) && x.sd >= 0.0f && x.sd <= DQW_UNKNOWN);
    float w[DQW_EFFECT_STARTS] = {0};
    float sd[DQW_EFFECT_STARTS] = {0};
    (void)dqw_estimator_read_effect(e, (int)(z >> 8) % 10 - 1, w, sd);
    for (int i = 0; i < DQW_EFFECT_STARTS; i++) HOLDS(isfinite(w[i]) && sd[i] >= 0.0f && sd[i] <= DQW_UNKNOWN);
    HOLDS((unsigned)dqw_estimator_voltage_acts(e) <= DQW_VOLTAGE_NEXT);
}

static void test_estimator(void)
{
    static const dqw_effect_config list[] = {{.effect = DQW_EFFECT_DEAD_TIME, .shape = {0.3f}, .start = {1}},
                                             {.effect = DQW_EFFECT_WINDING_TEMPERATURE, .shape = {25, 10}},
                                             {.effect = DQW_EFFECT_MAGNET_TEMPERATURE, .shape = {25, 0}},
                                             {.effect = DQW_EFFECT_SATURATION, .shape = {15}},
                                             {.effect = DQW_EFFECT_DELAY},
                                             {.effect = DQW_EFFECT_CURRENT_OFFSET, .shape = {0.9f, 2.2e-3f, 2.8e-3f}},
                                             {.effect = DQW_EFFECT_IRON_LOSS, .shape = {0.9f, 2.2e-3f, 2.8e-3f}}};
    static dqw_estimator_random lent;
    enum { WAYS = 12 };
    for (int way = 0; way < WAYS; way++) {
        CASE("way %d", way);
        // 8: settled; 9: effects; 10: adapted samples; 11: pole pairs not given.
        dqw_estimator_config c = config_of(way < 8 ? way : 7);
        c.settled = way == 8;
        if (way == 9) c.effects = list, c.effect_count = sizeof list / sizeof list[0], c.angle = true;
        if (way == 10) c.voltage_next = c.voltage_held = c.speed_electrical = true;
        if (way == 11) c.pole_pairs = 0;
        if (way == 3 || way == 6) c.angle_late_s = way == 3 ? 2.0f * c.dt_s : -c.dt_s;
        if (way % 3 == 2) c.random = &lent, dqw_estimator_random_init(&lent);
        dqw_estimator e;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&e, &c));
        test_random r = {(uint64_t)(40 + way)};
        const int wild = scaled(steps) / 4;
        int one_missing = 0;
        for (int k = 0; k < wild; k++) {
            dqw_sample s = wild_sample(&r, k);
            if (random_bits(&r) % 3000 == 0) s.temp_winding_C = random_float_bits(&r);
            s.resting = (uint8_t)(random_bits(&r) & 255u);
            (void)dqw_estimator_sample(&e, &s, random_bits(&r) % 512 == 0);
            if (random_bits(&r) % 16 != 0) (void)dqw_estimator_background(&e);
            if (k % 5000 == 4999) {
                dqw_estimator_missing(&e, (uint32_t)(k % 4));
                one_missing += k % 4 == 1;
            }
            if (e.stage.name == DQW_STAGE_DOMAIN && k % 1000 == 0) {
                if (c.random != NULL) dqw_estimator_random_init(&lent);
                TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_define(&e, &c));
            }
            read_all(&e, random_bits(&r));
        }
        is_sound(&e, wild + one_missing);
        // A healthy machine afterwards, with nothing between its rows.
        if (way == 9 || way == 11) continue;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_define(&e, &c));
        dqw_estimator_missing(&e, 0);
        if (c.random != NULL) dqw_estimator_random_init(&lent);
        for (int k = 0; k < 60000; k++) {
            dqw_sample s = machine_row(k);
            if (way == 8) s.v_d_V = machine_row_settled(&s, 0), s.v_q_V = machine_row_settled(&s, 1);
            if (way == 10) s = machine_row_adapted(k);
            (void)dqw_estimator_sample(&e, &s, false);
            (void)dqw_estimator_background(&e);
        }
        static const double truth[] = {R_TRUE, LD_TRUE, LQ_TRUE, PSI_TRUE};
        for (int i = 0; i < 4; i++) {
            CASE("way %d, parameter %d", way, i);
            BETWEEN(-0.02, (double)dqw_estimator_read(&e, (enum dqw_parameter)i).value / truth[i] - 1, 0.02);
        }
    }
}

static void test_monitor(void)
{
    static dqw_estimator_random lent;
    for (int way = 0; way < 4; way++) {
        CASE("way %d", way);
        // Thresholds that any residual meets: it gets into service, and looks at every channel.
        dqw_monitor_config c = {.estimator = config_of(way), .J_kgm2 = way & 2 ? 1e-3f : 0.0f};
        c.estimator.threshold_ppm = way == 0 ? 0 : UINT32_MAX;
        c.estimator.random = way % 2 == 1 ? &lent : NULL;
        dqw_estimator_random_init(&lent);
        dqw_monitor m;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_monitor_init(&m, &c));
        test_random r = {(uint64_t)(50 + way)};
        const int wild = scaled(steps) / 2;
        int events = 0;
        dqw_monitor_stored stored;
        memset(&stored, 0, sizeof stored);
        for (int k = 0; k < wild; k++) {
            const dqw_sample s = wild_sample(&r, k);
            (void)dqw_monitor_sample(&m, &s, random_bits(&r) % 512 == 0);
            dqw_monitor_change e;
            if (random_bits(&r) % 16 != 0 && dqw_monitor_background(&m)) {
                HOLDS(dqw_monitor_event(&m, &e));
                events++;
                HOLDS((unsigned)e.parameter < DQW_WATCH_CHANNELS && (unsigned)e.fault.name < DQW_FAULT_NAMES &&
                      e.fault.phase < 3);
                HOLDS(e.fault.confidence >= 0.0f && e.fault.confidence <= 1.001f);
                HOLDS(e.sample <= 5ull * m.estimator.halves && e.since <= e.sample);
                HOLDS(isfinite(e.value) && isfinite(e.healthy));
            }
            if (m.estimator.stage.name == DQW_STAGE_DOMAIN && k % 1000 == 0) {
                // Its memory is refilled, what was lent too.
                dqw_estimator_random_init(&lent);
                TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_monitor_define(&m, &c));
            }
            const uint64_t z = random_bits(&r);
            const enum dqw_monitor_channel channel = (enum dqw_monitor_channel)((int)(z % 16) - 1);
            const dqw_reading x = dqw_monitor_read(&m, channel);
            HOLDS(isfinite(x.value) && x.sd >= 0.0f && x.sd <= DQW_UNKNOWN);
            const float least = dqw_monitor_sensitivity(&m, channel);
            HOLDS(least > 0.0f && least <= DQW_UNKNOWN);
            HOLDS((unsigned)dqw_monitor_why(&m) < DQW_WHYS);
            const enum dqw_why unwatched = dqw_monitor_unwatched(&m, channel);
            HOLDS((least < DQW_UNKNOWN) == (unwatched == DQW_WHY_IN_SERVICE || unwatched == DQW_WHY_COARSE));
            // What was taken can be given back.
            if (z % 5000 == 0 && dqw_monitor_store(&m, &stored)) HOLDS(dqw_monitor_restore(&m, &stored) == DQW_OK);
            if (z % 5000 == 1) {
                dqw_monitor_stored wild_store = stored;
                ((unsigned char *)&wild_store)[(z >> 20) % sizeof wild_store] ^= (unsigned char)(1u
                                                                                                 << ((z >> 40) & 7u));
                HOLDS(dqw_monitor_restore(&m, &wild_store) != DQW_OK);
            }
        }
        const dqw_gate *g = &m.estimator.gate;
        TEST_ASSERT_EQUAL_UINT32((uint32_t)wild, g->accepted + g->nonfinite + g->saturated + g->stale);
        for (int i = 0; i < DQW_PARAMETERS; i++) HOLDS(isfinite(m.estimator.w_pu[i]));
        for (int i = 0; i < DQW_WATCH_OFFSET; i++) HOLDS(isfinite(m.healthy.weight[i]));
        for (int k = 0; k < DQW_WITNESS_INPUTS; k++)
            HOLDS(isfinite(m.witness.re[k]) && isfinite(m.witness.im[k]) && isfinite(m.witness.power[k]));
        if (getenv("DQW_TEST_VALUES") != NULL)
            printf("way %d: %d events, stage %d, %u ways back\n", way, events, (int)m.estimator.stage.name,
                   (unsigned)m.estimator.stage.times_back);
    }
}

// A block and an estimator's object with bits in everything that the witness reads but its structure.
static void test_witness(void)
{
    const dqw_estimator_config c = config_of(2);
    dqw_estimator e;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&e, &c));
    test_random r = {60};
    dqw_witness w;
    dqw_witness_init(&w);
    dqw_estimator_block b;
    memset(&b, 0, sizeof b);
    int learned = 0;
    for (int k = 0; k < scaled(steps) / 2; k++) {
        // Within what an estimator hands over: samples up to ten bases, weights below 1e4, finite errors.
        for (int n = 0; n < DQW_PLAIN_SIGNALS; n++)
            b.sum[n] = (float)(pow(10, random_uniform(&r, -8, 2)) * random_normal(&r));
        b.sum[8] = (float)(random_normal(&r) * 600);
        const double theta_rad = random_uniform(&r, -PI, PI);
        b.cosine = (float)cos(theta_rad);
        b.sine = (float)sin(theta_rad);
        for (int n = 0; n < 4; n++) e.w_pu[n] = (float)(pow(10, random_uniform(&r, -8, 3)) * random_normal(&r));
        for (int n = 0; n < 2; n++) e.e_pu[n] = (float)(pow(10, random_uniform(&r, -8, 5)) * random_normal(&r));
        if (random_bits(&r) % 4 == 0) b.sum[random_bits(&r) % DQW_PLAIN_SIGNALS] = random_float_bits(&r) * 1e-30f;
        if (random_bits(&r) % 4 == 0) b.sine = random_float_bits(&r);
        if (random_bits(&r) % 4 == 0) e.e_pu[random_bits(&r) % 2] = random_float_bits(&r) * 1e-30f;
        learned += dqw_witness_learn(&w, &e, &b);
        for (int i = 0; i < DQW_WITNESS_INPUTS; i++) {
            CASE("step %d, input %d", k, i);
            HOLDS(isfinite(w.re[i]) && isfinite(w.im[i]) && isfinite(w.power[i]) && w.power[i] >= 0.0f);
            HOLDS(!isnan(dqw_witness_size(&w, (enum dqw_witness_input)i)) &&
                  !isnan(dqw_witness_sd(&w, &e, (enum dqw_witness_input)i)));
        }
    }
    HOLDS(learned > scaled(steps) / 50);
}

static void test_fault_change_and_noise(void)
{
    test_random r = {70};
    int named = 0;
    for (int k = 0; k < scaled(steps) / 4; k++) {
        float change[DQW_SIGNS];
        float unit[DQW_SIGNS];
        bits(&r, change, DQW_SIGNS);
        bits(&r, unit, DQW_SIGNS);
        if (k % 2 == 1)
            for (int i = 0; i < DQW_SIGNS; i++) {
                change[i] = (float)(pow(10, random_uniform(&r, -20, 10)) * random_normal(&r));
                unit[i] = (float)pow(10, random_uniform(&r, -15, 10));
            }
        const dqw_fault_machine machine = {random_float_bits(&r), random_float_bits(&r), random_float_bits(&r),
                                           k % 4 > 1, random_float_bits(&r)};
        const dqw_fault_verdict v = dqw_fault_name_it(change, unit, machine);
        HOLDS((unsigned)v.name > DQW_FAULT_NONE && (unsigned)v.name < DQW_FAULT_NAMES && v.phase < 3);
        named += v.name != DQW_FAULT_UNKNOWN;
    }
    HOLDS(named > scaled(steps) / 100);
    dqw_change c;
    dqw_change_init(&c);
    for (int k = 0; k < scaled(steps); k++) {
        const uint64_t z = random_bits(&r);
        const uint8_t limit = (uint8_t)(1 + (z >> 40) % 255);
        const bool full = dqw_change_step(&c, (int32_t)(uint32_t)z, limit);
        HOLDS(full == (c.sum_q5 == limit) && c.sum_q5 <= limit);
    }
    // What is not finite is the caller's to keep out; what is left behind goes with a new start.
    dqw_noise n;
    dqw_noise_init(&n);
    for (int k = 0; k < scaled(steps); k++) {
        float x[3];
        bits(&r, x, 3);
        dqw_noise_step(&n, x[0], x[1], x[2], x[k % 3]);
        if (k % 1000 == 0) dqw_noise_gap(&n);
        HOLDS(!isnan(dqw_noise_variance(n.of.i_d_A2)) && dqw_noise_variance(n.of.w_rad2_s2) >= 0.0f);
    }
    TEST_ASSERT_EQUAL_UINT16(scaled(steps) > 9000 ? DQW_NOISE_MEMORY : n.of.rows, n.of.rows);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_transforms);
    RUN_TEST(test_learner);
    RUN_TEST(test_random_learner);
    RUN_TEST(test_ordinal);
    RUN_TEST(test_window);
    RUN_TEST(test_model);
    RUN_TEST(test_gate_and_stage);
    RUN_TEST(test_effect_lists);
    RUN_TEST(test_shaft);
    RUN_TEST(test_tapped);
    RUN_TEST(test_estimator);
    RUN_TEST(test_monitor);
    RUN_TEST(test_witness);
    RUN_TEST(test_fault_change_and_noise);
    return UNITY_END();
}
