// What is said in whole numbers of what was learned, against the equations in double: deviations, what hides behind an
// input, and when a voltage acts.
#include "dqw_estimator_block_q15.h"
#include "dqw_test.h"
#include "known_weight.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

enum { N = DQW_PARAMETERS };
#define V_FULL 40.0
#define Q24 16777216.0
#define Q28 268435456.0
#define Q31 2147483648.0
#define Q38 274877906944.0
#define Q40 1099511627776.0
#define Q56 72057594037927936.0

static dqw_estimator_q15_config config;
static dqw_estimator_q15 e;

static void start(bool settled)
{
    static const dqw_estimator_q15_config given = {.scale = {(uint32_t)(1000 * V_FULL), 12000, 400000, 100000, 5},
                                                   .R_uohm = 400000,
                                                   .Ld_nH = 1100000,
                                                   .Lq_nH = 1700000,
                                                   .psi_nWb = 15000000,
                                                   .half_window = 20,
                                                   .dead_time_width_mA = 300,
                                                   .angle = true,
                                                   .encoder_offset = true};
    config = given;
    config.settled = settled;
    memset(&e, 0, sizeof e);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&e, &config));
    e.stage.name = DQW_STAGE_ORDINAL;
}

// What is rounded on its way in is then said to be so.
static void take_state(known_state *s)
{
    for (int a = 0; a < 2; a++) {
        e.error_q56[a] = llrint(s->error2[a] * Q56);
        e.residual.lasting_q38[a] = (int32_t)lrint(s->lasting2[a] * Q38);
        s->lasting2[a] = e.residual.lasting_q38[a] / Q38;
        e.residual.lasting_q38[2] = (int32_t)lrint(s->lasting2[2] * Q38);
        if (a == 1) s->lasting2[2] = e.residual.lasting_q38[2] / Q38;
    }
    e.residual.slow_q38 = (int32_t)lrint(s->slow2 * Q38);
    s->slow2 = e.residual.slow_q38 / Q38;
    e.residual.calm_q28[0] = (uint32_t)lrint(sqrt(s->calm_fast2) * Q28);
    e.residual.calm_q28[1] = (uint32_t)lrint(sqrt(s->calm_slow2) * Q28);
    s->calm_fast2 = pow(e.residual.calm_q28[0] / Q28, 2), s->calm_slow2 = pow(e.residual.calm_q28[1] / Q28, 2);
    e.blocks = (uint16_t)s->blocks;
    e.segment.segments = (uint16_t)s->segments, e.segment.since = (uint16_t)s->since;
    e.residual.opened = (uint8_t)s->opened;
    config.voltage_error_mV = (uint32_t)lrint(s->voltage_error * 1000 * V_FULL);
    s->voltage_error = config.voltage_error_mV / (1000 * V_FULL);
    config.voltage_scale_ppm = (uint32_t)lrint(1e6 * s->voltage_scale);
    s->voltage_scale = 1e-6 * config.voltage_scale_ppm;
}

static void take_weight(int i, known_weight *w)
{
    e.w_q24[i] = (int32_t)lrint(w->w * Q24);
    e.cov_q40[i] = llrint(w->cov * Q40);
    e.residual.alone_q31[i] = (uint32_t)llrint(w->alone2 * Q31);
    e.residual.slow_alone_q31[i] = (uint32_t)llrint(w->slow_alone2 * Q31);
    e.segment.band_q28[i] = (int32_t)lrint(w->band * Q28);
    w->band = e.segment.band_q28[i] / Q28;
    e.learned = (e.learned & ~(1u << i)) | (uint32_t)w->learned << i;
}

static void alike(double expected, int32_t value_q24, const char *what)
{
    const double room = 2 / Q24 + 1e-3 * expected;
    // What hides is a square of 2^61 at most.
    if (!isfinite(expected))
        HOLDS(value_q24 == INT32_MAX);
    else if (expected > 5)
        HOLDS(value_q24 / Q24 > 4.99);
    else
        test_between(expected - room, value_q24 / Q24, expected + room, what, __LINE__);
}

