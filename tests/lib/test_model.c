// The machine's equations in pairs and blocks against a finely integrated machine, and the end correction of a block's
// currents.
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
    const double d = b->v_d_V - m->R * b->i_d_A - m->Ld * b->di_d_A_s + m->p * m->Lq * b->wi_q_A_rad_s;
    const double q = b->v_q_V - m->R * b->i_q_A - m->Lq * b->di_q_A_s -
                     m->p * (m->Ld * b->wi_d_A_rad_s + m->psi * b->w_m_rad_s);
    return hypot(d, q);
}

// The window's two sides, one after the other.
static bool join(dqw_window *w, dqw_window_rise *rise, const dqw_block *pair, dqw_block *block)
{
    float x[DQW_BLOCK_SIGNALS];
    float y[DQW_WINDOW_SIGNALS];
    float sum[2];
    memcpy(x, pair, sizeof x);
    for (int i = 0; i < DQW_BLOCK_SIGNALS; i++) dqw_window_gather(&dqw_window_cells(w)[i], x[i]);
    dqw_window_count(w);
    if (!dqw_window_full(w)) return false;
    HOLDS(dqw_window_turn(w));
    const uint32_t event = dqw_window_join(w, rise, y, sum);
    dqw_handover_release(&w->over);
    memcpy(block, y, sizeof *block);
    return event == DQW_EVENT_BLOCK;
}

// Blocks of 2 x 20 pairs; a voltage about what holds the current, redrawn every three periods.
static errors blocks(const machine *m, double w_e, double dt, bool correct, double acceleration)
{
    test_random r = {31};
    state s = {2.0, 5.0, 0.7, w_e / m->p};
    dqw_window window;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_window_init(&window, 20, DQW_BLOCK_SIGNALS));
    dqw_window_rise rise = {.has = false};
    const dqw_machine known = {(float)m->R, (float)m->Ld, (float)m->Lq, (float)m->p};
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
        const period now = integrate(m, &s, cos(middle) * v_d - sin(middle) * v_q,
                                     sin(middle) * v_d + cos(middle) * v_q, dt, acceleration);
        if (k > 0) {
            const dqw_block b = dqw_model_pair(&last.start, &now.start, (float)dt);
            for (int n = 0; n < 40; n++) all[n] = all[n + 1];
            all[39] = last;
            dqw_block c;
            if (join(&window, &rise, &b, &c)) {
                if (correct) dqw_model_bow(&c, &known, (float)dt);
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
    const dqw_machine good = {0.9f, 2.2e-3f, 2.8e-3f, 4.0f};
    dqw_block b = before;
    dqw_model_bow(&b, &good, 1e-4f);
    TEST_ASSERT_TRUE(b.i_d_A != before.i_d_A && b.i_q_A != before.i_q_A);
    TEST_ASSERT_TRUE(b.wi_d_A_rad_s != before.wi_d_A_rad_s && b.wi_q_A_rad_s != before.wi_q_A_rad_s);
    TEST_ASSERT_TRUE(b.v_d_V == before.v_d_V && b.di_q_A_s == before.di_q_A_s && b.w_m_rad_s == before.w_m_rad_s);
    // By no block's own size: a choice by the block would bias.
    const dqw_block still = {0.5f, 80, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 0.0f, 500};
    b = still;
    dqw_model_bow(&b, &good, 2e-4f);
    // w_e v_q dt^2 / 12 L_d
    BETWEEN(0.9999, (double)b.i_d_A / (-2000.0 * 80.0 * 4e-8 / 12.0 / 2.2e-3), 1.0001);
    const dqw_machine odd[] = {{0.9f, -1e-3f, 2.8e-3f, 4.0f},    {0.9f, 2.2e-3f, 0.0f, 4.0f},
                               {100.0f, 2.2e-3f, 2.8e-3f, 4.0f}, {0.9f, 2.2e-3f, 2.8e-3f, 60.0f},
                               {0.9f, NAN, 2.8e-3f, 4.0f},       {NAN, 2.2e-3f, 2.8e-3f, 4.0f},
                               {0.9f, 2.2e-3f, 1e-30f, 4.0f},    {0.9f, 2.2e-3f, 2.8e-3f, NAN}};
    for (unsigned k = 0; k < sizeof odd / sizeof odd[0]; k++) {
        CASE("case %u", k);
        b = before;
        dqw_model_bow(&b, &odd[k], 1e-4f);
        TEST_ASSERT_EQUAL_MEMORY(&before, &b, sizeof b);
    }
}

static void test_static_row_and_pair(void)
{
    const dqw_sample s = {.v_d_V = 1, .v_q_V = 2, .i_d_A = 3, .i_q_A = 4, .w_m_rad_s = 5};
    const dqw_block b = dqw_model_static(&s);
    const dqw_block row = {1, 2, 3, 4, 0, 0, 15, 20, 5};
    TEST_ASSERT_EQUAL_MEMORY(&row, &b, sizeof row);
    const dqw_sample t = {.v_d_V = 9, .v_q_V = 9, .i_d_A = 5, .i_q_A = 0, .w_m_rad_s = 7};
    const dqw_block pair = dqw_model_pair(&s, &t, 0.5f);
    const dqw_block expected = {1, 2, 4, 2, 4, -8, 25, 10, 6};
    TEST_ASSERT_EQUAL_MEMORY(&expected, &pair, sizeof pair);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_integrator_of_this_test);
    RUN_TEST(test_slow_machine_satisfies_the_pair_equation);
    RUN_TEST(test_correction_gains_a_factor_of_ten);
    RUN_TEST(test_order_of_the_pair_equation);
    RUN_TEST(test_correction_is_left_out_where_it_must_be);
    RUN_TEST(test_static_row_and_pair);
    return UNITY_END();
}
