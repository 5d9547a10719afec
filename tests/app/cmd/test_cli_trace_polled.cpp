// `dqwatch trace` of polled logs: names of what is there, none of what is not, and a refusal in numbers.
#include <cmath>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "command.hpp"
#include "polled_drive.hpp"
#include "unity.h"

extern "C" void setUp(void) {}
extern "C" void tearDown(void) {}

using command::Folder;
using command::Outcome;
using nlohmann::json;

namespace {

bool has(const std::string& text, const std::string& part) { return text.find(part) != text.npos; }

Outcome traced(const Folder& folder, const dqw::Log& log, const std::vector<std::string>& more = {})
{
    folder.write("drive.toml", "[log]\nregime = \"polled\"\n[machine]\npole_pairs = 5\n");
    std::vector<std::string> args = {"trace", folder.write("drive.csv", polled_drive::csv(log)), "--json", "--out",
                                     folder / "o"};
    args.insert(args.end(), more.begin(), more.end());
    return command::dqwatch(args);
}

/// "dead_time " for each effect that is named.
std::string names(const Outcome& run)
{
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
    const json said = json::parse(run.out);
    std::string out;
    for (const json& effect : said.at("effects")) out += effect.at("name").get<std::string>() + " ";
    return out;
}

/// One log of many under the sanitizers: they are ten times as slow, and all go the same way.
unsigned last(unsigned first, unsigned end) { return command::sanitized() ? first : end; }

polled_drive::Drawn drawn(unsigned seed)
{
    polled_drive::Drawn m;
    m.seed = seed, m.seconds = 120, m.noise_rad_s = 0.2;
    return m;
}

void a_healthy_drive_gets_no_name(void)
{
    const Folder folder;
    for (unsigned seed = 1; seed <= last(1, 6); ++seed) {
        polled_drive::Drawn m = drawn(seed);
        m.rate_Hz = seed % 2 == 0 ? 20 : 50;
        const Outcome run = traced(folder, polled_drive::polled(m));
        TEST_ASSERT_EQUAL_STRING_MESSAGE("", names(run).c_str(), ("seed " + std::to_string(seed)).c_str());
        TEST_ASSERT_TRUE_MESSAGE(has(run.err, "polled: traced in "), run.err.c_str());
    }
}

void what_is_there_is_named_in_its_size(void)
{
    const Folder folder;
    constexpr double kPhase = 0.78539816339744831;
    for (unsigned seed = 11; seed <= last(11, 14); ++seed) {
        polled_drive::Drawn m = drawn(seed);
        m.lost_V = 0.3;
        const Outcome run = traced(folder, polled_drive::polled(m));
        TEST_ASSERT_EQUAL_STRING_MESSAGE("dead_time ", names(run).c_str(), ("seed " + std::to_string(seed)).c_str());
        const json V = json::parse(run.out).at("effects")[0].at("parameters").at("voltage_V");
        const double value = V.at("value"), sd = V.at("sd");
        std::printf("dead time of %.3f V: %.3f ± %.3f V\n", kPhase * m.lost_V, value, sd);
        TEST_ASSERT_DOUBLE_WITHIN(0.02, kPhase * m.lost_V, value);
        TEST_ASSERT_TRUE(sd > 5e-4 && sd < 0.02);
    }
    if (command::sanitized()) return;
    polled_drive::Drawn hot = drawn(21);
    hot.warm_K = 60, hot.measures_heat = true, hot.seconds = 400;
    TEST_ASSERT_TRUE(has(names(traced(folder, polled_drive::polled(hot))), "winding_temperature "));
}

// The log has the voltage that was asked for; behind a resistance the link sags with the power.
void a_link_that_sags_is_named(void)
{
    const Folder folder;
    for (unsigned seed = 41; seed <= last(41, 43); ++seed) {
        dqw::Log log = polled_drive::polled(drawn(seed));
        const auto power = [&](std::size_t k) { return log.v_d_V[k] * log.i_d_A[k] + log.v_q_V[k] * log.i_q_A[k]; };
        double most = 0.0;
        for (std::size_t k = 0; k < log.rows(); ++k) most = std::fmax(most, power(k));
        for (std::size_t k = 0; k < log.rows(); ++k) {
            const double gain = 1.0 - 0.1 * power(k) / most;
            log.v_d_V[k] /= gain, log.v_q_V[k] /= gain;
        }
        const Outcome run = traced(folder, log);
        TEST_ASSERT_EQUAL_STRING_MESSAGE("voltage_scale ", names(run).c_str(),
                                         ("seed " + std::to_string(seed)).c_str());
        const double gain = json::parse(run.out).at("effects")[0].at("parameters").at("gain").at("value");
        std::printf("a sag of 10 %%: %.1f %%\n", 100 * gain);
        TEST_ASSERT_DOUBLE_WITHIN(0.01, -0.1, gain);
    }
}

// Points are rows that were turned by a time which the rows hardly tell; no deviation is below that of the rows.
void no_parameter_is_known_better_than_by_the_rows(void)
{
    const Folder folder;
    for (unsigned seed = 51; seed <= last(51, 53); ++seed) {
        const Outcome run = traced(folder, polled_drive::polled(drawn(seed)));
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
        const json told = json::parse(run.out).at("after").at("parameters");
        const json rows = json::parse(command::dqwatch({"fit", folder / "drive.csv", "--json"}).out).at("parameters");
        int compared = 0;
        for (const char* name : {"R_ohm", "Ld_H", "Lq_H", "psi_Wb"}) {
            if (!told.contains(name) || !rows.contains(name)) continue;
            const double sd = told.at(name).at("sd"), least = rows.at(name).at("sd");
            std::printf("%s: %g, of the rows %g\n", name, sd, least);
            TEST_ASSERT_TRUE_MESSAGE(sd >= 0.999 * least, name);
            ++compared;
        }
        TEST_ASSERT_TRUE(compared >= 3);
    }
}

void too_few_looks_are_refused_in_numbers(void)
{
    const Folder folder;
    polled_drive::Drawn m = drawn(31);
    m.seconds = 4;
    const Outcome run = traced(folder, polled_drive::polled(m));
    TEST_ASSERT_EQUAL_INT_MESSAGE(3, run.code, run.out.c_str());
    TEST_ASSERT_TRUE_MESSAGE(has(run.err, "drive.csv:1: a polled log with ") && has(run.err, "at least 30"),
                             run.err.c_str());
    const Outcome other = traced(folder, polled_drive::polled(drawn(32)), {"--effect", "iron_loss"});
    TEST_ASSERT_EQUAL_INT(3, other.code);
    TEST_ASSERT_TRUE_MESSAGE(has(other.err, "it tells no iron_loss"), other.err.c_str());
}

std::string vendors() { return command::environment("DATA", "../shared/data") + "/vendor/"; }

// Two runs of one actuator, 20 s each.
void actuators_on_a_bench_get_no_name(void)
{
    // Nothing may live that a test which is skipped does not free.
    if (!std::ifstream(vendors() + "README.md")) TEST_IGNORE_MESSAGE("no vendors' logs: set DATA");
    const std::string data = vendors();
    const Folder folder;
    for (const char* name : {"tmotor_eff_1667828286.70403.csv", "tmotor_eff_1667828588.0588076.csv"}) {
        const Outcome run = command::dqwatch(
            {"trace", data + name, "--gear", "9", "--pole-pairs", "21", "--json", "--out", folder / "o"});
        TEST_ASSERT_EQUAL_STRING_MESSAGE("", names(run).c_str(), name);
        const json said = json::parse(run.out);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(0, said.at("doubt").size(), said.at("doubt").dump().c_str());
        TEST_ASSERT_FALSE_MESSAGE(has(said.at("structure").dump() + said.at("rest").dump(), "angle"), name);
    }
}

}  // namespace

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_healthy_drive_gets_no_name);
    RUN_TEST(what_is_there_is_named_in_its_size);
    RUN_TEST(a_link_that_sags_is_named);
    RUN_TEST(no_parameter_is_known_better_than_by_the_rows);
    RUN_TEST(too_few_looks_are_refused_in_numbers);
    RUN_TEST(actuators_on_a_bench_get_no_name);
    return UNITY_END();
}
