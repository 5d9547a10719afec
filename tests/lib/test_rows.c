// A block's rows against the equations in double: inputs, targets, the noise of the inputs, and what a voltage one
// period late would differ by.
#include "block_rows.h"
#include "dqw_estimator_block.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

enum { N = DQW_PARAMETERS };

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
                                               .half_window = 7,
                                               .pole_pairs = 5,
                                               .dead_time_width_A = 0.3f,
                                               .angle = true,
                                               .encoder_offset = true,
                                               .voltage_held = true,
                                               .noise_on_inputs = true};
    config = given;
}

static void start(void)
{
    memset(&e, 0, sizeof e);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&e, &config));
    e.blocks = 200;
}

static block_si drawn(test_random *r)
{
    block_si b;
    for (int a = 0; a < 2; a++) {
        b.v_V[a] = random_uniform(r, -20, 20);
        b.i_A[a] = random_uniform(r, -6, 6);
        b.di_A_s[a] = random_uniform(r, -3000, 3000);
        b.wi_A_rad_s[a] = random_uniform(r, -1500, 1500);
        b.dead[a] = random_uniform(r, -1, 1);
        b.constant[a] = random_uniform(r, -1, 1);
        b.v_step_V[a] = random_uniform(r, -30, 30);
        b.noise_A2[a] = random_uniform(r, 1e-3, 0.05);
    }
    b.w_rad_s = random_uniform(r, -280, 280);
    b.noise_rad2_s2 = random_uniform(r, 0.1, 4);
    b.slope_inv_A = random_uniform(r, 0.05, 3);
    b.follow = random_uniform(r, 0.2, 0.95);
    return b;
}

// As the window hands it over: sums of pairs, of which some are means of two samples without the half.
static dqw_estimator_block handed(const block_si *b)
{
    dqw_estimator_block out = {.whole = true, .dead_slope_inv_A = (float)b->slope_inv_A};
    for (int a = 0; a < 2; a++) {
        out.sum[a] = (float)b->v_V[a];
        out.sum[2 + a] = (float)(2 * b->i_A[a]);
        out.sum[4 + a] = (float)(b->di_A_s[a] * (double)config.dt_s);
        out.sum[6 + a] = (float)(2 * b->wi_A_rad_s[a]);
        out.sum[9 + a] = (float)(2 * b->dead[a]);
        out.sum[11 + a] = (float)(2 * b->constant[a]);
        out.v_step_V[a] = (float)b->v_step_V[a];
    }
    out.sum[8] = (float)(2 * b->w_rad_s);
    out.noise.i_d_A2 = (float)b->noise_A2[0], out.noise.i_q_A2 = (float)b->noise_A2[1];
    out.noise.w_rad2_s2 = (float)b->noise_rad2_s2;
    return out;
}

static rows_with with(void)
{
    const bool known = config.pole_pairs != 0;
    rows_with w = {.dt_s = (double)config.dt_s,
                   .pole_pairs = known ? config.pole_pairs : 1,
                   .half = config.half_window,
                   .width_A = known ? (double)config.dead_time_width_A : 0,
                   .psi_q = known && config.encoder_offset,
                   .held = config.voltage_held,
                   .cross = {known ? DQW_LQ : DQW_POLES_LQ, known ? DQW_LD : DQW_POLES_LD},
                   .bent = true,
                   .R_ohm = (double)config.R_ohm,
                   .L_H = {(double)config.Ld_H, (double)config.Lq_H},
                   .turns = config.pole_pairs};
    return w;
}

static void alike(double expected, double size, double value, const char *what, int axis, int i)
{
    CASE("%s of axis %d, %d", what, axis, i);
    BETWEEN(expected - 2e-5 * size, value, expected + 2e-5 * size);
}

static void compare(const block_si *b, const rows_with *w)
{
    const dqw_estimator_block block = handed(b);
    e.given.lead = (float)(2 / b->follow - 2);
    dqw_estimator_rows r;
    memset(&r, 0x5a, sizeof r);
    dqw_estimator_rows_of(&e, &block, &r);
    const rows_si t = block_rows(*b, w);
    const double v = (double)config.v_base_V;
    for (int a = 0; a < 2; a++) {
        alike(t.y_V[a], 1, (double)r.y[a] * v, "target", a, 0);
        alike(t.late_V[a], 1, (double)r.late[a] * v, "late voltage", a, 0);
        double unit[N];
        for (int i = 0; i < N; i++) {
            unit[i] = (double)dqw_estimator_unit(&e, i) / v;
            alike(t.x[a][i] * unit[i], 1, (double)r.x[a][i], "input", a, i);
            alike(1, 1, (t.var[a][i] * unit[i] * unit[i] + 1e-12) / ((double)r.var[a][i] + 1e-12), "noise", a, i);
        }
        const double flux = unit[a == 0 ? DQW_PSI_Q : DQW_PSI];
        const double speed = t.speed[a] * unit[w->cross[a]] * flux;
        alike(speed, fabs(speed) + 1e-9, (double)r.speed[a], "noise of the speed", a, 0);
        const double both = unit[DQW_R] * unit[DQW_DEAD_TIME];
        alike(t.dead_in_R[a] * both, 1e-3, (double)r.dead_in_R[a], "dead time's noise with R", a, 0);
        alike(t.R_in_dead[a] * both, 1e-3, (double)r.R_in_dead[a], "R's noise with dead time", a, 0);
    }
}

