// What README.md promises: its first two commands exist, and its C example compiles against lib/ as a stranger would
// build it.
#include <algorithm>
#include <filesystem>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "command.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

/// The lines of `text`.
static std::vector<std::string> lines_of(const std::string& text)
{
    std::vector<std::string> lines;
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
}

/// The first fenced block of README.md in `language`; empty where there is none. README.md is looked for where the
/// tests run.
static std::string first_block(const std::string& language)
{
    std::string block;
    bool inside = false;
    for (const std::string& line : lines_of(command::read_file("README.md"))) {
        if (inside && line == "```") return block;
        if (inside) block += line + "\n";
        if (line == "```" + language) inside = true;
    }
    return "";
}

/// Commands of a block, without comments and empty lines.
static std::vector<std::string> commands_of(const std::string& block)
{
    std::vector<std::string> commands;
    for (const std::string& line : lines_of(block)) {
        const std::string command = std::regex_replace(line, std::regex("^\\s+|\\s*(#.*)?$"), "");
        if (!command.empty()) commands.push_back(command);
    }
    return commands;
}

static void two_commands_come_first(void)
{
    const std::vector<std::string> commands = commands_of(first_block("sh"));
    TEST_ASSERT_TRUE_MESSAGE(commands.size() >= 2, "README.md has no ```sh block of two commands");
    TEST_ASSERT_EQUAL_STRING("make demo", commands[0].c_str());
    TEST_ASSERT_EQUAL_STRING("make test", commands[1].c_str());
    const std::vector<std::string> makefile = lines_of(command::read_file("Makefile"));
    for (const char* rule : {"demo:", "test:"}) {
        const bool there = std::any_of(makefile.begin(), makefile.end(),
                                       [&](const std::string& line) { return line.rfind(rule, 0) == 0; });
        TEST_ASSERT_TRUE_MESSAGE(there, (std::string("Makefile has no target ") + rule).c_str());
    }
}

static void the_example_compiles(void)
{
    const std::string example = first_block("c");
    TEST_ASSERT_FALSE_MESSAGE(example.empty(), "README.md has no ```c block");
    const bool program = std::regex_search(example, std::regex("\\bmain\\s*\\("));

    const command::Folder folder;
    const std::string source = folder.write("example.c", example), result = folder / "example";
    std::vector<std::string> argv;
    std::istringstream compiler(command::environment("CC", "cc"));
    for (std::string word; compiler >> word;) argv.push_back(word);
    for (const char* flag : {"-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-Ilib"}) argv.push_back(flag);
    if (program) {
        argv.push_back(source);
        std::vector<std::string> library;
        for (const auto& entry : std::filesystem::directory_iterator("lib"))
            if (entry.path().extension() == ".c") library.push_back(entry.path().string());
        std::sort(library.begin(), library.end());
        TEST_ASSERT_FALSE_MESSAGE(library.empty(), "lib/ holds no C file");
        argv.insert(argv.end(), library.begin(), library.end());
        argv.insert(argv.end(), {"-lm", "-o", result});
    } else {
        argv.insert(argv.end(), {"-c", source, "-o", result});
    }
    const command::Outcome built = command::run_program(argv);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, built.code, built.err.c_str());
    if (!program) return;
    const command::Outcome run = command::run_program({result});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, (run.out + run.err).c_str());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(two_commands_come_first);
    RUN_TEST(the_example_compiles);
    return UNITY_END();
}
