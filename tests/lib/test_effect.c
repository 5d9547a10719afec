// Every effect against a machine that has it by its physical law, integrated finely in double: the float learners must
// give back its weight and R, L_d, L_q, psi beside it. The plant works in phases, co-energies and circuits, not in
// (E51) to (E55).
#include "bent_iron.h"
#include "dqw_effect.h"
#include "dqw_effect_kind.h"
#include "dqw_estimator.h"
#include "dqw_estimator_block.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

#define R_TRUE 0.9
#define LD_TRUE 2.2e-3
#define LQ_TRUE 2.8e-3
#define PSI_TRUE 0.12
#define P_TRUE 4
#define DT_S 1e-4
#define I_BASE 15.0
enum { ROWS = 30000, WEIGHTS = 5 };

typedef struct plant {
    enum dqw_effect_name effect;
    double w[WEIGHTS];  ///< true weights
    double shape;       ///< width, order, time constant
    double heat;        ///< state of the winding or the magnet
    double temp_C;      ///< where a sensor tells it
} plant;

typedef struct row {
    double v_d, v_q, i_d, i_q, w_m, theta, temp;
} row;

static row rows[ROWS];

static double speed(double t) { return 20 + 100 * sin(2 * PI * 1.3 * t) + 15 * sin(2 * PI * 7 * t); }
static double angle(double t)
{
    return P_TRUE * (20 * t + 100 * (1 - cos(2 * PI * 1.3 * t)) / (2 * PI * 1.3) +
                     15 * (1 - cos(2 * PI * 7 * t)) / (2 * PI * 7));
}

static void turn(double by, const double x[2], double y[2])
{
    const double d = cos(by) * x[0] + sin(by) * x[1];
    y[1] = cos(by) * x[1] - sin(by) * x[0];
    y[0] = d;
}

// Dq quantities at angle theta as phases, and back: each phase's projection on the axes.
static void to_phases(double theta, const double dq[2], double abc[3])
{
    for (int x = 0; x < 3; x++) abc[x] = dq[0] * cos(theta - x * 2 * PI / 3) - dq[1] * sin(theta - x * 2 * PI / 3);
}
static void of_phases(double theta, const double abc[3], double dq[2])
{
    dq[0] = dq[1] = 0.0;
    for (int x = 0; x < 3; x++) {
        dq[0] += 2.0 / 3 * abc[x] * cos(theta - x * 2 * PI / 3);
        dq[1] -= 2.0 / 3 * abc[x] * sin(theta - x * 2 * PI / 3);
    }
}

static double coenergy(const plant *p, double i_d, double i_q)
{
    const double x = i_d / I_BASE;
    const double y = i_q / I_BASE;
    double w = 0.5 * LD_TRUE * i_d * i_d + 0.5 * LQ_TRUE * i_q * i_q + PSI_TRUE * i_d;
    if (p->effect == DQW_EFFECT_SATURATION)
        w += I_BASE * (p->w[0] * pow(x, 3) / 3 + p->w[1] * pow(x, 4) / 4 + p->w[2] * pow(x, 5) / 5 +
                       p->w[3] * pow(y, 4) / 4 + p->w[4] * pow(y, 6) / 6);
    if (p->effect == DQW_EFFECT_CROSS_SATURATION)
        w += I_BASE * (p->w[0] * x * y * y + p->w[1] * x * x * y * y + p->w[2] * x * pow(y, 4));
    // Both axes of one co-energy: they bend alike.
    if (p->effect == DQW_EFFECT_FLUX_MAP) w += p->w[0] * bent_coenergy(i_d, i_q);
    if (p->effect == DQW_EFFECT_MAGNET_TEMPERATURE) w += p->w[0] * (p->shape > 0 ? p->heat : p->temp_C - 25) * i_d;
    return w;
}

static void flux(const plant *p, const double i[2], double psi[2])
{
    const double h = 1e-2;
    psi[0] = (coenergy(p, i[0] + h, i[1]) - coenergy(p, i[0] - h, i[1])) / (2 * h);
    psi[1] = (coenergy(p, i[0], i[1] + h) - coenergy(p, i[0], i[1] - h)) / (2 * h);
}

// Terminal current of the state, which is the flux-bearing current: iron takes its share of the induced voltage.
static void terminal(const plant *p, const double v[2], const double i_m[2], double i[2])
{
    const double G = p->effect == DQW_EFFECT_IRON_LOSS ? p->w[0] : 0.0;
    for (int a = 0; a < 2; a++) i[a] = i_m[a] + G * (v[a] - R_TRUE * i_m[a]) / (1 + R_TRUE * G);
}

// d/dt of the flux-bearing current and of the heat under the stationary voltage.
static void slope(const plant *p, double t, const double stationary[2], const double x[3], double out[3])
{
    const double theta = angle(t);
    const double w_e = P_TRUE * speed(t);
    plant now = *p;
    now.heat = x[2];
    double v[2], i[2], psi[2], abc[3], loss[2] = {0, 0};
    turn(theta, stationary, v);
    terminal(&now, v, x, i);
    to_phases(theta, i, abc);
    double r = R_TRUE;
    switch (p->effect) {
    case DQW_EFFECT_DEAD_TIME:
        for (int k = 0; k < 3; k++) abc[k] = p->w[0] * tanh(abc[k] / p->shape);
        of_phases(theta, abc, loss);
        break;
    case DQW_EFFECT_PHASE_RESISTANCE_IMBALANCE:
        abc[0] *= p->w[0];
        abc[1] *= p->w[1];
        abc[2] = 0.0;
        of_phases(theta, abc, loss);
        break;
    case DQW_EFFECT_WINDING_TEMPERATURE: r += p->w[0] * (p->shape > 0 ? x[2] : p->temp_C - 25); break;
    case DQW_EFFECT_SKIN_EFFECT: r += p->w[0] * w_e * w_e; break;
    case DQW_EFFECT_VOLTAGE_OFFSET:
        loss[0] = p->w[0];
        loss[1] = p->w[1];
        break;
    default: break;
    }
    double e[2];
    for (int a = 0; a < 2; a++) e[a] = v[a] - loss[a] - r * i[a];
    flux(&now, x, psi);
    double along[2] = {0, 0};  // of the flux with the angle
    if (p->effect == DQW_EFFECT_FLUX_HARMONICS) {
        const double c = cos(p->shape * theta);
        const double s = sin(p->shape * theta);
        psi[0] += p->w[0] * c + p->w[1] * s;
        psi[1] += p->w[2] * c + p->w[3] * s;
        along[0] = p->shape * (p->w[1] * c - p->w[0] * s);
        along[1] = p->shape * (p->w[3] * c - p->w[2] * s);
    }
    e[0] -= w_e * (along[0] - psi[1]);
    e[1] -= w_e * (along[1] + psi[0]);
    // Differential inductances by differences of the flux.
    const double h = 1e-2;
    double up[2], down[2], l[2][2];
    for (int a = 0; a < 2; a++) {
        double j[2] = {x[0], x[1]};
        j[a] += h;
        flux(&now, j, up);
        j[a] -= 2 * h;
        flux(&now, j, down);
        for (int b = 0; b < 2; b++) l[b][a] = (up[b] - down[b]) / (2 * h);
    }
    const double determinant = l[0][0] * l[1][1] - l[0][1] * l[1][0];
    out[0] = (l[1][1] * e[0] - l[0][1] * e[1]) / determinant;
    out[1] = (l[0][0] * e[1] - l[1][0] * e[0]) / determinant;
    out[2] = p->shape > 0 ? ((i[0] * i[0] + i[1] * i[1]) / (I_BASE * I_BASE) - x[2]) / p->shape : 0.0;
}

static void advance(const plant *p, double t, double h, const double v[2], double x[3])
{
    double k1[3], k2[3], k3[3], k4[3], y[3];
    slope(p, t, v, x, k1);
    for (int a = 0; a < 3; a++) y[a] = x[a] + 0.5 * h * k1[a];
    slope(p, t + 0.5 * h, v, y, k2);
    for (int a = 0; a < 3; a++) y[a] = x[a] + 0.5 * h * k2[a];
    slope(p, t + 0.5 * h, v, y, k3);
    for (int a = 0; a < 3; a++) y[a] = x[a] + h * k3[a];
    slope(p, t + h, v, y, k4);
    for (int a = 0; a < 3; a++) x[a] += h / 6 * (k1[a] + 2 * k2[a] + 2 * k3[a] + k4[a]);
}

// What the sensors and the frame make of the truth.
static void sense(const plant *p, double theta, row *r)
{
    double i[2] = {r->i_d, r->i_q};
    double abc[3];
    to_phases(theta, i, abc);
    if (p->effect == DQW_EFFECT_CURRENT_OFFSET) {
        abc[0] += p->w[0];
        abc[1] += -0.5 * p->w[0] + 0.5 * sqrt(3) * p->w[1];
        abc[2] += -0.5 * p->w[0] - 0.5 * sqrt(3) * p->w[1];
    }
    if (p->effect == DQW_EFFECT_CURRENT_GAIN_MISMATCH) {
        // Gains without a common part: a by 2 m_1, b less c by -2 sqrt(3) m_2.
        abc[0] *= 1 + 2 * p->w[0];
        abc[1] *= 1 - p->w[0] - sqrt(3) * p->w[1];
        abc[2] *= 1 - p->w[0] + sqrt(3) * p->w[1];
    }
    of_phases(theta, abc, i);
    r->i_d = i[0];
    r->i_q = i[1];
    if (p->effect == DQW_EFFECT_ANGLE_OFFSET) {
        double v[2] = {r->v_d, r->v_q};
        turn(p->w[0], i, i);
        turn(p->w[0], v, v);
        r->i_d = i[0];
        r->i_q = i[1];
        r->v_d = v[0];
        r->v_q = v[1];
        r->theta += p->w[0];
    }
}

