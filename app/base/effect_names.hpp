// The effects' names in logs, traces and on the command line, and what they are in lib/.
#ifndef DQW_APP_BASE_EFFECT_NAMES_HPP
#define DQW_APP_BASE_EFFECT_NAMES_HPP

#include <optional>
#include <string>
#include <vector>

#include "dqw_effect.h"
#include "ref/effect/effect.hpp"

namespace dqw {

/// All names, electrical ones first.
const std::vector<std::string>& effect_names();

std::optional<dqw_effect_name> effect_named(const std::string& name);

/// "DQW_EFFECT_DEAD_TIME".
std::string enumerator_of(const std::string& name);

/// What a monitor watches by inputs of its own.
bool monitor_watches(const std::string& name);

/// True where an effect goes with the electrical angle.
bool needs_angle(const std::string& name);

/// True where a shape that was not given needs R, L_d, L_q or psi.
bool shape_needs_machine(const std::string& name);

/// Times the electrical angle with which an effect comes and goes on the axes; 0: not with the angle.
double angle_order(const TraceInput& in);

/// Its row of the catalogue.
const Effect& row_of(dqw_effect_name name);

/// For lib/: shape and start values in single precision, what is missing 0; a table stays the input's. Throws
/// std::invalid_argument for an unknown name.
dqw_effect_config effect_config(const TraceInput& input);

}  // namespace dqw
#endif
