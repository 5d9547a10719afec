// The mechanical axis against the exact solution of J dw/dt + B w + T_c sign(w) = T and against least squares in double.
#include "dqw_mechanical.h"
#include "dqw_test.h"

#define J_TRUE 2e-3
#define B_TRUE 4e-3
#define COULOMB_TRUE 0.1
#define DT_S 1e-3
enum { ROWS = 10000, HALF = 25 };

static double torque[ROWS], speed[ROWS];
static double standstill;  ///< of the configuration and of the batch

void setUp(void)
{
    test_case[0] = 0;
    standstill = 0.0;
}
void tearDown(void) {}

// Torque held from row to row, redrawn every 40, of at least `least`; in fine steps, each of them exact.
static void make_log_above(double least, double coulomb, double noise, uint64_t seed)
{
    test_random r = {seed};
    double w = 50.0;
    double t = 0.0;
    for (int k = 0; k < ROWS; k++) {
        if (k % 40 == 0) do
                t = random_uniform(&r, -1, 1);
            while (fabs(t) < least);
        torque[k] = t;
        speed[k] = w;
        for (int n = 0; n < 200; n++) {
            const double friction = w > 0 ? coulomb : w < 0 ? -coulomb : 0.0;
            const double end = (t - friction) / B_TRUE;
            w = end + (w - end) * exp(-B_TRUE / J_TRUE * DT_S / 200);
        }
    }
    double sums[4] = {0};
    for (int k = 0; k < ROWS; k++) {
        sums[0] += torque[k] / ROWS;
        sums[1] += torque[k] * torque[k] / ROWS;
        sums[2] += speed[k] / ROWS;
        sums[3] += speed[k] * speed[k] / ROWS;
    }
    const double sd_t = noise * sqrt(sums[1] - sums[0] * sums[0]);
    const double sd_w = noise * sqrt(sums[3] - sums[2] * sums[2]);
    for (int k = 0; k < ROWS; k++) {
        torque[k] += sd_t * random_normal(&r);
        speed[k] += sd_w * random_normal(&r);
    }
}

static void make_log(double coulomb, double noise, uint64_t seed) { make_log_above(2 * coulomb, coulomb, noise, seed); }

static dqw_mechanical_config config_of(bool coulomb)
{
    const dqw_mechanical_config c = {
        .dt_s = (float)DT_S, .torque_base_Nm = 1.0f, .w_base_rad_s = 150.0f, .coulomb = coulomb, .standstill_rad_s = coulomb ? (float)standstill : 0.0f};
    return c;
}

static dqw_mechanical learn(const dqw_mechanical_config *c)
{
    dqw_mechanical m;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_mechanical_init(&m, c));
    for (int k = 0; k < ROWS; k++) (void)dqw_mechanical_step(&m, (float)torque[k], (float)speed[k]);
    return m;
}

static double sign_of(double w) { return w > standstill ? 1.0 : w < -standstill ? -1.0 : 0.0; }

static void batch(bool coulomb, double w[LS_MAX])
{
    test_ls s;
    ls_begin(&s, coulomb ? 3 : 2, 0.0);
    for (int first = 0; first + 2 * HALF < ROWS; first += HALF) {
        double y = 0.0;
        double x[3] = {0};
        for (int n = 0; n < 2 * HALF; n++) {
            const double weight = n < HALF ? n + 1 : 2 * HALF - n;
            // The first pair is row 0 to row 1, and the step before it was none.
            const int k = first + n - 1;
            if (k < 0) continue;
            y += weight * torque[k];
            x[0] += weight * (speed[k + 1] - speed[k]) / DT_S;
            x[1] += weight * 0.5 * (speed[k + 1] + speed[k]);
            x[2] += weight * 0.5 * (sign_of(speed[k + 1]) + sign_of(speed[k]));
        }
        const double total = first == 0 ? HALF * (HALF + 1.0) - 1 : HALF * (HALF + 1.0);
        y /= total;
        for (int i = 0; i < 3; i++) x[i] /= total;
        ls_add(&s, x, y);
    }
    double inverse[LS_MAX][LS_MAX];
    (void)ls_solve(&s, w, inverse);
}

