// The effects' inputs in fixed point beside the float ones, each law over a whole trajectory; what is learned of them beside what float
// learns; heat, refusals, any bits.
#include "dqw_estimator.h"
#include "dqw_estimator_q15.h"
#include "dqw_test.h"
#include "sim_log.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

enum { ROWS = 10000, SETTLED_ROWS = 600 };
#define R_TRUE 0.9
#define LD_TRUE 2.2e-3
#define LQ_TRUE 2.8e-3
#define PSI_TRUE 0.12
#define P_TRUE 4
#define V_FULL 180.0
#define I_FULL 14.0
#define W_FULL 220.0
#define DT_S 1e-4
// Of settled rows.
#define UNIT_S 1e-6

static const dqw_scale scale = {.v_full_mV = 180000, .i_full_mA = 14000, .w_full_mrad_s = 220000, .dt_ns = 100000, .pole_pairs = P_TRUE};
static const dqw_scale settled_scale = {.v_full_mV = 180000, .i_full_mA = 14000, .w_full_mrad_s = 220000, .dt_ns = 1000, .pole_pairs = P_TRUE};

typedef struct law {
    const char *name;
    dqw_effect_config one;
    dqw_effect_q15_config two;
    int v, i, dt;  // its weights' unit: powers of full voltage, full current, period
    double w[DQW_EFFECT_STARTS];
} law;

#define FLOAT(name, ...)                                                                                                                                       \
    {                                                                                                                                                          \
        .effect = (name), .shape = { __VA_ARGS__ }                                                                                                             \
    }
#define MACHINE .R_uohm = 900000, .Ld_nH = 2200000, .Lq_nH = 2800000, .psi_nWb = 120000000
static const law laws[] = {
    {"dead_time", FLOAT(DQW_EFFECT_DEAD_TIME, 0.3f), {.effect = DQW_EFFECT_DEAD_TIME, .i_uA = 300000}, 1, 0, 0, {4}},
    {"saturation", FLOAT(DQW_EFFECT_SATURATION, 15), {.effect = DQW_EFFECT_SATURATION, .i_uA = 15000000}, 1, 0, 1, {-0.004, -0.003, -0.002, -0.008, -0.003}},
    {"cross_saturation", FLOAT(DQW_EFFECT_CROSS_SATURATION, 15), {.effect = DQW_EFFECT_CROSS_SATURATION, .i_uA = 15000000}, 1, 0, 1, {-0.006, -0.003, 0.002}},
    {"winding_temperature",
     FLOAT(DQW_EFFECT_WINDING_TEMPERATURE, 25, 0),
     {.effect = DQW_EFFECT_WINDING_TEMPERATURE, .T_0_cC = 2500},
     1,
     -1,
     0,
     {R_TRUE * 0.0039}},
    {"winding_temperature by heating",
     FLOAT(DQW_EFFECT_WINDING_TEMPERATURE, 25, 0.2f, 15),
     {.effect = DQW_EFFECT_WINDING_TEMPERATURE, .T_0_cC = 2500, .tau_us = 200000, .i_uA = 15000000},
     1,
     -1,
     0,
     {0.5}},
    {"magnet_temperature",
     FLOAT(DQW_EFFECT_MAGNET_TEMPERATURE, 25, 0),
     {.effect = DQW_EFFECT_MAGNET_TEMPERATURE, .T_0_cC = 2500},
     1,
     0,
     1,
     {-PSI_TRUE * 0.0012}},
    {"magnet_temperature by heating",
     FLOAT(DQW_EFFECT_MAGNET_TEMPERATURE, 25, 0.2f, 15),
     {.effect = DQW_EFFECT_MAGNET_TEMPERATURE, .T_0_cC = 2500, .tau_us = 200000, .i_uA = 15000000},
     1,
     0,
     1,
     {-0.02}},
    {"iron_loss", FLOAT(DQW_EFFECT_IRON_LOSS, (float)R_TRUE, (float)LD_TRUE, (float)LQ_TRUE), {.effect = DQW_EFFECT_IRON_LOSS, MACHINE}, -1, 1, 0, {1.0 / 60}},
    {"flux_harmonics", FLOAT(DQW_EFFECT_FLUX_HARMONICS, 6), {.effect = DQW_EFFECT_FLUX_HARMONICS, .order = 6}, 1, 0, 1, {2e-3, -1e-3, 0.5e-3, 1.5e-3}},
    {"current_offset",
     FLOAT(DQW_EFFECT_CURRENT_OFFSET, (float)R_TRUE, (float)LD_TRUE, (float)LQ_TRUE),
     {.effect = DQW_EFFECT_CURRENT_OFFSET, MACHINE},
     0,
     1,
     0,
     {0.4, -0.25}},
    {"current_gain_mismatch",
     FLOAT(DQW_EFFECT_CURRENT_GAIN_MISMATCH, (float)R_TRUE, (float)LD_TRUE, (float)LQ_TRUE),
     {.effect = DQW_EFFECT_CURRENT_GAIN_MISMATCH, MACHINE},
     0,
     0,
     0,
     {0.03, -0.02}},
    {"angle_offset",
     FLOAT(DQW_EFFECT_ANGLE_OFFSET, (float)LD_TRUE, (float)LQ_TRUE, (float)PSI_TRUE),
     {.effect = DQW_EFFECT_ANGLE_OFFSET, MACHINE},
     0,
     0,
     0,
     {0.05}},
    {"delay", FLOAT(DQW_EFFECT_DELAY, 0), {.effect = DQW_EFFECT_DELAY}, 0, 0, 0, {0.3}},
    {"skin_effect", FLOAT(DQW_EFFECT_SKIN_EFFECT, 0), {.effect = DQW_EFFECT_SKIN_EFFECT}, 1, -1, 2, {R_TRUE * 1.5e-6}},
    {"phase_resistance_imbalance", FLOAT(DQW_EFFECT_PHASE_RESISTANCE_IMBALANCE, 0), {.effect = DQW_EFFECT_PHASE_RESISTANCE_IMBALANCE}, 1, -1, 0, {0.2, -0.1}},
    {"voltage_offset", FLOAT(DQW_EFFECT_VOLTAGE_OFFSET, 0), {.effect = DQW_EFFECT_VOLTAGE_OFFSET}, 1, 0, 0, {1.5, -1.0}},
};
enum { LAWS = sizeof laws / sizeof laws[0] };

