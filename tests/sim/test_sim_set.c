// The scenario table, its keys, and what is refused.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dqw_sim.h"
#include "sim_keys.h"
#include "unity.h"

static dqw_sim_scenario s;
static dqw_sim_report report;
static dqw_sim_row few[400];

void setUp(void)
{
    s = *dqw_sim_scenario_find("servo_ideal");
    s.duration_s = 0.01;
}
void tearDown(void) {}

static void test_table_has_what_is_promised(void)
{
    const char *const names[] = {"paper_step",
                                 "servo",
                                 "servo_ideal",
                                 "robot_joint",
                                 "traction_ipm",
                                 "traction_ipm_linear",
                                 "standstill",
                                 "coast_friction",
                                 "heating",
                                 "fault_turn_short",
                                 "fault_demagnetisation",
                                 "fault_phase_connection",
                                 "fault_bearing"};
    for (size_t i = 0; i < sizeof names / sizeof *names; ++i)
        TEST_ASSERT_NOT_NULL_MESSAGE(dqw_sim_scenario_find(names[i]), names[i]);
    for (size_t i = 0; i < dqw_sim_scenario_count(); ++i) {
        const dqw_sim_scenario *one = dqw_sim_scenario_at(i);
        TEST_ASSERT_EQUAL_PTR_MESSAGE(one, dqw_sim_scenario_find(one->name), one->name);
        TEST_ASSERT_TRUE_MESSAGE(strlen(one->about) > 20 && dqw_sim_rows(one) > 0, one->name);
        TEST_ASSERT_TRUE_MESSAGE(strstr("dynamic steady standstill mechanical", one->regime) != NULL, one->name);
    }
    TEST_ASSERT_NULL(dqw_sim_scenario_at(dqw_sim_scenario_count()));
    TEST_ASSERT_NULL(dqw_sim_scenario_find("no_such"));
    TEST_ASSERT_NULL(dqw_sim_scenario_find(NULL));
    TEST_ASSERT_EQUAL_size_t(301, dqw_sim_rows(dqw_sim_scenario_find("paper_step")));
    TEST_ASSERT_EQUAL_size_t(20000, dqw_sim_rows(dqw_sim_scenario_find("servo")));
    TEST_ASSERT_EQUAL_INT(21, dqw_sim_scenario_find("robot_joint")->machine.pole_pairs);
    TEST_ASSERT_TRUE(dqw_sim_scenario_find("heating")->method == DQW_SIM_BDF);
}

static void test_keys_reach_their_fields(void)
{
    TEST_ASSERT_EQUAL_INT(0, dqw_sim_set(&s, "machine.R_ohm", "1.5e-1"));
    TEST_ASSERT_EQUAL_DOUBLE(0.15, s.machine.R_ohm);
    TEST_ASSERT_EQUAL_INT(0, dqw_sim_set(&s, "machine.pole_pairs", "7"));
    TEST_ASSERT_EQUAL_INT(7, s.machine.pole_pairs);
    TEST_ASSERT_EQUAL_INT(0, dqw_sim_set(&s, "nonideal.dead_time_V", "4"));
    TEST_ASSERT_EQUAL_DOUBLE(4, s.nonideal.dead_time_V.value);
    TEST_ASSERT_EQUAL_INT(0, dqw_sim_set(&s, "nonideal.turn_short.t_end_s", "2.5"));
    TEST_ASSERT_EQUAL_DOUBLE(2.5, s.nonideal.turn_short.t_end_s);
    TEST_ASSERT_EQUAL_INT(0, dqw_sim_set(&s, "profile.i_q_A.random_hold_s", "0.01"));
    TEST_ASSERT_EQUAL_DOUBLE(0.01, s.profile.i_q_A.random_hold_s);
    TEST_ASSERT_EQUAL_INT(0, dqw_sim_set(&s, "profile.speed_rad_s.shape", "triangle"));
    TEST_ASSERT_TRUE(s.profile.speed_rad_s.shape == DQW_SIM_SHAPE_TRIANGLE);
    TEST_ASSERT_EQUAL_INT(0, dqw_sim_set(&s, "method", "bdf"));
    TEST_ASSERT_TRUE(s.method == DQW_SIM_BDF);
    TEST_ASSERT_EQUAL_INT(0, dqw_sim_set(&s, "balance", "true"));
    TEST_ASSERT_TRUE(s.balance);
    TEST_ASSERT_EQUAL_INT(0, dqw_sim_set(&s, "seed", "18446744073709551615"));
    TEST_ASSERT_TRUE(s.seed == UINT64_MAX);
    TEST_ASSERT_EQUAL_INT(0, dqw_sim_set(&s, "machine.flux_map", "a/b.csv"));
    TEST_ASSERT_EQUAL_STRING("a/b.csv", s.machine.flux_map);
    TEST_ASSERT_EQUAL_INT(0, dqw_sim_set(&s, "nonideal.inverter_curve", "c.csv"));
    TEST_ASSERT_EQUAL_STRING("c.csv", s.nonideal.inverter_curve);
    TEST_ASSERT_EQUAL_INT(0, dqw_sim_set(&s, "nonideal.angle_offset_rad.t_start_s", "0.5"));
    TEST_ASSERT_EQUAL_DOUBLE(0.5, s.nonideal.angle_offset_rad.t_start_s);
    TEST_ASSERT_EQUAL_INT(0, dqw_sim_set(&s, "nonideal.cogging_order", "24"));
    TEST_ASSERT_EQUAL_INT(24, s.nonideal.cogging_order);
    TEST_ASSERT_EQUAL_INT(0, dqw_sim_set(&s, "noise", "0.02"));
    TEST_ASSERT_TRUE(s.noise.i == 0.02 && s.noise.v == 0.02 && s.noise.w == 0.02 && s.noise.theta == 0.02 &&
                     s.noise.torque == 0.02);
    TEST_ASSERT_EQUAL_INT(0, dqw_sim_set(&s, "noise_i", "0.03"));
    TEST_ASSERT_TRUE(s.noise.i == 0.03 && s.noise.v == 0.02);
}

