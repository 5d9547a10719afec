#include "app/cmd/columns.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "app/base/output.hpp"
#include "app/base/parameters.hpp"
#include "app/base/quantity.hpp"
#include "app/base/text.hpp"
#include "app/job/logs.hpp"
#include "app/format/formats.hpp"
#include "app/read/log_reader.hpp"
#include "app/report/report.hpp"

namespace dqw {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const Survey& s, const std::string& path, const std::vector<std::string>& warnings)
{
    Json out = {{"schema", "dqwatch.columns/1"},
                {"file", path},
                {"format", s.format},
                {"about", s.about},
                {"rows", s.rows_in_file},
                {"rows_kept", s.rows_kept}};
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
    out["warnings"] = warnings;
    return out;
}

std::string text_of(const Survey& s, const std::string& path)
{
    std::string out = fmt::format("{}: {} ({})\n", printable(path), s.format, s.about);
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
    return out;
}

/// LOG of DIR/LOG.csv.gz.
std::string stem_of(const std::string& path)
{
    std::filesystem::path name = std::filesystem::path(path).filename();
    if (name.extension() == ".gz" || name.extension() == ".zst") name = name.stem();
    const std::string stem = name.stem().string();
    return path == "-" || stem.empty() ? "log" : stem;
}

void write_canonical(const Log& log, const Survey& survey, const Options& options)
{
    make_directory(options.out_dir);
    const std::string stem = stem_of(log.path) + "_canonical";
    OutputFile csv(path_in(options.out_dir, stem + ".csv"));
    std::string line;
    std::vector<const std::vector<double>*> kept;
    for (const ColumnInfo& column : columns) {
        if ((log.*(column.values)).empty()) continue;
        kept.push_back(&(log.*(column.values)));
        line += (line.empty() ? "" : ",") + std::string(column.name);
    }
    csv.write(line + "\n");
    for (std::size_t k = 0; k < log.rows(); ++k) {
        line.clear();
        for (const auto* values : kept) line += fmt::format("{}{}", line.empty() ? "" : ",", (*values)[k]);
        csv.write(line + "\n");
    }
    csv.close();
    std::string toml = fmt::format("# {} as dqwatch reads it.\n[machine]\n", survey.about);
    for (const Parameter& p : kParameters)
        if (log.machine.*(p.nominal)) toml += fmt::format("{} = {}\n", p.name, *(log.machine.*(p.nominal)));
    toml += "[log]\n";
    if (!survey.regime.empty()) toml += fmt::format("regime = \"{}\"\n", survey.regime);
    if (!log.modulation.empty()) toml += fmt::format("modulation = \"{}\"\n", log.modulation);
    if (log.observed) toml += "angle = \"observer\"\n";
    if (log.voltage_error_V > 0) toml += fmt::format("voltage_error_V = {}\n", log.voltage_error_V);
    write_file(path_in(options.out_dir, stem + ".toml"), toml);
}

}  // namespace

int columns_command(const Options& options)
{
    std::vector<std::string> notes;
    Survey survey;
    ReadOptions read = read_options(options);
    read.notes = &notes;
    read.survey = &survey;
    const std::string& path = options.logs.front();
    const Log log = read_log(path, read);
    if (options.write) write_canonical(log, survey, options);
    std::vector<std::string> warnings;
    for (const std::string& note : notes)
        if (note.compare(0, 9, "warning: ") == 0) warnings.push_back(note.substr(9));
    print_notes(notes);
    print(options.json ? json_text(json_of(survey, path, warnings)) : text_of(survey, path));
    return exit_done;
}

int formats_command(const Options& options)
{
    if (options.json) {
        Json list = Json::array();
        for (const Format* format : formats()) list.push_back(Json{{"name", format->name}, {"about", format->about}});
        print(json_text(Json{{"schema", "dqwatch.formats/1"}, {"formats", std::move(list)}}));
        return exit_done;
    }
    std::string out;
    for (const Format* format : formats()) out += fmt::format("{:<20}{}\n", format->name, format->about);
    print(out + "\nWhat no file says: --pole-pairs N, --gear N, --v-dc V, --period S, or LOG.toml.\n");
    return exit_done;
}

}  // namespace dqw