// Measured. Inputs: largest difference, 1/32768 of the base, of pairs and of settled rows. What is learned: largest difference of a weight in
// percent of the effect's largest, and of R, L_d, L_q, psi in percent of each; of pairs and of settled rows.
static const struct {
    double input[2], weight[2], plain[2];
} measured[LAWS] = {
    {{7.7, 7.7}, {0.0079, 0.0028}, {0.0043, 0.003}},         // dead_time
    {{0.063, 0.00095}, {11, 0.48}, {0.014, 0.0063}},         // saturation
    {{0.09, 0.00064}, {0.029, 0.016}, {0.0057, 0.001}},      // cross_saturation
    {{0.031, 0.00044}, {0.14, 0.0083}, {0.025, 0.0037}},     // winding_temperature
    {{0.031, 0}, {0.19, 0}, {0.018, 0}},                     // winding_temperature by heating
    {{0.031, 0.0004}, {0.0045, 0.006}, {0.0055, 0.001}},     // magnet_temperature
    {{0.063, 0}, {0.0023, 0}, {0.011, 0}},                   // magnet_temperature by heating
    {{0.11, 0.00052}, {0.00037, 0.0039}, {0.0031, 0.0028}},  // iron_loss
    {{1.6, 0.38}, {0.00094, 0.012}, {0.0025, 0.005}},        // flux_harmonics
    {{1.6, 0.5}, {0.11, 0.023}, {0.0055, 0.0028}},           // current_offset
    {{1.2, 0.32}, {0.0056, 0.034}, {0.0011, 0.0034}},        // current_gain_mismatch
    {{0.087, 0.002}, {5.7e-05, 0.0034}, {0.0095, 0.0015}},   // angle_offset
    {{0.032, 0.00045}, {0.0037, 0.013}, {0.0048, 0.0024}},   // delay
    {{0.031, 0.00068}, {0.0038, 0.0015}, {0.0025, 0.0019}},  // skin_effect
    {{0.58, 0.63}, {0.0088, 0.0072}, {0.0023, 0.0017}},      // phase_resistance_imbalance
    {{0, 0}, {0.01, 0.0027}, {0.0068, 0.0015}},              // voltage_offset
};

// Pairs in half a block: what comes and goes with the angle needs short ones.
static int half_of(const law *l)
{
    const enum dqw_effect_name effect = l->one.effect;
    return effect == DQW_EFFECT_FLUX_HARMONICS || effect == DQW_EFFECT_CURRENT_GAIN_MISMATCH || effect == DQW_EFFECT_PHASE_RESISTANCE_IMBALANCE ? 5 : 20;
}

// A unit of the weights, SI.
static double unit_of(const law *l, bool settled) { return pow(V_FULL, l->v) * pow(I_FULL, l->i) * pow(settled ? UNIT_S : DT_S, l->dt); }

