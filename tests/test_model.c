// The machine's equations in pairs and blocks against a finely integrated machine, and the readout against joint least squares.
#include "dqw_model.h"
#include "dqw_test.h"
#include "dqw_window.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

typedef struct machine {
    double R, Ld, Lq, psi, p;
} machine;

static const machine servo = {0.9, 2.2e-3, 2.8e-3, 0.12, 4};

// One period with the stationary-frame voltage held: Runge-Kutta in the rotating frame, whose voltage turns backward.
typedef struct period {
    dqw_sample start;
    double i_d, i_q;  ///< means over the period
    double wi_d, wi_q;
} period;

typedef struct state {
    double i_d, i_q, theta, w_m;
} state;

static void slope(const machine *m, const state *s, double v_alpha, double v_beta, double out[2], double v[2])
{
    const double w_e = m->p * s->w_m;
    v[0] = cos(s->theta) * v_alpha + sin(s->theta) * v_beta;
    v[1] = cos(s->theta) * v_beta - sin(s->theta) * v_alpha;
    out[0] = (v[0] - m->R * s->i_d + w_e * m->Lq * s->i_q) / m->Ld;
    out[1] = (v[1] - m->R * s->i_q - w_e * (m->Ld * s->i_d + m->psi)) / m->Lq;
}

static period integrate(const machine *m, state *s, double v_alpha, double v_beta, double dt, double acceleration)
{
    enum { STEPS = 200 };
    const double h = dt / STEPS;
    period out = {.start = {.i_d_A = (float)s->i_d, .i_q_A = (float)s->i_q, .w_m_rad_s = (float)s->w_m}};
    double v_d = 0.0;
    double v_q = 0.0;
    for (int k = 0; k < STEPS; k++) {
        double k1[2], k2[2], k3[2], k4[2], v[2], v_mid[2], v_end[2];
        state a = *s;
        slope(m, &a, v_alpha, v_beta, k1, v);
        a.theta = s->theta + 0.5 * h * m->p * (s->w_m + 0.25 * h * acceleration);
        a.w_m = s->w_m + 0.5 * h * acceleration;
        a.i_d = s->i_d + 0.5 * h * k1[0];
        a.i_q = s->i_q + 0.5 * h * k1[1];
        slope(m, &a, v_alpha, v_beta, k2, v_mid);
        a.i_d = s->i_d + 0.5 * h * k2[0];
        a.i_q = s->i_q + 0.5 * h * k2[1];
        slope(m, &a, v_alpha, v_beta, k3, v_mid);
        const state middle = a;
        a.theta = s->theta + h * m->p * (s->w_m + 0.5 * h * acceleration);
        a.w_m = s->w_m + h * acceleration;
        a.i_d = s->i_d + h * k3[0];
        a.i_q = s->i_q + h * k3[1];
        slope(m, &a, v_alpha, v_beta, k4, v_end);
        const double d = s->i_d + h / 6 * (k1[0] + 2 * k2[0] + 2 * k3[0] + k4[0]);
        const double q = s->i_q + h / 6 * (k1[1] + 2 * k2[1] + 2 * k3[1] + k4[1]);
        v_d += (v[0] + 4 * v_mid[0] + v_end[0]) / 6 / STEPS;
        v_q += (v[1] + 4 * v_mid[1] + v_end[1]) / 6 / STEPS;
        out.i_d += (s->i_d + 4 * middle.i_d + d) / 6 / STEPS;
        out.i_q += (s->i_q + 4 * middle.i_q + q) / 6 / STEPS;
        out.wi_d += (s->w_m * s->i_d + 4 * middle.w_m * middle.i_d + a.w_m * d) / 6 / STEPS;
        out.wi_q += (s->w_m * s->i_q + 4 * middle.w_m * middle.i_q + a.w_m * q) / 6 / STEPS;
        s->theta = a.theta;
        s->w_m = a.w_m;
        s->i_d = d;
        s->i_q = q;
    }
    out.start.v_d_V = (float)v_d;
    out.start.v_q_V = (float)v_q;
    return out;
}

typedef struct errors {
    double v, i, wi;  ///< largest residual of the voltage equations over blocks, V; of the mean currents, A; times w
} errors;

