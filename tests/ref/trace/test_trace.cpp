// The tracer against the simulator, whose laws are others' (sim/ shares no code with ref/), and against measured logs.
// Plain only: long, and what it runs others run under the sanitizers.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <stdexcept>

#include "ref/trace/trace.hpp"
#include "simulated.hpp"
#include "unity.h"

extern "C" void setUp(void) {}
extern "C" void tearDown(void) {}

namespace {

using dqw::Log;
using dqw::TraceResult;

std::vector<Log> one_log(const char* scenario, const std::vector<std::string>& settings)
{
    return {simulated(scenario, settings, Beside::nothing)};
}

/// A trace that has what is alike to choose from: the whole catalogue takes as long again, and blind logs are given it.
TraceResult among(const std::vector<std::string>& effects, const std::vector<Log>& logs)
{
    dqw::TraceOptions options;
    options.effects = effects;
    return dqw::trace(logs, options);
}

double value(const std::vector<dqw::Estimate>& list, const char* name)
{
    for (const dqw::Estimate& e : list)
        if (e.name == name) return e.value;
    TEST_FAIL_MESSAGE(name);
    return 0.0;
}

void only(const TraceResult& r, const char* effect)
{
    TEST_ASSERT_EQUAL_size_t_MESSAGE(1, r.effects.size(), effect);
    TEST_ASSERT_EQUAL_STRING(effect, r.effects[0].name.c_str());
}

void both(const TraceResult& r, const char* first, const char* second)
{
    TEST_ASSERT_EQUAL_size_t(2, r.effects.size());
    TEST_ASSERT_EQUAL_STRING(first, r.effects[0].name.c_str());
    TEST_ASSERT_EQUAL_STRING(second, r.effects[1].name.c_str());
}

void clean_log_has_nothing()
{
    const TraceResult r = dqw::trace(one_log("servo", {}));
    TEST_ASSERT_EQUAL_STRING("clean", r.verdict.c_str());
    TEST_ASSERT_EQUAL_size_t(0, r.effects.size());
    // Measured: 1.06.
    TEST_ASSERT_DOUBLE_WITHIN(0.12, 1.05, r.after.heldout_rms / r.noise_floor);
    TEST_ASSERT_TRUE(r.map.empty());
}

/// A law made of noisy columns loses nothing to one that only turns them: in 5 % noise the rows alone prefer a shift by
/// hundreds of nats.
void a_law_of_noisy_columns_is_not_named_as_a_shift()
{
    const TraceResult r = among({"iron_loss", "sample_shift", "sensor_lag", "delay", "turn_short", "angle_offset"},
                                one_log("servo", {"duration_s=1.5", "profile.v_d_V.binary=0", "profile.v_q_V.binary=0",
                                                  "nonideal.iron_loss_S=0.012", "noise=0.05", "noise.seed=4"}));
    only(r, "iron_loss");
    TEST_ASSERT_EQUAL_size_t(0, r.effects[0].confusable_with.size());
    // 1/0.012; its deviation is 0.6, noise of this size moves it by as much as 2.5.
    TEST_ASSERT_DOUBLE_WITHIN(3.0, 83.33, value(r.effects[0].parameters, "R_fe_ohm"));
}

/// How the pulses of an inverter stand within a period turns the voltage by some 1e-4 rad, which is most of what little
/// v_d there is. It has no name; a twentieth of a period has one.
void pulses_within_a_period_have_no_name()
{
    const auto traced = [](const char* late) {
        return dqw::trace(one_log("servo", {"inverter.modulation=clamped_low", "method=rk4", "drive.dt_s=0.0002",
                                            "duration_s=2", "noise=0.0003", "noise.v=0", "profile.v_d_V.binary=4",
                                            "profile.v_q_V.binary=4", "profile.speed_rad_s.wave=250", late}));
    };
    const TraceResult own = traced("sensing.late_periods=0");
    TEST_ASSERT_EQUAL_STRING("clean", own.verdict.c_str());
    // Noise; as if the mean voltage were held an effect is named.
    TEST_ASSERT_DOUBLE_WITHIN(0.004, 0.0146, own.before.axes[0].percent);
    only(traced("sensing.late_periods=0.05"), "sample_shift");
}

/// Rows that hold the voltage until them, in a log that does not say so, or says so and does not: the key that reads it
/// right is told. Two rows late there is none.
void a_voltage_of_the_row_before_is_told_its_key()
{
    std::vector<Log> logs = one_log("servo", {"seed=60559", "duration_s=0.6"});
    const auto noted = [&logs](const std::string& key) {
        dqw::TraceOptions options;
        options.effects = {"sample_shift"};
        const TraceResult r = dqw::trace(logs, options);
        return std::any_of(r.notes.begin(), r.notes.end(), [&key](const std::string& note) {
            return note.find("voltage_interval = \"" + key + "\"") != std::string::npos;
        });
    };
    TEST_ASSERT_FALSE(noted("previous"));
    for (std::vector<double>* v : {&logs[0].v_d_V, &logs[0].v_q_V})
        std::rotate(v->rbegin(), v->rbegin() + 1, v->rend());
    TEST_ASSERT_TRUE(noted("previous"));
    logs[0].previous = true;
    TEST_ASSERT_FALSE(noted("previous"));
    for (std::vector<double>* v : {&logs[0].v_d_V, &logs[0].v_q_V}) std::rotate(v->begin(), v->begin() + 2, v->end());
    TEST_ASSERT_TRUE(noted("next"));
}

/// Where a period is as long as a fifth of L/R, where the pulses stand in it bends the currents by more than noise: an
/// inverter that rests its legs by turns has it turn about six times a turn, as an inverter's loss does. Without an angle
/// that at the first row is found.
void pulses_of_a_long_period_have_no_name()
{
    std::vector<Log> logs = one_log("servo",
                                    {"inverter.modulation=clamped_60", "method=rk4", "drive.dt_s=0.0004",
                                     "duration_s=1.6", "noise=0.00005", "noise.v=0", "profile.v_d_V.binary=4",
                                     "profile.v_q_V.binary=4", "profile.speed_rad_s.wave=60", "machine.R_ohm=1.5"});
    for (const bool angle : {true, false}) {
        if (!angle) logs[0].theta_e_rad.clear(), logs[0].theta_m_rad.clear();
        const TraceResult r = dqw::trace(logs);
        TEST_ASSERT_EQUAL_STRING("clean", r.verdict.c_str());
        // As if the mean voltage were held, 0.33 %, R 0.55 mohm off, and an effect is named.
        TEST_ASSERT_DOUBLE_WITHIN(0.006, angle ? 0.0246 : 0.043, r.before.axes[0].percent);
        TEST_ASSERT_DOUBLE_WITHIN(2e-4, 1.5, value(r.after.parameters, "R_ohm"));
    }
}

/// Between the pulses what a late current lacks turns about in the middle of the period, with a valley on either side:
/// in the wrong one half of the residual stays.
void currents_told_behind_the_pulses_middle_are_named()
{
    const TraceResult r = dqw::trace(
        one_log("servo", {"inverter.modulation=centred", "method=rk4", "drive.dt_s=0.0002", "duration_s=1",
                          "noise=0.003", "noise.v=0", "profile.v_d_V.binary=4", "profile.v_q_V.binary=4",
                          "profile.speed_rad_s.wave=250", "sensing.late_periods=0.66"}));
    only(r, "sample_shift");
    // In the other valley 129.0.
    TEST_ASSERT_DOUBLE_WITHIN(0.5e-6, 132e-6, value(r.effects[0].parameters, "shift_s"));
    TEST_ASSERT_TRUE(r.after.heldout_rms < 0.1 * r.before.heldout_rms);
    TEST_ASSERT_EQUAL_STRING("explained", r.verdict.c_str());
}

/// Currents told late and an angle that is off, together: induced voltage and inductances lie along the rotor's axes,
/// not along the angle's. Of legs that switch the pulses show only once both are in the model, and are told no longer
/// where there are none; without them an iron loss, and without the rotor's axes 54 mrad.
void late_currents_and_an_angle_that_is_off_are_both_told()
{
    const struct {
        const char *scenario, *modulation, *seed, *dt_s;
    } cases[] = {{"servo", "mean", "seed=1", "0.0002"},
                 {"servo", "clamped_low", "seed=9321", "0.0002"},
                 {"traction_ipm_linear", "mean", "seed=1", "0.0001"}};
    for (const auto& c : cases) {
        const TraceResult r = among(
            {"sample_shift", "angle_offset", "iron_loss", "sensor_lag", "delay"},
            one_log(c.scenario, {std::string("inverter.modulation=") + c.modulation, "method=rk4", c.seed,
                                 std::string("drive.dt_s=") + c.dt_s, "duration_s=0.6", "noise=0.003",
                                 "sensing.late_periods=0.9", "nonideal.angle_offset_rad=0.05"}));
        TEST_ASSERT_EQUAL_size_t_MESSAGE(2, r.effects.size(), c.scenario);
        for (const auto& e : r.effects) {
            const bool shift = e.name == "sample_shift";
            TEST_ASSERT_EQUAL_STRING(shift ? "sample_shift" : "angle_offset", e.name.c_str());
            const double truth = shift ? 0.9 * std::stod(c.dt_s) : 0.05;
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1.5e-3 * truth, truth,
                                              value(e.parameters, shift ? "shift_s" : "angle_rad"), c.scenario);
        }
    }
}