static void test_init_refuses_and_leaves_the_object_alone(void)
{
    dqw_mechanical m;
    const dqw_mechanical_config good = config_of(true);
    TEST_ASSERT_EQUAL_INT(DQW_ERR_NULL, dqw_mechanical_init(NULL, &good));
    REFUSED(m, DQW_ERR_NULL, dqw_mechanical_init(&m, NULL));
    const float bad[] = {-1.0f, NAN, INFINITY, -INFINITY, 0.0f};
    for (int k = 0; k < 5; k++)
        for (int field = 0; field < 8; field++) {
            if (k == 4 && field >= 3) continue;  // there 0 has a meaning
            dqw_mechanical_config c = good;
            float *const fields[] = {&c.dt_s,      &c.torque_base_Nm, &c.w_base_rad_s,     &c.J_kgm2,
                                     &c.B_Nms_rad, &c.excitation_pu,  &c.standstill_rad_s, &c.coulomb_width_rad_s};
            *fields[field] = bad[k];
            REFUSED(m, DQW_ERR_RANGE, dqw_mechanical_init(&m, &c));
        }
    dqw_mechanical_config c = good;
    c.half_window = 10001;
    REFUSED(m, DQW_ERR_SIZE, dqw_mechanical_init(&m, &c));
    const dqw_mechanical_config zero = {0};
    REFUSED(m, DQW_ERR_RANGE, dqw_mechanical_init(&m, &zero));
}

static void test_noise_free_inertia_and_friction(void)
{
    make_log(0.0, 0.0, 1);
    const dqw_mechanical_config c = config_of(false);
    const dqw_mechanical m = learn(&c);
    const dqw_friction f = dqw_mechanical_read(&m);
    double w[LS_MAX];
    batch(false, w);
    BETWEEN(-1e-4, f.J_kgm2 / w[0] - 1, 1e-4);
    BETWEEN(-1e-4, f.B_Nms_rad / w[1] - 1, 1e-4);
    BETWEEN(-1e-3, f.J_kgm2 / J_TRUE - 1, 1e-3);
    BETWEEN(-1e-3, f.B_Nms_rad / B_TRUE - 1, 1e-3);
    TEST_ASSERT_TRUE(f.J_known && f.B_known && !f.coulomb_known);
}

static void test_noise_free_with_coulomb_friction(void)
{
    make_log(COULOMB_TRUE, 0.0, 2);
    const dqw_mechanical_config c = config_of(true);
    const dqw_mechanical m = learn(&c);
    const dqw_friction f = dqw_mechanical_read(&m);
    double w[LS_MAX];
    batch(true, w);
    BETWEEN(-1e-3, f.J_kgm2 / w[0] - 1, 1e-3);
    BETWEEN(-1e-3, f.B_Nms_rad / w[1] - 1, 1e-3);
    BETWEEN(-1e-3, f.coulomb_Nm / w[2] - 1, 1e-3);
    BETWEEN(-0.001, f.J_kgm2 / J_TRUE - 1, 0.001);
    BETWEEN(-0.002, f.B_Nms_rad / B_TRUE - 1, 0.002);
    BETWEEN(-0.002, f.coulomb_Nm / COULOMB_TRUE - 1, 0.002);
    // Within the standstill band friction counts as none, which it is not.
    standstill = 1.0;
    const dqw_mechanical_config band = config_of(true);
    const dqw_mechanical o = learn(&band);
    BETWEEN(-0.04, dqw_mechanical_read(&o).B_Nms_rad / B_TRUE - 1, 0.0);  // -0.020
    standstill = 0.0;
    TEST_ASSERT_TRUE(f.J_known && f.B_known && f.coulomb_known);
    // Where the torque is too small to move the rotor, friction is less than T_c, which the model does not know.
    make_log_above(0.0, COULOMB_TRUE, 0.0, 2);
    const dqw_mechanical stuck = learn(&c);
    const dqw_friction g = dqw_mechanical_read(&stuck);
    BETWEEN(-0.01, g.J_kgm2 / J_TRUE - 1, 0.01);     // 0.002
    BETWEEN(-0.05, g.B_Nms_rad / B_TRUE - 1, 0.01);  // -0.023
    BETWEEN(-0.05, g.coulomb_Nm / COULOMB_TRUE - 1, 0.05);
    make_log(COULOMB_TRUE, 0.0, 2);
    // Friction that is not modelled goes into the viscous term, and the residual tells.
    const dqw_mechanical_config less = config_of(false);
    const dqw_mechanical n = learn(&less);
    BETWEEN(1.3, dqw_mechanical_read(&n).B_Nms_rad / B_TRUE, 3.0);  // 2.08
    BETWEEN(5, dqw_axis_relative_residual(&n.axis) / dqw_axis_relative_residual(&m.axis), 1e4);
}

