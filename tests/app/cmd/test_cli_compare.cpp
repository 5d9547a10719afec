// `compare`: its object, page and exit codes; and float, fixed point and reference fit over every electrical scenario
// and measured log.
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

static const char* const names[] = {"R_ohm", "Ld_H", "Lq_H", "psi_Wb"};

// Percent that fixed point may be from float.
static constexpr double kMost = 0.3;

static json compared(const std::string& log, const Folder& folder, int code = 0, std::vector<std::string> more = {})
{
    std::vector<std::string> args = {"compare", log, "--json", "--out", folder / "o"};
    args.insert(args.end(), more.begin(), more.end());
    const Outcome run = command::dqwatch(args);
    TEST_ASSERT_EQUAL_INT_MESSAGE(code, run.code, (log + ": " + run.err).c_str());
    return json::parse(run.out);
}

static double value(const json& result, const char* who, const std::string& name)
{
    return result.at(who).at(name).at("value").get<double>();
}

/// The fields of the schema, and each difference where both know the parameter and nowhere else.
static void expect_schema(const json& result, const std::string& what)
{
    TEST_ASSERT_EQUAL_STRING("dqwatch.compare/1", result.at("schema").get<std::string>().c_str());
    TEST_ASSERT_EQUAL_size_t(5, result.size());
    const json& differences = result.at("difference_percent");
    TEST_ASSERT_EQUAL_size_t(3, differences.size());
    const char* const pairs[][3] = {{"float_reference", "float", "reference"},
                                    {"q15_float", "q15", "float"},
                                    {"q15_reference", "q15", "reference"}};
    for (const auto& [pair, first, second] : pairs) {
        std::size_t common = 0;
        for (const auto& [name, entry] : result.at(first).items()) {
            TEST_ASSERT_TRUE_MESSAGE(
                entry.value("given", false) || entry.at("sd").is_number() || entry.at("sd").is_null(), name.c_str());
            if (!result.at(second).contains(name)) continue;
            common++;
            const double b = value(result, second, name), expected = 100.0 * (value(result, first, name) - b) / b;
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-9 * std::fabs(expected), expected,
                                              differences.at(pair).at(name).get<double>(), (what + " " + name).c_str());
        }
        TEST_ASSERT_EQUAL_size_t_MESSAGE(common, differences.at(pair).size(), what.c_str());
    }
}

static void json_page_and_table_of_a_log(void)
{
    const Folder folder;
    const command::Machine m;
    command::write_log(folder / "log.csv", 4000);
    const json result = compared(folder / "log.csv", folder, 0, {"--pole-pairs", "4"});
    expect_schema(result, "log.csv");
    const std::pair<const char*, double> truths[] = {
        {"R_ohm", m.R_ohm}, {"Ld_H", m.Ld_H}, {"Lq_H", m.Lq_H}, {"psi_Wb", m.psi_Wb}};
    for (const auto& [name, truth] : truths)
        for (const char* who : {"reference", "float", "q15"}) {
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.01 * truth, truth, value(result, who, name), name);
            TEST_ASSERT_TRUE_MESSAGE(result.at(who).at(name).at("sd").get<double>() > 0, name);
        }
    TEST_ASSERT_TRUE(result.at("q15").at("pole_pairs").at("given").get<bool>());

    const std::string page = command::read_file(folder / "o/compare.html");
    for (const char* part : {"\"series\":[\"float\",\"Q15\",\"reference\"]", "log.csv", "psi [mWb]", "Q15−float LSB"})
        TEST_ASSERT_TRUE_MESSAGE(page.find(part) != std::string::npos, part);

    const Outcome text = command::dqwatch({"compare", folder / "log.csv", "--pole-pairs", "4", "--out", folder / "o"});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, text.code, text.err.c_str());
    for (const char* part :
         {"R_ohm", "psi_Wb", "reference", "float", "Q15", "Q15−float %", "Q15−float LSB", "1 LSB is 1/32768 of"})
        TEST_ASSERT_TRUE_MESSAGE(text.out.find(part) != std::string::npos, part);
}