// Signals of a log: of a drive, or of settled points.
typedef struct row {
    double x[5], theta, temp;  // v_d v_q i_d i_q w_m
} row;
static row rows[ROWS];
static const double full[5] = {V_FULL, V_FULL, I_FULL, I_FULL, W_FULL};

static void drive_rows(void)
{
    dqw_sim_scenario s = *dqw_sim_scenario_find("servo_ideal");
    s.duration_s = ROWS * DT_S;
    dqw_sim_row *log = simulate(&s);
    TEST_ASSERT_EQUAL_size_t(ROWS, count);
    for (size_t k = 0; k < count; k++) {
        const dqw_sim_row *r = &log[k];
        const double t = (double)k / ROWS;
        const row one = {{r->v_d_V, r->v_q_V, r->i_d_A, r->i_q_A, r->w_m_rad_s}, r->theta_e_rad, 25 + 60 * t + 10 * sin(9 * t)};
        rows[k] = one;
        for (int i = 0; i < 5; i++) TEST_ASSERT_TRUE(fabs(one.x[i]) < 0.999 * full[i]);
    }
    free(log);
}

static void settled_rows(void)
{
    test_random r = {31};
    for (int k = 0; k < SETTLED_ROWS; k++) {
        const double i_d = random_uniform(&r, -9, 9);
        const double i_q = random_uniform(&r, -9, 9);
        const double w_m = random_uniform(&r, -150, 150);
        const double w = P_TRUE * w_m;
        const row one = {{R_TRUE * i_d - w * LQ_TRUE * i_q, R_TRUE * i_q + w * (LD_TRUE * i_d + PSI_TRUE), i_d, i_q, w_m},
                         random_uniform(&r, -PI, PI),
                         random_uniform(&r, 0, 120)};
        rows[k] = one;
    }
}

static int16_t q15(double x, double of) { return (int16_t)lrint(x / of * 32768); }

static dqw_sample_q15 fixed(const row *r)
{
    const dqw_sample_q15 s = {.v_d_q15 = q15(r->x[0], V_FULL),
                              .v_q_q15 = q15(r->x[1], V_FULL),
                              .i_d_q15 = q15(r->x[2], I_FULL),
                              .i_q_q15 = q15(r->x[3], I_FULL),
                              .w_m_q15 = q15(r->x[4], W_FULL),
                              .theta_e_turn = (uint16_t)(lrint(remainder(r->theta, 2 * PI) / (2 * PI) * 65536) & 65535),
                              .temp_winding_cC = (int16_t)lrint(100 * r->temp),
                              .temp_magnet_cC = (int16_t)lrint(100 * r->temp)};
    return s;
}

static dqw_sample exact(const row *r)
{
    const dqw_sample s = {.v_d_V = (float)r->x[0],
                          .v_q_V = (float)r->x[1],
                          .i_d_A = (float)r->x[2],
                          .i_q_A = (float)r->x[3],
                          .w_m_rad_s = (float)r->x[4],
                          .theta_e_rad = (float)remainder(r->theta, 2 * PI),
                          .temp_winding_C = (float)r->temp,
                          .temp_magnet_C = (float)r->temp};
    return s;
}

// What the integers stand for.
static dqw_sample meant(const dqw_sample_q15 *x)
{
    const row r = {{x->v_d_q15 / 32768.0 * V_FULL, x->v_q_q15 / 32768.0 * V_FULL, x->i_d_q15 / 32768.0 * I_FULL, x->i_q_q15 / 32768.0 * I_FULL,
                    x->w_m_q15 / 32768.0 * W_FULL},
                   x->theta_e_turn / 65536.0 * 2 * PI,
                   x->temp_winding_cC / 100.0};
    return exact(&r);
}

static dqw_effect one;
static dqw_effect_q15 two;

static void begin(const law *l, bool settled)
{
    const dqw_effect_base base = {settled ? 1.0f : (float)DT_S, (float)V_FULL, (float)I_FULL, (float)W_FULL, P_TRUE};
    const dqw_effect_q15_base fixed_base = {.scale = settled ? &settled_scale : &scale, .settled = settled, .half_window = (uint8_t)half_of(l)};
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_effect_init(&one, &l->one, 1, &base));
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_effect_init_q15(&two, &l->two, 1, &fixed_base));
}

// A weight that is 1 per unit of its input's base, SI; a settled delay's is in float's periods of 1 s.
static double weight_of(const law *l, int i, bool settled)
{
    const double w = ldexp((double)dqw_effect_restored_q40(&two, 0, i, (int64_t)1 << 40), -40) * unit_of(l, settled);
    return settled && l->one.effect == DQW_EFFECT_DELAY ? w * UNIT_S : w;
}