/// Below what a period's pulses may turn a sensor's offset is named still.
void offset_below_the_pulses_own_is_named()
{
    const TraceResult r = dqw::trace(
        one_log("servo", {"duration_s=1", "noise=0.0003", "noise.v=0", "nonideal.current_offset_alpha_A=0.01"}));
    only(r, "current_offset");
    TEST_ASSERT_EQUAL_STRING("explained", r.verdict.c_str());
    TEST_ASSERT_DOUBLE_WITHIN(0.4e-3, 10e-3, value(r.effects[0].parameters, "i_alpha_A"));
}

/// And heat. Without the name R takes the mean of it, 1 %, and the log is clean.
void heat_below_the_pulses_own_is_named()
{
    const TraceResult r = dqw::trace(
        one_log("servo", {"drive.dt_s=0.0002", "duration_s=2", "noise=0.0003", "noise.v=0", "noise.temp=0.0001",
                          "nonideal.winding_alpha_per_K=0.004", "machine.winding_heat_J_K=20",
                          "machine.magnet_heat_J_K=400", "machine.winding_ambient_W_K=0.05"}));
    only(r, "winding_temperature");
    TEST_ASSERT_DOUBLE_WITHIN(0.2e-3, 4.0e-3, value(r.effects[0].parameters, "alpha_per_K"));
    TEST_ASSERT_DOUBLE_WITHIN(0.5e-3, 0.9, value(r.after.parameters, "R_ohm"));
}

/// What a polynomial leaves of its iron under an injected voltage looks like noise of single rows: by that floor nothing
/// was left, and L_q 4 % off.
void iron_is_mapped_though_its_rest_looks_like_noise()
{
    const TraceResult r = among(
        {"saturation", "cross_saturation", "sample_shift", "current_offset"},
        one_log("servo", {"duration_s=1", "noise=0.002", "nonideal.saturation_qq_A_Wb3=250000"}));
    only(r, "saturation");
    // Measured: 1.03, of a floor that is that of the log's noise; .65 without the map.
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 1.03, r.after.heldout_rms / r.noise_floor);
    TEST_ASSERT_DOUBLE_WITHIN(0.04e-3, 2.82e-3, value(r.after.parameters, "Lq_H"));
    TEST_ASSERT_DOUBLE_WITHIN(0.5e-3, 0.9, value(r.after.parameters, "R_ohm"));
}

/// What a filter leaves is found first as a shift, and is one no longer once the heat is in the model.
void the_wrong_one_of_two_goes_for_the_right_one()
{
    const TraceResult r = among(
        {"sensor_lag", "sample_shift", "delay", "winding_temperature", "angle_offset"},
        one_log("robot_joint",
                {"duration_s=1", "noise=0.0005", "inverter.modulation=centred", "method=rk4", "sensing.filter_s=4e-6",
                 "nonideal.winding_alpha_per_K=0.004", "machine.winding_heat_J_K=1", "machine.magnet_heat_J_K=400",
                 "machine.winding_ambient_W_K=0.05"}));
    TEST_ASSERT_EQUAL_size_t(2, r.effects.size());
    for (const auto& e : r.effects)
        TEST_ASSERT_TRUE_MESSAGE(e.name == "sensor_lag" || e.name == "winding_temperature", e.name.c_str());
    const auto& lag = r.effects[r.effects[0].name == "sensor_lag" ? 0 : 1];
    TEST_ASSERT_DOUBLE_WITHIN(0.1e-6, 4e-6, value(lag.parameters, "tau_s"));
}

/// A sensor's gain takes its part of all of R, also of what the speed adds to it: with R alone k is known to 2 %, and a
/// rest stays.
void a_gain_meets_the_resistance_of_the_row()
{
    const TraceResult r = among(
        {"skin_effect", "current_gain_mismatch", "phase_resistance_imbalance", "winding_temperature"},
        one_log("servo",
                {"duration_s=1", "noise=0.003", "nonideal.skin_effect_s2_rad2=2e-6", "nonideal.current_gain_a=0.08",
                 "nonideal.current_gain_b=-0.04", "nonideal.current_gain_c=-0.04"}));
    TEST_ASSERT_EQUAL_size_t(2, r.effects.size());
    TEST_ASSERT_EQUAL_STRING("explained", r.verdict.c_str());
    TEST_ASSERT_EQUAL_STRING("skin_effect", r.effects[0].name.c_str());
    TEST_ASSERT_DOUBLE_WITHIN(0.01e-6, 2e-6, value(r.effects[0].parameters, "k_s2_rad2"));
    TEST_ASSERT_DOUBLE_WITHIN(0.5e-3, 0.04, value(r.effects[1].parameters, "gain"));
}

/// Its flux lies along the rotor's axes, to which the angle's law turns the cold magnet's alone: counted twice, 103 mrad
/// and a rest of 14 floors.
void a_magnet_that_warms_beside_an_angle_is_counted_once()
{
    const TraceResult r = among({"angle_offset", "magnet_temperature", "winding_temperature", "saturation"},
                                one_log("servo", {"duration_s=1", "noise=0.0005", "noise.temp=0.0001",
                                                  "nonideal.angle_offset_rad=0.1", "nonideal.magnet_beta_per_K=-0.004",
                                                  "machine.winding_heat_J_K=1", "machine.magnet_heat_J_K=1",
                                                  "machine.winding_ambient_W_K=0.05", "machine.winding_magnet_W_K=2"}));
    both(r, "angle_offset", "magnet_temperature");
    TEST_ASSERT_DOUBLE_WITHIN(0.1e-3, 0.1, value(r.effects[0].parameters, "angle_rad"));
    TEST_ASSERT_DOUBLE_WITHIN(0.02e-3, -4e-3, value(r.effects[1].parameters, "beta_per_K"));
    TEST_ASSERT_TRUE(r.after.heldout_rms < 1.2 * r.noise_floor);
}