static void test_one_percent_noise(void)
{
    standstill = 1.0;
    int inside[3] = {0};
    double worst[3] = {0};
    for (int seed = 0; seed < 40; seed++) {
        make_log(COULOMB_TRUE, 0.01, (uint64_t)(10 + seed));
        const dqw_mechanical_config c = config_of(true);
        const dqw_mechanical m = learn(&c);
        const dqw_friction f = dqw_mechanical_read(&m);
        const double off[] = {f.J_kgm2 - J_TRUE, f.B_Nms_rad - B_TRUE, f.coulomb_Nm - COULOMB_TRUE};
        const double sd[] = {f.J_sd_kgm2, f.B_sd_Nms_rad, f.coulomb_sd_Nm};
        const double truth[] = {J_TRUE, B_TRUE, COULOMB_TRUE};
        for (int i = 0; i < 3; i++) {
            worst[i] = fmax(worst[i], 100 * fabs(off[i]) / truth[i]);
            if (fabs(off[i]) < 3 * sd[i]) inside[i]++;
        }
        TEST_ASSERT_TRUE(f.J_known && f.B_known && f.coulomb_known);
    }
    BETWEEN(0.05, worst[0], 0.7);  // 0.2 %
    BETWEEN(1.0, worst[1], 6.0);   // 3.8 %: the standstill band, see above
    BETWEEN(1.0, worst[2], 6.0);
    BETWEEN(30, inside[0], 40);
}

static void test_nominal_values_are_no_prior(void)
{
    make_log(0.0, 0.01, 3);
    dqw_mechanical_config c = config_of(false);
    const dqw_mechanical m = learn(&c);
    c.J_kgm2 = (float)(1.3 * J_TRUE);
    c.B_Nms_rad = (float)(0.7 * B_TRUE);
    const dqw_mechanical n = learn(&c);
    const dqw_friction a = dqw_mechanical_read(&m);
    const dqw_friction b = dqw_mechanical_read(&n);
    BETWEEN(-0.05, (a.J_kgm2 - b.J_kgm2) / a.J_sd_kgm2, 0.05);
    // 0.21: while J is unknown, a slope below the excitation threshold predicts with the nominal J.
    BETWEEN(-0.4, (a.B_Nms_rad - b.B_Nms_rad) / a.B_sd_Nms_rad, 0.4);
}

static void test_missing_samples_and_gaps_do_not_bias(void)
{
    make_log(0.0, 0.0, 4);
    const dqw_mechanical_config c = config_of(false);
    dqw_mechanical m;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_mechanical_init(&m, &c));
    test_random r = {5};
    uint32_t bad = 0;
    uint32_t offered = 0;
    for (int k = 0; k < ROWS; k++) {
        if (k % 1234 == 1233) {
            k += 300;
            dqw_mechanical_gap(&m);
            if (k >= ROWS) break;
        }
        const uint64_t kind = random_bits(&r) % 40;
        offered++;
        if (kind < 2) bad++;
        const uint32_t event = dqw_mechanical_step(&m, kind == 0 ? NAN : (float)torque[k], kind == 1 ? INFINITY : (float)speed[k]);
        TEST_ASSERT_EQUAL(kind < 2, (event & DQW_EVENT_NONFINITE) != 0);
    }
    const dqw_friction f = dqw_mechanical_read(&m);
    BETWEEN(-1e-3, f.J_kgm2 / J_TRUE - 1, 1e-3);
    BETWEEN(-1e-3, f.B_Nms_rad / B_TRUE - 1, 1e-3);
    TEST_ASSERT_EQUAL_UINT32(bad, m.gate.nonfinite);
    TEST_ASSERT_EQUAL_UINT32(0, m.axis.neuron.skipped);  // no pair was made of a bad sample
    TEST_ASSERT_EQUAL_UINT32(offered, m.gate.accepted + m.gate.nonfinite + m.gate.saturated);
}

static void test_what_the_signals_cannot_teach_is_not_known(void)
{
    for (int kind = 0; kind < 3; kind++) {
        CASE("kind %d", kind);
        const dqw_mechanical_config c = config_of(true);
        dqw_mechanical m;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_mechanical_init(&m, &c));
        for (int k = 0; k < 20000; k++) {
            const double w = kind == 0 ? 0.0 : kind == 1 ? 100.0 : 50 + 49 * sin(0.01 * k);
            const double slope = kind == 2 ? 49 * 0.01 / DT_S * cos(0.01 * (k + 0.5)) : 0.0;
            const double t = kind == 0 ? 0.0 : J_TRUE * slope + B_TRUE * w + COULOMB_TRUE;
            (void)dqw_mechanical_step(&m, (float)t, (float)w);
        }
        const dqw_friction f = dqw_mechanical_read(&m);
        // At rest nothing; at one speed viscous and Coulomb friction are one; in one direction at many speeds all of it.
        HOLDS(f.J_known == (kind == 2) && f.B_known == (kind == 2) && f.coulomb_known == (kind == 2));
        if (kind == 2) {
            BETWEEN(-0.01, f.J_kgm2 / J_TRUE - 1, 0.01);
            BETWEEN(-0.01, f.B_Nms_rad / B_TRUE - 1, 0.01);
            BETWEEN(-0.01, f.coulomb_Nm / COULOMB_TRUE - 1, 0.01);
        }
    }
}