// Every listed key takes one kind of value or another, and no two keys have one name.
static void test_every_listed_key_is_known(void)
{
    size_t n = 0;
    for (; dqw_sim_key_at(n); ++n) {
        const char *key = dqw_sim_key_at(n);
        const dqw_sim_field *f = dqw_sim_field_at(n);
        const char *const choices = f && f->choices ? f->choices : "1 ";
        char first[20];
        snprintf(first, sizeof first, "%.*s", (int)strcspn(choices, " "), choices);
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, dqw_sim_set(&s, key, first), key);
        for (size_t m = 0; m < n; ++m) TEST_ASSERT_TRUE_MESSAGE(strcmp(key, dqw_sim_key_at(m)) != 0, key);
    }
    TEST_ASSERT_TRUE(n > 100);
}

static void test_bad_keys_and_values_are_refused_and_change_nothing(void)
{
    const dqw_sim_scenario before = s;
    const char *const keys[] = {
        "", "R_ohm", "machine", "machine.", "machine.R", "machine.R_ohm ", "noise_x", "name", "profile.i_d_A.value.x"};
    for (size_t k = 0; k < sizeof keys / sizeof *keys; ++k)
        TEST_ASSERT_EQUAL_INT_MESSAGE(DQW_SIM_ERR_KEY, dqw_sim_set(&s, keys[k], "1"), keys[k]);
    char long_path[300];
    memset(long_path, 'x', sizeof long_path), long_path[299] = 0;
    const char *const pairs[][2] = {{"machine.R_ohm", ""},
                                    {"machine.R_ohm", "abc"},
                                    {"machine.R_ohm", "1 ohm"},
                                    {"machine.R_ohm", "nan"},
                                    {"machine.R_ohm", "inf"},
                                    {"machine.R_ohm", "1e999"},
                                    {"machine.pole_pairs", "4.5"},
                                    {"machine.pole_pairs", "99999999999999999999"},
                                    {"seed", "-1"},
                                    {"seed", "1.5"},
                                    {"seed", "99999999999999999999999"},
                                    {"method", "euler"},
                                    {"method", ""},
                                    {"method", "ada"},
                                    {"method", "adams bdf"},
                                    {"balance", "yes"},
                                    {"machine.flux_map", long_path},
                                    {"noise", "much"}};
    for (size_t k = 0; k < sizeof pairs / sizeof *pairs; ++k)
        TEST_ASSERT_EQUAL_INT_MESSAGE(DQW_SIM_ERR_VALUE, dqw_sim_set(&s, pairs[k][0], pairs[k][1]), pairs[k][1]);
    TEST_ASSERT_EQUAL_INT(DQW_SIM_ERR_KEY, dqw_sim_set(NULL, "seed", "1"));
    TEST_ASSERT_EQUAL_INT(DQW_SIM_ERR_KEY, dqw_sim_set(&s, NULL, "1"));
    TEST_ASSERT_EQUAL_INT(DQW_SIM_ERR_KEY, dqw_sim_set(&s, "seed", NULL));
    for (size_t k = 0; k < dqw_sim_field_count(); ++k) {
        const dqw_sim_field *f = dqw_sim_field_at(k);
        const size_t size = f->kind == DQW_SIM_FIELD_DOUBLE || f->kind == DQW_SIM_FIELD_SEED ? 8
                            : f->kind == DQW_SIM_FIELD_BOOL                                  ? sizeof(bool)
                                                                                             : sizeof(int);
        TEST_ASSERT_EQUAL_MEMORY_MESSAGE((const char *)&before + f->offset, (const char *)&s + f->offset, size, f->key);
    }
}

