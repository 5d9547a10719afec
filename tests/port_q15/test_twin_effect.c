// The effects' inputs in fixed point beside the float ones, each law over a whole trajectory; what is learned of them
// beside what float learns; heat, refusals, any bits.
#include "bent_iron.h"
#include "dqw_effect.h"
#include "dqw_estimator.h"
#include "dqw_estimator_q15.h"
#include "dqw_estimator_block_q15.h"
#include "dqw_number.h"
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

static const dqw_scale scale = {
    .v_full_mV = 180000, .i_full_mA = 14000, .w_full_mrad_s = 220000, .dt_ns = 100000, .pole_pairs = P_TRUE};
static const dqw_scale settled_scale = {
    .v_full_mV = 180000, .i_full_mA = 14000, .w_full_mrad_s = 220000, .dt_ns = 1000, .pole_pairs = P_TRUE};

typedef struct law {
    const char *name;
    dqw_effect_config one;
    dqw_effect_q15_config two;
    int v, i, dt;  // its weights' unit: powers of full voltage, full current, period
    double w[DQW_EFFECT_STARTS];
} law;

#define FLOAT(name, ...)                                                                                               \
    {                                                                                                                  \
        .effect = (name), .shape = { __VA_ARGS__ }                                                                     \
    }
#define MACHINE .R_uohm = 900000, .Ld_nH = 2200000, .Lq_nH = 2800000, .psi_nWb = 120000000
static law laws[] = {
    {"dead_time", FLOAT(DQW_EFFECT_DEAD_TIME, 0.3f), {.effect = DQW_EFFECT_DEAD_TIME, .i_uA = 300000}, 1, 0, 0, {4}},
    {"saturation",
     FLOAT(DQW_EFFECT_SATURATION, 15),
     {.effect = DQW_EFFECT_SATURATION, .i_uA = 15000000},
     1,
     0,
     1,
     {-0.004, -0.003, -0.002, -0.008, -0.003}},
    {"cross_saturation",
     FLOAT(DQW_EFFECT_CROSS_SATURATION, 15),
     {.effect = DQW_EFFECT_CROSS_SATURATION, .i_uA = 15000000},
     1,
     0,
     1,
     {-0.006, -0.003, 0.002}},
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
    {"iron_loss",
     FLOAT(DQW_EFFECT_IRON_LOSS, (float)R_TRUE, (float)LD_TRUE, (float)LQ_TRUE),
     {.effect = DQW_EFFECT_IRON_LOSS, MACHINE},
     -1,
     1,
     0,
     {1.0 / 60}},
    {"flux_harmonics",
     FLOAT(DQW_EFFECT_FLUX_HARMONICS, 6),
     {.effect = DQW_EFFECT_FLUX_HARMONICS, .order = 6},
     1,
     0,
     1,
     {2e-3, -1e-3, 0.5e-3, 1.5e-3}},
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
    {"phase_resistance_imbalance",
     FLOAT(DQW_EFFECT_PHASE_RESISTANCE_IMBALANCE, 0),
     {.effect = DQW_EFFECT_PHASE_RESISTANCE_IMBALANCE},
     1,
     -1,
     0,
     {0.2, -0.1}},
    {"voltage_offset",
     FLOAT(DQW_EFFECT_VOLTAGE_OFFSET, 0),
     {.effect = DQW_EFFECT_VOLTAGE_OFFSET},
     1,
     0,
     0,
     {1.5, -1.0}},
    {"flux_map",
     FLOAT(DQW_EFFECT_FLUX_MAP, (float)BENT_FULL_WB, (float)BENT_CELL_D_A, (float)BENT_CELL_Q_A),
     {.effect = DQW_EFFECT_FLUX_MAP, .psi_nWb = 13200000, .cell_d_uA = 1500000, .cell_q_uA = 800000},
     0,
     0,
     0,
     {0.9, 1.1}},
};
enum { LAWS = sizeof laws / sizeof laws[0] };

// Measured. Inputs: largest difference, 1/32768 of the base, of pairs and of settled rows. What is learned: largest
// difference of a weight in percent of the effect's largest, and of R, L_d, L_q, psi in percent of each; of pairs and
// of settled rows.
static const struct {
    double input[2], weight[2], plain[2];
} measured[LAWS] = {
    {{0.055, 0.045}, {0.0076, 0.0088}, {0.00035, 0.0032}},    // dead_time
    {{0.12, 0.0014}, {8, 0.85}, {0.14, 0.0047}},              // saturation
    {{0.14, 0.0013}, {0.3, 0.027}, {0.0032, 0.0016}},         // cross_saturation
    {{0.073, 0.00044}, {0.084, 0.0049}, {0.0069, 0.0042}},    // winding_temperature
    {{0.1, 0}, {0.41, 0}, {0.055, 0}},                        // winding_temperature by heating
    {{0.11, 0.0004}, {0.00058, 0.0042}, {0.001, 0.00083}},    // magnet_temperature
    {{0.19, 0}, {0.1, 0}, {0.022, 0}},                        // magnet_temperature by heating
    {{0.51, 0.00048}, {0.0037, 0.0037}, {0.01, 0.0031}},      // iron_loss
    {{0.037, 0.011}, {0.002, 0.0098}, {0.00034, 0.0059}},     // flux_harmonics
    {{0.14, 0.0026}, {0.0038, 0.02}, {0.00044, 0.0022}},      // current_offset
    {{0.092, 0.0012}, {0.0045, 0.032}, {0.00034, 0.0038}},    // current_gain_mismatch
    {{0.086, 0.0024}, {0.011, 0.0038}, {0.00056, 0.0017}},    // angle_offset
    {{1.3, 0.00045}, {0.0059, 0.018}, {0.0083, 0.0024}},      // delay
    {{0.031, 0.00068}, {0.0009, 0.0012}, {0.00056, 0.0019}},  // skin_effect
    {{0.0033, 0.002}, {0.011, 0.0078}, {0.0014, 0.0017}},     // phase_resistance_imbalance
    {{0, 0}, {0.027, 0.0063}, {0.00075, 0.0012}},             // voltage_offset
    {{0.1, 0.02}, {0.0041, 0.034}, {0.001, 0.0036}},          // flux_map
};

// Pairs in half a block: what comes and goes with the angle needs short ones.
static int half_of(const law *l)
{
    const enum dqw_effect_name effect = l->one.effect;
    return effect == DQW_EFFECT_FLUX_HARMONICS || effect == DQW_EFFECT_CURRENT_GAIN_MISMATCH ||
                   effect == DQW_EFFECT_PHASE_RESISTANCE_IMBALANCE
               ? 5
               : 20;
}

// A unit of the weights, SI.
static double unit_of(const law *l, bool settled)
{
    return pow(V_FULL, l->v) * pow(I_FULL, l->i) * pow(settled ? UNIT_S : DT_S, l->dt);
}

// Signals of a log: of a drive, or of settled points.
typedef struct row {
    double x[5], theta, temp;  // v_d v_q i_d i_q w_m
} row;
static row rows[ROWS];
static const double full[5] = {V_FULL, V_FULL, I_FULL, I_FULL, W_FULL};

