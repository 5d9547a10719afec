#include "app/cmd/parser.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>

#include "app/base/effect_names.hpp"
#include "app/base/learnable.hpp"
#include "app/base/output.hpp"
#include "app/base/parameters.hpp"
#include "app/base/text.hpp"
#include "app/cmd/columns.hpp"
#include "app/cmd/command.hpp"
#include "app/cmd/compare.hpp"
#include "app/cmd/completion.hpp"
#include "app/cmd/demo.hpp"
#include "app/cmd/estimate.hpp"
#include "app/cmd/manual.hpp"
#include "app/cmd/monitor.hpp"
#include "app/cmd/sim.hpp"
#include "app/cmd/trace.hpp"
#include "app/cmd/version.hpp"
#include "app/format/formats.hpp"
#include "app/paper/paper.hpp"
#include "app/read/csv.hpp"
#include "dqw_sim.h"

namespace dqw {
namespace {

/// A number that does not fit is no seed: the parser would take the nearest that does.
std::uint64_t seed_of(const std::string& text)
{
    std::uint64_t seed = 0;
    const char* const end = text.data() + text.size();
    const auto [last, error] = std::from_chars(text.data(), end, seed);
    if (error != std::errc{} || last != end)
        throw CLI::ValidationError("--seed", shown(text) + " is no whole number from 0 to 18446744073709551615");
    return seed;
}

void add_common(CLI::App& command, Options& o)
{
    command.add_flag("--json", o.json, "print one JSON object on stdout and nothing else");
    command
        .add_option_function<std::string>(
            "--out", [&o](const std::string& dir) { o.out_dir = dir, o.out_given = true; },
            "folder for what is written (default .)")
        ->type_name("DIR");
    command.add_option("--pole-pairs", o.pole_pairs, "number of pole pairs")
        ->check(CLI::Range(1, 1000))
        ->type_name("N");
    command.add_option("--machine", o.machine_file, "machine file instead of LOG.toml")->type_name("FILE");
}

/// What a log's file may not say.
void add_reading(CLI::App& command, Options& o)
{
    std::vector<std::string> names;
    for (const Format* format : formats()) names.emplace_back(format->name);
    command.add_option("--format", o.format, "format of the log, where it is not found by itself; see dqwatch formats")
        ->check(CLI::IsMember(names))
        ->type_name("NAME");
    const auto positive = CLI::Validator(
        [](const std::string& text) {
            double value = 0;
            return parse_number(text, value) == NumberError::none && value > 0 ? std::string()
                                                                               : shown(text) + " is not above 0";
        },
        "");
    command.add_option("--gear", o.gear, "turns of the rotor for one of the output shaft")
        ->check(positive)
        ->type_name("N");
    command.add_option("--v-dc", o.v_dc_V, "voltage of the DC link, where the log has none")
        ->check(positive)
        ->type_name("V");
    command
        .add_option("--period", o.period_s,
                    "seconds from row to row, where the log has no time or stamps that are no use")
        ->check(positive)
        ->type_name("S");
}

/// A list of names out of those that are known.
CLI::Option* add_names(CLI::App& command, const char* name, std::vector<std::string>& to, const std::string& about,
                       const std::vector<std::string>& known)
{
    return command.add_option(name, to, about + list(known, 99))
        ->take_all()
        ->allow_extra_args(false)
        ->check(CLI::IsMember(known));
}

void add_parameters(CLI::App& command, Options& o)
{
    add_names(command, "--parameters", o.parameters, "what to estimate, by commas: ", known_parameters())
        ->delimiter(',')
        ->type_name("LIST");
}

void add_effects(CLI::App& command, Options& o, const std::string& about)
{
    add_names(command, "--effect", o.effects, about, traced_names())->type_name("NAME");
}

void add_config(CLI::App& command, Options& o, const char* about)
{
    command.add_option("--config", o.config_file, about)->type_name("trace.json");
}

void add_arith(CLI::App& command, Options& o, const char* about)
{
    command.add_option("--arith", o.arith, about)->check(CLI::IsMember({"float", "q15"}))->capture_default_str();
}

void add_log(CLI::App& command, Options& o, const char* about)
{
    o.logs.resize(1);
    command.add_option("LOG.csv", o.logs.front(), about)->required()->type_name("");
    add_common(command, o);
    add_reading(command, o);
}

void add_logs(CLI::App& command, Options& o)
{
    command.add_option("LOG.csv", o.logs, "log, or several of one machine and regime")->required()->type_name("");
    add_common(command, o);
    add_reading(command, o);
}

void add_estimate(CLI::App& command, Options& o)
{
    add_parameters(command, o);
    add_effects(command, o, "effect to estimate as well, repeatable: ");
    add_config(command, o, "effects that a trace found, with their start values");
}

void add_fit(CLI::App& command, Options& o)
{
    add_logs(command, o);
    add_estimate(command, o);
}

void add_learn(CLI::App& command, Options& o)
{
    add_fit(command, o);
    add_arith(command, o, "arithmetic of the learners");
}

void add_compare(CLI::App& command, Options& o)
{
    add_log(command, o, "log of any regime");
    add_estimate(command, o);
    command.add_option("--map", o.maps, "instead of a log, two flux maps of one machine: where they differ")
        ->expected(2)
        ->type_name("A.csv B.csv");
    command.get_option("LOG.csv")->required(false);
}

void add_trace(CLI::App& command, Options& o)
{
    add_logs(command, o);
    add_effects(command, o, "try this effect alone, or these: ");
}

void add_monitor(CLI::App& command, Options& o)
{
    add_log(command, o, "dynamic log; - for rows from a pipe as they come");
    command.get_option("--json")->description(
        "print one JSON object an event, one a line, then one of what could be seen, and nothing else on stdout");
    add_effects(
        command, o,
        "effect that the machine has, learned as well; repeatable; a note says where this log cannot have it: ");
    add_config(command, o, "what a trace found: start values, and the effects to learn");
    add_arith(command, o, "arithmetic of the monitor");
    command
        .add_option("--store", o.store_file,
                    "keep what is healthy in this file: read at the start where it is there, written while it runs")
        ->type_name("FILE");
}

void add_columns(CLI::App& command, Options& o)
{
    add_log(command, o, "log of any format");
    command.add_flag("--write", o.write, "write DIR/LOG_canonical.csv and .toml: the same in dqwatch's own format");
}

void add_demo(CLI::App& command, Options& o)
{
    add_common(command, o);
    add_parameters(command, o);
}

void add_sim(CLI::App& command, Options& o)
{
    command.add_option("SCENARIO", o.scenario, "which drive; --list names all")->type_name("");
    command.add_flag("--list", o.list, "name the scenarios");
    command.add_flag("--list-keys", o.list_keys, "name the keys of --set");
    command.add_option("--set", o.settings, "change one value, e.g. machine.R_ohm=0.5; repeatable")
        ->type_name("KEY=VALUE")
        ->allow_extra_args(false)
        ->take_all();
    command
        .add_option_function<std::string>(
            "--seed", [&o](const std::string& text) { o.seed = seed_of(text); }, "of noise and random excitation")
        ->type_name("N");
    command
        .add_option("--polled", o.polled,
                    "write the log as a vendor's tool polls it; what --set polled.* does not say is VESC's wire (steps "
                    "of 0.01 A, 0.001 V, 1 erpm, 0.1 V), jitter of 1 ms, 2 % of the rows lost, 1 % repeated, speed "
                    "noise of 0.5 % of the speed where i_max_A meets the voltage limit")
        ->type_name("HZ");
    command.add_option("--modulation", o.modulation, "how the inverter switches, as --set inverter.modulation")
        ->type_name("NAME");
    add_common(command, o);
}

int paper_command(const Options& o)
{
    if (o.pole_pairs || !o.machine_file.empty())
        print_notes({"paper: the paper's machine is simulated; --pole-pairs and --machine change nothing"});
    make_directory(o.out_dir);
    return run_paper(o.out_dir, o.json);
}

struct Command {
    const char *name, *about;
    void (*add)(CLI::App&, Options&);
    int (*run)(const Options&);
    const char* footer;
};

const Command commands[] = {
    {"paper", "reproduce the paper's tables and figures beside its numbers", add_common, paper_command, ""},
    {"sim", "simulate a drive, write DIR/SCENARIO.csv and .toml", add_sim, sim_command, ""},
    {"learn", "run the C learners over a log", add_learn, learn_command,
     "With --out, writes DIR/learn.json as well, with --arith q15 DIR/dqw_q15_config.h where the log is not "
     "mechanical. Exit code 4: a parameter asked for is not identifiable."},
    {"fit", "fit the reference model to a log", add_fit, fit_command,
     "With --out, writes DIR/fit.json as well. Exit code 4: a parameter asked for is not identifiable."},
    {"trace", "find the physical effect that the model of a log lacks", add_trace, trace_command,
     "Writes trace.json, report.html, dqw_model_config.h and, where the log is not mechanical, dqw_q15_config.h for "
     "port_q15/ into DIR."},
    {"compare", "learn a log in float and in fixed point, fit it, and say how far they are apart", add_compare,
     compare_command,
     "Differences are 100 (first - second) / second. One LSB of a parameter is 1/32768 of the unit that the full "
     "scales make of it:\nR V/I, L V T/I, psi V T; J M T/W, B M/W; full scales V, I, torque M, speed W, sampling "
     "period T. An effect's parameter is named EFFECT.PARAMETER. Writes compare.html into DIR.\nExit code 4: a "
     "parameter asked for is not identifiable by all three. Of two maps compare.html has both, and where they differ."},
    {"monitor", "watch a log for changes of the machine, and name the fault", add_monitor, monitor_command,
     "Writes monitor.html into DIR, with --arith q15 dqw_q15_monitor.h as well. Exit code 0 with and without events."},
    {"columns", "say what is read of a log, column by column, and what is missing: the first thing to run", add_columns,
     columns_command, ""},
    {"formats", "list the formats of logs that are read", add_common, formats_command, ""},
    {"demo", "simulate a servo, learn it, fit it, and compare both with the truth", add_demo, demo_command,
     "Writes DIR/servo.csv, DIR/servo.toml and DIR/demo.json."},
};

/// Pages and completions of this very parser; what they tell to end parsing, as help does.
void add_installed(CLI::App& app)
{
    const auto pages = [&app] {
        std::map<std::string, std::vector<std::string>> known;
        for (std::size_t i = 0; i < dqw_sim_scenario_count(); ++i)
            known["SCENARIO"].push_back(dqw_sim_scenario_at(i)->name);
        return pages_of(app, known);
    };
    app.add_option_function<std::string>(
           "--completion",
           [pages](const std::string& shell) {
               print(completion_for(shell, pages()));
               throw CLI::Success();
           },
           "print the completion of this command line for a shell")
        ->check(CLI::IsMember(completed_shells()))
        ->type_name("SHELL");
    app.add_option_function<std::string>(
           "--manual",
           [pages](const std::string& dir) {
               write_manual(pages(), dir);
               throw CLI::Success();
           },
           "write a man page for this and for each subcommand into DIR")
        ->type_name("DIR");
}

/// False where help, the version or the like was asked for, and printed.
bool parse(CLI::App& app, int argc, char** argv)
{
    try {
        app.parse(argc, argv);
        return true;
    } catch (const CLI::CallForHelp&) {
        const auto chosen = app.get_subcommands();
        print(chosen.empty() ? app.help() : chosen.front()->help());
    } catch (const CLI::CallForVersion&) {
        print(version_text());
    } catch (const CLI::Success&) {
    } catch (const CLI::ParseError& error) {
        throw UsageError(std::string(error.what()) + "; see dqwatch --help");
    }
    return false;
}

}  // namespace

int run_command_line(int argc, char** argv)
{
    CLI::App app("dqwatch learns the parameters of a permanent-magnet motor, and checks them against a reference fit.",
                 "dqwatch");
    app.set_version_flag("--version", std::string(), "say which version this is, and what it was built with");
    add_installed(app);
    app.require_subcommand(1);
    Options options;
    for (const Command& c : commands) {
        CLI::App* command = app.add_subcommand(c.name, c.about);
        c.add(*command, options);
        command->footer(c.footer);
    }
    // The parser would only say that a subcommand is missing.
    const std::string first = argc > 1 ? argv[1] : "-";
    const auto is_first = [&](const Command& c) { return c.name == first; };
    if (first == "live" || first == "fleet")
        throw UsageError(first + " is the Python package's: pip install './python[" + first +
                         "]' puts a dqwatch that has it on the path");
    if (first[0] != '-' && std::none_of(std::begin(commands), std::end(commands), is_first))
        throw UsageError("no subcommand " + shown(first) + "; see dqwatch --help");
    app.footer("Exit codes: 0 done; 1 anything else; 2 wrong usage; 3 input unreadable or invalid; 4 a parameter asked "
               "for is not identifiable.");
    if (!parse(app, argc, argv)) return exit_done;
    for (const Command& c : commands)
        if (app.got_subcommand(c.name)) return c.run(options);
    return exit_usage;
}

}  // namespace dqw
