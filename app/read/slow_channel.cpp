#include "app/read/slow_channel.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace dqw {

std::string settle_slow_channel(Column column, std::vector<double>& values, bool doubted)
{
    // No winding that still runs is colder or hotter; open and shorted sensors read far beyond.
    constexpr double coldest_C = -60, hottest_C = 250;
    const auto first = std::find_if(values.begin(), values.end(), [](double v) { return !std::isnan(v); });
    if (first == values.end()) return "no value at all";
    std::fill(values.begin(), first, *first);
    if (!doubted || column == col_v_dc) return "";
    const auto [least, largest] = std::minmax_element(values.begin(), values.end());
    if (*least < coldest_C || *largest > hottest_C)
        return fmt::format("{:g} to {:g} degC, as of no sensor", *least, *largest);
    if (*least == 0.0 && *largest == 0.0) return "0 throughout, as of no sensor";
    return "";
}

}  // namespace dqw
