#include "app/cmd/completion.hpp"

#include <fmt/format.h>

namespace dqw {
namespace {

using Takes = Word::Takes;

std::string joined(const std::vector<std::string>& words)
{
    std::string text;
    for (const auto& w : words) text += (text.empty() ? "" : " ") + w;
    return text;
}

/// In single quotes, for all three shells.
std::string quoted(const std::string& text, const char* apostrophe)
{
    std::string to = "'";
    for (const char c : text) to += c == '\'' ? std::string(apostrophe) : std::string(1, c);
    return to + "'";
}

std::string names_of(const std::vector<Word>& words)
{
    std::vector<std::string> names;
    for (const Word& w : words) names.push_back(w.name);
    return joined(names);
}

std::string subcommands(const std::vector<Page>& pages)
{
    std::vector<std::string> names;
    for (const Page& p : pages)
        if (!p.name.empty()) names.push_back(p.name);
    return joined(names);
}

/// What completes the value, for bash's compgen; "" where nothing does.
std::string bash_action(const Word& w)
{
    switch (w.takes) {
    case Takes::choice: return "-W '" + joined(w.choices) + "'";
    case Takes::file: return "-f";
    case Takes::folder: return "-d";
    default: return "";
    }
}

std::string bash(const std::vector<Page>& pages)
{
    std::string text = "# dqwatch --completion bash\n"
                       "_dqwatch()\n{\n"
                       "    local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD-1]} sub=${COMP_WORDS[1]}\n"
                       "    local -a action=()\n"
                       "    [ \"$COMP_CWORD\" = 1 ] && sub=\n"
                       "    case $sub:$prev in\n";
    for (const Page& p : pages)
        for (const Word& w : p.options) {
            if (w.takes == Takes::nothing) continue;
            const std::string action = bash_action(w);
            text += fmt::format("    {}:{}) {}\n        return ;;\n", p.name.empty() ? "*" : p.name, w.name,
                                action.empty() ? "COMPREPLY=()"
                                               : "mapfile -t COMPREPLY < <(compgen " + action + " -- \"$cur\")");
        }
    text += "    esac\n    case $sub:$cur in\n";
    for (const Page& p : pages) {
        text += fmt::format("    {}:-*) action=(-W '{}') ;;\n", p.name, names_of(p.options));
        if (p.name.empty())
            text += fmt::format("    :*) action=(-W '{}') ;;\n", subcommands(pages));
        else if (!p.positionals.empty() && !bash_action(p.positionals.front()).empty())
            text += fmt::format("    {}:*) action=({}) ;;\n", p.name, bash_action(p.positionals.front()));
    }
    return text + "    esac\n"
                  "    COMPREPLY=()\n"
                  "    [ ${#action[@]} = 0 ] || mapfile -t COMPREPLY < <(compgen \"${action[@]}\" -- \"$cur\")\n"
                  "}\n"
                  "complete -o filenames -F _dqwatch dqwatch\n";
}

std::string zsh_quoted(const std::string& text) { return quoted(text, "'\\''"); }

/// "[about]" within a specification of _arguments, where colons and brackets part.
std::string zsh_about(const std::string& about)
{
    std::string text;
    for (const char c : brief(about))
        text += c == ':' || c == '[' || c == ']' ? std::string("\\") + c : std::string(1, c);
    return text;
}

std::string zsh_action(const Word& w)
{
    switch (w.takes) {
    case Takes::choice: return "(" + joined(w.choices) + ")";
    case Takes::file: return "_files";
    case Takes::folder: return "_files -/";
    default: return " ";
    }
}

std::string zsh(const std::vector<Page>& pages)
{
    const auto options = [](const Page& p, const char* indent) {
        std::string text;
        for (const Word& w : p.options) {
            const std::string value = w.takes == Takes::nothing ? "" : ":" + w.value + ":" + zsh_action(w);
            text += fmt::format(" \\\n{}{}", indent,
                                zsh_quoted((w.repeats ? "*" : "") + w.name + "[" + zsh_about(w.about) + "]" + value));
        }
        return text;
    };
    std::string text = "#compdef dqwatch\n# dqwatch --completion zsh\n"
                       "local context state state_descr line\n"
                       "typeset -A opt_args\n"
                       "local -a commands\n"
                       "commands=(\n";
    for (const Page& p : pages)
        if (!p.name.empty()) text += "    " + zsh_quoted(p.name + ":" + zsh_about(p.about)) + "\n";
    text += ")\n_arguments -C" + options(pages.front(), "    ") +
            " \\\n    '1:subcommand:->command' '*::argument:->rest'\n"
            "case $state in\n"
            "command) _describe -t commands subcommand commands ;;\n"
            "rest)\n    case $words[1] in\n";
    for (const Page& p : pages) {
        if (p.name.empty()) continue;
        text += fmt::format("    {}) _arguments{}", p.name, options(p, "        "));
        for (const Word& w : p.positionals)
            text += " \\\n        " + zsh_quoted((w.repeats ? "*:" : "1:") + w.name + ":" + zsh_action(w));
        text += " ;;\n";
    }
    return text + "    esac ;;\nesac\n";
}

std::string fish(const std::vector<Page>& pages)
{
    const auto fish_quoted = [](const std::string& s) { return quoted(s, "\\'"); };
    const auto value = [&](const Word& w) -> std::string {
        switch (w.takes) {
        case Takes::nothing: return "";
        case Takes::choice: return " -x -a " + fish_quoted(joined(w.choices));
        case Takes::file: return " -r -F";
        case Takes::folder: return " -x -a '(__fish_complete_directories)'";
        default: return " -x";
        }
    };
    std::string text = "# dqwatch --completion fish\ncomplete -c dqwatch -f\n";
    for (const Page& p : pages) {
        if (!p.name.empty())
            text += fmt::format("complete -c dqwatch -n __fish_use_subcommand -a {} -d {}\n", p.name,
                                fish_quoted(brief(p.about)));
        const std::string when = p.name.empty() ? "__fish_use_subcommand"
                                                : fish_quoted("__fish_seen_subcommand_from " + p.name);
        for (const Word& w : p.options)
            text += fmt::format("complete -c dqwatch -n {} -l {}{} -d {}\n", when, w.name.substr(2), value(w),
                                fish_quoted(brief(w.about)));
        for (const Word& w : p.positionals) {
            const std::string of = w.takes == Takes::choice ? value(w) : w.takes == Takes::file ? " -F" : "";
            if (!of.empty()) text += fmt::format("complete -c dqwatch -n {}{}\n", when, of);
        }
    }
    return text;
}

}  // namespace

const std::vector<std::string>& completed_shells()
{
    static const std::vector<std::string> shells = {"bash", "zsh", "fish"};
    return shells;
}

std::string completion_for(const std::string& shell, const std::vector<Page>& pages)
{
    return shell == "bash" ? bash(pages) : shell == "zsh" ? zsh(pages) : fish(pages);
}

}  // namespace dqw