static void drive_rows(void)
{
    static row kept[ROWS];
    static bool have = false;
    if (!have) {
        dqw_sim_scenario s = *dqw_sim_scenario_find("servo_ideal");
        s.duration_s = ROWS * DT_S;
        dqw_sim_row *log = simulate(&s);
        TEST_ASSERT_EQUAL_size_t(ROWS, count);
        for (size_t k = 0; k < count; k++) {
            const dqw_sim_row *r = &log[k];
            const double t = (double)k / ROWS;
            kept[k] = (row){
                {r->v_d_V, r->v_q_V, r->i_d_A, r->i_q_A, r->w_m_rad_s}, r->theta_e_rad, 25 + 60 * t + 10 * sin(9 * t)};
            for (int i = 0; i < 5; i++) TEST_ASSERT_TRUE(fabs(kept[k].x[i]) < 0.999 * full[i]);
        }
        free(log);
        have = true;
    }
    memcpy(rows, kept, sizeof rows);
}

static void settled_rows(void)
{
    test_random r = {31};
    for (int k = 0; k < SETTLED_ROWS; k++) {
        const double i_d = random_uniform(&r, -9, 9);
        const double i_q = random_uniform(&r, -9, 9);
        const double w_m = random_uniform(&r, -150, 150);
        const double w = P_TRUE * w_m;
        const row one = {
            {R_TRUE * i_d - w * LQ_TRUE * i_q, R_TRUE * i_q + w * (LD_TRUE * i_d + PSI_TRUE), i_d, i_q, w_m},
            random_uniform(&r, -PI, PI),
            random_uniform(&r, 0, 120)};
        rows[k] = one;
    }
}

static int16_t q15(double x, double of) { return (int16_t)lrint(fmax(-32768, fmin(32767, x / of * 32768))); }

static dqw_sample_q15 fixed(const row *r)
{
    dqw_sample_q15 s = dqw_sample_from_dq_q15(
        q15(r->x[0], V_FULL), q15(r->x[1], V_FULL), q15(r->x[2], I_FULL), q15(r->x[3], I_FULL), q15(r->x[4], W_FULL),
        (uint16_t)(lrint(remainder(r->theta, 2 * PI) / (2 * PI) * 65536) & 65535));
    s.temp_winding_cC = (int16_t)lrint(100 * r->temp);
    s.temp_magnet_cC = (int16_t)lrint(100 * r->temp);
    return s;
}

static dqw_sample exact(const row *r)
{
    dqw_sample s = dqw_sample_from_dq((float)r->x[0], (float)r->x[1], (float)r->x[2], (float)r->x[3], (float)r->x[4],
                                      (float)remainder(r->theta, 2 * PI));
    s.temp_winding_C = (float)r->temp;
    s.temp_magnet_C = (float)r->temp;
    return s;
}

// What the integers stand for.
static dqw_sample meant(const dqw_sample_q15 *x)
{
    const row r = {{x->v_d_q15 / 32768.0 * V_FULL, x->v_q_q15 / 32768.0 * V_FULL, x->i_d_q15 / 32768.0 * I_FULL,
                    x->i_q_q15 / 32768.0 * I_FULL, x->w_m_q15 / 32768.0 * W_FULL},
                   0,
                   x->temp_winding_cC / 100.0};
    dqw_sample s = exact(&r);
    s.cosine = (float)(x->cosine_q15 / 32768.0);
    s.sine = (float)(x->sine_q15 / 32768.0);
    return s;
}

static dqw_effect one;
static dqw_effect_q15 two;

// A table is made as the program starts.
static void take_table(void) { laws[LAWS - 1].one.map = laws[LAWS - 1].two.map = bent_table(); }

static void begin(const law *l, bool settled)
{
    const dqw_effect_base base = {
        settled ? 1.0f : (float)DT_S, (float)V_FULL, (float)I_FULL, (float)W_FULL, P_TRUE, false};
    const dqw_effect_q15_base fixed_base = {
        .scale = settled ? &settled_scale : &scale, .settled = settled, .half_window = (uint8_t)half_of(l)};
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
                if (there) dqw_effect_dead_time(&one, settled ? NULL : &last, &s, f[0], f[1]);
                dqw_effect_heat(&one, s.i_d_A, s.i_q_A);
                dqw_effect_warm(&one, 1);
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
        if (there) dqw_effect_dead_time(&one, settled ? NULL : &last, &s, f[0], f[1]);
        dqw_effect_heat(&one, s.i_d_A, s.i_q_A);
        dqw_effect_warm(&one, 1);
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
    static dqw_estimator_config f;
    f = (dqw_estimator_config){.dt_s = settled ? 1.0f : (float)DT_S,
                               .v_base_V = (float)V_FULL,
                               .i_base_A = (float)I_FULL,
                               .w_base_rad_s = (float)W_FULL,
                               .pole_pairs = P_TRUE,
                               .half_window = (uint16_t)half_of(l),
                               .angle = true,
                               .settled = settled,
                               .effects = &l->one,
                               .effect_count = 1};
    *c = (dqw_estimator_q15_config){.scale = settled ? settled_scale : scale,
                                    .half_window = (uint8_t)half_of(l),
                                    .solve_blocks = 1,
                                    .angle = true,
                                    .settled = settled,
                                    .effects = &l->two,
                                    .effect_count = 1};
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&e, &f));
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&q, c));
}

// Largest difference of R, L_d, L_q, psi in percent.
static double plain_difference(void)
{
    static const double unit[] = {1e-6, 1e-9, 1e-9, 1e-9};
    double worst = 0.0;
    for (int i = 0; i < 4; i++) {
        const dqw_reading_q15 now = dqw_estimator_read_q15(&q, (enum dqw_parameter)i);
        const dqw_reading then = dqw_estimator_read(&e, (enum dqw_parameter)i);
        HOLDS(now.usable && then.usable);
        const double value = ldexp((double)now.value_q40, -40) * unit[i] *
                             dqw_estimator_unit_q15(q.config, (enum dqw_parameter)i);
        worst = fmax(worst, 100 * fabs(value / (double)then.value - 1));
    }
    return worst;
}

// Largest difference of the effect's weights in percent of the largest, and how far float's own are from the truth.
static double weight_difference(const law *l, bool settled, double *off)
{
    float f[DQW_EFFECT_STARTS];
    float f_sd[DQW_EFFECT_STARTS];
    int64_t w[DQW_EFFECT_STARTS];
    int64_t sd[DQW_EFFECT_STARTS];
    const int known = dqw_estimator_read_effect(&e, 0, f, f_sd);
    TEST_ASSERT_EQUAL_INT(known, dqw_estimator_read_effect_q15(&q, 0, w, sd));
    const int weights = dqw_effect_weights(l->one.effect);
    HOLDS(l->one.effect == DQW_EFFECT_SATURATION || known == (1 << weights) - 1);
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
        HOLDS((sd[i] == INT64_MAX) == (f_sd[i] >= DQW_UNKNOWN));
        if (sd[i] != INT64_MAX) HOLDS(ldexp((double)sd[i], -40) * unit > 0.3 * (double)f_sd[i]);
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
                (void)dqw_estimator_sample(&e, &s, false);
                (void)dqw_estimator_sample_q15(&q, &x, false);
                (void)dqw_estimator_background(&e);
                (void)dqw_estimator_background_q15(&q);
            }
            HOLDS(e.blocks == q.blocks && q.restarts == 0);
            double off;
            const double weight = weight_difference(l, settled, &off);
            BETWEEN(0.0, off, l->one.effect == DQW_EFFECT_SATURATION ? 25.0 : 0.8);
            BETWEEN(measured[n].weight[settled] / 3, weight, 2 * measured[n].weight[settled]);
            BETWEEN(measured[n].plain[settled] / 3, plain_difference(), 2 * measured[n].plain[settled]);
        }
}