static double residual(const machine *m, const dqw_block *b)
{
    float x_d[DQW_D_INPUTS];
    float x_q[DQW_Q_INPUTS];
    dqw_model_inputs(b, x_d, x_q);
    const double d = b->v_d_V - m->R * x_d[DQW_IN_R] - m->Ld * x_d[DQW_IN_L] - m->p * m->Lq * x_d[DQW_IN_CROSS];
    const double q = b->v_q_V - m->R * x_q[DQW_IN_R] - m->Lq * x_q[DQW_IN_L] - m->p * m->Ld * x_q[DQW_IN_CROSS] - m->p * m->psi * x_q[DQW_IN_FLUX];
    return hypot(d, q);
}

// Blocks of 2 x 20 pairs; a voltage about what holds the current, redrawn every three periods.
static errors blocks(const machine *m, double w_e, double dt, bool correct, double acceleration)
{
    test_random r = {31};
    state s = {2.0, 5.0, 0.7, w_e / m->p};
    dqw_window window;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_window_init(&window, 20, DQW_BLOCK_SIGNALS));
    const dqw_parameters known = {
        .R_ohm = (float)m->R, .Ld_H = (float)m->Ld, .Lq_H = (float)m->Lq, .psi_Wb = (float)m->psi, .pole_pairs = (uint16_t)m->p, .known = 31};
    errors worst = {0, 0, 0};
    double mean[4] = {0};
    double held[2] = {0};
    period last = {{0}, 0, 0, 0, 0};
    period all[41];
    for (int k = 0; k <= 400; k++) {
        if (k % 3 == 0) {
            held[0] = 20 * random_normal(&r);
            held[1] = 20 * random_normal(&r);
        }
        const double w = m->p * s.w_m;
        const double middle = s.theta + 0.5 * w * dt;
        const double v_d = m->R * s.i_d - w * m->Lq * s.i_q - 3 * s.i_d + held[0];
        const double v_q = m->R * s.i_q + w * (m->Ld * s.i_d + m->psi) - 3 * (s.i_q - 5) + held[1];
        const period now = integrate(m, &s, cos(middle) * v_d - sin(middle) * v_q, sin(middle) * v_d + cos(middle) * v_q, dt, acceleration);
        if (k > 0) {
            const dqw_block b = dqw_model_pair(&last.start, &now.start, (float)dt);
            const float x[] = {b.v_d_V, b.v_q_V, b.i_d_A, b.i_q_A, b.di_d_A_s, b.di_q_A_s, b.wi_d_A_rad_s, b.wi_q_A_rad_s, b.w_m_rad_s};
            float y[DQW_BLOCK_SIGNALS];
            for (int n = 0; n < 40; n++) all[n] = all[n + 1];
            all[39] = last;
            if (dqw_window_step(&window, x, y) == DQW_EVENT_LEARNED) {
                dqw_block c = {y[0], y[1], y[2], y[3], y[4], y[5], y[6], y[7], y[8]};
                if (correct) dqw_model_correct(&c, &known, (float)dt);
                for (int n = 0; n < 4; n++) mean[n] = 0.0;
                for (int n = 0; n < 40; n++) {
                    const double weight = (n < 20 ? n + 1 : 40 - n) / 420.0;
                    mean[0] += weight * all[n].i_d;
                    mean[1] += weight * all[n].i_q;
                    mean[2] += weight * all[n].wi_d;
                    mean[3] += weight * all[n].wi_q;
                }
                worst.v = fmax(worst.v, residual(m, &c));
                worst.i = fmax(worst.i, hypot(c.i_d_A - mean[0], c.i_q_A - mean[1]));
                worst.wi = fmax(worst.wi, hypot(c.wi_d_A_rad_s - mean[2], c.wi_q_A_rad_s - mean[3]));
            }
        }
        last = now;
    }
    return worst;
}

static void test_the_integrator_of_this_test(void)
{
    // Locked rotor: i = v / R (1 - exp(-R t / L)).
    state s = {0, 0, 0, 0};
    (void)integrate(&servo, &s, 10.0, 0.0, 1e-3, 0.0);
    BETWEEN(-1e-12, s.i_d - 10 / servo.R * (1 - exp(-servo.R * 1e-3 / servo.Ld)), 1e-12);
}

static void test_slow_machine_satisfies_the_pair_equation(void)
{
    const errors e = blocks(&servo, 20.0, 1e-4, false, 0.0);
    BETWEEN(1e-6, e.v, 3e-3);
    const errors c = blocks(&servo, 20.0, 1e-4, true, 0.0);
    BETWEEN(1e-6, c.v, 3e-3);
}

