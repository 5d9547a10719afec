// The fixed-point estimator by itself: refusals, bad samples, hand-over, gaps, any bits, weights out of bounds, pole
// pairs, settled rows, when the voltage acts, stage 2.
#include "dqw_estimator_random_q15.h"
#include "twin_estimator.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

static void test_init_names_the_field_and_leaves_the_object_alone(void)
{
    pair p;
    configure(&p, 0.0, 0.05);
    dqw_estimator_q15 e;
    TEST_ASSERT_EQUAL_INT(DQW_ERR_NULL, dqw_estimator_init_q15(NULL, &p.qc));
    REFUSED(e, DQW_ERR_NULL, dqw_estimator_init_q15(&e, NULL));
    static const dqw_estimator_q15_config zero = {.half_window = 0};
    REFUSED(e, DQW_ERR_V_BASE, dqw_estimator_init_q15(&e, &zero));
    const dqw_estimator_q15_config good = p.qc;
    dqw_estimator_random_q15 raw = {.learn = NULL};
    const struct {
        dqw_estimator_q15_config c;
        enum dqw_status status;
    } bad[] = {
#define BAD(field, value, name) {good, DQW_ERR_##name},
#define FIELDS                                                                                                         \
    FIELD(scale.v_full_mV, 0, V_BASE)                                                                                  \
    FIELD(scale.i_full_mA, DQW_SCALE_MAX + 1, I_BASE)                                                                  \
    FIELD(scale.w_full_mrad_s, 0, W_BASE)                                                                              \
    FIELD(scale.dt_ns, 1000000001, DT)                                                                                 \
    FIELD(scale.dt_ns, 2000000, TURN)                                                                                  \
    FIELD(R_uohm, UINT32_MAX, R)                                                                                       \
    FIELD(Ld_nH, UINT32_MAX, LD)                                                                                       \
    FIELD(Lq_nH, UINT32_MAX, LQ)                                                                                       \
    FIELD(excitation_q15, 32767, EXCITATION)                                                                           \
    FIELD(half_window, 101, HALF_WINDOW)                                                                               \
    FIELD(dead_time_width_mA, 1, DEAD_TIME_WIDTH)                                                                      \
    FIELD(modulation, DQW_MODULATIONS, MODULATION)                                                                     \
    FIELD(angle_late_ns, -100001, ANGLE_LATE)                                                                          \
    FIELD(voltage_error_mV, DQW_SCALE_MAX + 1, VOLTAGE_ERROR)                                                          \
    FIELD(voltage_scale_ppm, 100001, VOLTAGE_SCALE)                                                                    \
    FIELD(random, &raw, RANDOM)
#define FIELD BAD
        FIELDS
#undef FIELD
    };
    int n = 0;
#define FIELD(field, value, name)                                                                                      \
    {                                                                                                                  \
        dqw_estimator_q15_config c = bad[n].c;                                                                         \
        c.field = (value);                                                                                             \
        CASE("%s", #field);                                                                                            \
        REFUSED(e, bad[n].status, dqw_estimator_init_q15(&e, &c));                                                     \
        n++;                                                                                                           \
    }
    FIELDS
#undef FIELD
    p.qc = good;
    p.qc.settled = p.qc.voltage_held = true;
    REFUSED(e, DQW_ERR_SETTLED, dqw_estimator_init_q15(&e, &p.qc));
    // Without an angle a width means nothing.
    p.qc = good;
    p.qc.angle = false;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&p.q, &p.qc));
    HOLDS(p.q.wide_q28 == 0);
#if DQW_EFFECT_WEIGHTS > 0
    // Dead time by its width and in the list.
    p.qc = good;
    static const dqw_effect_q15_config again = {.effect = DQW_EFFECT_DEAD_TIME, .i_uA = 300000};
    p.qc.effect_count = 1;
    p.qc.effects = &again;
    REFUSED(e, DQW_ERR_EFFECT_TWICE, dqw_estimator_init_q15(&e, &p.qc));
    // A list that is not there, and one longer than any that has room.
    p.qc = good;
    p.qc.effect_count = 1;
    REFUSED(e, DQW_ERR_EFFECT_LIST, dqw_estimator_init_q15(&e, &p.qc));
    static const dqw_effect_q15_config one = {.effect = DQW_EFFECT_IRON_LOSS};
    p.qc.effects = &one;
    // One alone needs the pole pairs.
    p.qc.effect_count = 1;
    p.qc.scale.pole_pairs = 0;
    REFUSED(e, DQW_ERR_EFFECT_POLE_PAIRS, dqw_estimator_init_q15(&e, &p.qc));
    p.qc = good;
    p.qc.effects = &one;
    p.qc.effect_count = UINT8_MAX;
    REFUSED(e, DQW_ERR_EFFECT_ROOM, dqw_estimator_init_q15(&e, &p.qc));
    p.qc.effect_count = 0;
#endif
    p.qc = good;
    p.qc.scale.pole_pairs = 0;
    p.qc.voltage_held = true;
    REFUSED(e, DQW_ERR_POLE_PAIRS, dqw_estimator_init_q15(&e, &p.qc));
    // The old one goes on where another configuration is refused.
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&p.q, &good));
    p.q.halves = 77;
    p.q.gate.accepted = 5;
    const dqw_estimator_q15 before = p.q;
    TEST_ASSERT_EQUAL_INT(DQW_ERR_POLE_PAIRS, dqw_estimator_define_q15(&p.q, &p.qc));
    TEST_ASSERT_EQUAL_MEMORY(&before, &p.q, sizeof before);
    p.q.blocks = 100;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_define_q15(&p.q, &good));
    HOLDS(p.q.halves == 77 && p.q.gate.accepted == 5 && p.q.blocks == 0 && p.q.stage.name == DQW_STAGE_RANDOM);
}

// What the background gives holds from the next half on, each axis its own.
static void test_each_axis_takes_its_own_step(void)
{
    pair p;
    configure(&p, 0.3, 0.05);
    begin(&p);
    p.q.given = (dqw_estimator_q15_given){.step_q15 = {3, 7}, .follow_q15 = 99, .ready = true};
    const dqw_sample_q15 s = {.i_q_q15 = 1000, .w_m_q15 = 2000, .cosine_q15 = INT16_MAX};
    for (int k = 0; k < 300 && p.q.given.ready; k++) (void)dqw_estimator_sample_q15(&p.q, &s, false);
    HOLDS(!p.q.given.ready && p.q.step_q15[0] == 3 && p.q.step_q15[1] == 7 && p.q.follow_q15 == 99);
}

static void test_a_nameplate_is_enough(void)
{
    const dqw_nameplate_q15 plate = {
        .dt_ns = 100000, .v_mV = 24000, .i_mA = 10000, .w_mrad_s = 300000, .pole_pairs = 7};
    const dqw_estimator_q15_config c = dqw_estimator_config_default_q15(&plate);
    dqw_estimator_q15 e;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&e, &c));
    // 450 rad/s by 7 by 0.1 ms: no less than five
    HOLDS(dqw_estimator_config_default_q15(NULL).scale.dt_ns == 0);
    HOLDS(c.half_window == 5 && c.scale.v_full_mV == 36000 && c.dead_time_width_mA == 200 && c.angle &&
          c.encoder_offset && c.noise_on_inputs);
}

static void test_fresh_estimator_has_the_nominal_values_and_knows_nothing(void)
{
    pair p;
    configure(&p, 0.3, 0.05);
    begin(&p);
    for (int i = 0; i < N; i++) {
        CASE("%s", NAME[i]);
        BETWEEN(-1e-6, q_value(&p, i) - f_value(&p, i), 1e-6);
        const dqw_reading_q15 r = dqw_estimator_read_q15(&p.q, (enum dqw_parameter)i);
        HOLDS(r.sd_q40 == INT64_MAX && r.sd_change_q40 == INT64_MAX && !r.usable);
    }
    HOLDS(!dqw_estimator_background_q15(&p.q) && dqw_estimator_voltage_acts_q15(&p.q) == DQW_VOLTAGE_NOT_KNOWN &&
          dqw_estimator_pole_pairs_q15(&p.q) == 4);
    HOLDS(dqw_estimator_residual_q28(&p.q) == 0 && dqw_estimator_recent_q27(&p.q) == 0);
    // No sum is nought, that of the late voltage neither.
    for (int i = 0; i <= p.q.inputs; i++) HOLDS(p.q.normal.a_q32[DQW_NORMAL_A(i, i)] > 0);
    HOLDS(p.q.normal.inputs == p.q.inputs + 1 && p.q.across == 0);
    // The late voltage is one more input before a solution and after it.
    dqw_estimator_solve_q15(&p.q);
    HOLDS(p.q.normal.inputs == p.q.inputs + 1);
    int64_t w[DQW_EFFECT_STARTS];
    HOLDS(dqw_estimator_read_effect_q15(&p.q, 0, w, w) == DQW_ERR_SIZE &&
          dqw_estimator_read_effect_q15(&p.q, -1, w, w) == DQW_ERR_SIZE);
    const dqw_reading_q15 none = dqw_estimator_read_q15(&p.q, DQW_PARAMETERS);
    HOLDS(none.sd_q40 == INT64_MAX && !none.usable && dqw_estimator_unit_q15(&p.qc, DQW_PARAMETERS) == 0);
}

