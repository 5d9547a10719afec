// Learners with a flux map: on a log of that iron both weights are 1 and nothing is left; another machine's map is told
// by them.
#include <cmath>
#include <functional>
#include <string>

#include "app/learn/inputs.hpp"
#include "app/learn/learn.hpp"
#include "app/read/flux_map.hpp"
#include "command.hpp"
#include "dqw_effect_kind.h"
#include "flux_table.hpp"
#include "ref/effect/flux_table.hpp"
#include "simulated.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

namespace {

using command::Folder;
using dqw::Log;

void between(double low, double x, double high, const char* what)
{
    const std::string text = std::string(what) + ": " + std::to_string(x) + ", bounds " + std::to_string(low) + " .. " +
                             std::to_string(high);
    TEST_ASSERT_TRUE_MESSAGE(low <= x && x <= high, text.c_str());
}

struct Iron {
    double iron_Wb = 0.3, knee_A = 6.0, magnet_A = 8.0;

    /// Of a leakage and of iron, psi is the slope of `3e-3/2 i^2 + K sqrt(1 + x^2 + y^2)`.
    void flux(double i_d, double i_q, double& psi_d, double& psi_q) const
    {
        constexpr double kQ = 1.4, kLeakage_H = 1.2e-3;
        const double x = (i_d + magnet_A) / knee_A, y = i_q / (kQ * knee_A), norm = std::sqrt(1 + x * x + y * y);
        psi_d = kLeakage_H * i_d + iron_Wb * x / norm, psi_q = kLeakage_H * i_q + iron_Wb / kQ * y / norm;
    }
    std::string csv() const
    {
        std::string out = "i_d_A,i_q_A,psi_d_Wb,psi_q_Wb\n";
        for (int d = -16; d <= 16; ++d)
            for (int q = -16; q <= 16; ++q) {
                double psi_d, psi_q;
                flux(d, q, psi_d, psi_q);
                out += std::to_string(d) + "," + std::to_string(q) + "," + std::to_string(psi_d) + "," +
                       std::to_string(psi_q) + "\n";
            }
        return out;
    }
};

Log log_of(const std::string& map, const char* noise, const char* seed = "1")
{
    return simulated("servo",
                     {"machine.flux_map=" + map, std::string("noise=") + noise, "noise.w=0.0005", "duration_s=2",
                      std::string("seed=") + seed, "machine.R_ohm=0.8", "profile.shaft=imposed",
                      "profile.control=current", "profile.v_d_V.binary=0", "profile.v_q_V.binary=0",
                      "profile.speed_rad_s.wave=60", "drive.current_bandwidth_rad_s=300", "drive.i_max_A=14",
                      "profile.i_d_A=-4", "profile.i_d_A.random=4", "profile.i_d_A.random_hold_s=0.05",
                      "profile.i_q_A.random=9", "profile.i_q_A.random_hold_s=0.031"},
                     Beside::regime);
}

dqw::Learned learned(Log log, const std::string& map, bool fixed_point)
{
    log.machine.flux_map = map;
    dqw::LearnConfig config;
    dqw::add_flux_map(config, {log});
    dqw::LearnOptions options;
    options.inputs = config.inputs;
    options.fixed_point = fixed_point;
    dqw::Learned out = dqw::learn_all({log}, options);
    dqw::note_flux_map({log}, out.result);
    return out;
}

double worst_percent(const dqw::Result& result)
{
    double most = 0.0;
    for (const auto& axis : result.axes) most = std::max(most, axis.percent);
    return most;
}

bool warns(const dqw::Result& result, const char* what)
{
    for (const std::string& note : result.notes)
        if (note.rfind("warning: ", 0) == 0 && note.find(what) != std::string::npos) return true;
    return false;
}

void on_its_own_iron_both_weights_are_one()
{
    const Folder folder;
    const std::string map = folder.write("map.csv", Iron().csv());
    for (const char* noise : {"0", "0.01"}) {
        const bool noisy = noise[1] != '\0';
        const Log log = log_of(map, noise);
        // Plain 23 % and 0.3 ohm.
        between(10.0, worst_percent(dqw::learn({log})), 40.0, "residual without the map, %");
        for (const bool fixed_point : {false, true}) {
            const dqw::Learned found = learned(log, map, fixed_point);
            TEST_ASSERT_EQUAL_size_t(1, found.effects.size());
            TEST_ASSERT_EQUAL_STRING("flux_map", found.effects[0].name.c_str());
            for (int k = 0; k < 2; ++k) {
                const dqw::Estimate& e = found.effects[0].parameters[static_cast<std::size_t>(k)];
                TEST_ASSERT_EQUAL_STRING(k == 0 ? "weight_d" : "weight_q", e.name.c_str());
                between(0.997, e.value, 1.003, e.name.c_str());
                between(-4.0, (e.value - 1.0) / e.sd, 4.0, "weight, in its deviations");
            }
            between(0.798, found.model.R_ohm, 0.802, "R, ohm");
            // Measured 0.23; at 1 % the noise alone.
            between(noisy ? 3.0 : 0.1, worst_percent(found.result), noisy ? 3.5 : 0.4, "residual, %");
            TEST_ASSERT_FALSE(warns(found.result, "flux map"));
        }
    }
}

void another_machines_map_is_told()
{
    const Folder folder;
    const std::string map = folder.write("map.csv", Iron().csv());
    const Log log = log_of(map, "0.01", "2");
    const std::string weak = folder.write("weak.csv", Iron{0.24}.csv()),
                      knee = folder.write("knee.csv", Iron{0.3, 9}.csv());
    for (const bool fixed_point : {false, true}) {
        const dqw::Learned low = learned(log, weak, fixed_point);
        TEST_ASSERT_TRUE(warns(low.result, "the flux map is not this machine's"));
        between(1.24, low.effects[0].parameters[0].value, 1.26, "weight_d of iron that carries a quarter more");
        TEST_ASSERT_TRUE(warns(low.result, "in the flux map 0.192 Wb"));
        TEST_ASSERT_TRUE(warns(learned(log, knee, fixed_point).result, "the flux map is not this machine's"));
    }
}

void a_table_is_the_map()
{
    const Folder folder;
    const dqw::FluxMap map = dqw::read_flux_map(folder.write("map.csv", Iron().csv()));
    const dqw::TraceInput table = dqw::flux_table(map, {-11, 2, 11});
    TEST_ASSERT_TRUE(dqw_effect_is_map(table.map.data()));
    TEST_ASSERT_EQUAL_size_t(1770, dqw_effect_map_bytes(table.map.data()));
    TEST_ASSERT_EQUAL_size_t(table.map.size() * 2, dqw_effect_map_bytes(table.map.data()));
    TEST_ASSERT_EQUAL_INT(17, table.map[1]);
    // Bilinear by hand, with the tangent at zero current, beside the closed form.
    const dqw::FluxNode zero = dqw::between(map, 0, 0);
    double worst = 0.0, square = 0.0, n = 0.0;
    for (double d = -10.9; d <= 1.9; d += 0.23)
        for (double q = -10.9; q <= 10.9; q += 0.31) {
            const std::array<double, 2> bend = bend_of(table, d, q);
            double psi_d, psi_q;
            Iron().flux(d, q, psi_d, psi_q);
            const double e_d = zero.psi_d_Wb + zero.L_dd_H * d + bend[0] - psi_d,
                         e_q = zero.L_qq_H * q + bend[1] - psi_q;
            worst = std::max({worst, std::abs(e_d), std::abs(e_q)}), square += e_d * e_d + e_q * e_q, ++n;
        }
    // Of 0.3 Wb.
    between(1e-5, std::sqrt(square / n) / 0.3, 8e-4, "error, RMS");
    between(1e-4, worst / 0.3, 6e-3, "largest error");
}

void what_cannot_be_is_refused()
{
    const Folder folder;
    Log log;
    log.machine.flux_map = folder.write("map.csv", Iron().csv());
    log.i_d_A = log.i_q_A = {0.0, 1.0};
    dqw::LearnConfig config;
    dqw::add_effects(config, {"saturation"});
    const auto refused = [](const std::function<void()>& call, const char* why) {
        try {
            call();
        } catch (const std::exception& error) {
            TEST_ASSERT_TRUE_MESSAGE(std::string(error.what()).find(why) != std::string::npos, error.what());
            return;
        }
        TEST_FAIL_MESSAGE(why);
    };
    refused([&] { dqw::add_flux_map(config, {log}); }, "both say how the iron bends");
    dqw::FluxMap straight = dqw::read_flux_map(log.machine.flux_map);
    for (std::size_t d = 0; d < straight.i_d_A.size(); ++d)
        for (std::size_t q = 0; q < straight.i_q_A.size(); ++q)
            straight.nodes[d * straight.i_q_A.size() + q] = {
                0.1 + 1e-3 * straight.i_d_A[d], 2e-3 * straight.i_q_A[q], 0, 0, 1e-3, 0, 2e-3};
    refused([&] { (void)dqw::flux_table(straight, dqw::range_of(straight)); }, "does not bend");
    log.machine.flux_map = folder / "none.csv";
    config.inputs.clear();
    refused([&] { dqw::add_flux_map(config, {log}); }, "expected a flux map");
    for (const char* text :
         {R"({"inputs":[{"effect":"flux_map","shape":[1,1,1],"weights":[1,1]}]})",
          R"({"inputs":[{"effect":"flux_map","shape":[1,1,1],"weights":[1,1],"map":[2,1,2,1,2,3,4,5,6,7]}]})",
          R"({"inputs":[{"effect":"flux_map","shape":[1,1,1],"weights":[1,1],"map":[2,1,2,1,2,3,4,5,6,7,40000]}]})",
          R"({"inputs":[{"effect":"delay","map":[2,1,2,1,2,3,4,5,6,7,8]}]})"})
        refused([&] { (void)dqw::learn_config_of("trace.json", text); }, "map");
    const dqw::LearnConfig good = dqw::learn_config_of(
        "trace.json",
        R"({"inputs":[{"effect":"flux_map","shape":[1,1,1],"weights":[1,1],"map":[2,1,2,1,2,3,4,5,6,7,8]}]})");
    TEST_ASSERT_EQUAL_size_t(11, good.inputs[0].map.size());
    // What a fit seeks in its place.
    TEST_ASSERT_EQUAL_size_t(2, dqw::effects_of(good).size());
}

}  // namespace

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(on_its_own_iron_both_weights_are_one);
    RUN_TEST(another_machines_map_is_told);
    RUN_TEST(a_table_is_the_map);
    RUN_TEST(what_cannot_be_is_refused);
    return UNITY_END();
}