static void test_correction_gains_a_factor_of_ten(void)
{
    // w_e dt = 0.2
    const errors plain = blocks(&servo, 2000.0, 1e-4, false, 0.0);
    const errors better = blocks(&servo, 2000.0, 1e-4, true, 0.0);
    BETWEEN(0.1, plain.v, 2.0);
    BETWEEN(10.0, plain.v / better.v, 1000.0);
    BETWEEN(10.0, plain.i / better.i, 1000.0);
    BETWEEN(10.0, plain.wi / better.wi, 1000.0);
    // And while the speed changes by 10 % within the 40 ms of the log.
    const errors fast_plain = blocks(&servo, 2000.0, 1e-4, false, 1250.0);
    const errors fast = blocks(&servo, 2000.0, 1e-4, true, 1250.0);
    BETWEEN(10.0, fast_plain.v / fast.v, 1000.0);
}

// Without correction the error of the mean current falls with the square of the period, with it faster.
static void test_order_of_the_pair_equation(void)
{
    const errors coarse = blocks(&servo, 1000.0, 4e-4, false, 0.0);
    const errors fine = blocks(&servo, 1000.0, 2e-4, false, 0.0);
    BETWEEN(3.0, coarse.i / fine.i, 5.5);
    const errors coarse_c = blocks(&servo, 2000.0, 1e-4, true, 0.0);
    const errors fine_c = blocks(&servo, 2000.0, 0.5e-4, true, 0.0);
    BETWEEN(6.0, coarse_c.i / fine_c.i, 40.0);
}

static void test_correction_is_left_out_where_it_must_be(void)
{
    const dqw_block before = {10, 200, 3, 4, 1000, -2000, 1500, 2000, 500};
    const dqw_parameters good = {.R_ohm = 0.9f, .Ld_H = 2.2e-3f, .Lq_H = 2.8e-3f, .psi_Wb = 0.12f, .pole_pairs = 4, .known = 31};
    dqw_block b = before;
    dqw_model_correct(&b, &good, 1e-4f);
    TEST_ASSERT_TRUE(b.i_d_A != before.i_d_A && b.i_q_A != before.i_q_A);
    static const uint8_t missing[] = {DQW_KNOWS_R, DQW_KNOWS_LD, DQW_KNOWS_LQ};
    for (int k = 0; k < 3; k++) {
        dqw_parameters less = good;
        less.known &= (uint8_t)~missing[k];
        b = before;
        dqw_model_correct(&b, &less, 1e-4f);
        TEST_ASSERT_EQUAL_MEMORY(&before, &b, sizeof b);
    }
    dqw_parameters odd[8];
    for (int k = 0; k < 8; k++) odd[k] = good;
    odd[0].pole_pairs = 0;
    odd[1].Ld_H = -1e-3f;
    odd[2].Lq_H = 0.0f;
    odd[3].R_ohm = 100.0f;   // R dt / L above 1
    odd[4].pole_pairs = 60;  // w_e dt above 1
    odd[5].Ld_H = NAN;
    odd[6].R_ohm = NAN;
    odd[7].Lq_H = 1e-30f;
    for (int k = 0; k < 8; k++) {
        CASE("case %d", k);
        b = before;
        dqw_model_correct(&b, &odd[k], 1e-4f);
        TEST_ASSERT_EQUAL_MEMORY(&before, &b, sizeof b);
    }
}

static void test_static_row_and_inputs(void)
{
    const dqw_sample s = {.v_d_V = 1, .v_q_V = 2, .i_d_A = 3, .i_q_A = 4, .w_m_rad_s = 5};
    const dqw_block b = dqw_model_static(&s);
    float x_d[DQW_D_INPUTS];
    float x_q[DQW_Q_INPUTS];
    dqw_model_inputs(&b, x_d, x_q);
    const float d[] = {3, 0, -20};
    const float q[] = {4, 0, 15, 5};
    TEST_ASSERT_EQUAL_MEMORY(d, x_d, sizeof d);
    TEST_ASSERT_EQUAL_MEMORY(q, x_q, sizeof q);
    TEST_ASSERT_EQUAL_FLOAT(1, b.v_d_V);
    TEST_ASSERT_EQUAL_FLOAT(2, b.v_q_V);
    const dqw_sample t = {.v_d_V = 9, .v_q_V = 9, .i_d_A = 5, .i_q_A = 0, .w_m_rad_s = 7};
    const dqw_block pair = dqw_model_pair(&s, &t, 0.5f);
    const dqw_block expected = {1, 2, 4, 2, 4, -8, 25, 10, 6};
    TEST_ASSERT_EQUAL_MEMORY(&expected, &pair, sizeof pair);
}