static void learn_log(pair *p, int from, int rows)
{
    const journal *l = simulated(0.0);
    test_random r = {91};
    for (int k = from; k < from + rows; k++) {
        const dqw_sample whole = sample(l, k % l->rows, 0.01, &r);
        const dqw_sample_q15 s = rounded(&whole);
        if (dqw_estimator_sample_q15(&p->q, &s, false) & DQW_EVENT_BLOCK) (void)dqw_estimator_background_q15(&p->q);
    }
}

// Who hears nothing for a while is as sure as it was, and of the same; in stage 1 nothing is usable. (E61)
static void test_time_alone_makes_nobody_less_sure(void)
{
    pair p;
    configure(&p, 0.3, 0.0);
    p.qc.follow = true;
    begin(&p);
    learn_log(&p, 0, 20000);
    for (int i = 0; i < N; i++) {
        CASE("%s", NAME[i]);
        const dqw_reading_q15 before = dqw_estimator_read_q15(&p.q, (enum dqw_parameter)i);
        HOLDS(before.usable == (i < 4));
        p.q.stage.name = DQW_STAGE_DOMAIN;
        HOLDS(!dqw_estimator_read_q15(&p.q, (enum dqw_parameter)i).usable);
        p.q.stage.name = DQW_STAGE_ORDINAL;
        for (int n = 1; n <= 100; n++) dqw_estimator_missing_q15(&p.q, 1000000000u / p.qc.scale.dt_ns);
        const dqw_reading_q15 now = dqw_estimator_read_q15(&p.q, (enum dqw_parameter)i);
        HOLDS(now.value_q40 == before.value_q40 && now.sd_q40 == before.sd_q40 &&
              now.sd_change_q40 == before.sd_change_q40 && now.usable == before.usable);
    }
}

// A count that is full ends nothing: weights are solved for as long as there are blocks.
static void test_a_full_count_of_blocks_still_learns(void)
{
    pair p;
    configure(&p, 0.3, 0.0);
    begin(&p);
    learn_log(&p, 0, 4000);
    p.q.gate.blocks = UINT32_MAX - 2;
    const int32_t before = p.q.w_q24[DQW_LQ];
    learn_log(&p, 4000, 4000);
    HOLDS(p.q.gate.blocks == UINT32_MAX && p.q.w_q24[DQW_LQ] != before);
    const int32_t full = p.q.w_q24[DQW_LQ];
    learn_log(&p, 8000, 4000);
    HOLDS(p.q.w_q24[DQW_LQ] != full);
}

// A held vector's mean, by its closed form: turned by half a period's angle, or by three of it where it acts a period
// later, and shorter by its sine over it. Within four last places.
static void test_a_held_vector_is_turned_and_shortened(void)
{
    const double dt_s = 6e-4;
    for (int next = 0; next < 2; next++) {
        pair p;
        configure(&p, 0.0, 0.0);
        p.qc.scale.dt_ns = 600000;
        p.qc.voltage_held = true;
        p.qc.voltage_next = next == 1;
        begin(&p);
        test_random r = {92};
        double v[2] = {0.0, 0.0};
        double widest = 0.0;
        for (int k = 0; k < 2000; k++) {
            const int w = k % 2 == 0 ? 15 * k : -15 * k;
            const dqw_sample_q15 x = {.v_d_q15 = (int16_t)((int)(random_bits(&r) % 40000u) - 20000),
                                      .v_q_q15 = (int16_t)((int)(random_bits(&r) % 40000u) - 20000),
                                      .i_q_q15 = (int16_t)k,
                                      .w_m_q15 = (int16_t)w};
            (void)dqw_estimator_sample_q15(&p.q, &x, false);
            if (next == 0) v[0] = x.v_d_q15, v[1] = x.v_q_q15;
            const double half = 0.5 * 4 * (w / 32768.0 * W_FULL) * dt_s;
            const double turn = next == 1 ? 3 * half : half;
            const double size = half != 0.0 ? sin(half) / half : 1.0;
            CASE("%s, row %d", next == 1 ? "next" : "now", k);
            BETWEEN(-4, p.q.last.v_d_q15 - size * (cos(turn) * v[0] + sin(turn) * v[1]), 4);
            BETWEEN(-4, p.q.last.v_q_q15 - size * (cos(turn) * v[1] - sin(turn) * v[0]), 4);
            if (next == 1) v[0] = x.v_d_q15, v[1] = x.v_q_q15;
            widest = fmax(widest, fabs(turn));
        }
        BETWEEN(0.1, widest, 1.5);
    }
}

// A voltage beyond its scale is refused with the sample that it came with, whenever it acts.
static void test_a_voltage_beyond_the_scale(void)
{
    for (int n = 0; n < 8; n++) {
        pair p;
        configure(&p, 0.0, 0.0);
        p.qc.voltage_held = n % 2 == 1;
        p.qc.voltage_next = n / 2 % 2 == 1;
        begin(&p);
        for (int k = 0; k < 12; k++) {
            CASE("held %d, next %d, axis %d, sample %d", n % 2, n / 2 % 2, n / 4, k);
            dqw_sample_q15 s = {.v_d_q15 = 900, .v_q_q15 = -800, .i_q_q15 = (int16_t)(500 + k), .w_m_q15 = 9000};
            const int16_t beyond = k % 4 == 2 ? INT16_MIN : k % 4 == 3 ? INT16_MAX : 0;
            if (beyond != 0) *(n / 4 != 0 ? &s.v_q_q15 : &s.v_d_q15) = beyond;
            const uint32_t event = dqw_estimator_sample_q15(&p.q, &s, false) & DQW_EVENT_SATURATED;
            HOLDS((event != 0) == (beyond != 0));
        }
    }
}

// A sample repeats the one before where both currents and the speed are the same: any one of them that moves is life.
static void test_what_repeats(void)
{
    for (int moves = 0; moves < 8; moves++) {
        pair p;
        configure(&p, 0.0, 0.0);
        p.qc.stale_limit = 5;
        begin(&p);
        for (int k = 0; k < 50; k++) {
            dqw_sample_q15 s = {.v_q_q15 = (int16_t)k, .i_d_q15 = 100, .i_q_q15 = 200, .w_m_q15 = 3000};
            if ((moves & 1) != 0) s.i_d_q15 = (int16_t)(100 + k % 2);
            if ((moves & 2) != 0) s.i_q_q15 = (int16_t)(200 + k % 2);
            if ((moves & 4) != 0) s.w_m_q15 = (int16_t)(3000 + k % 2);
            (void)dqw_estimator_sample_q15(&p.q, &s, false);
        }
        CASE("moves %d", moves);
        HOLDS((p.q.gate.stale > 0) == (moves == 0));
    }
}

// Noise is measured over rows that follow each other: none across a sample that was refused.
static void test_noise_is_not_measured_across_a_refused_sample(void)
{
    pair p;
    configure(&p, 0.0, 0.0);
    begin(&p);
    for (int k = 0; k < 40; k++) {
        const dqw_sample_q15 s = {.v_q_q15 = 500, .i_q_q15 = (int16_t)(500 + 37 * k % 11), .w_m_q15 = 9000};
        (void)dqw_estimator_sample_q15(&p.q, &s, k % 10 == 9);
        CASE("sample %d", k);
        HOLDS((p.q.noise.held > 0) == (k > 0 && k % 10 != 9 && k % 10 != 0));
    }
}

// A burst of bad samples amid good ones: counted one by one, and the result is as good as without.
static void test_bursts_of_bad_samples_are_counted_and_harmless(void)
{
    const journal *l = simulated(0.0);
    double undisturbed[4] = {0};
    for (int kind = -1; kind < 4; kind++) {
        CASE("kind %d", kind);
        pair p;
        configure(&p, 0.3, 0.0);
        p.qc.stale_limit = 10;
        begin(&p);
        test_random r = {90};
        dqw_sample_q15 held = {0};
        uint32_t events[2] = {0};
        for (int k = 0; k < l->rows; k++) {
            const dqw_sample whole = sample(l, k, 0.01, &r);
            dqw_sample_q15 s = rounded(&whole);
            int16_t *const channel[] = {&s.v_d_q15, &s.v_q_q15, &s.i_d_q15, &s.i_q_q15, &s.w_m_q15};
            const bool burst = kind >= 0 && k % 10000 >= 5000 && k % 10000 < 5200;
            if (!burst)
                held = s;
            else if (kind == 0)
                *channel[k % 5] = k % 2 ? 32767 : -32768;
            else if (kind == 1)
                *channel[k % 5] = -32767;
            else if (kind == 2)
                s.i_d_q15 = held.i_d_q15, s.i_q_q15 = held.i_q_q15, s.w_m_q15 = held.w_m_q15;
            const uint32_t e = dqw_estimator_sample_q15(&p.q, &s, burst && kind == 3);
            events[0] += (e & DQW_EVENT_SATURATED) != 0;
            events[1] += (e & DQW_EVENT_STALE) != 0;
            if (e & DQW_EVENT_BLOCK) (void)dqw_estimator_background_q15(&p.q);
        }
        if (kind < 0) {
            for (int i = 0; i < 4; i++) undisturbed[i] = q_value(&p, i);
            continue;
        }
        const uint32_t bad = 4 * 200;
        const dqw_gate *g = &p.q.gate;
        TEST_ASSERT_EQUAL_UINT32(kind == 2 ? 0 : bad, g->saturated);
        TEST_ASSERT_EQUAL_UINT32(kind == 2 ? bad - 4 * 9 : 0, g->stale);
        TEST_ASSERT_EQUAL_UINT32((uint32_t)l->rows, g->accepted + g->saturated + g->stale);
        TEST_ASSERT_EQUAL_UINT32(g->saturated, events[0]);
        TEST_ASSERT_EQUAL_UINT32(g->stale, events[1]);
        BETWEEN(40, g->incomplete, 48);
        for (int i = 0; i < 4; i++) {
            CASE("kind %d, %s", kind, NAME[i]);
            BETWEEN(-0.02, 100 * (q_value(&p, i) - undisturbed[i]) / TRUTH[i], 0.02);
        }
    }
}