// Current references redrawn every 20 ms, a proportional loop with the model's voltage, a binary voltage on top.
static void simulate(const plant *p, uint64_t seed)
{
    // A delay ends between two of them.
    const int steps = p->effect == DQW_EFFECT_DELAY ? 10 : 4;
    test_random r = {seed};
    plant now = *p;
    double x[3] = {0, 0, 0};
    double ref[2] = {0, 0}, dither[2] = {0, 0}, held[2] = {0, 0};
    for (int k = 0; k < ROWS; k++) {
        const double t = k * DT_S;
        const double w_e = P_TRUE * speed(t);
        if (k % 200 == 0) {
            ref[0] = random_uniform(&r, -9, 6);
            ref[1] = random_uniform(&r, -10, 10);
        }
        if (k % 4 == 0)
            for (int a = 0; a < 2; a++) dither[a] = random_bits(&r) & 1u ? 8 : -8;
        now.temp_C = 25 + 60 * t / (ROWS * DT_S) + 10 * sin(2 * PI * 0.9 * t);
        double v_held[2], i[2];
        // The sensors see the last voltage still.
        turn(angle(t), held, v_held);
        terminal(&now, v_held, x, i);
        double v[2] = {R_TRUE * ref[0] - w_e * LQ_TRUE * ref[1] + 4 * (ref[0] - x[0]) + dither[0],
                       R_TRUE * ref[1] + w_e * (LD_TRUE * ref[0] + PSI_TRUE) + 4 * (ref[1] - x[1]) + dither[1]};
        double old[2] = {held[0], held[1]};
        turn(-angle(t + 0.5 * DT_S), v, held);
        row *out = &rows[k];
        *out = (row){0, 0, i[0], i[1], speed(t), angle(t), now.temp_C};
        for (int s = 0; s < steps; s++) {
            const double at = t + DT_S * s / steps;
            const bool late = p->effect == DQW_EFFECT_DELAY && s + 0.5 < p->w[0] * steps;
            advance(&now, at, DT_S / steps, late ? old : held, x);
            now.heat = x[2];
            // What was commanded, as the rotor sees it: Simpson.
            double v0[2], v1[2], v2[2];
            turn(angle(at), held, v0);
            turn(angle(at + 0.5 * DT_S / steps), held, v1);
            turn(angle(at + DT_S / steps), held, v2);
            out->v_d += (v0[0] + 4 * v1[0] + v2[0]) / 6 / steps;
            out->v_q += (v0[1] + 4 * v1[1] + v2[1]) / 6 / steps;
        }
        sense(p, angle(t), out);
    }
}

static double deviation(int channel)
{
    double sum = 0, sum2 = 0;
    for (int k = 0; k < ROWS; k++) {
        const double x = (&rows[k].v_d)[channel];
        sum += x;
        sum2 += x * x;
    }
    return sqrt(sum2 / ROWS - sum * sum / ROWS / ROWS);
}

static dqw_effect_config list[2];

static dqw_estimator begin(const dqw_estimator_config *c)
{
    dqw_estimator e;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&e, c));
    return e;
}

static uint32_t show(dqw_estimator *e, const dqw_sample *s, bool saturated)
{
    const uint32_t event = dqw_estimator_sample(e, s, saturated);
    if (event & DQW_EVENT_BLOCK) (void)dqw_estimator_background(e);
    return event;
}

static dqw_sample sample_of(int k)
{
    dqw_sample s = dqw_sample_from_dq((float)rows[k].v_d, (float)rows[k].v_q, (float)rows[k].i_d, (float)rows[k].i_q,
                                      (float)rows[k].w_m, (float)remainder(rows[k].theta, 2 * PI));
    s.temp_winding_C = s.temp_magnet_C = (float)rows[k].temp;
    return s;
}

static dqw_estimator_config config_of(int effects)
{
    const dqw_estimator_config c = {.dt_s = (float)DT_S,
                                    .v_base_V = 100.0f,
                                    .i_base_A = (float)I_BASE,
                                    .w_base_rad_s = 140.0f,
                                    .pole_pairs = P_TRUE,
                                    .half_window = 10,
                                    .angle = true,
                                    .noise_on_inputs = true,
                                    .effects = list,
                                    .effect_count = (uint8_t)effects};
    return c;
}

// Noise as a part of each signal's own deviation, angle and temperature exact.
static dqw_estimator learned(const dqw_estimator_config *c, double noise, uint64_t seed)
{
    dqw_estimator e = begin(c);
    double sd[5];
    for (int n = 0; n < 5; n++) sd[n] = noise * deviation(n);
    test_random r = {seed};
    for (int k = 0; k < ROWS; k++) {
        double x[5];
        for (int n = 0; n < 5; n++) x[n] = (&rows[k].v_d)[n] + (noise > 0 ? sd[n] * random_normal(&r) : 0.0);
        dqw_sample s = dqw_sample_from_dq((float)x[0], (float)x[1], (float)x[2], (float)x[3], (float)x[4],
                                          (float)remainder(rows[k].theta, 2 * PI));
        s.temp_winding_C = (float)rows[k].temp;
        s.temp_magnet_C = (float)rows[k].temp;
        (void)show(&e, &s, false);
    }
    return e;
}

typedef struct law {
    enum dqw_effect_name effect;
    const char *name;
    int weights;
    double w[WEIGHTS], shape;
    float config[4];
    // Measured: largest error of the weights in % of the largest, of R, L_d, L_q, psi in % of each; without noise, with
    // 1 %.
    double weight[2], plain[2];
    double alone;  ///< measured: the worst of R, L_d, L_q, psi where the effect is not configured
} law;

#define MACHINE_SHAPE                                                                                                  \
    {                                                                                                                  \
        (float)R_TRUE, (float)LD_TRUE, (float)LQ_TRUE                                                                  \
    }
static const law laws[] = {
    {DQW_EFFECT_DEAD_TIME, "dead_time", 1, {4}, 0.3, {0.3f}, {0.349, 0.268}, {0.226, 0.14}, 78.7},
    {DQW_EFFECT_SATURATION,
     "saturation",
     5,
     {-0.004, -0.003, -0.002, -0.008, -0.003},
     0,
     {(float)I_BASE},
     {0.371, 7.63},
     {0.0104, 0.128},
     6.2},
    {DQW_EFFECT_CROSS_SATURATION,
     "cross_saturation",
     3,
     {-0.006, -0.003, 0.002},
     0,
     {(float)I_BASE},
     {0.0184, 0.172},
     {0.00526, 0.0288},
     3.21},
    {DQW_EFFECT_WINDING_TEMPERATURE,
     "winding_temperature",
     1,
     {R_TRUE * 0.0039},
     0,
     {25, 0},
     {0.00231, 0.251},
     {0.00109, 0.0365},
     12.8},
    {DQW_EFFECT_WINDING_TEMPERATURE,
     "winding_temperature by heating",
     1,
     {0.5},
     0.7,
     {25, 0.7f, (float)I_BASE},
     {0.0259, 0.259},
     {0.00123, 0.0523},
     10},
    {DQW_EFFECT_MAGNET_TEMPERATURE,
     "magnet_temperature",
     1,
     {-PSI_TRUE * 0.0012},
     0,
     {25, 0},
     {0.0074, 0.15},
     {0.00968, 0.0389},
     3.61},
    {DQW_EFFECT_MAGNET_TEMPERATURE,
     "magnet_temperature by heating",
     1,
     {-0.02},
     0.7,
     {25, 0.7f, (float)I_BASE},
     {0.141, 0.0864},
     {0.0249, 0.0458},
     3.15},
    {DQW_EFFECT_IRON_LOSS, "iron_loss", 1, {1.0 / 60}, 0, MACHINE_SHAPE, {0.0427, 0.0342}, {0.00192, 0.0219}, 1.86},
    {DQW_EFFECT_FLUX_HARMONICS,
     "flux_harmonics",
     4,
     {2e-3, -1e-3, 0.5e-3, 1.5e-3},
     6,
     {6},
     {0.0208, 0.095},
     {0.00699, 0.0122},
     9.56},
    {DQW_EFFECT_CURRENT_OFFSET,
     "current_offset",
     2,
     {0.4, -0.25},
     0,
     MACHINE_SHAPE,
     {0.0168, 0.0479},
     {0.000973, 0.049},
     0.232},
    {DQW_EFFECT_CURRENT_GAIN_MISMATCH,
     "current_gain_mismatch",
     2,
     {0.03, -0.02},
     0,
     MACHINE_SHAPE,
     {0.151, 0.461},
     {0.131, 0.154},
     0.419},
    {DQW_EFFECT_ANGLE_OFFSET,
     "angle_offset",
     1,
     {0.05},
     0,
     {(float)LD_TRUE, (float)LQ_TRUE, (float)PSI_TRUE},
     {0.0482, 0.0537},
     {0.000910, 0.00898},
     0.180},
    {DQW_EFFECT_DELAY, "delay", 1, {0.3}, 0, {0}, {1.35, 1.27}, {0.00323, 0.0464}, 1.98},
    {DQW_EFFECT_SKIN_EFFECT, "skin_effect", 1, {R_TRUE * 1.5e-6}, 0, {0}, {0.0177, 0.117}, {0.00349, 0.0277}, 12.4},
    {DQW_EFFECT_PHASE_RESISTANCE_IMBALANCE,
     "phase_resistance_imbalance",
     2,
     {0.2, -0.1},
     0,
     {0},
     {0.0667, 0.284},
     {0.00519, 0.0403},
     3.72},
    {DQW_EFFECT_VOLTAGE_OFFSET, "voltage_offset", 2, {1.5, -1.0}, 0, {0}, {0.00332, 0.41}, {0.00161, 0.0354}, 3.67},
    {DQW_EFFECT_FLUX_MAP,
     "flux_map",
     2,
     {0.9, 0.9},
     0,
     {(float)BENT_FULL_WB, (float)BENT_CELL_D_A, (float)BENT_CELL_Q_A},
     {0.0196, 0.185},
     {0.0143, 0.0301},
     10.2},
};
enum { LAWS = sizeof laws / sizeof laws[0] };