static void test_counters_stop_at_their_maximum(void)
{
    make_log(0.0, 0.0, 6);
    const dqw_mechanical_config c = config_of(false);
    dqw_mechanical m;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_mechanical_init(&m, &c));
    m.gate.blocks = m.gate.incomplete = UINT32_MAX;
    for (int k = 0; k < 200; k++) (void)dqw_mechanical_step(&m, (float)torque[k], k < 100 ? (float)speed[k] : NAN);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, m.gate.blocks);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, m.gate.incomplete);
}

static double shaft_angle[ROWS];

// Friction and load of the shaft, by what each of them is.
static double braking(enum dqw_effect_name effect, const double a[2], double w, double theta)
{
    const double soft = (exp(w) - exp(-w)) / (exp(w) + exp(-w));  // over 1 rad/s
    const double way = fabs(w) > 15 ? (w > 0 ? 1.0 : -1.0) : soft;
    switch (effect) {
    case DQW_EFFECT_COULOMB_FRICTION: return a[0] * way;
    case DQW_EFFECT_DIRECTION_ASYMMETRY: return w > 0 ? a[0] * way : -a[0] * way;
    case DQW_EFFECT_STRIBECK_FRICTION: return a[0] * way * exp(-w * w / (20.0 * 20.0));
    case DQW_EFFECT_COGGING_TORQUE: return hypot(a[0], a[1]) * cos(6 * theta - atan2(a[1], a[0]));
    default: return a[0];
    }
}

static void make_log_with(enum dqw_effect_name effect, const double a[2], double noise, uint64_t seed)
{
    test_random r = {seed};
    double w = 20.0;
    double theta = 0.0;
    double t = 0.0;
    const double h = DT_S / 50;
    double sums[2] = {0};
    for (int k = 0; k < ROWS; k++) {
        if (k % 40 == 0) t = random_uniform(&r, -1, 1) - 0.01 * w;
        torque[k] = t;
        speed[k] = w;
        shaft_angle[k] = theta;
        for (int n = 0; n < 50; n++) {
            // Heun's rule with steps of 20 microseconds.
            const double s0 = (t - B_TRUE * w - braking(effect, a, w, theta)) / J_TRUE;
            const double w1 = w + h * s0;
            const double s1 = (t - B_TRUE * w1 - braking(effect, a, w1, theta + h * w)) / J_TRUE;
            theta += 0.5 * h * (w + w1);
            w += 0.5 * h * (s0 + s1);
        }
        sums[0] += torque[k] * torque[k] / ROWS;
        sums[1] += speed[k] * speed[k] / ROWS;
    }
    for (int k = 0; k < ROWS; k++) {
        torque[k] += noise * sqrt(sums[0]) * random_normal(&r);
        speed[k] += noise * sqrt(sums[1]) * random_normal(&r);
    }
}

