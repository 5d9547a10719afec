// The middle value.
#ifndef DQW_REF_LOG_MEDIAN_HPP
#define DQW_REF_LOG_MEDIAN_HPP

#include <algorithm>
#include <cstddef>
#include <vector>

namespace dqw {

/// Of an even number the upper of the two in the middle; 0 of none.
inline double median(std::vector<double> x)
{
    if (x.empty()) return 0.0;
    const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
    std::nth_element(x.begin(), middle, x.end());
    return *middle;
}

}  // namespace dqw
#endif
