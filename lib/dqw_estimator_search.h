// Which legs of the inverter switch, as a running estimator has found it.
#ifndef DQW_ESTIMATOR_SEARCH_H
#define DQW_ESTIMATOR_SEARCH_H

#include "dqw_estimator.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Which legs switch: as configured; or as found, where that is DQW_MODULATION_UNKNOWN.
///
/// Source   (E101) in docs/EQUATIONS.md
/// Returns  DQW_MODULATION_UNKNOWN while it is being found; without dead time to learn, then centred
/// Context  background
enum dqw_modulation dqw_estimator_modulation(const dqw_estimator *e);

#ifdef __cplusplus
}
#endif
#endif
