// Ten million rows in under 2 GB. Under the sanitizers, whose memory is not the program's, a hundred thousand.
// Plain only: long, and what it runs others run under the sanitizers.
#include <nlohmann/json.hpp>
#include <string>

#include "command.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

static const std::size_t rows = 10000000;

static nlohmann::json run(const char* reader, const std::string& path)
{
    const auto outcome = command::dqwatch({reader, path, "--json"}, {}, 300);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, outcome.code, outcome.err.c_str());
    std::printf("%s: %zu rows, %.1f s, peak %.0f MiB\n", reader, rows, outcome.seconds, outcome.peak_MiB);
    TEST_ASSERT_TRUE_MESSAGE(outcome.peak_MiB < 2000, "2 GB");
    const auto json = nlohmann::json::parse(outcome.out);
    TEST_ASSERT_EQUAL_UINT64(rows, json.at("rows").get<std::uint64_t>());
    return json;
}

static double value(const nlohmann::json& result, const char* name)
{
    return result.at("parameters").at(name).at("value").get<double>();
}

static void learn_and_fit_take_ten_million_rows(void)
{
    const command::Folder folder;
    const command::Machine machine;
    const std::string path = folder / "log.csv";
    command::write_log(path, rows, machine);
    folder.write("log.toml", "[machine]\npole_pairs = 4\n");
    TEST_ASSERT_DOUBLE_WITHIN(0.01 * machine.psi_Wb, machine.psi_Wb, value(run("learn", path), "psi_Wb"));
    // As settled points: what is tested is the reader and the memory, and a dynamic fit of so many rows takes over a
    // minute.
    folder.write("log.toml", "[machine]\npole_pairs = 4\n[log]\nregime = \"steady\"\n");
    TEST_ASSERT_DOUBLE_WITHIN(0.05 * machine.psi_Wb, machine.psi_Wb, value(run("fit", path), "psi_Wb"));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(learn_and_fit_take_ten_million_rows);
    return UNITY_END();
}
