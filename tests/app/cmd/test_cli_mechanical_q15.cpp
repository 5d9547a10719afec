// The mechanical axis in fixed point through the command: `compare` and `learn --arith q15` on every mechanical
// scenario and measured friction log.
// Plain only: long, and what it runs others run under the sanitizers.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>

#include "command.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

namespace fs = std::filesystem;
using command::Folder;
using command::Outcome;
using nlohmann::json;

// Percent that fixed point may be from float, and from the reference beyond float.
static constexpr double kMost = 0.3;

static void say(const std::string& what, double percent)
{
    if (std::getenv("DQW_TEST_VALUES") != nullptr) std::printf("%-60s %.5f %%\n", what.c_str(), percent);
}

static json ran(std::vector<std::string> args, const std::string& what)
{
    args.emplace_back("--json");
    const Outcome run = command::dqwatch(args);
    TEST_ASSERT_TRUE_MESSAGE(run.code == 0 || run.code == 4, (what + ": " + run.err).c_str());
    return json::parse(run.out);
}

static std::vector<std::string> scenarios()
{
    std::vector<std::string> names;
    const json list = json::parse(command::dqwatch({"sim", "--list", "--json"}).out);
    for (const auto& scenario : list.at("scenarios"))
        if (scenario.at("regime") == "mechanical") names.push_back(scenario.at("name"));
    TEST_ASSERT_TRUE(names.size() >= 2);
    return names;
}

static std::string simulated(const Folder& folder, const std::string& scenario, const std::string& noise)
{
    const Outcome sim = command::dqwatch(
        {"sim", scenario, "--out", folder / "", "--set", "noise=" + noise, "--set", "duration_s=5"});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, sim.code, sim.err.c_str());
    return folder / (scenario + ".csv");
}

static double value(const json& of, const std::string& name) { return of.at(name).at("value").get<double>(); }

/// Largest difference from float, in percent.
static double judge(const std::string& log, const std::string& what, const Folder& folder)
{
    const json result = ran({"compare", log, "--out", folder / "o"}, what);
    TEST_ASSERT_TRUE_MESSAGE(
        command::read_file(folder / "o/compare.html").find("\"series\":[\"float\",\"Q15\",\"reference\"]") !=
            std::string::npos,
        what.c_str());
    double most = 0.0;
    for (const char* name : {"J_kgm2", "B_Nms_rad"}) {
        const std::string here = what + ", " + name;
        TEST_ASSERT_EQUAL_INT_MESSAGE(result.at("float").contains(name), result.at("q15").contains(name), here.c_str());
        if (!result.at("q15").contains(name)) continue;
        const double f = value(result.at("float"), name), q = value(result.at("q15"), name);
        const double apart = 100.0 * std::fabs(q / f - 1.0);
        say(here, apart);
        TEST_ASSERT_TRUE_MESSAGE(apart <= kMost, here.c_str());
        most = std::max(most, apart);
        if (!result.at("reference").contains(name)) continue;
        const double r = value(result.at("reference"), name);
        TEST_ASSERT_TRUE_MESSAGE(100.0 * (std::fabs(q / r - 1.0) - std::fabs(f / r - 1.0)) <= kMost, here.c_str());
    }
    return most;
}

static void fixed_point_follows_float_on_scenarios(void)
{
    const Folder folder;
    double most = 0.0;
    for (const std::string& scenario : scenarios())
        for (const char* noise : {"0", "0.2"})
            most = std::max(most, judge(simulated(folder, scenario, noise), scenario + ", noise " + noise, folder));
    TEST_ASSERT_TRUE(most > 1e-4 && most < 0.005);  // 0.0005, J of coast_friction at 20 %
}

static void fixed_point_follows_float_on_measured_logs(void)
{
    const Folder folder;
    double most = 0.0;
    int logs = 0;
    std::error_code error;
    for (const auto& file : fs::directory_iterator(command::environment("DATA", "../shared/data"), error)) {
        const std::string name = file.path().filename().string();
        if (file.path().extension() != ".csv" || name.rfind("servo_friction", 0) != 0) continue;
        most = std::max(most, judge(file.path().string(), name, folder));
        logs++;
    }
    if (logs == 0) TEST_IGNORE_MESSAGE("no measured friction logs: set DATA");
    TEST_ASSERT_TRUE(most > 5e-4 && most < 0.02);  // 0.003, J
}

/// Numbers of a result: parameters that were estimated, and those of its effects.
static std::vector<std::pair<std::string, double>> numbers(const json& result)
{
    std::vector<std::pair<std::string, double>> all;
    for (const auto& [name, entry] : result.at("parameters").items())
        if (!entry.value("given", false)) all.emplace_back(name, entry.at("value").get<double>());
    for (const auto& effect : result.at("effects"))
        for (const auto& [name, entry] : effect.at("parameters").items())
            if (!entry.value("given", false))
                all.emplace_back(effect.at("name").get<std::string>() + "." + name, entry.at("value").get<double>());
    return all;
}