// Halves that are full while one waits are lost, and counted; gaps are not spanned, and carry time.
static void test_late_backgrounds_and_gaps(void)
{
    for (int every = 2; every <= 4; every++) {
        pair p;
        configure(&p, 0.3, 0.0);
        begin(&p);
        uint32_t offered = 0;
        uint32_t taken = 0;
        for (long k = 0; k < 40000; k++) {
            CASE("background misses every %d. half of ten, sample %ld", every, k);
            const dqw_sample s = moving(k, 0.5, 0.01, &(test_random){(uint64_t)k});
            const dqw_sample_q15 q = rounded(&s);
            const dqw_window_q15_part *part = &p.q.window.part[1 - p.q.window.over.now];
            const dqw_window_q15_part waits = *part;
            const bool waited = p.q.window.over.pending;
            offered += (dqw_estimator_sample_q15(&p.q, &q, false) & (DQW_EVENT_BLOCK | DQW_EVENT_MISSED)) != 0;
            if (waited) HOLDS(memcmp(&waits, part, sizeof waits) == 0);
            if (k % 20 != 19 || (k / 20 % 10 == 0 && k / 200 % every == 0)) continue;
            taken += p.q.window.over.pending;
            (void)dqw_estimator_background_q15(&p.q);
            HOLDS(!p.q.window.over.pending);
        }
        const uint32_t lost = offered - taken - p.q.window.over.pending;
        HOLDS(p.q.missed == lost && lost > 40);
        for (int i = 0; i < 4; i++) BETWEEN(-0.5, 100 * (q_value(&p, i) / TRUTH[i] - 1), 0.5);
    }
    pair p;
    configure(&p, 0.3, 0.0);
    begin(&p);
    int since = 0;
    test_random r = {120};
    for (long k = 0; k < 30000; k++) {
        if (since >= 317) {
            k += 1 + (long)(random_bits(&r) % 200);
            since = 0;
            dqw_estimator_missing_q15(&p.q, 0);
        }
        since++;
        CASE("sample %ld, %d after a gap", k, since);
        const dqw_sample s = moving(k, 0.5, 0.0, NULL);
        const dqw_sample_q15 q = rounded(&s);
        const bool block = (dqw_estimator_sample_q15(&p.q, &q, false) & DQW_EVENT_BLOCK) != 0;
        HOLDS(block == (since % 20 == 0));
        if (block) (void)dqw_estimator_background_q15(&p.q);
    }
    for (int i = 0; i < 4; i++) BETWEEN(-0.05, 100 * (q_value(&p, i) / TRUTH[i] - 1), 0.05);
    const uint32_t halves = p.q.halves;
    dqw_estimator_missing_q15(&p.q, 2000);
    BETWEEN(100, p.q.halves - halves, 101);
}

// Whatever comes: no overflow, which the sanitizers would see; weights stay within their bound, and what is learned is
// bounded below.
static void test_any_bits(void)
{
    for (int way = 0; way < 8; way++) {
        pair p;
        configure(&p, way & 1 ? 0.9 : -0.9, way & 2 ? 0.05 : 0.0);
        p.qc.follow = (way & 4) != 0;
        p.qc.half_window = (uint8_t)(way % 3 == 0 ? 1 : way % 3 == 1 ? 100 : 7);
        static const enum dqw_modulation modulation[] = {DQW_MODULATION_MASK, DQW_MODULATION_CLAMPED_LOW,
                                                         DQW_MODULATION_CLAMPED_HIGH, DQW_MODULATION_CLAMPED_60};
        p.qc.modulation = modulation[(way >> 1 & 2) | (way & 1)];
        p.qc.angle_late_ns = way % 2 ? 100000 : -100000;
        begin(&p);
        test_random r = {(uint64_t)(500 + way)};
        for (int k = 0; k < scaled(100000); k++) {
            const uint64_t z = random_bits(&r);
            const bool mild = k / 5000 % 2 == 0;
            dqw_sample_q15 s = dqw_sample_from_dq_q15((int16_t)(z & 65535), (int16_t)(z >> 16 & 65535), 0, 0, 0,
                                                      (uint16_t)(z >> 7 & 65535));
            s.i_d_q15 = (int16_t)(z >> 32 & 65535), s.i_q_q15 = (int16_t)(z >> 48 & 65535),
            s.w_m_q15 = (int16_t)(random_bits(&r) & 65535);
            s.resting = (uint8_t)(z >> 3 & 255);
            if (mild) s.v_d_q15 /= 64, s.i_q_q15 /= 1024, s.w_m_q15 /= 4;
            if (k % 30011 == 30010) dqw_estimator_missing_q15(&p.q, (uint32_t)z);
            if (dqw_estimator_sample_q15(&p.q, &s, false) & DQW_EVENT_BLOCK) (void)dqw_estimator_background_q15(&p.q);
            for (int i = 0; i < N; i++) {
                CASE("way %d, sample %d, weight %d: %d", way, k, i, (int)p.q.w_q24[i]);
                HOLDS(p.q.w_q24[i] < 1 << 30 && p.q.w_q24[i] > -(1 << 30) && p.q.cov_q40[i] >= 0);
            }
        }
    }
}

// A weight of 64 nominal values is no machine's: learning begins again, and is counted.
static void test_weights_out_of_bounds_begin_again(void)
{
    pair p;
    configure(&p, 0.0, 0.0);
    begin(&p);
    test_random r = {130};
    for (long k = 0; k < 20000; k++) {
        const dqw_sample s = moving(k, 0.5, 0.01, &r);
        if (k == 10000) p.q.w_q24[DQW_PSI_Q] = -(1 << 30);
        (void)step(&p, &s);
    }
    TEST_ASSERT_EQUAL_UINT32(1, p.q.restarts);
    for (int i = 0; i < 4; i++) BETWEEN(-0.5, 100 * (q_value(&p, i) / TRUTH[i] - 1), 0.5);
}

// All in one object, but for what the interrupt has gone on with.
static bool learned_alike(const dqw_estimator_q15 *a, const dqw_estimator_q15 *b)
{
    return memcmp(a->w_q24, b->w_q24, sizeof a->w_q24) == 0 && memcmp(&a->normal, &b->normal, sizeof a->normal) == 0 &&
           memcmp(a->cov_q40, b->cov_q40, sizeof a->cov_q40) == 0 &&
           memcmp(&a->given, &b->given, sizeof a->given) == 0 && a->blocks == b->blocks &&
           memcmp(&a->noise, &b->noise, sizeof a->noise) == 0 && a->follow_q15 == b->follow_q15;
}

// Samples that come between taking a block and learning it change nothing, to the bit; a block that was lost shows in
// the time.
static void test_a_background_that_is_interrupted_learns_the_same(void)
{
    pair p;
    configure(&p, 0.3, 0.05);
    p.qc.follow = true;
    begin(&p);
    dqw_estimator_q15 late = p.q;
    test_random r = {77};
    const journal *l = simulated(0.24);
    dqw_estimator_q15_block b;
    int waits = -1;
    bool taken = false;
    uint32_t blocks = 0;
    for (int k = 0; k < 12000; k++) {
        CASE("sample %d", k);
        const dqw_sample s = sample(l, k, 0.02, &r);
        const dqw_sample_q15 q = rounded(&s);
        if ((dqw_estimator_sample_q15(&p.q, &q, false) & DQW_EVENT_BLOCK) != 0)
            (void)dqw_estimator_background_q15(&p.q);
        if ((dqw_estimator_sample_q15(&late, &q, false) & DQW_EVENT_BLOCK) != 0) {
            taken = dqw_estimator_take_q15(&late, &b);
            HOLDS(taken == (k >= 39) && !late.window.over.pending && !dqw_estimator_take_q15(&late, &b));
            waits = (int)(random_bits(&r) % 20);
        }
        if (waits-- != 0 || !taken) continue;
        const bool judged = late.stage.name != DQW_STAGE_RANDOM;
        if (dqw_estimator_learn_q15(&late, &b) && judged) dqw_estimator_stage_on_q15(&late, true);
        HOLDS(learned_alike(&p.q, &late) && late.stage.name == p.q.stage.name &&
              late.elapsed == (blocks++ == 0 ? 2u : 1u));
    }
    HOLDS(p.q.blocks > 300 && blocks > 500);
    // Three halves are lost.
    for (int k = 0; k < 80; k++) {
        const dqw_sample s = sample(l, k, 0.02, &r);
        const dqw_sample_q15 q = rounded(&s);
        (void)dqw_estimator_sample_q15(&p.q, &q, false);
    }
    (void)dqw_estimator_background_q15(&p.q);
    for (int k = 80; k < 120; k++) {
        const dqw_sample s = sample(l, k, 0.02, &r);
        const dqw_sample_q15 q = rounded(&s);
        (void)dqw_estimator_sample_q15(&p.q, &q, false);
        if (k % 20 == 19) (void)dqw_estimator_background_q15(&p.q);
    }
    HOLDS(p.q.elapsed == 5 && p.q.missed == 3);
}

