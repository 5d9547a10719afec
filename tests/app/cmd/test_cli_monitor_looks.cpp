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

}  // namespace

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_polled_log_tells_what_has_failed);
    RUN_TEST(settled_points_show_heat_and_no_fault);
    return UNITY_END();
}