static double plain_error(const dqw_estimator *e)
{
    static const double truth[] = {R_TRUE, LD_TRUE, LQ_TRUE, PSI_TRUE};
    double worst = 0.0;
    for (int i = 0; i < 4; i++)
        worst = fmax(worst, 100 * fabs((double)dqw_estimator_read(e, (enum dqw_parameter)i).value / truth[i] - 1));
    return worst;
}

static bool all_usable(const dqw_estimator *e)
{
    for (int i = 0; i < 4; i++)
        if (!dqw_estimator_read(e, (enum dqw_parameter)i).usable) return false;
    return true;
}

// A law behind others that this machine has not: its weights are where the list says, and the others' are about
// nothing.
static void behind_others(const law *l)
{
    // Looked for beside each other they are alike.
    if (l->effect == DQW_EFFECT_VOLTAGE_OFFSET || l->effect == DQW_EFFECT_SKIN_EFFECT) return;
    dqw_effect_config behind[3] = {{.effect = DQW_EFFECT_VOLTAGE_OFFSET},
                                   {.effect = DQW_EFFECT_DEAD_TIME, .shape = {0.3f}},
                                   {.effect = l->effect, .map = bent_table()}};
    memcpy(behind[2].shape, l->config, sizeof l->config);
    dqw_estimator_config c = config_of(0);
    c.effects = behind;
    c.effect_count = l->effect == DQW_EFFECT_DEAD_TIME ? 2 : 3;
    CASE("%s behind others", l->name);
    const dqw_estimator e = learned(&c, 0.0, 1);
    float weights[DQW_EFFECT_STARTS];
    float sd[DQW_EFFECT_STARTS];
    HOLDS(dqw_estimator_read_effect(&e, c.effect_count - 1, weights, sd) == (1 << l->weights) - 1);
    double largest = 0.0;
    for (int i = 0; i < l->weights; i++) largest = fmax(largest, fabs(l->w[i]));
    for (int i = 0; i < l->weights; i++)
        BETWEEN(-3 * l->weight[0] - 0.2, 100 * (weights[i] - l->w[i]) / largest, 3 * l->weight[0] + 0.2);
    // Of a base of 100 V: what the law leaves out goes there.
    HOLDS(dqw_estimator_read_effect(&e, 0, weights, sd) >= 0);
    for (int i = 0; i < 2; i++) BETWEEN(-0.02, weights[i], 0.02);                                              // 0.003
    if (l->effect != DQW_EFFECT_DEAD_TIME) BETWEEN(-0.01, dqw_estimator_read(&e, DQW_DEAD_TIME).value, 0.01);  // 0.0012
}

static void test_every_effect_gives_back_its_weight(void)
{
    for (int k = 0; k < LAWS; k++) {
        const law *l = &laws[k];
        plant p = {.effect = l->effect, .shape = l->shape};
        memcpy(p.w, l->w, sizeof p.w);
        simulate(&p, (uint64_t)(100 + k));
        list[0] = (dqw_effect_config){.effect = l->effect, .map = bent_table()};
        memcpy(list[0].shape, l->config, sizeof l->config);
        double largest = 0.0;
        for (int i = 0; i < l->weights; i++) largest = fmax(largest, fabs(l->w[i]));
        TEST_ASSERT_EQUAL_INT(l->weights, dqw_effect_weights(l->effect));
        for (int noisy = 0; noisy < 2; noisy++) {
            CASE("%s, noise %d %%", l->name, noisy);
            const dqw_estimator_config c = config_of(1);
            const dqw_estimator e = learned(&c, 0.01 * noisy, (uint64_t)(7 + k));
            float weights[DQW_EFFECT_STARTS], sd[DQW_EFFECT_STARTS];
            const int known = dqw_estimator_read_effect(&e, 0, weights, sd);
            double worst = 0.0;
            for (int i = 0; i < l->weights; i++) worst = fmax(worst, 100 * fabs(weights[i] - l->w[i]) / largest);
            BETWEEN(l->weight[noisy] / 3 - 0.02, worst, 1.5 * l->weight[noisy] + 0.02);
            // What is known is right by its own deviation, but for what the law leaves out.
            for (int i = 0; i < l->weights && noisy == 1; i++)
                BETWEEN(-4.5, (weights[i] - l->w[i]) / fmax(sd[i], 0.015 * fabs(l->w[i])), 4.5);
            BETWEEN(l->plain[noisy] / 3 - 0.01, plain_error(&e), 1.5 * l->plain[noisy] + 0.01);
            HOLDS(all_usable(&e));
            HOLDS(known == (1 << l->weights) - 1);
        }
        CASE("%s, not configured", l->name);
        const dqw_estimator_config c = config_of(0);
        const dqw_estimator e = learned(&c, 0.0, 1);
        BETWEEN(0.9 * l->alone, plain_error(&e), 1.1 * l->alone);
        behind_others(l);
    }
}

// The voltage under which the plant's currents stand still: its slope is affine in the voltage.
static void settle(const plant *p, double t, const double x[3], double v[2])
{
    const double theta = angle(t);
    double at[3][3], a[2][2];
    for (int n = 0; n < 3; n++) {
        double unit[2] = {n == 1, n == 2};
        turn(-theta, unit, unit);
        slope(p, t, unit, x, at[n]);
    }
    for (int n = 0; n < 2; n++)
        for (int m = 0; m < 2; m++) a[m][n] = at[n + 1][m] - at[0][m];
    const double determinant = a[0][0] * a[1][1] - a[0][1] * a[1][0];
    v[0] = -(a[1][1] * at[0][0] - a[0][1] * at[0][1]) / determinant;
    v[1] = -(a[0][0] * at[0][1] - a[1][0] * at[0][0]) / determinant;
}

static void test_settled_rows_give_back_what_has_no_slope(void)
{
    for (int k = 0; k < LAWS; k++) {
        const law *l = &laws[k];
        // What turns with the angle does not settle; a delay needs a change, heat needs time.
        if (l->effect == DQW_EFFECT_FLUX_HARMONICS || l->effect == DQW_EFFECT_CURRENT_OFFSET ||
            l->effect == DQW_EFFECT_CURRENT_GAIN_MISMATCH || l->effect == DQW_EFFECT_DELAY ||
            (l->effect != DQW_EFFECT_DEAD_TIME && l->shape > 0))
            continue;
        CASE("%s", l->name);
        plant p = {.effect = l->effect, .shape = l->shape};
        memcpy(p.w, l->w, sizeof p.w);
        list[0] = (dqw_effect_config){.effect = l->effect, .map = bent_table()};
        memcpy(list[0].shape, l->config, sizeof l->config);
        dqw_estimator_config c = config_of(1);
        c.settled = true;
        dqw_estimator e;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&e, &c));
        test_random r = {(uint64_t)(200 + k)};
        for (int n = 0; n < 2000; n++) {
            const double x[3] = {random_uniform(&r, -10, 10), random_uniform(&r, -10, 10), 0};
            const double t = random_uniform(&r, 0, 1);
            p.temp_C = random_uniform(&r, 0, 120);
            double v[2], i[2];
            settle(&p, t, x, v);
            terminal(&p, v, x, i);
            row s = {v[0], v[1], i[0], i[1], speed(t), angle(t), p.temp_C};
            sense(&p, angle(t), &s);
            dqw_sample sample = dqw_sample_from_dq((float)s.v_d, (float)s.v_q, (float)s.i_d, (float)s.i_q, (float)s.w_m,
                                                   (float)remainder(s.theta, 2 * PI));
            sample.temp_winding_C = (float)s.temp;
            sample.temp_magnet_C = (float)s.temp;
            (void)show(&e, &sample, false);
        }
        float weights[DQW_EFFECT_STARTS], sd[DQW_EFFECT_STARTS];
        HOLDS(dqw_estimator_read_effect(&e, 0, weights, sd) == (1 << l->weights) - 1);
        double largest = 0.0;
        for (int i = 0; i < l->weights; i++) largest = fmax(largest, fabs(l->w[i]));
        // An angle offset is its first order alone; neighbouring powers are alike.
        const double bound = l->effect == DQW_EFFECT_ANGLE_OFFSET ? 0.3
                             : l->effect == DQW_EFFECT_SATURATION ? 0.2
                                                                  : 0.05;
        for (int i = 0; i < l->weights; i++) BETWEEN(-bound, 100 * (weights[i] - l->w[i]) / largest, bound);
        BETWEEN(0.0, plain_error(&e), bound);
    }
}

// In a list or as a width: the same weight, to the bit; read by both names.
static void test_dead_time_in_the_list_is_the_weight_that_every_estimator_has(void)
{
    plant p = {.effect = DQW_EFFECT_DEAD_TIME, .w = {4}, .shape = 0.3};
    simulate(&p, 100);
    list[0] = (dqw_effect_config){.effect = DQW_EFFECT_DEAD_TIME, .shape = {0.3f}, .start = {1.5f}};
    const dqw_estimator_config listed = config_of(1);
    dqw_estimator_config plain = config_of(0);
    plain.dead_time_width_A = 0.3f;
    const dqw_estimator fresh = begin(&listed);
    BETWEEN(1.5 * 0.999999, dqw_estimator_read(&fresh, DQW_DEAD_TIME).value, 1.5 * 1.000001);
    list[0].start[0] = 0.0f;
    const dqw_estimator a = learned(&listed, 0.01, 3);
    const dqw_estimator b = learned(&plain, 0.01, 3);
    TEST_ASSERT_EQUAL_UINT8(DQW_PARAMETERS, a.inputs);
    TEST_ASSERT_EQUAL_MEMORY(a.w_pu, b.w_pu, sizeof a.w_pu);
    TEST_ASSERT_EQUAL_MEMORY(&a.gain, &b.gain, sizeof a.gain);
    float weight;
    float sd;
    HOLDS(dqw_estimator_read_effect(&a, 0, &weight, &sd) == 1);
    const dqw_reading r = dqw_estimator_read(&a, DQW_DEAD_TIME);
    HOLDS(weight == r.value && sd == r.sd && r.usable);
    HOLDS(dqw_estimator_read_effect(&b, 0, &weight, &sd) == DQW_ERR_SIZE);
    // The list's width counts where both are given.
    plain.dead_time_width_A = 5.0f;
    plain.effects = list;
    plain.effect_count = 1;
    const dqw_estimator both = learned(&plain, 0.01, 3);
    TEST_ASSERT_EQUAL_MEMORY(a.w_pu, both.w_pu, sizeof a.w_pu);
}