static void shown(int rows, test_random *r)
{
    for (int k = 0; k < rows; k++) {
        const block_si b = drawn(r);
        const rows_with w = with();
        compare(&b, &w);
    }
}

static void test_rows_are_the_equations(void)
{
    test_random r = {700};
    begin(), start();
    shown(40, &r);
    config.voltage_held = config.encoder_offset = false, config.dead_time_width_A = 0, config.half_window = 20;
    start();
    shown(10, &r);
    // A width that is narrow beside the noise, and one that is wide beside the currents.
    for (int wide = 0; wide < 2; wide++) {
        config.dead_time_width_A = wide ? 5.0f : 0.001f;
        start();
        shown(10, &r);
    }
}

// Six weights, and none of what only shows beside the pole pairs; the currents' bend by the pole pairs that the
// weights say.
static void test_rows_without_pole_pairs(void)
{
    test_random r = {701};
    begin();
    config.pole_pairs = 0, config.voltage_held = false;
    start();
    e.w_pu[DQW_POLES_LQ] = 3.5f * e.w_pu[DQW_LQ];
    for (int k = 0; k < 10; k++) {
        const block_si b = drawn(&r);
        rows_with w = with();
        w.turns = 3.5;
        compare(&b, &w);
    }
}

// By the learned machine, from the eleventh block on; never by an L_d that no machine has beside its L_q, nor by a
// resistance below zero.
static void test_when_currents_bend(void)
{
    test_random r = {702};
    begin(), start();
    for (e.blocks = 0; e.blocks < 20; e.blocks++) {
        const block_si b = drawn(&r);
        rows_with w = with();
        w.bent = e.blocks > 10;
        compare(&b, &w);
    }
    const double L_q_H = (double)config.Lq_H;
    static const double part[] = {0.1, 0.2, 0.3, 0.7, 1.3, 1.9, 2.2, 5};
    for (unsigned k = 0; k < sizeof part / sizeof part[0]; k++) {
        e.w_pu[DQW_LD] = (float)(part[k] * L_q_H / (double)dqw_estimator_unit(&e, DQW_LD));
        const block_si b = drawn(&r);
        rows_with w = with();
        w.L_H[0] = fmin(2, fmax(0.25, part[k])) * L_q_H;
        compare(&b, &w);
    }
    for (int sign = -1; sign < 2; sign += 2) {
        e.w_pu[DQW_R] = (float)sign * 0.2f;
        const block_si b = drawn(&r);
        rows_with w = with();
        w.L_H[0] = 2 * L_q_H;
        w.bent = sign > 0;
        w.R_ohm = 0.2 * (double)dqw_estimator_unit(&e, DQW_R);
        compare(&b, &w);
    }
}

// A settled point has no slope to bend, and nobody measures its noise.
static void test_settled_rows(void)
{
    test_random r = {703};
    begin();
    config.settled = true, config.voltage_held = false;
    start();
    block_si b = drawn(&r);
    const dqw_estimator_block block = handed(&b);
    dqw_estimator_rows rows;
    memset(&rows, 0, sizeof rows);
    dqw_estimator_rows_of(&e, &block, &rows);
    rows_with w = with();
    w.bent = false;
    const rows_si t = block_rows(b, &w);
    for (int a = 0; a < 2; a++)
        for (int i = 0; i < N; i++) {
            const double unit = (double)(dqw_estimator_unit(&e, i) / config.v_base_V);
            alike(t.x[a][i] * unit, 1, (double)rows.x[a][i], "input", a, i);
            HOLDS(rows.var[a][i] == 0.0f && rows.late[a] == 0.0f);
        }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_rows_are_the_equations);
    RUN_TEST(test_rows_without_pole_pairs);
    RUN_TEST(test_when_currents_bend);
    RUN_TEST(test_settled_rows);
    return UNITY_END();
}