/// Constant as the rotor sees it, an offset jumps each period as the stator does, and a late voltage has none of that:
/// an angle offset of .8 mrad made it good.
void a_late_voltage_has_no_jumps_of_an_offset()
{
    const TraceResult r = among({"delay", "voltage_offset", "angle_offset", "sample_shift"},
                                one_log("servo", {"duration_s=1", "noise=0.001", "nonideal.delay_periods=0.5",
                                                  "nonideal.voltage_offset_d_V=1", "nonideal.voltage_offset_q_V=-2"}));
    both(r, "delay", "voltage_offset");
    TEST_ASSERT_DOUBLE_WITHIN(0.01e-3, 0.12, value(r.after.parameters, "psi_Wb"));
}

/// Currents that are told late have run on under the voltage that reaches the machine: under the log's own, an angle
/// that is off had to make good what the offset adds to them, and the flux was .06 mWb off.
void late_currents_run_without_what_the_voltage_lacks()
{
    const TraceResult r = among({"sample_shift", "voltage_offset", "angle_offset", "sensor_lag", "delay"},
                                one_log("servo", {"duration_s=1", "noise=0.003", "sensing.late_periods=0.6",
                                                  "nonideal.voltage_offset_d_V=1", "nonideal.voltage_offset_q_V=-2"}));
    both(r, "sample_shift", "voltage_offset");
    TEST_ASSERT_DOUBLE_WITHIN(4e-3, 1.0, value(r.effects[1].parameters, "v_d_V"));
    TEST_ASSERT_DOUBLE_WITHIN(0.03e-3, 0.12, value(r.after.parameters, "psi_Wb"));
}

/// A leg that rests at the upper rail leaves the currents under one vector around each row: what is told a twenty-fifth
/// of a period late, or behind a filter as short, goes with that, not with the mean voltage.
void currents_told_between_pulses_are_named()
{
    const auto traced = [](const char* what) {
        return among({"sample_shift", "sensor_lag", "delay", "iron_loss", "angle_offset"},
                     one_log("servo", {"inverter.modulation=clamped_60", "method=rk4", "drive.dt_s=0.0002",
                                       "duration_s=1.5", "noise=0.003", "noise.v=0", "profile.v_d_V.binary=4",
                                       "profile.v_q_V.binary=4", "profile.speed_rad_s.wave=250", what}));
    };
    // Of 8 us: measured 7.94 and 7.89.
    const TraceResult late = traced("sensing.late_periods=0.04"), filtered = traced("sensing.filter_s=8e-6");
    only(late, "sample_shift");
    TEST_ASSERT_DOUBLE_WITHIN(0.16e-6, 7.94e-6, value(late.effects[0].parameters, "shift_s"));
    only(filtered, "sensor_lag");
    TEST_ASSERT_DOUBLE_WITHIN(0.16e-6, 7.89e-6, value(filtered.effects[0].parameters, "tau_s"));
    for (const TraceResult& r : {late, filtered}) {
        TEST_ASSERT_EQUAL_STRING("explained", r.verdict.c_str());
        TEST_ASSERT_EQUAL_size_t(0, r.effects[0].confusable_with.size());
    }
}

/// Switches that conduct through a voltage lose it in a leg that rests as well, whatever the log says of the legs.
void a_leg_that_rests_may_lose_voltage_too()
{
    const TraceResult r = among(
        {"dead_time", "sensor_lag", "iron_loss", "saturation"},
        {simulated("drive_clamped", {"seed=60495", "duration_s=2", "inverter.node_F=0", "inverter.dead_time_s=0",
                                     "inverter.switch_ohm=0", "inverter.diode_ohm=0", "inverter.switch_V=1.5",
                                     "inverter.diode_V=1.2", "inverter.knee_A=0.08", "inverter.reverse=diode"})});
    const auto found = std::find_if(r.effects.begin(), r.effects.end(),
                                    [](const dqw::TraceEffect& e) { return e.name == "dead_time"; });
    TEST_ASSERT_TRUE(found != r.effects.end());
    TEST_ASSERT_EQUAL_STRING("centred", found->modulation.c_str());
    // As if the leg rested without loss R reads 1.11; measured 0.893.
    TEST_ASSERT_DOUBLE_WITHIN(0.03, 0.9, value(r.after.parameters, "R_ohm"));
    TEST_ASSERT_TRUE(std::any_of(r.notes.begin(), r.notes.end(), [](const std::string& note) {
        return note.find("its leg that rests loses voltage like the others") != std::string::npos;
    }));
}

/// Phases unlike each other at one angle of a locked rotor: settled points in no order, of which none follows a like
/// one. It is the rotor's own matrix, whether of resistances or of sensors.
void unlike_phases_show_at_one_angle()
{
    const auto traced = [](const char* phase_a) {
        return dqw::trace({simulated("standstill",
                                     {"profile.i_d_A.levels=0", "profile.i_d_A.wave=0", "profile.i_d_A.random=8",
                                      "profile.i_q_A.random=8", "profile.i_d_A.random_hold_s=0.25",
                                      "profile.i_q_A.random_hold_s=0.25", "duration_s=50", phase_a},
                                     Beside::regime)});
    };
    const TraceResult alike = traced("nonideal.phase_resistance_a_ohm=0");
    TEST_ASSERT_EQUAL_STRING("clean", alike.verdict.c_str());
    // Of 100 rows held out: a tenth.
    TEST_ASSERT_DOUBLE_WITHIN(0.25, 1.0, alike.after.heldout_rms / alike.noise_floor);
    const TraceResult unlike = traced("nonideal.phase_resistance_a_ohm=0.3");
    TEST_ASSERT_TRUE(unlike.before.heldout_rms > 3.0 * unlike.noise_floor);
    TEST_ASSERT_EQUAL_STRING("explained", unlike.verdict.c_str());
    TEST_ASSERT_EQUAL_size_t(1, unlike.effects.size());
    const std::string name = unlike.effects[0].name;
    TEST_ASSERT_TRUE(name == "phase_resistance_imbalance" || name == "current_gain_mismatch");
    TEST_ASSERT_EQUAL_size_t(1, unlike.effects[0].confusable_with.size());
    TEST_ASSERT_DOUBLE_WITHIN(0.25, 1.0, unlike.after.heldout_rms / unlike.noise_floor);
}

/// In 10 % noise half a volt of dead time is not seen, and R takes it up: 1.0 for 0.9 ohm, of which white noise knows
/// nothing: 0.014.
void a_loss_that_noise_hides_is_in_the_deviation_of_R()
{
    const auto R_of = [](const char* volt) {
        const TraceResult r = among(
            {"dead_time", "saturation", "winding_temperature"},
            one_log("servo", {"duration_s=0.5", "noise=0.1", volt, "nonideal.dead_time_width_A=0.5"}));
        TEST_ASSERT_EQUAL_STRING("clean", r.verdict.c_str());
        for (const dqw::Estimate& e : r.after.parameters)
            if (e.name == "R_ohm") return e;
        return dqw::Estimate{};
    };
    // Without the part that it hides 7 to 9 deviations off, with it 2.4 to 4.4 (four seeds).
    const dqw::Estimate lossy = R_of("nonideal.dead_time_V=0.5");
    TEST_ASSERT_TRUE(lossy.value > 0.95);
    TEST_ASSERT_DOUBLE_WITHIN(4.5 * lossy.sd, 0.9, lossy.value);
    TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.035, lossy.sd);
    // Where there is none it widens little.
    const dqw::Estimate ideal = R_of("nonideal.dead_time_V=0");
    TEST_ASSERT_DOUBLE_WITHIN(3.0 * ideal.sd, 0.9, ideal.value);
    TEST_ASSERT_DOUBLE_WITHIN(0.012, 0.021, ideal.sd);
}