static void effects_of_the_shaft(void)
{
    const Folder folder;
    const struct {
        const char *scenario, *noise;
        std::vector<const char*> effects;
        std::size_t least;  ///< numbers that both know
    } cases[] = {{"coast_friction", "0", {"coulomb_friction"}, 3},
                 {"coast_friction", "0.2", {"coulomb_friction"}, 1},
                 {"effect_friction", "0", {"coulomb_friction", "stribeck_friction", "load_torque"}, 4},
                 {"effect_friction", "0", {"direction_asymmetry", "coulomb_friction", "cogging_torque"}, 4},
                 {"effect_friction", "0.2", {"direction_asymmetry", "coulomb_friction"}, 1}};
    double most = 0.0;
    for (const auto& c : cases) {
        const std::string log = simulated(folder, c.scenario, c.noise);
        std::vector<std::string> args = {"learn", log, "--arith", "q15"};
        std::string what = std::string(c.scenario) + ", noise " + c.noise;
        for (const char* effect : c.effects)
            args.insert(args.end(), {"--effect", effect}), what += std::string(" ") + effect;
        const auto fixed = numbers(ran(args, what));
        args[3] = "float";
        const auto single = numbers(ran(args, what));
        TEST_ASSERT_TRUE_MESSAGE(fixed.size() >= c.least, what.c_str());
        TEST_ASSERT_EQUAL_size_t_MESSAGE(single.size(), fixed.size(), what.c_str());
        for (std::size_t i = 0; i < single.size(); ++i) {
            TEST_ASSERT_EQUAL_STRING(single[i].first.c_str(), fixed[i].first.c_str());
            const double apart = 100.0 * std::fabs(fixed[i].second / single[i].second - 1.0);
            say(what + ": " + single[i].first, apart);
            TEST_ASSERT_TRUE_MESSAGE(apart <= kMost,
                                     (what + ": " + single[i].first + " " + std::to_string(apart)).c_str());
            most = std::max(most, apart);
        }
    }
    TEST_ASSERT_TRUE(most > 0.01 && most < 0.15);  // 0.040, B beside cogging in blocks of six pairs
}

static void a_torque_constant_from_two_columns(void)
{
    const Folder folder;
    std::string text = "t_s,w_m_rad_s,torque_Nm,i_q_A\n";
    for (int k = 0; k < 4000; ++k) {
        const double i = 3.0 * std::sin(0.002 * k) + 0.5 * std::sin(0.07 * k);
        text += std::to_string(1e-3 * k) + "," + std::to_string(50.0 * std::sin(0.01 * k)) + "," +
                std::to_string(0.12 * i) + "," + std::to_string(i) + "\n";
    }
    const std::string log = folder.write("log.csv", text);
    for (const char* arith : {"float", "q15"}) {
        const json result = ran({"learn", log, "--arith", arith, "--parameters", "torque_constant_Nm_A"}, arith);
        const json& k_t = result.at("parameters").at("torque_constant_Nm_A");
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-5, 0.12, k_t.at("value").get<double>(), arith);
        TEST_ASSERT_TRUE_MESSAGE(k_t.at("sd").get<double>() > 0.0 && k_t.at("sd").get<double>() < 1e-4, arith);
    }
}

static void what_fixed_point_does_not_take_is_one_line(void)
{
    const Folder folder;
    std::string text = "t_s,w_m_rad_s,torque_Nm\n";
    for (int k = 0; k < 300; ++k)
        text += std::to_string(1e-3 * k) + "," + std::to_string(10 * std::sin(0.05 * k)) + "," +
                std::to_string(std::cos(0.05 * k)) + "\n";
    const std::string log = folder.write("log.csv", text), huge = folder.write("huge.csv", text);
    folder.write("huge.toml", "[columns]\ntorque_Nm = { from = \"torque_Nm\", scale = 1e4 }\n");
    const auto config = [&](const std::string& name, const std::string& effect) {
        return folder.write(name, "{\"inputs\":[" + effect + "]}");
    };
    const struct {
        std::vector<std::string> args;
        const char* says;
    } bad[] = {{{huge}, "huge.csv:301: a torque up to"},
               {{log, "--config", config("a.json", "{\"effect\":\"cogging_torque\",\"shape\":[6.5]}")},
                "log.csv:301: 6.5 periods of cogging_torque"},
               {{log, "--config", config("b.json", "{\"effect\":\"coulomb_friction\",\"shape\":[0.001]}")},
                "log.csv:301: the fixed-point learners refuse"},
               {{log, "--effect", "dead_time"}, "log.csv:301: dead_time is not an effect"}};
    for (const auto& b : bad) {
        std::vector<std::string> args = {"learn", "--arith", "q15"};
        args.insert(args.end(), b.args.begin(), b.args.end());
        const Outcome run = command::dqwatch(args);
        TEST_ASSERT_EQUAL_INT_MESSAGE(3, run.code, (std::string(b.says) + ": " + run.err).c_str());
        TEST_ASSERT_EQUAL_STRING("", run.out.c_str());
        TEST_ASSERT_TRUE_MESSAGE(run.err.find(b.says) != std::string::npos, run.err.c_str());
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(fixed_point_follows_float_on_scenarios);
    RUN_TEST(fixed_point_follows_float_on_measured_logs);
    RUN_TEST(effects_of_the_shaft);
    RUN_TEST(a_torque_constant_from_two_columns);
    RUN_TEST(what_fixed_point_does_not_take_is_one_line);
    return UNITY_END();
}