static void test_inputs_over_a_whole_trajectory(void)
{
    for (int settled = 0; settled < 2; settled++) {
        settled ? settled_rows() : drive_rows();
        for (int n = 0; n < LAWS; n++) {
            const law *l = &laws[n];
            // Settled rows here are no time apart.
            if (settled && l->two.tau_us > 0) continue;
            CASE("%s, %s", l->name, settled ? "settled" : "pairs");
            begin(l, settled);
            const int weights = dqw_effect_weights(l->one.effect);
            double worst = 0.0;
            double largest = 0.0;
            dqw_sample last = {0};
            dqw_sample_q15 last_q15 = {0};
            for (int k = 0; k < (settled ? SETTLED_ROWS : ROWS); k++) {
                const dqw_sample_q15 x = fixed(&rows[k]);
                const dqw_sample s = meant(&x);
                float f[2][DQW_EFFECT_WEIGHTS];
                int32_t q[2][DQW_EFFECT_WEIGHTS];
                bool there = true;
                if (settled) {
                    dqw_effect_static(&one, &s, f[0], f[1]);
                    dqw_effect_static_q15(&two, &x, q[0], q[1]);
                } else {
                    there = dqw_effect_pair(&one, k > 0 ? &last : NULL, &s, f[0], f[1]);
                    HOLDS(there == dqw_effect_pair_q15(&two, k > 0 ? &last_q15 : NULL, &x, q[0], q[1]));
                }
                dqw_effect_heat(&one, s.i_d_A, s.i_q_A);
                dqw_effect_heat_q15(&two, x.i_d_q15, x.i_q_q15);
                for (int i = 0; there && i < weights; i++)
                    for (int axis = 0; axis < 2; axis++) {
                        const double now = ldexp(q[axis][i], -1 - two.fraction);
                        HOLDS(fabs(now) < 4.0);
                        worst = fmax(worst, 32768 * fabs(now - (double)f[axis][i] * weight_of(l, i, settled) / V_FULL));
                        largest = fmax(largest, fabs(now));
                    }
                last = s;
                last_q15 = x;
            }
            HOLDS(largest > 0.003);
            const double usual = measured[n].input[settled];
            BETWEEN(usual / 3, worst, 2 * usual);
        }
    }
}

static dqw_random_sample memory_d[50], memory_q[50];

// What the effect takes, as float has it, added to the voltages.
static void add_effect(const law *l, bool settled, int rows_used)
{
    static double add[ROWS][2];
    memset(add, 0, sizeof add);
    begin(l, settled);
    const double by = settled && l->one.effect == DQW_EFFECT_DELAY ? DT_S : 1.0;
    dqw_sample last = {0};
    for (int k = 0; k < rows_used; k++) {
        const dqw_sample s = exact(&rows[k]);
        float f[2][DQW_EFFECT_WEIGHTS];
        bool there = true;
        if (settled)
            dqw_effect_static(&one, &s, f[0], f[1]);
        else
            there = dqw_effect_pair(&one, k > 0 ? &last : NULL, &s, f[0], f[1]);
        dqw_effect_heat(&one, s.i_d_A, s.i_q_A);
        for (int i = 0; there && i < dqw_effect_weights(l->one.effect); i++)
            for (int axis = 0; axis < 2; axis++) add[settled ? k : k - 1][axis] += by * l->w[i] * (double)f[axis][i];
        last = s;
    }
    for (int k = 0; k < rows_used; k++)
        for (int axis = 0; axis < 2; axis++) {
            rows[k].x[axis] += add[k][axis];
            HOLDS(fabs(rows[k].x[axis]) < 0.999 * V_FULL);
        }
}

static dqw_estimator e;
static dqw_estimator_q15 q;

static void begin_estimators(const law *l, bool settled, dqw_estimator_q15_config *c)
{
    const dqw_estimator_config f = {.regime = settled ? DQW_REGIME_STATIC : DQW_REGIME_DYNAMIC,
                                    .dt_s = settled ? 1.0f : (float)DT_S,
                                    .v_base_V = (float)V_FULL,
                                    .i_base_A = (float)I_FULL,
                                    .w_base_rad_s = (float)W_FULL,
                                    .pole_pairs = P_TRUE,
                                    .half_window = (uint16_t)half_of(l),
                                    .reservoir_d = memory_d,
                                    .reservoir_q = memory_q,
                                    .reservoir = 50,
                                    .effects = &l->one,
                                    .effect_count = 1};
    *c = (dqw_estimator_q15_config){.scale = settled ? settled_scale : scale,
                                    .half_window = (uint8_t)half_of(l),
                                    .read_blocks = 1,
                                    .settled = settled,
                                    .effects = &l->two,
                                    .effect_count = 1};
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&e, &f));
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&q, c));
}

