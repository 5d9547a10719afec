// What a monitor knows as healthy, over a power cycle: refused where it is not this machine's, told where the machine
// has changed meanwhile, and not where it is only warmer or colder.
#include <stddef.h>

#include "dqw_number.h"
#include "watched_joint.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

// All that was learned as healthy comes back: each value as it was, whichever it was.
static void every_value_comes_back(const dqw_monitor *m)
{
    dqw_monitor kept = *m;
    float next = 1000;
    for (int i = 0; i < DQW_WATCH_OFFSET; i++) kept.healthy.weight[i] = next++;
    for (int i = 0; i < DQW_WITNESS_INPUTS; i++) {
        kept.healthy.re[i] = next++;
        kept.healthy.im[i] = next++;
    }
    kept.healthy.cold_R_ohm = next++;
    kept.healthy.cold_psi_Wb = next++;
    kept.healthy.hottest_K = next++;
    kept.healthy.residual_pu2 = next++;
    kept.healthy.friction_Nm = next++;
    for (int i = 0; i < DQW_WATCH_TEMPERATURE; i++) kept.watch.looks[i] = (uint8_t)(100 + i);
    dqw_monitor_stored flash;
    HOLDS(dqw_monitor_store(&kept, &flash));
    dqw_monitor back;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_monitor_init(&back, m->config));
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_monitor_restore(&back, &flash));
    TEST_ASSERT_EQUAL_MEMORY(kept.healthy.weight, back.healthy.weight, sizeof kept.healthy.weight);
    TEST_ASSERT_EQUAL_MEMORY(kept.healthy.re, back.healthy.re, sizeof kept.healthy.re);
    TEST_ASSERT_EQUAL_MEMORY(kept.healthy.im, back.healthy.im, sizeof kept.healthy.im);
    HOLDS(back.healthy.cold_R_ohm == kept.healthy.cold_R_ohm);
    HOLDS(back.healthy.cold_psi_Wb == kept.healthy.cold_psi_Wb);
    HOLDS(back.healthy.hottest_K == kept.healthy.hottest_K);
    HOLDS(back.healthy.residual_pu2 == kept.healthy.residual_pu2);
    HOLDS(back.healthy.friction_Nm == kept.healthy.friction_Nm);
    TEST_ASSERT_EQUAL_MEMORY(kept.watch.looks, back.watch.looks, sizeof kept.watch.looks);
}

static dqw_monitor_stored healthy;

// A healthy joint's, taken at 2.6 s.
static const dqw_monitor_stored *stored(void)
{
    if (healthy.version != 0) return &healthy;
    const dqw_sim_scenario s = joint(2.6);
    simulate(&s);
    const dqw_monitor_config c = config_of();
    dqw_monitor m = begin(&c);
    dqw_monitor_stored untouched;
    memset(&untouched, 0x5a, sizeof untouched);
    // Not before its healthy values stand.
    double at_s = 0.0;
    for (int k = 0; k < row_count; k += 200) {
        const course o = watch(&m, k, k + 200);
        HOLDS(o.events == 0);
        dqw_monitor_stored now;
        memset(&now, 0x5a, sizeof now);
        if (dqw_monitor_store(&m, &now)) {
            if (at_s == 0.0) at_s = k * DT_S;
            HOLDS(now.looks[DQW_WATCH_R] >= 20 && now.looks[DQW_WATCH_LQ] >= 20 && now.looks[DQW_WATCH_PSI] >= 20);
        } else {
            HOLDS(memcmp(&now, &untouched, sizeof now) == 0);
        }
    }
    BETWEEN(0.5, at_s, 0.8);  // service, and what is known well
    HOLDS(dqw_monitor_store(&m, &healthy));
    every_value_comes_back(&m);
    HOLDS(!dqw_monitor_store(&m, NULL) && !dqw_monitor_store(NULL, &healthy));
    // From twenty looks on: of R, L_q and the flux; the others may have none.
    for (int i = 0; i < DQW_WATCH_TEMPERATURE; i++)
        for (uint8_t looks = 19; looks <= 20; looks++) {
            CASE("channel %d, %d looks", i, looks);
            dqw_monitor young = m;
            young.watch.looks[i] = looks;
            dqw_monitor_stored now;
            const bool needed = i == DQW_WATCH_R || i == DQW_WATCH_LQ || i == DQW_WATCH_PSI;
            HOLDS(dqw_monitor_store(&young, &now) == (!needed || looks == 20));
        }
    test_case[0] = 0;
    BETWEEN(0.0199, healthy.healthy.weight[DQW_PSI], 0.0201);
    BETWEEN(0.49, healthy.healthy.weight[DQW_R], 0.51);
    return &healthy;
}

