// Effects in fixed point: `learn --arith q15` and `compare` beside float on a simulated log of each effect, and on
// settled rows that warm up; what a trace found works as it is.
// Plain only: long, and what it runs others run under the sanitizers.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "command.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

using command::Folder;
using command::Outcome;
using nlohmann::json;

using Strings = std::vector<std::string>;

// Percent that fixed point may be from float.
static constexpr double kMost = 0.3;
// Deviations that it may be from float where that is more.
static constexpr double kHidden = 1.5;

static Outcome run(Strings args)
{
    Outcome outcome = command::dqwatch(args);
    std::string all;
    for (const auto& a : args) all += a + " ";
    TEST_ASSERT_TRUE_MESSAGE(outcome.code == 0 || outcome.code == 4, (all + outcome.err).c_str());
    return outcome;
}

static std::string simulated(const Folder& folder, const std::string& scenario, const Strings& settings)
{
    Strings args = {"sim", scenario, "--out", folder / ""};
    for (const auto& s : settings) args.insert(args.end(), {"--set", s});
    run(args);
    return folder / (scenario + ".csv");
}

/// What the learners say: of the machine, and of the effects.
struct Read {
    struct Value {
        double value, sd;
    };
    std::map<std::string, Value> plain, weights;
};

static Read learned(const Strings& what, const char* arithmetic)
{
    Strings args = {"learn", "--arith", arithmetic, "--json"};
    args.insert(args.end(), what.begin(), what.end());
    const json j = json::parse(run(args).out);
    Read read;
    const auto take = [](const json& from, auto& to) {
        for (const auto& [name, p] : from.items())
            if (!p.value("given", false) && !p.at("sd").is_null()) to[name] = {p.at("value"), p.at("sd")};
    };
    take(j.at("parameters"), read.plain);
    for (const auto& e : j.at("effects")) take(e.at("parameters"), read.weights);
    // Where an amplitude is nothing a phase is anything.
    for (auto it = read.weights.begin(); it != read.weights.end();)
        it = it->first.rfind("phase_", 0) == 0 || it->first.rfind("axis_", 0) == 0 ? read.weights.erase(it)
                                                                                   : std::next(it);
    return read;
}

struct Off {
    double plain = 0.0, weight = 0.0;  ///< percent of each parameter, of the effect's largest weight
    double hidden = 0.0;               ///< the difference in deviations of fixed point, where it is above 0.3 %
};

/// Fixed point knows what float knows, and how far it is off.
static Off difference(const Read& one, const Read& two, const std::string& what)
{
    TEST_ASSERT_EQUAL_size_t_MESSAGE(one.plain.size(), two.plain.size(), what.c_str());
    Off off;
    for (const auto& [name, f] : one.plain) {
        TEST_ASSERT_TRUE_MESSAGE(two.plain.count(name) == 1, (what + " " + name).c_str());
        const Read::Value q = two.plain.at(name);
        const double percent = 100.0 * std::fabs(q.value / f.value - 1.0);
        off.plain = std::max(off.plain, percent);
        if (percent > kMost) off.hidden = std::max(off.hidden, std::fabs(q.value - f.value) / q.sd);
    }
    double largest = 0.0;
    for (const auto& [name, f] : one.weights) largest = std::max(largest, std::fabs(f.value));
    for (const auto& [name, f] : one.weights) {
        // Fixed point may leave open what float says is nothing.
        if (two.weights.count(name) == 0 && std::fabs(f.value) < f.sd) continue;
        TEST_ASSERT_TRUE_MESSAGE(two.weights.count(name) == 1, (what + " " + name).c_str());
        const Read::Value q = two.weights.at(name);
        const double percent = 100.0 * std::fabs(q.value - f.value) / largest;
        off.weight = std::max(off.weight, percent);
        if (percent > kMost) off.hidden = std::max(off.hidden, std::fabs(q.value - f.value) / q.sd);
    }
    if (std::getenv("DQW_TEST_VALUES") != nullptr)
        std::printf("%-44s %zu parameters %.4f %%, %zu weights %.4f %%, %.2f deviations\n", what.c_str(),
                    one.plain.size(), off.plain, one.weights.size(), off.weight, off.hidden);
    return off;
}

