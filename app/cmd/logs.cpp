#include "app/cmd/logs.hpp"

#include <fmt/format.h>

#include "app/base/columns.hpp"
#include "app/base/parameters.hpp"
#include "app/base/progress.hpp"

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
    for (const Parameter& p : kParameters)
        if (!(to.*(p.nominal))) to.*(p.nominal) = from.*(p.nominal);
}

}  // namespace

ReadOptions read_options(const Options& options)
{
    ReadOptions read;
    read.machine_file = options.machine_file;
    if (options.pole_pairs) read.pole_pairs = *options.pole_pairs;
    read.format = options.format;
    read.given.gear = options.gear, read.given.v_dc_V = options.v_dc_V, read.given.period_s = options.period_s;
    return read;
}

std::vector<Log> read_logs(const std::vector<std::string>& paths, const Options& options, bool all_columns,
                           std::vector<std::string>& notes, bool angle)
{
    std::vector<Log> logs;
    Progress progress("reading");
    for (std::size_t i = 0; i < paths.size(); ++i) {
        ReadOptions read = read_options(options);
        read.plain_only = !all_columns;
        read.angle = angle;
        read.notes = &notes;
        read.progress = [&](double fraction) {
            progress.update((static_cast<double>(i) + fraction) / static_cast<double>(paths.size()));
        };
        logs.push_back(read_log(paths[i], read));
        const Log &first = logs.front(), &log = logs.back();
        if (log.regime != first.regime)
            throw InputError(log.path, 1,
                             fmt::format("a {} log, but {} is {}; expected logs of one regime", name_of(log.regime),
                                         first.path, name_of(first.regime)));
        check_same_machine(first, log);
    }
    Machine machine;
    for (const Log& log : logs) complete(machine, log.machine);
    for (Log& log : logs) log.machine = machine;
    return logs;
}

InputError refused(const Log& log, std::string what)
{
    const std::string path = log.path + ": ";
    if (what.rfind(path, 0) == 0) what.erase(0, path.size());
    return {log.path, log.rows() + 1, what};
}

}  // namespace dqw