static void values_are_those_of_learn_and_fit(void)
{
    const Folder folder;
    command::write_log(folder / "log.csv", 3000);
    folder.write("log.toml", "[machine]\npole_pairs = 4\nR_ohm = 0.4\n");
    const json result = compared(folder / "log.csv", folder);
    const std::pair<const char*, std::vector<std::string>> alone[] = {
        {"reference", {"fit"}}, {"float", {"learn"}}, {"q15", {"learn", "--arith", "q15"}}};
    for (auto [who, args] : alone) {
        args.insert(args.end(), {folder / "log.csv", "--json"});
        TEST_ASSERT_EQUAL_STRING_MESSAGE(json::parse(command::dqwatch(args).out).at("parameters").dump().c_str(),
                                         result.at(who).dump().c_str(), who);
    }
    // A machine file of another name, and a part of the parameters.
    folder.write("other.toml", "[machine]\npole_pairs = 4\n");
    const json part = compared(folder / "log.csv", folder, 0,
                               {"--machine", folder / "other.toml", "--parameters", "R_ohm,psi_Wb"});
    expect_schema(part, "part");
    TEST_ASSERT_FALSE(part.at("reference").at("R_ohm").contains("nominal"));
    for (const char* who : {"reference", "float", "q15"}) TEST_ASSERT_FALSE_MESSAGE(part.at(who).contains("Ld_H"), who);
}

static void exit_code_4_where_one_of_them_cannot_tell(void)
{
    const Folder folder;
    std::string text = "v_d_V,v_q_V,i_d_A,i_q_A\n";
    for (int k = -20; k <= 20; ++k)
        text += std::to_string(0.5 * k) + ",0," + std::to_string(k + 0.01 * (k % 3)) + ",0\n";
    const std::string path = folder.write("log.csv", text);
    TEST_ASSERT_DOUBLE_WITHIN(0.005, 0.5, value(compared(path, folder), "q15", "R_ohm"));
    const json result = compared(path, folder, 4, {"--parameters", "R_ohm,psi_Wb"});
    expect_schema(result, path);
    TEST_ASSERT_EQUAL_size_t(1, result.at("difference_percent").at("q15_float").size());
    const Outcome run = command::dqwatch({"compare", path, "--parameters", "R_ohm,psi_Wb", "--out", folder / "o"});
    TEST_ASSERT_TRUE_MESSAGE(run.out.find("psi_Wb, Q15: ") != std::string::npos, run.out.c_str());
}

static void bad_input_is_one_line_and_exit_code_3(void)
{
    const Folder folder;
    command::write_log(folder / "huge.csv", 3000);
    folder.write("huge.toml", "[columns]\nv_d_V = { from = \"v_d_V\", scale = 1e6 }\n");
    const struct {
        std::string path;
        const char* says;
    } bad[] = {{folder.write("empty.csv", ""), ":1: "},
               {folder / "absent.csv", ":0: "},
               {folder.write("nan.csv", "t_s,v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s\n0,1,2,three,4,5\n"), ":2: "},
               {folder / "huge.csv", ":3001: a voltage up to"}};
    for (const auto& b : bad) {
        const Outcome run = command::dqwatch({"compare", b.path, "--json", "--out", folder / "o"});
        TEST_ASSERT_EQUAL_INT_MESSAGE(3, run.code, (b.path + ": " + run.err).c_str());
        TEST_ASSERT_EQUAL_STRING("", run.out.c_str());
        const std::string last = run.err.substr(run.err.rfind('\n', run.err.size() - 2) + 1);
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, last.compare(0, b.path.size(), b.path), last.c_str());
        TEST_ASSERT_TRUE_MESSAGE(last.find(b.says) != std::string::npos, last.c_str());
    }
    const Outcome taken = command::dqwatch({"compare", folder / "huge.csv", "--out", folder / "huge.csv"});
    TEST_ASSERT_EQUAL_INT_MESSAGE(1, taken.code, taken.err.c_str());
}

/// What one log said, and the largest over many.
struct Worst {
    double q15_float = 0.0, excess = -HUGE_VAL;
    int pairs = 0;
};

static void judge(const json& result, const std::string& what, Worst& all)
{
    expect_schema(result, what);
    const json& d = result.at("difference_percent");
    Worst here;
    std::string line = what;
    for (const char* name : names) {
        if (!d.at("q15_float").contains(name)) continue;
        const double q15 = d.at("q15_float").at(name).get<double>();
        here.pairs++;
        here.q15_float = std::max(here.q15_float, std::fabs(q15));
        line += std::string("  ") + name + " " + std::to_string(q15);
        if (!d.at("q15_reference").contains(name) || !d.at("float_reference").contains(name)) continue;
        here.excess = std::max(here.excess, std::fabs(d.at("q15_reference").at(name).get<double>()) -
                                                std::fabs(d.at("float_reference").at(name).get<double>()));
    }
    if (std::getenv("DQW_TEST_VALUES") != nullptr)
        std::printf("%-42s worst |q15_float| %.4f %%, worst excess %+.4f %%, %d parameters\n", what.c_str(),
                    here.q15_float, here.pairs ? here.excess : 0.0, here.pairs);
    TEST_ASSERT_TRUE_MESSAGE(here.q15_float <= kMost, line.c_str());
    TEST_ASSERT_TRUE_MESSAGE(here.excess <= kMost, line.c_str());
    // What float knows fixed point knows, and the other way round.
    for (const char* name : names)
        TEST_ASSERT_EQUAL_INT_MESSAGE(result.at("float").contains(name), result.at("q15").contains(name),
                                      (what + " " + name).c_str());
    all.q15_float = std::max(all.q15_float, here.q15_float);
    all.excess = std::max(all.excess, here.excess);
    all.pairs += here.pairs;
}