struct Case {
    const char* effect;
    Strings settings;
    const char* beside = "";  ///< another effect that is there
};
static const Case cases[] = {
    {"dead_time", {"nonideal.dead_time_V=4", "nonideal.dead_time_width_A=0.3"}},
    {"saturation", {"nonideal.saturation_dd_A_Wb3=500", "nonideal.saturation_qq_A_Wb3=2e4"}},
    {"cross_saturation",
     {"nonideal.saturation_dd_A_Wb3=500", "nonideal.saturation_qq_A_Wb3=2e4", "nonideal.saturation_dq_A_Wb3=1e3"},
     "saturation"},
    {"winding_temperature",
     {"nonideal.winding_alpha_per_K=0.0039", "machine.winding_heat_J_K=0.2", "machine.magnet_heat_J_K=50",
      "machine.winding_ambient_W_K=0.5"}},
    {"magnet_temperature",
     {"nonideal.magnet_beta_per_K=-0.0012", "machine.winding_heat_J_K=1", "machine.magnet_heat_J_K=1",
      "machine.winding_magnet_W_K=3"}},
    {"iron_loss", {"nonideal.iron_loss_S=0.01"}},
    {"flux_harmonics", {"nonideal.flux_harmonic_6d_Wb=0.002", "nonideal.flux_harmonic_6q_Wb=0.001"}},
    {"current_offset", {"nonideal.current_offset_alpha_A=0.3"}},
    {"current_gain_mismatch", {"nonideal.current_gain_a=0.05"}},
    {"angle_offset", {"nonideal.angle_offset_rad=0.05"}},
    {"delay", {"nonideal.delay_periods=0.4"}},
    {"skin_effect", {"nonideal.skin_effect_s2_rad2=2e-6"}},
    {"phase_resistance_imbalance", {"nonideal.phase_resistance_a_ohm=0.3"}},
    {"voltage_offset", {"nonideal.voltage_offset_q_V=1"}},
};

static Strings asked(const std::string& log, const Case& c)
{
    Strings args = {log, "--effect", c.effect};
    if (*c.beside != 0) args.insert(args.end(), {"--effect", c.beside});
    return args;
}

/// Every effect on a servo of 1 s.
static Off over_effects(const char* noise, std::size_t& known)
{
    const Folder folder;
    Off all;
    known = 0;
    for (const Case& c : cases) {
        // In so much noise the log tells of a saturating machine no R, L_d, L_q and no weight. What is left, psi, moves
        // with the blocks in which a polynomial's small inputs do not count: float's own by 0.75 % where that bound
        // moves by a fortieth.
        if (*noise != '0' || noise[1] != 0)
            if (std::string(c.effect).find("saturation") != std::string::npos) continue;
        Strings settings = c.settings;
        settings.insert(settings.end(), {std::string("noise=") + noise, "duration_s=1"});
        const Strings args = asked(simulated(folder, "servo", settings), c);
        const Read one = learned(args, "float"), two = learned(args, "q15");
        const Off off = difference(one, two, std::string(c.effect) + ", noise " + noise);
        // What is more than that is about what quantisation and noise leave known of it.
        TEST_ASSERT_TRUE_MESSAGE(off.hidden <= kHidden, c.effect);
        known += one.plain.size() + one.weights.size();
        all = {std::max(all.plain, off.plain), std::max(all.weight, off.weight), std::max(all.hidden, off.hidden)};
    }
    return all;
}

static void near(double usual, double value, const char* what)
{
    TEST_ASSERT_TRUE_MESSAGE(value > usual / 2 && value < 2 * usual,
                             (std::string(what) + " " + std::to_string(value)).c_str());
}

static void fixed_point_follows_float_on_every_effect(void)
{
    std::size_t known = 0;
    const Off all = over_effects("0", known);
    near(0.015, all.plain, "parameters");
    near(0.12, all.weight, "weights");
    TEST_ASSERT_TRUE(known >= 80);
}

static void fixed_point_follows_float_through_noise_of_a_fifth(void)
{
    std::size_t known = 0;
    const Off all = over_effects("0.2", known);
    // What quantisation and noise make of it, on every machine.
    near(0.29, all.plain, "parameters");
    near(1.4, all.weight, "weights");
    TEST_ASSERT_TRUE(known >= 34);
}

/// The scenarios that are named after an effect, as they are; and settled rows that warm up.
static void named_scenarios_and_settled_rows(void)
{
    const Folder folder;
    const struct {
        const char* scenario;
        Strings settings, effects;
    } logs[] = {{"effect_dead_time", {"duration_s=1"}, {"dead_time"}},
                {"effect_angle_offset", {"duration_s=1"}, {"angle_offset"}},
                {"heating", {}, {"winding_temperature", "magnet_temperature"}}};
    Off all;
    for (const auto& l : logs) {
        Strings args = {simulated(folder, l.scenario, l.settings)};
        for (const auto& e : l.effects) args.insert(args.end(), {"--effect", e});
        const Off off = difference(learned(args, "float"), learned(args, "q15"), l.scenario);
        TEST_ASSERT_TRUE_MESSAGE(off.plain <= kMost && off.weight <= kMost, l.scenario);
        all = {std::max(all.plain, off.plain), std::max(all.weight, off.weight), 0.0};
    }
    near(0.0045, all.plain, "parameters");
    near(0.03, all.weight, "weights");
}

