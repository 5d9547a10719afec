// Filters of a drive with an inverter, an encoder and converters, told from its log: the truth is the simulator's.
// Plain only: long, and what it runs others run under the sanitizers.
#include <algorithm>
#include <cmath>
#include <string>

#include "ref/trace/trace.hpp"
#include "sharp_edges.hpp"
#include "simulated.hpp"
#include "unity.h"

extern "C" void setUp(void) {}
extern "C" void tearDown(void) {}

namespace {

using dqw::Estimate;
using dqw::TraceEffect;
using dqw::TraceResult;

/// With the effects that such a drive has the most of: all of the catalogue take minutes.
TraceResult traced(const char* scenario, const std::vector<std::string>& settings,
                   const std::vector<std::string>& effects = {"dead_time", "sensor_lag"})
{
    dqw::TraceOptions options;
    options.effects = effects;
    return dqw::trace({simulated(scenario, settings)}, options);
}

const TraceEffect& effect(const TraceResult& r, const char* name)
{
    for (const TraceEffect& e : r.effects)
        if (e.name == name) return e;
    TEST_FAIL_MESSAGE(name);
    return r.effects.front();
}

/// Within three deviations, which are no larger than `most_sd`.
void is(double truth, double most_sd, const std::vector<Estimate>& in, const char* name)
{
    for (const Estimate& e : in) {
        if (e.name != name) continue;
        TEST_ASSERT_TRUE_MESSAGE(e.sd > 0.0 && e.sd < most_sd, name);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(3.0 * e.sd, truth, e.value, name);
        return;
    }
    TEST_FAIL_MESSAGE(name);
}

/// The winding's resistance and a switch's are in series.
void filter_of_the_currents_under_a_clamped_leg()
{
    const TraceResult r = traced("drive_clamped_joint",
                                 {"seed=90212", "sensing.filter_s=30e-6", "sensing.speed_bandwidth_rad_s=0"});
    TEST_ASSERT_EQUAL_STRING("explained", r.verdict.c_str());
    TEST_ASSERT_EQUAL_size_t(2, r.effects.size());
    effect(r, "dead_time");
    const TraceEffect& lag = effect(r, "sensor_lag");
    TEST_ASSERT_EQUAL_STRING("currents", lag.channel.c_str());
    is(30e-6, 10e-6, lag.parameters, "tau_s");
    is(0.52, 0.01, r.after.parameters, "R_ohm");
    is(1.0e-3, 2e-5, r.after.parameters, "Ld_H");
    is(1.4e-3, 3e-5, r.after.parameters, "Lq_H");
    is(0.02, 5e-5, r.after.parameters, "psi_Wb");
}

/// Noise of the currents turns over what a leg loses in the few rows where its current is about zero: what is left is
/// noise, of that size.
void a_dead_time_in_noise_is_no_structure()
{
    const TraceResult r = traced("drive_clamped", sharp_edges());
    TEST_ASSERT_EQUAL_STRING("explained", r.verdict.c_str());
    TEST_ASSERT_EQUAL_size_t(1, r.effects.size());
    is(5.02, 0.3, effect(r, "dead_time").parameters, "voltage_V");
    is(0.9, 0.06, r.after.parameters, "R_ohm");
    TEST_ASSERT_DOUBLE_WITHIN(0.25, 1.05, r.after.heldout_rms / r.noise_floor);
}

/// A tracking loop makes the speed of the encoder's angle: of two poles at w, it lags by 2/w.
void loop_that_tracks_the_angle_is_a_filter_of_the_speed()
{
    const TraceResult r = traced("drive_clamped", {"seed=90211", "sensing.speed_bandwidth_rad_s=600"});
    effect(r, "dead_time");
    const TraceEffect& lag = effect(r, "sensor_lag");
    TEST_ASSERT_EQUAL_STRING("speed", lag.channel.c_str());
    is(2.0 / 600.0, 1.2e-3, lag.parameters, "tau_s");
}

/// Where the speed is filtered and the currents too, one filter has the name; no shift of the currents is named in
/// place of the other, unless the filter is said to be as good.
void filter_beside_a_filter_is_no_shift()
{
    const TraceResult r = traced(
        "drive_clamped_joint",
        {"seed=90212", "duration_s=1", "sensing.filter_s=30e-6", "sensing.speed_bandwidth_rad_s=600"},
        {"dead_time", "sensor_lag", "sample_shift", "iron_loss"});
    effect(r, "dead_time");
    is(2.0 / 600.0, 0.3e-3, effect(r, "sensor_lag").parameters, "tau_s");
    for (const TraceEffect& e : r.effects) {
        if (e.name != "sample_shift") continue;
        const auto& alike = e.confusable_with;
        TEST_ASSERT_TRUE(std::find(alike.begin(), alike.end(), "sensor_lag") != alike.end());
    }
    is(0.52, 0.02, r.after.parameters, "R_ohm");
    is(1.0e-3, 4e-5, r.after.parameters, "Ld_H");
    is(1.4e-3, 5e-5, r.after.parameters, "Lq_H");
    is(0.02, 1.5e-4, r.after.parameters, "psi_Wb");
}

/// Slower than the rows are apart, on a shaft that its torque speeds up: voltages of six periods alone, and a speed that
/// stays, had L_q .09 % off, at 17 deviations.
void filter_slower_than_a_row_of_a_shaft_that_speeds_up()
{
    const TraceResult r = traced("servo", {"duration_s=1", "noise=0.001", "sensing.filter_s=1.3e-4"}, {"sensor_lag"});
    TEST_ASSERT_EQUAL_STRING("explained", r.verdict.c_str());
    TEST_ASSERT_TRUE(r.after.heldout_rms < 1.06 * r.noise_floor);
    is(130e-6, 1e-7, effect(r, "sensor_lag").parameters, "tau_s");
    is(0.9, 5e-4, r.after.parameters, "R_ohm");
    is(2.2e-3, 5e-7, r.after.parameters, "Ld_H");
    is(2.8e-3, 5e-7, r.after.parameters, "Lq_H");
}

/// Pulses of the last periods had other duties where the voltage steps in each: as if all were the last's, the deviation
/// of L_d was 33 times this, and what the fit left .73 of a floor that had it.
void pulses_behind_a_filter_have_duties_of_their_own()
{
    const TraceResult r = traced("servo",
                                 {"inverter.modulation=centred", "method=rk4", "sensing.filter_s=8e-5", "noise=0.0005",
                                  "noise.v=0", "duration_s=0.8"},
                                 {"sensor_lag"});
    TEST_ASSERT_EQUAL_STRING("explained", r.verdict.c_str());
    TEST_ASSERT_TRUE(std::abs(r.after.heldout_rms / r.noise_floor - 1.0) < 0.1);
    TEST_ASSERT_DOUBLE_WITHIN(8e-8, 80e-6, effect(r, "sensor_lag").parameters.at(0).value);
    is(2.2e-3, 5e-7, r.after.parameters, "Ld_H");
    is(2.8e-3, 1e-6, r.after.parameters, "Lq_H");
}

}  // namespace

int main()
{
    UNITY_BEGIN();
    RUN_TEST(a_dead_time_in_noise_is_no_structure);
    RUN_TEST(filter_of_the_currents_under_a_clamped_leg);
    RUN_TEST(loop_that_tracks_the_angle_is_a_filter_of_the_speed);
    RUN_TEST(filter_beside_a_filter_is_no_shift);
    RUN_TEST(filter_slower_than_a_row_of_a_shaft_that_speeds_up);
    RUN_TEST(pulses_behind_a_filter_have_duties_of_their_own);
    return UNITY_END();
}