static void test_deviations_are_the_equations(void)
{
    test_random r = {710};
    int known = 0;
    for (int k = 0; k < 3000; k++) {
        const bool settled = k % 5 == 0;
        start(settled);
        known_state s = known_drawn(&r, settled, settled ? 1e-10 : 1e-8);
        config.follow = k % 4 >= 2;
        s.forgets = config.follow && !settled;
        s.stretch = 15;  // 30 ms of blocks of 2 ms
        // No leg rests: the constant is no weight.
        e.modulation = (uint8_t)(k % 2 ? DQW_MODULATION_CENTRED : DQW_MODULATION_CLAMPED_LOW);
        s.weights = e.inputs - k % 2;
        config.observed = k % 3 == 0;
        take_state(&s);
        known_weight w[N];
        for (int i = 0; i < N; i++) w[i] = weight_drawn(&r);
        for (int i = 0; i < N; i++) {
            // R stands for dead time, the flux for the other one and the constant.
            const int score = i <= DQW_PSI ? i : i == DQW_DEAD_TIME ? DQW_R : DQW_PSI;
            w[i].score2 = w[score].score2, w[i].lag = w[score].lag;
            e.score2_q68[score] = llrint(w[i].score2 * Q56), e.score_lag_q68[score] = llrint(w[i].lag * Q56);
            w[i].leans = config.observed && i <= DQW_LQ;
            w[i].is_L = i == DQW_LD || i == DQW_LQ;
            const bool quiet_q = fmax(s.error2[1], s.floor2) < fmax(s.error2[0], s.floor2);
            w[i].in_q = i == DQW_PSI || (i != DQW_PSI_Q && quiet_q);
            take_weight(i, &w[i]);
            s.learned += w[i].learned;
        }
        double fast2;
        double slow2;
        known_lasting(&s, &fast2, &slow2);
        const dqw_lasting_q15 now = dqw_estimator_lasting_q15(&e);
        CASE("state %d", k);
        const double size = 1e-4 * known_common(&s) + 1e-13;
        BETWEEN(fast2 - size, (double)now.fast_q56 / Q56, fast2 + size);
        BETWEEN(slow2 - size, (double)now.slow_q56 / Q56, slow2 + size);
        BETWEEN(known_common(&s) - size, (double)now.all_q56 / Q56, known_common(&s) + size);
        const double calm2 = 0.16 * pow(e.residual.calm_q28[0] / Q28, 2) / (1 + s.since);
        BETWEEN(0.999 * calm2 - 1e-15, (double)dqw_estimator_witness_q56(&e) / Q56, 1.001 * calm2 + 1e-15);
        const double left = sqrt(s.error2[0] + s.error2[1]);
        BETWEEN(0.999 * left, dqw_estimator_residual_q28(&e) / Q28, 1.001 * left);
        // What is next to nothing beside what noise makes of it is no more exact than that.
        const double margin = 0.02 * known_common(&s);
        if ((fast2 > 0 && fast2 < margin) || (slow2 > 0 && slow2 < margin)) continue;
        for (int i = 0; i < N; i++) {
            CASE("state %d, weight %d, %d blocks", k, i, s.blocks);
            const known_sd sd = known_of(&s, &w[i]);
            alike(sd.noise, dqw_estimator_noise_sd_q24(&e, i), "by noise");
            alike(sd.change, dqw_estimator_sd_q24(&e, i), "of a change");
            const double model = sqrt(known_model2(&s, &w[i], fast2, slow2));
            const int32_t model_q28 = dqw_estimator_model_q28(&e, i, &now);
            if (!isfinite(model))
                HOLDS(model_q28 == INT32_MAX);
            else
                BETWEEN(0.999 * model - 1e-7, model_q28 / Q28, 1.001 * model + 1e-7);
            known += isfinite(sd.value);
            const dqw_reading_q15 read = dqw_estimator_read_q15(&e, (enum dqw_parameter)i);
            const bool told = isfinite(sd.value) && !(config.observed && (i == DQW_LD || i == DQW_LQ));
            HOLDS((read.sd_q40 != INT64_MAX) == told);
            if (told) alike(sd.value, (int32_t)(read.sd_q40 / 65536), "of the value");
            HOLDS((read.sd_change_q40 != INT64_MAX) == isfinite(sd.change));
            if (isfinite(sd.change)) alike(sd.change, (int32_t)(read.sd_change_q40 / 65536), "of a change");
        }
    }
    TEST_ASSERT_TRUE(known > 5000);
}

// A stretch is thirty milliseconds, of four to two hundred blocks.
static void test_stretches(void)
{
    static const int half[] = {1, 2, 3, 7, 20, 70, 74, 76, 100};
    for (unsigned k = 0; k < sizeof half / sizeof half[0]; k++) {
        start(false);
        e.window.half = (uint8_t)half[k];
        CASE("half of %d pairs", half[k]);
        HOLDS((int)dqw_estimator_stretch_q15(&e) == (int)fmax(4, fmin(200, round(300.0 / half[k]))));
    }
}