// Out of range, and before anything was learned: no weight is known, and every number is one.
static void test_read_before_anything_was_learned(void)
{
    for (int k = 0; k < LAWS; k++) {
        CASE("%s", laws[k].name);
        list[0] = (dqw_effect_config){.effect = DQW_EFFECT_VOLTAGE_OFFSET, .start = {0.5f, -0.25f}};
        list[1] = (dqw_effect_config){
            .effect = laws[k].effect, .start = {0.01f, 0.02f, 0.03f, 0.04f, 0.05f}, .map = bent_table()};
        memcpy(list[1].shape, laws[k].config, sizeof laws[k].config);
        const dqw_estimator_config c = config_of(2);
        dqw_estimator e = begin(&c);
        for (int way = 0; way < 2; way++) {
            float w[DQW_EFFECT_STARTS] = {9, 9, 9, 9, 9};
            float sd[DQW_EFFECT_STARTS] = {9, 9, 9, 9, 9};
            HOLDS(dqw_estimator_read_effect(&e, -1, w, sd) == DQW_ERR_SIZE &&
                  dqw_estimator_read_effect(&e, 2, w, sd) == DQW_ERR_SIZE);
            HOLDS(w[0] == 9.0f && sd[0] == 9.0f);
            HOLDS(dqw_estimator_read_effect(&e, 1, w, sd) == 0);
            for (int i = 0; i < laws[k].weights; i++) {
                BETWEEN(0.01 * (i + 1) * 0.999999, w[i], 0.01 * (i + 1) * 1.000001);
                HOLDS(sd[i] == DQW_UNKNOWN);
            }
            for (int i = laws[k].weights; i < DQW_EFFECT_STARTS; i++) HOLDS(w[i] == 9.0f && sd[i] == 9.0f);
            HOLDS(dqw_estimator_read_effect(&e, 0, w, sd) == 0);
            BETWEEN(0.499999, w[0], 0.500001);
            BETWEEN(-0.250001, w[1], -0.249999);
            // And after rows that are all refused.
            const dqw_sample bad = {.v_d_V = NAN};
            for (int n = 0; n < 200 && way == 0; n++) (void)show(&e, &bad, false);
        }
    }
}

static void test_an_effect_that_the_rows_do_not_show_is_not_known(void)
{
    // A magnet whose temperature stands is a part of psi; where no current flows there is no dead time, and
    // nothing is learned at all: the other weights would take up what is wrong with its shape.
    const enum dqw_effect_name names[] = {DQW_EFFECT_MAGNET_TEMPERATURE, DQW_EFFECT_DEAD_TIME};
    for (int n = 0; n < 2; n++) {
        CASE("effect %d", (int)names[n]);
        list[0] = (dqw_effect_config){.effect = names[n], .shape = {n == 0 ? 20.0f : 0.3f}};
        const dqw_estimator_config c = config_of(1);
        dqw_estimator e;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&e, &c));
        for (int k = 0; k < 20000; k++) {
            const float w = 100.0f + 50.0f * (float)sin(0.001 * k);
            dqw_sample s = dqw_sample_from_dq(0, (float)(P_TRUE * PSI_TRUE * w), 0, 0, w,
                                              (float)fmod(0.04 * k, 2 * PI));
            s.temp_magnet_C = 80.0f;
            (void)show(&e, &s, false);
        }
        float weight, sd;
        HOLDS(dqw_estimator_read_effect(&e, 0, &weight, &sd) == 0);
        const dqw_reading psi = dqw_estimator_read(&e, DQW_PSI);
        HOLDS(!(psi.sd < 0.25f * psi.value));
    }
}

static void test_init_refuses_and_leaves_the_object_alone(void)
{
    dqw_estimator e;
    list[0] = (dqw_effect_config){.effect = DQW_EFFECT_DEAD_TIME, .shape = {0.3f}};
    list[1] = list[0];
    dqw_estimator_config c = config_of(1);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&e, &c));
    c.pole_pairs = 0;
    REFUSED(e, DQW_ERR_EFFECT_POLE_PAIRS, dqw_estimator_init(&e, &c));
    c = config_of(1);
    c.effects = NULL;
    REFUSED(e, DQW_ERR_EFFECT_LIST, dqw_estimator_init(&e, &c));
    const float bad[] = {0.0f, -1.0f, NAN, INFINITY, 1e-39f};
    for (int k = 0; k < 5; k++) {
        CASE("width %g", (double)bad[k]);
        list[0].shape[0] = bad[k];
        c = config_of(1);
        REFUSED(e, DQW_ERR_EFFECT_SHAPE, dqw_estimator_init(&e, &c));
    }
    list[0].shape[0] = 0.3f;
    list[0].start[0] = NAN;
    REFUSED(e, DQW_ERR_EFFECT_SHAPE, dqw_estimator_init(&e, &c));
    list[0].start[0] = 0.0f;
    const enum dqw_effect_name wrong[] = {DQW_EFFECT_NONE, DQW_EFFECT_NAMES, (enum dqw_effect_name)1000,
                                          DQW_EFFECT_COULOMB_FRICTION};
    for (int k = 0; k < 4; k++) {
        list[0].effect = wrong[k];
        REFUSED(e, DQW_ERR_EFFECT_NAME, dqw_estimator_init(&e, &c));
    }
    // Twice the same heating, more weights than there is room for, an iron loss without inductances.
    list[0] = list[1] = (dqw_effect_config){.effect = DQW_EFFECT_WINDING_TEMPERATURE, .shape = {25, 100}};
    c = config_of(2);
    REFUSED(e, DQW_ERR_EFFECT_TWICE, dqw_estimator_init(&e, &c));
    static dqw_effect_config many[DQW_EFFECT_WEIGHTS / 5 + 1];
    for (int k = 0; k < DQW_EFFECT_WEIGHTS / 5 + 1; k++)
        many[k] = (dqw_effect_config){.effect = DQW_EFFECT_SATURATION, .shape = {10}};
    c.effects = many;
    c.effect_count = DQW_EFFECT_WEIGHTS / 5 + 1;
    REFUSED(e, DQW_ERR_EFFECT_ROOM, dqw_estimator_init(&e, &c));
    list[0] = (dqw_effect_config){.effect = DQW_EFFECT_IRON_LOSS};
    c = config_of(1);
    REFUSED(e, DQW_ERR_EFFECT_SHAPE, dqw_estimator_init(&e, &c));
}