static Worst over_scenarios(const char* noise)
{
    const Folder folder;
    Worst all;
    const json list = json::parse(command::dqwatch({"sim", "--list", "--json"}).out);
    for (const auto& scenario : list.at("scenarios")) {
        const std::string name = scenario.at("name"), regime = scenario.at("regime");
        // What a drive as it is built adds is no part of either model: what they take up is not one number.
        if (name.rfind("drive_", 0) == 0) continue;
        if (regime == "mechanical") continue;  // test_cli_mechanical_q15
        std::vector<std::string> args = {"sim", name, "--out", folder / "", "--set", std::string("noise=") + noise};
        // Faults begin at 1 s.
        if (regime == "dynamic" && scenario.at("rows").get<long>() > 1000)
            args.insert(args.end(), {"--set", "duration_s=2"});
        const Outcome sim = command::dqwatch(args);
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, sim.code, sim.err.c_str());
        const Outcome run = command::dqwatch({"compare", folder / (name + ".csv"), "--json", "--out", folder / "o"});
        TEST_ASSERT_TRUE_MESSAGE(run.code == 0 || run.code == 4, (name + ": " + run.err).c_str());
        judge(json::parse(run.out), "dqwatch sim " + name + " --set noise=" + noise, all);
    }
    if (std::getenv("DQW_TEST_VALUES") != nullptr)
        std::printf("noise %s: worst |q15_float| %.4f %%, worst excess %+.4f %%, %d parameters\n", noise, all.q15_float,
                    all.excess, all.pairs);
    return all;
}

static void fixed_point_follows_float_on_noise_free_scenarios(void)
{
    const Worst all = over_scenarios("0");
    TEST_ASSERT_DOUBLE_WITHIN(0.09, 0.19, all.q15_float);  // 0.191, traction_ipm, whose machine saturates
    TEST_ASSERT_TRUE(all.pairs >= 40);
}

static void fixed_point_follows_float_through_noise_of_a_fifth(void)
{
    const Worst all = over_scenarios("0.2");
    TEST_ASSERT_DOUBLE_WITHIN(0.12, 0.16, all.q15_float);  // 0.154, paper_step's L_q
    TEST_ASSERT_TRUE(all.pairs >= 25);
}

static void fixed_point_follows_float_on_measured_logs(void)
{
    const Folder folder;
    Worst all;
    std::error_code error;
    for (const auto& file : fs::directory_iterator(command::environment("DATA", "../shared/data"), error)) {
        std::string header;
        std::getline(std::ifstream(file.path()), header);
        // Flux maps are no logs; friction logs are test_cli_mechanical_q15's.
        if (file.path().extension() != ".csv" || header.find("psi_d_Wb") != header.npos ||
            header.find("v_d_V") == header.npos)
            continue;
        const Outcome run = command::dqwatch({"compare", file.path().string(), "--json", "--out", folder / "o"});
        TEST_ASSERT_TRUE_MESSAGE(run.code == 0 || run.code == 4, (file.path().string() + ": " + run.err).c_str());
        judge(json::parse(run.out), file.path().filename().string(), all);
    }
    if (all.pairs == 0) TEST_IGNORE_MESSAGE("no measured logs: set DATA");
    TEST_ASSERT_TRUE(all.q15_float > 1e-4 && all.q15_float < 0.05);  // 0.0063, the grid's L_d
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(json_page_and_table_of_a_log);
    RUN_TEST(values_are_those_of_learn_and_fit);
    RUN_TEST(exit_code_4_where_one_of_them_cannot_tell);
    RUN_TEST(bad_input_is_one_line_and_exit_code_3);
    RUN_TEST(fixed_point_follows_float_on_noise_free_scenarios);
    RUN_TEST(fixed_point_follows_float_through_noise_of_a_fifth);
    RUN_TEST(fixed_point_follows_float_on_measured_logs);
    return UNITY_END();
}
