#include "app/page/thin.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>

namespace dqw {
namespace {

constexpr double nothing = std::numeric_limits<double>::quiet_NaN();

std::size_t rows_of(const Columns& columns) { return columns.empty() ? 0 : columns[0].size(); }

/// Places of the least and the greatest value in [begin, end), in their order; `end` where all are NaN.
void places(const std::vector<double>& column, std::size_t begin, std::size_t end, std::size_t& first,
            std::size_t& second)
{
    std::size_t low = end, high = end;
    for (std::size_t k = begin; k < end; ++k) {
        if (std::isnan(column[k])) continue;
        if (low == end || column[k] < column[low]) low = k;
        if (high == end || column[k] > column[high]) high = k;
    }
    first = std::min(low, high), second = std::max(low, high);
}

}  // namespace

Columns extremes(const Columns& columns, std::size_t most)
{
    const std::size_t n = rows_of(columns), buckets = std::max<std::size_t>(1, most / 2);
    if (n <= most) return columns;
    Columns out(columns.size());
    for (std::size_t b = 0; b < buckets; ++b) {
        const std::size_t begin = b * n / buckets, end = (b + 1) * n / buckets;
        if (begin == end) continue;
        out[0].push_back(columns[0][begin]);
        out[0].push_back(columns[0][begin + (end - begin) / 2]);
        for (std::size_t c = 1; c < columns.size(); ++c) {
            std::size_t first = end, second = end;
            places(columns[c], begin, end, first, second);
            out[c].push_back(first < end ? columns[c][first] : nothing);
            out[c].push_back(second < end ? columns[c][second] : nothing);
        }
    }
    return out;
}

Columns sampled(const Columns& columns, std::size_t most)
{
    const std::size_t n = rows_of(columns);
    std::vector<std::size_t> rows(n);
    std::iota(rows.begin(), rows.end(), std::size_t{0});
    if (n > most) {
        std::uint64_t state = 1;
        for (std::size_t k = 0; k < most; ++k) {
            state = state * 6364136223846793005u + 1442695040888963407u;
            std::swap(rows[k], rows[k + (state >> 33) % (n - k)]);
        }
        rows.resize(most);
    }
    std::sort(rows.begin(), rows.end(), [&](std::size_t a, std::size_t b) { return columns[0][a] < columns[0][b]; });
    Columns out(columns.size());
    for (std::size_t c = 0; c < columns.size(); ++c)
        for (const std::size_t row : rows) out[c].push_back(columns[c][row]);
    return out;
}

Columns bin_means(const Columns& columns, std::size_t bins, std::size_t least)
{
    Columns out(columns.size());
    const std::size_t n = rows_of(columns);
    if (n == 0) return out;
    const auto [low, high] = std::minmax_element(columns[0].begin(), columns[0].end());
    const double from = *low, width = (*high - from) / static_cast<double>(bins);
    if (!(width > 0)) return out;
    Columns sums(columns.size(), std::vector<double>(bins, 0.0));
    std::vector<std::size_t> counts(bins, 0);
    for (std::size_t k = 0; k < n; ++k) {
        const std::size_t bin = std::min(bins - 1, static_cast<std::size_t>((columns[0][k] - from) / width));
        ++counts[bin];
        for (std::size_t c = 0; c < columns.size(); ++c) sums[c][bin] += columns[c][k];
    }
    for (std::size_t bin = 0; bin < bins; ++bin)
        if (counts[bin] >= least)
            for (std::size_t c = 0; c < columns.size(); ++c)
                out[c].push_back(sums[c][bin] / static_cast<double>(counts[bin]));
    return out;
}

}  // namespace dqw
