#include "app/cmd/compare.hpp"

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>

#include "app/base/output.hpp"
#include "app/base/progress.hpp"
#include "app/cmd/estimate.hpp"
#include "app/cmd/logs.hpp"
#include "app/read/flux_map.hpp"
#include "app/report/compare.hpp"
#include "app/report/compare_maps.hpp"
#include "app/report/report.hpp"
#include "app/report/sense.hpp"
#include "ref/trace/named.hpp"

namespace dqw {
namespace {

Result learned(const std::vector<Log>& logs, const Options& options, const LearnConfig& config, bool fixed_point,
               Comparison& c, std::vector<TraceEffect>& effects)
{
    Progress progress(fixed_point ? "learning in fixed point" : "learning");
    LearnOptions how = learn_options(options, config, fixed_point);
    how.progress = progress.callback();
    how.block = [&](double t_s, const std::array<double, 4>& value) {
        c.blocks[fixed_point ? 1 : 0].push_back({t_s, value});
    };
    const Learned found = learn_all(logs, how);
    if (fixed_point) c.unit = found.unit;
    effects = found.effects;
    return found.result;
}

Result fitted(const std::vector<Log>& logs, const Options& options, const LearnConfig& config,
              std::vector<TraceEffect>& effects)
{
    Progress progress("fitting");
    const EffectFit found = fit_effects(logs, effects_of(config), options.parameters, progress.callback());
    effects = found.effects;
    return found.result;
}

/// As far as it is to be believed; the effects' parameters beside the others, named after their effect. What was given
/// says nothing.
void complete(Result& result, const std::vector<TraceEffect>& effects, const std::vector<Log>& logs,
              const Options& options)
{
    check_sense(logs, result);
    name_what_was_left_out(result, options.parameters);
    for (const TraceEffect& effect : effects)
        for (const Estimate& p : effect.parameters)
            if (!p.given) result.parameters.push_back({effect.name + "." + p.name, p.value, p.sd, false});
}

/// Whose note it is stands behind "warning: "; a note of all three stands once, as its own.
void gather_notes(Comparison& c)
{
    const auto all = estimates_of(c);
    const std::string warning = "warning: ";
    const auto has = [](const Result& r, const std::string& note) {
        return std::find(r.notes.begin(), r.notes.end(), note) != r.notes.end();
    };
    for (const auto& [who, result] : all)
        for (const std::string& note : result->notes) {
            const bool common = std::all_of(std::begin(all), std::end(all),
                                            [&, &n = note](const auto& other) { return has(*other.result, n); });
            if (common && result != &c.reference) continue;
            const std::string whose = common ? "" : std::string(who) + ": ";
            c.notes.push_back(note.rfind(warning, 0) == 0 ? warning + whose + note.substr(warning.size())
                                                          : whose + note);
        }
}

}  // namespace

int compare_command(const Options& options)
{
    const bool maps = !options.maps.empty();
    if (maps == !options.logs.front().empty())
        throw UsageError("compare: LOG.csv, or --map with two flux maps, and not both; --help says more");
    if (maps) {
        const MapComparison c = compare_maps(read_flux_map(options.maps[0]), read_flux_map(options.maps[1]));
        print(options.json ? json_text(compare_maps_json(c)) : compare_maps_text(c));
        return exit_done;
    }
    Comparison c;
    c.log = options.logs.front();
    const LearnConfig config = asked_effects(options.config_file, options.effects);
    const std::vector<Log> logs = read_logs(options.logs, options, !config.inputs.empty(), c.notes);
    c.nominal = logs.front().machine;
    // What cannot be written is said before the work, not after.
    make_directory(options.out_dir);
    std::vector<TraceEffect> single, fixed, reference;
    with_logs(logs, [&] {
        c.single = learned(logs, options, config, false, c, single);
        c.fixed = learned(logs, options, config, true, c, fixed);
        c.reference = fitted(logs, options, config, reference);
    });
    complete(c.single, single, logs, options);
    complete(c.fixed, fixed, logs, options);
    complete(c.reference, reference, logs, options);
    gather_notes(c);
    for (const auto& [who, result] : estimates_of(c))
        if (result != &c.reference)
            for (const std::string& note :
                 disagreements(result->parameters, who, c.reference.parameters, "the reference"))
                c.notes.push_back(note);
    write_file(path_in(options.out_dir, "compare.html"), compare_page(c));
    print_notes(c.notes);
    print(options.json ? json_text(compare_json(c)) : compare_text(c));
    const bool known = c.single.not_identifiable.empty() && c.fixed.not_identifiable.empty() &&
                       c.reference.not_identifiable.empty();
    return known ? exit_done : exit_not_identifiable;
}

}  // namespace dqw
