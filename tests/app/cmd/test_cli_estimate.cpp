// `learn` and `fit` on good logs: the JSON object, equivalent spellings of one log, several logs, the warning of rpm.
// Plain only: long, and what it runs others run under the sanitizers.
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "command.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

using command::Folder;
using command::Outcome;
using nlohmann::json;

static const char* const readers[] = {"fit", "learn"};

static json run_json(std::vector<std::string> args, int code = 0)
{
    args.push_back("--json");
    const Outcome run = command::dqwatch(args);
    TEST_ASSERT_EQUAL_INT_MESSAGE(code, run.code, (args[0] + ": " + run.err).c_str());
    // parse() refuses anything behind the object.
    return json::parse(run.out);
}

static double value(const json& result, const char* name)
{
    return result.at("parameters").at(name).at("value").get<double>();
}

static void expect_truth(const json& result, double percent)
{
    const command::Machine m;
    const std::pair<const char*, double> truths[] = {
        {"R_ohm", m.R_ohm}, {"Ld_H", m.Ld_H}, {"Lq_H", m.Lq_H}, {"psi_Wb", m.psi_Wb}};
    for (const auto& [name, truth] : truths) {
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.01 * percent * truth, truth, value(result, name), name);
        TEST_ASSERT_TRUE_MESSAGE(result.at("parameters").at(name).at("sd").get<double>() > 0, name);
    }
}

static void expect_schema(const json& result)
{
    TEST_ASSERT_EQUAL_STRING("dqwatch.parameters/1", result.at("schema").get<std::string>().c_str());
    TEST_ASSERT_TRUE(result.at("rows").is_number_integer());
    const std::set<std::string> regimes = {"dynamic", "steady", "standstill", "mechanical"};
    TEST_ASSERT_EQUAL_size_t(1, regimes.count(result.at("regime").get<std::string>()));
    for (const auto& [name, entry] : result.at("parameters").items()) {
        TEST_ASSERT_TRUE_MESSAGE(entry.at("value").is_number(), name.c_str());
        TEST_ASSERT_TRUE_MESSAGE(entry.value("given", false) || entry.at("sd").is_number(), name.c_str());
    }
    TEST_ASSERT_TRUE(result.at("effects").is_array());
    for (const auto& item : result.at("not_identifiable")) {
        TEST_ASSERT_TRUE(item.at("name").is_string());
        TEST_ASSERT_TRUE(item.at("why").is_string());
        TEST_ASSERT_FALSE(result.at("parameters").contains(item.at("name").get<std::string>()));
    }
    TEST_ASSERT_TRUE(result.at("residual").at("rms").is_number());
    TEST_ASSERT_EQUAL_STRING(result.at("regime") == "mechanical" ? "Nm" : "V",
                             result.at("residual").at("unit").get<std::string>().c_str());
}

static void json_is_one_object_with_the_documented_fields(void)
{
    const Folder folder;
    command::write_log(folder / "log.csv", 2000);
    for (const char* reader : readers) {
        const json result = run_json({reader, folder / "log.csv", "--pole-pairs", "4"});
        expect_schema(result);
        expect_truth(result, 1);
        TEST_ASSERT_EQUAL_INT(2000, result.at("rows").get<int>());
        TEST_ASSERT_EQUAL_INT(4, result.at("parameters").at("pole_pairs").at("value").get<int>());
        TEST_ASSERT_TRUE(result.at("parameters").at("pole_pairs").at("given").get<bool>());
    }
}

static void one_log_spelt_in_other_ways_gives_the_same_result(void)
{
    const Folder folder;
    const std::string plain = folder / "log.csv";
    command::write_log(plain, 2000);
    command::Style crlf, bom, semicolons, vesc;
    crlf.newline = "\r\n";
    bom.mark = "\xef\xbb\xbf";
    semicolons.separator = ';';
    vesc.separator = ';', vesc.trailing = true, vesc.newline = "\r\n", vesc.mark = "\xef\xbb\xbf";
    for (const char* reader : readers) {
        command::write_log(plain, 2000);
        const json expected = run_json({reader, plain, "--pole-pairs", "4"});
        for (const auto& style : {crlf, bom, semicolons, vesc}) {
            command::write_log(plain, 2000, {}, style);
            TEST_ASSERT_EQUAL_STRING(expected.dump().c_str(),
                                     run_json({reader, plain, "--pole-pairs", "4"}).dump().c_str());
        }
        const std::string text = [&] {
            command::write_log(plain, 2000);
            return command::read_file(plain);
        }();
        folder.write("log.csv", text + "\n\n\r\n");
        TEST_ASSERT_EQUAL_STRING(expected.dump().c_str(),
                                 run_json({reader, plain, "--pole-pairs", "4"}).dump().c_str());
    }
}