// What an effect itself refuses, by name; and a dead time that is someone else's weight.
static void test_each_refusal_has_its_code(void)
{
    const dqw_effect_base good = {1e-4f, 100, 15, 100, P_TRUE, false};
    const dqw_effect_config plain[3] = {{.effect = DQW_EFFECT_DEAD_TIME, .shape = {0.3f}},
                                        {.effect = DQW_EFFECT_SKIN_EFFECT},
                                        {.effect = DQW_EFFECT_DEAD_TIME, .shape = {0.3f}}};
    dqw_effect e;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_effect_init(&e, plain, 3, &good));
    TEST_ASSERT_EQUAL_UINT8(3, e.weights);
    TEST_ASSERT_EQUAL_INT(DQW_ERR_NULL, dqw_effect_init(NULL, plain, 2, &good));
    REFUSED(e, DQW_ERR_NULL, dqw_effect_init(&e, plain, 2, NULL));
    REFUSED(e, DQW_ERR_EFFECT_LIST, dqw_effect_init(&e, plain, -1, &good));
    REFUSED(e, DQW_ERR_EFFECT_LIST, dqw_effect_init(&e, NULL, 1, &good));
    const float bad[] = {0.0f, -1.0f, NAN, INFINITY};
    for (int k = 0; k < 4; k++) {
        CASE("%g", (double)bad[k]);
        dqw_effect_base b = good;
        b.dt_s = bad[k];
        REFUSED(e, DQW_ERR_DT, dqw_effect_init(&e, plain, 2, &b));
        b = good;
        b.v_V = bad[k];
        REFUSED(e, DQW_ERR_V_BASE, dqw_effect_init(&e, plain, 2, &b));
        b = good;
        b.i_A = bad[k];
        REFUSED(e, DQW_ERR_I_BASE, dqw_effect_init(&e, plain, 2, &b));
        b = good;
        b.w_m_rad_s = bad[k];
        REFUSED(e, DQW_ERR_W_BASE, dqw_effect_init(&e, plain, 2, &b));
    }
    const float orders[] = {0, -6, 1.5f, DQW_EFFECT_ORDERS + 1, NAN};
    for (int k = 0; k < 5; k++) {
        CASE("order %g", (double)orders[k]);
        const dqw_effect_config harmonics = {.effect = DQW_EFFECT_FLUX_HARMONICS, .shape = {orders[k]}};
        REFUSED(e, DQW_ERR_EFFECT_SHAPE, dqw_effect_init(&e, &harmonics, 1, &good));
    }
    // A width and a time constant have a reciprocal; a heating state may have none of either.
    static const struct {
        enum dqw_effect_name effect;
        float shape[3];
        bool taken;
    } shapes[] = {{DQW_EFFECT_DEAD_TIME, {3.3e-39f}, true},
                  {DQW_EFFECT_DEAD_TIME, {2.7e-39f}, false},
                  {DQW_EFFECT_WINDING_TEMPERATURE, {-40.0f, 0.0f, 0.0f}, true},
                  {DQW_EFFECT_WINDING_TEMPERATURE, {20.0f, 0.0f, 5.0f}, true},
                  {DQW_EFFECT_WINDING_TEMPERATURE, {20.0f, 30.0f, 0.0f}, true},
                  {DQW_EFFECT_WINDING_TEMPERATURE, {20.0f, -30.0f, 5.0f}, false},
                  {DQW_EFFECT_WINDING_TEMPERATURE, {20.0f, 30.0f, -5.0f}, false},
                  {DQW_EFFECT_FLUX_MAP, {0.02f, 1.0f, 2.0f}, true},
                  {DQW_EFFECT_FLUX_MAP, {0.0f, 1.0f, 2.0f}, false},
                  {DQW_EFFECT_FLUX_MAP, {0.02f, 0.0f, 2.0f}, false},
                  {DQW_EFFECT_FLUX_MAP, {0.02f, 1.0f, 0.0f}, false},
                  {DQW_EFFECT_IRON_LOSS, {0.5f, 1e-3f, 1e-3f}, true},
                  {DQW_EFFECT_IRON_LOSS, {-0.5f, 1e-3f, 1e-3f}, false},
                  {DQW_EFFECT_IRON_LOSS, {0.5f, -1e-3f, 1e-3f}, false},
                  {DQW_EFFECT_IRON_LOSS, {0.5f, 1e-3f, -1e-3f}, false},
                  {DQW_EFFECT_WINDING_TEMPERATURE, {20.0f, 3.3e-39f, 5.0f}, true},
                  {DQW_EFFECT_WINDING_TEMPERATURE, {20.0f, 2.7e-39f, 5.0f}, false}};
    for (size_t k = 0; k < sizeof shapes / sizeof shapes[0]; k++) {
        dqw_effect_config c = {.effect = shapes[k].effect, .map = bent_table()};
        for (int i = 0; i < 3; i++) c.shape[i] = shapes[k].shape[i];
        CASE("effect %d, shape %g %g %g", (int)c.effect, (double)c.shape[0], (double)c.shape[1], (double)c.shape[2]);
        if (shapes[k].taken)
            HOLDS(dqw_effect_init(&e, &c, 1, &good) == DQW_OK);
        else
            REFUSED(e, DQW_ERR_EFFECT_SHAPE, dqw_effect_init(&e, &c, 1, &good));
    }
    // Both widths of a friction that falls with the speed.
    for (int k = 0; k < 2; k++) {
        static const float width[] = {1.0f, 3.3e-39f, 2.7e-39f, 0.0f, -1.0f, INFINITY, NAN};
        for (int n = 0; n < 7; n++) {
            CASE("width %d: %g", k, (double)width[n]);
            dqw_effect_config c = {.effect = DQW_EFFECT_STRIBECK_FRICTION, .shape = {2.0f, 2.0f}};
            c.shape[k] = width[n];
            TEST_ASSERT_EQUAL_INT_MESSAGE(n < 2 ? 1 : (int)DQW_ERR_EFFECT_SHAPE, dqw_effect_check(&c, 1, true),
                                          test_case);
        }
    }
    // What an effect knows of the machine: nothing at all is refused, any one number is enough.
    const enum dqw_effect_name of_machine[] = {DQW_EFFECT_IRON_LOSS, DQW_EFFECT_CURRENT_OFFSET,
                                               DQW_EFFECT_CURRENT_GAIN_MISMATCH, DQW_EFFECT_ANGLE_OFFSET};
    for (int k = 0; k < 4; k++) {
        dqw_effect_config c = {.effect = of_machine[k]};
        REFUSED(e, DQW_ERR_EFFECT_SHAPE, dqw_effect_init(&e, &c, 1, &good));
        for (int i = 0; i < 3; i++) {
            CASE("effect %d, shape %d", (int)of_machine[k], i);
            for (int j = 0; j < 3; j++) c.shape[j] = j == i ? 1e-3f : 0.0f;
            HOLDS(dqw_effect_init(&e, &c, 1, &good) == DQW_OK);
            c.shape[i] = -1e-3f;
            REFUSED(e, DQW_ERR_EFFECT_SHAPE, dqw_effect_init(&e, &c, 1, &good));
        }
    }
    // Its room is the others'; it needs no angle here, and there is one of it.
    dqw_effect_base apart = good;
    apart.dead_time_apart = true;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_effect_init(&e, plain, 2, &apart));
    TEST_ASSERT_EQUAL_UINT8(1, e.weights);
    HOLDS(!e.needs_angle);
    REFUSED(e, DQW_ERR_EFFECT_TWICE, dqw_effect_init(&e, plain, 3, &apart));
    static dqw_effect_config full[DQW_EFFECT_WEIGHTS + 2];
    full[0] = plain[0];
    for (int k = 1; k < DQW_EFFECT_WEIGHTS + 2; k++) full[k] = plain[1];
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_effect_init(&e, full, DQW_EFFECT_WEIGHTS + 1, &apart));
    TEST_ASSERT_EQUAL_UINT8(DQW_EFFECT_WEIGHTS, e.weights);
    REFUSED(e, DQW_ERR_EFFECT_ROOM, dqw_effect_init(&e, full, DQW_EFFECT_WEIGHTS + 2, &apart));
    REFUSED(e, DQW_ERR_EFFECT_ROOM, dqw_effect_init(&e, full, DQW_EFFECT_WEIGHTS + 1, &good));
}

// What an effect asks for is asked, whatever stands before or behind it. (E51) to (E55)
static void test_what_a_list_asks_for(void)
{
    const dqw_effect_base base = {1e-4f, 100, 15, 100, P_TRUE, false};
    const dqw_effect_config nothing = {.effect = DQW_EFFECT_SKIN_EFFECT};
    for (int n = 0; n < LAWS; n++)
        for (int at = 0; at < 2; at++) {
            const enum dqw_effect_name name = laws[n].effect;
            CASE("%s, place %d", laws[n].name, at);
            dqw_effect_config two[2] = {nothing, nothing};
            two[at].effect = name;
            two[at].map = bent_table();
            two[at].shape[0] = laws[n].config[0];
            for (int i = 0; i < 3 && name >= DQW_EFFECT_IRON_LOSS; i++) two[at].shape[i] = laws[n].config[i];
            dqw_effect e;
            TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_effect_init(&e, two, 2, &base));
            const bool sensors = name == DQW_EFFECT_FLUX_HARMONICS || name == DQW_EFFECT_CURRENT_OFFSET ||
                                 name == DQW_EFFECT_CURRENT_GAIN_MISMATCH ||
                                 name == DQW_EFFECT_PHASE_RESISTANCE_IMBALANCE;
            HOLDS(e.needs_angle == (sensors || name == DQW_EFFECT_DEAD_TIME));
            HOLDS(e.needs_last == (name == DQW_EFFECT_IRON_LOSS || name == DQW_EFFECT_DELAY));
            HOLDS(e.needs_winding == (name == DQW_EFFECT_WINDING_TEMPERATURE));
            HOLDS(e.needs_magnet == (name == DQW_EFFECT_MAGNET_TEMPERATURE));
            dqw_estimator_config c = config_of(0);
            c.effects = two;
            c.effect_count = 2;
            for (int angle = 0; angle < 2; angle++) {
                dqw_estimator begun;
                c.angle = angle == 1;
                const bool lacks = !c.angle && (sensors || name == DQW_EFFECT_DEAD_TIME);
                HOLDS(dqw_estimator_init(&begun, &c) == (lacks ? DQW_ERR_EFFECT_ANGLE : DQW_OK));
            }
        }
}

// Three units of the bases, dead time a tenth, an effect's ten; an inductance stands in dead time's place while the
// pole pairs are not known. (E92)
static void test_start_deviations(void)
{
    list[0] = (dqw_effect_config){.effect = DQW_EFFECT_VOLTAGE_OFFSET};
    const dqw_estimator_config with = config_of(1);
    dqw_estimator_config seeks = config_of(0);
    seeks.pole_pairs = 0;
    const dqw_estimator e = begin(&with);
    const dqw_estimator s = begin(&seeks);
    for (int i = 0; i < e.inputs; i++) {
        CASE("weight %d", i);
        const bool dead = i == DQW_DEAD_TIME || i == DQW_DEAD_CONSTANT;
        const float sd = dead ? 0.1f : i < DQW_PARAMETERS ? 3.0f : 10.0f;
        HOLDS(dqw_estimator_start_sd_pu(&e, i) == sd);
        BETWEEN(0.99999, e.gain.d[i] / (1e4f * sd * sd), 1.00001);
        if (i < DQW_PARAMETERS) HOLDS(dqw_estimator_start_sd_pu(&s, i) == (i == DQW_DEAD_CONSTANT ? 0.1f : 3.0f));
    }
}

