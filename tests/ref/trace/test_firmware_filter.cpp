// Currents that firmware has filtered: the filter is run here, on the simulator's log and on a sequence by hand.
// Plain only: long, and what it runs others run under the sanitizers.
#include "ref/trace/firmware_filter.hpp"

#include <cmath>
#include <complex>
#include <string>

#include "ref/search/select.hpp"
#include "ref/trace/setup.hpp"
#include "ref/trace/trace.hpp"
#include "simulated.hpp"
#include "unity.h"

extern "C" void setUp(void) {}
extern "C" void tearDown(void) {}

namespace {

using Complex = std::complex<double>;
using dqw::Estimate;
using dqw::Log;
using dqw::TraceResult;

/// The currents of `l` as y += (i - y)/(1 + rows) of one frame has them, from rest at the first row.
void filter(Log& l, double rows, bool stator)
{
    const double p = l.machine.pole_pairs.value();
    Complex y(l.i_d_A[0], l.i_q_A[0]);
    for (std::size_t k = 1; k < l.rows(); ++k) {
        const double w_e = 0.5 * p * (l.w_m_rad_s[k - 1] + l.w_m_rad_s[k]);
        if (stator) y *= std::polar(1.0, -w_e * l.dt_s);
        y += (Complex(l.i_d_A[k], l.i_q_A[k]) - y) / (1.0 + rows);
        l.i_d_A[k] = y.real(), l.i_q_A[k] = y.imag();
    }
}

const Estimate* of(const std::vector<Estimate>& in, const char* name)
{
    for (const Estimate& e : in)
        if (name == e.name) return &e;
    TEST_FAIL_MESSAGE(name);
    return nullptr;
}

/// Within three deviations, or 1 %; deviations below `most_part` of it.
void is(double truth, double most_part, const std::vector<Estimate>& in, const char* name)
{
    const Estimate& e = *of(in, name);
    TEST_ASSERT_TRUE_MESSAGE(e.sd > 0.0 && e.sd < most_part * truth, (e.name + " " + std::to_string(e.sd)).c_str());
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(std::max(3.0 * e.sd, 0.01 * truth), truth, e.value, name);
}

void what_was_before_it_comes_back()
{
    const Log good = simulated("servo", {"duration_s=0.05"}, Beside::nothing);
    for (const bool stator : {false, true}) {
        std::vector<Log> logs{good};
        filter(logs[0], 2.5, stator);
        const double p = good.machine.pole_pairs.value();
        const Log back = dqw::before_filter(logs, p, {2.5, 0.0, stator}).front();
        for (std::size_t k = 1; k < good.rows(); ++k) {
            TEST_ASSERT_DOUBLE_WITHIN(1e-9, good.i_d_A[k], back.i_d_A[k]);
            TEST_ASSERT_DOUBLE_WITHIN(1e-9, good.i_q_A[k], back.i_q_A[k]);
        }
        // The other frame's is none of it.
        const Log other = dqw::before_filter(logs, p, {2.5, 0.0, !stator}).front();
        TEST_ASSERT_TRUE(std::abs(other.i_q_A[400] - good.i_q_A[400]) > 0.01);
    }
    // Two stretches know nothing of each other.
    Log two = good;
    two.segments = {0, 100};
    const Log apart = dqw::before_filter({two}, 3.0, {2.0, 0.0, false}).front();
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, good.i_q_A[100] + 2.0 * (good.i_q_A[101] - good.i_q_A[100]), apart.i_q_A[100]);
}

