// The firmware example on a Cortex-M4F under QEMU: the same events as on the host to the last bit, within the budget,
// and as docs/firmware.md says.
// Plain only: runs other programs.
#include <cstdlib>
#include <map>
#include <sstream>
#include <string>

#include "command.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

/// `name value` lines.
static std::map<std::string, long> values_of(const std::string& text)
{
    std::map<std::string, long> values;
    std::istringstream in(text);
    std::string name;
    for (long value; in >> name >> value;) values[name] = value;
    return values;
}

/// The first number of the table's row that begins so; -1 where there is none.
static long documented(const std::string& page, const std::string& row)
{
    const std::size_t at = page.find("| " + row);
    if (at == std::string::npos) return -1;
    const std::size_t bar = page.find(" | ", at + 2);
    return bar == std::string::npos ? -1 : std::strtol(page.c_str() + bar + 3, nullptr, 10);
}

static void check(const std::map<std::string, long>& measured, const std::string& page, bool same_compiler,
                  const char* name, const char* row, long limit)
{
    const auto found = measured.find(name);
    TEST_ASSERT_TRUE_MESSAGE(found != measured.end(), name);
    const std::string line = std::string(name) + " " + std::to_string(found->second) + "; tests/target/firmware.sh";
    if (limit > 0) TEST_ASSERT_TRUE_MESSAGE(found->second <= limit, line.c_str());
    // Another compiler counts otherwise. Two-sided: an improvement refreshes the page with `make firmware`.
    if (!same_compiler) return;
    const double ratio = static_cast<double>(found->second) / static_cast<double>(documented(page, row));
    TEST_ASSERT_TRUE_MESSAGE(ratio > 0.97 && ratio < 1.03,
                             (line + ", docs/firmware.md says " + std::to_string(documented(page, row))).c_str());
}

static void the_monitor_keeps_its_budget(void)
{
    const command::Outcome run = command::run_program({"tests/target/firmware.sh"}, {}, 300);
    if (run.code == 77) TEST_IGNORE_MESSAGE(("firmware under QEMU: " + run.out).c_str());
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, (run.out + run.err).c_str());
    const auto measured = values_of(run.out);
    const std::string page = command::read_file("docs/firmware.md");
    const command::Outcome compiler = command::run_program({"arm-none-eabi-gcc", "-dumpversion"});
    const bool same = page.find("gcc " + compiler.out.substr(0, compiler.out.find('\n')) + ",") != std::string::npos;
    check(measured, page, same, "plain_worst", "the paper's plain neurons", 120);
    check(measured, page, same, "step_worst", "interrupt, `dqw_monitor_sample`: worst", 900);
    check(measured, page, same, "step_stack", "the same, stack", 256);
    check(measured, page, same, "background_mean", "background, `dqw_monitor_background`, a block: mean", 0);
    check(measured, page, same, "start_stack", "start, `dqw_monitor_init`", 0);
    check(measured, page, same, "state_bytes", "state of a motor", 1624);
    check(measured, page, same, "flash_bytes", "flash of lib/: `init`", 28500);
    check(measured, page, same, "flash_lent_bytes", "the same with stage 2's Random Learner", 0);
    check(measured, page, same, "flash_stored_bytes", "the same with `store`", 0);
    check(measured, page, same, "flash_example_bytes", "all that `examples/foc_monitor.c` calls", 0);
    TEST_ASSERT_EQUAL_INT_MESSAGE(1, measured.at("host_equal"), "target and host differ: tests/target/firmware.sh");
    // The second one after a power cycle, against what was stored before the fault.
    TEST_ASSERT_EQUAL_INT(2, measured.at("events"));
    TEST_ASSERT_EQUAL_INT_MESSAGE(1, measured.at("circle_equal"),
                                  "target and host differ after a way back: tests/target/firmware.sh");
    TEST_ASSERT_EQUAL_INT(1, measured.at("circles"));
}

static void the_counter_is_exact(void)
{
    const command::Folder folder;
    const command::Outcome run = command::run_program(
        {"tests/target/run.sh", folder / "selftest.elf", "tests/target/selftest.c"}, {}, 100);
    if (run.code == 77) TEST_IGNORE_MESSAGE(("counter under QEMU: " + run.out).c_str());
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, (run.out + run.err).c_str());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_counter_is_exact);
    RUN_TEST(the_monitor_keeps_its_budget);
    return UNITY_END();
}
