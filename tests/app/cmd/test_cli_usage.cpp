// The command line itself: help, wrong usage, lists, output that cannot be written.
#include <sys/stat.h>

#include <nlohmann/json.hpp>
#include <string>

#include "command.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

using command::Folder;
using command::Outcome;

/// One line on stderr that holds `names`, nothing on stdout.
static void expect_complaint(const Outcome& run, int code, const std::string& names)
{
    TEST_ASSERT_EQUAL_INT_MESSAGE(code, run.code, (names + ": " + run.err).c_str());
    TEST_ASSERT_EQUAL_STRING_MESSAGE("", run.out.c_str(), names.c_str());
    TEST_ASSERT_TRUE_MESSAGE(!run.err.empty() && run.err.find('\n') == run.err.size() - 1, run.err.c_str());
    TEST_ASSERT_TRUE_MESSAGE(run.err.find(names) != std::string::npos, run.err.c_str());
}

static void help_and_version_are_no_errors(void)
{
    for (const auto& args : std::vector<std::vector<std::string>>{{"--help"},
                                                                  {"-h"},
                                                                  {"fit", "--help"},
                                                                  {"learn", "--help"},
                                                                  {"sim", "--help"},
                                                                  {"paper", "--help"},
                                                                  {"trace", "--help"},
                                                                  {"monitor", "--help"},
                                                                  {"compare", "--help"},
                                                                  {"columns", "--help"},
                                                                  {"formats", "--help"},
                                                                  {"demo", "--help"}}) {
        const Outcome run = command::dqwatch(args);
        TEST_ASSERT_EQUAL_INT(0, run.code);
        TEST_ASSERT_TRUE(run.out.find("--json") != std::string::npos || args.size() == 1);
        TEST_ASSERT_EQUAL_STRING("", run.err.c_str());
    }
    const Outcome all = command::dqwatch({"--help"});
    for (const char* name :
         {"paper", "sim", "learn", "fit", "trace", "compare", "monitor", "columns", "formats", "demo"})
        TEST_ASSERT_TRUE_MESSAGE(all.out.find(name) != std::string::npos, name);
    const Outcome version = command::dqwatch({"--version"});
    TEST_ASSERT_EQUAL_INT(0, version.code);
    TEST_ASSERT_EQUAL_INT(0, version.out.compare(0, 8, "dqwatch "));
}

static void wrong_usage_is_exit_code_2(void)
{
    const struct {
        std::vector<std::string> args;
        const char* names;
    } wrong[] = {
        {{}, "subcommand"},
        {{"fly"}, "fly"},
        {{"live"}, "pip install './python[live]'"},
        {{"fit"}, "LOG.csv"},
        {{"learn"}, "LOG.csv"},
        {{"sim"}, "SCENARIO"},
        {{"fit", "a.csv", "--fast"}, "--fast"},
        {{"fit", "a.csv", "--pole-pairs", "0"}, "--pole-pairs"},
        {{"fit", "a.csv", "--pole-pairs", "-4"}, "--pole-pairs"},
        {{"fit", "a.csv", "--pole-pairs", "2.5"}, "--pole-pairs"},
        {{"fit", "a.csv", "--pole-pairs", "four"}, "--pole-pairs"},
        {{"fit", "a.csv", "--pole-pairs"}, "--pole-pairs"},
        {{"fit", "a.csv", "--parameters", "R_ohm,colour"}, "colour"},
        {{"learn", "a.csv", "--arith", "q7"}, "q7"},
        {{"compare"}, "LOG.csv"},
        {{"columns"}, "LOG.csv"},
        {{"fit", "a.csv", "--format", "no_such_format"}, "--format"},
        {{"fit", "a.csv", "--gear", "-9"}, "--gear"},
        {{"fit", "a.csv", "--v-dc", "nan"}, "--v-dc"},
        {{"fit", "a.csv", "--period", "0"}, "--period"},
        {{"compare", "a.csv", "b.csv"}, "b.csv"},
        {{"compare", "a.csv", "--arith", "q15"}, "--arith"},
        {{"fit", "a.csv", "--arith", "float"}, "--arith"},
        {{"fit", "a.csv", "--effect", "gremlins"}, "--effect"},
        {{"sim", "no_such_drive"}, "servo"},
        {{"sim", "servo", "--set", "machine.R_ohm"}, "key=value"},
        {{"sim", "servo", "--set", "=3"}, "key=value"},
        {{"sim", "servo", "--set", "machine.colour=3"}, "machine.colour"},
        {{"sim", "servo", "--polled"}, "--polled"},
        {{"sim", "servo", "--modulation"}, "--modulation"},
        {{"sim", "servo", "--seed", "many"}, "--seed"},
    };
    for (const auto& w : wrong) expect_complaint(command::dqwatch(w.args), 2, w.names);
}