static void a_log_comes_through_a_pipe(void)
{
    const Folder folder;
    command::write_log(folder / "log.csv", 2000);
    for (const char* reader : readers) {
        const std::string shell = "cat '" + (folder / "log.csv") + "' | '" + command::binary() + "' " + reader +
                                  " /dev/stdin --pole-pairs 4 --json | cat";
        const Outcome run = command::run_program({"sh", "-c", shell});
        expect_truth(json::parse(run.out), 1);
    }
}

static void several_logs_are_estimated_jointly(void)
{
    const Folder folder;
    command::Machine other;
    other.period = 3100;
    command::write_log(folder / "a.csv", 2000);
    command::write_log(folder / "b.csv", 2500, other);
    folder.write("b.toml", "[machine]\npole_pairs = 4\n");
    for (const char* reader : readers) {
        const json result = run_json({reader, folder / "a.csv", folder / "b.csv"});
        expect_truth(result, 1);
        TEST_ASSERT_EQUAL_INT(4500, result.at("rows").get<int>());
        TEST_ASSERT_TRUE(result.at("parameters").at("pole_pairs").at("given").get<bool>());
    }
}

/// One log again, under its name and another's, and its first half: no more is known than by one.
static void rows_given_twice_count_once(void)
{
    const Folder folder;
    const std::string one = folder / "one.csv";
    command::write_log(one, 2000);
    const std::string text = command::read_file(one), again = folder.write("again.csv", text),
                      half = folder.write("half.csv", text.substr(0, text.find('\n', text.size() / 2) + 1));
    const auto fitted = [](std::vector<std::string> logs) {
        logs.insert(logs.begin(), "fit");
        return run_json(logs);
    };
    const json expected = fitted({one}).at("parameters");
    for (const std::vector<std::string>& logs : {std::vector<std::string>{one, one}, {half, one, again}}) {
        const json said = fitted(logs);
        TEST_ASSERT_EQUAL_STRING(expected.dump().c_str(), said.at("parameters").dump().c_str());
        TEST_ASSERT_TRUE_MESSAGE(said.at("notes").dump().find("used once") != std::string::npos,
                                 said.at("notes").dump().c_str());
    }
}

static void previous_voltages_give_the_same_parameters(void)
{
    const Folder folder;
    command::write_log(folder / "log.csv", 2001);
    std::string text = command::read_file(folder / "log.csv"), out, before_d = "0", before_q = "0";
    for (std::size_t at = 0, line = 0; at < text.size(); ++line) {
        const std::size_t end = text.find('\n', at), t = text.find(',', at), d = text.find(',', t + 1),
                          q = text.find(',', d + 1);
        const std::string v_d = text.substr(t + 1, d - t - 1), v_q = text.substr(d + 1, q - d - 1);
        out += line ? text.substr(at, t - at) + "," + before_d + "," + before_q + text.substr(q, end - q) + "\n"
                    : text.substr(at, end - at) + "\n";
        if (line) before_d = v_d, before_q = v_q;
        at = end + 1;
    }
    folder.write("log.csv", out);
    folder.write("log.toml", "[machine]\npole_pairs = 4\n[log]\nvoltage_interval = \"previous\"\n");
    for (const char* reader : readers) expect_truth(run_json({reader, folder / "log.csv"}), 1);
}

