// A block's rows in whole numbers against the equations in double: inputs, targets, the noise of the inputs, and what a
// voltage one period late would differ by.
#include "block_rows.h"
#include "dqw_estimator_block_q15.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

enum { N = DQW_PARAMETERS, BLOCK_ROWS = 8192, SLOPES = 1000 };
#define V_FULL 40.0
#define I_FULL 12.0
#define W_FULL 400.0
#define DT_S 1e-4

static dqw_estimator_q15_config config;
static dqw_estimator_q15 e;
static int weight;  // of the block's sums

static void begin(void)
{
    static const dqw_estimator_q15_config given = {
        .scale = {(uint32_t)(1000 * V_FULL), (uint32_t)(1000 * I_FULL), (uint32_t)(1000 * W_FULL), 100000, 5},
        .R_uohm = 400000,
        .Ld_nH = 1100000,
        .Lq_nH = 1700000,
        .psi_nWb = 15000000,
        .half_window = 9,
        .dead_time_width_mA = 300,
        .angle = true,
        .encoder_offset = true,
        .voltage_held = true,
        .noise_on_inputs = true};
    config = given;
}

static void start(void)
{
    memset(&e, 0, sizeof e);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&e, &config));
    e.blocks = 200;
    weight = config.half_window * (config.half_window + 1);
}

static block_si drawn(test_random *r)
{
    block_si b;
    for (int a = 0; a < 2; a++) {
        b.v_V[a] = random_uniform(r, -20, 20);
        b.i_A[a] = random_uniform(r, -6, 6);
        b.di_A_s[a] = random_uniform(r, -6000, 6000);
        b.wi_A_rad_s[a] = random_uniform(r, -1500, 1500);
        b.dead[a] = random_uniform(r, -1, 1);
        b.constant[a] = random_uniform(r, -1, 1);
        b.v_step_V[a] = random_uniform(r, -300, 300);
        b.noise_A2[a] = random_uniform(r, 0.01, 0.2);
    }
    b.w_rad_s = random_uniform(r, -280, 280);
    b.noise_rad2_s2 = random_uniform(r, 10, 400);
    b.slope_inv_A = random_uniform(r, 0.05, 3);
    b.follow = random_uniform(r, 0.2, 0.95);
    return b;
}

static int32_t rounded(double x) { return (int32_t)lrint(x); }

// As the window hands it over, Q15 and Q17 of the full scales, of pairs: sums of two samples without the half. What is
// rounded here is what the block is then said to be.
static dqw_estimator_q15_block handed(block_si *b)
{
    dqw_estimator_q15_block out;
    memset(&out, 0, sizeof out);
    out.whole = true;
    out.weight = (uint16_t)weight;
    const double one = 32768.0 * weight;
    for (int a = 0; a < 2; a++) {
        out.sums[a] = rounded(b->v_V[a] / V_FULL * one);
        out.sums[2 + a] = rounded(2 * b->i_A[a] / I_FULL * one);
        out.sums[4 + a] = rounded(b->di_A_s[a] * DT_S / I_FULL * one);
        out.sums[6 + a] = rounded(4 * b->wi_A_rad_s[a] / (W_FULL * I_FULL) * one);
        out.sums[9 + a] = rounded(2 * b->dead[a] * one);
        out.sums[11 + a] = rounded(2 * b->constant[a] * one);
        out.v_step_q15[a] = rounded(b->v_step_V[a] / V_FULL * 32768);
        // The mean of such products is minus two variances.
        out.with.noise_q30[a] = -llrint(2 * BLOCK_ROWS * b->noise_A2[a] / (I_FULL * I_FULL) * 1073741824.0);
    }
    out.sums[8] = rounded(2 * b->w_rad_s / W_FULL * one);
    out.with.noise_q30[2] = llrint(6 * BLOCK_ROWS * b->noise_rad2_s2 / (W_FULL * W_FULL) * 1073741824.0);
    out.with.rows = BLOCK_ROWS;
    const double width = config.dead_time_width_mA / 1000.0;
    out.with.slopes = SLOPES;
    out.with.slope_q15 = (uint32_t)llrint(b->slope_inv_A * width * 32768 * SLOPES);
    out.with.follow_q15 = (uint16_t)rounded(b->follow * 32768);
    return out;
}

static bool known(void) { return config.scale.pole_pairs != 0 || config.settled; }

