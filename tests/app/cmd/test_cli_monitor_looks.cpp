// `dqwatch monitor` of slow logs, as people run it.
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>
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

std::string written(const Folder& folder, const polled_drive::Drawn& m)
{
    folder.write("drive.toml", "[log]\nregime = \"polled\"\n[machine]\npole_pairs = 5\n");
    return folder.write("drive.csv", polled_drive::csv(polled_drive::polled(m)));
}

std::vector<json> lines(const std::string& text)
{
    std::vector<json> out;
    std::istringstream all(text);
    for (std::string line; std::getline(all, line);) out.push_back(json::parse(line));
    return out;
}

void a_polled_log_tells_what_has_failed(void)
{
    const Folder folder;
    polled_drive::Drawn m;
    m.seconds = 200, m.noise_rad_s = 0.4, m.change_s = 110, m.psi_fall = 0.2;
    const std::string log = written(folder, m);
    const Outcome run = command::dqwatch({"monitor", log, "--json", "--out", folder / "o"});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
    const std::vector<json> said = lines(run.out);
    TEST_ASSERT_EQUAL_size_t(2, said.size());
    TEST_ASSERT_EQUAL_STRING("demagnetisation", said[0].at("fault").get<std::string>().c_str());
    TEST_ASSERT_DOUBLE_WITHIN(0.01 * m.psi_Wb, m.psi_Wb, said[0].at("healthy").get<double>());
    TEST_ASSERT_EQUAL_STRING("dqwatch.sensitivity/1", said[1].at("schema").get<std::string>().c_str());
    const json& channels = said[1].at("parameters");
    TEST_ASSERT_TRUE(channels.at("psi_Wb").at("watched").get<bool>());
    TEST_ASSERT_FALSE(channels.at("friction_Nm").at("watched").get<bool>());
    TEST_ASSERT_TRUE(has(channels.at("short_S").at("why").get<std::string>(), "averages"));
    TEST_ASSERT_TRUE_MESSAGE(has(run.err, "polled log: "), run.err.c_str());
    TEST_ASSERT_TRUE(has(command::read_file(folder / "o/monitor.html"), "demagnetisation"));

    const Outcome text = command::dqwatch({"monitor", log, "--out", folder / "o"});
    TEST_ASSERT_TRUE_MESSAGE(has(text.out, "demagnetisation: psi_Wb "), text.out.c_str());
    TEST_ASSERT_FALSE_MESSAGE(has(text.out, "refused"), text.out.c_str());
    for (const std::vector<std::string>& more :
         {std::vector<std::string>{"--arith", "q15"}, std::vector<std::string>{"--effect", "dead_time"}}) {
        std::vector<std::string> args = {"monitor", log, "--out", folder / "o"};
        args.insert(args.end(), more.begin(), more.end());
        const Outcome refused = command::dqwatch(args);
        TEST_ASSERT_EQUAL_INT(3, refused.code);
        TEST_ASSERT_TRUE_MESSAGE(has(refused.err, "drive.csv:1: a polled log: looks of it know neither"),
                                 refused.err.c_str());
    }
}

/// Ten minutes of a servo that heats up by tens of kelvin, as its own simulator has it: no event, and the heat is read.
void settled_points_show_heat_and_no_fault(void)
{
    const Folder folder;
    TEST_ASSERT_EQUAL_INT(0, command::dqwatch({"sim", "heating", "--seed", "11", "--out", folder / ""}).code);
    const Outcome run = command::dqwatch({"monitor", folder / "heating.csv", "--json", "--out", folder / "o"});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
    const std::vector<json> said = lines(run.out);
    TEST_ASSERT_EQUAL_size_t_MESSAGE(1, said.size(), run.out.c_str());
    const json& channels = said[0].at("parameters");
    for (const char* name : {"Lq_H", "psi_Wb", "temperature_K"})
        TEST_ASSERT_TRUE_MESSAGE(channels.at(name).at("watched").get<bool>(), name);
    // A demagnetisation of a tenth would be seen.
    TEST_ASSERT_TRUE(channels.at("psi_Wb").at("least_change").get<double>() < 0.012);
}

/// The same drive, its magnet weak from the start, and weaker while the first looks last: beside the machine file, and
/// without.
void what_is_there_at_the_start_is_held_against_the_machine_file(void)
{
    const Folder folder;
    const auto said_of = [&](const polled_drive::Drawn& m, const std::string& machine) {
        const std::string log = written(folder, m);
        folder.write("drive.toml", "[log]\nregime = \"polled\"\n[machine]\npole_pairs = 5\n" + machine);
        const Outcome run = command::dqwatch({"monitor", log, "--out", folder / "o"});
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
        return run.err;
    };
    polled_drive::Drawn m;
    m.seconds = 120, m.noise_rad_s = 0.4;
    const std::string plate = "R_ohm = 0.31\nLd_H = 0.4e-3\nLq_H = 0.7e-3\npsi_Wb = 0.015\n";
    TEST_ASSERT_TRUE(has(said_of(m, ""), "first looks is taken as healthy, a fault too"));
    const std::string healthy = said_of(m, plate);
    TEST_ASSERT_FALSE_MESSAGE(has(healthy, "warning"), healthy.c_str());
    TEST_ASSERT_TRUE_MESSAGE(has(healthy, "the first looks beside the machine file: R_ohm"), healthy.c_str());
    polled_drive::Drawn weak = m;
    weak.psi_Wb = 0.8 * m.psi_Wb;
    const std::string fallen = said_of(weak, plate);
    TEST_ASSERT_TRUE_MESSAGE(has(fallen, "warning: psi_Wb is 0.012"), fallen.c_str());
    TEST_ASSERT_FALSE_MESSAGE(has(fallen, "warning: R_ohm") || has(fallen, "goes from"), fallen.c_str());
    polled_drive::Drawn falling = m;
    falling.change_s = 20, falling.psi_fall = 0.3;
    const std::string on_its_way = said_of(falling, "");
    TEST_ASSERT_TRUE_MESSAGE(has(on_its_way, "warning: psi_Wb goes from 0.01"), on_its_way.c_str());
    polled_drive::Drawn warming = m;
    warming.warm_K = 60;
    const std::string warmer = said_of(warming, plate);
    TEST_ASSERT_FALSE_MESSAGE(has(warmer, "warning"), warmer.c_str());
}

/// A refusal names the unit that may be its reason.
void a_refused_log_says_what_is_doubted_of_it(void)
{
    const Folder folder;
    polled_drive::Drawn m;
    m.seconds = 20;
    dqw::Log log = polled_drive::polled(m);
    for (auto* column : {&log.v_d_V, &log.v_q_V})
        for (double& v : *column) v *= 1e3;
    folder.write("drive.toml", "[log]\nregime = \"polled\"\n[machine]\npole_pairs = 5\n");
    const std::string path = folder.write("drive.csv", polled_drive::csv(log));
    const Outcome run = command::dqwatch({"monitor", path, "--out", folder / "o"});
    TEST_ASSERT_EQUAL_INT(3, run.code);
    TEST_ASSERT_TRUE_MESSAGE(has(run.err, "one more is to be watched; v_d_V, v_q_V: the numbers look like mV"),
                             run.err.c_str());
}

}  // namespace

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_polled_log_tells_what_has_failed);
    RUN_TEST(settled_points_show_heat_and_no_fault);
    RUN_TEST(what_is_there_at_the_start_is_held_against_the_machine_file);
    RUN_TEST(a_refused_log_says_what_is_doubted_of_it);
    return UNITY_END();
}