/// Half a row to six, of either frame; beside a dead time too, and where hardly any noise makes the likelihood steep.
void filters_are_named_with_their_time_constant()
{
    const struct {
        double rows;
        bool stator;
        bool dead_time;
        double noise, most_part;  ///< of the rated values; deviation of the time constant
    } cases[] = {{0.6, false, false, 0.01, 0.1},
                 {1.0, true, false, 0.01, 0.1},
                 {3.0, false, true, 0.01, 0.1},
                 {3.0, false, false, 0.0005, 0.0025},
                 {1.5, true, false, 0.0005, 0.005}};
    int seed = 60580;
    for (const auto& c : cases) {
        std::vector<std::string> settings{"duration_s=0.5", "seed=" + std::to_string(seed++),
                                          "noise=" + std::to_string(c.noise)};
        if (c.dead_time) settings.insert(settings.end(), {"nonideal.dead_time_V=4", "nonideal.dead_time_width_A=0.15"});
        std::vector<Log> logs{simulated("servo", settings, Beside::nothing)};
        filter(logs[0], c.rows, c.stator);
        dqw::TraceOptions options;
        options.effects = {"sensor_lag", "dead_time"};
        if (!c.dead_time) options.effects.insert(options.effects.end(), {"delay", "sample_shift", "iron_loss"});
        const TraceResult r = dqw::trace(logs, options);
        const std::string what = std::to_string(c.rows) + (c.dead_time ? " beside dead time" : "");
        TEST_ASSERT_EQUAL_STRING_MESSAGE("explained", r.verdict.c_str(), what.c_str());
        TEST_ASSERT_EQUAL_size_t_MESSAGE(c.dead_time ? 2 : 1, r.effects.size(), what.c_str());
        TEST_ASSERT_EQUAL_STRING("sensor_lag", r.effects[0].name.c_str());
        TEST_ASSERT_EQUAL_STRING("currents", r.effects[0].channel.c_str());
        is(c.rows * logs[0].dt_s, c.most_part, r.effects[0].parameters, "tau_s");
        if (c.noise < 0.001)
            TEST_ASSERT_DOUBLE_WITHIN(0.2e-6, c.rows * logs[0].dt_s, of(r.effects[0].parameters, "tau_s")->value);
        is(0.9, 0.06, r.after.parameters, "R_ohm");
        is(2.2e-3, 0.05, r.after.parameters, "Ld_H");
        is(2.8e-3, 0.05, r.after.parameters, "Lq_H");
        is(0.12, 0.02, r.after.parameters, "psi_Wb");
        TEST_ASSERT_TRUE(r.after.heldout_rms < 1.3 * r.noise_floor && r.after.heldout_rms > 0.7 * r.noise_floor);
        TEST_ASSERT_TRUE(r.before.heldout_rms > r.after.heldout_rms);
    }
}

/// Of currents that are sampled 0.9 us late the filter's rows take a part, unless that stands beside them.
void an_instant_beside_a_filter_is_none_of_its_rows()
{
    std::vector<Log> logs{simulated(
        "servo", {"duration_s=0.5", "seed=60693", "noise=0.0005", "sensing.late_periods=0.009"}, Beside::nothing)};
    Log& log = logs[0];
    const double late_s = 0.009 * log.dt_s;
    filter(log, 4.0, true);
    const double p = log.machine.pole_pairs.value();
    const auto setup = dqw::trace_setup(logs, {"coulomb_friction"}, dqw::Variant::usual, p);
    const dqw::Point plain = dqw::refine_gains(setup->search(), setup->starts.front(), 12).point;
    const auto off = [&](bool sampling) {
        const auto fit = dqw::fit_filter(logs, p, plain, 4.0, sampling);
        TEST_ASSERT_TRUE(fit && fit->filter.stator && fit->filter.sd < 0.002);
        return std::abs(fit->filter.rows - 4.0) / fit->filter.sd;
    };
    TEST_ASSERT_TRUE_MESSAGE(off(true) < 3.0, "beside it");
    TEST_ASSERT_TRUE_MESSAGE(off(false) > 5.0, "without it");
    dqw::TraceOptions options;
    options.effects = {"sensor_lag", "sample_shift", "delay", "iron_loss"};
    const TraceResult r = dqw::trace(logs, options);
    TEST_ASSERT_EQUAL_STRING("explained", r.verdict.c_str());
    TEST_ASSERT_EQUAL_size_t(2, r.effects.size());
    TEST_ASSERT_EQUAL_STRING("sensor_lag", r.effects[0].name.c_str());
    TEST_ASSERT_EQUAL_STRING("sample_shift", r.effects[1].name.c_str());
    is(4.0 * log.dt_s, 1.6e-3, r.effects[0].parameters, "tau_s");
    // Without the instant beside it 1.5 us.
    TEST_ASSERT_DOUBLE_WITHIN(0.1e-6, 4.0 * log.dt_s, of(r.effects[0].parameters, "tau_s")->value);
    is(late_s, 0.02, r.effects[1].parameters, "shift_s");
    is(2.2e-3, 4e-3, r.after.parameters, "Ld_H");
    is(2.8e-3, 4e-3, r.after.parameters, "Lq_H");
}

