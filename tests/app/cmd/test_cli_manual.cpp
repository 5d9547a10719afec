// Man pages and completions: made of the parser, so each option that help has is in them, and the shells take them.
#include <set>
#include <sstream>
#include <string>

#include "command.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

using command::Folder;
using command::Outcome;

static const std::vector<std::string> shells = {"bash", "zsh", "fish"};

/// The first words of the lines of help's section.
static std::vector<std::string> words_of(const std::string& help, const std::string& section)
{
    std::vector<std::string> words;
    std::istringstream in(help.substr(help.find(section + ":\n") + section.size() + 2));
    for (std::string line; std::getline(in, line) && !line.empty();) {
        std::istringstream row(line);
        std::string word;
        row >> word;
        if (line.compare(0, 2, "  ") == 0 && line[2] != ' ') words.push_back(word);
    }
    return words;
}

static std::vector<std::string> subcommands() { return words_of(command::dqwatch({"--help"}).out, "Subcommands"); }

/// Long options as help names them.
static std::vector<std::string> options_of(std::vector<std::string> args)
{
    args.emplace_back("--help");
    std::vector<std::string> names;
    for (std::string word : words_of(command::dqwatch(args).out, "Options"))
        names.push_back(word.substr(word.find("--")));
    return names;
}

static void each_option_is_in_its_man_page(void)
{
    const Folder folder;
    TEST_ASSERT_EQUAL_INT(0, command::dqwatch({"--manual", folder / "man"}).code);
    TEST_ASSERT_TRUE(subcommands().size() >= 8);
    for (const auto& name : subcommands()) {
        const std::string page = command::read_file(folder / ("man/dqwatch-" + name + ".1"));
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, page.compare(0, 4, ".TH "), name.c_str());
        TEST_ASSERT_TRUE(!options_of({name}).empty());
        for (const auto& option : options_of({name})) {
            std::string escaped;
            for (const char c : option) escaped += c == '-' ? "\\-" : std::string(1, c);
            TEST_ASSERT_TRUE_MESSAGE(page.find("\n\\fB" + escaped + "\\fR") != std::string::npos,
                                     (name + " " + option).c_str());
        }
    }
    TEST_ASSERT_EQUAL_INT(1, command::dqwatch({"--manual", "/dev/null/man"}).code);
}

static void each_option_is_in_each_completion(void)
{
    for (const auto& shell : shells) {
        const Outcome run = command::dqwatch({"--completion", shell});
        TEST_ASSERT_EQUAL_INT(0, run.code);
        std::set<std::string> all = {"--help", "--version"};
        for (const auto& name : subcommands())
            for (const auto& option : options_of({name})) all.insert(option);
        for (const auto& option : all)
            TEST_ASSERT_TRUE_MESSAGE(run.out.find(shell == "fish" ? "-l " + option.substr(2) : option) !=
                                         std::string::npos,
                                     (shell + " " + option).c_str());
        TEST_ASSERT_TRUE_MESSAGE(run.out.find("dead_time") != std::string::npos, shell.c_str());
    }
    TEST_ASSERT_EQUAL_INT(2, command::dqwatch({"--completion", "csh"}).code);
}

/// What `shell` itself says of a script of ours with these lines behind it.
static Outcome run_in(const Folder& folder, const std::string& shell, const std::string& behind)
{
    const std::string script = folder.write("script",
                                            command::dqwatch({"--completion", shell}).out + "\n" + behind + "\n");
    return command::run_program({shell, script});
}

static void bash_completes(void)
{
    const Folder folder;
    const std::string complete =
        "try() { COMP_WORDS=(\"$@\"); COMP_CWORD=$(($# - 1)); _dqwatch; echo \"${COMPREPLY[*]}\"; }\n";
    const Outcome run = run_in(
        folder, "bash",
        complete + "try dqwatch tr\ntry dqwatch fit --eff\ntry dqwatch fit --effect dea\n"
                   "try dqwatch sim servo_i\ntry dqwatch learn --arith ''\ntry dqwatch fit --pole-pairs 1");
    if (run.code == 127) TEST_IGNORE_MESSAGE("no bash here");
    TEST_ASSERT_EQUAL_STRING("trace\n--effect\ndead_time\nservo_ideal\nfloat q15\n\n", run.out.c_str());
    TEST_ASSERT_EQUAL_STRING("", run.err.c_str());
}