void dead_time_does_not_stay_in_R()
{
    const TraceResult r = dqw::trace(one_log("servo", {"nonideal.dead_time_V=4", "nonideal.dead_time_width_A=0.15"}));
    TEST_ASSERT_EQUAL_STRING("explained", r.verdict.c_str());
    only(r, "dead_time");
    TEST_ASSERT_DOUBLE_WITHIN(0.08, 4.0, value(r.effects[0].parameters, "voltage_V"));
    TEST_ASSERT_TRUE(value(r.before.parameters, "R_ohm") > 1.5);
    TEST_ASSERT_DOUBLE_WITHIN(0.018, 0.9, value(r.after.parameters, "R_ohm"));
    TEST_ASSERT_DOUBLE_WITHIN(0.02 * 2.2e-3, 2.2e-3, value(r.after.parameters, "Ld_H"));
    TEST_ASSERT_DOUBLE_WITHIN(0.005 * 0.12, 0.12, value(r.after.parameters, "psi_Wb"));
    // Measured: 1.36 V before, 0.187 V after.
    TEST_ASSERT_DOUBLE_WITHIN(0.15, 1.36, r.before.heldout_rms);
    TEST_ASSERT_DOUBLE_WITHIN(0.03, 0.187, r.after.heldout_rms);
}

/// Legs that lose a dead time of 1.5 us of 200, and a controller that gives back half as much too much, or just that, by
/// the currents of the row before and in proportion below 0.3 A. As one law of one width the one was a sample shift and
/// a saturation beside it; the other was a saturation alone, L_d 12 to 15 % off.
void what_a_controller_gives_back_is_apart_from_what_it_loses()
{
    for (const double part : {1.5, 1.0}) {
        const TraceResult r = among(
            {"dead_time", "saturation", "sample_shift", "winding_temperature"},
            one_log("servo", {"inverter.modulation=centred", "method=rk4", "drive.dt_s=0.0002", "duration_s=1.2",
                              "noise=0.003", "noise.v=0", "profile.v_d_V.binary=4", "profile.v_q_V.binary=4",
                              "profile.speed_rad_s.wave=60", "inverter.dead_time_s=1.5e-6",
                              "drive.compensation=" + std::to_string(part), "drive.compensation_width_A=0.3"}));
        TEST_ASSERT_EQUAL_STRING("explained", r.verdict.c_str());
        only(r, "dead_time");
        TEST_ASSERT_EQUAL_STRING("edges", r.effects[0].law.c_str());
        const double lost_V = value(r.effects[0].parameters, "voltage_V"),
                     back_V = value(r.effects[0].parameters, "given_back_V");
        TEST_ASSERT_DOUBLE_WITHIN(0.03, 2.4, lost_V);
        TEST_ASSERT_DOUBLE_WITHIN(0.02, 2.4 * (part - 1.0), back_V - lost_V);
        TEST_ASSERT_DOUBLE_WITHIN(0.005 * 0.9, 0.9, value(r.after.parameters, "R_ohm"));
        TEST_ASSERT_DOUBLE_WITHIN(0.001 * 2.2e-3, 2.2e-3, value(r.after.parameters, "Ld_H"));
        TEST_ASSERT_DOUBLE_WITHIN(0.001 * 2.8e-3, 2.8e-3, value(r.after.parameters, "Lq_H"));
        TEST_ASSERT_TRUE(r.after.heldout_rms < 1.1 * r.noise_floor);
    }
}

/// Legs that lose a dead time of 1.5 us of 200, in a log that tells all pulses.
std::vector<Log> switched_servo(std::vector<std::string> settings)
{
    const std::vector<std::string> all{"inverter.modulation=centred",
                                       "method=rk4",
                                       "drive.dt_s=0.0002",
                                       "duration_s=1.2",
                                       "noise=0.003",
                                       "noise.v=0",
                                       "profile.v_d_V.binary=4",
                                       "profile.v_q_V.binary=4",
                                       "profile.speed_rad_s.wave=60",
                                       "inverter.dead_time_s=1.5e-6"};
    settings.insert(settings.begin(), all.begin(), all.end());
    return one_log("servo", settings);
}

const dqw::TraceEffect& named(const TraceResult& r, const std::string& name)
{
    for (const auto& e : r.effects)
        if (e.name == name) return e;
    TEST_FAIL_MESSAGE(name.c_str());
    return r.effects.front();
}

/// A leg loses by the current that flows, a controller gives back by what it is told. Sensors that are off by half an
/// ampere: by what is told 2.0 times the noise was left, the offset 469 and -619 mA, R and L not usable.
void a_dead_time_beside_a_sensors_offset()
{
    const TraceResult r = among(
        {"dead_time", "current_offset", "current_gain_mismatch", "voltage_offset"},
        switched_servo({"nonideal.current_offset_alpha_A=0.3", "nonideal.current_offset_beta_A=-0.4",
                        "drive.compensation=1.5", "drive.compensation_width_A=0.3"}));
    TEST_ASSERT_EQUAL_STRING("explained", r.verdict.c_str());
    TEST_ASSERT_EQUAL_size_t(2, r.effects.size());
    const auto& offset = named(r, "current_offset").parameters;
    TEST_ASSERT_DOUBLE_WITHIN(0.02, 2.4, value(named(r, "dead_time").parameters, "voltage_V"));
    TEST_ASSERT_DOUBLE_WITHIN(0.004, 0.3, value(offset, "i_alpha_A"));
    TEST_ASSERT_DOUBLE_WITHIN(0.004, -0.4, value(offset, "i_beta_A"));
    TEST_ASSERT_DOUBLE_WITHIN(0.004, 0.9, value(r.after.parameters, "R_ohm"));
    TEST_ASSERT_DOUBLE_WITHIN(0.001 * 2.2e-3, 2.2e-3, value(r.after.parameters, "Ld_H"));
    TEST_ASSERT_TRUE(r.after.heldout_rms < 1.2 * r.noise_floor);
}

/// By what is told 1.7 times the noise was left beside a late sample, R +-0.12 ohm; a filter of 10 us was not found.
void a_dead_time_beside_currents_of_another_instant()
{
    const TraceResult late = among({"dead_time", "sample_shift", "sensor_lag", "delay", "iron_loss"},
                                   switched_servo({"sensing.late_periods=0.2"}));
    TEST_ASSERT_EQUAL_STRING("explained", late.verdict.c_str());
    TEST_ASSERT_EQUAL_size_t(2, late.effects.size());
    TEST_ASSERT_DOUBLE_WITHIN(1.5e-6, 39.5e-6, value(named(late, "sample_shift").parameters, "shift_s"));
    TEST_ASSERT_DOUBLE_WITHIN(0.02, 2.4, value(named(late, "dead_time").parameters, "voltage_V"));
    TEST_ASSERT_DOUBLE_WITHIN(0.004, 0.9, value(late.after.parameters, "R_ohm"));
    const TraceResult behind = among({"dead_time", "sample_shift", "sensor_lag", "delay", "iron_loss"},
                                     switched_servo({"sensing.filter_s=1e-5"}));
    TEST_ASSERT_EQUAL_STRING("explained", behind.verdict.c_str());
    TEST_ASSERT_EQUAL_size_t(2, behind.effects.size());
    TEST_ASSERT_DOUBLE_WITHIN(0.6e-6, 10e-6, value(named(behind, "sensor_lag").parameters, "tau_s"));
    TEST_ASSERT_DOUBLE_WITHIN(0.03, 2.4, value(named(behind, "dead_time").parameters, "voltage_V"));
    TEST_ASSERT_DOUBLE_WITHIN(0.001 * 2.2e-3, 2.2e-3, value(behind.after.parameters, "Ld_H"));
}