// Without pole pairs R, L_d, L_q alone are told; of settled points R alone.
static void test_what_needs_pole_pairs(void)
{
    for (int settled = 0; settled < 2; settled++) {
        start(settled == 1);
        config.scale.pole_pairs = 0;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&e, &config));
        e.blocks = 1000, e.learned = (1u << N) - 1u;
        e.error_q56[0] = e.error_q56[1] = llrint(1e-6 * Q56);
        for (int i = 0; i < N; i++) {
            CASE("settled %d, weight %d", settled, i);
            e.w_q24[i] = 12345;
            e.cov_q40[i] = llrint(0.01 * Q40), e.residual.alone_q31[i] = (uint32_t)llrint(0.1 * Q31);
            const dqw_reading_q15 r = dqw_estimator_read_q15(&e, (enum dqw_parameter)i);
            HOLDS((r.sd_q40 != INT64_MAX) == (i == DQW_R || (settled == 0 && i <= DQW_LQ)));
            HOLDS((r.sd_change_q40 != INT64_MAX) == (r.sd_q40 != INT64_MAX));
            HOLDS((r.value_q40 == 0) == (settled == 0 && i > DQW_PSI));
        }
        HOLDS(dqw_estimator_read_q15(&e, (enum dqw_parameter)N).value_q40 == 0);
    }
}

// Sums in which a late voltage of this power is so many periods of the residual; all else has been solved.
static void late(double power, double periods)
{
    const int n = e.inputs;
    memset(&e.normal, 0, sizeof e.normal);
    e.normal.inputs = (uint8_t)(n + 1);
    for (int i = 0; i < n; i++) e.normal.a_q32[DQW_NORMAL_A(i, i)] = llrint(4294967296.0);
    e.normal.a_q32[DQW_NORMAL_A(n, n)] = llrint(power * 4294967296.0);
    e.normal.b_q32[n] = llrint(power * periods * 4294967296.0);
    e.normal.c_q32 = llrint(1e4 * 4294967296.0);
}

// (E90): within 0.35 of a period, with a deviation below 0.16, from fifty blocks on.
static void test_when_a_voltage_acts(void)
{
    for (int next = 0; next < 2; next++)
        for (int k = -45; k <= 45; k++) {
            start(false);
            config.voltage_next = next == 1;
            e.blocks = 50;
            e.error_q56[0] = e.error_q56[1] = llrint(1e-4 * Q56);
            const double periods = 0.031 * k;
            CASE("next %d, %g periods late", next, periods);
            late(100, periods);
            const double whole = round(periods);
            const bool near = fabs(periods - whole) < 0.35 && (whole == 0 || whole == (next ? -1 : 1));
            const enum dqw_voltage_acts now = whole == 0 ? (next ? DQW_VOLTAGE_NEXT : DQW_VOLTAGE_NOW)
                                                         : (next ? DQW_VOLTAGE_NOW : DQW_VOLTAGE_NEXT);
            HOLDS(dqw_estimator_voltage_acts_q15(&e) == (near ? now : DQW_VOLTAGE_NOT_KNOWN));
            e.blocks = 49;
            HOLDS(dqw_estimator_voltage_acts_q15(&e) == DQW_VOLTAGE_NOT_KNOWN);
        }
    // sd^2 = s^2 (1 + 2 r) / power, r R's autocorrelation.
    for (int above = 0; above < 2; above++) {
        start(false);
        e.blocks = 400;
        e.score2_q68[DQW_R] = 4000000, e.score_lag_q68[DQW_R] = 1000000;
        e.error_q56[0] = llrint(1e-4 * Q56), e.error_q56[1] = llrint(3e-4 * Q56);
        const double sd = above ? 0.161 : 0.159;
        late(2e-4 * 1.5 / (sd * sd), 0);
        HOLDS(dqw_estimator_voltage_acts_q15(&e) == (above ? DQW_VOLTAGE_NOT_KNOWN : DQW_VOLTAGE_NOW));
    }
}

// An input of a few last places: how much of it is fast is no surer than one of them, whatever two means say.
static void test_the_last_place_of_an_input(void)
{
    start(false);
    e.blocks = 20000;
    for (uint32_t alone = 1; alone < 40; alone += 3)
        for (uint32_t slow = 0; slow < alone + 4; slow++) {
            e.residual.alone_q31[DQW_LD] = alone;
            e.residual.slow_alone_q31[DQW_LD] = slow;
            const double fast2 = 1e-9;
            const dqw_lasting_q15 l = {.fast_q56 = llrint(fast2 * Q56), .all_q56 = llrint(1e-7 * Q56)};
            const double h = dqw_estimator_model_q28(&e, DQW_LD, &l) / Q28;
            const double least = sqrt(fast2 * Q31) / alone;
            const double most = least * sqrt(slow < alone ? fmax(alone - slow, 1 + 0.2 * slow) : 1 + 0.2 * alone);
            CASE("%u last places, %u of them slow: %g", alone, slow, h);
            BETWEEN(0.99 * least, h, 1.01 * most);
        }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_deviations_are_the_equations);
    RUN_TEST(test_stretches);
    RUN_TEST(test_what_needs_pole_pairs);
    RUN_TEST(test_when_a_voltage_acts);
    RUN_TEST(test_the_last_place_of_an_input);
    return UNITY_END();
}