static rows_with with(void)
{
    rows_with w = {.dt_s = DT_S,
                   .pole_pairs = config.scale.pole_pairs != 0 ? config.scale.pole_pairs : (int)DQW_POLES_Q15_SCALE,
                   .half = config.half_window,
                   .width_A = known() ? config.dead_time_width_mA / 1000.0 : 0,
                   .psi_q = known() && config.encoder_offset,
                   .held = config.voltage_held,
                   .cross = {known() ? DQW_LQ : (int)DQW_POLES_LQ_Q15, known() ? DQW_LD : (int)DQW_POLES_LD_Q15},
                   .bent = true,
                   .R_ohm = 1e-6 * config.R_uohm,
                   .L_H = {1e-9 * config.Ld_nH, 1e-9 * config.Lq_nH},
                   .turns = config.scale.pole_pairs};
    return w;
}

static double unit_of(const dqw_units_q15 *u, int i)
{
    if (i == DQW_R) return 1e-6 * u->si[0];
    if (i == DQW_LD || i == DQW_LQ) return 1e-9 * u->si[i];
    if (i == DQW_PSI || (i == DQW_PSI_Q && known())) return 1e-9 * u->si[3];
    if (known()) return V_FULL / DQW_DEAD_TIME_Q15_PARTS;
    return 1e-9 * u->si[i == DQW_POLES_LD_Q15 ? DQW_LD : DQW_LQ];
}

static void alike(double expected, double room, double value, const char *what, int axis, int i)
{
    CASE("%s of axis %d, %d", what, axis, i);
    BETWEEN(expected - room, value, expected + room);
}

static void compare(block_si b, const rows_with *w)
{
    const dqw_estimator_q15_block block = handed(&b);
    dqw_rows_q15 r;
    memset(&r, 0x5a, sizeof r);
    dqw_estimator_rows_of_q15(&e, &block, &r);
    const rows_si t = block_rows(b, w);
    const double q28 = V_FULL / 268435456.0;
    const double q56 = q28 * q28;
    for (int a = 0; a < 2; a++) {
        alike(t.y_V[a], 1e-3, r.y_q28[a] * q28, "target", a, 0);
        alike(known() && config.scale.pole_pairs != 0 && !config.settled ? t.late_V[a] : 0, 2e-3, r.late_q28[a] * q28,
              "late voltage", a, 0);
        double u[N];
        for (int i = 0; i < N; i++) {
            u[i] = unit_of(&r.unit, i);
            alike(t.x[a][i] * u[i], 1.5e-3, r.x_q28[a][i] * q28, "input", a, i);
            const double var = t.var[a][i] * u[i] * u[i];
            alike(var, 1e-3 * var + 1e-9, (double)r.noise_q56[a][i] * q56, "noise", a, i);
        }
        const double speed = t.speed[a] * u[w->cross[a]] * u[a == 0 ? DQW_PSI_Q : DQW_PSI];
        alike(speed, 1e-3 * fabs(speed) + 1e-9, (double)r.noise_q56[a][DQW_NOISE_Q15_SPEED] * q56, "noise of the speed",
              a, 0);
        const double both = u[DQW_R] * u[DQW_DEAD_TIME];
        alike(t.dead_in_R[a] * both, 1e-3 * t.dead_in_R[a] * both + 1e-9,
              (double)r.noise_q56[a][DQW_NOISE_Q15_DEAD_IN_R] * q56, "dead time's noise with R", a, 0);
        alike(t.R_in_dead[a] * both, 1e-3 * t.R_in_dead[a] * both + 1e-9,
              (double)r.noise_q56[a][DQW_NOISE_Q15_R_IN_DEAD] * q56, "R's noise with dead time", a, 0);
    }
}

static void shown(int rows, test_random *r)
{
    for (int k = 0; k < rows; k++) {
        const rows_with w = with();
        compare(drawn(r), &w);
    }
}

static void test_rows_are_the_equations(void)
{
    test_random r = {700};
    begin(), start();
    shown(40, &r);
    config.voltage_held = config.encoder_offset = false, config.dead_time_width_mA = 0, config.half_window = 20;
    start();
    shown(10, &r);
    // A width that is narrow beside the noise, and one that is wide beside the currents.
    for (int wide = 0; wide < 2; wide++) {
        config.dead_time_width_mA = wide ? 5000 : 20;
        start();
        shown(10, &r);
    }
}

