// `compare`: float, fixed point and the reference fit on one log.
#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "command.hpp"
#include "compare_report.hpp"
#include "fit.hpp"
#include "output.hpp"
#include "progress.hpp"
#include "report.hpp"
#include "sense.hpp"

namespace dqw {
namespace {

struct Options : CommonOptions {
    std::string log;
};

Result learned(const std::vector<Log>& logs, const Options& options, bool fixed_point, Comparison& c)
{
    Progress progress(fixed_point ? "learning in fixed point" : "learning");
    LearnOptions o;
    o.parameters = options.parameters;
    o.fixed_point = fixed_point;
    o.progress = progress.callback();
    o.block = [&](double t_s, const std::array<double, 4>& value) { c.blocks[fixed_point ? 1 : 0].push_back({t_s, value}); };
    const Learned found = learn_all(logs, o);
    if (fixed_point) c.unit = found.unit;
    return found.result;
}

Result fitted(const std::vector<Log>& logs, const Options& options)
{
    Progress progress("fitting");
    FitOptions o;
    o.parameters = options.parameters;
    o.progress = progress.callback();
    return fit(logs, o);
}

/// Whose note it is stands behind "warning: "; a note of all three stands once, as its own.
void gather_notes(Comparison& c)
{
    const std::pair<const char*, const Result*> all[] = {{"reference", &c.reference}, {"float", &c.single}, {"Q15", &c.fixed}};
    const std::string warning = "warning: ";
    const auto has = [](const Result& r, const std::string& note) { return std::find(r.notes.begin(), r.notes.end(), note) != r.notes.end(); };
    for (const auto& [who, result] : all)
        for (const std::string& note : result->notes) {
            const bool common = std::all_of(std::begin(all), std::end(all), [&, &n = note](const auto& other) { return has(*other.second, n); });
            if (common && result != &c.reference) continue;
            const std::string whose = common ? "" : std::string(who) + ": ";
            c.notes.push_back(note.rfind(warning, 0) == 0 ? warning + whose + note.substr(warning.size()) : whose + note);
        }
}

int run(const Options& options)
{
    Comparison c;
    c.log = options.log;
    const std::vector<Log> logs = read_logs({options.log}, options, c.notes);
    const Log& log = logs.front();
    c.nominal = log.machine;
    // What cannot be written is said before the work, not after.
    make_directory(options.out_dir);
    try {
        c.single = learned(logs, options, false, c);
        c.fixed = learned(logs, options, true, c);
        c.reference = fitted(logs, options);
    } catch (const std::invalid_argument& error) {
        std::string what = error.what();
        const std::string path = log.path + ": ";
        if (what.rfind(path, 0) == 0) what.erase(0, path.size());
        throw InputError(log.path, log.rows() + 1, what);
    }
    bool known = true;
    for (Result* result : {&c.reference, &c.single, &c.fixed}) {
        check_sense(logs, *result);
        name_what_was_left_out(*result, options.parameters);
        known = known && result->not_identifiable.empty();
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
    CLI::App* command = app.add_subcommand("compare", "learn a log in float and in fixed point, fit it, and say how far they are apart");
    auto options = std::make_shared<Options>();
    command->add_option("LOG.csv", options->log, "log of any regime")->required()->type_name("");
    add_common(*command, *options);
    add_parameters(*command, *options);
    command->footer("Differences are 100 (first - second) / second. One LSB of a parameter is 1/32768 of the unit that the full scales make of it:\n"
                    "R V/I, L V T/I, psi V T; J M T/W, B M/W; full scales V, I, torque M, speed W, sampling period T. Writes compare.html into DIR.\n"
                    "Exit code 4: a parameter asked for is not identifiable by all three.");
    return {command, [=] { return run(*options); }};
}

}  // namespace dqw
