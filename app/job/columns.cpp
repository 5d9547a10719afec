#include "app/job/columns.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "app/base/progress.hpp"
#include "app/base/quantity.hpp"
#include "app/base/text.hpp"
#include "app/job/logs.hpp"
#include "app/read/log_reader.hpp"
#include "app/report/report.hpp"

namespace dqw {
namespace {

using Json = nlohmann::ordered_json;

}  // namespace

Surveyed survey_log(const Options& options)
{
    Surveyed out;
    out.path = options.logs.front();
    Progress progress("reading", options.progress);
    ReadOptions read = read_options(options);
    read.table = table_of(options, out.path);
    read.notes = &out.notes;
    read.survey = &out.survey;
    read.progress = progress.callback();
    out.log = read_log(out.path, read);
    return out;
}

std::string survey_json(const Surveyed& surveyed)
{
    const Survey& s = surveyed.survey;
    Json out = {{"schema", "dqwatch.columns/1"}, {"file", surveyed.path},   {"format", s.format}, {"about", s.about},
                {"rows", s.rows_in_file},        {"rows_kept", s.rows_kept}};
    Json list = Json::array();
    for (const Survey::Column& c : s.columns) {
        Json column = {{"name", c.name}, {"from", c.from}, {"rule", c.rule}};
        if (!c.unit.empty()) column["unit"] = c.unit;
        if (c.factor) column["factor"] = *c.factor;
        if (c.kept) column["first"] = c.first, column["least"] = c.least, column["largest"] = c.largest;
        if (!c.needs.empty()) column["needs"] = c.needs;
        list.push_back(std::move(column));
    }
    out["columns"] = std::move(list);
    if (!s.voltage.empty()) out["voltage"] = s.voltage;
    Json dropped = Json::array();
    for (const LeftOut& reason : s.left_out)
        dropped.push_back(Json{{"rows", reason.rows}, {"first_line", reason.first_line}, {"why", reason.why}});
    out["dropped"] = std::move(dropped);
    out["unused"] = s.unused;
    out["regime"] = s.regime.empty() ? Json(nullptr) : Json(s.regime);
    out["regime_why"] = s.regime_why;
    out["missing"] = s.missing;
    if (!s.proposed.empty()) {
        Json proposed = Json::array();
        for (const ProposedColumn& p : s.proposed) {
            proposed.push_back(Json{{"name", p.name}, {"toml", p.toml}, {"unit_guessed", !p.doubt.empty()}});
            if (!p.needs.empty()) proposed.back()["needs"] = p.needs;
        }
        out["proposed"] = std::move(proposed);
    }
    std::vector<std::string> warnings;
    for (const std::string& note : surveyed.notes)
        if (note.compare(0, 9, "warning: ") == 0) warnings.push_back(note.substr(9));
    out["warnings"] = warnings;
    return json_text(out);
}

std::string survey_text(const Surveyed& surveyed)
{
    const Survey& s = surveyed.survey;
    std::string out = fmt::format("{}: {} ({})\n", printable(surveyed.path), s.format, s.about);
    out += fmt::format("{}, {} kept\n\n", counted(s.rows_in_file, "row"), s.rows_kept);
    std::vector<std::vector<std::string>> rows = {{"column", "first", "least", "largest"}};
    for (const Survey::Column& c : s.columns)
        if (c.kept)
            rows.push_back({c.name, fmt::format("{:.6g}", c.first), fmt::format("{:.6g}", c.least),
                            fmt::format("{:.6g}", c.largest)});
    if (rows.size() > 1) out += table(rows) + "\n";
    for (const Survey::Column& c : s.columns) {
        out += fmt::format("{} = {}", c.name, c.rule);
        if (!c.unit.empty()) out += fmt::format("  [{}]", c.unit);
        if (!c.needs.empty())
            out += fmt::format("  needs {}", list(c.needs));
        else if (!c.kept)
            out += "  left out";
        out += "\n";
    }
    if (!s.voltage.empty()) out += "voltage: " + s.voltage + "\n";
    for (const LeftOut& reason : s.left_out)
        out += fmt::format("dropped: {}, the first at line {}: {}\n", counted(reason.rows, "row"), reason.first_line,
                           reason.why);
    if (!s.unused.empty()) out += "not used: " + list(s.unused, 100) + "\n";
    out += s.regime.empty() ? fmt::format("regime: none yet, {}\n", s.regime_why)
                            : fmt::format("regime: {}, {}\n", s.regime, s.regime_why);
    for (const std::string& what : s.missing) out += "missing: " + what + "\n";
    if (!s.proposed.empty()) out += "\nproposed by their names, to check and put into the machine file:\n[columns]\n";
    for (const ProposedColumn& p : s.proposed) {
        const std::string needs = p.needs.empty() ? "" : "needs " + p.needs;
        const std::string remark = p.doubt + (p.doubt.empty() || needs.empty() ? "" : "; ") + needs;
        out += fmt::format("{} = {}{}\n", p.name, p.toml, remark.empty() ? "" : "  # " + remark);
    }
    return out;
}

}  // namespace dqw