/// Eddies that take no more of the currents than a converter leaves, L/R_fe = 0.4 us, are in the filter's rows where
/// nothing tells them: 13 deviations, were the instant known.
void what_a_converter_leaves_is_in_the_deviation_of_a_filter()
{
    std::vector<Log> logs{simulated(
        "servo", {"duration_s=0.5", "seed=60721", "noise=0.002", "nonideal.iron_loss_S=1.5e-4"}, Beside::nothing)};
    filter(logs[0], 1.0, false);
    dqw::TraceOptions options;
    options.effects = {"sensor_lag", "sample_shift", "iron_loss", "delay"};
    const TraceResult r = dqw::trace(logs, options);
    TEST_ASSERT_EQUAL_STRING("explained", r.verdict.c_str());
    TEST_ASSERT_EQUAL_size_t(1, r.effects.size());
    const Estimate& tau = *of(r.effects[0].parameters, "tau_s");
    const double off_s = std::abs(tau.value - logs[0].dt_s);
    TEST_ASSERT_TRUE_MESSAGE(off_s > 0.2e-6 && off_s < 2.0 * tau.sd && tau.sd < 0.7e-6,
                             (std::to_string(1e6 * tau.value) + " +- " + std::to_string(1e6 * tau.sd) + " us").c_str());
    const Estimate& Ld = *of(r.after.parameters, "Ld_H");
    TEST_ASSERT_TRUE(std::abs(Ld.value - 2.2e-3) < 2.0 * Ld.sd && Ld.sd < 2e-3 * 2.2e-3);
}

/// A mean over seven rows is no such filter, a filter of the continuous kind is one only where it is as slow.
void what_is_no_such_filter_is_not_named_so()
{
    std::vector<Log> logs{simulated("servo", {"duration_s=0.5", "seed=60590"}, Beside::nothing)};
    const Log good = logs[0];
    constexpr std::size_t kMean = 7;
    for (std::size_t k = kMean; k < good.rows(); ++k)
        for (auto* column : {&logs[0].i_d_A, &logs[0].i_q_A}) {
            const std::vector<double>& from = column == &logs[0].i_d_A ? good.i_d_A : good.i_q_A;
            double sum = 0.0;
            for (std::size_t n = 0; n < kMean; ++n) sum += from[k - n];
            (*column)[k] = sum / kMean;
        }
    dqw::TraceOptions options;
    options.effects = {"sensor_lag", "dead_time", "delay"};
    const TraceResult mean = dqw::trace(logs, options);
    TEST_ASSERT_EQUAL_STRING("unexplained", mean.verdict.c_str());
    TEST_ASSERT_EQUAL_size_t(0, mean.effects.size());
    // Nor is one tried where nobody asks for its name.
    std::vector<Log> filtered{good};
    filter(filtered[0], 3.0, false);
    options.effects = {"dead_time", "delay"};
    for (const dqw::TraceEffect& e : dqw::trace(filtered, options).effects)
        TEST_ASSERT_TRUE_MESSAGE(e.name != "sensor_lag", e.name.c_str());
}

}  // namespace

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(what_was_before_it_comes_back);
    RUN_TEST(filters_are_named_with_their_time_constant);
    RUN_TEST(an_instant_beside_a_filter_is_none_of_its_rows);
    RUN_TEST(what_a_converter_leaves_is_in_the_deviation_of_a_filter);
    RUN_TEST(what_is_no_such_filter_is_not_named_so);
    return UNITY_END();
}