// A deviation is widened by how alike blocks are in what they teach its own weight: dead time goes with R, the flux on
// the other axis and dead time's constant part with the flux, each effect's weight by itself. (E61)
static void test_each_deviation_is_widened_by_its_own_blocks(void)
{
    list[0] = (dqw_effect_config){.effect = DQW_EFFECT_VOLTAGE_OFFSET};
    const dqw_estimator_config c = config_of(1);
    dqw_estimator e = begin(&c);
    e.learned = (1u << e.inputs) - 1u;
    e.blocks = 1000;
    static const int score_of[] = {0, 1, 2, 3, 0, 3, 3, 4, 5};
    TEST_ASSERT_EQUAL_UINT8(9, e.inputs);
    for (int k = 0; k < 6; k++)
        for (int i = 0; i < e.inputs; i++) {
            CASE("score %d, weight %d", k, i);
            for (int n = 0; n < DQW_ESTIMATOR_SCORES; n++) e.score2[n] = 2.0f, e.score_lag[n] = 0.0f;
            const double alone = (double)dqw_estimator_sd(&e, i);
            e.score_lag[k] = 0.5f;
            BETWEEN(0.99999, (double)dqw_estimator_sd(&e, i) / alone / (score_of[i] == k ? sqrt(1.5) : 1.0), 1.00001);
            // No less than a fifth of it, no more than what 0.98 makes.
            e.score_lag[k] = -1.9f;
            BETWEEN(0.99999, (double)dqw_estimator_sd(&e, i) / alone / (score_of[i] == k ? sqrt(0.2) : 1.0), 1.00001);
            e.score_lag[k] = 1.99f;
            BETWEEN(0.99999, (double)dqw_estimator_sd(&e, i) / alone / (score_of[i] == k ? sqrt(2.96) : 1.0), 1.00001);
        }
}

// What a block teaches an effect's weight counts for the score of that weight, and no other: dead time has none of its
// own. (E61)
static void test_each_effect_keeps_its_own_score(void)
{
    plant p = {.effect = DQW_EFFECT_VOLTAGE_OFFSET, .w = {0.5, -0.3}};
    simulate(&p, 100);
    list[0] = (dqw_effect_config){.effect = DQW_EFFECT_VOLTAGE_OFFSET};
    for (int count = 0; count < 2; count++) {
        dqw_estimator_config c = config_of(count);
        c.dead_time_width_A = 0.3f;
        const dqw_estimator e = learned(&c, 0.01, 7);
        for (int k = 0; k < DQW_ESTIMATOR_SCORES; k++) {
            CASE("%d effects, score %d", count, k);
            HOLDS((e.score2[k] > 0.0f && e.score_lag[k] != 0.0f) == (k < 4 + 2 * count));
        }
    }
}

// A weight is known where its deviation is below a quarter of the largest that has both as numbers.
static void test_which_weights_are_known(void)
{
    static const struct {
        float w[2], sd[2];
        uint32_t known;
    } cases[] = {{{1.0f, 0.0f}, {0.24f, 0.24f}, 3},        {{1.0f, 0.0f}, {0.26f, 0.24f}, 2},
                 {{-1.0f, 0.5f}, {0.26f, 0.24f}, 2},       {{INFINITY, 1.0f}, {0.1f, 5.0f}, 0},
                 {{INFINITY, 1.0f}, {0.1f, 0.2f}, 2},      {{NAN, 1.0f}, {0.1f, 0.2f}, 2},
                 {{100.0f, 1.0f}, {DQW_UNKNOWN, 5.0f}, 0}, {{100.0f, 1.0f}, {INFINITY, 5.0f}, 0},
                 {{100.0f, 1.0f}, {NAN, 5.0f}, 0},         {{100.0f, 1.0f}, {NAN, 0.2f}, 2},
                 {{0.0f, 0.0f}, {0.0f, 0.0f}, 0}};
    for (unsigned k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        CASE("case %u", k);
        HOLDS(dqw_effect_known(cases[k].w, cases[k].sd, 2) == cases[k].known);
    }
}

// A table takes the head and two numbers a node.
static void test_bytes_of_a_map(void)
{
    TEST_ASSERT_EQUAL_UINT(2 * (DQW_EFFECT_MAP_HEAD + 2 * BENT_NODES * BENT_NODES), dqw_effect_map_bytes(bent_table()));
    static const int16_t small[] = {3, 0, 2, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};
    TEST_ASSERT_EQUAL_UINT(2 * (DQW_EFFECT_MAP_HEAD + 2 * 3 * 2), dqw_effect_map_bytes(small));
}

// What an input is at the machine's bases: a measured temperature by 50 K, a heating state by 1, whatever T_0 is.
static void test_input_bases(void)
{
    const dqw_effect_base base = {1e-4f, 100, 15, 110, P_TRUE, false};
    const double w_e = P_TRUE * 110;
    const struct {
        dqw_effect_config c;
        double base;
    } cases[] = {{{.effect = DQW_EFFECT_SATURATION, .shape = {10}}, w_e},
                 {{.effect = DQW_EFFECT_CROSS_SATURATION, .shape = {10}}, w_e},
                 {{.effect = DQW_EFFECT_WINDING_TEMPERATURE, .shape = {25, 0}}, 50 * 15},
                 {{.effect = DQW_EFFECT_WINDING_TEMPERATURE, .shape = {0, 0}}, 50 * 15},
                 {{.effect = DQW_EFFECT_WINDING_TEMPERATURE, .shape = {25, 600}}, 15},
                 {{.effect = DQW_EFFECT_WINDING_TEMPERATURE, .shape = {0, 600}}, 15},
                 {{.effect = DQW_EFFECT_MAGNET_TEMPERATURE, .shape = {25, 0}}, 50 * w_e},
                 {{.effect = DQW_EFFECT_MAGNET_TEMPERATURE, .shape = {0, 600}}, w_e},
                 {{.effect = DQW_EFFECT_IRON_LOSS, .shape = {0.9f, 2e-3f, 3e-3f}}, 3e-3 * 100 * w_e},
                 {{.effect = DQW_EFFECT_FLUX_HARMONICS, .shape = {6}}, 6 * w_e},
                 {{.effect = DQW_EFFECT_CURRENT_OFFSET, .shape = {0.9f, 2e-3f, 3e-3f}}, 0.9 + 3e-3 * w_e},
                 {{.effect = DQW_EFFECT_CURRENT_GAIN_MISMATCH, .shape = {0.9f, 4e-3f, 3e-3f}}, (0.9 + 4e-3 * w_e) * 15},
                 {{.effect = DQW_EFFECT_ANGLE_OFFSET, .shape = {4e-3f, 3e-3f, 0.1f}}, (0.1 + 1e-3 * 15) * w_e},
                 {{.effect = DQW_EFFECT_DELAY}, 10},
                 {{.effect = DQW_EFFECT_SKIN_EFFECT}, w_e * w_e * 15},
                 {{.effect = DQW_EFFECT_PHASE_RESISTANCE_IMBALANCE}, 15},
                 {{.effect = DQW_EFFECT_VOLTAGE_OFFSET}, 1},
                 {{.effect = DQW_EFFECT_FLUX_MAP, .shape = {0.02f, 1, 2}, .map = bent_table()}, 0.02 * w_e},
                 {{.effect = DQW_EFFECT_DEAD_TIME, .shape = {0.3f}}, 1}};
    for (unsigned k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        CASE("case %u", k);
        dqw_effect e;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_effect_init(&e, &cases[k].c, 1, &base));
        BETWEEN(cases[k].base * 0.999999, dqw_effect_input_base(&e, 0), cases[k].base * 1.000001);
    }
}

// A list without effects goes along with everything, also after a gap; a list with some does not.
static void test_an_empty_list_after_a_gap(void)
{
    const dqw_effect_base base = {1e-4f, 100, 15, 100, P_TRUE, false};
    const dqw_sample s = dqw_sample_from_dq(1, 2, 3, 4, 50, 1);
    float d[DQW_EFFECT_WEIGHTS];
    float q[DQW_EFFECT_WEIGHTS];
    dqw_window_cell cell[2 * DQW_EFFECT_WEIGHTS] = {{0}};
    list[0] = (dqw_effect_config){.effect = DQW_EFFECT_VOLTAGE_OFFSET};
    for (int count = 0; count <= 1; count++) {
        CASE("%d effects", count);
        dqw_effect e;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_effect_init(&e, count > 0 ? list : NULL, count, &base));
        HOLDS(dqw_effect_pair(&e, &s, &s, d, q) == (count == 0));
        HOLDS(dqw_effect_pair(&e, &s, &s, d, q));
        dqw_effect_gap(&e);
        HOLDS(dqw_effect_pair(&e, &s, &s, d, q) == (count == 0));
        dqw_effect_gap(&e);
        // Without effects it is a pair where there is a last sample.
        HOLDS(!dqw_effect_gather(&e, NULL, &s, cell));
        HOLDS(dqw_effect_gather(&e, &s, &s, cell));
        dqw_effect_gap(&e);
        HOLDS(dqw_effect_gather(&e, &s, &s, cell) == (count == 0));
        HOLDS(dqw_effect_pair(&e, NULL, &s, d, q) == (count == 0));
    }
}

// What stands behind an effect is what it is alone, whichever effect it is.
static void test_every_effect_before_another(void)
{
    const dqw_effect_base base = {(float)DT_S, 100, (float)I_BASE, 140, P_TRUE, false};
    test_random r = {78};
    for (int k = 0; k < LAWS; k++) {
        dqw_effect_config two[] = {{.effect = laws[k].effect, .map = bent_table()}, {.effect = DQW_EFFECT_SKIN_EFFECT}};
        memcpy(two[0].shape, laws[k].config, sizeof laws[k].config);
        dqw_effect both;
        dqw_effect alone;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_effect_init(&both, two, 2, &base));
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_effect_init(&alone, &two[1], 1, &base));
        const int first = laws[k].weights;
        TEST_ASSERT_EQUAL_UINT8(first + 1, both.weights);
        dqw_sample last = {0};
        for (int n = 0; n < 6; n++) {
            CASE("%s, pair %d", laws[k].name, n);
            dqw_sample s = dqw_sample_from_dq((float)random_uniform(&r, -50, 50), (float)random_uniform(&r, -50, 50),
                                              (float)random_uniform(&r, -15, 15), (float)random_uniform(&r, -15, 15),
                                              (float)random_uniform(&r, -140, 140), (float)random_uniform(&r, -PI, PI));
            s.temp_winding_C = s.temp_magnet_C = (float)random_uniform(&r, 20, 120);
            float d[2][DQW_EFFECT_WEIGHTS];
            float q[2][DQW_EFFECT_WEIGHTS];
            const bool there = dqw_effect_pair(&both, n > 0 ? &last : NULL, &s, d[0], q[0]);
            const bool of_it = dqw_effect_pair(&alone, n > 0 ? &last : NULL, &s, d[1], q[1]);
            HOLDS(there == of_it || n < 2);
            if (there) HOLDS(d[0][first] == d[1][0] && q[0][first] == q[1][0]);
            dqw_effect_static(&both, &s, d[0], q[0]);
            dqw_effect_static(&alone, &s, d[1], q[1]);
            HOLDS(d[0][first] == d[1][0] && q[0][first] == q[1][0]);
            // A settled row is no pair's first sample.
            dqw_effect_gap(&both);
            dqw_effect_gap(&alone);
            (void)dqw_effect_pair(&both, &s, &s, d[0], q[0]);
            (void)dqw_effect_pair(&alone, &s, &s, d[1], q[1]);
            last = s;
        }
    }
}