/// Iron bends by the current in it, and what a filter lacks runs on its tangent. By what is told the offset was 283 +- 117
/// mA, and L_q 5 % off and not usable; the filter was a shift by -10 us, for no map stood beside one.
void a_sensor_beside_iron_that_saturates()
{
    const auto saturated = [](const std::vector<std::string>& effects, std::vector<std::string> settings) {
        settings.insert(settings.begin(), {"duration_s=1", "noise=0.002", "nonideal.saturation_qq_A_Wb3=250000"});
        return among(effects, one_log("servo", settings));
    };
    const TraceResult off = saturated({"saturation", "current_offset", "current_gain_mismatch"},
                                      {"nonideal.current_offset_alpha_A=0.3", "nonideal.current_offset_beta_A=-0.4"});
    TEST_ASSERT_EQUAL_size_t(2, off.effects.size());
    TEST_ASSERT_DOUBLE_WITHIN(0.005, 0.3, value(named(off, "current_offset").parameters, "i_alpha_A"));
    TEST_ASSERT_DOUBLE_WITHIN(0.005, -0.4, value(named(off, "current_offset").parameters, "i_beta_A"));
    TEST_ASSERT_DOUBLE_WITHIN(0.04e-3, 2.82e-3, value(off.after.parameters, "Lq_H"));
    const TraceResult behind = saturated({"saturation", "sensor_lag", "sample_shift"}, {"sensing.filter_s=1e-5"});
    TEST_ASSERT_EQUAL_size_t(2, behind.effects.size());
    TEST_ASSERT_DOUBLE_WITHIN(0.1e-6, 10e-6, value(named(behind, "sensor_lag").parameters, "tau_s"));
    TEST_ASSERT_DOUBLE_WITHIN(0.04e-3, 2.82e-3, value(behind.after.parameters, "Lq_H"));
    TEST_ASSERT_TRUE(behind.after.heldout_rms < 1.15 * behind.noise_floor);
}

/// What has no memory is told under the voltage that acts at the later instant. By that of the row the shift beside iron
/// was 39.0 +- .02 us, with a filter that is none, and a short beside it an iron loss.
void losses_told_at_a_later_instant()
{
    const auto late = [](const char* loss) {
        return among({"sample_shift", "iron_loss", "turn_short", "sensor_lag"},
                     one_log("servo", {"duration_s=1", "noise=0.002", "sensing.late_periods=0.3", loss}));
    };
    const TraceResult iron = late("nonideal.iron_loss_S=0.004"), turns = late("nonideal.turn_short=0.05");
    for (const TraceResult* r : {&iron, &turns}) {
        TEST_ASSERT_EQUAL_STRING("explained", r->verdict.c_str());
        TEST_ASSERT_EQUAL_size_t(2, r->effects.size());
        TEST_ASSERT_DOUBLE_WITHIN(0.1e-6, 30e-6, value(named(*r, "sample_shift").parameters, "shift_s"));
        TEST_ASSERT_DOUBLE_WITHIN(0.0005 * 2.2e-3, 2.2e-3, value(r->after.parameters, "Ld_H"));
        TEST_ASSERT_TRUE(r->after.heldout_rms < 1.15 * r->noise_floor);
    }
    TEST_ASSERT_DOUBLE_WITHIN(5.0, 250.0, value(named(iron, "iron_loss").parameters, "R_fe_ohm"));
    named(turns, "turn_short");
}

/// A winding of six periods, sampled nearly in the middle of its pulses, of which R takes its part meanwhile: without
/// that the shift was half a microsecond off, at 15 deviations.
void currents_told_from_the_middle_of_their_pulses()
{
    const TraceResult r = dqw::trace(
        one_log("servo", {"inverter.modulation=clamped_low", "method=rk4", "drive.dt_s=0.0003", "duration_s=1.5",
                          "noise=0.002", "noise.v=0", "profile.v_d_V.binary=8", "profile.v_q_V.binary=8",
                          "profile.speed_rad_s.wave=60", "sensing.late_periods=0.45", "machine.R_ohm=1.6"}));
    only(r, "sample_shift");
    TEST_ASSERT_DOUBLE_WITHIN(0.05e-6, 135e-6, value(r.effects[0].parameters, "shift_s"));
    TEST_ASSERT_DOUBLE_WITHIN(0.005 * 2.8e-3, 2.8e-3, value(r.after.parameters, "Lq_H"));
}

/// A link behind 4 ohm, whose capacitor of 500 uF gives for ten periods what the source does not at once. Told as if it
/// had none the source was 2.6 +- .5 ohm, and 1.8 times the noise was left.
void a_link_sags_as_its_capacitor_lets_it()
{
    const TraceResult r = dqw::trace(one_log(
        "servo", {"inverter.modulation=centred", "method=rk4", "drive.link=nominal", "drive.dt_s=0.0002",
                  "inverter.source_ohm=4", "inverter.link_F=0.0005", "duration_s=1.2", "noise=0.003", "noise.v=0",
                  "profile.v_d_V.binary=4", "profile.v_q_V.binary=4", "profile.speed_rad_s.wave=60"}));
    TEST_ASSERT_EQUAL_STRING("explained", r.verdict.c_str());
    only(r, "voltage_scale");
    const auto& told = r.effects[0].parameters;
    TEST_ASSERT_DOUBLE_WITHIN(0.3, 4.0, value(told, "source_ohm"));
    TEST_ASSERT_DOUBLE_WITHIN(0.0006, 0.002, value(told, "tau_s"));
    TEST_ASSERT_TRUE(r.after.heldout_rms < 1.1 * r.noise_floor);
    TEST_ASSERT_DOUBLE_WITHIN(0.001 * 0.9, 0.9, value(r.after.parameters, "R_ohm"));
    TEST_ASSERT_DOUBLE_WITHIN(0.001 * 2.8e-3, 2.8e-3, value(r.after.parameters, "Lq_H"));
}

/// What noise leaves of a slow log is a quarter of its voltage, and its columns are right nevertheless.
void much_noise_is_no_nonsense()
{
    const TraceResult r = dqw::trace(
        one_log("servo", {"duration_s=0.8", "noise=0.3", "noise.v=0.01", "noise.w=0.003", "noise.theta=0",
                          "profile.speed_rad_s=5", "profile.speed_rad_s.wave=5"}));
    TEST_ASSERT_EQUAL_STRING("clean", r.verdict.c_str());
    TEST_ASSERT_TRUE(r.before.axes[0].percent > 15.0);
    TEST_ASSERT_DOUBLE_WITHIN(0.02 * 0.9, 0.9, value(r.after.parameters, "R_ohm"));
}

