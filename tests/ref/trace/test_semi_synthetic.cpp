// The tracer on the simulator driven by what was measured, and told nothing of it: flux maps of real machines, curves
// of a real inverter.
// The judge is the measurement itself.
// Plain only: long, and what it runs others run under the sanitizers.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>

#include "ref/trace/trace.hpp"
#include "simulated.hpp"
#include "flux_table.hpp"
#include "unity.h"

extern "C" void setUp(void) {}
extern "C" void tearDown(void) {}

namespace {

using dqw::TraceResult;
using Table = std::vector<std::vector<double>>;  ///< rows of a CSV file whose heading is left out

std::string data(const std::string& name)
{
    const char* folder = std::getenv("DATA");
    return std::string(folder != nullptr && *folder != '\0' ? folder : "../shared/data") + "/" + name + ".csv";
}

std::string scratch(const std::string& name)
{
    const char* build = std::getenv("BUILD");
    return std::string(build != nullptr ? build : "build") + "/tests/semi_synthetic_" + name;
}

#define NEED(name)                                                                                                     \
    if (!std::ifstream(data(name))) TEST_IGNORE_MESSAGE("measured data are not there: set DATA")

Table numbers(const std::string& path)
{
    Table table;
    std::ifstream file(path);
    std::string line, cell;
    for (std::getline(file, line); std::getline(file, line);) {
        table.emplace_back();
        for (std::istringstream row(line); std::getline(row, cell, ',');)
            table.back().push_back(std::strtod(cell.c_str(), nullptr));
    }
    return table;
}

TraceResult traced(const std::vector<std::string>& settings)
{
    const TraceResult r = dqw::trace({simulated("servo", settings, Beside::nothing)});
    std::printf("%s:", r.verdict.c_str());
    for (const dqw::TraceEffect& e : r.effects) std::printf(" %s", e.name.c_str());
    for (const dqw::Estimate& e : r.after.parameters) std::printf("; %s %.5g (%.2g)", e.name.c_str(), e.value, e.sd);
    std::printf("; %.4g V before, %.4g V after, floor %.4g V\n", r.before.heldout_rms, r.after.heldout_rms,
                r.noise_floor);
    return r;
}

double value(const std::vector<dqw::Estimate>& list, const char* name)
{
    for (const dqw::Estimate& e : list)
        if (e.name == name) return e.value;
    TEST_FAIL_MESSAGE(name);
    return 0.0;
}

const dqw::TraceEffect* effect(const TraceResult& r, const char* name)
{
    for (const dqw::TraceEffect& e : r.effects)
        if (e.name == name) return &e;
    return nullptr;
}

/// Weights of an input as its law states them, and its base current.
std::vector<double> weights(const TraceResult& r, const char* name, double& base_A)
{
    for (const dqw::TraceInput& i : r.inputs)
        if (i.effect == name) {
            base_A = i.shape.at(0);
            return i.weights;
        }
    TEST_FAIL_MESSAGE(name);
    return {};
}

/// What the inputs for firmware add to the plain model's flux: by polynomials, (E52) and (E53), or a map's table.
std::array<double, 2> bend_in_firmware(const TraceResult& r, double i_d_A, double i_q_A)
{
    for (const dqw::TraceInput& i : r.inputs)
        if (i.effect == "flux_map") return bend_of(i, i_d_A, i_q_A);
    double base_A = 1.0;
    const std::vector<double> s = weights(r, "saturation", base_A), c = weights(r, "cross_saturation", base_A);
    const double x = i_d_A / base_A, y = i_q_A / base_A;
    return {s[0] * x * x + s[1] * x * x * x + s[2] * std::pow(x, 4) + c[0] * y * y + 2 * c[1] * x * y * y +
                c[2] * std::pow(y, 4),
            s[3] * y * y * y + s[4] * std::pow(y, 5) + 2 * c[0] * x * y + 2 * c[1] * x * x * y +
                4 * c[2] * x * y * y * y};
}

/// Flux that the tracer's model has for firmware, against the map's at its points within the currents of the log: RMS
/// difference over RMS deviation of the map from its mean, the worse axis.
double flux_error(const TraceResult& r, const Table& map, double least_d_A, double most_d_A, double most_q_A)
{
    const double Ld = value(r.after.parameters, "Ld_H"), Lq = value(r.after.parameters, "Lq_H"),
                 psi = value(r.after.parameters, "psi_Wb");
    const dqw::TraceEffect* offset = effect(r, "angle_offset");
    const double turn = offset ? value(offset->parameters, "angle_rad") : 0.0;
    double wrong[2] = {}, sum[2] = {}, square[2] = {}, n = 0;
    for (const std::vector<double>& p : map) {
        if (p[0] < least_d_A || p[0] > most_d_A || std::fabs(p[1]) > most_q_A) continue;
        const std::array<double, 2> bend = bend_in_firmware(r, p[0], p[1]);
        const double flux[2] = {psi + Ld * p[0] + turn * (Lq - Ld) * p[1] + bend[0],
                                Lq * p[1] + turn * ((Lq - Ld) * p[0] - psi) + bend[1]};
        for (int k = 0; k < 2; ++k)
            wrong[k] += std::pow(flux[k] - p[2 + k], 2), sum[k] += p[2 + k], square[k] += p[2 + k] * p[2 + k];
        ++n;
    }
    TEST_ASSERT_TRUE(n > 10);
    double worst = 0.0;
    for (int k = 0; k < 2; ++k) worst = std::max(worst, std::sqrt(wrong[k] / (square[k] - sum[k] * sum[k] / n)));
    std::printf("flux off by %.2f %% at %g points of the map\n", 100 * worst, n);
    return worst;
}

/// Of the measured points where the log was: RMS error of the map over the largest flux there, percent, and how many
/// are within two deviations of either axis.
void map_is_the_measured_one(const TraceResult& r, const Table& measured, double least, double most)
{
    double square = 0, largest = 0, within = 0, n = 0;
    for (const std::vector<double>& p : measured) {
        const dqw::FluxNode at = dqw::between(r.map, p[0], p[1]);
        if (!at.seen) continue;
        const double e_d = at.psi_d_Wb - p[2], e_q = at.psi_q_Wb - p[3];
        square += e_d * e_d + e_q * e_q, largest = std::max(largest, std::hypot(p[2], p[3])), ++n;
        within += 0.5 * (std::fabs(e_d) <= 2 * at.sd_d_Wb) + 0.5 * (std::fabs(e_q) <= 2 * at.sd_q_Wb);
    }
    TEST_ASSERT_TRUE(n > 10);
    const double percent = 100 * std::sqrt(square / n) / largest;
    std::printf("map off by %.3f %% at %g points, %.0f %% of them within two deviations\n", percent, n,
                100 * within / n);
    TEST_ASSERT_TRUE(percent > least && percent < most);
}

/// Measured: R 0.5101 of 0.51 ohm, 0.138 V before, 0.068 V after; flux within 0.6 %. The map's own d axis is turned:
/// psi_q is not 0 without current.
void map_of_the_servo_am8141()
{
    NEED("flux_map_am8141");
    const TraceResult r = traced({"machine.flux_map=" + data("flux_map_am8141"), "machine.R_ohm=0.51",
                                  "profile.shaft=imposed", "profile.control=current", "profile.i_d_A=-3.5",
                                  "profile.i_d_A.random=3", "profile.i_q_A.random=6.5"});
    TEST_ASSERT_NOT_NULL(effect(r, "saturation"));
    TEST_ASSERT_NOT_NULL(effect(r, "cross_saturation"));
    const Table map = numbers(data("flux_map_am8141"));
    double least = 1.0, most = 0.0;
    for (const std::vector<double>& p : map)
        if (p[1] == 0) least = std::min(least, -p[3] / p[2]), most = std::max(most, -p[3] / p[2]);
    const dqw::TraceEffect* turned = effect(r, "angle_offset");
    TEST_ASSERT_EQUAL_size_t(turned ? 3 : 2, r.effects.size());
    if (turned)
        TEST_ASSERT_TRUE(value(turned->parameters, "angle_rad") > least &&
                         value(turned->parameters, "angle_rad") < most);
    TEST_ASSERT_DOUBLE_WITHIN(0.02 * 0.51, 0.51, value(r.after.parameters, "R_ohm"));
    TEST_ASSERT_DOUBLE_WITHIN(0.03, 0.138, r.before.heldout_rms);
    TEST_ASSERT_DOUBLE_WITHIN(0.005, 0.068, r.after.heldout_rms);
    TEST_ASSERT_TRUE(flux_error(r, map, -8, 0, 8) < 0.007);
}

/// Measured: R 0.6301 of 0.63 ohm, 5.2 V before, 0.47 V after; firmware's flux off by 6.6 %, its map by 0.32 %. A
/// synchronous-reluctance motor: L_q falls to a third within 8 A.
void map_of_the_reluctance_motor_baldor()
{
    NEED("flux_map_baldor");
    const TraceResult r = traced({"machine.flux_map=" + data("flux_map_baldor"), "machine.R_ohm=0.63",
                                  "machine.pole_pairs=2", "profile.shaft=imposed", "profile.control=current",
                                  "profile.speed_rad_s.wave=30", "drive.v_dc_V=560",
                                  "drive.current_bandwidth_rad_s=300", "profile.i_d_A=-5", "profile.i_d_A.random=3",
                                  "profile.i_d_A.random_hold_s=0.02", "profile.i_q_A.random=8",
                                  "profile.i_q_A.random_hold_s=0.031", "noise=0.002"});
    TEST_ASSERT_NOT_NULL(effect(r, "saturation"));
    TEST_ASSERT_NOT_NULL(effect(r, "cross_saturation"));
    TEST_ASSERT_EQUAL_size_t(2, r.effects.size());
    TEST_ASSERT_DOUBLE_WITHIN(0.002 * 0.63, 0.63, value(r.after.parameters, "R_ohm"));
    TEST_ASSERT_DOUBLE_WITHIN(1.0, 5.2, r.before.heldout_rms);
    TEST_ASSERT_DOUBLE_WITHIN(0.09, 0.465, r.after.heldout_rms);
    TEST_ASSERT_DOUBLE_WITHIN(0.015, 0.066, flux_error(r, numbers(data("flux_map_baldor")), -8, -2, 6));
    map_is_the_measured_one(r, numbers(data("flux_map_baldor")), 0.2, 0.5);
}

/// Two seconds with wide steps: a polynomial that goes astray beyond the rows seen hides from names what one axis does
/// to the other, and the map has it nevertheless. Judged by few blocks that lie far out, it was 1.4 % off at 3 %.
void map_of_wide_steps(const char* seed, const char* duration)
{
    const TraceResult r = dqw::trace({simulated("servo",
                                                {"machine.flux_map=" + data("flux_map_baldor"),
                                                 "machine.R_ohm=0.63",
                                                 "machine.pole_pairs=2",
                                                 "profile.shaft=imposed",
                                                 "profile.control=current",
                                                 "profile.speed_rad_s.wave=40",
                                                 "drive.v_dc_V=560",
                                                 "drive.i_max_A=16",
                                                 "drive.current_bandwidth_rad_s=300",
                                                 "profile.i_d_A=-5",
                                                 "profile.i_d_A.random=4",
                                                 "profile.i_d_A.random_hold_s=0.05",
                                                 "profile.i_q_A.random=9",
                                                 "profile.i_q_A.random_hold_s=0.031",
                                                 "profile.v_d_V.binary=0",
                                                 "profile.v_q_V.binary=0",
                                                 duration,
                                                 "noise=0.01",
                                                 "noise.w=0.0005",
                                                 seed},
                                                Beside::nothing)},
                                     {{"saturation", "cross_saturation"}, {}});
    TEST_ASSERT_FALSE(r.map.empty());
    map_is_the_measured_one(r, numbers(data("flux_map_baldor")), 0.1, 0.5);
    double square = 0, most = 0, n = 0;
    for (const dqw::FluxNode& node : r.map.nodes)
        if (node.seen)
            square += node.sd_d_Wb * node.sd_d_Wb + node.sd_q_Wb * node.sd_q_Wb,
                most = std::max(most, std::hypot(node.psi_d_Wb, node.psi_q_Wb)), ++n;
    const double percent = 100 * std::sqrt(square / n) / most;
    std::printf("its deviation is %.3f %%\n", percent);
    TEST_ASSERT_TRUE(percent > 0.03 && percent < 0.5);
}

void map_of_a_log_with_wide_steps()
{
    NEED("flux_map_baldor");
    map_of_wide_steps("seed=51", "duration_s=2");
    // Far off in the stretches held out a map did not find back over all rows, and was 2 % off; a polynomial leads
    // there.
    map_of_wide_steps("seed=1061", "duration_s=4");
}

/// Of 4 s of steps with no signal beside, at 1 % noise.
TraceResult traced_steps(const std::vector<std::string>& settings)
{
    std::vector<std::string> all = {"machine.R_ohm=0.51",
                                    "profile.shaft=imposed",
                                    "profile.control=current",
                                    "profile.i_d_A=-3.5",
                                    "profile.i_d_A.random=3",
                                    "profile.i_d_A.random_hold_s=0.05",
                                    "profile.i_q_A.random=6.5",
                                    "profile.i_q_A.random_hold_s=0.031",
                                    "profile.v_d_V.binary=0",
                                    "profile.v_q_V.binary=0",
                                    "duration_s=4",
                                    "noise=0.01",
                                    "seed=34"};
    all.insert(all.end(), settings.begin(), settings.end());
    // A speed sensor has no such noise, whatever the currents have.
    all.emplace_back("noise.w=0.0005");
    return dqw::trace({simulated("servo", all, Beside::nothing)},
                      {{"saturation", "cross_saturation", "angle_offset", "dead_time"}, {}});
}

/// Iron that bends by a tenth of a percent of the flux has no name at 1 % noise, and a map: rows held out confirm it.
/// At 3 % they gain 220 nats, half of them in one stretch of ten.
void map_of_a_bend_without_a_name()
{
    NEED("flux_map_am8141");
    for (const auto& drawn : {std::array<const char*, 2>{"seed=34", "noise=0.01"}, {"seed=51", "noise=0.03"}}) {
        const TraceResult r = traced_steps({"machine.flux_map=" + data("flux_map_am8141"), drawn[0], drawn[1]});
        TEST_ASSERT_NULL(effect(r, "saturation"));
        TEST_ASSERT_FALSE_MESSAGE(r.map.empty(), drawn[1]);
        map_is_the_measured_one(r, numbers(data("flux_map_am8141")), 0.01, 0.3);
    }
}

/// The servo as it is, more salient, and its magnet alone; least, usual and most noise.
void linear_machine_has_no_map()
{
    int seed = 950;
    for (const char* machine : {"machine.Lq_H=2.8e-3", "machine.Lq_H=7e-3", "machine.Lq_H=2.2e-3"})
        for (const char* noise : {"noise=0.003", "noise=0.01", "noise=0.03"}) {
            const std::string drawn = "seed=" + std::to_string(++seed);
            const TraceResult r = traced_steps({drawn, machine, noise, "duration_s=1"});
            TEST_ASSERT_EQUAL_size_t_MESSAGE(0, r.effects.size(), drawn.c_str());
            TEST_ASSERT_TRUE_MESSAGE(r.map.empty(), drawn.c_str());
        }
}

/// Its currents are a polynomial of the fluxes, so its fluxes are none of the currents.
void iron_that_no_polynomial_is_leaves_noise()
{
    const TraceResult r = dqw::trace({simulated("traction_ipm", {"noise=0.01", "seed=2301"})},
                                     {{"saturation", "cross_saturation"}, {}});
    TEST_ASSERT_EQUAL_STRING("explained", r.verdict.c_str());
    TEST_ASSERT_TRUE(r.before.heldout_rms > 4.0 * r.noise_floor);
    TEST_ASSERT_TRUE(r.after.heldout_rms < 1.3 * r.noise_floor);
    TEST_ASSERT_FALSE(r.map.empty());
}

/// Iron of i = psi/L (1 + .46 (psi/psi_9)^2), psi_9 = L 9 A, by its flux map, linear on d: two of L's powers are not its
/// law, and rows of 2 % noise do not want a map instead. L at rest hangs on which of the two it is: told by the
/// polynomial alone it was 3.4 % off, at 5.6 deviations.
void iron_of_an_unknown_law_has_its_deviation()
{
    constexpr double kL = 2.8e-3, kAmps = 9.0;
    const std::string path = scratch("unknown_law.csv");
    std::ofstream file(path);
    file.precision(12);
    file << "i_d_A,i_q_A,psi_d_Wb,psi_q_Wb\n";
    for (int d = -15; d <= 15; ++d)
        for (int q = -28; q <= 28; ++q) {
            const double i_d = 0.08 * kAmps * d, i_q = 0.05 * kAmps * q;
            double low = -2.0 * kL * kAmps, high = -low;
            for (int n = 0; n < 60; ++n) {
                const double flux = 0.5 * (low + high), part = flux / (kL * kAmps);
                (flux / kL * (1.0 + 0.46 * part * part) < i_q ? low : high) = flux;
            }
            file << i_d << ',' << i_q << ',' << 0.12 + 2.2e-3 * i_d << ',' << low << '\n';
        }
    file.close();
    const TraceResult r = traced({"machine.flux_map=" + path, "duration_s=0.6", "noise=0.02"});
    TEST_ASSERT_NOT_NULL(effect(r, "saturation"));
    const dqw::Estimate& L = r.after.parameters.at(2);
    TEST_ASSERT_EQUAL_STRING("Lq_H", L.name.c_str());
    TEST_ASSERT_DOUBLE_WITHIN(2.0 * L.sd, kL, L.value);
    TEST_ASSERT_DOUBLE_WITHIN(0.05 * kL, kL, L.value);
    // Of d, which does not bend, both laws say the same.
    const dqw::Estimate& L_d = r.after.parameters.at(1);
    TEST_ASSERT_DOUBLE_WITHIN(0.005 * 2.2e-3, 2.2e-3, L_d.value);
    TEST_ASSERT_TRUE(L_d.sd < 0.006 * 2.2e-3);
}

/// One step from rest to one current, of which the iron's bend is seen, and no map.
void one_current_is_no_map()
{
    NEED("flux_map_baldor");
    const TraceResult r = dqw::trace(
        {simulated("servo",
                   {"machine.flux_map=" + data("flux_map_baldor"), "machine.pole_pairs=2", "profile.control=current",
                    "profile.shaft=imposed", "profile.speed_rad_s=100", "profile.speed_rad_s.wave=0",
                    "profile.i_d_A=-2", "profile.i_d_A.random=0", "profile.i_q_A=5", "profile.i_q_A.random=0",
                    "profile.v_d_V.binary=0", "profile.v_q_V.binary=0", "duration_s=1"},
                   Beside::nothing)},
        {{"saturation", "cross_saturation"}, {}});
    TEST_ASSERT_NOT_NULL(effect(r, "saturation"));
    TEST_ASSERT_TRUE(r.map.empty());
}

/// What each phase loses, from a sweep of settled voltage against current: its odd half. Along beta, b and c carry
/// sqrt(3)/2 i: 2/sqrt(3) V of it is seen. Along alpha, phase a carries i and the others half of it: 2/3 (V(i) +
/// V(i/2)) is seen, to second order 4/3 V(3/4 i). The slope of V's upper half is R: a loss in proportion to the current
/// is a resistance.
Table curve_of(Table sweep, bool along_beta, double& R_ohm)
{
    std::sort(sweep.begin(), sweep.end(), [](const auto& a, const auto& b) { return a[2] < b[2]; });
    Table curve = {{0, 0}};
    const double part = along_beta ? std::sqrt(0.75) : 0.75;
    const std::size_t n = sweep.size();
    for (std::size_t k = n / 2 + 1; k < n; ++k)
        curve.push_back(
            {part * 0.5 * (sweep[k][2] - sweep[n - 1 - k][2]), part * 0.5 * (sweep[k][0] - sweep[n - 1 - k][0])});
    double s = 0, x = 0, y = 0, xx = 0, xy = 0;
    for (std::size_t k = curve.size() / 2; k < curve.size(); ++k) {
        const double a = curve[k][0], b = curve[k][1];
        ++s, x += a, y += b, xx += a * a, xy += a * b;
    }
    R_ohm = (s * xy - x * y) / (s * xx - x * x);
    for (std::vector<double>& p : curve) p[1] -= R_ohm * p[0];
    return curve;
}

void curve_of_an_inverter(const char* name, bool along_beta)
{
    double R_ohm = 0.0;
    const Table curve = curve_of(numbers(data(name)), along_beta, R_ohm);
    const std::string path = scratch("curve.csv");
    {
        std::ofstream file(path);
        file << "i_A,v_V\n";
        for (std::size_t k = curve.size(); k-- > 1;) file << -curve[k][0] << "," << -curve[k][1] << "\n";
        for (const std::vector<double>& p : curve) file << p[0] << "," << p[1] << "\n";
    }
    std::printf("%s: %.4g V at %.3g A, R %.4g ohm: ", name, curve.back()[1], curve.back()[0], R_ohm);
    const TraceResult r = traced({"nonideal.inverter_curve=" + path, "machine.R_ohm=" + std::to_string(R_ohm)});
    TEST_ASSERT_EQUAL_size_t_MESSAGE(1, r.effects.size(), name);
    TEST_ASSERT_EQUAL_STRING("dead_time", r.effects[0].name.c_str());
    TEST_ASSERT_EQUAL_STRING("explained", r.verdict.c_str());
    // A law that still rises at the largest current ends above the curve: measured 2 to 7 %, below two deviations.
    const dqw::Estimate& V = r.effects[0].parameters[0];
    TEST_ASSERT_EQUAL_STRING("voltage_V", V.name.c_str());
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(std::min(2.0 * V.sd, 0.1 * curve.back()[1]), curve.back()[1], V.value, name);
    TEST_ASSERT_TRUE_MESSAGE(value(r.before.parameters, "R_ohm") > 1.4 * R_ohm, name);
    // Measured: 2.7 % off, half of what the laws that fit as well leave open.
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.04 * R_ohm, R_ohm, value(r.after.parameters, "R_ohm"), name);
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.2, 1.3, r.before.heldout_rms, name);
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.03, 0.18, r.after.heldout_rms, name);
}

/// Measured: 1.23 to 1.38 V before, 0.18 V after; R within 0.8 %.
void curves_of_an_inverter()
{
    for (const char* name : {"inverter_sweep_beta_axis_a", "inverter_sweep_d_axis_a", "inverter_sweep_d_axis_c"}) {
        NEED(name);
        curve_of_an_inverter(name, std::strstr(name, "beta") != nullptr);
    }
}

}  // namespace

int main()
{
    UNITY_BEGIN();
    RUN_TEST(map_of_the_servo_am8141);
    RUN_TEST(map_of_the_reluctance_motor_baldor);
    RUN_TEST(map_of_a_log_with_wide_steps);
    RUN_TEST(map_of_a_bend_without_a_name);
    RUN_TEST(linear_machine_has_no_map);
    RUN_TEST(iron_that_no_polynomial_is_leaves_noise);
    RUN_TEST(iron_of_an_unknown_law_has_its_deviation);
    RUN_TEST(one_current_is_no_map);
    RUN_TEST(curves_of_an_inverter);
    return UNITY_END();
}
