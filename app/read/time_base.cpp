#include "app/read/time_base.hpp"

#include <algorithm>

#include "app/base/columns.hpp"

namespace dqw {

TimeBase time_base_of(const std::vector<double>& t_s, Clock clock)
{
    TimeBase base;
    if (t_s.size() < 2) return base;
    const std::size_t intervals = t_s.size() - 1;
    const std::size_t stride = intervals / 100000 + 1;
    std::vector<double> some;
    some.reserve(intervals / stride + 1);
    for (std::size_t k = 0; k < intervals; k += stride) some.push_back(t_s[k + 1] - t_s[k]);
    const auto middle = some.begin() + static_cast<std::ptrdiff_t>(some.size() / 2);
    std::nth_element(some.begin(), middle, some.end());
    base.median_s = *middle;
    double longest_s = 1.5 * base.median_s;
    if (clock != Clock::own) {
        const auto usual = some.begin() + static_cast<std::ptrdiff_t>(some.size() * 9 / 10);
        std::nth_element(some.begin(), usual, some.end());
        if (clock == Clock::host || *usual > 1.05 * base.median_s) longest_s = 4.0 * *usual;
    }
    base.gap_s = longest_s;
    for (std::size_t k = 0; k < intervals; ++k) {
        const double dt_s = t_s[k + 1] - t_s[k];
        if (dt_s <= longest_s) continue;
        base.gaps.push_back(k + 1);
        base.longest_gap_s = std::max(base.longest_gap_s, dt_s);
    }
    base.regular = base.gaps.size() * 10 <= intervals;
    return base;
}

std::size_t turn_voltage_interval(Log& log)
{
    const std::size_t rows = log.rows();
    std::vector<std::size_t> first = log.segments;
    first.push_back(rows);
    std::size_t to = 0;
    std::vector<std::size_t> segments;
    for (std::size_t s = 0; s + 1 < first.size(); ++s) {
        if (first[s + 1] - first[s] < 2) continue;
        segments.push_back(to);
        for (std::size_t k = first[s]; k + 1 < first[s + 1]; ++k, ++to) {
            for (const ColumnInfo& column : columns) {
                auto& values = log.*(column.values);
                if (values.empty()) continue;
                const bool voltage = column.values == &Log::v_d_V || column.values == &Log::v_q_V;
                values[to] = values[voltage ? k + 1 : k];
            }
        }
    }
    for (const ColumnInfo& column : columns) {
        auto& values = log.*(column.values);
        if (!values.empty()) values.resize(to);
    }
    log.segments = segments.empty() ? std::vector<std::size_t>{0} : segments;
    return rows - to;
}

}  // namespace dqw
