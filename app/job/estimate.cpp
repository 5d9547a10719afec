#include "app/job/estimate.hpp"

#include <nlohmann/json.hpp>

#include "app/base/progress.hpp"
#include "app/firmware/q15_config.hpp"
#include "app/job/logs.hpp"
#include "app/report/datasheet.hpp"
#include "app/report/report.hpp"
#include "app/report/sense.hpp"
#include "ref/fit/fit.hpp"
#include "ref/trace/named.hpp"

namespace dqw {
namespace {

Estimation estimate(bool fits, const Options& options, decltype(estimate_by_fit)& estimator)
{
    std::vector<std::string> notes;
    const LearnConfig config = asked_effects(options, options.effects);
    const bool plain = config.inputs.empty();
    std::vector<Log> logs = read_logs(options.logs, options, !plain, notes, true, fits && plain);
    bring_speed_forward(logs, !fits, notes);
    Estimated estimated = with_logs(logs, [&] { return estimator(logs, options, config); });
    Result& result = estimated.result;
    check_sense(logs, result);
    name_what_was_left_out(result, options.parameters);
    result.notes.insert(result.notes.begin(), notes.begin(), notes.end());
    return {std::move(estimated), logs.front().machine, fits && result.regime != Regime::mechanical};
}

}  // namespace

Estimation learn_logs(const Options& options) { return estimate(false, options, estimate_by_learners); }

Estimation fit_logs(const Options& options) { return estimate(true, options, estimate_by_fit); }

std::string estimation_json(const Estimation& e)
{
    auto object = result_json(e.estimated.result, e.nominal, e.estimated.effects);
    if (e.datasheet) object["datasheet"] = datasheet_json(e.estimated.result, e.nominal);
    return json_text(object);
}

std::string estimation_text(const Estimation& e)
{
    return result_text(e.estimated.result, e.nominal, e.estimated.effects) +
           (e.datasheet ? datasheet_text(e.estimated.result, e.nominal) : "");
}

LearnOptions learn_options(const Options& options, const LearnConfig& config, bool fixed_point)
{
    LearnOptions how;
    how.parameters = options.parameters;
    how.inputs = config.inputs;
    how.start = config.start;
    how.fixed_point = fixed_point;
    return how;
}

Estimated estimate_by_learners(const std::vector<Log>& logs, const Options& options, const LearnConfig& config)
{
    Progress progress("learning", options.progress);
    LearnConfig with_map = config;
    add_flux_map(with_map, logs);
    LearnOptions how = learn_options(options, with_map, options.fixed_point());
    how.progress = progress.callback();
    how.allow_for_hidden_loss = true;
    Learned found = learn_all(logs, how);
    note_flux_map(logs, found.result);
    const bool header = how.fixed_point && found.result.regime != Regime::mechanical;
    return {found.result, found.effects,
            header ? q15_config_text(logs, found.result.parameters, found.inputs) : std::string()};
}

Estimated estimate_by_fit(const std::vector<Log>& logs, const Options& options, const LearnConfig& config)
{
    Progress progress("fitting", options.progress);
    const std::vector<std::string> names = effects_of(config);
    if (names.empty()) {
        Estimated plain{fit(logs, {options.parameters, progress.callback()}), {}, {}};
        if (!plain.result.dead_time.empty())
            plain.effects.push_back({"dead_time", plain.result.dead_time, 0.0, {}, ""});
        return plain;
    }
    const EffectFit found = fit_effects(logs, names, options.parameters, progress.callback());
    return {found.result, found.effects};
}

}  // namespace dqw