// Largest difference of R, L_d, L_q, psi in percent.
static double plain_difference(bool settled)
{
    const double dt = settled ? UNIT_S : DT_S;
    const double unit[] = {V_FULL / I_FULL, V_FULL * dt / I_FULL, V_FULL * dt / I_FULL, V_FULL * dt};
    const double then[] = {(double)e.parameters.R_ohm, (double)e.parameters.Ld_H, (double)e.parameters.Lq_H, (double)e.parameters.psi_Wb};
    double worst = 0.0;
    for (int i = 0; i < 4; i++) worst = fmax(worst, 100 * fabs(ldexp((double)q.parameters.value_q40[i], -40) * unit[i] / then[i] - 1));
    return worst;
}

// Largest difference of the effect's weights in percent of the largest, and how far float's own are from the truth.
static double weight_difference(const law *l, bool settled, double *off)
{
    float f[DQW_EFFECT_STARTS];
    float f_sd[DQW_EFFECT_STARTS];
    int64_t w[DQW_EFFECT_STARTS];
    int64_t sd[DQW_EFFECT_STARTS];
    const int known = dqw_estimator_effect(&e, 0, f, f_sd);
    TEST_ASSERT_EQUAL_INT(known, dqw_estimator_effect_q15(&q, 0, w, sd));
    const int weights = dqw_effect_weights(l->one.effect);
    HOLDS(known == (1 << weights) - 1);
    const bool late = settled && l->one.effect == DQW_EFFECT_DELAY;
    const double unit = unit_of(l, settled) * (late ? UNIT_S : 1.0);
    double largest = 0.0;
    double worst = 0.0;
    *off = 0.0;
    for (int i = 0; i < weights; i++) largest = fmax(largest, fabs((double)f[i]));
    for (int i = 0; i < weights; i++) {
        worst = fmax(worst, 100 * fabs(ldexp((double)w[i], -40) * unit - (double)f[i]) / largest);
        *off = fmax(*off, 100 * fabs((double)f[i] - l->w[i] * (late ? DT_S : 1.0)) / largest);
        // Fixed point's deviation has quantisation in it as well.
        HOLDS(ldexp((double)sd[i], -40) * unit > 0.3 * (double)f_sd[i]);
    }
    return worst;
}

static void test_what_is_learned_is_what_float_learns(void)
{
    for (int settled = 0; settled < 2; settled++)
        for (int n = 0; n < LAWS; n++) {
            const law *l = &laws[n];
            if (settled && l->two.tau_us > 0) continue;
            CASE("%s, %s", l->name, settled ? "settled" : "pairs");
            settled ? settled_rows() : drive_rows();
            const int used = settled ? SETTLED_ROWS : ROWS;
            add_effect(l, settled, used);
            dqw_estimator_q15_config c;
            begin_estimators(l, settled, &c);
            for (int k = 0; k < used; k++) {
                const dqw_sample s = exact(&rows[k]);
                const dqw_sample_q15 x = fixed(&rows[k]);
                const uint32_t then = dqw_estimator_step(&e, &s, false);
                if ((then & DQW_EVENT_LEARNED) != 0) (void)dqw_estimator_background(&e);
                (void)dqw_estimator_step_q15(&q, &x, false);
                const uint32_t now = dqw_estimator_background_q15(&q);
                HOLDS((then & DQW_EVENT_LEARNED) == (now & DQW_EVENT_LEARNED));
            }
            dqw_estimator_read_q15(&q);
            TEST_ASSERT_EQUAL_UINT8(e.parameters.known, q.parameters.known);
            TEST_ASSERT_EQUAL_UINT8(31, q.parameters.known);
            double off;
            const double weight = weight_difference(l, settled, &off);
            BETWEEN(0.0, off, l->one.effect == DQW_EFFECT_SATURATION ? 25.0 : 0.6);
            BETWEEN(measured[n].weight[settled] / 3, weight, 2 * measured[n].weight[settled]);
            BETWEEN(measured[n].plain[settled] / 3, plain_difference(settled), 2 * measured[n].plain[settled]);
        }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_inputs_over_a_whole_trajectory);
    RUN_TEST(test_what_is_learned_is_what_float_learns);
    return UNITY_END();
}
