// Measured logs of DATA, where there are any: every one is fitted and learned, and only a speed in rpm is warned of.
// Plain only: long, and what it runs others run under the sanitizers.
#include <nlohmann/json.hpp>
#include <string>

#include "command.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

namespace fs = std::filesystem;
using command::Outcome;

static std::vector<fs::path> logs()
{
    std::vector<fs::path> found;
    std::error_code error;
    for (const auto& file : fs::directory_iterator(command::environment("DATA", "../shared/data"), error)) {
        std::string header;
        std::getline(std::ifstream(file.path()), header);
        if (file.path().extension() == ".csv" && header.find("psi_d_Wb") == header.npos) found.push_back(file.path());
    }
    return found;
}

static const char* const absent = "no measured logs: set DATA";

static void every_log_is_fitted_and_learned(void)
{
    if (logs().empty()) TEST_IGNORE_MESSAGE(absent);
    for (const auto& log : logs())
        for (const char* reader : {"fit", "learn"}) {
            const Outcome run = command::dqwatch({reader, log.string(), "--json"});
            TEST_ASSERT_TRUE_MESSAGE(run.code == 0 || run.code == 4,
                                     (log.filename().string() + ": " + run.err).c_str());
            const auto json = nlohmann::json::parse(run.out);
            TEST_ASSERT_EQUAL_INT_MESSAGE(run.code == 4, !json.at("not_identifiable").empty(), log.filename().c_str());
            TEST_ASSERT_TRUE_MESSAGE(run.err.find("rpm") == std::string::npos, run.err.c_str());
        }
}

/// A machine file that scales the speed to rpm, beside what is known already.
static void rpm_is_warned_of_wherever_it_turns(void)
{
    if (logs().empty()) TEST_IGNORE_MESSAGE(absent);
    const command::Folder folder;
    for (const auto& log : logs()) {
        fs::path toml = log;
        toml.replace_extension(".toml");
        const std::string text = command::read_file(toml.string());
        if (text.find("\"standstill\"") != text.npos || text.find("[columns]") != text.npos) continue;
        folder.write("rpm.toml", text + "\n[columns]\nw_m_rad_s = { from = \"w_m_rad_s\", scale = 9.5492966 }\n");
        const Outcome run = command::dqwatch({"learn", log.string(), "--machine", folder / "rpm.toml"});
        TEST_ASSERT_TRUE_MESSAGE(run.err.find("look like rpm") != run.err.npos, log.filename().c_str());
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(every_log_is_fitted_and_learned);
    RUN_TEST(rpm_is_warned_of_wherever_it_turns);
    return UNITY_END();
}