static void expect_taken(const char *key, const char *expected)
{
    char text[200];
    dqw_sim_expected(key, text, sizeof text);
    TEST_ASSERT_EQUAL_STRING_MESSAGE(expected, text, key);
}

static void test_a_key_says_what_it_takes_and_a_choice_its_name(void)
{
    expect_taken("machine.R_ohm", "a number");
    expect_taken("nonideal.dead_time_V", "a number");
    expect_taken("noise", "a number");
    expect_taken("noise_i", "a number");
    expect_taken("machine.pole_pairs", "a whole number");
    expect_taken("seed", "a whole number from 0 on");
    expect_taken("balance", "true or false");
    expect_taken("machine.flux_map", "a path of at most 255 characters");
    expect_taken("drive.hold", "abc or dq");
    expect_taken("sensing.phases", "abc, ab, bc or ca");
    expect_taken("machine.colour", "");
    char text[20], shorter[6];
    dqw_sim_expected("sensing.phases", shorter, sizeof shorter);
    TEST_ASSERT_EQUAL_STRING("abc, ", shorter);
    const char *const shapes[] = {"sine", "square", "triangle", "stairs"};
    for (size_t k = 0; k < 4; ++k) {
        TEST_ASSERT_EQUAL_INT(0, dqw_sim_set(&s, "profile.load_Nm.shape", shapes[k]));
        dqw_sim_chosen(&s, "profile.load_Nm.shape", text, sizeof text);
        TEST_ASSERT_EQUAL_STRING(shapes[k], text);
    }
    dqw_sim_chosen(&s, "machine.R_ohm", text, sizeof text);
    TEST_ASSERT_EQUAL_STRING("", text);
    dqw_sim_chosen(&s, "machine.colour", text, sizeof text);
    TEST_ASSERT_EQUAL_STRING("", text);
}

static void expect_refused(const char *field)
{
    TEST_ASSERT_EQUAL_INT_MESSAGE(DQW_SIM_ERR_SCENARIO, dqw_sim_run(&s, few, 400, &report, NULL, NULL), field);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(report.message, field), report.message);
    TEST_ASSERT_EQUAL_size_t(0, dqw_sim_rows(&s));
    setUp();
}