// Start values ten times too large or too small, or none: what is learned does not show them, and no weight leaves its
// bits.
static void test_start_values_are_no_prior(void)
{
    static const double factor[] = {1.0, 10.0, 0.1, 0.0};
    for (int way = 0; way < 8; way++) {
        const double f = factor[way % 4];
        pair p;
        configure(&p, 0.0, 0.0);
        p.qc.R_uohm = (uint32_t)(f * p.qc.R_uohm), p.qc.Ld_nH = (uint32_t)(f * p.qc.Ld_nH);
        p.qc.Lq_nH = (uint32_t)(f * p.qc.Lq_nH), p.qc.psi_nWb = (uint32_t)(f * p.qc.psi_nWb);
        if (way >= 4) p.qc.scale.pole_pairs = 0;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&p.q, &p.qc));
        test_random r = {130};
        for (long k = 0; k < 30000; k++) {
            const dqw_sample s = moving(k, 0.5, 0.01, &r);
            const dqw_sample_q15 q = rounded(&s);
            if (dqw_estimator_sample_q15(&p.q, &q, false) & DQW_EVENT_BLOCK) (void)dqw_estimator_background_q15(&p.q);
        }
        for (int i = 0; i < 4; i++) {
            CASE("start %g times the truth, pole pairs %s, %s", f, way >= 4 ? "found" : "given", NAME[i]);
            BETWEEN(-0.1, 100 * (q_value(&p, i) / TRUTH[i] - 1), 0.1);
            HOLDS(dqw_estimator_read_q15(&p.q, (enum dqw_parameter)i).usable);
        }
        HOLDS(p.q.restarts == 0 && p.q.pole_pairs == 4 && p.q.stage.name == DQW_STAGE_IN_SERVICE);
    }
}

// Of the full speed as much, whatever the pole pairs.
static dqw_sample_q15 turning(int k, double noise, test_random *r)
{
    dqw_sample s = moving(k, 0.5, noise, r);
    s.w_m_rad_s *= (float)(4 * W_FULL / 400.0);
    return rounded(&s);
}

static void shown(dqw_estimator_q15 *e, const dqw_sample_q15 *s)
{
    if (dqw_estimator_sample_q15(e, s, false) & DQW_EVENT_BLOCK) (void)dqw_estimator_background_q15(e);
}

// Pole pairs of a machine with the same electrical signals, found in time and not before; L_d, L_q, flux go on from
// there.
static void test_pole_pairs_are_found(void)
{
    static const int poles[] = {1, 2, 4, 15, 40};
    for (int n = 0; n < 5; n++)
        for (int noisy = 0; noisy < 3; noisy++) {
            pair p;
            configure(&p, 0.3, 0.0);
            p.qc.scale.pole_pairs = 0;
            p.qc.scale.w_full_mrad_s = (uint32_t)(400000 / poles[n]);
            TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&p.q, &p.qc));
            dqw_estimator_q15_config told = p.qc;
            told.scale.pole_pairs = (uint16_t)poles[n];
            static dqw_estimator_q15 given;
            TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&given, &told));
            test_random r = {(uint64_t)(300 + n)};
            int found = -1;
            for (int k = 0; k < 30000; k++) {
                const dqw_sample_q15 q = turning(k, noisy * 0.01, &r);
                shown(&p.q, &q);
                shown(&given, &q);
                CASE("%d pole pairs, noise %d, sample %d", poles[n], noisy, k);
                HOLDS(p.q.pole_pairs == 0 || p.q.pole_pairs == poles[n]);
                if (found >= 0 || p.q.pole_pairs == 0) continue;
                found = k;
                // All that was learned until now is there.
                for (int i = 0; i < 4; i++) BETWEEN(0.6, (double)p.q.cov_q40[i] / (double)given.cov_q40[i], 3.0);
                // And of what has its weight from now on, nothing.
                for (int i = 4; i < N; i++) BETWEEN(0.99, (double)p.q.cov_q40[i] / (double)given.cov_q40[i], 1.01);
            }
            BETWEEN(2000, found, noisy == 2 && poles[n] == 40 ? 30000 : 12000);
            for (int i = 0; i < 4; i++) {
                CASE("%d pole pairs, noise %d, %s", poles[n], noisy, NAME[i]);
                BETWEEN(-0.15, 100 * (q_value(&p, i) / TRUTH[i] - 1), 0.15);
            }
            HOLDS(p.q.restarts == 0);
        }
}

// So they are where dead time or an encoder's offset is learned as well, which have a weight only from then on.
static void test_pole_pairs_are_found_beside_what_waits_for_them(void)
{
    for (int offset = 0; offset < 2; offset++)
        for (int noisy = 0; noisy < 2; noisy++) {
            CASE("%s, noise %d", offset ? "encoder offset" : "dead time", noisy);
            pair p;
            configure(&p, 0.3, 0.0);
            p.qc.scale.pole_pairs = 0;
            p.qc.scale.w_full_mrad_s = 100000;
            p.qc.encoder_offset = offset == 1;
            p.qc.angle = offset == 0;
            p.qc.dead_time_width_mA = offset ? 0 : 100;
            TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&p.q, &p.qc));
            test_random r = {310};
            int found = -1;
            for (int k = 0; k < 30000; k++) {
                const dqw_sample_q15 q = turning(k, noisy * 0.01, &r);
                shown(&p.q, &q);
                HOLDS(p.q.pole_pairs == 0 || p.q.pole_pairs == 4);
                if (found < 0 && p.q.pole_pairs != 0) found = k;
                HOLDS(found < 0 || p.q.pole_pairs == 4);
            }
            BETWEEN(2000, found, 12000);
            for (int i = 0; i < 4; i++) BETWEEN(-0.3, 100 * (q_value(&p, i) / TRUTH[i] - 1), 0.3);
            HOLDS(p.q.restarts == 0);
        }
}

// Without the pole pairs settled rows tell R alone; with them all four, as least squares in double do.
static void test_settled_rows(void)
{
    static const double truth[] = {0.9, 2.2e-3, 2.8e-3, 0.12};
    for (int given = 0; given < 2; given++) {
        const dqw_estimator_q15_config c = {.scale = {.v_full_mV = 180000,
                                                      .i_full_mA = 15000,
                                                      .w_full_mrad_s = 250000,
                                                      .dt_ns = 1000,
                                                      .pole_pairs = given ? 4 : 0},
                                            .settled = true};
        pair p;
        p.qc = c;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&p.q, &p.qc));
        test_random r = {31};
        test_ls ls;
        ls_begin(&ls, 4, 0.0);
        int16_t *channel[5];
        for (int k = 0; k < 400; k++) {
            const double i_d = random_uniform(&r, -10, 10);
            const double i_q = random_uniform(&r, -10, 10);
            const double w_m = random_uniform(&r, -200, 200);
            const double w = 4 * w_m;
            const double e[] = {0.05 * random_normal(&r), 0.05 * random_normal(&r)};
            const double x_d[] = {i_d, 0, -w * i_q, 0};
            const double x_q[] = {i_q, w * i_d, 0, w};
            double v[] = {e[0], e[1]};
            for (int i = 0; i < 4; i++) v[0] += truth[i] * x_d[i], v[1] += truth[i] * x_q[i];
            ls_add(&ls, x_d, v[0]);
            ls_add(&ls, x_q, v[1]);
            dqw_sample_q15 s = {.v_d_q15 = q15(v[0], 180),
                                .v_q_q15 = q15(v[1], 180),
                                .i_d_q15 = q15(i_d, 15),
                                .i_q_q15 = q15(i_q, 15),
                                .w_m_q15 = q15(w_m, 250)};
            channel[0] = &s.v_d_q15;
            TEST_ASSERT_EQUAL_UINT32(DQW_EVENT_BLOCK, dqw_estimator_sample_q15(&p.q, &s, false));
            if (k == 100) {
                *channel[0] = INT16_MAX;
                TEST_ASSERT_EQUAL_UINT32(DQW_EVENT_SATURATED, dqw_estimator_sample_q15(&p.q, &s, false));
                *channel[0] = 0;
                TEST_ASSERT_EQUAL_UINT32(DQW_EVENT_MISSED, dqw_estimator_sample_q15(&p.q, &s, false));
            }
            HOLDS(dqw_estimator_background_q15(&p.q));
        }
        double best[LS_MAX];
        double inverse[LS_MAX][LS_MAX];
        (void)ls_solve(&ls, best, inverse);
        HOLDS(p.q.missed == 1 && p.q.gate.saturated == 1 && p.q.restarts == 0 &&
              dqw_estimator_voltage_acts_q15(&p.q) == DQW_VOLTAGE_NOT_KNOWN);
        for (int i = 0; i < 4; i++) {
            CASE("%s, pole pairs %d", NAME[i], given);
            if (i > 0 && !given) {
                HOLDS(isinf(q_sd(&p, i)) || q_sd(&p, i) > 1e37);
                continue;
            }
            // All rows count, those of stage 2 as well: what is left is the rounding of the signals, 0.05 deviations of
            // the noise.
            BETWEEN(-0.1, (q_value(&p, i) - best[i]) / (0.05 * sqrt(inverse[i][i])), 0.1);
            BETWEEN(0.8, q_sd(&p, i) / (0.05 * sqrt(inverse[i][i])), 1.3);
        }
    }
}