static void test_every_effect_of_the_shaft_gives_back_its_weight(void)
{
    static const struct {
        enum dqw_effect_name effect;
        int weights;
        double a[2];
        float shape[2];
        double measured[2], alone;  ///< largest error in %: without noise, with 1 %; of J and B where it is not configured
    } laws[] = {
        {DQW_EFFECT_COULOMB_FRICTION, 1, {0.15}, {1}, {0.046, 0.24}, 232},     {DQW_EFFECT_DIRECTION_ASYMMETRY, 1, {0.08}, {1}, {0.0003, 0.039}, 57},
        {DQW_EFFECT_STRIBECK_FRICTION, 1, {0.2}, {1, 20}, {0.029, 0.27}, 177}, {DQW_EFFECT_COGGING_TORQUE, 2, {0.2, -0.1}, {6}, {0.10, 0.58}, 7.5},
        {DQW_EFFECT_LOAD_TORQUE, 1, {0.25}, {0}, {0.0003, 0.067}, 203},
    };
    for (int k = 0; k < 5; k++)
        for (int kind = 0; kind < 3; kind++) {
            CASE("effect %d, %s", (int)laws[k].effect, kind == 0 ? "no noise" : kind == 1 ? "noise 1 %" : "not configured");
            make_log_with(laws[k].effect, laws[k].a, kind == 1 ? 0.01 : 0.0, (uint64_t)(70 + k));
            const dqw_effect_config list = {.effect = laws[k].effect, .shape = {laws[k].shape[0], laws[k].shape[1]}};
            dqw_mechanical_config c = config_of(false);
            c.effects = &list;
            c.effect_count = kind < 2;
            // Cogging is soon averaged away.
            if (laws[k].effect == DQW_EFFECT_COGGING_TORQUE) c.half_window = 5;
            dqw_mechanical m;
            TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_mechanical_init(&m, &c));
            for (int n = 0; n < ROWS; n++) (void)dqw_mechanical_step_at(&m, (float)torque[n], (float)speed[n], (float)remainder(shaft_angle[n], 2 * PI));
            const dqw_friction f = dqw_mechanical_read(&m);
            double worst = fmax(100 * fabs(f.J_kgm2 / J_TRUE - 1), 100 * fabs(f.B_Nms_rad / B_TRUE - 1));
            if (kind == 2) {
                BETWEEN(0.9 * laws[k].alone, worst, 1.1 * laws[k].alone);
                continue;
            }
            float w[2], sd[2];
            HOLDS(dqw_mechanical_effect(&m, 0, w, sd) == (1 << laws[k].weights) - 1);
            HOLDS(f.J_known && f.B_known);
            for (int i = 0; i < laws[k].weights; i++) worst = fmax(worst, 100 * fabs(w[i] - laws[k].a[i]) / fabs(laws[k].a[0]));
            BETWEEN(laws[k].measured[kind] / 3 - 0.02, worst, 1.5 * laws[k].measured[kind] + 0.02);
        }
}

static void test_a_friction_may_turn_softly(void)
{
    const double a[2] = {0.15};
    make_log_with(DQW_EFFECT_COULOMB_FRICTION, a, 0.0, 70);
    dqw_mechanical_config c = config_of(true);
    c.coulomb_width_rad_s = 1.0f;
    const dqw_mechanical m = learn(&c);
    const dqw_friction f = dqw_mechanical_read(&m);
    BETWEEN(-0.01, f.coulomb_Nm / 0.15 - 1, 0.01);
    BETWEEN(-0.01, f.J_kgm2 / J_TRUE - 1, 0.01);
}

static void test_effects_are_refused_and_cogging_needs_the_angle(void)
{
    dqw_mechanical m;
    dqw_effect_config list = {.effect = DQW_EFFECT_COGGING_TORQUE, .shape = {6}};
    dqw_mechanical_config c = config_of(false);
    c.effects = &list;
    c.effect_count = 1;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_mechanical_init(&m, &c));
    TEST_ASSERT_TRUE(dqw_mechanical_step(&m, 0.1f, 10.0f) & DQW_EVENT_NONFINITE);
    TEST_ASSERT_FALSE(dqw_mechanical_step_at(&m, 0.1f, 10.0f, 1.0f) & DQW_EVENT_NONFINITE);
    list.shape[0] = 0.0f;
    REFUSED(m, DQW_ERR_EFFECT_SHAPE, dqw_mechanical_init(&m, &c));
    list = (dqw_effect_config){.effect = DQW_EFFECT_DEAD_TIME, .shape = {1}};
    REFUSED(m, DQW_ERR_EFFECT_NAME, dqw_mechanical_init(&m, &c));
    c.effects = NULL;
    REFUSED(m, DQW_ERR_EFFECT_LIST, dqw_mechanical_init(&m, &c));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_effect_of_the_shaft_gives_back_its_weight);
    RUN_TEST(test_a_friction_may_turn_softly);
    RUN_TEST(test_effects_are_refused_and_cogging_needs_the_angle);
    RUN_TEST(test_init_refuses_and_leaves_the_object_alone);
    RUN_TEST(test_noise_free_inertia_and_friction);
    RUN_TEST(test_noise_free_with_coulomb_friction);
    RUN_TEST(test_one_percent_noise);
    RUN_TEST(test_nominal_values_are_no_prior);
    RUN_TEST(test_missing_samples_and_gaps_do_not_bias);
    RUN_TEST(test_what_the_signals_cannot_teach_is_not_known);
    RUN_TEST(test_counters_stop_at_their_maximum);
    return UNITY_END();
}