static void fish_completes(void)
{
    const Folder folder;
    const Outcome run = run_in(folder, "fish",
                               "complete -C 'dqwatch tr'\ncomplete -C 'dqwatch fit --eff'\n"
                               "complete -C 'dqwatch fit --effect dea'\ncomplete -C 'dqwatch sim servo_i'");
    if (run.code == 127) TEST_IGNORE_MESSAGE("no fish here");
    std::istringstream in(run.out);
    std::string first[4], line;
    for (auto& word : first) {
        std::getline(in, line);
        word = line.substr(0, line.find('\t'));
    }
    TEST_ASSERT_EQUAL_STRING("trace", first[0].c_str());
    TEST_ASSERT_EQUAL_STRING("--effect", first[1].c_str());
    TEST_ASSERT_EQUAL_STRING("dead_time", first[2].c_str());
    TEST_ASSERT_EQUAL_STRING("servo_ideal", first[3].c_str());
    TEST_ASSERT_EQUAL_STRING("", run.err.c_str());
}

/// Its completion runs only at a prompt: a pseudo-terminal of zsh's own types a tab.
static void zsh_completes(void)
{
    const Folder folder;
    folder.write("_dqwatch", command::dqwatch({"--completion", "zsh"}).out);
    const std::string typed = folder.write(
        "type", "zmodload zsh/zpty || exit 127\nzpty z zsh -f -i\n"
                "zpty -w z 'PS1=; dqwatch() { print -r -- \"<$*>\" }; fpath=(" +
                    (folder / "") +
                    " $fpath); autoload -U compinit; compinit -u -D; print RE''ADY'\n"
                    "zpty -r -m z out '*READY*'\n"
                    "zpty -w z $'dqwatch sim servo_i\\t'\nzpty -r -m z out '*<sim *>*'\n"
                    "zpty -w z $'dqwatch fit --effect dea\\t'\nzpty -r -m z more '*<fit *>*'\n"
                    "print -r -- $out$more\n");
    const Outcome run = command::run_program({"zsh", "-f", typed}, {}, 60);
    if (run.code == 127) TEST_IGNORE_MESSAGE("no zsh here");
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
    TEST_ASSERT_TRUE_MESSAGE(run.out.find("<sim servo_ideal>") != std::string::npos, run.out.c_str());
    TEST_ASSERT_TRUE_MESSAGE(run.out.find("<fit --effect dead_time>") != std::string::npos, run.out.c_str());
}

/// One line a part, each with a version.
static void the_version_says_what_it_was_built_with(void)
{
    const Outcome run = command::dqwatch({"--version"});
    TEST_ASSERT_EQUAL_INT(0, run.code);
    const std::string header = command::read_file("lib/dqw_version.h");
    const auto from = header.find("DQW_VERSION \"") + 13;
    const std::string version = header.substr(from, header.find('"', from) - from);
    TEST_ASSERT_EQUAL_INT(0, run.out.compare(0, 9 + version.size(), "dqwatch " + version + "\n"));
    for (const char* part : {"compiler", "SUNDIALS", "Ceres", "Eigen", "CLI11", "nlohmann-json", "toml++", "fmt",
                             "zlib", "zstd", "lib/"}) {
        const auto at = run.out.find(std::string("\n  ") + part + " ");
        TEST_ASSERT_TRUE_MESSAGE(at != std::string::npos, part);
        const std::string line = run.out.substr(at + 1, run.out.find('\n', at + 1) - at - 1);
        TEST_ASSERT_TRUE_MESSAGE(line.find_first_of("0123456789") != std::string::npos, line.c_str());
    }
}

int main()
{
    UNITY_BEGIN();
    RUN_TEST(each_option_is_in_its_man_page);
    RUN_TEST(each_option_is_in_each_completion);
    RUN_TEST(bash_completes);
    RUN_TEST(fish_completes);
    RUN_TEST(zsh_completes);
    RUN_TEST(the_version_says_what_it_was_built_with);
    return UNITY_END();
}