static void test_unphysical_scenarios_are_refused_by_name(void)
{
    s.machine.R_ohm = 0, expect_refused("machine.R_ohm");
    s.machine.Ld_H = -1e-3, expect_refused("machine.Ld_H");
    s.machine.Lq_H = NAN, expect_refused("machine.Lq_H");
    s.machine.psi_Wb = INFINITY, expect_refused("machine.psi_Wb");
    s.machine.J_kgm2 = 0, expect_refused("machine.J_kgm2");
    s.machine.pole_pairs = 0, expect_refused("machine.pole_pairs");
    s.machine.coulomb_Nm = 1, expect_refused("machine.coulomb_width_rad_s");
    s.machine.winding_heat_J_K = 1, expect_refused("heat capacities");
    s.drive.dt_s = 0, expect_refused("drive.dt_s");
    s.drive.dt_s = -1e-4, expect_refused("drive.dt_s");
    s.drive.v_dc_V = 0, expect_refused("drive.v_dc_V");
    s.drive.i_max_A = 0, expect_refused("drive.i_max_A");
    s.drive.current_bandwidth_rad_s = 0, expect_refused("drive.current_bandwidth_rad_s");
    s.drive.speed_bandwidth_rad_s = 0, expect_refused("speed bandwidth");
    s.drive.log_every = -1, expect_refused("drive.log_");
    s.drive.log_window = 5, expect_refused("drive.log_");
    s.profile.i_d_A.random_hold_s = 0, expect_refused("profile.i_d_A");
    s.profile.speed_rad_s.wave_period_s = 0, expect_refused("profile.speed_rad_s");
    s.profile.v_q_V.value = NAN, expect_refused("profile.v_q_V");
    s.nonideal.turn_short.value = 1, expect_refused("nonideal.turn_short");
    s.nonideal.demagnetisation.value = -0.1, expect_refused("nonideal.demagnetisation");
    s.nonideal.dead_time_V.value = 3, expect_refused("nonideal.dead_time_width_A");
    s.nonideal.dead_time_V.value = 3, s.nonideal.dead_time_width_A = 1, strcpy(s.nonideal.inverter_curve, "x.csv"),
    expect_refused("exclude each other");
    s.nonideal.delay_periods.value = 2.1, expect_refused("nonideal.delay_periods");
    s.nonideal.current_gain_b.value = -1, expect_refused("nonideal.current_gain_b");
    s.nonideal.skin_effect_s2_rad2.value = -1e-9, expect_refused("nonideal.skin_effect_s2_rad2");
    s.nonideal.phase_resistance_b_ohm.value = -0.9, expect_refused("nonideal.phase_resistance_*_ohm");
    s.nonideal.phase_resistance_b_ohm.value = 0.1, s.nonideal.turn_short.value = 0.1,
    expect_refused("nonideal.turn_short");
    s.nonideal.stribeck_Nm.value = 0.1, s.machine.coulomb_width_rad_s = 1,
    expect_refused("nonideal.stribeck_width_rad_s");
    s.nonideal.friction_asymmetry_Nm.value = -0.1, expect_refused("nonideal.friction_asymmetry_Nm");
    s.nonideal.cogging_Nm.value = 0.1, expect_refused("nonideal.cogging_order");
    s.nonideal.clip_A = -1, expect_refused("nonideal.clip_A");
    s.nonideal.dropped_fraction = 1, expect_refused("nonideal.dropped_fraction");
    s.nonideal.saturation_qq_A_Wb3.t_end_s = NAN, expect_refused("nonideal.saturation_qq_A_Wb3.t_end_s");
    strcpy(s.machine.flux_map, "x.csv"), s.nonideal.saturation_qq_A_Wb3.value = 1, expect_refused("exclude each other");
    s.noise.i = -0.1, expect_refused("noise.i");
    s.duration_s = 0, expect_refused("duration_s");
    s.duration_s = 1e9, expect_refused("duration_s");
    s.rtol = 0, expect_refused("rtol");
    s.rtol = 1, expect_refused("rtol");
}