/// Of a winding of three and a half periods, without an angle. Legs that rest at the upper rail are no turned ones of
/// the lower: as those the pulses were not found, R was .5 % off at 9 deviations and psi at 88. What the mean of two
/// currents leaves of their course was 38 % of "noise that follows from the rows before".
void upper_legs_that_rest_without_an_angle()
{
    std::vector<Log> logs = one_log("robot_joint", {"inverter.modulation=clamped_high", "method=rk4", "duration_s=1",
                                                    "noise=0.0005", "noise.v=0", "machine.R_ohm=0.14"});
    for (Log& log : logs) log.theta_e_rad.clear(), log.theta_m_rad.clear(), log.v_dc_V.clear();
    const TraceResult r = dqw::trace(logs);
    TEST_ASSERT_EQUAL_STRING("clean", r.verdict.c_str());
    TEST_ASSERT_DOUBLE_WITHIN(0.001 * 0.14, 0.14, value(r.after.parameters, "R_ohm"));
    TEST_ASSERT_DOUBLE_WITHIN(0.001 * 50e-6, 50e-6, value(r.after.parameters, "Lq_H"));
    TEST_ASSERT_DOUBLE_WITHIN(0.0005 * 4e-3, 4e-3, value(r.after.parameters, "psi_Wb"));
}

/// Firmware's law has one width, of a sample's current, which ripple of an ampere widens; the edges' own is next to
/// nothing.
void firmware_is_given_the_width_of_its_own_law()
{
    const TraceResult r = dqw::trace(
        one_log("servo", {"inverter.modulation=centred", "method=rk4", "drive.dt_s=0.0002", "duration_s=1",
                          "noise=0.003", "noise.v=0", "profile.v_d_V.binary=4", "profile.v_q_V.binary=4",
                          "profile.speed_rad_s.wave=60", "inverter.dead_time_s=1.5e-6"}));
    TEST_ASSERT_EQUAL_STRING("edges", r.effects[0].law.c_str());
    TEST_ASSERT_TRUE(value(r.effects[0].parameters, "width_A") < 0.05);
    TEST_ASSERT_EQUAL_size_t(1, r.inputs.size());
    TEST_ASSERT_DOUBLE_WITHIN(0.2, 0.4, r.inputs[0].shape[0]);
    TEST_ASSERT_DOUBLE_WITHIN(0.2, 2.4, r.inputs[0].weights[0]);
}

struct Size {
    const char* parameter;
    double truth, within;
};

void each_single_effect_is_named()
{
    const struct {
        const char* name;
        std::vector<std::string> settings;
        std::vector<Size> sizes;
    } cases[] = {
        {"delay", {"nonideal.delay_periods=0.2"}, {{"periods", 0.2, 0.003}}},
        {"angle_offset", {"nonideal.angle_offset_rad=0.02"}, {{"angle_rad", 0.02, 5e-4}}},
        {"iron_loss", {"nonideal.iron_loss_S=0.002"}, {{"R_fe_ohm", 500.0, 40.0}}},
        {"flux_harmonics",
         {"nonideal.flux_harmonic_6d_Wb=0.002", "nonideal.flux_harmonic_6q_Wb=0.001"},
         {{"psi_6d_Wb", 0.002, 1e-4}, {"psi_6q_Wb", 0.001, 1e-4}}},
        {"voltage_offset",
         {"nonideal.voltage_offset_d_V=0.5", "nonideal.voltage_offset_q_V=-0.3"},
         {{"v_d_V", 0.5, 0.03}, {"v_q_V", -0.3, 0.03}}},
        {"current_offset",
         {"nonideal.current_offset_alpha_A=0.1", "nonideal.current_offset_beta_A=-0.06"},
         {{"i_alpha_A", 0.1, 0.015}, {"i_beta_A", -0.06, 0.015}}},
        {"phase_resistance_imbalance",
         {"nonideal.phase_resistance_a_ohm=0.1", "nonideal.phase_resistance_b_ohm=0.05"},
         {{"dR_a_ohm", 0.1, 0.01}, {"dR_b_ohm", 0.05, 0.01}}},
        {"current_gain_mismatch",
         {"nonideal.current_gain_b=0.03"},
         {{"gain", 0.0099, 0.0004}, {"axis_rad", -M_PI / 3.0, 0.05}}},
    };
    std::vector<std::string> names{"sample_shift", "sensor_lag", "turn_short", "dead_time"};
    for (const auto& c : cases) names.emplace_back(c.name);
    for (const auto& c : cases) {
        std::vector<std::string> settings = c.settings;
        settings.push_back("duration_s=1");
        const TraceResult r = among(names, one_log("servo", settings));
        only(r, c.name);
        for (const Size& size : c.sizes)
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(size.within, size.truth, value(r.effects[0].parameters, size.parameter),
                                              size.parameter);
    }
}

/// 12 logs, four parameters each: the RMS of 48 errors over their deviations is known to 10 %.
void deviations_cover_the_errors()
{
    double square = 0.0;
    for (int seed = 1; seed <= 12; ++seed) {
        const TraceResult r = dqw::trace(one_log("servo", {"duration_s=0.5", "seed=" + std::to_string(seed)}),
                                         {{"dead_time"}, {}});
        const std::pair<const char*, double> truths[] = {
            {"R_ohm", 0.9}, {"Ld_H", 2.2e-3}, {"Lq_H", 2.8e-3}, {"psi_Wb", 0.12}};
        for (const auto& [name, truth] : truths)
            for (const dqw::Estimate& e : r.after.parameters)
                if (e.name == name) square += std::pow((e.value - truth) / e.sd, 2) / 48.0;
    }
    std::printf("RMS error over deviation: %.2f\n", std::sqrt(square));
    TEST_ASSERT_DOUBLE_WITHIN(0.4, 1.1, std::sqrt(square));
}

/// A lag of 4 us in 2 % of noise, alone or beside a dead time: the rows held out want it, and not blocks enough. By the
/// scatter alone L_d was off by 2.2 and 3.4 deviations, RMS.
void what_is_not_proved_is_in_the_deviations()
{
    for (const bool dead_time : {false, true}) {
        double square = 0.0;
        int count = 0;
        for (int seed = 60683; seed < 60689; ++seed) {
            std::vector<std::string> settings{"duration_s=0.3", "noise=0.02", "sensing.filter_s=4e-6",
                                              "seed=" + std::to_string(seed)};
            if (dead_time)
                settings.insert(settings.end(), {"nonideal.dead_time_V=4", "nonideal.dead_time_width_A=0.15"});
            const TraceResult r = dqw::trace(one_log("servo", settings), {{"dead_time", "sensor_lag"}, {}});
            if (r.verdict != (dead_time ? "explained" : "clean") || r.effects.size() != (dead_time ? 1 : 0)) continue;
            ++count;
            for (const dqw::Estimate& e : r.after.parameters)
                if (e.name == "Ld_H") square += std::pow((e.value - 2.2e-3) / e.sd, 2);
        }
        std::printf("RMS error over deviation of L_d: %.2f of %d\n", std::sqrt(square / count), count);
        TEST_ASSERT_TRUE(count >= 3);
        TEST_ASSERT_DOUBLE_WITHIN(0.5, 1.0, std::sqrt(square / count));
    }
}

/// An angle that is off and an iron loss look alike, and a filter of 10 us is 8.4 beside the one, 12.6 beside the other:
/// of the machine's parameters that was in the deviation, of the filter, 8.4 +- .2, it was not.
void what_looks_alike_is_in_an_effects_deviation_too()
{
    double square = 0.0;
    int count = 0;
    for (int seed = 60716; seed < 60720; ++seed) {
        const TraceResult r = among({"iron_loss", "sensor_lag", "angle_offset"},
                                    one_log("servo", {"duration_s=0.3", "noise=0.01", "sensing.filter_s=1e-5",
                                                      "nonideal.angle_offset_rad=0.002", "nonideal.iron_loss_S=0.0007",
                                                      "seed=" + std::to_string(seed)}));
        if (r.effects.size() != 2 || r.effects[1].name != "angle_offset") continue;
        ++count;
        TEST_ASSERT_EQUAL_STRING("sensor_lag", r.effects[0].name.c_str());
        TEST_ASSERT_EQUAL_size_t(1, r.effects[1].confusable_with.size());
        const dqw::Estimate& tau = r.effects[0].parameters[0];
        square += std::pow((tau.value - 1e-5) / tau.sd, 2);
    }
    std::printf("RMS error over deviation of the filter: %.2f of %d\n", std::sqrt(square / count), count);
    TEST_ASSERT_TRUE(count >= 2);
    TEST_ASSERT_DOUBLE_WITHIN(0.3, 0.45, std::sqrt(square / count));
}

