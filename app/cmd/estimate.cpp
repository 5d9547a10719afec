#include "app/cmd/estimate.hpp"

#include "app/cmd/logs.hpp"
#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "app/base/effect_names.hpp"
#include "app/base/output.hpp"
#include "app/base/progress.hpp"
#include "app/base/text.hpp"
#include "app/firmware/q15_config.hpp"
#include "app/learn/inputs.hpp"
#include "app/learn/learn.hpp"
#include "app/report/effect.hpp"
#include "app/report/report.hpp"
#include "app/report/sense.hpp"
#include "ref/fit/fit.hpp"
#include "ref/trace/named.hpp"

namespace dqw {
namespace {

/// What was estimated: effects beside parameters, where they were asked for.
struct Estimated {
    Result result;
    std::vector<TraceEffect> effects;
    std::string q15_config = {};  ///< a header, where the learners were those of port_q15/
};

struct Options : CommonOptions {
    std::vector<std::string> logs;
    std::string arith = "float";
    EffectOptions effects;
};

using Estimator =
    std::function<Estimated(const std::vector<Log>&, const Options&, const LearnConfig&, std::function<void(double)>)>;

int estimate(const std::string& name, const Options& options, const Estimator& estimator)
{
    std::vector<std::string> notes;
    const LearnConfig config = asked_effects(options.effects.config_file, options.effects.names);
    CommonOptions reading = options;
    reading.all_columns = reading.all_columns || !config.inputs.empty();
    const std::vector<Log> logs = read_logs(options.logs, reading, notes);
    Estimated estimated;
    Result& result = estimated.result;
    try {
        Progress progress(name == "fit" ? "fitting" : "learning");
        estimated = estimator(logs, options, config, progress.callback());
    } catch (const std::invalid_argument& error) {
        // The estimators begin with the log's name where they know it.
        std::string what = error.what();
        const std::string path = logs.front().path + ": ";
        if (what.rfind(path, 0) == 0) what.erase(0, path.size());
        throw InputError(logs.front().path, logs.front().rows() + 1, what);
    }
    check_sense(logs, result);
    name_what_was_left_out(result, options.parameters);
    result.notes.insert(result.notes.begin(), notes.begin(), notes.end());
    auto object = result_json(result, logs.front().machine);
    object["effects"] = effects_json(estimated.effects);
    const std::string json = json_text(object);
    if (options.out_given) {
        make_directory(options.out_dir);
        OutputFile file(path_in(options.out_dir, name + ".json"));
        file.write(json);
        file.close();
        if (!estimated.q15_config.empty()) {
            OutputFile header(path_in(options.out_dir, "dqw_q15_config.h"));
            header.write(estimated.q15_config);
            header.close();
        }
    }
    print_notes(result.notes);
    print(options.json ? json : result_text(result, logs.front().machine) + effects_text(estimated.effects));
    return result.not_identifiable.empty() ? exit_done : exit_not_identifiable;
}

Command add_estimator(CLI::App& app, const std::string& name, const std::string& about, const Estimator& estimator)
{
    CLI::App* command = app.add_subcommand(name, about);
    auto options = std::make_shared<Options>();
    command->add_option("LOG.csv", options->logs, "log, or several of one machine and regime")
        ->required()
        ->type_name("");
    add_common(*command, *options);
    add_parameters(*command, *options);
    add_effects(*command, options->effects);
    if (name == "learn")
        command->add_option("--arith", options->arith, "arithmetic of the learners")
            ->check(CLI::IsMember({"float", "q15"}))
            ->capture_default_str();
    command->footer("With --out, writes DIR/" + name + ".json as well" +
                    (name == "learn" ? ", with --arith q15 DIR/dqw_q15_config.h where the log is not mechanical" : "") +
                    ". Exit code 4: a parameter asked for is not identifiable.");
    return {command, [=] { return estimate(name, *options, estimator); }};
}

}  // namespace

Command add_learn(CLI::App& app)
{
    return add_estimator(app, "learn", "run the C learners over a log",
                         [](const auto& logs, const Options& o, const LearnConfig& config, auto progress) {
                             LearnOptions options;
                             options.fixed_point = o.arith == "q15";
                             options.parameters = o.parameters;
                             options.inputs = config.inputs;
                             options.start = config.start;
                             options.progress = std::move(progress);
                             const Learned learned = learn_all(logs, options);
                             const bool header = options.fixed_point && learned.result.regime != Regime::mechanical;
                             return Estimated{learned.result, learned.effects,
                                              header ? q15_config_text(logs, learned.result.parameters, learned.inputs)
                                                     : ""};
                         });
}

Command add_fit(CLI::App& app)
{
    return add_estimator(app, "fit", "fit the reference model to a log",
                         [](const auto& logs, const Options& o, const LearnConfig& config, auto progress) {
                             const std::vector<std::string> names = effects_of(config);
                             if (!names.empty()) {
                                 const EffectFit fitted = fit_effects(logs, names, o.parameters, std::move(progress));
                                 return Estimated{fitted.result, fitted.effects};
                             }
                             FitOptions options;
                             options.parameters = o.parameters;
                             options.progress = std::move(progress);
                             return Estimated{fit(logs, options), {}};
                         });
}

}  // namespace dqw
