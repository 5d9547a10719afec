// What is said of what was learned, against the equations in double: deviations, what hides behind an input, and when a
// voltage acts.
#include "dqw_estimator_block.h"
#include "dqw_test.h"
#include "known_weight.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

enum { N = DQW_PARAMETERS };

static dqw_estimator_config config;
static dqw_estimator e;

static void start(bool settled, bool effects)
{
    static const dqw_estimator_config given = {.dt_s = 1e-4f,
                                               .v_base_V = 24.0f,
                                               .i_base_A = 7.0f,
                                               .w_base_rad_s = 300.0f,
                                               .half_window = 20,
                                               .pole_pairs = 5,
                                               .dead_time_width_A = 0.3f,
                                               .angle = true,
                                               .encoder_offset = true};
    static const dqw_effect_config list[] = {{.effect = DQW_EFFECT_SKIN_EFFECT}, {.effect = DQW_EFFECT_VOLTAGE_OFFSET}};
    config = given;
    config.settled = settled;
    // Effects' weights come behind.
    if (effects) config.effects = list, config.effect_count = 2;
    memset(&e, 0, sizeof e);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&e, &config));
    e.stage.name = DQW_STAGE_ORDINAL;
}

static void take_state(known_state *s)
{
    for (int a = 0; a < 2; a++) {
        e.error_pu2[a] = (float)s->error2[a];
        e.lasting_pu2[a] = (float)s->lasting2[a];
        e.lasting_pu2[2] = (float)s->lasting2[2];
    }
    e.slow_pu2 = (float)s->slow2;
    e.calm.fast_pu2 = (float)s->calm_fast2, e.calm.slow_pu2 = (float)s->calm_slow2;
    e.blocks = (uint16_t)s->blocks;
    e.segment.segments = (uint16_t)s->segments, e.segment.since = (uint16_t)s->since;
    e.opened = (uint8_t)s->opened;
    config.voltage_error_V = (float)(s->voltage_error * (double)config.v_base_V);
    config.voltage_scale_ppm = (uint32_t)lrint(1e6 * s->voltage_scale);
    s->voltage_scale = 1e-6 * config.voltage_scale_ppm;
}

static void take_weight(int i, const known_weight *w)
{
    e.w_pu[i] = (float)w->w;
    e.gain.d[i] = (float)w->cov;
    e.alone_pu2[i] = (float)w->alone2, e.slow_alone_pu2[i] = (float)w->slow_alone2;
    if (i < N) e.segment.band_pu[i] = (float)w->band;
    e.learned = (e.learned & ~(1u << i)) | (uint32_t)w->learned << i;
}

static void alike(double expected, float value, const char *what)
{
    if (!isfinite(expected))
        HOLDS(value == DQW_UNKNOWN);
    else
        test_between((1 - 1e-4) * expected, (double)value, (1 + 1e-4) * expected, what, __LINE__);
}