// Six weights, and none of what only shows beside the pole pairs; the currents' bend by the pole pairs that the more
// learned of the cross weights says.
static void test_rows_without_pole_pairs(void)
{
    test_random r = {701};
    begin();
    config.scale.pole_pairs = 0, config.voltage_held = false;
    start();
    for (int better = 0; better < 2; better++) {
        const int i[2] = {DQW_POLES_LD_Q15, DQW_POLES_LQ_Q15};
        for (int k = 0; k < 2; k++) {
            e.cov_q40[i[k]] = k == better ? 1000 : 1001;
            e.w_q24[i[k]] = (int32_t)(e.w_q24[DQW_LD + k] * (k == better ? 3.5 : 6.0) / 8);
        }
        for (int k = 0; k < 10; k++) {
            rows_with w = with();
            w.turns = 3.5;
            compare(drawn(&r), &w);
        }
    }
}

// By the learned machine, from the eleventh block on; never by an L_d that no machine has beside its L_q, nor by a
// resistance below zero.
static void test_when_currents_bend(void)
{
    test_random r = {702};
    begin(), start();
    for (e.blocks = 0; e.blocks < 20; e.blocks++) {
        rows_with w = with();
        w.bent = e.blocks > 10;
        for (int k = 0; k < 5; k++) compare(drawn(&r), &w);
    }
    const double L_q_H = 1e-9 * config.Lq_nH;
    static const double part[] = {0.1, 0.2, 0.3, 0.7, 1.3, 1.9, 2.2, 5};
    for (unsigned k = 0; k < sizeof part / sizeof part[0]; k++) {
        e.w_q24[DQW_LD] = rounded(part[k] * config.Lq_nH / config.Ld_nH * 16777216);
        rows_with w = with();
        w.L_H[0] = fmin(2, fmax(0.25, part[k])) * L_q_H;
        for (int n = 0; n < 5; n++) compare(drawn(&r), &w);
    }
    for (int sign = -1; sign < 2; sign += 2) {
        e.w_q24[DQW_R] = sign * 2 * 16777216;
        rows_with w = with();
        w.L_H[0] = 2 * L_q_H;
        w.bent = sign > 0;
        w.R_ohm = 2e-6 * config.R_uohm;
        compare(drawn(&r), &w);
    }
}

// A settled point has no slope to bend, and no rows before it; without a whole block nothing is said of a late voltage.
static void test_settled_and_broken_rows(void)
{
    test_random r = {703};
    begin(), start();
    block_si b = drawn(&r);
    dqw_estimator_q15_block block = handed(&b);
    dqw_rows_q15 rows;
    for (int whole = 0; whole < 2; whole++) {
        block.whole = whole;
        dqw_estimator_rows_of_q15(&e, &block, &rows);
        for (int a = 0; a < 2; a++) HOLDS((rows.late_q28[a] != 0) == (whole != 0));
    }
    config.settled = true, config.voltage_held = false;
    start();
    b.noise_A2[0] = b.noise_A2[1] = b.noise_rad2_s2 = 0;
    rows_with w = with();
    w.bent = false;
    compare(b, &w);
}

// Behind the machine's own inputs stand those of the effects, means of the window's sums.
static void test_rows_of_effects(void)
{
    static const dqw_effect_q15_config list[] = {{.effect = DQW_EFFECT_VOLTAGE_OFFSET},
                                                 {.effect = DQW_EFFECT_SKIN_EFFECT}};
    enum { WEIGHTS = 3 };
    test_random r = {704};
    begin();
    config.effects = list, config.effect_count = 2;
    start();
    const double one = ldexp(2.0 * weight, e.effect.fraction);  // of two samples
    for (int k = 0; k < 20; k++) {
        block_si b = drawn(&r);
        dqw_estimator_q15_block block = handed(&b);
        double expected[2 * WEIGHTS];
        for (int i = 0; i < 2 * WEIGHTS; i++) {
            expected[i] = random_uniform(&r, -2, 2);
            block.sums[DQW_PLAIN_Q15_SIGNALS + i] = rounded(expected[i] * one);
        }
        dqw_rows_q15 rows;
        dqw_estimator_rows_of_q15(&e, &block, &rows);
        for (int a = 0; a < 2; a++)
            for (int i = 0; i < WEIGHTS; i++)
                alike(expected[WEIGHTS * a + i], 1e-6, rows.x_q28[a][N + i] / 268435456.0, "effect", a, i);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_rows_are_the_equations);
    RUN_TEST(test_rows_without_pole_pairs);
    RUN_TEST(test_when_currents_bend);
    RUN_TEST(test_settled_and_broken_rows);
    RUN_TEST(test_rows_of_effects);
    return UNITY_END();
}
