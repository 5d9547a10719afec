// Which legs of the inverter switch, where a log does not say it.
#ifndef DQW_APP_LEARN_MODULATION_HPP
#define DQW_APP_LEARN_MODULATION_HPP

#include <vector>

#include "dqw_estimator.h"
#include "ref/effect/found.hpp"
#include "ref/log/log.hpp"

namespace dqw {

/// As the log says, or a trace found; where neither says anything and dead time is learned, the one that leaves the
/// least residual over the log's first ten seconds, if that is clear; else all legs switch. `effects` and `modulation`
/// of the configuration are not looked at.
dqw_modulation modulation_of(const Log& log, const dqw_estimator_config& config, const std::vector<TraceInput>& inputs);

}  // namespace dqw
#endif
