// The fixed-point port on five cores under QEMU: the same trajectories to the last bit everywhere, and costs as
// docs/cost.md says.
// Plain only: runs other programs.
#include <cmath>
#include <cstdlib>
#include <sstream>
#include <string>
#include <vector>

#include "command.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

static void the_counters_are_exact(void)
{
    const command::Folder folder;
    std::string skipped;
    for (const char* core : {"m0", "m3", "m4f", "m33", "rv32"}) {
        const command::Outcome run = command::run_program(
            {"tests/target/run_on.sh", core, folder / "selftest.elf", "tests/target/bare_selftest.c"}, {}, 100);
        if (run.code == 77)
            skipped += std::string(core) + " " + run.out;
        else
            TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, (core + (": " + run.out + run.err)).c_str());
    }
    if (!skipped.empty()) TEST_IGNORE_MESSAGE(skipped.c_str());
}

static void every_core_and_compiler_gives_the_same_bits(void)
{
    const command::Outcome run = command::run_program({"tests/target/target.sh"}, {}, 900);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, (run.out + run.err + "tests/target/target.sh").c_str());
    std::string skipped;
    std::istringstream in(run.out);
    for (std::string line; std::getline(in, line);)
        if (line.find("skipped:") != std::string::npos) skipped += line + "; ";
    if (!skipped.empty()) TEST_IGNORE_MESSAGE(skipped.c_str());
}

/// A line without its numbers, and these.
struct Cells {
    std::string text;
    std::vector<double> numbers;
    explicit Cells(const std::string& line)
    {
        for (const char* at = line.c_str(); *at != 0;) {
            char* end = nullptr;
            if (*at < '0' || *at > '9') {
                text += *at++;
                continue;
            }
            numbers.push_back(std::strtod(at, &end));
            text += '#';
            at = end;
        }
    }
};

static std::vector<std::string> lines_of(const std::string& text)
{
    std::vector<std::string> lines;
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
}

/// Two-sided: an improvement refreshes the table with `make numbers`.
static void compare(const std::string& measured, const std::string& told)
{
    const Cells now(measured);
    const Cells then(told);
    const std::string both = "measured: " + measured + "\ndocs/cost.md: " + told + "\nmake numbers";
    TEST_ASSERT_EQUAL_STRING_MESSAGE(then.text.c_str(), now.text.c_str(), both.c_str());
    TEST_ASSERT_EQUAL_INT_MESSAGE(then.numbers.size(), now.numbers.size(), both.c_str());
    for (std::size_t i = 0; i < now.numbers.size(); i++)
        TEST_ASSERT_TRUE_MESSAGE(std::fabs(now.numbers[i] - then.numbers[i]) <= std::fmax(0.05 * then.numbers[i], 2.0),
                                 both.c_str());
}

static void the_costs_are_those_of_the_page(void)
{
    const std::string page = command::read_file("docs/cost.md");
    const std::size_t begin = page.find("<!-- numbers -->\n");
    const std::size_t end = page.find("<!-- /numbers -->");
    TEST_ASSERT_TRUE_MESSAGE(begin < end && end != std::string::npos, "docs/cost.md has no table of numbers");
    const std::vector<std::string> told = lines_of(page.substr(begin + 17, end - begin - 17));

    const command::Outcome run = command::run_program({"tests/target/numbers.sh"}, {}, 900);
    if (run.code == 77) TEST_IGNORE_MESSAGE(("numbers under QEMU: " + run.out).c_str());
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, (run.out + run.err).c_str());
    const std::vector<std::string> measured = lines_of(run.out);
    TEST_ASSERT_TRUE_MESSAGE(measured.size() > 4, run.out.c_str());
    TEST_ASSERT_EQUAL_INT_MESSAGE(told.size(), measured.size(), "docs/cost.md's table has other rows: make numbers");
    for (std::size_t i = 0; i < told.size(); i++) {
        // Another compiler counts otherwise, another llvm-mca estimates otherwise: their lines name their versions.
        if (told[i].find("-gcc ") != std::string::npos && told[i] != measured[i])
            TEST_IGNORE_MESSAGE(("other compilers: " + measured[i]).c_str());
    }
    for (std::size_t i = 0; i < told.size(); i++) {
        const bool estimate = told[i].find("llvm-mca") != std::string::npos;
        if (estimate && told[i].substr(0, told[i].find(':')) != measured[i].substr(0, measured[i].find(':'))) continue;
        compare(measured[i], told[i]);
    }
    TEST_ASSERT_TRUE_MESSAGE(run.out.find(", over ") == std::string::npos,
                             ("something is over its limit:\n" + run.out).c_str());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_counters_are_exact);
    RUN_TEST(every_core_and_compiler_gives_the_same_bits);
    RUN_TEST(the_costs_are_those_of_the_page);
    return UNITY_END();
}