static enum dqw_status start(const dqw_effect_q15_config *list, int n)
{
    const dqw_effect_q15_base base = {.scale = &scale, .half_window = 20};
    return dqw_effect_init_q15(&two, list, n, &base);
}

// The flux of a table between its nodes, linear in each current, and beyond it what stands at its edge.
static void of_table(const int16_t *map, double x, double y, double flux[2])
{
    const double at_x = fmin(fmax(x + map[1], 0), map[0] - 1);
    const double at_y = fmin(fabs(y), map[2] - 1);
    const int k = at_x < map[0] - 2 ? (int)at_x : map[0] - 2;
    const int n = at_y < map[2] - 2 ? (int)at_y : map[2] - 2;
    for (int a = 0; a < 2; a++) {
        const int16_t *node = map + DQW_EFFECT_MAP_HEAD + 2 * (k * map[2] + n) + a;
        const double u = at_x - k;
        const double v = at_y - n;
        flux[a] = (1 - u) * ((1 - v) * node[0] + v * node[2]) +
                  u * ((1 - v) * node[2 * map[2]] + v * node[2 * map[2] + 2]);
        flux[a] /= a == 1 && y < 0 ? -32768.0 : 32768.0;
    }
}

static void test_a_map_ends_at_its_edge(void)
{
    law l = laws[LAWS - 1];
    l.one.shape[1] = 0.7f, l.one.shape[2] = 0.4f;
    l.two.cell_d_uA = 700000, l.two.cell_q_uA = 400000;
    begin(&l, true);
    int beyond = 0;
    for (int k = -16; k <= 16; k++)
        for (int n = -16; n <= 16; n++) {
            const dqw_sample_q15 x = {
                .i_d_q15 = (int16_t)(2000 * k), .i_q_q15 = (int16_t)(2000 * n), .w_m_q15 = 20000, .cosine_q15 = 32767};
            dqw_sample s = meant(&x);
            float d[DQW_EFFECT_WEIGHTS];
            float q_axis[DQW_EFFECT_WEIGHTS];
            int32_t d_q28[DQW_EFFECT_WEIGHTS];
            int32_t q_q28[DQW_EFFECT_WEIGHTS];
            dqw_effect_static(&one, &s, d, q_axis);
            dqw_effect_static_q15(&two, &x, d_q28, q_q28);
            double flux[2];
            const double i_d = (double)s.i_d_A / 0.7;
            const double i_q = (double)s.i_q_A / 0.4;
            of_table(l.two.map, i_d, i_q, flux);
            CASE("%g, %g cells", i_d, i_q);
            const double w_e = P_TRUE * (double)s.w_m_rad_s;
            BETWEEN(-2e-5, (double)q_axis[0] / (w_e * BENT_FULL_WB) - flux[0], 2e-5);
            BETWEEN(-2e-5, (double)d[1] / (w_e * BENT_FULL_WB) + flux[1], 2e-5);
            BETWEEN(-1e-4, ldexp(q_q28[0], -29) * 32768 / 20000 - flux[0], 1e-4);
            BETWEEN(-1e-4, ldexp(d_q28[1], -29) * 32768 / 20000 + flux[1], 1e-4);
            beyond += fabs(i_d) > 10 || fabs(i_q) > 20;
        }
    HOLDS(beyond > 500 && beyond < 1000);
}

// What the log above does not reach: tanh over all of its range, a turn of nearly a radian in a period. Closed forms
// judge.
static void test_tanh_and_turns(void)
{
    const dqw_effect_q15_config dead = {.effect = DQW_EFFECT_DEAD_TIME, .i_uA = 1600000};
    const dqw_effect_q15_base base = {.scale = &settled_scale, .settled = true};
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_effect_init_q15(&two, &dead, 1, &base));
    int32_t d[DQW_EFFECT_WEIGHTS];
    int32_t x_q[DQW_EFFECT_WEIGHTS];
    double worst = 0.0;
    for (int i = -32766; i <= 32766; i++) {
        const dqw_sample_q15 s = {.i_d_q15 = (int16_t)i, .cosine_q15 = INT16_MAX};
        dqw_effect_static_q15(&two, &s, d, x_q);
        // Fixed point's cosine of nothing.
        const double one_less = 32767.0 / 32768;
        const double a = i / 32768.0 * one_less * I_FULL / 1.6;
        worst = fmax(worst, fabs(ldexp(d[0], -29) - one_less * (2 * tanh(a) + 2 * tanh(a / 2)) / 3));
    }
    BETWEEN(5e-7, worst, 4e-6);  // 1.8e-6

    const dqw_effect_q15_config late = {.effect = DQW_EFFECT_DELAY};
    const dqw_scale fast = {
        .v_full_mV = 180000, .i_full_mA = 14000, .w_full_mrad_s = 2400000, .dt_ns = 100000, .pole_pairs = P_TRUE};
    const dqw_effect_q15_base pairs = {.scale = &fast, .half_window = 1};
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_effect_init_q15(&two, &late, 1, &pairs));
    worst = 0.0;
    for (int w = -32766; w <= 32766; w += 7) {
        const dqw_sample_q15 before = {.v_d_q15 = 30000, .v_q_q15 = -21000, .w_m_q15 = (int16_t)w};
        const dqw_sample_q15 now = {.v_d_q15 = -10000, .v_q_q15 = 32000, .w_m_q15 = (int16_t)w};
        (void)dqw_effect_pair_q15(&two, &before, &now, d, x_q);
        const double turn = w / 32768.0 * 2400 * P_TRUE * DT_S;
        const double off_d = -10000 - (cos(turn) * 30000 - sin(turn) * 21000);
        const double off_q = 32000 - (-cos(turn) * 21000 - sin(turn) * 30000);
        worst = fmax(worst, fmax(fabs(ldexp(two.late_d_q28, -28) - off_d / 32768),
                                 fabs(ldexp(two.late_q_q28, -28) - off_q / 32768)));
    }
    BETWEEN(1e-8, worst, 4e-7);  // 7.2e-8
}

// 8 units in every pair of a block fit in 31 bits, and twice that would not.
static void test_a_window_holds_what_inputs_may_be(void)
{
    const dqw_effect_q15_config list = {.effect = DQW_EFFECT_VOLTAGE_OFFSET};
    for (int h = 1; h <= DQW_WINDOW_Q15_HALF; h++) {
        const dqw_effect_q15_base base = {.scale = &scale, .half_window = (uint8_t)h};
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_effect_init_q15(&two, &list, 1, &base));
        const double most = ldexp(8.0 * h * (h + 1), two.fraction);
        HOLDS(most <= 2147483648.0 && most > 1073741824.0);
    }
}