// One key too many or too few, and the name by which it is refused.
static void test_contradictions_of_real_drives_are_refused_by_name(void)
{
    static const struct {
        const char *set, *name;
    } table[] = {
        {"inverter.carriers=2", "inverter.carriers needs"},
        {"inverter.compare_counts=2000", "inverter.compare_counts needs"},
        {"inverter.dead_time_s=1e-6", "inverter.dead_time_s needs"},
        {"inverter.node_F=1e-9", "inverter.node_F needs"},
        {"inverter.switch_V=1", "inverter.switch_V, switch_ohm needs"},
        {"inverter.switch_ohm=0.1", "inverter.switch_V, switch_ohm needs"},
        {"inverter.diode_V=1", "inverter.diode_V, diode_ohm needs"},
        {"inverter.diode_ohm=0.1", "inverter.diode_V, diode_ohm needs"},
        {"inverter.source_ohm=1", "inverter.source_ohm, link_F needs"},
        {"inverter.link_F=1e-3", "inverter.source_ohm, link_F needs"},
        {"inverter.ripple_V=1", "inverter.ripple_V needs"},
        {"drive.overmodulation=true", "drive.overmodulation needs"},
        {"drive.compensation=1", "drive.compensation needs"},
        {"inverter.modulation=centred drive.hold=dq", "inverter.modulation"},
        {"inverter.modulation=centred inverter.carriers=-1", "inverter.carriers"},
        {"inverter.modulation=centred inverter.carriers=10001", "inverter.carriers"},
        {"inverter.modulation=centred inverter.compare_counts=-1", "inverter.compare_counts"},
        {"inverter.modulation=centred inverter.dead_time_s=2.5e-5", "inverter.dead_time_s"},
        {"inverter.modulation=centred inverter.carriers=2 inverter.dead_time_s=1.3e-5", "inverter.dead_time_s"},
        {"inverter.modulation=centred inverter.switch_V=1", "inverter.knee_A"},
        {"inverter.modulation=centred inverter.ripple_V=400", "inverter.ripple_V"},
        {"inverter.modulation=centred inverter.ripple_V=4", "inverter.ripple_Hz"},
        {"inverter.modulation=centred inverter.node_F=1e-9", "inverter.node_F needs"},
        {"inverter.modulation=centred drive.compensation=1", "drive.compensation needs"},
        {"inverter.modulation=centred inverter.dead_time_s=1e-6 drive.compensation=11", "drive.compensation must"},
        {"inverter.modulation=centred noise.step_v_dc_V=1000", "noise.step_v_dc_V"},
        {"inverter.modulation=centred nonideal.turn_short_H=1e-6", "nonideal.turn_short_H needs"},
        {"sensing.once_rad=2", "sensing.once_rad"},
        {"sensing.twice_rad=-2", "sensing.twice_rad"},
        {"machine.winding_housing_W_K=1", "machine.housing_heat_J_K"},
        {"polled.queue_rows=3", "polled.* needs"},
        {"polled.rate_Hz=1000 polled.jitter_s=1", "polled.jitter_s"},
        {"inverter.modulation=centred inverter.diode_V=1", "inverter.knee_A"},
        {"inverter.modulation=centred inverter.source_ohm=1", "inverter.source_ohm and inverter.link_F"},
        {"inverter.modulation=centred inverter.link_F=1", "inverter.source_ohm and inverter.link_F"},
        {"inverter.modulation=centred nonideal.dead_time_V=1 nonideal.dead_time_width_A=1",
         "nonideal.dead_time_V, inv"},
        {"inverter.modulation=centred nonideal.inverter_curve=x.csv", "nonideal.dead_time_V, inverter_curve"},
        {"inverter.modulation=centred nonideal.delay_periods=0.5", "nonideal.delay_periods"},
        {"inverter.modulation=centred nonideal.delay_periods=1 nonideal.delay_periods.t_end_s=1",
         "nonideal.delay_periods"},
        {"inverter.modulation=centred nonideal.iron_loss_S=0.01", "nonideal.iron_loss_tau_s"},
        {"inverter.modulation=centred nonideal.iron_hysteresis_S_rad_s=1 nonideal.iron_hysteresis_corner_rad_s=1",
         "nonideal.iron_loss_tau_s"},
        {"inverter.modulation=centred nonideal.turn_short=0.1 nonideal.turn_short_ohm=0.1", "nonideal.turn_short_H"},
        {"drive.hold=dq sensing.filter_s=1e-5", "sensing.filter_s, late_periods"},
        {"drive.hold=dq sensing.late_periods=0.1", "sensing.filter_s, late_periods"},
        {"drive.hold=dq drive.unturned=true", "drive.unturned"},
        {"sensing.late_periods=1", "sensing.late_periods"},
        {"sensing.angle_late_periods=1.1", "sensing.angle_late_periods"},
        {"sensing.observer=true", "sensing.speed_bandwidth_rad_s"},
        {"sensing.observer=true sensing.speed_bandwidth_rad_s=100 sensing.observer_noise_rad=0.1 "
         "sensing.observer_corner_rad_s=1",
         "sensing.observer_corner_rad_s, observer_bandwidth_rad_s"},
        {"sensing.observer=true sensing.speed_bandwidth_rad_s=100 sensing.observer_noise_rad=0.1 "
         "sensing.observer_bandwidth_rad_s=1",
         "sensing.observer_corner_rad_s, observer_bandwidth_rad_s"},
        {"sensing.observer=true sensing.speed_bandwidth_rad_s=100 sensing.once_rad=0.1", "sensing.once_rad"},
        {"sensing.observer=true sensing.speed_bandwidth_rad_s=100 sensing.twice_rad=-0.1", "sensing.once_rad"},
        {"sensing.observer=true sensing.speed_bandwidth_rad_s=100 sensing.angle_late_periods=1", "sensing.once_rad"},
        {"sensing.observer_lag_s=1e-4", "need sensing.observer"},
        {"sensing.observer_load_rad_A=-1e-3", "need sensing.observer"},
        {"sensing.observer_noise_rad=0.1", "need sensing.observer"},
        {"machine.housing_heat_J_K=1", "machine.housing_heat_J_K"},
        {"nonideal.iron_hysteresis_S_rad_s=1", "nonideal.iron_hysteresis_corner_rad_s"},
    };
    for (size_t k = 0; k < sizeof table / sizeof *table; ++k) {
        char pairs[200], *next = pairs;
        strcpy(pairs, table[k].set);
        for (char *pair = next; next; pair = next) {
            char *value = strchr(pair, '=');
            next = strchr(pair, ' ');
            if (next) *next++ = 0;
            *value++ = 0;
            TEST_ASSERT_EQUAL_INT_MESSAGE(0, dqw_sim_set(&s, pair, value), table[k].set);
        }
        expect_refused(table[k].name);
    }
}

