#include "app/read/spikes.hpp"

#include <algorithm>
#include <cmath>

namespace dqw {
namespace {

constexpr std::size_t kFewest = 1000, kTogether = 2;
constexpr double kFarBeyond = 10.0;

}  // namespace

std::vector<std::size_t> spikes_of(const std::vector<double>& values)
{
    std::vector<std::size_t> rows;
    if (values.size() < kFewest) return rows;
    double sum = 0.0, most = 0.0;
    for (const double x : values) sum += std::abs(x), most = std::max(most, std::abs(x));
    // Mostly it ends here, without a copy.
    if (!(most > kFarBeyond * sum / static_cast<double>(values.size()))) return rows;
    std::vector<double> sizes(values.size());
    std::transform(values.begin(), values.end(), sizes.begin(), [](double x) { return std::abs(x); });
    const auto below = sizes.begin() + static_cast<std::ptrdiff_t>(values.size() - 1 - values.size() / 1000);
    std::nth_element(sizes.begin(), below, sizes.end());
    const double usual = *below;
    if (!(usual > 0.0)) return rows;
    for (std::size_t k = 0; k < values.size();) {
        std::size_t end = k;
        while (end < values.size() && std::abs(values[end]) > kFarBeyond * usual) ++end;
        for (std::size_t j = k; j < end && end - k <= kTogether; ++j) rows.push_back(j);
        k = end + 1;
    }
    return rows;
}

}  // namespace dqw
