#include "app/cmd/pages.hpp"

#include <CLI/CLI.hpp>

namespace dqw {
namespace {

/// "a", "b" of "NAME:{a,b}"; none where there is no list.
std::vector<std::string> choices_in(const std::string& type)
{
    const auto open = type.find('{'), close = type.rfind('}');
    if (open == std::string::npos || close == std::string::npos) return {};
    return CLI::detail::split(type.substr(open + 1, close - open - 1), ',');
}

bool ends_with(const std::string& text, const std::string& end)
{
    return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

Word word_of(const CLI::Option& option, const std::map<std::string, std::vector<std::string>>& known)
{
    Word w;
    w.name = option.get_name(option.get_positional());
    w.about = option.get_description();
    w.required = option.get_required();
    w.repeats = option.get_expected_max() > 1;
    if (option.get_type_size() == 0 || option.get_expected_max() == 0) return w;
    const std::string type = option.get_type_name();
    const auto mark = type.find(':');
    w.value = option.get_positional() ? w.name : type.substr(0, mark);
    w.choices = choices_in(type);
    if (const auto found = known.find(w.name); found != known.end()) w.choices = found->second;
    using T = Word::Takes;
    const bool file = w.value == "FILE" || ends_with(w.value, ".csv") || ends_with(w.value, ".json");
    w.takes = !w.choices.empty() ? T::choice : w.value == "DIR" ? T::folder : file ? T::file : T::text;
    // A type without a name of its own is its list alone.
    if (w.value.empty() || w.value.front() == '{') w.value = "VALUE";
    return w;
}

Page page_of(const CLI::App& app, const std::map<std::string, std::vector<std::string>>& known, bool is_command)
{
    Page page;
    page.name = is_command ? "" : app.get_name();
    page.about = app.get_description();
    page.footer = app.get_footer();
    for (const CLI::Option* option : app.get_options())
        (option->get_positional() ? page.positionals : page.options).push_back(word_of(*option, known));
    // -h,--help: the long name completes.
    for (Word& w : page.options)
        if (const auto comma = w.name.find(','); comma != std::string::npos) w.name = w.name.substr(comma + 1);
    return page;
}

}  // namespace

std::vector<Page> pages_of(const CLI::App& app, const std::map<std::string, std::vector<std::string>>& known)
{
    std::vector<Page> pages = {page_of(app, known, true)};
    for (const CLI::App* command : app.get_subcommands({})) pages.push_back(page_of(*command, known, false));
    return pages;
}

std::string brief(const std::string& about)
{
    return about.substr(0, std::min({about.find("; "), about.find(": "), about.find(", "), about.find(" (")}));
}

}  // namespace dqw
