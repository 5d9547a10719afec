// Physical sense: what disqualifies an explanation.
#ifndef DQW_REF_TRACE_SENSE_HPP
#define DQW_REF_TRACE_SENSE_HPP

#include "ref/trace/setup.hpp"

namespace dqw {

/// Why a point cannot be: a parameter outside its allowed range, a machine that is none. Empty where it can.
std::string sense_of(const TraceSetup& setup, const Point& at);

/// Why a log cannot be what the format says, by the plain model that fits it best: signs, columns, units. Empty where
/// it can. `noise`: what is left is that alone.
std::string doubt_of(const TraceSetup& setup, const Point& plain, const TraceFit& fit, bool noise);

}  // namespace dqw
#endif
