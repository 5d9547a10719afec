// Which legs of the inverter switch, where a log does not say it.
#ifndef DQW_APP_LEARN_MODULATION_HPP
#define DQW_APP_LEARN_MODULATION_HPP

#include <string>
#include <vector>

#include "dqw_estimator.h"
#include "ref/effect/found.hpp"
#include "ref/log/log.hpp"

namespace dqw {

/// As the log says, unless the leg that rests then loses as much as the others, which is as if all legs switched; or as
/// a trace found; where neither says anything and dead time is learned, the one that leaves the least residual over the
/// log's first ten seconds, if that is clear; else all legs switch. `effects` and `modulation` of the configuration are
/// not looked at.
dqw_modulation modulation_of(const Log& log, const dqw_estimator_config& config, const std::vector<TraceInput>& inputs);

/// A line where that was found, or is not as the log says; else empty.
std::string note_on_modulation(const Log& log, dqw_modulation taken);

}  // namespace dqw
#endif