// Half a million steps of 1.7e-7 of a time constant; settled rows 2 s apart. The closed form judges.
static void test_slow_heat_is_not_lost_to_rounding(void)
{
    const double square = (0.5 * 0.5 + 0.25 * 0.25) / 4;
    dqw_effect_q15_config c = {.effect = DQW_EFFECT_WINDING_TEMPERATURE, .i_uA = 28000000, .tau_us = 600000000};
    TEST_ASSERT_EQUAL_INT(DQW_OK, start(&c, 1));
    const int steps = scaled(500000);
    for (int k = 0; k < steps; k++) dqw_effect_heat_q15(&two, 16384, -8192);
    const double exact_heat = square * (1 - exp(-steps * DT_S / 600)) * 4;
    BETWEEN(exact_heat * 0.999999, ldexp((double)two.heat_q60[0], -60), exact_heat * 1.000001);

    c.row_us = 2000000;
    c.tau_us = 61000000;
    TEST_ASSERT_EQUAL_INT(DQW_OK, start(&c, 1));
    for (int k = 0; k < 30; k++) dqw_effect_heat_q15(&two, 16384, -8192);
    const double by_rows = square * (1 - pow(1 - 2.0 / 61, 30)) * 4;
    BETWEEN(by_rows * 0.9999999, ldexp((double)two.heat_q60[0], -60), by_rows * 1.0000001);

    // As fast as it may be, and as hot: never more than its bound.
    c.row_us = UINT32_MAX;
    c.tau_us = 1;
    TEST_ASSERT_EQUAL_INT(DQW_OK, start(&c, 1));
    for (int k = 0; k < 10; k++) dqw_effect_heat_q15(&two, INT16_MIN, INT16_MIN);
    TEST_ASSERT_EQUAL_INT64((int64_t)1 << 61, two.heat_q60[0]);
}

static dqw_estimator_q15 begin_one(const dqw_effect_q15_config *list, dqw_estimator_q15_config *c)
{
    static dqw_estimator_q15 fresh;
    const bool angle = list->effect == DQW_EFFECT_DEAD_TIME || list->effect == DQW_EFFECT_FLUX_HARMONICS;
    *c = (dqw_estimator_q15_config){.scale = scale, .angle = angle, .effects = list, .effect_count = 1};
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&fresh, c));
    return fresh;
}

// A temperature that is no number, or far from T_0, is counted as what it is; where the effect heats by itself nobody
// asks for it.
static void test_temperatures_that_cannot_be_learned(void)
{
    for (int magnet = 0; magnet < 2; magnet++)
        for (int heats = 0; heats < 2; heats++) {
            const dqw_effect_q15_config list = {.effect = magnet ? DQW_EFFECT_MAGNET_TEMPERATURE
                                                                 : DQW_EFFECT_WINDING_TEMPERATURE,
                                                .T_0_cC = -2500,
                                                .tau_us = heats ? 1000000 : 0};
            static const struct {
                int16_t temp_cC;
                uint32_t event;
            } cases[] = {{INT16_MIN, DQW_EVENT_NONFINITE},
                         {INT16_MAX, DQW_EVENT_SATURATED},
                         {30268, DQW_EVENT_SATURATED},
                         {30267, 0},
                         {-32767, 0},
                         {2500, 0}};
            dqw_estimator_q15_config c;
            q = begin_one(&list, &c);
            for (int n = 0; n < 6; n++) {
                CASE("%s, %s, %d", magnet ? "magnet" : "winding", heats ? "heating" : "thermometer", cases[n].temp_cC);
                dqw_sample_q15 s = {.i_q_q15 = (int16_t)(1000 * n), .temp_winding_cC = 2000, .temp_magnet_cC = 2000};
                *(magnet ? &s.temp_magnet_cC : &s.temp_winding_cC) = cases[n].temp_cC;
                TEST_ASSERT_EQUAL_UINT32(heats ? 0 : cases[n].event, dqw_estimator_sample_q15(&q, &s, false));
            }
        }
    // What stands behind the list's count is not in it.
    const dqw_effect_q15_config more[] = {{.effect = DQW_EFFECT_WINDING_TEMPERATURE, .T_0_cC = 2500},
                                          {.effect = DQW_EFFECT_MAGNET_TEMPERATURE, .T_0_cC = -32000}};
    const dqw_sample_q15 warm = {.temp_winding_cC = 3000, .temp_magnet_cC = 3000};
    for (int n = 1; n <= 2; n++) {
        TEST_ASSERT_EQUAL_INT(DQW_OK, start(more, n));
        HOLDS(dqw_effect_saturated_q15(&two, &warm) == (n == 2));
    }
}

// An effect behind others is what it is alone, in its place; a dead time that is someone else's has none.
static void test_an_effect_behind_others(void)
{
    drive_rows();
    const dqw_effect_q15_base base = {.scale = &scale, .half_window = 20};
    const dqw_effect_q15_base apart = {.scale = &scale, .half_window = 20, .dead_time_apart = true};
    for (int n = 0; n < LAWS; n++) {
        CASE("%s", laws[n].name);
        const dqw_effect_q15_config list[] = {
            {.effect = DQW_EFFECT_VOLTAGE_OFFSET}, {.effect = DQW_EFFECT_DEAD_TIME, .i_uA = 300000}, laws[n].two};
        if (n % 2 && laws[n].two.effect == DQW_EFFECT_DEAD_TIME) continue;
        static dqw_effect_q15 behind;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_effect_init_q15(&behind, list, 3, n % 2 ? &apart : &base));
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_effect_init_q15(&two, &list[2], 1, &base));
        const int first = n % 2 ? 2 : 3;
        TEST_ASSERT_EQUAL_UINT8(first + two.weights, behind.weights);
        dqw_sample_q15 last = {0};
        for (int k = 0; k < 2000; k++) {
            const dqw_sample_q15 x = fixed(&rows[k]);
            int32_t a[2][DQW_EFFECT_WEIGHTS];
            int32_t b[2][DQW_EFFECT_WEIGHTS];
            const dqw_sample_q15 *before = k % 100 != 0 ? &last : NULL;
            // What needs the row before has one pair fewer after a gap.
            const bool there = dqw_effect_pair_q15(&two, before, &x, a[0], a[1]);
            HOLDS(dqw_effect_pair_q15(&behind, before, &x, b[0], b[1]) == there);
            dqw_effect_heat_q15(&two, x.i_d_q15, x.i_q_q15);
            dqw_effect_heat_q15(&behind, x.i_d_q15, x.i_q_q15);
            last = x;
            if (!there) continue;
            for (int axis = 0; axis < 2; axis++) {
                HOLDS(b[axis][axis] == 2 << behind.fraction && b[axis][1 - axis] == 0);
                for (int i = 0; i < two.weights; i++) HOLDS(a[axis][i] == b[axis][first + i]);
            }
        }
    }
    const dqw_effect_q15_config twice[] = {{.effect = DQW_EFFECT_DEAD_TIME, .i_uA = 300000},
                                           {.effect = DQW_EFFECT_DEAD_TIME, .i_uA = 300000}};
    REFUSED(two, DQW_ERR_EFFECT_TWICE, dqw_effect_init_q15(&two, twice, 2, &apart));
}