// The late voltage's gradient goes on around the weights that were solved: as if every row had been shown around them.
static void test_the_late_voltage_goes_on_around_what_was_solved(void)
{
    enum { LATE = DQW_PARAMETERS, SHOWN = 300 };
    pair p;
    configure(&p, 0.0, 0.0);
    begin(&p);
    test_random r = {91};
    static double x[SHOWN][LATE + 1];
    static double y[SHOWN];
    int32_t before[LATE];
    for (int i = 0; i < LATE; i++) before[i] = p.q.w_q24[i];
    for (int k = 0; k < SHOWN; k++) {
        int32_t x_q28[LATE + 1];
        y[k] = 0.02 * random_normal(&r);
        for (int i = 0; i <= LATE; i++) {
            // Alike: what the weights explain, the late voltage would too.
            x[k][i] = (i == LATE ? 0.5 * x[k][0] + 0.3 * x[k][3] : 0.0) + 0.2 * random_normal(&r);
            x_q28[i] = (int32_t)lrint(ldexp(x[k][i], 28));
            if (i < LATE) y[k] += 0.1 * (i + 1) * x[k][i];
        }
        dqw_normal_add_q15(&p.q.normal, x_q28, (int32_t)lrint(ldexp(y[k], 28)));
    }
    dqw_estimator_solve_q15(&p.q);
    double around = 0.0;
    double was = 0.0;
    for (int k = 0; k < SHOWN; k++) {
        double left = y[k];
        for (int i = 0; i < LATE; i++) left -= ldexp((double)p.q.w_q24[i] - before[i], -24) * x[k][i];
        around += x[k][LATE] * left;
        was += x[k][LATE] * y[k];
    }
    CASE("%g of %g, is %g", around, was, ldexp((double)p.q.normal.b_q32[LATE], -32));
    HOLDS(fabs(around) < 0.1 * fabs(was));
    BETWEEN(-0.002, (ldexp((double)p.q.normal.b_q32[LATE], -32) - around) / was, 0.002);
    for (int i = 0; i < LATE; i++) HOLDS(p.q.normal.b_q32[i] == 0);
}

// A voltage that acts a period after the sample it comes with, and one held in the stationary frame: said so, they are
// learned as well; not said, the motion tells. 4 pole pairs of 70 rad/s in 50 us turn by 0.014 rad.
static void test_when_the_voltage_acts(void)
{
    for (int way = 0; way < 16; way++) {
        const bool next = way & 1;
        const bool held = way & 2;
        const bool said = way & 4;
        const bool electrical = way & 8;
        pair p;
        configure(&p, 0.3, 0.0);
        p.qc.voltage_next = said == next;
        p.qc.voltage_held = held;
        p.qc.speed_electrical = electrical;
        if (electrical) p.qc.scale.w_full_mrad_s *= 4;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&p.q, &p.qc));
        test_random r = {41};
        for (long k = 0; k < 30000; k++) {
            dqw_sample s = moving(k, 0.5, 0.003, &r);
            const dqw_sample acts = moving(k + (next ? 1 : 0), 0.5, 0.003, &r);
            const double turn = held ? (next ? 1.5 : 0.5) * 4 * (double)s.w_m_rad_s * DT_S : 0.0;
            s.v_d_V = (float)(cos(turn) * (double)acts.v_d_V - sin(turn) * (double)acts.v_q_V);
            s.v_q_V = (float)(sin(turn) * (double)acts.v_d_V + cos(turn) * (double)acts.v_q_V);
            const dqw_sample_q15 q = rounded(&s);
            if (dqw_estimator_sample_q15(&p.q, &q, false) & DQW_EVENT_BLOCK) (void)dqw_estimator_background_q15(&p.q);
        }
        CASE("acts %s, held %d, said %d, electrical %d", next ? "next" : "now", held, said, electrical);
        HOLDS(dqw_estimator_voltage_acts_q15(&p.q) == (next ? DQW_VOLTAGE_NEXT : DQW_VOLTAGE_NOW));
        double worst = 0;
        for (int i = 0; i < 4; i++) worst = fmax(worst, 100 * fabs(q_value(&p, i) / TRUTH[i] - 1));
        BETWEEN(said ? 0.0 : 0.3, worst, said ? 0.1 : 40);
    }
}

// Begun again it has forgotten all that was learned, and every statistic of it; it starts where it is told to.
static void test_begun_again_it_has_forgotten(void)
{
    int32_t start[DQW_ESTIMATOR_Q15_INPUTS];
    for (int i = 0; i < DQW_ESTIMATOR_Q15_INPUTS; i++) start[i] = 1000 * (i + 1);
    for (int told = 0; told < 2; told++) {
        static pair fresh;
        static pair p;
        configure(&fresh, 0.3, 0.0);
        begin(&fresh);
        configure(&p, 0.3, 0.0);
        begin(&p);
        learn_log(&p, 0, 4000);
        HOLDS(p.q.blocks > 50 && p.q.error_q56[0] > 0 && p.q.recent_q54 > 0 && p.q.learned != 0);
        dqw_estimator_start_q15(&p.q, told ? start : NULL);
        TEST_ASSERT_EQUAL_MEMORY(told ? start : fresh.q.w_q24, p.q.w_q24, sizeof start[0] * DQW_PARAMETERS);
        TEST_ASSERT_EQUAL_MEMORY(fresh.q.cov_q40, p.q.cov_q40, sizeof p.q.cov_q40[0] * DQW_PARAMETERS);
        TEST_ASSERT_EQUAL_MEMORY(fresh.q.normal.a_q32, p.q.normal.a_q32, sizeof p.q.normal.a_q32);
        TEST_ASSERT_EQUAL_MEMORY(fresh.q.normal.b_q32, p.q.normal.b_q32, sizeof p.q.normal.b_q32);
        TEST_ASSERT_EQUAL_MEMORY(fresh.q.score2_q68, p.q.score2_q68, sizeof p.q.score2_q68);
        TEST_ASSERT_EQUAL_MEMORY(fresh.q.score_lag_q68, p.q.score_lag_q68, sizeof p.q.score_lag_q68);
        TEST_ASSERT_EQUAL_MEMORY(fresh.q.score_last_q34, p.q.score_last_q34, sizeof p.q.score_last_q34);
        TEST_ASSERT_EQUAL_MEMORY(fresh.q.excess_q10, p.q.excess_q10, sizeof p.q.excess_q10);
        HOLDS(p.q.normal.c_q32 == fresh.q.normal.c_q32 && p.q.normal.inputs == fresh.q.normal.inputs);
        HOLDS(p.q.error_q56[0] == 0 && p.q.error_q56[1] == 0 && p.q.recent_q54 == 0);
        HOLDS(p.q.blocks == 0 && p.q.learned == 0);
    }
}

// Defined anew it forgets what was learned; what was counted stays, and how often it went back, and why.
static void test_defined_anew_it_forgets_all_but_the_counts(void)
{
    static pair p;
    static pair fresh;
    configure(&p, 0.3, 0.0);
    begin(&p);
    configure(&fresh, 0.3, 0.0);
    fresh.qc.stale_limit = 33;
    begin(&fresh);
    learn_log(&p, 0, 4000);
    p.q.stage.back = DQW_BACK_LEFT_BAND;
    p.q.stage.times_back = 7;
    p.q.stage.residual_ppm = 12345;
    p.q.missed = 3;
    const dqw_gate gate = p.q.gate;
    const uint32_t halves = p.q.halves;
    TEST_ASSERT_EQUAL_INT(DQW_ERR_NULL, dqw_estimator_define_q15(NULL, &fresh.qc));
    TEST_ASSERT_EQUAL_INT(DQW_ERR_NULL, dqw_estimator_define_q15(&p.q, NULL));
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_define_q15(&p.q, &fresh.qc));
    HOLDS(p.q.stage.name == DQW_STAGE_RANDOM && p.q.stage.back == DQW_BACK_LEFT_BAND && p.q.stage.times_back == 7 &&
          p.q.stage.residual_ppm == 12345);
    HOLDS(p.q.gate.accepted == gate.accepted && p.q.gate.blocks == gate.blocks && p.q.gate.stale_limit == 33);
    HOLDS(p.q.halves == halves && p.q.number == halves && p.q.missed == 3);
    TEST_ASSERT_EQUAL_MEMORY(fresh.q.w_q24, p.q.w_q24, sizeof p.q.w_q24);
    TEST_ASSERT_EQUAL_MEMORY(fresh.q.normal.a_q32, p.q.normal.a_q32, sizeof p.q.normal.a_q32);
    HOLDS(p.q.blocks == 0 && p.q.learned == 0 && p.q.follow_q15 == 32768 && p.q.given.follow_q15 == 32768);
}

