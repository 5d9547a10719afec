#include "app/cmd/command.hpp"

#include <algorithm>

#include "app/base/effect_names.hpp"
#include "app/base/quantity.hpp"
#include "app/base/text.hpp"

namespace dqw {

void add_common(CLI::App& command, CommonOptions& options)
{
    command.add_flag("--json", options.json, "print one JSON object on stdout and nothing else");
    command
        .add_option_function<std::string>(
            "--out", [&options](const std::string& dir) { options.out_dir = dir, options.out_given = true; },
            "folder for what is written (default .)")
        ->type_name("DIR");
    command
        .add_option_function<int>(
            "--pole-pairs", [&options](int n) { options.pole_pairs = n; }, "number of pole pairs")
        ->check(CLI::Range(1, 1000))
        ->type_name("N");
    command.add_option("--machine", options.machine_file, "machine file instead of LOG.toml")->type_name("FILE");
}

void add_parameters(CLI::App& command, CommonOptions& options)
{
    command.add_option("--parameters", options.parameters, "what to estimate, by commas: " + list(known_parameters()))
        ->delimiter(',')
        ->take_all()
        ->allow_extra_args(false)
        ->check(CLI::IsMember(known_parameters()))
        ->type_name("LIST");
}

void add_effects(CLI::App& command, EffectOptions& options)
{
    command
        .add_option("--effect", options.names, "effect to estimate as well, repeatable: " + list(effect_names(), 99))
        ->take_all()
        ->allow_extra_args(false)
        ->check(CLI::IsMember(effect_names()))
        ->type_name("NAME");
    command.add_option("--config", options.config_file, "effects that a trace found, with their start values")
        ->type_name("trace.json");
}

}  // namespace dqw