/// The key and what it takes: names where it is a choice.
static void a_value_that_cannot_be_is_exit_code_3(void)
{
    const struct {
        std::vector<std::string> args;
        const char *key, *expected;
    } wrong[] = {
        {{"--set", "machine.R_ohm=abc"}, "machine.R_ohm: \"abc\"", "a number"},
        {{"--set", "machine.R_ohm="}, "machine.R_ohm", "a number"},
        {{"--set", "machine.pole_pairs=4.5"}, "machine.pole_pairs: \"4.5\"", "a whole number"},
        {{"--set", "balance=yes"}, "balance", "true or false"},
        {{"--set", "noise=much"}, "noise", "a number"},
        {{"--set", "inverter.modulation=sine"}, "inverter.modulation", "mean, centred, clamped_low, "},
        {{"--modulation", "sine"}, "inverter.modulation", "mean, centred, clamped_low, "},
        {{"--set", "sensing.phases=a"}, "sensing.phases", "abc, ab, bc or ca"},
        {{"--set", "machine.R_ohm=-1"}, "machine.R_ohm", "above 0"},
        {{"--set", "machine.pole_pairs=0", "--polled", "50"}, "machine.pole_pairs", "from 1 to 1000"},
        {{"--set", "nonideal.dead_time_width_A=-1"}, "nonideal.dead_time_width_A", "not be negative"},
        {{"--set", "nonideal.turn_short=1"}, "nonideal.turn_short", "below 1"},
        {{"--set", "nonideal.cogging_Nm=1"}, "nonideal.cogging_order", "1 or more"},
        {{"--set", "duration_s=1e4"}, "duration_s", "at most 20000000"},
        {{"--set", "duration_s=1e4", "--polled", "50"}, "duration_s", "at most 20000000: lower"},
        {{"--set", "duration_s=1e-9"}, "duration_s", "half a row"},
        {{"--polled", "often"}, "polled.rate_Hz", "a number"},
        {{"--polled", "0"}, "polled.rate_Hz", "above 0"},
        {{"--polled", "-50"}, "polled.rate_Hz", "above 0"},
        {{"--polled", "9000"}, "polled.rate_Hz", "half of 1/drive.dt_s"},
        {{"--polled", "0.1"}, "polled.rate_Hz", "no row"},
        {{"--polled", "50", "--set", "drive.log_every=2"}, "polled.rate_Hz", "drive.log_every"},
        {{"--polled", "50", "--set", "polled.queue_rows=-1"}, "polled.queue_rows", "not be negative"},
        {{"--polled", "50", "--set", "polled.lost_fraction=1"}, "polled.lost_fraction", "below 1"},
    };
    const Folder folder;
    for (const auto& w : wrong) {
        std::vector<std::string> args = {"sim", "servo", "--out", folder / "none"};
        args.insert(args.end(), w.args.begin(), w.args.end());
        const Outcome run = command::dqwatch(args);
        expect_complaint(run, 3, w.key);
        expect_complaint(run, 3, w.expected);
        TEST_ASSERT_FALSE(std::filesystem::exists(folder / "none/servo.csv"));
    }
}

static void sim_lists_its_scenarios_and_keys(void)
{
    const Outcome text = command::dqwatch({"sim", "--list"});
    TEST_ASSERT_EQUAL_INT(0, text.code);
    TEST_ASSERT_TRUE(text.out.find("servo") != std::string::npos);
    const Outcome run = command::dqwatch({"sim", "--list", "--json"});
    const auto json = nlohmann::json::parse(run.out);
    TEST_ASSERT_TRUE(json.at("scenarios").size() >= 5);
    for (const auto& s : json.at("scenarios")) {
        TEST_ASSERT_FALSE(s.at("about").get<std::string>().empty());
        TEST_ASSERT_TRUE(s.at("rows").get<long>() > 0);
    }
    const Outcome keys = command::dqwatch({"sim", "--list-keys"});
    TEST_ASSERT_TRUE(keys.out.find("machine.R_ohm ") != std::string::npos);
    TEST_ASSERT_TRUE(keys.out.find(" adams, bdf or rk4\n") != std::string::npos);
}

