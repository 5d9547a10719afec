// The fixed-point tracker by itself: refusals, bad samples, late backgrounds, gaps, any bits, weights out of bounds.
#include "twin_tracker.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

static void test_init_refuses_and_leaves_the_object_alone(void)
{
    pair p;
    configure(&p, 0.0, 0.05, 0.01);
    dqw_tracker_q15 t;
    TEST_ASSERT_EQUAL_INT(DQW_ERR_NULL, dqw_tracker_init_q15(NULL, &p.qc));
    REFUSED(t, DQW_ERR_NULL, dqw_tracker_init_q15(&t, NULL));
    static const dqw_tracker_q15_config zero = {.half_window = 0};
    REFUSED(t, DQW_ERR_RANGE, dqw_tracker_init_q15(&t, &zero));
    const dqw_tracker_q15_config good = p.qc;
    uint32_t *const must[] = {&p.qc.R_uohm, &p.qc.Ld_nH, &p.qc.Lq_nH, &p.qc.psi_nWb, &p.qc.scale.v_full_mV, &p.qc.scale.dt_ns};
    for (int i = 0; i < 6; i++) {
        CASE("field %d", i);
        p.qc = good;
        *must[i] = 0;
        REFUSED(t, DQW_ERR_RANGE, dqw_tracker_init_q15(&t, &p.qc));
        *must[i] = UINT32_MAX;
        REFUSED(t, DQW_ERR_RANGE, dqw_tracker_init_q15(&t, &p.qc));
    }
    p.qc = good;
    p.qc.scale.pole_pairs = 0;
    REFUSED(t, DQW_ERR_RANGE, dqw_tracker_init_q15(&t, &p.qc));
    p.qc = good;
    p.qc.drift_ppm = 1000001;
    REFUSED(t, DQW_ERR_RANGE, dqw_tracker_init_q15(&t, &p.qc));
    p.qc = good;
    p.qc.excitation_q15 = 32767;
    REFUSED(t, DQW_ERR_RANGE, dqw_tracker_init_q15(&t, &p.qc));
    p.qc = good;
    p.qc.half_window = 101;
    REFUSED(t, DQW_ERR_SIZE, dqw_tracker_init_q15(&t, &p.qc));
    p.qc = good;
    p.qc.dead_time_width_mA = 1;
    REFUSED(t, DQW_ERR_RANGE, dqw_tracker_init_q15(&t, &p.qc));
    p.qc.angle = false;  // without the angle there is no dead time to learn
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_tracker_init_q15(&t, &p.qc));
}

static void test_fresh_tracker_has_the_nominal_values_and_knows_nothing(void)
{
    pair p;
    configure(&p, 0.3, 0.05, 0.0);
    begin(&p);
    for (int i = 0; i < N; i++) {
        CASE("%s", NAME[i]);
        BETWEEN(-1e-6, q_value(&p, i) - f_value(&p, i), 1e-6);
        HOLDS(isinf(q_sd(&p, i)));
    }
    const enum dqw_tracker_weight_q15 none = DQW_TRACK_Q15_WEIGHTS;
    HOLDS(dqw_tracker_value_q15(&p.q, none) == INT32_MAX && dqw_tracker_sd_q15(&p.q, none) == INT32_MAX && dqw_tracker_unit_q15(&p.qc, none) == 0);
}