// An empty list goes along with everything; an effect has no pair where time has jumped, nor without a last sample.
static void test_pairs_after_a_gap(void)
{
    const dqw_effect_q15_config list = {.effect = DQW_EFFECT_VOLTAGE_OFFSET};
    const dqw_effect_q15_base base = {.scale = &scale, .half_window = 20};
    const dqw_sample_q15 s = {.i_q_q15 = 1000, .cosine_q15 = INT16_MAX};
    int32_t d[DQW_EFFECT_WEIGHTS];
    int32_t q_axis[DQW_EFFECT_WEIGHTS];
    for (int effects = 0; effects <= 1; effects++) {
        CASE("%d effects", effects);
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_effect_init_q15(&two, effects > 0 ? &list : NULL, effects, &base));
        for (int n = 0; n < 2; n++) {
            HOLDS(dqw_effect_pair_q15(&two, &s, &s, d, q_axis) == (effects == 0));
            HOLDS(dqw_effect_pair_q15(&two, &s, &s, d, q_axis));
            dqw_effect_gap_q15(&two);
        }
        HOLDS(dqw_effect_pair_q15(&two, NULL, &s, d, q_axis) == (effects == 0));
        HOLDS(dqw_effect_pair_q15(&two, &s, &s, d, q_axis));
        HOLDS(dqw_effect_pair_q15(&two, NULL, &s, d, q_axis) == (effects == 0));
    }
}

// What stands behind an effect is what it is alone, whichever effect it is.
static void test_every_effect_before_another(void)
{
    drive_rows();
    const dqw_effect_q15_base base = {.scale = &scale, .half_window = 20};
    for (int n = 0; n < LAWS; n++) {
        const dqw_effect_q15_config list[] = {laws[n].two, {.effect = DQW_EFFECT_SKIN_EFFECT}};
        static dqw_effect_q15 both;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_effect_init_q15(&both, list, 2, &base));
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_effect_init_q15(&two, &list[1], 1, &base));
        const int first = dqw_effect_weights(list[0].effect);
        TEST_ASSERT_EQUAL_UINT8(first + 1, both.weights);
        for (int k = 1; k < 200; k++) {
            CASE("%s, row %d", laws[n].name, k);
            const dqw_sample_q15 last = fixed(&rows[k - 1]);
            const dqw_sample_q15 x = fixed(&rows[k]);
            int32_t a[2][DQW_EFFECT_WEIGHTS];
            int32_t b[2][DQW_EFFECT_WEIGHTS];
            const bool there = dqw_effect_pair_q15(&both, &last, &x, a[0], a[1]);
            HOLDS(dqw_effect_pair_q15(&two, &last, &x, b[0], b[1]) == there && there == (k > 1));
            if (there) HOLDS(a[0][first] == b[0][0] && a[1][first] == b[1][0]);
        }
    }
}

// A deviation is widened by how alike blocks are in what they teach its own weight: dead time goes with R, the flux on
// the other axis and dead time's constant part with the flux, each effect's weight by itself. (E61)
static void test_each_deviation_is_widened_by_its_own_blocks(void)
{
    const dqw_effect_q15_config list = {.effect = DQW_EFFECT_VOLTAGE_OFFSET};
    const dqw_estimator_q15_config c = {.scale = scale, .angle = true, .effects = &list, .effect_count = 1};
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&q, &c));
    static const int score_of[] = {0, 1, 2, 3, 0, 3, 3, 4, 5};
    for (int k = 0; k < 6; k++)
        for (int i = 0; i < 9; i++) {
            CASE("score %d, weight %d", k, i);
            for (int n = 0; n < DQW_ESTIMATOR_Q15_SCORES; n++) {
                q.score2_q68[n] = (int64_t)1 << 40;
                q.score_lag_q68[n] = 0;
            }
            HOLDS(dqw_estimator_inflation_q20(&q, i) == 1048576);
            q.score_lag_q68[k] = (int64_t)1 << 38;
            BETWEEN(0.99999, ldexp((double)dqw_estimator_inflation_q20(&q, i), -20) / (score_of[i] == k ? 1.5 : 1.0),
                    1.00001);
            // No less than a fifth of it, no more than what 0.98 makes.
            q.score_lag_q68[k] = -((int64_t)1 << 40);
            BETWEEN(0.9999, ldexp((double)dqw_estimator_inflation_q20(&q, i), -20) / (score_of[i] == k ? 0.2 : 1.0),
                    1.0001);
            q.score_lag_q68[k] = (int64_t)1 << 40;
            BETWEEN(0.99999, ldexp((double)dqw_estimator_inflation_q20(&q, i), -20) / (score_of[i] == k ? 2.96 : 1.0),
                    1.00001);
        }
}

// What a block teaches a weight is kept for R, L_d, L_q, the flux and each effect: one whose input stays nought was
// taught nothing.
static void test_what_is_taught_is_an_effects_own(void)
{
    drive_rows();
    for (int warm = 0; warm < 2; warm++) {
        const dqw_effect_q15_config list = {.effect = DQW_EFFECT_WINDING_TEMPERATURE, .T_0_cC = 2500};
        const dqw_estimator_q15_config c = {
            .scale = scale, .angle = true, .dead_time_width_mA = 300, .effects = &list, .effect_count = 1};
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&q, &c));
        for (int k = 0; k < 4000; k++) {
            dqw_sample_q15 x = fixed(&rows[k]);
            x.temp_winding_cC = (int16_t)(warm ? 7000 + k % 999 : 2500);
            (void)dqw_estimator_sample_q15(&q, &x, false);
            (void)dqw_estimator_background_q15(&q);
        }
        for (int k = 0; k <= 4; k++) {
            CASE("warm %d, score %d", warm, k);
            HOLDS((q.score2_q68[k] > 0) == (k < 4 || warm == 1));
        }
    }
}

// Before anything was learned no weight is known, and no more of them are written than the effect has.
static void test_read_before_anything_was_learned(void)
{
    for (int n = 0; n < LAWS; n++) {
        CASE("%s", laws[n].name);
        dqw_effect_q15_config list[] = {{.effect = DQW_EFFECT_VOLTAGE_OFFSET}, laws[n].two};
        const int64_t start = laws[n].two.effect == DQW_EFFECT_VOLTAGE_OFFSET ? 123456789 : 0;
        list[1].start_q40[0] = start;
        const dqw_estimator_q15_config c = {.scale = scale, .angle = true, .effects = list, .effect_count = 2};
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&q, &c));
        int64_t w[DQW_EFFECT_STARTS + 1];
        int64_t sd[DQW_EFFECT_STARTS + 1];
        for (int i = 0; i <= DQW_EFFECT_STARTS; i++) w[i] = sd[i] = -99;
        HOLDS(dqw_estimator_read_effect_q15(&q, -1, w, sd) == DQW_ERR_SIZE &&
              dqw_estimator_read_effect_q15(&q, 2, w, sd) == DQW_ERR_SIZE && w[0] == -99 && sd[0] == -99);
        HOLDS(dqw_estimator_read_effect_q15(&q, 1, w, sd) == 0);
        for (int i = 0; i <= DQW_EFFECT_STARTS; i++) {
            const bool there = i < dqw_effect_weights(laws[n].two.effect);
            HOLDS(sd[i] == (there ? INT64_MAX : -99) && (there || w[i] == -99));
        }
        BETWEEN(-1e5, w[0] - start, 1e5);
    }
}