void disturbance_outside_the_catalogue_gets_no_name()
{
    const TraceResult r = dqw::trace(
        one_log("servo", {"nonideal.disturbance_V=1", "nonideal.disturbance_Hz=37", "duration_s=1"}));
    TEST_ASSERT_EQUAL_STRING("unexplained", r.verdict.c_str());
    TEST_ASSERT_EQUAL_size_t(0, r.effects.size());
    TEST_ASSERT_FALSE(r.rest_signature.empty());
}

void dropped_samples_are_a_fault_of_the_record()
{
    const TraceResult r = dqw::trace(one_log("servo", {"nonideal.dropped_fraction=0.02", "duration_s=0.3"}));
    TEST_ASSERT_EQUAL_STRING("unexplained", r.verdict.c_str());
    TEST_ASSERT_NOT_NULL(std::strstr(r.rest_signature.c_str(), "held or dropped"));
}

void clipped_sensors_are_a_fault_of_the_record()
{
    const TraceResult r = dqw::trace(one_log("servo", {"nonideal.clip_A=6"}));
    TEST_ASSERT_EQUAL_STRING("unexplained", r.verdict.c_str());
    TEST_ASSERT_EQUAL_size_t(0, r.effects.size());
    TEST_ASSERT_TRUE_MESSAGE(r.rest_signature.find("sensors that stop") != std::string::npos, r.rest_signature.c_str());
}

// Stretches get fewer and guards shorter: some blocks of the residual are held out at any length.
void short_logs_are_judged_on_some_rows()
{
    for (const char* duration : {"duration_s=0.05", "duration_s=0.08", "duration_s=0.122", "duration_s=0.125",
                                 "duration_s=0.15", "duration_s=0.2"}) {
        const TraceResult r = dqw::trace(
            one_log("servo", {"nonideal.dead_time_V=4", "nonideal.dead_time_width_A=0.15", duration}));
        only(r, "dead_time");
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.4, 4.0, value(r.effects[0].parameters, "voltage_V"), duration);
        TEST_ASSERT_TRUE_MESSAGE(r.after.heldout_rms > 0.02 && r.after.heldout_rms < 0.5, duration);
    }
}

// Without noise, the sampling's own error is no effect.
void exact_logs_have_no_second_name()
{
    const auto traced = [](const char* what) { return dqw::trace(one_log("servo_ideal", {"duration_s=0.6", what})); };
    TEST_ASSERT_EQUAL_STRING("clean", traced("nonideal.voltage_offset_d_V=0").verdict.c_str());
    only(traced("nonideal.voltage_offset_d_V=0.5"), "voltage_offset");
    only(traced("nonideal.phase_resistance_a_ohm=0.1"), "phase_resistance_imbalance");
}

void too_few_rows_to_hold_some_out_are_refused()
{
    try {
        dqw::trace(one_log("servo", {"duration_s=0.02"}));
        TEST_FAIL_MESSAGE("200 rows were traced");
    } catch (const std::invalid_argument& error) {
        TEST_ASSERT_NOT_NULL(std::strstr(error.what(), "to hold some out"));
    }
}

void measured_sweeps_are_dead_time()
{
    const char* data = std::getenv("DATA");
    const std::string folder = data != nullptr ? data : "../shared/data";
    for (const char* name : {"inverter_sweep_d_axis_a", "inverter_sweep_d_axis_b", "inverter_sweep_d_axis_c",
                             "inverter_sweep_beta_axis_a"}) {
        const std::string path = folder + "/" + name + ".csv";
        if (!std::ifstream(path)) TEST_IGNORE_MESSAGE("no measured logs here");
        const TraceResult r = dqw::trace({dqw::read_log(path)});
        TEST_ASSERT_EQUAL_STRING("dead_time", r.effects.at(0).name.c_str());
        // A loss that is not alike both ways is a voltage as well: measured 0.076 of 4.2 V on one of them.
        TEST_ASSERT_TRUE_MESSAGE(r.effects.size() <= 2, name);
        if (r.effects.size() == 2) {
            TEST_ASSERT_EQUAL_STRING_MESSAGE("voltage_offset", r.effects[1].name.c_str(), name);
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.15, 0.0, value(r.effects[1].parameters, "v_d_V"), name);
        }
        const double R = value(r.after.parameters, "R_ohm");
        // Measured: 1.07 to 1.18 with deviations of 0.12 to 0.20: which law holds beyond the largest current is not
        // known.
        TEST_ASSERT_TRUE_MESSAGE(R > 1.0 && R < 1.4, name);
        TEST_ASSERT_TRUE_MESSAGE(r.before.axes[0].percent > 20.0 && r.after.axes[0].percent < 2.5, name);
    }
}

void delay_beyond_one_period()
{
    for (const double periods : {0.5, 1.5}) {
        const TraceResult r = dqw::trace(
            one_log("servo", {"duration_s=0.5", "nonideal.delay_periods=" + std::to_string(periods)}));
        only(r, "delay");
        // Measured: 0.5008, 1.5009; L_d 2.1990 mH, L_q 2.8012 mH. To first order 1.5 reads 1.39, and L_d 9 % too large.
        TEST_ASSERT_DOUBLE_WITHIN(0.003, periods, value(r.effects[0].parameters, "periods"));
        TEST_ASSERT_DOUBLE_WITHIN(0.002 * 2.2e-3, 2.2e-3, value(r.after.parameters, "Ld_H"));
        TEST_ASSERT_DOUBLE_WITHIN(0.002 * 2.8e-3, 2.8e-3, value(r.after.parameters, "Lq_H"));
    }
}

void heat_that_no_current_drives_is_in_the_deviation_of_R()
{
    std::vector<Log> logs = one_log("servo", {"duration_s=1"});
    Log& log = logs[0];
    log.temp_winding_C.clear(), log.temp_magnet_C.clear();
    const double R_ohm = 0.9, rise_ohm = 0.3;
    for (std::size_t k = 0; k + 1 < log.rows(); ++k) {
        const double more_ohm = rise_ohm * log.t_s[k] / log.t_s.back();
        log.v_d_V[k] += more_ohm * 0.5 * (log.i_d_A[k] + log.i_d_A[k + 1]);
        log.v_q_V[k] += more_ohm * 0.5 * (log.i_q_A[k] + log.i_q_A[k + 1]);
    }
    const TraceResult r = dqw::trace(logs);
    only(r, "winding_temperature");
    for (const dqw::Estimate& e : r.after.parameters)
        if (e.name == "R_ohm") {
            const double off = std::abs(e.value - R_ohm);
            TEST_ASSERT_TRUE_MESSAGE(off < 3.0 * e.sd && e.sd < 0.3 * R_ohm, std::to_string(off / e.sd).c_str());
            return;
        }
    TEST_FAIL_MESSAGE("no R");
}

