// What a log's columns cover.
#ifndef DQW_REF_EFFECT_RANGE_HPP
#define DQW_REF_EFFECT_RANGE_HPP

#include <algorithm>
#include <cmath>
#include <vector>

#include "ref/log/log.hpp"

namespace dqw {

/// 0 where the log lacks the column.
inline double at_row(const std::vector<double>& column, std::size_t k) { return column.empty() ? 0.0 : column[k]; }

struct Range {
    double least = HUGE_VAL, most = -HUGE_VAL, square = 0.0, sum = 0.0, n = 0.0;
    void add(double x) { least = std::min(least, x), most = std::max(most, x), square += x * x, sum += x, n += 1.0; }
    double span() const { return n > 0.0 ? most - least : 0.0; }
    double size() const { return n > 0.0 ? std::max(std::abs(least), std::abs(most)) : 0.0; }
    double sd() const { return n > 0.0 ? std::sqrt(std::max(square / n - sum * sum / n / n, 0.0)) : 0.0; }
};

inline Range range_of(const std::vector<Log>& logs, std::vector<double> Log::*column)
{
    Range r;
    for (const Log& log : logs)
        for (double x : log.*column) r.add(x);
    return r;
}

inline bool everywhere(const std::vector<Log>& logs, std::vector<double> Log::*column)
{
    return std::all_of(logs.begin(), logs.end(), [&](const Log& log) { return !(log.*column).empty(); });
}

}  // namespace dqw
#endif
