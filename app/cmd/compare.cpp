#include "app/cmd/compare.hpp"

#include "app/cmd/logs.hpp"
#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "app/base/output.hpp"
#include "app/base/progress.hpp"
#include "app/learn/inputs.hpp"
#include "app/report/compare.hpp"
#include "app/report/report.hpp"
#include "app/report/sense.hpp"
#include "ref/fit/fit.hpp"
#include "ref/trace/named.hpp"

namespace dqw {
namespace {

struct Options : CommonOptions {
    std::string log;
    EffectOptions effects;
};

/// One estimator's parameters, and those of the effects.
struct Estimated {
    Result result;
    std::vector<TraceEffect> effects;
};

/// The effects' parameters beside the others, named after their effect; what was given says nothing.
void take_effects(Estimated& e)
{
    for (const TraceEffect& effect : e.effects)
        for (const Estimate& p : effect.parameters)
            if (!p.given) e.result.parameters.push_back({effect.name + "." + p.name, p.value, p.sd, false});
}

Estimated learned(const std::vector<Log>& logs, const Options& options, const LearnConfig& config, bool fixed_point,
                  Comparison& c)
{
    Progress progress(fixed_point ? "learning in fixed point" : "learning");
    LearnOptions o;
    o.parameters = options.parameters;
    o.inputs = config.inputs;
    o.start = config.start;
    o.fixed_point = fixed_point;
    o.progress = progress.callback();
    o.block = [&](double t_s, const std::array<double, 4>& value) {
        c.blocks[fixed_point ? 1 : 0].push_back({t_s, value});
    };
    const Learned found = learn_all(logs, o);
    if (fixed_point) c.unit = found.unit;
    return {found.result, found.effects};
}

Estimated fitted(const std::vector<Log>& logs, const Options& options, const LearnConfig& config)
{
    Progress progress("fitting");
    const EffectFit found = fit_effects(logs, effects_of(config), options.parameters, progress.callback());
    return {found.result, found.effects};
}

/// Whose note it is stands behind "warning: "; a note of all three stands once, as its own.
void gather_notes(Comparison& c)
{
    const std::pair<const char*, const Result*> all[] = {
        {"reference", &c.reference}, {"float", &c.single}, {"Q15", &c.fixed}};
    const std::string warning = "warning: ";
    const auto has = [](const Result& r, const std::string& note) {
        return std::find(r.notes.begin(), r.notes.end(), note) != r.notes.end();
    };
    for (const auto& [who, result] : all)
        for (const std::string& note : result->notes) {
            const bool common = std::all_of(std::begin(all), std::end(all),
                                            [&, &n = note](const auto& other) { return has(*other.second, n); });
            if (common && result != &c.reference) continue;
            const std::string whose = common ? "" : std::string(who) + ": ";
            c.notes.push_back(note.rfind(warning, 0) == 0 ? warning + whose + note.substr(warning.size())
                                                          : whose + note);
        }
}

int run(const Options& options)
{
    Comparison c;
    c.log = options.log;
    const LearnConfig config = asked_effects(options.effects.config_file, options.effects.names);
    CommonOptions reading = options;
    reading.all_columns = reading.all_columns || !config.inputs.empty();
    const std::vector<Log> logs = read_logs({options.log}, reading, c.notes);
    const Log& log = logs.front();
    c.nominal = log.machine;
    // What cannot be written is said before the work, not after.
    make_directory(options.out_dir);
    Estimated single, fixed, reference;
    try {
        single = learned(logs, options, config, false, c);
        fixed = learned(logs, options, config, true, c);
        reference = fitted(logs, options, config);
    } catch (const std::invalid_argument& error) {
        std::string what = error.what();
        const std::string path = log.path + ": ";
        if (what.rfind(path, 0) == 0) what.erase(0, path.size());
        throw InputError(log.path, log.rows() + 1, what);
    }
    bool known = true;
    for (auto [e, to] :
         {std::pair(&reference, &c.reference), std::pair(&single, &c.single), std::pair(&fixed, &c.fixed)}) {
        check_sense(logs, e->result);
        name_what_was_left_out(e->result, options.parameters);
        take_effects(*e);
        *to = e->result;
        known = known && to->not_identifiable.empty();
    }
    gather_notes(c);
    OutputFile file(path_in(options.out_dir, "compare.html"));
    file.write(compare_page(c));
    file.close();
    print_notes(c.notes);
    print(options.json ? json_text(compare_json(c)) : compare_text(c));
    return known ? exit_done : exit_not_identifiable;
}

}  // namespace

Command add_compare(CLI::App& app)
{
    CLI::App* command = app.add_subcommand(
        "compare", "learn a log in float and in fixed point, fit it, and say how far they are apart");
    auto options = std::make_shared<Options>();
    command->add_option("LOG.csv", options->log, "log of any regime")->required()->type_name("");
    add_common(*command, *options);
    add_parameters(*command, *options);
    add_effects(*command, options->effects);
    command->footer("Differences are 100 (first - second) / second. One LSB of a parameter is 1/32768 of the unit that "
                    "the full scales make of it:\n"
                    "R V/I, L V T/I, psi V T; J M T/W, B M/W; full scales V, I, torque M, speed W, sampling period T. "
                    "An effect's parameter is named "
                    "EFFECT.PARAMETER. Writes compare.html into DIR.\n"
                    "Exit code 4: a parameter asked for is not identifiable by all three.");
    return {command, [=] { return run(*options); }};
}

}  // namespace dqw
