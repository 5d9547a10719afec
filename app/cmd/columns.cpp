#include "app/cmd/columns.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "app/base/output.hpp"
#include "app/base/parameters.hpp"
#include "app/format/formats.hpp"
#include "app/job/columns.hpp"
#include "app/read/machine_file.hpp"
#include "app/report/report.hpp"

namespace dqw {
namespace {

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
    if (log.voltage_scale != MachineFile{}.voltage_scale)
        toml += fmt::format("voltage_scale = {}\n", log.voltage_scale);
    write_file(path_in(options.out_dir, stem + ".toml"), toml);
    complain(fmt::format("note: wrote {0}.csv and {0}.toml", path_in(options.out_dir, stem)));
}

}  // namespace

int columns_command(const Options& options)
{
    const Surveyed surveyed = survey_log(options);
    if (options.write) write_canonical(surveyed.log, surveyed.survey, options);
    print_notes(surveyed.notes);
    print(options.json ? survey_json(surveyed) : survey_text(surveyed));
    return exit_done;
}

int formats_command(const Options& options)
{
    using Json = nlohmann::ordered_json;
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