// An effect that turns with the rotor needs its angle: both 0 is none, nor is a length far from 1.
static void test_an_angle_that_is_none(void)
{
    const dqw_effect_q15_config list = {.effect = DQW_EFFECT_FLUX_HARMONICS, .order = 6};
    const dqw_effect_q15_config other = {.effect = DQW_EFFECT_SKIN_EFFECT};
    const struct {
        int16_t cosine, sine;
        bool good;
    } cases[] = {{0, 0, false},     {INT16_MAX, 0, true}, {INT16_MIN, 0, true},   {0, -31200, true},
                 {31000, 0, false}, {24000, 24000, true}, {24500, -24500, false}, {INT16_MIN, INT16_MIN, false}};
    for (int n = 0; n < 8; n++) {
        CASE("case %d", n);
        const dqw_sample_q15 s = {
            .i_q_q15 = (int16_t)(1000 * n), .cosine_q15 = cases[n].cosine, .sine_q15 = cases[n].sine};
        dqw_estimator_q15_config c;
        q = begin_one(&list, &c);
        TEST_ASSERT_EQUAL_UINT32(cases[n].good ? 0 : DQW_EVENT_NONFINITE, dqw_estimator_sample_q15(&q, &s, false));
        q = begin_one(&other, &c);
        TEST_ASSERT_EQUAL_UINT32(0, dqw_estimator_sample_q15(&q, &s, false));
    }
}

static void test_init_refuses_and_leaves_the_object_alone(void)
{
    static dqw_effect_q15 o;
    const dqw_effect_q15_config good = {.effect = DQW_EFFECT_DEAD_TIME, .i_uA = 300000};
    const dqw_effect_q15_base base = {.scale = &scale, .half_window = 20};
    REFUSED(o, DQW_ERR_EFFECT_LIST, dqw_effect_init_q15(&o, NULL, 1, &base));
    REFUSED(o, DQW_ERR_NULL, dqw_effect_init_q15(&o, &good, 1, NULL));
    REFUSED(o, DQW_ERR_EFFECT_LIST, dqw_effect_init_q15(&o, &good, -1, &base));
    REFUSED(o, DQW_ERR_NULL, dqw_effect_init_q15(NULL, &good, 1, &base));
    dqw_scale no_p = scale;
    no_p.pole_pairs = 0;
    const dqw_effect_q15_base without = {.scale = &no_p, .half_window = 20};
    REFUSED(o, DQW_ERR_EFFECT_POLE_PAIRS, dqw_effect_init_q15(&o, &good, 1, &without));
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_effect_init_q15(&o, NULL, 0, &without));
    const dqw_effect_q15_config bad[] = {
        {.effect = DQW_EFFECT_NONE},
        {.effect = DQW_EFFECT_NAMES},
        {.effect = DQW_EFFECT_COULOMB_FRICTION},
        {.effect = DQW_EFFECT_DEAD_TIME},
        {.effect = DQW_EFFECT_DEAD_TIME, .i_uA = 427},  // a last place is 427.2 uA
        {.effect = DQW_EFFECT_SATURATION},
        {.effect = DQW_EFFECT_SATURATION, .i_uA = 218749},
        {.effect = DQW_EFFECT_CROSS_SATURATION, .i_uA = 224000001},
        {.effect = DQW_EFFECT_WINDING_TEMPERATURE, .tau_us = 1000000000001u},
        {.effect = DQW_EFFECT_MAGNET_TEMPERATURE, .tau_us = 1000, .i_uA = 1},
        {.effect = DQW_EFFECT_IRON_LOSS, .R_uohm = 900000},
        {.effect = DQW_EFFECT_IRON_LOSS, .R_uohm = 900000, .Ld_nH = 20},
        {.effect = DQW_EFFECT_CURRENT_OFFSET},
        {.effect = DQW_EFFECT_CURRENT_GAIN_MISMATCH},
        {.effect = DQW_EFFECT_ANGLE_OFFSET, .Ld_nH = 5, .Lq_nH = 5},
        {.effect = DQW_EFFECT_FLUX_HARMONICS},
        {.effect = DQW_EFFECT_FLUX_HARMONICS, .order = DQW_EFFECT_Q15_ORDERS + 1},
    };
    for (unsigned n = 0; n < sizeof bad / sizeof bad[0]; n++) {
        CASE("number %u", n);
        const enum dqw_status why = n < 3 ? DQW_ERR_EFFECT_NAME : DQW_ERR_EFFECT_SHAPE;
        REFUSED(o, why, dqw_effect_init_q15(&o, &bad[n], 1, &base));
        dqw_estimator_q15_config c = {.scale = scale, .angle = true, .effects = &bad[n], .effect_count = 1};
        REFUSED(q, why, dqw_estimator_init_q15(&q, &c));
    }
    // The last that are taken: their neighbours above are not.
    const dqw_effect_q15_config last[] = {
        {.effect = DQW_EFFECT_DEAD_TIME, .i_uA = 428},
        {.effect = DQW_EFFECT_SATURATION, .i_uA = 218750},
        {.effect = DQW_EFFECT_CROSS_SATURATION, .i_uA = 224000000},
        {.effect = DQW_EFFECT_WINDING_TEMPERATURE, .tau_us = 1000000000000u},
        {.effect = DQW_EFFECT_WINDING_TEMPERATURE, .tau_us = 1000, .i_uA = 0},
        {.effect = DQW_EFFECT_FLUX_HARMONICS, .order = 1},
        {.effect = DQW_EFFECT_FLUX_HARMONICS, .order = DQW_EFFECT_Q15_ORDERS},
    };
    for (unsigned n = 0; n < sizeof last / sizeof last[0]; n++) {
        CASE("last %u", n);
        TEST_ASSERT_EQUAL_INT_MESSAGE(DQW_OK, dqw_effect_init_q15(&o, &last[n], 1, &base), test_case);
    }
    // R, L and psi up to 2^18 of their units.
    dqw_scale fine = scale;
    fine.v_full_mV = 1000, fine.i_full_mA = 100000, fine.dt_ns = 10000, fine.w_full_mrad_s = 100000;
    const dqw_effect_q15_base of_fine = {.scale = &fine, .half_window = 20};
    for (int n = 0; n < 8; n++) {
        CASE("most %d", n);
        const uint32_t part = n % 2 ? 999 : 1001;
        dqw_effect_q15_config most = {.effect = n < 6 ? DQW_EFFECT_CURRENT_OFFSET : DQW_EFFECT_ANGLE_OFFSET};
        uint32_t *const field[] = {&most.R_uohm, &most.Ld_nH, &most.Lq_nH, &most.psi_nWb};
        static const uint32_t most_by_1000[] = {2621440, 26214, 26214, 2621440};
        *field[n / 2] = most_by_1000[n / 2] * part;
        HOLDS(dqw_effect_init_q15(&o, &most, 1, &of_fine) == (n % 2 ? DQW_OK : DQW_ERR_EFFECT_SHAPE));
    }
    // Twice the same heating; more weights than there is room for.
    for (int magnet = 0; magnet < 2; magnet++) {
        dqw_effect_q15_config twice[2] = {{.effect = DQW_EFFECT_WINDING_TEMPERATURE},
                                          {.effect = DQW_EFFECT_WINDING_TEMPERATURE}};
        if (magnet) twice[0].effect = twice[1].effect = DQW_EFFECT_MAGNET_TEMPERATURE;
        REFUSED(o, DQW_ERR_EFFECT_TWICE, dqw_effect_init_q15(&o, twice, 2, &base));
        twice[0].effect = magnet ? DQW_EFFECT_WINDING_TEMPERATURE : DQW_EFFECT_MAGNET_TEMPERATURE;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_effect_init_q15(&o, twice, 2, &base));
    }
    static dqw_effect_q15_config many[DQW_EFFECT_WEIGHTS / 5 + 1];
    for (int k = 0; k < DQW_EFFECT_WEIGHTS / 5 + 1; k++)
        many[k] = (dqw_effect_q15_config){.effect = DQW_EFFECT_SATURATION, .i_uA = 15000000};
    REFUSED(o, DQW_ERR_EFFECT_ROOM, dqw_effect_init_q15(&o, many, DQW_EFFECT_WEIGHTS / 5 + 1, &base));
    // An index without an effect.
    int64_t w[DQW_EFFECT_STARTS];
    int64_t sd[DQW_EFFECT_STARTS];
    dqw_estimator_q15_config c;
    q = begin_one(&good, &c);
    TEST_ASSERT_EQUAL_INT(DQW_ERR_SIZE, dqw_estimator_read_effect_q15(&q, 1, w, sd));
    TEST_ASSERT_EQUAL_INT(DQW_ERR_SIZE, dqw_estimator_read_effect_q15(&q, -1, w, sd));
    TEST_ASSERT_EQUAL_INT(0, dqw_estimator_read_effect_q15(&q, 0, w, sd));
}