// A nominal value too small for a unit of its own counts in what is usual, and is what is read at first.
static void test_small_nominal_values_are_where_it_starts(void)
{
    pair p;
    configure(&p, 0.0, 0.0);
    p.qc.R_uohm = 10;
    p.qc.Ld_nH = 10;
    p.qc.Lq_nH = 12;
    p.qc.psi_nWb = 200;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&p.q, &p.qc));
    static const double nominal[] = {10e-6, 10e-9, 12e-9, 200e-9};
    for (int i = 0; i < 4; i++) {
        CASE("%s", NAME[i]);
        HOLDS(dqw_estimator_unit_q15(&p.qc, (enum dqw_parameter)i) > 1000);
        BETWEEN(0.99, q_value(&p, i) / nominal[i], 1.01);
    }
}

// Without nominal values: a tenth of the full voltage at full current, and at full speed; the flux half of it.
// A nominal value is the unit where at full scale it is 2^-17 to 8 full voltages, and an inductance's slope 2^12 at
// most; else the unit is a tenth of the full voltage, a half for the flux.
static void test_which_nominal_values_are_units(void)
{
    static const dqw_estimator_q15_config plain = {.scale = {10000, 10000, 10000, 100000, 1},
                                                   .R_uohm = 100000,
                                                   .Ld_nH = 1000000,
                                                   .Lq_nH = 1000000,
                                                   .psi_nWb = 50000000,
                                                   .half_window = 20};
    // At full scale: R one volt an ohm, an inductance 10 V/H of turning and 10 kV/H of slope, the flux 10 V/Wb.
    static const struct {
        int i;
        uint32_t nominal;
        bool settled, is_unit;
        double base;
    } cases[] = {{DQW_R, 7, false, false, 1e5},         {DQW_R, 8, false, true, 0},
                 {DQW_R, 7999990, false, true, 0},      {DQW_R, 8000010, false, false, 1e5},
                 {DQW_LD, 760, false, false, 1e7},      {DQW_LD, 766, false, true, 0},
                 {DQW_LQ, 409599000, false, true, 0},   {DQW_LQ, 409601000, false, false, 1e7},
                 {DQW_LQ, 409601000, true, true, 0},    {DQW_LD, 799999000, true, true, 0},
                 {DQW_LD, 800004000, true, false, 1e7}, {DQW_PSI, 7620, false, false, 5e8},
                 {DQW_PSI, 7640, false, true, 0},       {DQW_PSI, 4294967295u, false, true, 0}};
    for (unsigned k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        CASE("case %u", k);
        dqw_estimator_q15_config c = plain;
        c.settled = cases[k].settled;
        uint32_t *const nominal[] = {&c.R_uohm, &c.Ld_nH, &c.Lq_nH, &c.psi_nWb};
        *nominal[cases[k].i] = cases[k].nominal;
        dqw_units_q15 u;
        TEST_ASSERT_EQUAL_INT_MESSAGE(DQW_OK, dqw_units_of_q15(&c, 1, &u), test_case);
        const double unit = cases[k].is_unit ? cases[k].nominal : cases[k].base;
        BETWEEN(0.999999 * unit, u.si[cases[k].i], 1.000001 * unit);
        const double w = fmin(32, cases[k].nominal / unit) * 16777216;
        BETWEEN(w - 1, u.w_q24[cases[k].i], w + 1);
    }
}

static void test_units_without_nominal_values(void)
{
    for (int poles = 1; poles <= 7; poles += 3) {
        CASE("%d pole pairs", poles);
        const dqw_estimator_q15_config c = {
            .scale = {.v_full_mV = 24000, .i_full_mA = 10000, .w_full_mrad_s = 300000, .dt_ns = 50000}};
        dqw_estimator_q15_config told = c;
        told.scale.pole_pairs = (uint16_t)poles;
        const double turning = 300.0 * poles;
        const double L_nH = 1e9 * 0.1 * 24 / 10 / turning;
        BETWEEN(-1, dqw_estimator_unit_q15(&told, DQW_R) - 1e6 * 0.1 * 24 / 10, 1);
        BETWEEN(-1, dqw_estimator_unit_q15(&told, DQW_LD) - L_nH, 1);
        BETWEEN(-1, dqw_estimator_unit_q15(&told, DQW_LQ) - L_nH, 1);
        BETWEEN(-1, dqw_estimator_unit_q15(&told, DQW_PSI) - 1e9 * 0.5 * 24 / turning, 1);
        BETWEEN(-1, dqw_estimator_unit_q15(&told, DQW_PSI_Q) - 1e9 * 0.5 * 24 / turning, 1);
    }
}

// While pole pairs are sought, the two cross weights are reactances of the other axis: of L_d, and of L_q.
static void test_units_of_the_cross_weights(void)
{
    const dqw_estimator_q15_config c = {
        .scale = {.v_full_mV = 24000, .i_full_mA = 10000, .w_full_mrad_s = 300000, .dt_ns = 50000},
        .Ld_nH = 400000,
        .Lq_nH = 900000};
    dqw_estimator_q15 e;
    memset(&e, 0, sizeof e);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&e, &c));
    dqw_units_q15 u;
    (void)dqw_units_of_q15(&c, e.pole_pairs, &u);
    HOLDS(u.X_q40[1] > u.X_q40[0]);
    TEST_ASSERT_TRUE(u.X_q40[0] == dqw_estimator_whole_q40(&e, &u, DQW_DEAD_TIME));
    TEST_ASSERT_TRUE(u.X_q40[1] == dqw_estimator_whole_q40(&e, &u, DQW_PSI_Q));
    TEST_ASSERT_TRUE(u.psi_q40 == dqw_estimator_whole_q40(&e, &u, DQW_PSI));
}

// Both weights of dead time are counted in thirtieths of the full voltage once pole pairs are known.
static void test_units_of_dead_time(void)
{
    pair p;
    configure(&p, 0.3, 0.05);
    begin(&p);
    dqw_units_q15 u;
    (void)dqw_units_of_q15(&p.qc, p.q.pole_pairs, &u);
    for (int i = DQW_DEAD_TIME; i <= DQW_DEAD_CONSTANT; i += DQW_DEAD_CONSTANT - DQW_DEAD_TIME)
        BETWEEN(1 / 30.0 - 1e-9, ldexp((double)dqw_estimator_whole_q40(&p.q, &u, i), -40), 1 / 30.0 + 1e-9);
}

// Of a sample all is kept for the next pair; its voltage may be another one's.
static void test_a_sample_is_kept_whole(void)
{
    for (int next = 0; next < 2; next++) {
        pair p;
        configure(&p, 0.3, 0.0);
        p.qc.voltage_next = next == 1;
        begin(&p);
        const dqw_sample_q15 s = {.v_d_q15 = 100,
                                  .v_q_q15 = 200,
                                  .i_d_q15 = 300,
                                  .i_q_q15 = 400,
                                  .w_m_q15 = 500,
                                  .cosine_q15 = 32000,
                                  .sine_q15 = 600,
                                  .temp_winding_cC = 700,
                                  .temp_magnet_cC = 800,
                                  .resting = 5};
        (void)dqw_estimator_sample_q15(&p.q, &s, false);
        const dqw_sample_q15 *l = &p.q.last;
        CASE("next %d", next);
        HOLDS(next == 1 || (l->v_d_q15 == 100 && l->v_q_q15 == 200 && l->resting == 5));
        HOLDS(l->i_d_q15 == 300 && l->i_q_q15 == 400 && l->w_m_q15 == 500);
        HOLDS(l->cosine_q15 == 32000 && l->sine_q15 == 600);
        HOLDS(l->temp_winding_cC == 700 && l->temp_magnet_cC == 800);
    }
}

// One sample that did not come is one that was refused.
static void test_one_missing_sample_is_a_refused_one(void)
{
    pair missing;
    pair refused;
    configure(&missing, 0.3, 0.0);
    begin(&missing);
    configure(&refused, 0.3, 0.0);
    begin(&refused);
    int gaps = 0;
    for (long k = 0; k < 1000; k++) {
        const dqw_sample s = moving(k, 0.5, 0.0, NULL);
        const dqw_sample_q15 q = rounded(&s);
        const bool gap = k % 37 == 36;
        gaps += gap;
        (void)dqw_estimator_sample_q15(&refused.q, &q, gap);
        if (gap)
            dqw_estimator_missing_q15(&missing.q, 1);
        else
            (void)dqw_estimator_sample_q15(&missing.q, &q, false);
        (void)dqw_estimator_background_q15(&missing.q);
        (void)dqw_estimator_background_q15(&refused.q);
        CASE("sample %ld", k);
        HOLDS(missing.q.halves == refused.q.halves);
        TEST_ASSERT_EQUAL_MEMORY(&refused.q.window, &missing.q.window, sizeof missing.q.window);
    }
    HOLDS(missing.q.halves > 40 && missing.q.blocks == refused.q.blocks);
    HOLDS((int)missing.q.gate.nonfinite == gaps && (int)refused.q.gate.saturated == gaps);
}