/// A trace's file: its shapes and values to start from.
static void what_a_trace_found(void)
{
    const Folder folder;
    const std::string log = simulated(folder, "effect_dead_time", {"duration_s=1"});
    const std::string config = folder.write(
        "trace.json",
        R"({"inputs": [{"effect": "dead_time", "shape": [0.15], "weights": [3.9]}, {"effect": "voltage_offset", "weights": [0.1, -0.1]}],
                        "after": {"parameters": {"R_ohm": {"value": 0.8}, "Ld_H": {"value": 2e-3}, "pole_pairs": {"value": 4}}}})");
    std::filesystem::remove(folder / "effect_dead_time.toml");
    const Strings args = {log, "--config", config};
    const Read one = learned(args, "float"), two = learned(args, "q15");
    const Off off = difference(one, two, "trace.json");
    TEST_ASSERT_TRUE(off.plain <= 0.05 && off.weight <= 0.05);
    // Its width is the machine's, so that the values are.
    TEST_ASSERT_DOUBLE_WITHIN(0.04, 4.0, two.weights.at("voltage_V").value);
    TEST_ASSERT_DOUBLE_WITHIN(0.01, 0.9, two.plain.at("R_ohm").value);

    const json j = json::parse(run({"compare", log, "--config", config, "--effect", "dead_time", "--pole-pairs", "4",
                                    "--json", "--out", folder / "o"})
                                   .out);
    for (const char* who : {"reference", "float", "q15"})
        TEST_ASSERT_DOUBLE_WITHIN(0.05, 4.0, j.at(who).at("dead_time.voltage_V").at("value").get<double>());
    const double percent = j.at("difference_percent").at("q15_float").at("dead_time.voltage_V").get<double>();
    TEST_ASSERT_TRUE(std::fabs(percent) > 1e-6 && std::fabs(percent) < 0.05);
    TEST_ASSERT_TRUE(command::read_file(folder / "o/compare.html").find("dead_time.voltage_V") != std::string::npos);
}

static void what_fixed_point_cannot_take_is_one_line_and_exit_code_3(void)
{
    const Folder folder;
    const std::string log = simulated(folder, "servo", {"duration_s=0.1"});
    const auto config = [&](const char* name, const std::string& shape) {
        return folder.write(name, R"({"inputs": [{"effect": )" + shape + "}]}");
    };
    const struct {
        Strings args;
        const char* says;
    } bad[] = {{{"--effect", "coulomb_friction"}, "coulomb_friction is not an effect"},
               {{"--config", config("wide.json", R"("dead_time", "shape": [5000])")},
                "dead_time: its shape is more than fixed point takes"},
               {{"--config", config("far.json", R"("magnet_temperature", "shape": [400, 0, 0])")},
                "magnet_temperature: its shape is more"},
               {{"--config", config("narrow.json", R"("dead_time", "shape": [1e-5])")},
                "refuse these full scales, nominal values or shapes"},
               {{"--config", config("unit.json", R"("saturation", "shape": [1000])")},
                "refuse these full scales, nominal values or shapes"}};
    for (const auto& b : bad) {
        Strings args = {"learn", log, "--arith", "q15"};
        args.insert(args.end(), b.args.begin(), b.args.end());
        const Outcome outcome = command::dqwatch(args);
        TEST_ASSERT_EQUAL_INT_MESSAGE(3, outcome.code, (std::string(b.says) + ": " + outcome.err).c_str());
        TEST_ASSERT_EQUAL_STRING("", outcome.out.c_str());
        TEST_ASSERT_TRUE_MESSAGE(outcome.err.find(log + ":") != std::string::npos &&
                                     outcome.err.find(b.says) != std::string::npos,
                                 outcome.err.c_str());
    }
    const Outcome wrong = command::dqwatch({"compare", log, "--effect", "gremlins"});
    TEST_ASSERT_EQUAL_INT_MESSAGE(2, wrong.code, wrong.err.c_str());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(fixed_point_follows_float_on_every_effect);
    RUN_TEST(fixed_point_follows_float_through_noise_of_a_fifth);
    RUN_TEST(named_scenarios_and_settled_rows);
    RUN_TEST(what_a_trace_found);
    RUN_TEST(what_fixed_point_cannot_take_is_one_line_and_exit_code_3);
    return UNITY_END();
}