// What an effect asks for is asked, whatever stands before or behind it. (E51) to (E55)
static void test_what_a_list_asks_for(void)
{
    const dqw_effect_q15_base base = {.scale = &scale, .half_window = 20};
    for (int n = 0; n < LAWS; n++)
        for (int at = 0; at < 2; at++) {
            CASE("%s, place %d", laws[n].name, at);
            dqw_effect_q15_config list[2] = {{.effect = DQW_EFFECT_SKIN_EFFECT}, {.effect = DQW_EFFECT_SKIN_EFFECT}};
            list[at] = laws[n].two;
            list[at].tau_us = 0;
            static dqw_effect_q15 x;
            TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_effect_init_q15(&x, list, 2, &base));
            const enum dqw_effect_name name = laws[n].two.effect;
            const bool sensors = name == DQW_EFFECT_FLUX_HARMONICS || name == DQW_EFFECT_CURRENT_OFFSET ||
                                 name == DQW_EFFECT_CURRENT_GAIN_MISMATCH ||
                                 name == DQW_EFFECT_PHASE_RESISTANCE_IMBALANCE;
            HOLDS(x.needs_angle == (sensors || name == DQW_EFFECT_DEAD_TIME));
            HOLDS(x.needs_last == (name == DQW_EFFECT_IRON_LOSS || name == DQW_EFFECT_DELAY));
            HOLDS(x.needs_winding == (name == DQW_EFFECT_WINDING_TEMPERATURE));
            HOLDS(x.needs_magnet == (name == DQW_EFFECT_MAGNET_TEMPERATURE));
            for (int angle = 0; angle < 2; angle++) {
                const dqw_estimator_q15_config c = {
                    .scale = scale, .angle = angle == 1, .effects = list, .effect_count = 2};
                HOLDS(dqw_estimator_init_q15(&q, &c) == (x.needs_angle && !c.angle ? DQW_ERR_EFFECT_ANGLE : DQW_OK));
            }
            list[at].tau_us = 1000000;
            TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_effect_init_q15(&x, list, 2, &base));
            HOLDS(!x.needs_winding && !x.needs_magnet);
        }
}

// An effect's weights are of the voltage that a usual input makes, per unit of its base: an electrical angle a period
// at full speed, a temperature 50 K off, a tenth of a period's delay.
static double usual(const dqw_effect_q15_config *c, bool settled)
{
    const double angle = W_FULL * P_TRUE * (settled ? UNIT_S : DT_S);
    const double turn = settled ? 1 : angle;
    const double R = 0.9 * I_FULL / V_FULL;
    // L and L_d are of pairs' v dt / i, and of v / (w_e i) where rows are settled.
    const double L = 2.8e-3 * I_FULL / V_FULL / (settled ? UNIT_S : DT_S) * (settled ? angle : 1);
    const bool heats = c->tau_us > 0;
    switch (c->effect) {
    case DQW_EFFECT_SATURATION:
    case DQW_EFFECT_ANGLE_OFFSET:
    case DQW_EFFECT_FLUX_MAP: return turn;
    case DQW_EFFECT_CROSS_SATURATION: return turn / 2;
    case DQW_EFFECT_WINDING_TEMPERATURE: return heats ? 0.5 : 50 / 327.68;
    case DQW_EFFECT_MAGNET_TEMPERATURE: return (heats ? 0.5 : 50 / 327.68) * turn;
    case DQW_EFFECT_IRON_LOSS: return turn / (2 * (1 + R));
    case DQW_EFFECT_FLUX_HARMONICS: return fmin(1, turn * c->order);
    case DQW_EFFECT_CURRENT_OFFSET: return (R + L * turn) / fmax(R, L);
    case DQW_EFFECT_CURRENT_GAIN_MISMATCH: return (R + L * turn) / (2 * fmax(R, L));
    case DQW_EFFECT_DELAY: return 0.1;
    default: return 1;
    }
}

static void test_what_a_usual_input_is(void)
{
    for (int settled = 0; settled < 2; settled++)
        for (int n = 0; n < LAWS; n++) {
            CASE("%s, %s", laws[n].name, settled ? "settled" : "pairs");
            begin(&laws[n], settled);
            const double expected = usual(&laws[n].two, settled);
            BETWEEN(0.99999 * expected, two.base_q28[0] / 268435456.0, 1.00001 * expected);
        }
    dqw_effect_q15_config harmonics = {.effect = DQW_EFFECT_FLUX_HARMONICS};
    for (unsigned order = 1; order <= DQW_EFFECT_Q15_ORDERS; order++) {
        harmonics.order = (uint16_t)order;
        TEST_ASSERT_EQUAL_INT(DQW_OK, start(&harmonics, 1));
        const double expected = usual(&harmonics, false);
        BETWEEN(0.99999 * expected, two.base_q28[0] / 268435456.0, 1.00001 * expected);
    }
}

// An effect's weight is in so many halvings of its input that a usual one makes a full voltage of one.
static void test_a_usual_input_fills_its_unit(void)
{
    for (int n = 0; n < LAWS; n++) {
        CASE("%s", laws[n].name);
        const dqw_estimator_q15_config c = {.scale = scale, .angle = true, .effects = &laws[n].two, .effect_count = 1};
        TEST_ASSERT_EQUAL_INT_MESSAGE(DQW_OK, dqw_estimator_init_q15(&q, &c), test_case);
        for (int i = 0; i < q.effect.weights; i++) {
            const double unit = ldexp(q.effect.base_q28[0], q.shift[i]);
            HOLDS(unit >= 134217728.0 && unit <= 268435456.0);
        }
    }
}

