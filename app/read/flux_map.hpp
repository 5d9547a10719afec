// A flux map as a file.
#ifndef DQW_APP_READ_FLUX_MAP_HPP
#define DQW_APP_READ_FLUX_MAP_HPP

#include <string>

#include "ref/effect/plane.hpp"

namespace dqw {

/// Reads i_d_A,i_q_A,psi_d_Wb,psi_q_Wb and, where they are there, sd_d_Wb,sd_q_Wb,seen and, of its first row,
/// short_S,sd_short_S,short_axis_rad, in any order of columns and rows. Without deviations they are 0, without `seen`
/// all is. Throws InputError: a column or number that is missing or
/// not finite, no full grid, less than 3 by 3 points, zero current outside, a flux that does not rise with its own
/// current.
FluxMap read_flux_map(const std::string& path);

}  // namespace dqw
#endif