// ---- readout ----

typedef struct axes {
    dqw_axis d, q;
    test_ls joint;  ///< R, Ld, Lq, psi in bases; p given
    double noise_d, noise_q;
} axes;

#define I_BASE 10.0
#define W_BASE 200.0
#define V_BASE 200.0

static void begin(axes *a, double p)
{
    memset(a, 0, sizeof *a);
    dqw_learner_config c = {.inputs = DQW_D_INPUTS, .step_size = 0.5f, .y_base = (float)V_BASE};
    c.x_base[DQW_IN_R] = (float)I_BASE;
    c.x_base[DQW_IN_L] = (float)(I_BASE * W_BASE * p);
    c.x_base[DQW_IN_CROSS] = (float)(I_BASE * W_BASE);
    c.x_base[DQW_IN_FLUX] = (float)W_BASE;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_axis_init(&a->d, &c));
    c.inputs = DQW_Q_INPUTS;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_axis_init(&a->q, &c));
    ls_begin(&a->joint, 4, 0.0);
}

// What one block may vary.
enum { CURRENTS = 1, SLOPES = 2, SPEED = 4 };

static void feed(axes *a, const machine *m, int vary, int count, double noise_d, double noise_q, uint64_t seed)
{
    test_random r = {seed};
    for (int k = 0; k < count; k++) {
        dqw_block b = {0, 0, 3, 4, 0, 0, 0, 0, 100};
        if (vary & CURRENTS) {
            b.i_d_A = (float)(4 * random_normal(&r));
            b.i_q_A = (float)(4 * random_normal(&r));
        }
        if (vary & SPEED) b.w_m_rad_s = (float)(100 * random_normal(&r));
        if (vary & SLOPES) {
            b.di_d_A_s = (float)(2000 * random_normal(&r));
            b.di_q_A_s = (float)(2000 * random_normal(&r));
        }
        b.wi_d_A_rad_s = b.w_m_rad_s * b.i_d_A;
        b.wi_q_A_rad_s = b.w_m_rad_s * b.i_q_A;
        float x_d[DQW_D_INPUTS];
        float x_q[DQW_Q_INPUTS];
        dqw_model_inputs(&b, x_d, x_q);
        const double e_d = noise_d * random_normal(&r);
        const double e_q = noise_q * random_normal(&r);
        const float v_d = (float)(m->R * x_d[0] + m->Ld * x_d[1] + m->p * m->Lq * x_d[2] + e_d);
        const float v_q = (float)(m->R * x_q[0] + m->Lq * x_q[1] + m->p * m->Ld * x_q[2] + m->p * m->psi * x_q[3] + e_q);
        uint32_t mask_d = 0;
        uint32_t mask_q = 0;
        for (int i = 0; i < DQW_D_INPUTS; i++) mask_d |= (x_d[i] != 0.0f ? 1u : 0u) << i;
        for (int i = 0; i < DQW_Q_INPUTS; i++) mask_q |= (x_q[i] != 0.0f ? 1u : 0u) << i;
        (void)dqw_axis_learn(&a->d, x_d, v_d, mask_d);
        (void)dqw_axis_learn(&a->q, x_q, v_q, mask_q);
        if (noise_d > 0 && noise_q > 0) {
            const double row_d[] = {x_d[0] / noise_d, x_d[1] / noise_d, m->p * x_d[2] / noise_d, 0.0};
            const double row_q[] = {x_q[0] / noise_q, m->p * x_q[2] / noise_q, x_q[1] / noise_q, m->p * x_q[3] / noise_q};
            ls_add(&a->joint, row_d, v_d / noise_d);
            ls_add(&a->joint, row_q, v_q / noise_q);
        }
    }
}

static void values(const dqw_parameters *r, double value[4], double sd[4])
{
    const double v[] = {r->R_ohm, r->Ld_H, r->Lq_H, r->psi_Wb};
    const double s[] = {r->R_sd_ohm, r->Ld_sd_H, r->Lq_sd_H, r->psi_sd_Wb};
    memcpy(value, v, sizeof v);
    memcpy(sd, s, sizeof s);
}

