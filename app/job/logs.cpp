#include "app/job/logs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <numeric>

#include "app/base/columns.hpp"
#include "app/base/parameters.hpp"
#include "app/base/progress.hpp"
#include "app/base/text.hpp"
#include "app/read/join.hpp"
#include "ref/fit/polled_logs.hpp"
#include "ref/log/speed_lag.hpp"
#include "ref/model/open_circuit.hpp"

namespace dqw {
namespace {

/// What says which machine it is must agree; nominal values are starting points and may differ.
void check_same_machine(const Log& first, const Log& log)
{
    const auto differ = [&](const char* what, const std::optional<double>& a, const std::optional<double>& b) {
        if (a && b && *a != *b)
            throw InputError(
                log.path, 1,
                fmt::format("{} is {:g}, but {:g} for {}; expected logs of one machine", what, *b, *a, first.path));
    };
    differ("pole_pairs", first.machine.pole_pairs, log.machine.pole_pairs);
    differ("torque_constant_Nm_A", first.machine.torque_constant_Nm_A, log.machine.torque_constant_Nm_A);
}

/// Fills what `to` lacks from `from`.
void complete(Machine& to, const Machine& from)
{
    if (to.name.empty()) to.name = from.name;
    if (to.flux_map.empty()) to.flux_map = from.flux_map;
    for (const Parameter& p : kParameters)
        if (!(to.*(p.nominal))) to.*(p.nominal) = from.*(p.nominal);
    for (const auto rated : {&Machine::v_rated_V, &Machine::i_rated_A, &Machine::w_max_rad_s})
        if (!(to.*rated)) to.*rated = from.*rated;
}

/// Empty of a file that cannot be read; whoever reads it says why.
std::string format_if_any(const std::string& path)
{
    try {
        return format_of_file(path);
    } catch (const InputError&) {
        return "";
    }
}

/// A file of currents and speed, and the one beside it of the voltages (moteus), or of the link's (openinverter);
/// empty: there is none.
struct Files {
    std::string path, voltages, link;
};

/// Files that belong together, by their formats: one of each, or names that differ by the channel alone.
std::vector<Files> sources_of(const std::vector<std::string>& paths, const Options& options)
{
    std::vector<Files> sources;
    std::vector<std::string> controls, spots;
    for (const std::string& path : paths) {
        std::error_code ignored;
        // A pipe can be read but once.
        const bool may_be = paths.size() > 1 && options.format.empty() && options.tables.count(path) == 0 &&
                            std::filesystem::is_regular_file(path, ignored);
        const std::string format = may_be ? format_if_any(path) : "";
        if (format == "moteus_control")
            controls.push_back(path);
        else if (format == "openinverter_spot")
            spots.push_back(path);
        else
            sources.push_back({path, "", ""});
    }
    const auto partner_of = [&](std::string name, const std::string& word, const char* other, std::size_t count) {
        const auto at = name.rfind(word);
        if (at != name.npos) name.replace(at, word.size(), other);
        Files* partner = nullptr;
        for (Files& source : sources)
            if (name == source.path || (sources.size() == 1 && count == 1)) partner = &source;
        return partner;
    };
    for (const std::string& spot : spots) {
        Files* partner = partner_of(spot, "spot_values", "motor_data", spots.size());
        if (!partner || format_if_any(partner->path) != "openinverter_motor")
            throw InputError(spot, 1,
                             "values now and then; expected the file of motor_data beside it, or this one alone");
        partner->link = spot;
    }
    for (const std::string& control : controls) {
        Files* partner = partner_of(control, "servo_control", "servo_stats", controls.size());
        if (!partner)
            throw InputError(control, 1, "voltages without currents; expected the file of servo_stats beside it");
        partner->voltages = control;
    }
    return sources;
}

/// (E136)
Log joined(const Files& source, const ReadOptions& options)
{
    Survey survey;
    ReadOptions half = options;
    half.survey = &survey;
    half.plain_only = false;
    Log log = read_log(source.path, half);
    for (const std::string& what : survey.missing)
        if (what.find("w_m_rad_s") != what.npos) throw InputError(source.path, 1, "missing column " + what);
    for (const auto* column : {&log.i_d_A, &log.i_q_A, &log.w_m_rad_s, &log.t_s})
        if (column->empty())
            throw InputError(source.path, 1, "nothing to join voltages to; expected t_s, currents and speed");
    half.notes = nullptr;
    const Log control = read_log(source.voltages, half);
    const std::size_t far = join_voltages(log, control), moving = keep_settled(log);
    if (log.rows() < 3)
        throw InputError(source.path, 1,
                         fmt::format("{} of {} left beside the voltages of {}; expected settled stretches", log.rows(),
                                     counted(log.rows() + far + moving, "row"), source.voltages));
    log.regime = Regime::steady;
    if (options.notes)
        options.notes->push_back(fmt::format("{}: voltages of {} by the nearest stamp; {} without one and {} in motion "
                                             "left out",
                                             source.path, source.voltages, counted(far, "row"), moving));
    return log;
}

/// A log whose voltages are parts of the link's, which another file has: between its rows it goes straight.
Log linked(const Files& source, const ReadOptions& options)
{
    Survey survey;
    ReadOptions beside = options;
    beside.survey = &survey;
    beside.plain_only = false;
    beside.notes = nullptr;
    const Log spots = read_log(source.link, beside);
    const std::vector<double>&t = spots.t_s, &v = spots.v_dc_V;
    if (t.empty() || v.empty()) throw InputError(source.link, 1, "no voltage of the DC link by time; expected udc");
    const double mean = std::accumulate(v.begin(), v.end(), 0.0) / static_cast<double>(v.size());
    const auto [least, largest] = std::minmax_element(v.begin(), v.end());
    if (!(*least > 0.0)) throw InputError(source.link, 1, "udc is not above 0 throughout; expected the link's voltage");
    ReadOptions whole = options;
    whole.given.v_dc_V = mean;
    Log log = read_log(source.path, whole);
    for (std::size_t k = 0, n = 0; k < log.t_s.size(); ++k) {
        while (n + 1 < t.size() && t[n + 1] <= log.t_s[k]) ++n;
        const bool between = n + 1 < t.size() && log.t_s[k] > t[n];
        const double link_V = between ? v[n] + (v[n + 1] - v[n]) * (log.t_s[k] - t[n]) / (t[n + 1] - t[n]) : v[n];
        for (auto* column : {&log.v_d_V, &log.v_q_V})
            if (!column->empty()) (*column)[k] *= link_V / mean;
        if (!log.v_dc_V.empty()) log.v_dc_V[k] = link_V;
    }
    if (options.notes)
        options.notes->push_back(fmt::format("{}: the link's voltage is that of {}: {:g} to {:g} V", source.path,
                                             source.link, *least, *largest));
    return log;
}

/// Whether `head` is the beginning of `whole`, row by row.
bool begins(const Log& whole, const Log& head)
{
    return head.rows() > 0 && std::all_of(columns.begin(), columns.end(), [&](const ColumnInfo& column) {
               const auto &all = whole.*(column.values), &few = head.*(column.values);
               return all.empty() == few.empty() && all.size() >= few.size() &&
                      std::equal(few.begin(), few.end(), all.begin());
           });
}

/// Rows that were given twice count once, or they would be taken for twice as much to know.
void drop_repeated(std::vector<Log>& logs, std::vector<std::string>& notes)
{
    for (std::size_t k = 0; k + 1 < logs.size(); ++k) {
        const bool longer = logs.back().rows() > logs[k].rows();
        if (!(longer ? begins(logs.back(), logs[k]) : begins(logs[k], logs.back()))) continue;
        if (longer) std::swap(logs.back(), logs[k]);
        notes.push_back(fmt::format("{}: its rows are those of {}: used once", logs.back().path, logs[k].path));
        complete(logs[k].machine, logs.back().machine);
        logs.pop_back();
        return;
    }
}

/// Of polled logs the settled rows, as settled points; others as they are.
std::vector<Log> settled(std::vector<Log> logs, std::vector<std::string>& notes)
{
    if (logs.empty() || logs.front().regime != Regime::polled) return logs;
    const std::vector<Log> out = with_logs(logs, [&] { return settled_logs(logs); });
    for (std::size_t i = 0; i < logs.size(); ++i)
        notes.push_back(fmt::format("{}: polled: {} of {} settled, read as settled points", logs[i].path, out[i].rows(),
                                    counted(logs[i].rows(), "row")));
    return out;
}

}  // namespace

ReadOptions read_options(const Options& options)
{
    ReadOptions read;
    read.machine_file = options.machine_file;
    if (options.pole_pairs) read.pole_pairs = *options.pole_pairs;
    read.format = options.format;
    read.machine_text = options.machine_text;
    read.given.gear = options.gear, read.given.v_dc_V = options.v_dc_V, read.given.period_s = options.period_s;
    return read;
}

LearnConfig asked_effects(const Options& options, const std::vector<std::string>& names)
{
    LearnConfig config;
    if (!options.config_text.empty())
        config = learn_config_of("trace", options.config_text);
    else if (!options.config_file.empty())
        config = read_learn_config(options.config_file);
    add_effects(config, names);
    return config;
}

RowSource* table_of(const Options& options, const std::string& log)
{
    const auto found = options.tables.find(log);
    return found == options.tables.end() ? nullptr : found->second.get();
}

std::vector<Log> read_logs(const std::vector<std::string>& paths, const Options& options, bool all_columns,
                           std::vector<std::string>& notes, bool angle, bool polled)
{
    std::vector<Log> logs;
    Progress progress("reading", options.progress);
    const std::vector<Files> sources = sources_of(paths, options);
    for (std::size_t i = 0; i < sources.size(); ++i) {
        ReadOptions read = read_options(options);
        read.plain_only = !all_columns;
        read.table = table_of(options, sources[i].path);
        read.angle = angle;
        read.notes = &notes;
        read.progress = [&](double fraction) {
            progress.update((static_cast<double>(i) + fraction) / static_cast<double>(sources.size()));
        };
        logs.push_back(!sources[i].voltages.empty() ? joined(sources[i], read)
                       : !sources[i].link.empty()   ? linked(sources[i], read)
                                                    : read_log(sources[i].path, read));
        const Log &first = logs.front(), &log = logs.back();
        if (log.regime != first.regime)
            throw InputError(log.path, 1,
                             fmt::format("a {} log, but {} is {}; expected logs of one regime", name_of(log.regime),
                                         first.path, name_of(first.regime)));
        check_same_machine(first, log);
        drop_repeated(logs, notes);
    }
    Machine machine;
    for (const Log& log : logs) complete(machine, log.machine);
    for (Log& log : logs) log.machine = machine;
    for (const Log& log : logs)
        if (!polled && is_short_circuit(log))
            throw InputError(log.path, 1, "a short circuit, of whose current the size alone is known; fit takes it");
    // Moved, for a copy of a long log would be as much memory again.
    if (polled) return logs;
    return settled(std::move(logs), notes);
}

InputError refused(const Log& log, std::string what)
{
    const std::string path = log.path + ": ";
    if (what.rfind(path, 0) == 0) what.erase(0, path.size());
    if (!log.doubt.empty()) what += "; " + log.doubt;
    return {log.path, log.rows() + 1, what};
}

void bring_speed_forward(std::vector<Log>& logs, bool firmware, std::vector<std::string>& notes,
                         std::optional<double> known_s)
{
    const double lag_s = known_s ? *known_s : speed_lag_s(logs);
    if (!(lag_s > 0.0)) return;
    for (Log& log : logs) SpeedForward(lag_s, log.dt_s).over(log), log.speed_lag_s = lag_s;
    notes.push_back(fmt::format("the speed is {:.3g} ms late beside the angle, as behind a filter or from a loop that "
                                "tracks it: brought forward by its slope{}",
                                1e3 * lag_s, firmware ? "; firmware has to do so as well" : ""));
}

}  // namespace dqw
