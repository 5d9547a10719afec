#include "app/page/plot.hpp"

#include <algorithm>
#include <cmath>

#include "app/base/quantity.hpp"

namespace dqw {

std::array<double, 2> range_around(double low, double high, double least)
{
    if (!(high >= low)) return {0.0, 0.0};
    const double missing = std::max(0.0, least - (high - low)), pad = 0.08 * std::max(high - low, least);
    return {low - 0.5 * missing - pad, high + 0.5 * missing + pad};
}

std::string scale(Columns& columns, std::array<double, 2>& range, const char* parameter)
{
    const Quantity q = quantity(parameter, std::max(std::fabs(range[0]), std::fabs(range[1])), 0.0);
    const double factor = factor_of(q, parameter);
    for (std::size_t k = 1; k < columns.size(); ++k)
        for (double& x : columns[k]) x *= factor;
    for (double& x : range) x *= factor;
    return q.unit.empty() ? "1" : q.unit;
}

}  // namespace dqw