// A block's inputs from what was gathered of it, every effect behind two others, against the weighted mean of its
// pairs' own inputs.
static void test_a_block_is_the_mean_of_its_pairs(void)
{
    enum { HALF = 10, PLAIN = DQW_BLOCK_SIGNALS };
    plant p = {.effect = DQW_EFFECT_VOLTAGE_OFFSET};
    simulate(&p, 77);
    const dqw_effect_base base = {(float)DT_S, 100, (float)I_BASE, 140, P_TRUE, false};
    const dqw_effect_base apart = {(float)DT_S, 100, (float)I_BASE, 140, P_TRUE, true};
    const struct {
        dqw_effect_config c;
        double bound;  // of the largest input
    } cases[] = {{{.effect = DQW_EFFECT_SATURATION, .shape = {15}}, 2e-6},
                 {{.effect = DQW_EFFECT_CROSS_SATURATION, .shape = {15}}, 2e-6},
                 {{.effect = DQW_EFFECT_WINDING_TEMPERATURE, .shape = {25}}, 1.5e-3},
                 {{.effect = DQW_EFFECT_WINDING_TEMPERATURE, .shape = {25, 0.4f}}, 1.5e-2},
                 {{.effect = DQW_EFFECT_MAGNET_TEMPERATURE, .shape = {25}}, 5e-5},
                 {{.effect = DQW_EFFECT_MAGNET_TEMPERATURE, .shape = {25, 0.4f}}, 1.5e-2},
                 {{.effect = DQW_EFFECT_IRON_LOSS, .shape = {0.9f, 2.2e-3f, 2.8e-3f}}, 1.5e-3},
                 {{.effect = DQW_EFFECT_FLUX_HARMONICS, .shape = {6}}, 2e-6},
                 {{.effect = DQW_EFFECT_CURRENT_OFFSET, .shape = {0.9f, 2.2e-3f, 2.8e-3f}}, 2e-6},
                 {{.effect = DQW_EFFECT_CURRENT_GAIN_MISMATCH, .shape = {0.9f, 2.2e-3f, 2.8e-3f}}, 2e-6},
                 {{.effect = DQW_EFFECT_ANGLE_OFFSET, .shape = {2.2e-3f, 2.8e-3f, 0.12f}}, 1e-5},
                 {{.effect = DQW_EFFECT_DELAY}, 1.5e-3},
                 {{.effect = DQW_EFFECT_SKIN_EFFECT}, 2e-6},
                 {{.effect = DQW_EFFECT_PHASE_RESISTANCE_IMBALANCE}, 2e-6},
                 {{.effect = DQW_EFFECT_VOLTAGE_OFFSET}, 2e-6},
                 {{.effect = DQW_EFFECT_FLUX_MAP,
                   .shape = {(float)BENT_FULL_WB, (float)BENT_CELL_D_A, (float)BENT_CELL_Q_A},
                   .map = bent_table()},
                  2e-6}};
    for (unsigned n = 0; n < sizeof cases / sizeof cases[0]; n++) {
        CASE("effect %d", (int)cases[n].c.effect);
        const dqw_effect_config both[] = {
            {.effect = DQW_EFFECT_VOLTAGE_OFFSET}, {.effect = DQW_EFFECT_DEAD_TIME, .shape = {0.3f}}, cases[n].c};
        const int weights = dqw_effect_weights(cases[n].c.effect);
        dqw_effect e, alone;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_effect_init(&e, both, 3, n % 2 ? &apart : &base));
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_effect_init(&alone, &both[2], 1, &base));
        const int first = n % 2 ? 2 : 3;
        TEST_ASSERT_EQUAL_UINT8(first + weights, e.weights);
        dqw_window w;
        dqw_window_rise rise = {.has = false};
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_window_init(&w, HALF, PLAIN + 2 * e.weights));
        static double pairs[ROWS][2][WEIGHTS];
        static bool good[ROWS];
        double worst = 0.0;
        double largest = 0.0;
        dqw_sample last = {0};
        int blocks = 0;
        for (int k = 0; k < 4000; k++) {
            const row *r = &rows[k];
            dqw_sample s = dqw_sample_from_dq((float)r->v_d, (float)r->v_q, (float)r->i_d, (float)r->i_q, (float)r->w_m,
                                              (float)remainder(r->theta, 2 * PI));
            s.temp_winding_C = s.temp_magnet_C = (float)r->temp;
            const dqw_sample *before = k > 0 && k % 211 != 100 ? &last : NULL;
            dqw_effect_heat(&e, s.i_d_A, s.i_q_A);
            dqw_effect_heat(&alone, s.i_d_A, s.i_q_A);
            float d[DQW_EFFECT_WEIGHTS];
            float q[DQW_EFFECT_WEIGHTS];
            good[k] = dqw_effect_pair(&alone, before, &s, d, q);
            dqw_effect_warm(&alone, 1);
            for (int i = 0; i < weights; i++) {
                pairs[k][0][i] = d[i];
                pairs[k][1][i] = q[i];
            }
            HOLDS(dqw_effect_gather(&e, before, &s, dqw_window_cells(&w) + PLAIN) == good[k]);
            if (good[k]) {
                const dqw_block b = dqw_model_pair(&last, &s, (float)DT_S);
                float plain[PLAIN];
                memcpy(plain, &b, sizeof plain);
                for (int i = 0; i < PLAIN; i++) dqw_window_gather(&dqw_window_cells(&w)[i], plain[i]);
                dqw_window_count(&w);
            } else {
                dqw_window_refuse(&w);
            }
            last = s;
            if (!dqw_window_full(&w)) continue;
            dqw_effect_warm(&e, HALF);
            float block[DQW_WINDOW_SIGNALS];
            float sums[2];
            HOLDS(dqw_window_turn(&w));
            const uint32_t event = dqw_window_join(&w, &rise, block, sums);
            dqw_handover_release(&w.over);
            if (event != DQW_EVENT_BLOCK) continue;
            blocks++;
            for (int i = 0; i < e.weights; i++) {
                d[i] = block[PLAIN + 2 * i];
                q[i] = block[PLAIN + 2 * i + 1];
            }
            dqw_block b;
            memcpy(&b, block, sizeof b);
            dqw_effect_inputs(&e, &b, d, q);
            HOLDS(d[0] == 1.0f && q[0] == 0.0f && d[1] == 0.0f && q[1] == 1.0f);
            for (int i = 0; i < weights; i++) {
                double mean[2] = {0, 0};
                double sum = 0.0;
                for (int j = 1; j <= 2 * HALF; j++) {
                    const int at = k - 2 * HALF + j;
                    const double weight = !good[at] ? 0 : j <= HALF ? j : 2 * HALF + 1 - j;
                    sum += weight;
                    for (int axis = 0; axis < 2; axis++) mean[axis] += weight * pairs[at][axis][i];
                }
                worst = fmax(worst, fmax(fabs((double)d[first + i] - mean[0] / sum),
                                         fabs((double)q[first + i] - mean[1] / sum)));
                largest = fmax(largest, fmax(fabs(mean[0] / sum), fabs(mean[1] / sum)));
            }
        }
        HOLDS(blocks > 380 && largest > 0.0);
        if (getenv("DQW_TEST_VALUES") != NULL) printf("effect %d: %.2g\n", (int)cases[n].c.effect, worst / largest);
        BETWEEN(0.0, worst / largest, cases[n].bound);
    }
}

static void test_what_an_effect_needs_must_be_a_number(void)
{
    list[0] = (dqw_effect_config){.effect = DQW_EFFECT_DEAD_TIME, .shape = {0.3f}};
    list[1] = (dqw_effect_config){.effect = DQW_EFFECT_WINDING_TEMPERATURE, .shape = {25, 0}};
    for (int effects = 0; effects <= 2; effects++)
        for (int field = 0; field < 3; field++) {
            CASE("%d effects, field %d", effects, field);
            dqw_estimator_config c = config_of(effects);
            c.angle = effects > 0;
            dqw_estimator e = begin(&c);
            dqw_sample s = dqw_sample_from_dq(1, 2, 3, 4, 50, field == 0 ? NAN : 1.0f);
            s.temp_winding_C = field == 1 ? NAN : 40.0f;
            s.temp_magnet_C = field == 2 ? NAN : 40.0f;
            const bool needed = (field == 0 && effects > 0) || (field == 1 && effects > 1);
            HOLDS(((dqw_estimator_sample(&e, &s, false) & DQW_EVENT_NONFINITE) != 0) == needed);
        }
}