// A start value is what is read before anything is learned of another effect's: to the plain unit and back.
static void test_start_values_and_weights_are_of_one_unit(void)
{
    for (int settled = 0; settled < 2; settled++)
        for (int n = 0; n < LAWS; n++) {
            CASE("%s, %s", laws[n].name, settled ? "settled" : "pairs");
            begin(&laws[n], settled);
            for (int i = 0; i < dqw_effect_weights(laws[n].one.effect); i++) {
                const int64_t start_q40 = -123456789012;
                const int64_t back = dqw_effect_restored_q40(&two, 0, i, dqw_effect_based_q40(&two, 0, i, start_q40));
                BETWEEN(1 - 1e-6, (double)back / (double)start_q40, 1 + 1e-6);
            }
        }
}

// Samples that are refused cost rows, not accuracy: `delay` and `iron_loss` need two rows before a pair.
static void test_no_pair_uses_a_refused_sample(void)
{
    static const char *const names[] = {"dead_time", "iron_loss", "delay"};
    for (int m = 0; m < 3; m++) {
        const law *l = laws;
        while (strcmp(l->name, names[m]) != 0) l++;
        CASE("%s", l->name);
        drive_rows();
        add_effect(l, false, ROWS);
        dqw_estimator_q15_config c;
        begin_estimators(l, false, &c);
        for (int k = 0; k < ROWS; k++) {
            dqw_sample s = exact(&rows[k]);
            dqw_sample_q15 x = fixed(&rows[k]);
            const bool bad = k % 37 == 5;
            if (bad) {
                s.v_d_V = s.i_q_A = 80.0f;
                x.v_d_q15 = x.i_q_q15 = 32000;
            }
            if (k % 1000 == 999) {
                dqw_estimator_missing(&e, 0);
                dqw_estimator_missing_q15(&q, 0);
                continue;
            }
            (void)dqw_estimator_sample(&e, &s, bad);
            (void)dqw_estimator_sample_q15(&q, &x, bad);
            (void)dqw_estimator_background(&e);
            (void)dqw_estimator_background_q15(&q);
        }
        double off;
        BETWEEN(0.0, weight_difference(l, false, &off), 0.3);
        BETWEEN(0.0, off, 0.6);
        BETWEEN(0.0, plain_difference(), 0.05);
    }
}

static int16_t bits(test_random *r)
{
    static const int16_t odd[] = {INT16_MIN, -INT16_MAX, -32766, -1, 0, 1, 32766, INT16_MAX};
    const uint64_t z = random_bits(r);
    return z % 4 == 0 ? odd[z / 4 % 8] : (int16_t)((int)(z >> 40 & 65535u) - 32768);
}

static uint32_t some(test_random *r) { return (uint32_t)random_bits(r) >> (random_bits(r) % 32); }

// Any list that init takes, any bits in every sample: no trap, inputs within their bound; afterwards a clean log is
// learned as ever.
static void test_any_bits(void)
{
    test_random r = {77};
    int taken = 0;
    for (int run = 0; run < scaled(1500); run++) {
        dqw_effect_q15_config list[3];
        const int n = (int)(random_bits(&r) % 3) + 1;
        for (int k = 0; k < n; k++)
            list[k] = (dqw_effect_q15_config){
                .effect = (enum dqw_effect_name)(random_bits(&r) % 15),
                .i_uA = some(&r),
                .R_uohm = some(&r),
                .Ld_nH = some(&r),
                .Lq_nH = some(&r),
                .psi_nWb = some(&r),
                .tau_us = random_bits(&r) % 2 ? (uint64_t)some(&r) * some(&r) : 0,
                .row_us = some(&r),
                .T_0_cC = bits(&r),
                .order = (uint16_t)some(&r),
                .start_q40 = {dqw_q_signed32(some(&r)) * ((int64_t)1 << 28), INT64_MIN, INT64_MAX}};
        const bool settled = random_bits(&r) % 4 == 0;
        const dqw_estimator_q15_config c = {.scale = {.v_full_mV = 1 + some(&r) % 10000000,
                                                      .i_full_mA = 1 + some(&r) % 10000000,
                                                      .w_full_mrad_s = 1 + some(&r) % 10000000,
                                                      .dt_ns = 1 + some(&r) % 1000000,
                                                      .pole_pairs = (uint16_t)(1 + some(&r) % 50)},
                                            .half_window = (uint8_t)(1 + some(&r) % 100),
                                            .angle = true,
                                            .settled = settled,
                                            .effects = list,
                                            .effect_count = (uint8_t)n};
        CASE("run %d", run);
        if (dqw_estimator_init_q15(&q, &c) != DQW_OK) continue;
        taken++;
        for (int k = 0; k < 250; k++) {
            const double length = random_uniform(&r, 0.94, 1.05);
            const double theta = random_uniform(&r, -PI, PI);
            const dqw_sample_q15 s = {bits(&r),
                                      bits(&r),
                                      bits(&r),
                                      bits(&r),
                                      bits(&r),
                                      q15(length * cos(theta), 1),
                                      q15(length * sin(theta), 1),
                                      bits(&r),
                                      bits(&r),
                                      0};
            (void)dqw_estimator_sample_q15(&q, &s, false);
            const dqw_effect_q15 *f = &q.effect;
            for (int i = 0; i < f->weights; i++)
                HOLDS(labs(f->a_d[i]) < 2L << f->fraction && labs(f->a_q[i]) < 2L << f->fraction &&
                      labs(f->g_d[i]) <= 1L << f->fraction && labs(f->g_q[i]) <= 1L << f->fraction);
            (void)dqw_estimator_background_q15(&q);
        }
        for (int k = 0; k < n; k++) {
            int64_t w[DQW_EFFECT_STARTS];
            int64_t sd[DQW_EFFECT_STARTS];
            HOLDS(dqw_estimator_read_effect_q15(&q, k, w, sd) >= 0);
        }
    }
    BETWEEN(0.05, (double)taken / scaled(1500), 0.95);
}

int main(void)
{
    take_table();
    UNITY_BEGIN();
    RUN_TEST(test_inputs_over_a_whole_trajectory);
    RUN_TEST(test_what_is_learned_is_what_float_learns);
    RUN_TEST(test_no_pair_uses_a_refused_sample);
    RUN_TEST(test_a_map_ends_at_its_edge);
    RUN_TEST(test_tanh_and_turns);
    RUN_TEST(test_a_window_holds_what_inputs_may_be);
    RUN_TEST(test_slow_heat_is_not_lost_to_rounding);
    RUN_TEST(test_temperatures_that_cannot_be_learned);
    RUN_TEST(test_start_values_and_weights_are_of_one_unit);
    RUN_TEST(test_what_a_usual_input_is);
    RUN_TEST(test_a_usual_input_fills_its_unit);
    RUN_TEST(test_an_effect_behind_others);
    RUN_TEST(test_pairs_after_a_gap);
    RUN_TEST(test_every_effect_before_another);
    RUN_TEST(test_each_deviation_is_widened_by_its_own_blocks);
    RUN_TEST(test_what_is_taught_is_an_effects_own);
    RUN_TEST(test_read_before_anything_was_learned);
    RUN_TEST(test_an_angle_that_is_none);
    RUN_TEST(test_what_a_list_asks_for);
    RUN_TEST(test_init_refuses_and_leaves_the_object_alone);
    RUN_TEST(test_any_bits);
    return UNITY_END();
}