// No parameter may be called known and be wrong: off by over 1 % and over 6 of its deviations.
static void no_wrong_number(const dqw_parameters *r, const machine *m)
{
    const double truth[] = {m->R, m->Ld, m->Lq, m->psi};
    static const char *const name[] = {"R", "Ld", "Lq", "psi"};
    double value[4];
    double sd[4];
    values(r, value, sd);
    for (int i = 0; i < 4; i++) {
        if (!(r->known >> i & 1u)) continue;
        const double off = fabs(value[i] - truth[i]);
        char message[300];
        (void)snprintf(message, sizeof message, "%s is called known as %g +- %g, is %g; %s", name[i], value[i], sd[i], truth[i], test_case);
        if (off > 0.01 * truth[i] && off > 6 * sd[i]) TEST_FAIL_MESSAGE(message);
    }
    if (r->known & DQW_KNOWS_POLE_PAIRS) HOLDS(r->pole_pairs == (uint16_t)m->p);
}

static void test_readout_is_joint_least_squares_of_both_axes(void)
{
    static const double noise[][2] = {{0.5, 0.5}, {0.2, 2.0}, {3.0, 0.3}};
    for (int c = 0; c < 3; c++) {
        CASE("noise %g V, %g V", noise[c][0], noise[c][1]);
        axes a;
        begin(&a, 4);
        feed(&a, &servo, CURRENTS | SLOPES | SPEED, 4000, noise[c][0], noise[c][1], (uint64_t)(400 + c));
        const dqw_parameters r = dqw_model_read(&a.d, &a.q, 4, DQW_WEIGHT_EACH);
        TEST_ASSERT_EQUAL_UINT8(31, r.known);
        double w[LS_MAX];
        double inverse[LS_MAX][LS_MAX];
        (void)ls_solve(&a.joint, w, inverse);
        double value[4];
        double sd[4];
        values(&r, value, sd);
        for (int i = 0; i < 4; i++) {
            const double s = sqrt(inverse[i][i]);
            BETWEEN(-0.1, (value[i] - w[i]) / s, 0.1);  // the axes' own noise estimates weigh them a little differently
            BETWEEN(0.93, sd[i] / s, 1.07);
        }
    }
}

static void test_readout_is_calibrated(void)
{
    int inside[4] = {0};
    const int runs = 200;
    for (int k = 0; k < runs; k++) {
        axes a;
        begin(&a, 4);
        feed(&a, &servo, CURRENTS | SLOPES | SPEED, 200, 1.0, 2.0, (uint64_t)(2000 + k));
        const dqw_parameters r = dqw_model_read(&a.d, &a.q, 4, DQW_WEIGHT_EACH);
        const double truth[] = {servo.R, servo.Ld, servo.Lq, servo.psi};
        double value[4];
        double sd[4];
        values(&r, value, sd);
        for (int i = 0; i < 4; i++)
            if (fabs(value[i] - truth[i]) < 1.96 * sd[i]) inside[i]++;
    }
    for (int i = 0; i < 4; i++) BETWEEN(180, inside[i], 198);
}

static void test_pole_pairs_are_found_or_refused(void)
{
    for (int p = 1; p <= 30; p++) {
        CASE("p = %d", p);
        machine m = servo;
        m.p = p;
        axes a;
        begin(&a, 1);
        feed(&a, &m, CURRENTS | SLOPES | SPEED, 3000, 0.2, 0.2, (uint64_t)(500 + p));
        const dqw_parameters r = dqw_model_read(&a.d, &a.q, 0, DQW_WEIGHT_EACH);
        TEST_ASSERT_TRUE(r.known & DQW_KNOWS_POLE_PAIRS);
        TEST_ASSERT_EQUAL_UINT16(p, r.pole_pairs);
        BETWEEN(p - 5 * r.pole_pairs_raw_sd, r.pole_pairs_raw, p + 5 * r.pole_pairs_raw_sd);
        no_wrong_number(&r, &m);
    }
    // So noisy that several integers would do: refused, and with it the flux; never a wrong integer.
    int found = 0;
    for (int k = 0; k < 200; k++) {
        CASE("seed %d", k);
        axes a;
        begin(&a, 1);
        feed(&a, &servo, CURRENTS | SLOPES | SPEED, 60, 10.0, 10.0, (uint64_t)(600 + k));
        const dqw_parameters r = dqw_model_read(&a.d, &a.q, 0, DQW_WEIGHT_EACH);
        if (r.known & DQW_KNOWS_POLE_PAIRS) {
            found++;
            TEST_ASSERT_EQUAL_UINT16(4, r.pole_pairs);
        } else {
            TEST_ASSERT_EQUAL_UINT16(0, r.pole_pairs);
            TEST_ASSERT_FALSE(r.known & DQW_KNOWS_PSI);
        }
    }
    BETWEEN(0, found, 60);
    // Given, it is taken as given.
    axes a;
    begin(&a, 1);
    const dqw_parameters r = dqw_model_read(&a.d, &a.q, 7, DQW_WEIGHT_EACH);
    TEST_ASSERT_EQUAL_UINT8(DQW_KNOWS_POLE_PAIRS, r.known);
    TEST_ASSERT_EQUAL_UINT16(7, r.pole_pairs);
}