// A part of the full voltage in millionths, rounded down.
static void test_recent_residual_in_millionths(void)
{
    pair p;
    configure(&p, 0.0, 0.0);
    begin(&p);
    for (int bits = 0; bits <= 31; bits++) {
        CASE("2^%d", bits);
        p.q.recent_q54 = (int64_t)1 << (2 * bits);
        HOLDS(dqw_estimator_recent_ppm_q15(&p.q) == (uint32_t)floor(ldexp(1e6, bits - 27)));
    }
}

// How large a parameter is, for what it may change by: itself; dead time one of its units, a thirtieth of the full
// voltage, the flux on the other axis as the flux. (E105)
static void test_how_large_a_parameter_is(void)
{
    for (int has = 0; has < 2; has++) {
        pair p;
        configure(&p, 0.0, has ? 0.05 : 0.0);
        begin(&p);
        for (int i = 0; i < N; i++) p.q.w_q24[i] = (i % 2 ? -5000 : 3000) * (i + 1);
        for (int i = 0; i < N; i++) {
            CASE("has %d, weight %d", has, i);
            const int32_t w = p.q.w_q24[has && i == DQW_PSI_Q ? DQW_PSI : i];
            HOLDS(dqw_estimator_size_q24(&p.q, i) == (has && i == DQW_DEAD_TIME ? 16777216 : abs(w)));
        }
    }
}

// Without lent memory stage 2 takes fifty blocks. (E93)
static void test_stage_two_takes_fifty_blocks(void)
{
    pair p;
    configure(&p, 0.0, 0.0);
    begin(&p);
    for (long k = 0; k < 2000 && p.q.stage.name == DQW_STAGE_RANDOM; k++) {
        const dqw_sample s = moving(k, 0.5, 0.0, NULL);
        (void)step(&p, &s);
        HOLDS((p.q.stage.name == DQW_STAGE_RANDOM) == (p.q.blocks < 50));
    }
    TEST_ASSERT_EQUAL_INT(DQW_STAGE_ORDINAL, p.q.stage.name);
}

// A late voltage is a row's of whole blocks alone, where the pole pairs are known: others lack parts of its step. (E90)
static void test_a_late_voltage_is_of_whole_blocks(void)
{
    for (int way = 0; way < 8; way++) {
        pair p;
        configure(&p, 0.0, 0.0);
        if (way & 1) p.qc.scale.pole_pairs = 0;
        p.qc.settled = (way & 2) != 0;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&p.q, &p.qc));
        dqw_estimator_q15_block b = {.weight = 420, .v_step_q15 = {4200, -8400}, .whole = (way & 4) != 0};
        b.with.rows = 8192;
        dqw_rows_q15 r;
        dqw_estimator_rows_of_q15(&p.q, &b, &r);
        CASE("way %d", way);
        const double known = way == 4 ? 1.0 : 0.0;
        BETWEEN(-1e-8, ldexp(r.late_q28[0], -28) - known * 10.0 / 32768, 1e-8);
        BETWEEN(-1e-8, ldexp(r.late_q28[1], -28) + known * 20.0 / 32768, 1e-8);
    }
}

// A block of one row is that row, to the last place.
static void test_a_settled_row_is_exact(void)
{
    test_random r = {78};
    for (int n = 0; n < 1000; n++) {
        dqw_sample_q15 s = {0};
        int16_t *const x[] = {&s.v_d_q15, &s.v_q_q15, &s.i_d_q15, &s.i_q_q15, &s.w_m_q15};
        for (int i = 0; i < 5; i++) *x[i] = (int16_t)((int)(random_bits(&r) % 65533) - 32766);
        int32_t row[DQW_BLOCK_Q15_SIGNALS];
        dqw_model_pair_q15(&s, &s, row);
        const dqw_block_q15 b = dqw_model_block_q15(row, 1);
        HOLDS(b.v_d == s.v_d_q15 * 8192 && b.v_q == s.v_q_q15 * 8192 && b.i_d == s.i_d_q15 * 8192 &&
              b.i_q == s.i_q_q15 * 8192 && b.w_m == s.w_m_q15 * 8192 && b.di_d == 0 && b.di_q == 0);
    }
}

// It is told from fifty blocks on, however well they tell it.
static void test_when_the_voltage_acts_takes_fifty_blocks(void)
{
    pair p;
    configure(&p, 0.0, 0.0);
    begin(&p);
    int told_at = 0;
    for (long k = 0; k < 2000 && told_at == 0; k++) {
        const dqw_sample s = moving(k, 0.5, 0.0, NULL);
        (void)step(&p, &s);
        if (dqw_estimator_voltage_acts_q15(&p.q) == DQW_VOLTAGE_NOT_KNOWN) continue;
        HOLDS(dqw_estimator_voltage_acts_q15(&p.q) == DQW_VOLTAGE_NOW);
        told_at = p.q.blocks;
    }
    TEST_ASSERT_EQUAL_INT(50, told_at);
}

// What noise of the currents makes of dead time's and R's equations, (E60), in double.
static void test_noise_in_dead_time(void)
{
    pair p;
    configure(&p, 0.0, 0.8);
    begin(&p);
    const double sd[2] = {0.02, 0.005};  // of the full current
    const double slope = 0.6 / (0.8 / I_FULL);
    dqw_estimator_q15_block b = {
        .weight = 420,
        .with = {.rows = 8192, .slopes = 1000, .slope_q15 = (uint32_t)(0.6 * 32768 * 1000), .follow_q15 = 20000}};
    for (int axis = 0; axis < 2; axis++)
        b.with.noise_q30[axis] = (int64_t)(-2 * sd[axis] * sd[axis] * 8192 * 1073741824.0);
    dqw_rows_q15 r;
    dqw_estimator_rows_of_q15(&p.q, &b, &r);
    const double h = 20;
    const double mean = (h * (4 * h * h - 1) / 6 + h * h) / (h * h * (h + 1) * (h + 1));
    const double R = TRUTH[0] * I_FULL / V_FULL;
    const double follow = 20000 / 32768.0;
    const double width = 0.8 / I_FULL;
    for (int axis = 0; axis < 2; axis++) {
        CASE("axis %d", axis);
        const double var = sd[axis] * sd[axis];
        const double left = var * follow / (2 - follow);
        const double wide = 0.53 / (sqrt(left) + 1.2 * width);
        const double g = mean * slope / 30;
        BETWEEN(0.999, ldexp((double)r.noise_q56[axis][DQW_NOISE_Q15_R_IN_DEAD], -56) / (g * R * var), 1.001);
        BETWEEN(0.999,
                ldexp((double)r.noise_q56[axis][DQW_NOISE_Q15_DEAD_IN_R], -56) /
                    (g * R * (var - 0.5 * left * sqrt(left) / (sqrt(left) + width))),
                1.001);
        BETWEEN(0.999, ldexp((double)r.noise_q56[axis][DQW_DEAD_TIME], -56) / (g * var * fmax(slope, wide) / 30),
                1.001);
        BETWEEN(0.999, ldexp((double)r.noise_q56[axis][DQW_R], -56) / (mean * R * R * var), 1.001);
    }
}

// A half is handed over with the angle of its last sample: 0 and 0 where that one was refused, or none is given.
static void test_a_half_carries_its_angle(void)
{
    for (int way = 0; way < 4; way++) {
        const bool angle = way & 1;
        const bool refused = way & 2;
        CASE("angle %d, refused %d", angle, refused);
        pair p;
        configure(&p, 0.0, angle ? 0.05 : 0.0);
        begin(&p);
        dqw_sample_q15 q = {0};
        for (int k = 0; k < 20; k++) {
            dqw_sample s = moving(k, 0.5, 0.0, NULL);
            s.cosine = (float)cos(0.1 * k);
            s.sine = (float)sin(0.1 * k);
            q = rounded(&s);
            const uint32_t event = dqw_estimator_sample_q15(&p.q, &q, refused && k == 19);
            HOLDS(((event & DQW_EVENT_BLOCK) != 0) == (k == 19));
        }
        const bool known = angle && !refused;
        HOLDS(p.q.handed.cosine_q15 == (known ? q.cosine_q15 : 0) && p.q.handed.sine_q15 == (known ? q.sine_q15 : 0));
        HOLDS(p.q.handed.number == 1);
    }
}

