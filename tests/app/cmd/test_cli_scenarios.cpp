// From the simulator through files to the estimates: truth comes back, and no scenario is mistaken for rpm.
// Plain only: long, and what it runs others run under the sanitizers.
#include <nlohmann/json.hpp>
#include <string>

#include "command.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

using command::Folder;
using command::Outcome;
using nlohmann::json;

static json run_json(std::vector<std::string> args)
{
    args.push_back("--json");
    const Outcome run = command::dqwatch(args);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
    return json::parse(run.out);
}

static void expect_near(const json& truth, const json& result, double percent)
{
    for (const char* name : {"R_ohm", "Ld_H", "Lq_H", "psi_Wb"}) {
        const double t = truth.at(name).get<double>();
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.01 * percent * t, t,
                                          result.at("parameters").at(name).at("value").get<double>(), name);
    }
}

static void the_fit_of_a_simulated_log_gives_its_machine_back(void)
{
    const Folder folder;
    for (const char* scenario : {"traction_ipm_linear", "servo_ideal"}) {
        const json sim = run_json({"sim", scenario, "--out", folder / "", "--set", "duration_s=2"});
        expect_near(sim.at("truth"), run_json({"fit", sim.at("csv").get<std::string>()}), 0.1);
        expect_near(sim.at("truth"), run_json({"learn", sim.at("csv").get<std::string>()}), 1.0);
    }
}

static void set_machine_and_pole_pairs_reach_the_simulator(void)
{
    const Folder folder;
    const std::string machine = folder.write("m.toml", "[machine]\nR_ohm = 1.5\npsi_Wb = 0.1\n");
    const json sim = run_json({"sim", "servo_ideal", "--out", folder / "", "--machine", machine, "--pole-pairs", "3",
                               "--set", "machine.Lq_H=4e-3", "--set", "duration_s=0.5"});
    TEST_ASSERT_EQUAL_DOUBLE(1.5, sim.at("truth").at("R_ohm").get<double>());
    TEST_ASSERT_EQUAL_INT(3, sim.at("truth").at("pole_pairs").get<int>());
    TEST_ASSERT_EQUAL_DOUBLE(4e-3, sim.at("truth").at("Lq_H").get<double>());
    expect_near(sim.at("truth"), run_json({"fit", sim.at("csv").get<std::string>()}), 0.2);
}

static void a_seed_repeats_and_another_differs(void)
{
    const Folder folder;
    std::string text[3];
    const char* const seeds[] = {"7", "7", "8"};
    for (int i = 0; i < 3; ++i) {
        run_json({"sim", "--set", "duration_s=0.05", "servo", "--seed", seeds[i], "--out", folder / ""});
        text[i] = command::read_file(folder / "servo.csv");
    }
    TEST_ASSERT_TRUE(text[0] == text[1]);
    TEST_ASSERT_FALSE(text[0] == text[2]);
    TEST_ASSERT_TRUE(command::read_file(folder / "servo.toml").find("--seed 8") != std::string::npos);
    for (const char* none : {"-1", "1.5", "seven", "", "18446744073709551616", "7 "})
        TEST_ASSERT_EQUAL_INT_MESSAGE(2, command::dqwatch({"sim", "servo", "--seed", none, "--out", folder / ""}).code,
                                      none);
}

/// The speed column, the sixth of an electrical and the third of a mechanical log, times `factor`.
static std::string faster(const std::string& csv, double factor)
{
    std::string out;
    int column = 0;
    const std::string header = csv.substr(0, csv.find('\n'));
    for (std::size_t at = 0; at < header.find("w_m_rad_s"); ++at) column += header[at] == ',';
    for (std::size_t at = 0; at < csv.size();) {
        const std::size_t end = csv.find('\n', at);
        std::size_t from = at;
        for (int c = 0; c < column; ++c) from = csv.find(',', from) + 1;
        const std::size_t to = std::min(csv.find(',', from), end);
        out += csv.substr(at, from - at);
        out += at ? std::to_string(factor * std::strtod(csv.c_str() + from, nullptr)) : csv.substr(from, to - from);
        out += csv.substr(to, end - to) + "\n";
        at = end + 1;
    }
    return out;
}

static void rpm_is_told_in_every_scenario_that_turns(void)
{
    const Folder folder;
    const json all = run_json({"sim", "--list"});
    for (const auto& scenario : all.at("scenarios")) {
        const std::string name = scenario.at("name");
        const double rows = scenario.at("rows").get<double>(), seconds = scenario.at("duration_s").get<double>();
        if (rows > 100000) continue;
        // As much is told by so many rows.
        const double enough = seconds * std::min(1.0, 8000 / rows);
        run_json({"sim", name, "--out", folder / "", "--set", "duration_s=" + std::to_string(enough), "--set",
                  name.rfind("drive_", 0) == 0 ? "method=rk4" : "method=adams"});
        const std::string path = folder / (name + ".csv");
        const Outcome right = command::dqwatch({"learn", path});
        TEST_ASSERT_TRUE_MESSAGE(right.code == 0 || right.code == 4, right.err.c_str());
        TEST_ASSERT_TRUE_MESSAGE(right.err.find("rpm") == std::string::npos, right.err.c_str());
        if (scenario.at("regime") == "standstill") continue;
        folder.write(name + ".csv", faster(command::read_file(path), 9.5492966));
        const Outcome wrong = command::dqwatch({"learn", path});
        TEST_ASSERT_TRUE_MESSAGE(wrong.err.find("look like rpm") != std::string::npos, name.c_str());
    }
}

static void the_demo_compares_both_with_the_truth(void)
{
    const Folder folder;
    const Outcome text = command::dqwatch({"demo", "--out", folder / "d"});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, text.code, text.err.c_str());
    for (const char* part : {"R_ohm", "Ld_H", "Lq_H", "psi_Wb", "truth", "learner", "reference", "±", " %)"})
        TEST_ASSERT_TRUE_MESSAGE(text.out.find(part) != std::string::npos, part);
    const json result = run_json({"demo", "--out", folder / "d"});
    expect_near(result.at("truth"), result.at("reference"), 2.0);
    expect_near(result.at("truth"), result.at("float"), 3.0);
    TEST_ASSERT_TRUE(std::filesystem::exists(folder / "d/servo.csv"));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_fit_of_a_simulated_log_gives_its_machine_back);
    RUN_TEST(set_machine_and_pole_pairs_reach_the_simulator);
    RUN_TEST(a_seed_repeats_and_another_differs);
    RUN_TEST(rpm_is_told_in_every_scenario_that_turns);
    RUN_TEST(the_demo_compares_both_with_the_truth);
    return UNITY_END();
}