static void test_deviations_are_the_equations(void)
{
    test_random r = {710};
    int known = 0;
    for (int k = 0; k < 3000; k++) {
        const bool settled = k % 5 == 0;
        start(settled, !settled);
        known_state s = known_drawn(&r, settled, settled ? 1e-13 : 1e-8);
        config.follow = k % 4 >= 2;
        s.forgets = config.follow && !settled;
        s.stretch = 15;  // 30 ms of blocks of 2 ms
        // No leg rests: the constant is no weight.
        e.modulation = (uint8_t)(k % 2 ? DQW_MODULATION_CENTRED : DQW_MODULATION_CLAMPED_LOW);
        s.weights = e.inputs - k % 2;
        config.observed = k % 3 == 0;
        take_state(&s);
        known_weight w[DQW_ESTIMATOR_INPUTS];
        for (int i = 0; i < e.inputs; i++) w[i] = weight_drawn(&r);
        for (int i = 0; i < e.inputs; i++) {
            // R stands for dead time, the flux for the other one and the constant.
            const int score = i >= N ? i - N + 4 : i <= DQW_PSI ? i : i == DQW_DEAD_TIME ? DQW_R : DQW_PSI;
            w[i].score2 = w[score].score2, w[i].lag = w[score].lag;
            e.score2[score] = (float)w[i].score2, e.score_lag[score] = (float)w[i].lag;
            w[i].leans = config.observed && i <= DQW_LQ;
            w[i].is_L = i == DQW_LD || i == DQW_LQ;
            const bool quiet_q = fmax(s.error2[1], s.floor2) < fmax(s.error2[0], s.floor2);
            w[i].in_q = i == DQW_PSI || (i != DQW_PSI_Q && quiet_q);
            if (i >= N) w[i].band = 0;
            take_weight(i, &w[i]);
            s.learned += w[i].learned;
        }
        double fast2;
        double slow2;
        known_lasting(&s, &fast2, &slow2);
        const dqw_lasting now = dqw_estimator_lasting(&e);
        CASE("state %d", k);
        const double size = 1e-4 * known_common(&s);
        BETWEEN(fast2 - size, now.fast_pu2, fast2 + size);
        BETWEEN(slow2 - size, now.slow_pu2, slow2 + size);
        alike(known_common(&s), now.all_pu2, "residual");
        alike(0.16 * s.calm_fast2 / (1 + s.since), dqw_estimator_witness_pu2(&e), "of the witness");
        alike(sqrt(s.error2[0] + s.error2[1]), dqw_estimator_residual_pu(&e), "root of the residual");
        // What is next to nothing beside what noise makes of it is no more exact than that.
        const double margin = 0.01 * known_common(&s);
        if ((fast2 > 0 && fast2 < margin) || (slow2 > 0 && slow2 < margin)) continue;
        for (int i = 0; i < e.inputs; i++) {
            CASE("state %d, weight %d, %d blocks", k, i, s.blocks);
            const known_sd sd = known_of(&s, &w[i]);
            const double unit = (double)dqw_estimator_unit(&e, i);
            alike(unit * sd.noise, dqw_estimator_noise_sd(&e, i), "by noise");
            alike(unit * sd.change, dqw_estimator_sd(&e, i), "of a change");
            alike(unit * sd.value, dqw_estimator_sd_value(&e, i), "of the value");
            alike(sqrt(known_model2(&s, &w[i], fast2, slow2)), dqw_estimator_model_pu(&e, i, &now), "hidden");
            known += isfinite(sd.value);
            if (i >= N) continue;
            const dqw_reading read = dqw_estimator_read(&e, (enum dqw_parameter)i);
            if (config.observed && (i == DQW_LD || i == DQW_LQ))
                HOLDS(read.sd == DQW_UNKNOWN);
            else
                HOLDS(read.sd == dqw_estimator_sd_value(&e, i));
            HOLDS(read.sd_change == dqw_estimator_sd(&e, i));
        }
    }
    TEST_ASSERT_TRUE(known > 5000);
}

// A stretch is thirty milliseconds, of four to two hundred blocks.
static void test_stretches(void)
{
    static const int half[] = {1, 2, 3, 7, 20, 70, 74, 76, 200, 1000};
    for (unsigned k = 0; k < sizeof half / sizeof half[0]; k++) {
        start(false, false);
        e.window.half = (uint16_t)half[k];
        CASE("half of %d pairs", half[k]);
        HOLDS(dqw_estimator_stretch(&e) == (int)fmax(4, fmin(200, floor(300.0 / half[k] + 1e-4))));
    }
}