static void test_what_was_damaged_is_refused(void)
{
    const dqw_monitor_stored good = *stored();
    const dqw_monitor_config c = config_of();
    dqw_monitor m = begin(&c);
    const dqw_monitor before = m;
    TEST_ASSERT_EQUAL_INT(DQW_ERR_NULL, dqw_monitor_restore(NULL, &good));
    TEST_ASSERT_EQUAL_INT(DQW_ERR_NULL, dqw_monitor_restore(&m, NULL));
    int refused[3] = {0};
    for (size_t at = 0; at < sizeof good; at++)
        for (int bit = 0; bit < 8; bit++) {
            CASE("byte %d, bit %d", (int)at, bit);
            dqw_monitor_stored s = good;
            ((unsigned char *)&s)[at] ^= (unsigned char)(1u << bit);
            const enum dqw_status status = dqw_monitor_restore(&m, &s);
            HOLDS(status ==
                  (at < offsetof(dqw_monitor_stored, config) ? DQW_ERR_STORE_VERSION : DQW_ERR_STORE_DAMAGED));
            TEST_ASSERT_EQUAL_MEMORY(&before, &m, sizeof m);
            refused[status == DQW_ERR_STORE_VERSION]++;
        }
    TEST_ASSERT_EQUAL_INT(32, refused[1]);
    TEST_ASSERT_EQUAL_INT(8 * (int)sizeof good - 32, refused[0]);
    // All bits of a byte at once, and memory that was never written.
    for (size_t at = 0; at < sizeof good; at++) {
        CASE("byte %d", (int)at);
        dqw_monitor_stored s = good;
        ((unsigned char *)&s)[at] = (unsigned char)~((unsigned char *)&s)[at];
        HOLDS(dqw_monitor_restore(&m, &s) != DQW_OK);
    }
    static const int fills[] = {0x00, 0xff, 0x5a};
    for (int k = 0; k < 3; k++) {
        dqw_monitor_stored s;
        memset(&s, fills[k], sizeof s);
        HOLDS(dqw_monitor_restore(&m, &s) == DQW_ERR_STORE_VERSION);
        s.version = good.version;
        HOLDS(dqw_monitor_restore(&m, &s) == DQW_ERR_STORE_DAMAGED);
    }
    TEST_ASSERT_EQUAL_MEMORY(&before, &m, sizeof m);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_monitor_restore(&m, &good));
}