static int give_up(void *ctx, double fraction)
{
    ++*(int *)ctx;
    TEST_ASSERT_TRUE(fraction >= 0 && fraction <= 1);
    return fraction > 0.5;
}

static int go_on(void *ctx, double fraction)
{
    ++*(int *)ctx;
    TEST_ASSERT_TRUE(fraction >= 0 && fraction <= 1);
    return 0;
}

static void test_capacity_progress_and_null(void)
{
    TEST_ASSERT_EQUAL_size_t(100, dqw_sim_rows(&s));
    TEST_ASSERT_EQUAL_INT(DQW_SIM_ERR_CAPACITY, dqw_sim_run(&s, few, 99, &report, NULL, NULL));
    TEST_ASSERT_EQUAL_INT(DQW_SIM_ERR_CAPACITY, dqw_sim_run(&s, NULL, 100, &report, NULL, NULL));
    TEST_ASSERT_EQUAL_INT(DQW_SIM_ERR_SCENARIO, dqw_sim_run(NULL, few, 400, NULL, NULL, NULL));
    TEST_ASSERT_EQUAL_size_t(0, dqw_sim_rows(NULL));
    int calls = 0;
    TEST_ASSERT_EQUAL_INT(0, dqw_sim_run(&s, few, 100, NULL, go_on, &calls));
    TEST_ASSERT_TRUE(calls >= 40 && calls <= 110);
    calls = 0;
    TEST_ASSERT_EQUAL_INT(DQW_SIM_ERR_ABORTED, dqw_sim_run(&s, few, 100, &report, give_up, &calls));
    TEST_ASSERT_TRUE(report.message[0] && calls > 1);
    for (int status = 0; status >= -8; --status)
        TEST_ASSERT_TRUE(strcmp(dqw_sim_status_text(status), "unknown status") != 0);
    TEST_ASSERT_EQUAL_STRING("unknown status", dqw_sim_status_text(-99));
}

// Rows of many periods: the mean voltage over the row, or over its settled end.
static void test_rows_of_many_periods(void)
{
    static dqw_sim_row fine[100];
    TEST_ASSERT_EQUAL_INT(0, dqw_sim_run(&s, fine, 100, NULL, NULL, NULL));
    s.drive.log_every = 10;
    TEST_ASSERT_EQUAL_size_t(10, dqw_sim_rows(&s));
    TEST_ASSERT_EQUAL_INT(0, dqw_sim_run(&s, few, 10, NULL, NULL, NULL));
    double mean = 0;
    for (int k = 30; k < 40; ++k) mean += fine[k].v_d_V / 10;
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, mean, few[3].v_d_V);
    TEST_ASSERT_EQUAL_DOUBLE(fine[30].i_d_A, few[3].i_d_A);
    TEST_ASSERT_EQUAL_DOUBLE(fine[30].t_s, few[3].t_s);
    s.drive.log_window = 2;
    TEST_ASSERT_EQUAL_INT(0, dqw_sim_run(&s, few, 10, NULL, NULL, NULL));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.5 * (fine[38].v_d_V + fine[39].v_d_V), few[3].v_d_V);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.5 * (fine[38].v_q_V + fine[39].v_q_V), few[3].v_q_V);
    TEST_ASSERT_EQUAL_DOUBLE(fine[38].i_d_A, few[3].i_d_A);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_table_has_what_is_promised);
    RUN_TEST(test_keys_reach_their_fields);
    RUN_TEST(test_every_listed_key_is_known);
    RUN_TEST(test_bad_keys_and_values_are_refused_and_change_nothing);
    RUN_TEST(test_a_key_says_what_it_takes_and_a_choice_its_name);
    RUN_TEST(test_unphysical_scenarios_are_refused_by_name);
    RUN_TEST(test_contradictions_of_real_drives_are_refused_by_name);
    RUN_TEST(test_capacity_progress_and_null);
    RUN_TEST(test_rows_of_many_periods);
    return UNITY_END();
}
