// Physical sense: what disqualifies an explanation.
#ifndef DQW_REF_TRACE_SENSE_HPP
#define DQW_REF_TRACE_SENSE_HPP

#include "trace_setup.hpp"

namespace dqw {

/// Why a point cannot be: a parameter outside its allowed range, a machine that is none. Empty where it can.
std::string sense_of(const TraceSetup& setup, const Point& at);

}  // namespace dqw
#endif