// An input that is nothing but noise: its weight shrinks, its deviation falls with the blocks, and it must stay unknown.
static void test_noise_is_no_excitation(void)
{
    for (int blocks = 1000; blocks <= 16000; blocks *= 4) {
        CASE("%d blocks", blocks);
        axes a;
        begin(&a, 4);
        test_random r = {(uint64_t)blocks};
        for (int k = 0; k < blocks; k++) {
            // i_d is held; the slope that is measured is noise, and only a part of it moves the voltage.
            const double i_q = 5 * random_normal(&r), w = 100 + 20 * random_normal(&r), slope = 60 * random_normal(&r);
            dqw_block x = {0, 0, 2.0f, (float)i_q, (float)(slope + 150 * random_normal(&r)), 0, 0, 0, (float)w};
            x.wi_d_A_rad_s = x.w_m_rad_s * x.i_d_A;
            x.wi_q_A_rad_s = x.w_m_rad_s * x.i_q_A;
            x.v_d_V = (float)(0.9 * 2.0 + 2.2e-3 * slope - 4 * 2.8e-3 * w * i_q);
            float x_d[DQW_D_INPUTS];
            float x_q[DQW_Q_INPUTS];
            dqw_model_inputs(&x, x_d, x_q);
            (void)dqw_axis_learn(&a.d, x_d, x.v_d_V, 7u);
        }
        const double Ld = dqw_learner_weight(&a.d.neuron, DQW_IN_L);
        BETWEEN(0.10, Ld / 2.2e-3, 0.18);  // 0.136: 60^2 / (60^2 + 150^2) of the slope's power moves the voltage
        TEST_ASSERT_FALSE(dqw_model_read(&a.d, &a.q, 4, DQW_WEIGHT_EACH).known & DQW_KNOWS_LD);
    }
}

// Without magnet the axes change places: d' = q, q' = -d.
static void test_swapping_the_axes_swaps_the_inductances(void)
{
    axes a;
    axes b;
    begin(&a, 4);
    begin(&b, 4);
    test_random r = {700};
    for (int k = 0; k < 2000; k++) {
        dqw_block x = {0, 0, (float)random_normal(&r),        (float)random_normal(&r), (float)(2000 * random_normal(&r)), (float)(2000 * random_normal(&r)),
                       0, 0, (float)(100 * random_normal(&r))};
        x.wi_d_A_rad_s = x.w_m_rad_s * x.i_d_A;
        x.wi_q_A_rad_s = x.w_m_rad_s * x.i_q_A;
        x.v_d_V = (float)(0.9 * x.i_d_A + 2.2e-3 * x.di_d_A_s - 4 * 2.8e-3 * x.wi_q_A_rad_s + 0.3 * random_normal(&r));
        x.v_q_V = (float)(0.9 * x.i_q_A + 2.8e-3 * x.di_q_A_s + 4 * 2.2e-3 * x.wi_d_A_rad_s + 0.3 * random_normal(&r));
        const dqw_block y = {x.v_q_V, -x.v_d_V, x.i_q_A, -x.i_d_A, x.di_q_A_s, -x.di_d_A_s, x.wi_q_A_rad_s, -x.wi_d_A_rad_s, x.w_m_rad_s};
        float x_d[DQW_D_INPUTS];
        float x_q[DQW_Q_INPUTS];
        dqw_model_inputs(&x, x_d, x_q);
        (void)dqw_axis_learn(&a.d, x_d, x.v_d_V, 7u);
        (void)dqw_axis_learn(&a.q, x_q, x.v_q_V, 7u);
        dqw_model_inputs(&y, x_d, x_q);
        (void)dqw_axis_learn(&b.d, x_d, y.v_d_V, 7u);
        (void)dqw_axis_learn(&b.q, x_q, y.v_q_V, 7u);
    }
    const dqw_parameters one = dqw_model_read(&a.d, &a.q, 4, DQW_WEIGHT_EACH);
    const dqw_parameters two = dqw_model_read(&b.d, &b.q, 4, DQW_WEIGHT_EACH);
    TEST_ASSERT_EQUAL_UINT8(31 & ~DQW_KNOWS_PSI, one.known);
    TEST_ASSERT_EQUAL_UINT8(one.known, two.known);
    BETWEEN(-1e-4, two.R_ohm / one.R_ohm - 1, 1e-4);
    BETWEEN(-1e-4, two.Lq_H / one.Ld_H - 1, 1e-4);
    BETWEEN(-1e-4, two.Ld_H / one.Lq_H - 1, 1e-4);
    BETWEEN(-1e-3, two.R_sd_ohm / one.R_sd_ohm - 1, 1e-3);
    BETWEEN(-1e-3, two.Lq_sd_H / one.Ld_sd_H - 1, 1e-3);
    BETWEEN(-1e-3, two.pole_pairs_raw / one.pole_pairs_raw - 1, 1e-3);
}

