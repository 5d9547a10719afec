#include "app/job/compare.hpp"

#include <algorithm>
#include <iterator>

#include "app/base/progress.hpp"
#include "app/job/estimate.hpp"
#include "app/job/logs.hpp"
#include "app/report/report.hpp"
#include "app/report/sense.hpp"
#include "ref/trace/named.hpp"

namespace dqw {
namespace {

Result learned(const std::vector<Log>& logs, const Options& options, const LearnConfig& config, bool fixed_point,
               Comparison& c, std::vector<TraceEffect>& effects)
{
    Progress progress(fixed_point ? "learning in fixed point" : "learning", options.progress);
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
    Progress progress("fitting", options.progress);
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

ToCompare log_to_compare(const Options& options)
{
    ToCompare what;
    what.comparison.log = options.logs.front();
    what.config = asked_effects(options, options.effects);
    what.logs = read_logs(options.logs, options, !what.config.inputs.empty(), what.comparison.notes, true);
    bring_speed_forward(what.logs, false, what.comparison.notes);
    add_flux_map(what.config, what.logs);
    what.comparison.nominal = what.logs.front().machine;
    return what;
}

Comparison compare_log(ToCompare what, const Options& options)
{
    const std::vector<Log>& logs = what.logs;
    Comparison& c = what.comparison;
    std::vector<TraceEffect> single, fixed, reference;
    with_logs(logs, [&] {
        c.single = learned(logs, options, what.config, false, c, single);
        c.fixed = learned(logs, options, what.config, true, c, fixed);
        c.reference = fitted(logs, options, what.config, reference);
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
    return std::move(c);
}

}  // namespace dqw