static void test_another_configuration_is_refused(void)
{
    const dqw_monitor_stored *good = stored();
    static const dqw_effect_config list[] = {{.effect = DQW_EFFECT_VOLTAGE_OFFSET},
                                             {.effect = DQW_EFFECT_DEAD_TIME, .shape = {0.1f}}};
    enum { CHANGES = 21, SAME = 5 };
    for (int k = 0; k < CHANGES + SAME; k++) {
        CASE("change %d", k);
        dqw_monitor_config c = config_of();
        dqw_estimator_config *e = &c.estimator;
        float *const values[] = {&e->dt_s, &e->v_base_V, &e->i_base_A, &e->w_base_rad_s,      &e->R_ohm,
                                 &e->Ld_H, &e->Lq_H,     &e->psi_Wb,   &e->dead_time_width_A, &c.J_kgm2};
        bool *const flags[] = {&e->encoder_offset, &e->noise_on_inputs,  &e->voltage_next,
                               &e->voltage_held,   &e->speed_electrical, &c.commissioned};
        if (k < 10) *values[k] *= 1.01f;
        if (k >= 10 && k < 16) *flags[k - 10] = !*flags[k - 10];
        if (k == 16) e->pole_pairs = 5;
        if (k == 17) e->half_window = 19;
        if (k == 18) e->effects = list, e->effect_count = 1;
        if (k == 19) e->angle_late_s = e->dt_s;
        if (k == 20) e->modulation = DQW_MODULATION_CLAMPED_60;
        // What does not give the healthy values their meaning may be another one.
        if (k == CHANGES) e->half_window = 20;
        if (k == CHANGES + 1) c.band[DQW_WATCH_R] = 0.1f;
        if (k == CHANGES + 2) c.heating_K_s = 2.0f;
        if (k == CHANGES + 3) e->threshold_ppm = 20000;
        if (k == CHANGES + 4) e->stale_limit = 7;
        dqw_monitor m = begin(&c);
        const dqw_monitor before = m;
        HOLDS(dqw_monitor_restore(&m, good) == (k < CHANGES ? DQW_ERR_STORE_CONFIG : DQW_OK));
        if (k < CHANGES) TEST_ASSERT_EQUAL_MEMORY(&before, &m, sizeof m);
    }
    // Another list, another shape, another order are others.
    dqw_effect_config other[] = {list[1], list[0]};
    dqw_monitor_config c = config_of();
    c.estimator.dead_time_width_A = 0.0f;
    c.estimator.effects = list;
    c.estimator.effect_count = 2;
    dqw_monitor m = begin(&c);
    m.estimator.stage.name = DQW_STAGE_IN_SERVICE;
    for (int i = 0; i < DQW_WATCH_TEMPERATURE; i++) m.watch.looks[i] = 100;
    dqw_monitor_stored s;
    HOLDS(dqw_monitor_store(&m, &s));
    for (int k = 0; k < 3; k++) {
        CASE("list %d", k);
        dqw_effect_config changed[] = {list[0], list[1]};
        if (k == 1) changed[1].shape[0] = 0.11f;
        if (k == 2) memcpy(changed, other, sizeof changed);
        dqw_monitor_config d = c;
        d.estimator.effects = changed;
        dqw_monitor n = begin(&d);
        HOLDS(dqw_monitor_restore(&n, &s) == (k == 0 ? DQW_OK : DQW_ERR_STORE_CONFIG));
    }
}

// A machine in which something has been, or has not, since the store was written: from its first sample on.
static course after_power_cycle(const dqw_sim_scenario *s, const dqw_monitor_stored *given, dqw_monitor *m,
                                const dqw_monitor_config *c)
{
    simulate(s);
    *m = begin(c);
    if (given != NULL) TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_monitor_restore(m, given));
    return watch(m, 0, row_count);
}

// Watched at once where a fresh one's healthy values settle first; and they are the stored ones.
static void test_a_restored_monitor_watches_at_once(void)
{
    const dqw_monitor_stored *given = stored();
    const dqw_monitor_config c = config_of();
    const dqw_sim_scenario s = joint(2.4);
    dqw_monitor m;
    const course fresh = after_power_cycle(&s, NULL, &m, &c);
    const course o = after_power_cycle(&s, given, &m, &c);
    CASE("service at %g s, watching at %g s, fresh at %g s; %d events", o.service_s, o.watching_s, fresh.watching_s,
         o.events);
    HOLDS(o.events == 0 && fresh.events == 0);
    BETWEEN(-1e-9, o.service_s - fresh.service_s, 1e-9);
    BETWEEN(0.0, o.watching_s - o.service_s, 0.01);
    BETWEEN(-1e-3, m.healthy.weight[DQW_LQ] / given->healthy.weight[DQW_LQ] - 1, 5e-3);
    // It can be stored again at once.
    dqw_monitor_stored again;
    HOLDS(dqw_monitor_store(&m, &again));
    const dqw_sim_scenario just_in_service = joint(o.service_s + 0.01);
    for (int known = 0; known < 2; known++) {
        (void)after_power_cycle(&just_in_service, known ? given : NULL, &m, &c);
        CASE("known %d", known);
        TEST_ASSERT_EQUAL_INT(known ? DQW_WHY_IN_SERVICE : DQW_WHY_UNSETTLED,
                              dqw_monitor_unwatched(&m, (enum dqw_monitor_channel)DQW_WATCH_PSI));
    }
}

