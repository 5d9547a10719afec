#include "app/cmd/manual.hpp"

#include "app/base/output.hpp"
#include "dqw_version.h"

namespace dqw {
namespace {

/// As man prints it: a hyphen that can be copied, no line that is taken for a macro.
std::string escaped(const std::string& text)
{
    std::string to;
    for (const char c : text) {
        const bool begins = to.empty() || to.back() == '\n';
        if (c == '\\')
            to += "\\e";
        else if (c == '-')
            to += "\\-";
        else if (begins && (c == '.' || c == '\''))
            to += std::string("\\&") + c;
        else if (c == '\n')
            to += "\n.br\n";
        else
            to += c;
    }
    return to;
}

std::string full_name(const Page& page) { return page.name.empty() ? "dqwatch" : "dqwatch-" + page.name; }

std::string upper(std::string text)
{
    for (char& c : text)
        if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
    return text;
}

std::string synopsis(const Page& page)
{
    std::string text = "\n.SH SYNOPSIS\n.B dqwatch" + (page.name.empty() ? "" : " " + escaped(page.name)) + "\n";
    text += page.name.empty() ? "[\\fIoptions\\fR] \\fIsubcommand\\fR ..." : "[\\fIoptions\\fR]";
    for (const Word& w : page.positionals) {
        const std::string name = "\\fI" + escaped(w.name) + "\\fR" + (w.repeats ? " ..." : "");
        text += w.required ? " " + name : " [" + name + "]";
    }
    return text + "\n";
}

std::string described(const Word& w)
{
    const bool option = w.name.front() == '-';
    std::string text = ".TP\n\\fB" + escaped(w.name) + "\\fR";
    if (option && w.takes != Word::Takes::nothing) text += " \\fI" + escaped(w.value) + "\\fR";
    return text + "\n" + escaped(w.about) + "\n";
}

std::string section(const char* title, const std::vector<Word>& words)
{
    if (words.empty()) return "";
    std::string text = std::string(".SH ") + title + "\n";
    for (const Word& w : words) text += described(w);
    return text;
}

}  // namespace

std::string man_page(const Page& page, const std::vector<Page>& all)
{
    const bool command = page.name.empty();
    const std::string name = full_name(page);
    std::string text = ".TH " + escaped(upper(name)) + " 1 \"\" \"dqwatch " DQW_VERSION "\" \"dqwatch\"\n.SH NAME\n" +
                       escaped(name) + " \\- " + escaped(command ? "parameters and faults of a motor" : page.about) +
                       synopsis(page);
    if (command) text += ".SH DESCRIPTION\n" + escaped(page.about) + "\n";
    text += section("ARGUMENTS", page.positionals) + section("OPTIONS", page.options);
    if (command) {
        text += ".SH SUBCOMMANDS\n";
        for (const Page& p : all)
            if (!p.name.empty()) text += ".TP\n.BR " + escaped(full_name(p)) + " (1)\n" + escaped(p.about) + "\n";
    }
    if (!page.footer.empty()) text += ".SH NOTES\n" + escaped(page.footer) + "\n";
    if (!command) text += ".SH SEE ALSO\n.BR dqwatch (1)\n";
    return text;
}

void write_manual(const std::vector<Page>& all, const std::string& dir)
{
    make_directory(dir);
    for (const Page& page : all) write_file(path_in(dir, full_name(page) + ".1"), man_page(page, all));
}

}  // namespace dqw