// What goes with a block: its weight, the step of the voltage between its halves, the angle at its middle, its number.
static void test_what_goes_with_a_block(void)
{
    enum { HALF = 20, MOST = 4000 };
    static dqw_sample_q15 s[MOST];
    static bool good[MOST];
    pair p;
    configure(&p, 0.0, 0.05);
    begin(&p);
    test_random r = {77};
    uint32_t incomplete = 0;
    int blocks = 0;
    for (int k = 0; k < MOST; k++) {
        const bool rough = k / 500 % 2 == 1;
        s[k].v_d_q15 = (int16_t)(random_bits(&r) % 60000 - 30000);
        s[k].v_q_q15 = (int16_t)(random_bits(&r) % 60000 - 30000);
        const double theta = random_uniform(&r, -PI, PI);
        s[k].cosine_q15 = (int16_t)lrint(32767 * cos(theta));
        s[k].sine_q15 = (int16_t)lrint(32767 * sin(theta));
        s[k].i_d_q15 = (int16_t)(k % 1000);
        good[k] = !(rough && random_bits(&r) % 100 < 14);
        if ((dqw_estimator_sample_q15(&p.q, &s[k], !good[k]) & DQW_EVENT_BLOCK) == 0) continue;
        dqw_estimator_q15_block b;
        const bool taken = dqw_estimator_take_q15(&p.q, &b);
        CASE("sample %d", k);
        HOLDS((k + 1) % HALF == 0 && (k + 1 >= 2 * HALF || !taken));
        if (k + 1 < 2 * HALF) continue;
        int64_t sum = 0;
        int32_t step_q15[2] = {0};
        int weight = 0;
        int valid = 0;
        for (int j = 1; j <= 2 * HALF; j++) {
            const int at = k - 2 * HALF + j;
            if (at == 0 || !good[at] || !good[at - 1]) continue;
            const int w = j <= HALF ? j : 2 * HALF + 1 - j;
            const int sign = j <= HALF ? -1 : 1;
            step_q15[0] += sign * s[at - 1].v_d_q15;
            step_q15[1] += sign * s[at - 1].v_q_q15;
            sum += w * s[at - 1].v_d_q15;
            weight += w;
            valid++;
        }
        HOLDS(taken == (4 * valid >= 3 * 2 * HALF));
        incomplete += !taken;
        HOLDS(p.q.gate.incomplete == incomplete);
        if (!taken) continue;
        blocks++;
        HOLDS(b.weight == weight && b.whole == (valid == 2 * HALF));
        HOLDS(b.v_step_q15[0] == step_q15[0] && b.v_step_q15[1] == step_q15[1]);
        BETWEEN(-1e-6, ldexp(dqw_estimator_means_q15(&b).v_d, -28) - ldexp((double)sum / weight, -15), 1e-6);
        const int middle = k - HALF;
        HOLDS(b.with.cosine_q15 == (good[middle] ? s[middle].cosine_q15 : 0) &&
              b.with.sine_q15 == (good[middle] ? s[middle].sine_q15 : 0));
        HOLDS(p.q.number == (uint32_t)((k + 1) / HALF) && b.with.number == p.q.number);
    }
    HOLDS(blocks > 100 && incomplete > 10);
}

// The Random Learner's rows are volts: inputs up to the full one, weights up to sixteen units.
static void test_what_stage_two_can_hold(void)
{
    static dqw_estimator_random_q15 lent;
    static const struct {
        double input, weight;
    } ways[] = {{0.99, 1.5}, {0.1, 15.0}};
    for (int way = 0; way < 2; way++) {
        dqw_estimator_random_init_q15(&lent);
        int32_t w_q24[DQW_LEARNER_INPUTS_Q15] = {0};
        test_random r = {131};
        bool done = false;
        for (int n = 0; n < 4000 && !done; n++)
            for (int axis = 0; axis < 2; axis++) {
                int32_t x_q28[DQW_LEARNER_INPUTS_Q15];
                double y = 0.0;
                for (int i = 0; i < DQW_LEARNER_INPUTS_Q15; i++) {
                    const double x = ways[way].input * random_uniform(&r, -1, 1);
                    x_q28[i] = (int32_t)lrint(ldexp(x, 28));
                    y += ways[way].weight * (i % 2 ? 1.0 : 0.8) * x;
                }
                done = lent.learn(&lent, x_q28, (int32_t)lrint(ldexp(y, 28)), axis == 0 ? NULL : w_q24);
            }
        HOLDS(done);
        for (int i = 0; i < DQW_LEARNER_INPUTS_Q15; i++) {
            CASE("way %d, weight %d", way, i);
            BETWEEN(0.95, ldexp(w_q24[i], -24) / (ways[way].weight * (i % 2 ? 1.0 : 0.8)), 1.05);
        }
    }
}

// What a motion never shows stays where it started.
static void test_stage_two_leaves_what_it_does_not_see(void)
{
    static dqw_estimator_random_q15 lent;
    dqw_estimator_random_init_q15(&lent);
    int32_t w_q24[DQW_LEARNER_INPUTS_Q15];
    for (int i = 0; i < DQW_LEARNER_INPUTS_Q15; i++) w_q24[i] = 12345678 + i;
    test_random r = {132};
    bool done = false;
    for (int n = 0; n < 4000 && !done; n++)
        for (int axis = 0; axis < 2; axis++) {
            int32_t x_q28[DQW_LEARNER_INPUTS_Q15] = {0};
            x_q28[DQW_R] = (int32_t)lrint(ldexp(random_uniform(&r, -0.9, 0.9), 28));
            done = lent.learn(&lent, x_q28, 2 * x_q28[DQW_R], axis == 0 ? NULL : w_q24);
        }
    HOLDS(done);
    BETWEEN(1.98, ldexp(w_q24[DQW_R], -24), 2.02);
    for (int i = 1; i < DQW_LEARNER_INPUTS_Q15; i++) HOLDS(w_q24[i] == 12345678 + i);
}

// Stage 2 with lent memory: the Random Learner alone, then learning begins from its weights, which are near.
static void test_stage_two_with_lent_memory(void)
{
    static dqw_estimator_random_q15 lent;
    pair p;
    configure(&p, 0.0, 0.0);
    p.qc.R_uohm = p.qc.Ld_nH = p.qc.Lq_nH = p.qc.psi_nWb = 0;
    p.qc.random = &lent;
    dqw_estimator_random_init_q15(&lent);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&p.q, &p.qc));
    test_random r = {130};
    bool began = false;
    for (long k = 0; k < 40000; k++) {
        const dqw_sample s = moving(k, 0.5, 0.01, &r);
        const dqw_sample_q15 q = rounded(&s);
        if (dqw_estimator_sample_q15(&p.q, &q, false) & DQW_EVENT_BLOCK) (void)dqw_estimator_background_q15(&p.q);
        if (p.q.stage.name == DQW_STAGE_RANDOM) HOLDS(p.q.blocks == 0);
        if (p.q.stage.name == DQW_STAGE_RANDOM || began) continue;
        began = true;
        for (int i = 0; i < 4; i++) {
            CASE("%s, as the Random Learner found it", NAME[i]);
            BETWEEN(-3, 100 * (q_value(&p, i) / TRUTH[i] - 1), 3);  // 0.7
        }
    }
    HOLDS(began && p.q.stage.name == DQW_STAGE_IN_SERVICE);
    for (int i = 0; i < 4; i++) BETWEEN(-0.1, 100 * (q_value(&p, i) / TRUTH[i] - 1), 0.1);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_names_the_field_and_leaves_the_object_alone);
    RUN_TEST(test_each_axis_takes_its_own_step);
    RUN_TEST(test_a_nameplate_is_enough);
    RUN_TEST(test_fresh_estimator_has_the_nominal_values_and_knows_nothing);
    RUN_TEST(test_time_alone_makes_nobody_less_sure);
    RUN_TEST(test_a_full_count_of_blocks_still_learns);
    RUN_TEST(test_a_held_vector_is_turned_and_shortened);
    RUN_TEST(test_a_voltage_beyond_the_scale);
    RUN_TEST(test_what_repeats);
    RUN_TEST(test_noise_is_not_measured_across_a_refused_sample);
    RUN_TEST(test_bursts_of_bad_samples_are_counted_and_harmless);
    RUN_TEST(test_late_backgrounds_and_gaps);
    RUN_TEST(test_any_bits);
    RUN_TEST(test_weights_out_of_bounds_begin_again);
    RUN_TEST(test_a_background_that_is_interrupted_learns_the_same);
    RUN_TEST(test_start_values_are_no_prior);
    RUN_TEST(test_pole_pairs_are_found);
    RUN_TEST(test_pole_pairs_are_found_beside_what_waits_for_them);
    RUN_TEST(test_settled_rows);
    RUN_TEST(test_the_late_voltage_goes_on_around_what_was_solved);
    RUN_TEST(test_when_the_voltage_acts);
    RUN_TEST(test_begun_again_it_has_forgotten);
    RUN_TEST(test_defined_anew_it_forgets_all_but_the_counts);
    RUN_TEST(test_small_nominal_values_are_where_it_starts);
    RUN_TEST(test_which_nominal_values_are_units);
    RUN_TEST(test_units_without_nominal_values);
    RUN_TEST(test_units_of_the_cross_weights);
    RUN_TEST(test_units_of_dead_time);
    RUN_TEST(test_a_sample_is_kept_whole);
    RUN_TEST(test_one_missing_sample_is_a_refused_one);
    RUN_TEST(test_recent_residual_in_millionths);
    RUN_TEST(test_how_large_a_parameter_is);
    RUN_TEST(test_stage_two_takes_fifty_blocks);
    RUN_TEST(test_a_late_voltage_is_of_whole_blocks);
    RUN_TEST(test_a_settled_row_is_exact);
    RUN_TEST(test_when_the_voltage_acts_takes_fifty_blocks);
    RUN_TEST(test_noise_in_dead_time);
    RUN_TEST(test_a_half_carries_its_angle);
    RUN_TEST(test_what_goes_with_a_block);
    RUN_TEST(test_what_stage_two_can_hold);
    RUN_TEST(test_stage_two_leaves_what_it_does_not_see);
    RUN_TEST(test_stage_two_with_lent_memory);
    return UNITY_END();
}