// What broke while the drive was off is told, where a fresh monitor takes it for healthy.
static void test_what_broke_while_it_was_off_is_told(void)
{
    static const struct {
        const char *text, *key;
        double size;
        enum dqw_fault_name name;
        double told_s;  ///< measured
    } broken[] = {{"demagnetisation", "nonideal.demagnetisation", 0.06, DQW_FAULT_DEMAGNETISATION, 0.99},
                  {"turn short", "nonideal.turn_short", 0.03, DQW_FAULT_TURN_SHORT, 1.40},
                  {"phase connection", "nonideal.phase_connection_ohm", 0.05, DQW_FAULT_PHASE_CONNECTION, 1.66},
                  {"current offset", "nonideal.current_offset_alpha_A", 0.2, DQW_FAULT_CURRENT_OFFSET, 1.72},
                  {"encoder offset", "nonideal.angle_offset_rad", 0.05, DQW_FAULT_ENCODER_OFFSET, 1.02}};
    const dqw_monitor_stored *given = stored();
    const dqw_monitor_config c = config_of();
    for (unsigned k = 0; k < (quick() ? 1 : sizeof broken / sizeof broken[0]); k++) {
        dqw_sim_scenario s = joint(2.2);
        s.seed = 2;
        set(&s, broken[k].key, "", broken[k].size);
        dqw_monitor m;
        const course fresh = after_power_cycle(&s, NULL, &m, &c);
        const course o = after_power_cycle(&s, given, &m, &c);
        CASE("%s: told at %g s, fault %d, channel %d, watching at %g s", broken[k].text, o.first_s,
             (int)o.first.fault.name, (int)o.first.parameter, o.watching_s);
        if (getenv("DQW_TEST_VALUES") != NULL) printf("%s\n", test_case);
        HOLDS(o.events >= 1 && o.first.fault.name == broken[k].name && o.first.fault.phase == 0);
        BETWEEN(0.8 * broken[k].told_s, o.first_s, 1.25 * broken[k].told_s);
        HOLDS(fresh.events == 0);
    }
}