// What the machine file says of the voltage goes into the deviations, over the current, and moves no value.
static void a_voltage_that_may_be_off_makes_values_less_sure(void)
{
    const Folder folder;
    std::string text = "v_d_V,v_q_V,i_d_A,i_q_A\n";
    for (int k = -20; k <= 20; ++k) text += std::to_string(0.5 * k) + ",0," + std::to_string(k) + ",0\n";
    folder.write("log.csv", text);
    const double i_rms = std::sqrt(20.0 * 21.0 / 3.0);
    for (const char* arithmetic : {"float", "q15"}) {
        folder.write("log.toml", "[log]\nregime = \"standstill\"\n");
        const std::vector<std::string> args = {"learn", folder / "log.csv", "--arith", arithmetic};
        const json without = run_json(args);
        folder.write("log.toml", "[log]\nregime = \"standstill\"\nvoltage_error_V = 0.2\n");
        const json with = run_json(args);
        TEST_ASSERT_EQUAL_DOUBLE(value(without, "R_ohm"), value(with, "R_ohm"));
        const auto sd = [](const json& result) { return result.at("parameters").at("R_ohm").at("sd").get<double>(); };
        // Its scale moves all of it: 12 bits where nobody says, and what is said.
        folder.write("log.toml", "[log]\nregime = \"standstill\"\nvoltage_scale = 0\n");
        const json exact = run_json(args);
        folder.write("log.toml", "[log]\nregime = \"standstill\"\nvoltage_scale = 0.01\n");
        const json coarse = run_json(args);
        TEST_ASSERT_EQUAL_DOUBLE(value(without, "R_ohm"), value(coarse, "R_ohm"));
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(2e-5, 0.01 * 0.5, sd(coarse), arithmetic);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(5e-6, std::hypot(sd(exact), 1.41e-4 * 0.5), sd(without), arithmetic);
        TEST_ASSERT_TRUE_MESSAGE(sd(exact) < 0.9 * sd(without), arithmetic);
        TEST_ASSERT_TRUE_MESSAGE(sd(without) < 0.02 * sd(with), arithmetic);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.03 * 0.2 / i_rms, 0.2 / i_rms, sd(with), arithmetic);
    }
}

static void nominal_values_do_not_move_the_fit(void)
{
    const Folder folder;
    command::write_log(folder / "log.csv", 2000);
    const json without = run_json({"fit", folder / "log.csv", "--pole-pairs", "4"});
    for (const char* nominal : {"R_ohm = 0.35\nLd_H = 1.4e-3\nLq_H = 2.1e-3\npsi_Wb = 0.035\n",
                                "R_ohm = 0.65\nLd_H = 2.6e-3\nLq_H = 3.9e-3\npsi_Wb = 0.065\n"}) {
        folder.write("log.toml", std::string("[machine]\npole_pairs = 4\n") + nominal);
        const json with = run_json({"fit", folder / "log.csv"});
        for (const char* name : {"R_ohm", "Ld_H", "Lq_H", "psi_Wb"}) {
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-6 * value(without, name), value(without, name), value(with, name),
                                              name);
            TEST_ASSERT_TRUE(with.at("parameters").at(name).contains("nominal"));
        }
    }
}

static void a_speed_in_rpm_is_warned_of(void)
{
    const Folder folder;
    command::Style rpm;
    rpm.speed_factor = 9.5492966;
    for (const char* toml : {"[machine]\npole_pairs = 4\n", "[machine]\npole_pairs = 4\npsi_Wb = 0.05\n"}) {
        folder.write("log.toml", toml);
        for (const char* reader : readers) {
            command::write_log(folder / "log.csv", 2000, {}, rpm);
            const Outcome run = command::dqwatch({reader, folder / "log.csv", "--json"});
            TEST_ASSERT_TRUE_MESSAGE(run.err.find("warning: ") != std::string::npos &&
                                         run.err.find("look like rpm") != std::string::npos,
                                     run.err.c_str());
            TEST_ASSERT_TRUE(json::parse(run.out).at("notes").dump().find("look like rpm") != std::string::npos);
            command::write_log(folder / "log.csv", 2000);
            TEST_ASSERT_TRUE(command::dqwatch({reader, folder / "log.csv"}).err.find("rpm") == std::string::npos);
        }
    }
    // The remedy that the warning names works.
    command::write_log(folder / "log.csv", 2000, {}, rpm);
    folder.write("log.toml",
                 "[machine]\npole_pairs = 4\n[columns]\nw_m_rad_s = { from = \"w_m_rad_s\", scale = 0.10471976 }\n");
    const Outcome run = command::dqwatch({"fit", folder / "log.csv", "--json"});
    TEST_ASSERT_TRUE(run.err.find("rpm") == std::string::npos);
    expect_truth(json::parse(run.out), 1);
}

static void exit_code_4_only_for_what_was_asked(void)
{
    // At standstill there is no flux to find; R alone is.
    const Folder folder;
    std::string text = "v_d_V,v_q_V,i_d_A,i_q_A\n";
    for (int k = -20; k <= 20; ++k)
        text += std::to_string(0.5 * k) + ",0," + std::to_string(k + 0.01 * (k % 3)) + ",0\n";
    const std::string path = folder.write("log.csv", text);
    for (const char* reader : readers) {
        TEST_ASSERT_DOUBLE_WITHIN(0.005, 0.5, value(run_json({reader, path}), "R_ohm"));
        const json result = run_json({reader, path, "--parameters", "R_ohm,psi_Wb"}, 4);
        expect_schema(result);
        TEST_ASSERT_EQUAL_STRING("psi_Wb", result.at("not_identifiable").at(0).at("name").get<std::string>().c_str());
        TEST_ASSERT_DOUBLE_WITHIN(0.005, 0.5, value(result, "R_ohm"));
    }
}