void pole_pairs_are_those_that_explain_the_log()
{
    // Under 3 iron loss explains it, to a floor that the shorted turns are part of.
    std::vector<Log> logs = one_log("servo", {"nonideal.turn_short=0.1", "duration_s=0.4"});
    const double pole_pairs = *logs[0].machine.pole_pairs;
    logs[0].machine.pole_pairs.reset();
    logs[0].theta_e_rad.clear(), logs[0].theta_m_rad.clear();
    const TraceResult r = dqw::trace(logs);
    only(r, "turn_short");
    TEST_ASSERT_EQUAL_DOUBLE(pole_pairs, value(r.after.parameters, "pole_pairs"));
    TEST_ASSERT_TRUE_MESSAGE(r.notes.back().find("the one whole number") != std::string::npos,
                             "the plain fit has them");
}

void voltage_may_turn_with_the_rotor()
{
    // w_e T = 0.15: taken for a vector that stands still, it looks like iron loss with a delay.
    const TraceResult clean = dqw::trace(one_log("servo", {"drive.hold=dq", "drive.dt_s=4e-4"}));
    TEST_ASSERT_EQUAL_STRING("clean", clean.verdict.c_str());
    TEST_ASSERT_TRUE(clean.notes.back().find("rotor's frame") != std::string::npos);
    TEST_ASSERT_DOUBLE_WITHIN(0.0005 * 0.12, 0.12, value(clean.after.parameters, "psi_Wb"));
    only(dqw::trace(one_log("servo", {"drive.hold=dq", "drive.dt_s=4e-4", "nonideal.dead_time_V=4",
                                      "nonideal.dead_time_width_A=0.15"})),
         "dead_time");
}

void log_that_is_not_what_the_format_says()
{
    const std::vector<Log> good = one_log("servo", {"duration_s=0.3"});
    const auto doubted = [&good](const char* about, auto change) {
        std::vector<Log> logs = good;
        change(logs[0]);
        const TraceResult r = dqw::trace(logs);
        TEST_ASSERT_EQUAL_STRING_MESSAGE("unexplained", r.verdict.c_str(), about);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(0, r.effects.size(), about);
        TEST_ASSERT_TRUE_MESSAGE(r.doubt.find(about) != std::string::npos, r.doubt.c_str());
        // Of rows apart an effect may be the half; no law is tried on columns that are others.
        TEST_ASSERT_TRUE_MESSAGE(r.rejected.size() == 1 || std::string(about) == "previous", about);
        return r;
    };
    doubted("the signs of i_d and i_q turned", [](Log& log) {
        for (double& i : log.i_d_A) i = -i;
        for (double& i : log.i_q_A) i = -i;
    });
    doubted("i_d and i_q exchanged", [](Log& log) { std::swap(log.i_d_A, log.i_q_A); });
    doubted("previous", [](Log& log) {
        for (auto* v : {&log.v_d_V, &log.v_q_V}) std::rotate(v->begin(), v->end() - 1, v->end());
    });
    const TraceResult turned = doubted("unit and sign", [](Log& log) {
        for (double& w : log.w_m_rad_s) w = -w;
    });
    doubted("unit and sign", [](Log& log) {
        for (double& w : log.w_m_rad_s) w *= 30.0 / M_PI;
    });
    TEST_ASSERT_TRUE(std::any_of(turned.notes.begin(), turned.notes.end(),
                                 [](const std::string& n) { return n.find("unit and sign") != std::string::npos; }));
}

}  // namespace

// One percent of noise: the rows held out confirm a Stribeck friction that may be nothing by its deviation, and less is
// left without a name than it takes. A name whose value may be nothing is none.
static void a_name_without_a_value_is_taken_back(void)
{
    const TraceResult result = dqw::trace({simulated("effect_friction", {"seed=9516"})});
    const auto is_it = [](const auto& x) { return x.name == "stribeck_friction"; };
    TEST_ASSERT_TRUE(std::none_of(result.effects.begin(), result.effects.end(), is_it));
    const auto rejected = std::find_if(result.rejected.begin(), result.rejected.end(), is_it);
    TEST_ASSERT_TRUE(rejected != result.rejected.end());
    TEST_ASSERT_EQUAL_STRING("fitted, its parameters are not told from nothing", rejected->why.c_str());
}

int main()
{
    UNITY_BEGIN();
    RUN_TEST(clean_log_has_nothing);
    RUN_TEST(a_law_of_noisy_columns_is_not_named_as_a_shift);
    RUN_TEST(pulses_within_a_period_have_no_name);
    RUN_TEST(a_voltage_of_the_row_before_is_told_its_key);
    RUN_TEST(pulses_of_a_long_period_have_no_name);
    RUN_TEST(offset_below_the_pulses_own_is_named);
    RUN_TEST(heat_below_the_pulses_own_is_named);
    RUN_TEST(iron_is_mapped_though_its_rest_looks_like_noise);
    RUN_TEST(the_wrong_one_of_two_goes_for_the_right_one);
    RUN_TEST(a_gain_meets_the_resistance_of_the_row);
    RUN_TEST(a_dead_time_beside_a_sensors_offset);
    RUN_TEST(a_dead_time_beside_currents_of_another_instant);
    RUN_TEST(a_sensor_beside_iron_that_saturates);
    RUN_TEST(losses_told_at_a_later_instant);
    RUN_TEST(currents_told_from_the_middle_of_their_pulses);
    RUN_TEST(late_currents_run_without_what_the_voltage_lacks);
    RUN_TEST(a_magnet_that_warms_beside_an_angle_is_counted_once);
    RUN_TEST(a_late_voltage_has_no_jumps_of_an_offset);
    RUN_TEST(currents_told_between_pulses_are_named);
    RUN_TEST(late_currents_and_an_angle_that_is_off_are_both_told);
    RUN_TEST(currents_told_behind_the_pulses_middle_are_named);
    RUN_TEST(a_leg_that_rests_may_lose_voltage_too);
    RUN_TEST(unlike_phases_show_at_one_angle);
    RUN_TEST(a_loss_that_noise_hides_is_in_the_deviation_of_R);
    RUN_TEST(dead_time_does_not_stay_in_R);
    RUN_TEST(what_a_controller_gives_back_is_apart_from_what_it_loses);
    RUN_TEST(a_link_sags_as_its_capacitor_lets_it);
    RUN_TEST(much_noise_is_no_nonsense);
    RUN_TEST(upper_legs_that_rest_without_an_angle);
    RUN_TEST(firmware_is_given_the_width_of_its_own_law);
    RUN_TEST(each_single_effect_is_named);
    RUN_TEST(deviations_cover_the_errors);
    RUN_TEST(what_is_not_proved_is_in_the_deviations);
    RUN_TEST(what_looks_alike_is_in_an_effects_deviation_too);
    RUN_TEST(disturbance_outside_the_catalogue_gets_no_name);
    RUN_TEST(dropped_samples_are_a_fault_of_the_record);
    RUN_TEST(clipped_sensors_are_a_fault_of_the_record);
    RUN_TEST(short_logs_are_judged_on_some_rows);
    RUN_TEST(exact_logs_have_no_second_name);
    RUN_TEST(too_few_rows_to_hold_some_out_are_refused);
    RUN_TEST(measured_sweeps_are_dead_time);
    RUN_TEST(delay_beyond_one_period);
    RUN_TEST(heat_that_no_current_drives_is_in_the_deviation_of_R);
    RUN_TEST(pole_pairs_are_those_that_explain_the_log);
    RUN_TEST(voltage_may_turn_with_the_rotor);
    RUN_TEST(log_that_is_not_what_the_format_says);
    RUN_TEST(a_name_without_a_value_is_taken_back);
    return UNITY_END();
}