static void an_option_and_a_set_of_one_key_are_refused(void)
{
    const Folder folder;
    const std::vector<std::vector<std::string>> twice = {{"--seed", "5", "--set", "seed=6"},
                                                         {"--pole-pairs", "3", "--set", "machine.pole_pairs=5"}};
    for (auto args : twice) {
        args.insert(args.begin(), {"sim", "paper_step", "--out", folder / ""});
        expect_complaint(command::dqwatch(args), 2, "an option said it before");
    }
    TEST_ASSERT_EQUAL_INT(
        0, command::dqwatch({"sim", "paper_step", "--out", folder / "", "--set", "noise=-1", "--set", "noise=0"}).code);
}

static void what_cannot_be_written_is_exit_code_1(void)
{
    const Folder folder;
    const std::string file = folder.write("file", "");
    const std::vector<std::string> sim = {"sim", "paper_step", "--out"};
    auto into = [&](const std::string& dir) {
        auto args = sim;
        args.push_back(dir);
        return command::dqwatch(args);
    };
    expect_complaint(into(file), 1, file);
    expect_complaint(into(file + "/below"), 1, "below");
    expect_complaint(into("/proc/nowhere"), 1, "/proc/nowhere");
    if (::geteuid() != 0) {
        ::chmod((folder / "").c_str(), 0555);
        expect_complaint(into(folder / "x"), 1, "x");
        ::chmod((folder / "").c_str(), 0755);
    }
    // A full disk: the log goes to /dev/full by way of a link.
    std::filesystem::create_symlink("/dev/full", folder / "paper_step.csv");
    expect_complaint(into(folder / ""), 1, "No space left");
    const Outcome full = command::dqwatch({"sim", "--list"}, {"/dev/null", "/dev/full"});
    expect_complaint(full, 1, "stdout");
    const Outcome closed = command::dqwatch({"sim", "--list"}, {"/dev/null", "-"});
    expect_complaint(closed, 1, "stdout");
}

static void a_closed_stdout_does_not_end_in_a_file(void)
{
    const Folder folder;
    const Outcome run = command::dqwatch({"sim", "paper_step", "--out", folder / "d"}, {"/dev/null", "-"});
    TEST_ASSERT_EQUAL_INT(1, run.code);
    TEST_ASSERT_EQUAL_INT(0, command::read_file(folder / "d/paper_step.csv").compare(0, 4, "t_s,"));
}

static void folders_are_made(void)
{
    const Folder folder;
    const Outcome run = command::dqwatch({"sim", "paper_step", "--out", folder / "a/b/c"});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
    TEST_ASSERT_FALSE(command::read_file(folder / "a/b/c/paper_step.csv").empty());
    TEST_ASSERT_FALSE(command::read_file(folder / "a/b/c/paper_step.toml").empty());
}

static void no_progress_off_a_terminal(void)
{
    const Folder folder;
    // Either takes longer than a terminal would wait for a word.
    const char* const duration = command::sanitized() ? "duration_s=2" : "duration_s=20";
    const Outcome run = command::dqwatch({"sim", "servo", "--out", folder / "", "--set", duration});
    TEST_ASSERT_EQUAL_INT(0, run.code);
    TEST_ASSERT_EQUAL_STRING("", run.err.c_str());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(help_and_version_are_no_errors);
    RUN_TEST(wrong_usage_is_exit_code_2);
    RUN_TEST(a_value_that_cannot_be_is_exit_code_3);
    RUN_TEST(sim_lists_its_scenarios_and_keys);
    RUN_TEST(an_option_and_a_set_of_one_key_are_refused);
    RUN_TEST(what_cannot_be_written_is_exit_code_1);
    RUN_TEST(a_closed_stdout_does_not_end_in_a_file);
    RUN_TEST(folders_are_made);
    RUN_TEST(no_progress_off_a_terminal);
    return UNITY_END();
}