// A burst of bad samples amid good ones: counted one by one, and the result is as good as without.
static void test_bursts_of_bad_samples_are_counted_and_harmless(void)
{
    const journal *l = simulated(0.0);
    double undisturbed[4] = {0};
    for (int kind = -1; kind < 4; kind++) {
        CASE("kind %d", kind);
        pair p;
        configure(&p, 0.3, 0.0, 0.0);
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
            const uint32_t e = dqw_tracker_sample_q15(&p.q, &s, burst && kind == 3);
            events[0] += (e & DQW_EVENT_SATURATED) != 0;
            events[1] += (e & DQW_EVENT_STALE) != 0;
            if (e & DQW_EVENT_LEARNED) (void)dqw_tracker_learn_q15(&p.q);
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

// Blocks that come while one waits are lost, and counted; gaps are not spanned, and carry time.
static void test_late_backgrounds_and_gaps(void)
{
    for (int every = 2; every <= 4; every++) {
        pair p;
        configure(&p, 0.3, 0.0, 0.0);
        begin(&p);
        uint32_t offered = 0;
        uint32_t taken = 0;
        for (long k = 0; k < 20000; k++) {
            CASE("background every %d halves, sample %ld", every, k);
            const dqw_sample s = moving(k, 0.5, 0.01, &(test_random){(uint64_t)k});
            const dqw_sample_q15 q = rounded(&s);
            int32_t waits[DQW_TRACK_Q15_SIGNALS];
            const bool waited = p.q.pending;
            memcpy(waits, p.q.block, sizeof waits);
            offered += (dqw_tracker_sample_q15(&p.q, &q, false) & DQW_EVENT_LEARNED) != 0;
            if (waited) HOLDS(memcmp(waits, p.q.block, sizeof waits) == 0);
            if (k % (every * 20) != every * 20 - 1) continue;
            taken += p.q.pending;
            (void)dqw_tracker_learn_q15(&p.q);
            HOLDS(!p.q.pending);
        }
        const uint32_t lost = offered - taken - p.q.pending;
        HOLDS(p.q.missed == (lost < UINT8_MAX ? lost : UINT8_MAX) && lost > 100);
        for (int i = 0; i < 4; i++) BETWEEN(-0.5, 100 * (q_value(&p, i) / TRUTH[i] - 1), 0.5);
    }
    pair p;
    configure(&p, 0.3, 0.0, 0.0);
    begin(&p);
    int since = 0;
    test_random r = {120};
    for (long k = 0; k < 30000; k++) {
        if (since >= 317) {
            k += 1 + (long)(random_bits(&r) % 200);
            since = 0;
            dqw_tracker_gap_q15(&p.q, 0);
        }
        since++;
        CASE("sample %ld, %d after a gap", k, since);
        const dqw_sample s = moving(k, 0.5, 0.0, NULL);
        const dqw_sample_q15 q = rounded(&s);
        const bool block = (dqw_tracker_sample_q15(&p.q, &q, false) & DQW_EVENT_LEARNED) != 0;
        HOLDS(block == (since >= 40 && since % 20 == 0));
        if (block) (void)dqw_tracker_learn_q15(&p.q);
    }
    for (int i = 0; i < 4; i++) BETWEEN(-0.05, 100 * (q_value(&p, i) / TRUTH[i] - 1), 0.05);
    const uint32_t halves = p.q.halves;
    dqw_tracker_gap_q15(&p.q, 2000);
    BETWEEN(100, p.q.halves - halves, 101);
}

// Whatever comes: no overflow, which the sanitizers would see; weights stay within their bound, and what is learned is bounded below.
static void test_any_bits(void)
{
    for (int way = 0; way < 8; way++) {
        pair p;
        configure(&p, way & 1 ? 0.9 : -0.9, way & 2 ? 0.05 : 0.0, way & 4 ? 1.0 : 0.0);
        p.qc.half_window = (uint8_t)(way % 3 == 0 ? 1 : way % 3 == 1 ? 100 : 7);
        begin(&p);
        test_random r = {(uint64_t)(500 + way)};
        for (int k = 0; k < scaled(200000); k++) {
            const uint64_t z = random_bits(&r);
            const bool mild = k / 5000 % 2 == 0;
            dqw_sample_q15 s = dqw_sample_from_dq_q15((int16_t)(z & 65535), (int16_t)(z >> 16 & 65535), 0, 0, 0, (uint16_t)(z >> 7 & 65535));
            s.i_d_q15 = (int16_t)(z >> 32 & 65535), s.i_q_q15 = (int16_t)(z >> 48 & 65535), s.w_m_q15 = (int16_t)(random_bits(&r) & 65535);
            if (mild) s.v_d_q15 /= 64, s.i_q_q15 /= 1024, s.w_m_q15 /= 4;
            if (k % 30011 == 30010) dqw_tracker_gap_q15(&p.q, (uint32_t)z);
            if (dqw_tracker_sample_q15(&p.q, &s, false) & DQW_EVENT_LEARNED) (void)dqw_tracker_learn_q15(&p.q);
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
    configure(&p, 0.0, 0.0, 0.0);
    begin(&p);
    test_random r = {130};
    for (long k = 0; k < 20000; k++) {
        const dqw_sample s = moving(k, 0.5, 0.01, &r);
        if (k == 10000) p.q.w_q24[DQW_TRACK_PSI_Q_Q15] = -(1 << 30);
        (void)step(&p, &s);
    }
    TEST_ASSERT_EQUAL_UINT32(1, p.q.restarts);
    for (int i = 0; i < 4; i++) BETWEEN(-0.5, 100 * (q_value(&p, i) / TRUTH[i] - 1), 0.5);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_and_leaves_the_object_alone);
    RUN_TEST(test_fresh_tracker_has_the_nominal_values_and_knows_nothing);
    RUN_TEST(test_bursts_of_bad_samples_are_counted_and_harmless);
    RUN_TEST(test_late_backgrounds_and_gaps);
    RUN_TEST(test_any_bits);
    RUN_TEST(test_weights_out_of_bounds_begin_again);
    return UNITY_END();
}