// Switched off warm and on cold, or the other way: nothing but heat.
static void test_only_warmer_or_colder_is_no_event(void)
{
    static const struct {
        double winding_K, magnet_K;
    } rises[] = {{40, 0}, {40, 30}, {-30, -30}, {80, 60}, {0, 0}};
    const dqw_monitor_stored *given = stored();
    const dqw_monitor_config c = config_of();
    for (unsigned k = 0; k < (quick() ? 2 : sizeof rises / sizeof rises[0]); k++) {
        dqw_sim_scenario s = joint(2.4);
        s.seed = 3;
        s.machine.temp_start_C = s.machine.temp_ref_C + 1;
        s.nonideal.winding_alpha_per_K.value = 0.0039 * rises[k].winding_K;
        s.nonideal.magnet_beta_per_K.value = -0.001 * rises[k].magnet_K;
        dqw_monitor m;
        const course o = after_power_cycle(&s, given, &m, &c);
        CASE("winding %g K, magnet %g K: %d events, the first at %g s, channel %d, fault %d", rises[k].winding_K,
             rises[k].magnet_K, o.events, o.first_s, (int)o.first.parameter, (int)o.first.fault.name);
        HOLDS(o.events == 0 && isfinite(o.watching_s));
        BETWEEN(rises[k].winding_K - 4, dqw_monitor_read(&m, DQW_WATCH_TEMPERATURE).value, rises[k].winding_K + 4);
    }
    // Switched off hot, its magnet warm: the winding is cold on switching on, and the flux still lower; but not by a
    // demagnetisation's part.
    dqw_monitor_stored hot = *given;
    dqw_monitor m = begin(&c);
    HOLDS(dqw_monitor_restore(&m, &hot) == DQW_OK);
    for (int way = 0; way < 2; way++) {
        dqw_sim_scenario s = joint(2.4);
        s.seed = 4;
        s.machine.temp_start_C = s.machine.temp_ref_C + 1;
        s.nonideal.magnet_beta_per_K.value = -0.001 * 40;
        simulate(&s);
        m = begin(&c);
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_monitor_restore(&m, &hot));
        // What it was when it was switched off.
        if (way == 1) m.healthy.hottest_K = 60.0f;
        const course o = watch(&m, 0, row_count);
        CASE("hottest %g K: %d events, first fault %d", way == 1 ? 60.0 : 0.0, o.events, (int)o.first.fault.name);
        if (way == 1)
            HOLDS(o.events == 0);
        else
            HOLDS(o.events >= 1 && o.first.fault.name == DQW_FAULT_DEMAGNETISATION);
    }
}

// R between 40 K below cold and 10 K above the limit of the winding. The flux by what a magnet as hot as the winding is,
// or was, has lost, three tenths more and half a band; where the winding is colder than cold, gained as much. (E94)
static void test_where_healthy_values_begin(void)
{
    static const double winding_K[] = {-60, -41, -39, 0, 0.5, 50, 119, 121, 200};
    static const double hottest_K[] = {0, 30, 130};
    const dqw_monitor_config c = config_of();
    const dqw_monitor_stored *given = stored();
    const double cold_ohm = (double)given->healthy.cold_R_ohm;
    const double cold_Wb = (double)given->healthy.cold_psi_Wb;
    for (int k = 0; k < 9; k++)
        for (int h = 0; h < 3; h++)
            for (double flux = 0.75; flux < 1.3; flux += 0.01) {
                CASE("%g K, was %g K, flux %g", winding_K[k], hottest_K[h], flux);
                dqw_monitor m = begin(&c);
                TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_monitor_restore(&m, given));
                m.healthy.hottest_K = (float)hottest_K[h];
                m.estimator.number = 70000;
                dqw_estimator *e = &m.estimator;
                e->w_pu[DQW_R] = (float)(cold_ohm * (1 + 0.0039 * winding_K[k])) / dqw_estimator_unit(e, DQW_R);
                e->w_pu[DQW_PSI] = (float)(cold_Wb * flux) / dqw_estimator_unit(e, DQW_PSI);
                m.enter_as_stored(&m);
                const double rise = fmax(-40, fmin(120, winding_K[k]));
                const double lost = 1.3e-3 * fmax(rise, hottest_K[h]) + 0.006;
                const double gained = 1.3e-3 * fmax(-rise, 0) + 0.006;
                BETWEEN(-1e-5, (double)m.healthy.weight[DQW_R] / cold_ohm - (1 + 0.0039 * rise), 1e-5);
                BETWEEN(-1e-5, (double)m.healthy.weight[DQW_PSI] / cold_Wb - fmax(1 - lost, fmin(1 + gained, flux)),
                        1e-5);
                HOLDS(m.watch.followed[0] == 70000 / 256 && m.watch.followed[1] == 70000 / 256);
            }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_what_was_damaged_is_refused);
    RUN_TEST(test_another_configuration_is_refused);
    RUN_TEST(test_a_restored_monitor_watches_at_once);
    RUN_TEST(test_where_healthy_values_begin);
    RUN_TEST(test_what_broke_while_it_was_off_is_told);
    RUN_TEST(test_only_warmer_or_colder_is_no_event);
    return UNITY_END();
}