// Skipped samples and gaps cost rows, not accuracy: `delay` and `iron_loss` need two rows before them.
static void test_no_pair_uses_a_refused_sample(void)
{
    const int which[] = {0, 7, 12};
    for (int n = 0; n < 3; n++) {
        const law *l = &laws[which[n]];
        CASE("%s", l->name);
        plant p = {.effect = l->effect, .shape = l->shape};
        memcpy(p.w, l->w, sizeof p.w);
        simulate(&p, (uint64_t)(100 + which[n]));
        list[0] = (dqw_effect_config){.effect = l->effect, .map = bent_table()};
        memcpy(list[0].shape, l->config, sizeof l->config);
        const dqw_estimator_config c = config_of(1);
        dqw_estimator e;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&e, &c));
        for (int k = 0; k < ROWS; k++) {
            dqw_sample s = sample_of(k);
            const bool bad = k % 37 == 5;
            if (bad) s.v_d_V = s.i_q_A = 80.0f;
            if (k % 1000 == 999) {
                dqw_estimator_missing(&e, 0);
                s.v_d_V = 70.0f;
                (void)show(&e, &s, true);
                continue;
            }
            (void)show(&e, &s, bad);
        }
        float weight, sd;
        (void)dqw_estimator_read_effect(&e, 0, &weight, &sd);
        BETWEEN(l->weight[0] / 3 - 0.03, 100 * fabs(weight / l->w[0] - 1), 1.5 * l->weight[0] + 0.03);
        BETWEEN(0.0, plain_error(&e), 1.5 * l->plain[0] + 0.01);
    }
}

static void test_slow_heat_is_not_lost_to_rounding(void)
{
    list[0] = (dqw_effect_config){.effect = DQW_EFFECT_WINDING_TEMPERATURE, .shape = {25, 600, 10}};
    const dqw_effect_base base = {1e-4f, 100, 15, 100, P_TRUE, false};
    dqw_effect e;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_effect_init(&e, list, 1, &base));
    const dqw_effect cold = e;
    for (int half = 1; half <= 20; half += 19) {
        CASE("half %d", half);
        e = cold;
        for (int k = 1; k <= 3000000; k++) {
            dqw_effect_heat(&e, 6.0f, -4.0f);
            if (k % half == 0) dqw_effect_warm(&e, (uint32_t)half);
        }
        BETWEEN(0.52 * (1 - exp(-0.5)) * 0.99999, e.heat[0], 0.52 * (1 - exp(-0.5)) * 1.00001);
        // What is no number heats nothing; what is wild heats as ten bases do.
        const float before = e.heat[0];
        dqw_effect_heat(&e, NAN, 1.0f);
        dqw_effect_warm(&e, (uint32_t)half);
        HOLDS(e.heat[0] == before);
        dqw_effect_heat(&e, 1e30f, INFINITY);
        dqw_effect_warm(&e, (uint32_t)half);
        HOLDS(e.heat[0] == before);
        dqw_effect_heat(&e, 1e10f, 3.0f);
        dqw_effect_warm(&e, (uint32_t)half);
        BETWEEN(half * 1e-4 / 600 * 100 * 0.9, e.heat[0] - before, half * 1e-4 / 600 * 100 * 1.1);
    }
}

// Frictions by their closed forms, each with its own width.
static void test_laws_of_friction(void)
{
    static const float widths[] = {0.25f, 1.0f, 4.0f};
    for (int n = 0; n < 3; n++)
        for (int k = -12; k <= 12; k++) {
            const float w = 0.5f * (float)k;
            const double way = tanh((double)w / (double)widths[n]);
            const double falls = exp(-pow((double)w / 3, 2));
            const struct {
                enum dqw_effect_name effect;
                double x;
            } laws_of[] = {{DQW_EFFECT_COULOMB_FRICTION, way},
                           {DQW_EFFECT_DIRECTION_ASYMMETRY, fabs(way)},
                           {DQW_EFFECT_STRIBECK_FRICTION, way * falls},
                           {DQW_EFFECT_LOAD_TORQUE, 1}};
            for (int i = 0; i < 4; i++) {
                const dqw_effect_config c = {.effect = laws_of[i].effect, .shape = {widths[n], 3.0f}};
                float x[DQW_EFFECT_STARTS] = {NAN};
                dqw_effect_torque(&c, w, 0.0f, x);
                CASE("effect %d of width %g at %g rad/s", (int)laws_of[i].effect, (double)widths[n], (double)w);
                BETWEEN(-1e-6, (double)x[0] - laws_of[i].x, 1e-6);
            }
        }
}

// After a time constant or ten at once it is as warm as the current makes it.
static void test_heat_does_not_overshoot(void)
{
    list[0] = (dqw_effect_config){.effect = DQW_EFFECT_WINDING_TEMPERATURE, .shape = {25, 600, 10}};
    const dqw_effect_base base = {1e-4f, 100, 15, 100, P_TRUE, false};
    static const uint32_t periods[] = {3000000, 5900000, 6100000, 60000000};
    for (int k = 0; k < 4; k++) {
        dqw_effect e;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_effect_init(&e, list, 1, &base));
        e.square_A2 = 52.0f * (float)periods[k];
        dqw_effect_warm(&e, periods[k]);
        CASE("%u periods", (unsigned)periods[k]);
        BETWEEN(-1e-5, (double)e.heat[0] - 0.52 * fmin(1, periods[k] / 6e6), 1e-5);
    }
}

static void test_defined_anew_it_forgets_all_but_the_counts(void)
{
    plant p = {.effect = DQW_EFFECT_DEAD_TIME, .w = {4}, .shape = 0.3};
    simulate(&p, 100);
    dqw_estimator_config c = config_of(0);
    c.threshold_ppm = 15000;
    dqw_estimator e;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&e, &c));
    list[0] = (dqw_effect_config){.effect = DQW_EFFECT_DEAD_TIME, .shape = {0.3f}};
    uint32_t counted = 0;
    for (int k = 0; k < ROWS; k++) {
        const dqw_sample s = sample_of(k);
        (void)show(&e, &s, false);
        if (e.stage.name == DQW_STAGE_DOMAIN) {
            TEST_ASSERT_EQUAL_INT(DQW_BACK_THRESHOLD, e.stage.back);
            TEST_ASSERT_EQUAL_UINT32(0, counted);
            counted = e.gate.accepted;
            c.effects = NULL;
            c.effect_count = 1;
            const dqw_estimator old = e;
            TEST_ASSERT_EQUAL_INT(DQW_ERR_EFFECT_LIST, dqw_estimator_define(&e, &c));
            TEST_ASSERT_EQUAL_MEMORY(&old, &e, sizeof e);
            c = config_of(1);
            c.threshold_ppm = 15000;
            TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_define(&e, &c));
            TEST_ASSERT_EQUAL_INT(DQW_STAGE_RANDOM, e.stage.name);
            TEST_ASSERT_EQUAL_UINT32(0, e.blocks);
        }
    }
    TEST_ASSERT_TRUE(counted > 0);
    TEST_ASSERT_EQUAL_INT(DQW_STAGE_IN_SERVICE, e.stage.name);
    TEST_ASSERT_EQUAL_UINT32(1, e.stage.times_back);
    TEST_ASSERT_EQUAL_UINT32(ROWS, e.gate.accepted);
}

// Each has weights, the last five are of the shaft, and beyond the list there is nothing.
static void test_every_effect_has_its_row(void)
{
    for (int name = 1; name < DQW_EFFECT_NAMES; name++) {
        CASE("effect %d", name);
        HOLDS(dqw_effect_weights((enum dqw_effect_name)name) >= 1);
        const bool shaft = name >= DQW_EFFECT_COULOMB_FRICTION;
        HOLDS(dqw_effect_is_mechanical((enum dqw_effect_name)name) == shaft);
        HOLDS(!shaft || dqw_effect_needs((enum dqw_effect_name)name) == DQW_NEEDS_SHAFT);
    }
    static const int none[] = {DQW_EFFECT_NONE, DQW_EFFECT_NAMES, 1000, -1};
    for (int k = 0; k < 4; k++) {
        CASE("no effect %d", none[k]);
        HOLDS(dqw_effect_weights((enum dqw_effect_name)none[k]) == 0 &&
              dqw_effect_needs((enum dqw_effect_name)none[k]) == 0 &&
              dqw_effect_shape_of((enum dqw_effect_name)none[k]) == DQW_SHAPE_FREE);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_effect_has_its_row);
    RUN_TEST(test_every_effect_gives_back_its_weight);
    RUN_TEST(test_settled_rows_give_back_what_has_no_slope);
    RUN_TEST(test_dead_time_in_the_list_is_the_weight_that_every_estimator_has);
    RUN_TEST(test_read_before_anything_was_learned);
    RUN_TEST(test_an_effect_that_the_rows_do_not_show_is_not_known);
    RUN_TEST(test_init_refuses_and_leaves_the_object_alone);
    RUN_TEST(test_each_refusal_has_its_code);
    RUN_TEST(test_what_a_list_asks_for);
    RUN_TEST(test_start_deviations);
    RUN_TEST(test_each_deviation_is_widened_by_its_own_blocks);
    RUN_TEST(test_each_effect_keeps_its_own_score);
    RUN_TEST(test_which_weights_are_known);
    RUN_TEST(test_bytes_of_a_map);
    RUN_TEST(test_input_bases);
    RUN_TEST(test_an_empty_list_after_a_gap);
    RUN_TEST(test_every_effect_before_another);
    RUN_TEST(test_a_block_is_the_mean_of_its_pairs);
    RUN_TEST(test_what_an_effect_needs_must_be_a_number);
    RUN_TEST(test_no_pair_uses_a_refused_sample);
    RUN_TEST(test_slow_heat_is_not_lost_to_rounding);
    RUN_TEST(test_laws_of_friction);
    RUN_TEST(test_heat_does_not_overshoot);
    RUN_TEST(test_defined_anew_it_forgets_all_but_the_counts);
    return UNITY_END();
}