static void lists_leave_the_files_behind_them_alone(void)
{
    const Folder folder;
    command::write_log(folder / "log.csv", 2000);
    for (const char* reader : readers) {
        const json comma = run_json({reader, "--pole-pairs", "4", "--parameters", "R_ohm,psi_Wb", folder / "log.csv"});
        const json again = run_json(
            {reader, "--pole-pairs", "4", "--parameters", "R_ohm", "--parameters", "psi_Wb", folder / "log.csv"});
        TEST_ASSERT_EQUAL_STRING(comma.dump().c_str(), again.dump().c_str());
        TEST_ASSERT_TRUE(comma.at("parameters").contains("R_ohm"));
        const json other = run_json({reader, "--pole-pairs", "4", "--parameters", "J_kgm2", folder / "log.csv"}, 4);
        TEST_ASSERT_EQUAL_STRING("J_kgm2", other.at("not_identifiable").at(0).at("name").get<std::string>().c_str());
    }
}

static void out_keeps_the_object_in_a_file(void)
{
    const Folder folder;
    command::write_log(folder / "log.csv", 2000);
    for (const char* reader : readers) {
        const Outcome run = command::dqwatch(
            {reader, folder / "log.csv", "--pole-pairs", "4", "--json", "--out", folder / "o"});
        TEST_ASSERT_EQUAL_STRING(run.out.c_str(),
                                 command::read_file(folder / ("o/" + std::string(reader) + ".json")).c_str());
    }
}

/// A loop of 800 rad/s makes the speed 2.5 ms late, and R 30 % too large: the angle tells. (E193)
static void a_speed_that_is_late_is_brought_forward(void)
{
    const Folder folder;
    std::vector<std::string> args = {"sim", "drive_clamped", "--seed", "60549", "--out", folder / ""};
    for (const char* set :
         {"sensing.speed_bandwidth_rad_s=800", "inverter.dead_time_s=0", "inverter.node_F=0", "inverter.switch_V=0",
          "inverter.switch_ohm=0", "inverter.diode_V=0", "inverter.diode_ohm=0", "inverter.knee_A=0",
          "nonideal.iron_loss_S=0", "sensing.filter_s=0", "profile.load_Nm.random=1",
          "profile.load_Nm.random_hold_s=0.04", "profile.speed_rad_s.wave=80", "profile.speed_rad_s.wave_period_s=1.5",
          "profile.speed_rad_s.shape=square", "method=rk4", "duration_s=4"})
        args.insert(args.end(), {"--set", set});
    TEST_ASSERT_EQUAL_INT(0, command::dqwatch(args).code);
    for (const char* reader : readers) {
        const Outcome run = command::dqwatch({reader, folder / "drive_clamped.csv", "--json"});
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
        TEST_ASSERT_TRUE_MESSAGE(run.err.find(" ms late beside the angle") != std::string::npos, run.err.c_str());
        const json R = json::parse(run.out).at("parameters").at("R_ohm");
        const double off = R.at("value").get<double>() - 0.9, sd = R.at("sd").get<double>();
        TEST_ASSERT_TRUE_MESSAGE(std::fabs(off) < 0.01 && std::fabs(off) < 3 * sd && sd < 0.03, R.dump().c_str());
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(json_is_one_object_with_the_documented_fields);
    RUN_TEST(one_log_spelt_in_other_ways_gives_the_same_result);
    RUN_TEST(a_log_comes_through_a_pipe);
    RUN_TEST(several_logs_are_estimated_jointly);
    RUN_TEST(rows_given_twice_count_once);
    RUN_TEST(previous_voltages_give_the_same_parameters);
    RUN_TEST(a_voltage_that_may_be_off_makes_values_less_sure);
    RUN_TEST(nominal_values_do_not_move_the_fit);
    RUN_TEST(a_speed_in_rpm_is_warned_of);
    RUN_TEST(exit_code_4_only_for_what_was_asked);
    RUN_TEST(lists_leave_the_files_behind_them_alone);
    RUN_TEST(out_keeps_the_object_in_a_file);
    RUN_TEST(a_speed_that_is_late_is_brought_forward);
    return UNITY_END();
}
