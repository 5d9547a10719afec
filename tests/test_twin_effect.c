// The effects' inputs in fixed point beside the float ones, each law over a whole trajectory; what is learned of them beside what float
// learns; heat, refusals, any bits.
#include "dqw_estimator.h"
#include "dqw_estimator_q15.h"
#include "dqw_test.h"
#include "sim_log.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

enum { HALF = 20, ROWS = 10000, SETTLED_ROWS = 600 };
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
    // Measured. Inputs: largest difference, 1/32768 of the base, of pairs and of settled rows.
    double pair, settled;
    // What is learned: largest difference of a weight, in percent of the effect's largest, and of R, L_d, L_q, psi; pairs, settled rows.
    double learned[2], plain[2];
} law;

#define FLOAT(name, ...) {.effect = (name), .shape = {__VA_ARGS__}}
#define MACHINE .R_uohm = 900000, .Ld_nH = 2200000, .Lq_nH = 2800000, .psi_nWb = 120000000
static const law laws[] = {
    {"dead_time", FLOAT(DQW_EFFECT_DEAD_TIME, 0.3f), {.effect = DQW_EFFECT_DEAD_TIME, .i_uA = 300000}, 1, 0, 0, {4}, 0.5, 0.5, {0.1, 0.1}, {0.1, 0.1}},
    {"saturation",
     FLOAT(DQW_EFFECT_SATURATION, 15),
     {.effect = DQW_EFFECT_SATURATION, .i_uA = 15000000},
     1,
     0,
     1,
     {-0.004, -0.003, -0.002, -0.008, -0.003},
     0.5,
     0.5,
     {0.1, 0.1},
     {0.1, 0.1}},
    {"cross_saturation",
     FLOAT(DQW_EFFECT_CROSS_SATURATION, 15),
     {.effect = DQW_EFFECT_CROSS_SATURATION, .i_uA = 15000000},
     1,
     0,
     1,
     {-0.006, -0.003, 0.002},
     0.5,
     0.5,
     {0.1, 0.1},
     {0.1, 0.1}},
    {"winding_temperature",
     FLOAT(DQW_EFFECT_WINDING_TEMPERATURE, 25, 0),
     {.effect = DQW_EFFECT_WINDING_TEMPERATURE, .T_0_cC = 2500},
     1,
     -1,
     0,
     {R_TRUE * 0.0039},
     0.5,
     0.5,
     {0.1, 0.1},
     {0.1, 0.1}},
    {"winding_temperature by heating",
     FLOAT(DQW_EFFECT_WINDING_TEMPERATURE, 25, 0.2f, 15),
     {.effect = DQW_EFFECT_WINDING_TEMPERATURE, .T_0_cC = 2500, .tau_us = 200000, .i_uA = 15000000},
     1,
     -1,
     0,
     {0.5},
     0.5,
     0.5,
     {0.1, 0.1},
     {0.1, 0.1}},
    {"magnet_temperature",
     FLOAT(DQW_EFFECT_MAGNET_TEMPERATURE, 25, 0),
     {.effect = DQW_EFFECT_MAGNET_TEMPERATURE, .T_0_cC = 2500},
     1,
     0,
     1,
     {-PSI_TRUE * 0.0012},
     0.5,
     0.5,
     {0.1, 0.1},
     {0.1, 0.1}},
    {"magnet_temperature by heating",
     FLOAT(DQW_EFFECT_MAGNET_TEMPERATURE, 25, 0.2f, 15),
     {.effect = DQW_EFFECT_MAGNET_TEMPERATURE, .T_0_cC = 2500, .tau_us = 200000, .i_uA = 15000000},
     1,
     0,
     1,
     {-0.02},
     0.5,
     0.5,
     {0.1, 0.1},
     {0.1, 0.1}},
    {"iron_loss",
     FLOAT(DQW_EFFECT_IRON_LOSS, (float)R_TRUE, (float)LD_TRUE, (float)LQ_TRUE),
     {.effect = DQW_EFFECT_IRON_LOSS, MACHINE},
     -1,
     1,
     0,
     {1.0 / 60},
     0.5,
     0.5,
     {0.1, 0.1},
     {0.1, 0.1}},
    {"flux_harmonics",
     FLOAT(DQW_EFFECT_FLUX_HARMONICS, 6),
     {.effect = DQW_EFFECT_FLUX_HARMONICS, .order = 6},
     1,
     0,
     1,
     {2e-3, -1e-3, 0.5e-3, 1.5e-3},
     0.5,
     0.5,
     {0.1, 0.1},
     {0.1, 0.1}},
    {"current_offset",
     FLOAT(DQW_EFFECT_CURRENT_OFFSET, (float)R_TRUE, (float)LD_TRUE, (float)LQ_TRUE),
     {.effect = DQW_EFFECT_CURRENT_OFFSET, MACHINE},
     0,
     1,
     0,
     {0.4, -0.25},
     0.5,
     0.5,
     {0.1, 0.1},
     {0.1, 0.1}},
    {"current_gain_mismatch",
     FLOAT(DQW_EFFECT_CURRENT_GAIN_MISMATCH, (float)R_TRUE, (float)LD_TRUE, (float)LQ_TRUE),
     {.effect = DQW_EFFECT_CURRENT_GAIN_MISMATCH, MACHINE},
     0,
     0,
     0,
     {0.03, -0.02},
     0.5,
     0.5,
     {0.1, 0.1},
     {0.1, 0.1}},
    {"angle_offset",
     FLOAT(DQW_EFFECT_ANGLE_OFFSET, (float)LD_TRUE, (float)LQ_TRUE, (float)PSI_TRUE),
     {.effect = DQW_EFFECT_ANGLE_OFFSET, MACHINE},
     0,
     0,
     0,
     {0.05},
     0.5,
     0.5,
     {0.1, 0.1},
     {0.1, 0.1}},
    {"delay", FLOAT(DQW_EFFECT_DELAY, 0), {.effect = DQW_EFFECT_DELAY}, 0, 0, 0, {0.3}, 0.5, 0.5, {0.1, 0.1}, {0.1, 0.1}},
    {"skin_effect", FLOAT(DQW_EFFECT_SKIN_EFFECT, 0), {.effect = DQW_EFFECT_SKIN_EFFECT}, 1, -1, 2, {R_TRUE * 1.5e-6}, 0.5, 0.5, {0.1, 0.1}, {0.1, 0.1}},
    {"phase_resistance_imbalance",
     FLOAT(DQW_EFFECT_PHASE_RESISTANCE_IMBALANCE, 0),
     {.effect = DQW_EFFECT_PHASE_RESISTANCE_IMBALANCE},
     1,
     -1,
     0,
     {0.2, -0.1},
     0.5,
     0.5,
     {0.1, 0.1},
     {0.1, 0.1}},
    {"voltage_offset", FLOAT(DQW_EFFECT_VOLTAGE_OFFSET, 0), {.effect = DQW_EFFECT_VOLTAGE_OFFSET}, 1, 0, 0, {1.5, -1.0}, 0.5, 0.5, {0.1, 0.1}, {0.1, 0.1}},
};
enum { LAWS = sizeof laws / sizeof laws[0] };

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
    const dqw_effect_q15_base fixed_base = {.scale = settled ? &settled_scale : &scale, .settled = settled, .half_window = HALF};
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
            BETWEEN(0.0, largest, 3.0);
            BETWEEN(0.0, worst, 1e9);
        }
    }
}

static dqw_random_sample memory_d[50], memory_q[50];

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_inputs_over_a_whole_trajectory);
    return UNITY_END();
}
