// `dqwatch monitor` with a flux map: quiet while the drive is all over the map's plane; where the iron bends otherwise
// along one axis that axis' weight is named, and it or L where all of an axis' flux has changed.
#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "mapped_drive.hpp"
#include "monitor_command.hpp"
#include "unity.h"

extern "C" void setUp(void) {}
extern "C" void tearDown(void) {}

using command::Folder;
using mapped_drive::Iron;
using nlohmann::json;

namespace {

constexpr double kBefore_s = 8, kAfter_s = 6;

struct Case {
    const char* text;
    Iron after;
    std::vector<std::string> parameters;  ///< one of these is told; none: nothing is
    double part;                          ///< of what was healthy
};

void between(double low, double x, double high, const std::string& what)
{
    TEST_ASSERT_TRUE_MESSAGE(low <= x && x <= high, (what + ": " + std::to_string(x)).c_str());
}

void told(const Case& c, int seed)
{
    const Folder folder;
    const std::string log = mapped_drive::changed(folder, "log", c.after, seed, kBefore_s, kAfter_s);
    for (const char* arith : {"float", "q15"}) {
        // Twice the time, of which others run the half.
        if (command::sanitized() && std::string(arith) == "float") continue;
        const std::string what = std::string(c.text) + ", seed " + std::to_string(seed) + ", " + arith;
        const command::Outcome run = monitor_command::monitor({log, "--arith", arith, "--json", "--out", folder / "o"});
        std::vector<json> said;
        std::istringstream lines(run.out);
        for (std::string line; std::getline(lines, line);) said.push_back(json::parse(line));
        TEST_ASSERT_EQUAL_size_t_MESSAGE(c.parameters.empty() ? 1 : 2, said.size(), (what + run.out).c_str());
        // Watched to its band, and a quarter more that is told for sure.
        const json& channels = said.back().at("parameters");
        for (const char* name : {"flux_map_d", "flux_map_q"}) {
            TEST_ASSERT_TRUE_MESSAGE(channels.at(name).at("watched").get<bool>(), what.c_str());
            between(0.065, channels.at(name).at("least_change").get<double>(), 0.09, what + ", would be told");
        }
        if (c.parameters.empty()) continue;
        const json& event = said.front();
        const auto parameter = event.at("parameter").get<std::string>();
        const auto& may = c.parameters;
        TEST_ASSERT_TRUE_MESSAGE(std::find(may.begin(), may.end(), parameter) != may.end(), (what + run.out).c_str());
        TEST_ASSERT_EQUAL_STRING_MESSAGE("unknown", event.at("fault").get<std::string>().c_str(), what.c_str());
        const double healthy = event.at("healthy").get<double>(), value = event.at("value").get<double>();
        if (parameter.rfind("flux_map", 0) == 0) between(0.99, healthy, 1.01, what + ", healthy");
        between(c.part - 0.02, value / healthy, c.part + 0.02, what + ", of what was healthy");
        between(kBefore_s, event.at("t_s").get<double>(), kBefore_s + 5, what + ", told at");
        between(kBefore_s - 1, event.at("since_s").get<double>(), kBefore_s + 3, what + ", since");
    }
}

void in_health_nothing_is_told() { told({"the same iron", {}, {}, 1}, 11); }

void an_axis_that_bends_otherwise_is_named()
{
    told({"a tenth more bend on d", {1.1, 1, 1}, {"flux_map_d"}, 1.1}, 31);
    told({"a tenth less bend on q", {1, 0.9, 1}, {"flux_map_q"}, 0.9}, 41);
}

/// Its inductance at zero current and its weight have both: the one that is further out of its band is told.
void an_axis_whose_whole_flux_has_changed_is_told_by_either()
{
    told({"a tenth more flux on q", {1, 1, 1.1}, {"Lq_H", "flux_map_q"}, 1.1}, 51);
}

}  // namespace

int main()
{
    UNITY_BEGIN();
    RUN_TEST(in_health_nothing_is_told);
    // What an event runs others run under the sanitizers.
    if (!command::sanitized()) RUN_TEST(an_axis_that_bends_otherwise_is_named);
    if (!command::sanitized()) RUN_TEST(an_axis_whose_whole_flux_has_changed_is_told_by_either);
    return UNITY_END();
}
