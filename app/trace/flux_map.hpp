// A flux map as files, and what it says of the least current, in words.
#ifndef DQW_APP_TRACE_FLUX_MAP_HPP
#define DQW_APP_TRACE_FLUX_MAP_HPP

#include <string>

#include "ref/trace/trace.hpp"

namespace dqw {

/// i_d_A,i_q_A,psi_d_Wb,psi_q_Wb,sd_d_Wb,sd_q_Wb,seen: row-major in i_d, as the simulator reads it. Beside shorted
/// turns three columns more, alike in every row: short_S,sd_short_S,short_axis_rad.
std::string flux_map_csv(const FluxMap& map);

/// torque_Nm,i_d_A,i_q_A,i_A: as far as the least current lies where the log was.
std::string mtpa_csv(const FluxMap& map, double pole_pairs);

/// What is written, and what the largest torque gains against i_d = 0; or which currents a log lacks. Empty where
/// nothing saturates.
std::string flux_map_text(const TraceResult& trace);

/// 0 where they are not known.
double pole_pairs_of(const TraceResult& trace);

}  // namespace dqw
#endif
