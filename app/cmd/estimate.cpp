#include "app/cmd/estimate.hpp"

#include <nlohmann/json.hpp>

#include "app/base/output.hpp"
#include "app/base/progress.hpp"
#include "app/cmd/logs.hpp"
#include "app/firmware/q15_config.hpp"
#include "app/report/datasheet.hpp"
#include "app/report/report.hpp"
#include "app/report/sense.hpp"
#include "ref/fit/fit.hpp"
#include "ref/trace/named.hpp"

namespace dqw {
namespace {

int estimate(const std::string& name, const Options& options, decltype(estimate_by_fit)& estimator)
{
    std::vector<std::string> notes;
    const LearnConfig config = asked_effects(options.config_file, options.effects);
    const bool fits = name == "fit", plain = config.inputs.empty();
    const std::vector<Log> logs = read_logs(options.logs, options, !plain, notes, fits, fits && plain);
    Estimated estimated = with_logs(logs, [&] { return estimator(logs, options, config); });
    Result& result = estimated.result;
    check_sense(logs, result);
    name_what_was_left_out(result, options.parameters);
    result.notes.insert(result.notes.begin(), notes.begin(), notes.end());
    const Machine& nominal = logs.front().machine;
    auto object = result_json(result, nominal, estimated.effects);
    if (fits && result.regime != Regime::mechanical) object["datasheet"] = datasheet_json(result);
    const std::string json = json_text(object);
    if (options.out_given) {
        make_directory(options.out_dir);
        write_file(path_in(options.out_dir, name + ".json"), json);
        if (!estimated.q15_config.empty())
            write_file(path_in(options.out_dir, "dqw_q15_config.h"), estimated.q15_config);
    }
    print_notes(result.notes);
    print(options.json ? json
                       : result_text(result, nominal, estimated.effects) +
                             (fits && result.regime != Regime::mechanical ? datasheet_text(result) : ""));
    return result.not_identifiable.empty() ? exit_done : exit_not_identifiable;
}

}  // namespace

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
    Progress progress("learning");
    LearnOptions how = learn_options(options, config, options.fixed_point());
    how.progress = progress.callback();
    const Learned found = learn_all(logs, how);
    const bool header = how.fixed_point && found.result.regime != Regime::mechanical;
    return {found.result, found.effects,
            header ? q15_config_text(logs, found.result.parameters, found.inputs) : std::string()};
}

Estimated estimate_by_fit(const std::vector<Log>& logs, const Options& options, const LearnConfig& config)
{
    Progress progress("fitting");
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

int learn_command(const Options& options) { return estimate("learn", options, estimate_by_learners); }

int fit_command(const Options& options) { return estimate("fit", options, estimate_by_fit); }

}  // namespace dqw
