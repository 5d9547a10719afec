// Effects between SI and the whole numbers of port_q15/.
#ifndef DQW_APP_Q15_EFFECT_Q15_HPP
#define DQW_APP_Q15_EFFECT_Q15_HPP

#include "app/q15/fixed_point.hpp"
#include "dqw_effect_q15.h"
#include "ref/effect/found.hpp"

namespace dqw {

/// SI of what dqw_estimator_effect_q15 reads as 1.
double effect_unit(dqw_effect_name name, const FullScales& full);

/// For port_q15/: shape and start values rounded, as effect_config() has them for lib/. `weight_unit`: of the input's
/// weights; `row_s`: time between settled rows, 0 for others. Throws std::invalid_argument for what its integers do not
/// hold.
dqw_effect_q15_config effect_config_q15(const TraceInput& input, const FullScales& full, double weight_unit,
                                        double row_s);

}  // namespace dqw
#endif
