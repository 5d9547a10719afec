/// How an inverter's modulation is called in a machine file and in what the command writes.
#ifndef DQW_APP_BASE_MODULATION_HPP
#define DQW_APP_BASE_MODULATION_HPP

#include <optional>
#include <string>
#include <string_view>

#include "dqw_modulation_name.h"

namespace dqw {

/// "centred", "clamped_low", "clamped_high", "clamped_60"; nothing for another name.
std::optional<dqw_modulation> modulation_named(std::string_view name);

/// The name; of what the log does not say, "centred".
std::string modulation_text(dqw_modulation modulation);

}  // namespace dqw
#endif
