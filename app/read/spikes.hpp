// Rows whose value no motor has: a channel's fault.
#ifndef DQW_APP_READ_SPIKES_HPP
#define DQW_APP_READ_SPIKES_HPP

#include <cstddef>
#include <vector>

namespace dqw {

/// Rows, alone or two together, that are beyond ten times what 99.9 % of the rows stay below; more in a row are a
/// motion. None of fewer than 1000 rows, and none beside a row of `behind`: voltages of which one is beyond its own
/// 99.9 % make such a current.
std::vector<std::size_t> spikes_of(const std::vector<double>& values,
                                   const std::vector<const std::vector<double>*>& behind);

}  // namespace dqw
#endif
