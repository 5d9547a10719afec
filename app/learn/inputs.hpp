// Which effects the learners are given: from the command line by name alone, or from a trace with shapes and weights.
#ifndef DQW_APP_LEARN_INPUTS_HPP
#define DQW_APP_LEARN_INPUTS_HPP

#include <string>
#include <vector>

#include "ref/effect/found.hpp"
#include "ref/log/log.hpp"
#include "ref/log/residual.hpp"

namespace dqw {

/// What a trace.json says to the learners.
struct LearnConfig {
    std::vector<TraceInput> inputs;
    Machine start;  ///< its parameters after tracing
};

/// Reads `inputs` and `after` of a trace. Throws InputError: unreadable, no JSON, not a trace, an unknown effect.
LearnConfig read_learn_config(const std::string& path);
/// The same of a text; `path` stands for its file.
LearnConfig learn_config_of(const std::string& path, const std::string& text);

/// Adds those named that it lacks.
void add_effects(LearnConfig& config, const std::vector<std::string>& names);

/// Adds the machine file's flux map, over the logs' currents. Throws InputError where the file is no map, and
/// std::invalid_argument beside another effect of the same kind.
void add_flux_map(LearnConfig& config, const std::vector<Log>& logs);

/// A note where the magnet is not that of the machine file's flux map.
void note_flux_map(const std::vector<Log>& logs, Result& result);

/// Their names, each once; a flux map's are those of what it stands for.
std::vector<std::string> effects_of(const LearnConfig& config);

/// The inputs with every shape filled in that is missing: widths of 2 % of the largest current or speed, the largest
/// current as unit of polynomials, order 6, 25 degC, a heating state where there is no thermometer; R, L_d, L_q, psi
/// from `machine`.
/// Throws std::invalid_argument for an effect that is not of these logs' regime, or needs an angle that they lack.
std::vector<TraceInput> completed(std::vector<TraceInput> inputs, const std::vector<Log>& logs,
                                  const PlainModel& machine);

/// True where a shape that was not given needs R, L_d, L_q or psi.
bool needs_machine(const std::vector<TraceInput>& inputs);

}  // namespace dqw
#endif