static void test_nothing_learned_nothing_known(void)
{
    axes a;
    begin(&a, 4);
    TEST_ASSERT_EQUAL_UINT8(DQW_KNOWS_POLE_PAIRS, dqw_model_read(&a.d, &a.q, 4, DQW_WEIGHT_EACH).known);
    const dqw_parameters r = dqw_model_read(&a.d, &a.q, 0, DQW_WEIGHT_EACH);
    TEST_ASSERT_EQUAL_UINT8(0, r.known);
    TEST_ASSERT_TRUE(isnan(r.pole_pairs_raw));
}

// What varies, and what can be known from it with p given, statics and dynamics.
static void test_what_the_signals_cannot_teach_is_never_called_known(void)
{
    const machine machines[] = {servo, {0.012, 0.2e-3, 0.5e-3, 0.07, 4}, {0.1, 50e-6, 50e-6, 0.004, 21}};
    static const double noises[] = {0.0, 1e-4, 0.01, 0.5};
    static const int counts[] = {1, 2, 3, 5, 20, 1000, 10000};
    for (int given = 0; given < 2; given++)
        for (int m = 0; m < 3; m++)
            for (int vary = 0; vary < 8; vary++)
                for (int n = 0; n < 4; n++)
                    for (int c = 0; c < 7; c++) {
                        CASE("machine %d, vary %d, noise %g V, %d blocks, p %s", m, vary, noises[n], counts[c], given ? "given" : "not given");
                        axes a;
                        begin(&a, given ? machines[m].p : 1);
                        feed(&a, &machines[m], vary, counts[c], noises[n], noises[n], (uint64_t)(800 + c));
                        const dqw_parameters r = dqw_model_read(&a.d, &a.q, given ? (uint16_t)machines[m].p : 0, DQW_WEIGHT_EACH);
                        if (counts[c] > 8)
                            no_wrong_number(&r, &machines[m]);
                        else if (noises[n] == 0.0)
                            no_wrong_number(&r, &machines[m]);
                        // One operating point: two equations for R, Ld, Lq and psi together.
                        if (vary == 0) HOLDS(!(r.known & 15));
                        if (!(vary & (SLOPES | SPEED)) && !given) HOLDS(!(r.known & (DQW_KNOWS_LD | DQW_KNOWS_LQ)));
                    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_integrator_of_this_test);
    RUN_TEST(test_slow_machine_satisfies_the_pair_equation);
    RUN_TEST(test_correction_gains_a_factor_of_ten);
    RUN_TEST(test_order_of_the_pair_equation);
    RUN_TEST(test_correction_is_left_out_where_it_must_be);
    RUN_TEST(test_static_row_and_inputs);
    RUN_TEST(test_readout_is_joint_least_squares_of_both_axes);
    RUN_TEST(test_readout_is_calibrated);
    RUN_TEST(test_pole_pairs_are_found_or_refused);
    RUN_TEST(test_noise_is_no_excitation);
    RUN_TEST(test_swapping_the_axes_swaps_the_inductances);
    RUN_TEST(test_nothing_learned_nothing_known);
    RUN_TEST(test_what_the_signals_cannot_teach_is_never_called_known);
    return UNITY_END();
}