// Without pole pairs R, L_d, L_q alone are told; of settled points R alone.
static void test_what_needs_pole_pairs(void)
{
    for (int settled = 0; settled < 2; settled++) {
        start(settled == 1, false);
        config.pole_pairs = 0;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&e, &config));
        e.blocks = 1000, e.learned = (1u << N) - 1u;
        e.error_pu2[0] = e.error_pu2[1] = 1e-6f;
        for (int i = 0; i < N; i++) {
            CASE("settled %d, weight %d", settled, i);
            e.gain.d[i] = 0.01f, e.alone_pu2[i] = 0.1f;
            const dqw_reading r = dqw_estimator_read(&e, (enum dqw_parameter)i);
            HOLDS((r.sd != DQW_UNKNOWN) == (i == DQW_R || (settled == 0 && i <= DQW_LQ)));
            HOLDS((r.sd_change != DQW_UNKNOWN) == (r.sd != DQW_UNKNOWN));
        }
    }
}

// (E90): within 0.35 of a period, with a deviation below 0.16, from fifty blocks on.
static void test_when_a_voltage_acts(void)
{
    for (int next = 0; next < 2; next++)
        for (int k = -45; k <= 45; k++) {
            start(false, false);
            config.voltage_next = next == 1;
            e.blocks = 50, e.late_pu2 = 0.5f;
            e.error_pu2[0] = e.error_pu2[1] = 1e-4f;
            const double periods = 0.031 * k;
            CASE("next %d, %g periods late", next, periods);
            e.late_error_pu2 = (float)(periods * 0.5);
            const double whole = round(periods);
            const bool near = fabs(periods - whole) < 0.35 && (whole == 0 || whole == (next ? -1 : 1));
            const enum dqw_voltage_acts now = whole == 0 ? (next ? DQW_VOLTAGE_NEXT : DQW_VOLTAGE_NOW)
                                                         : (next ? DQW_VOLTAGE_NOW : DQW_VOLTAGE_NEXT);
            HOLDS(dqw_estimator_voltage_acts(&e) == (near ? now : DQW_VOLTAGE_NOT_KNOWN));
            e.blocks = 49;
            HOLDS(dqw_estimator_voltage_acts(&e) == DQW_VOLTAGE_NOT_KNOWN);
        }
    // sd^2 = s^2 (1 + 2 r) part / power, r R's autocorrelation.
    for (int above = 0; above < 2; above++) {
        start(false, false);
        e.blocks = 400, e.late_error_pu2 = 0.0f;
        e.score2[DQW_R] = 1.0f, e.score_lag[DQW_R] = 0.25f;
        e.error_pu2[0] = 1e-4f, e.error_pu2[1] = 3e-4f;
        const double sd = above ? 0.161 : 0.159;
        e.late_pu2 = (float)(2e-4 * 1.5 * (double)dqw_estimator_part(&e) / (sd * sd));
        HOLDS(dqw_estimator_voltage_acts(&e) == (above ? DQW_VOLTAGE_NOT_KNOWN : DQW_VOLTAGE_NOW));
    }
}

// An axis that is followed ever closer weighs no more than 8 times what both would.
static void test_a_quiet_axis_weighs_so_much(void)
{
    start(false, false);
    for (int quiet = 0; quiet < 2; quiet++)
        for (double part = 1; part > 1e-5; part *= 0.5) {
            e.error_pu2[quiet] = (float)(1e-2 * part);
            e.error_pu2[1 - quiet] = 1e-2f;
            const double mean = 1e-2 * (1 + part) / 2;
            CASE("axis %d, %g of the other", quiet, part);
            alike(fmax(1e-2 * part / mean, 1.0 / 64), (double)dqw_estimator_axis_part(&e, quiet), "quiet");
            alike(1e-2 / mean, (double)dqw_estimator_axis_part(&e, 1 - quiet), "loud");
        }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_deviations_are_the_equations);
    RUN_TEST(test_stretches);
    RUN_TEST(test_what_needs_pole_pairs);
    RUN_TEST(test_when_a_voltage_acts);
    RUN_TEST(test_a_quiet_axis_weighs_so_much);
    return UNITY_END();
}
