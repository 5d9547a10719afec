#include "app/read/spikes.hpp"

#include <algorithm>
#include <cmath>

namespace dqw {
namespace {

constexpr std::size_t kFewest = 1000, kTogether = 2;
constexpr double kFarBeyond = 10.0;

/// What 99.9 % of them stay below.
double usual_size(const std::vector<double>& values)
{
    std::vector<double> sizes(values.size());
    std::transform(values.begin(), values.end(), sizes.begin(), [](double x) { return std::abs(x); });
    const auto below = sizes.begin() + static_cast<std::ptrdiff_t>(values.size() - 1 - values.size() / 1000);
    std::nth_element(sizes.begin(), below, sizes.end());
    return *below;
}

}  // namespace

std::vector<std::size_t> spikes_of(const std::vector<double>& values,
                                   const std::vector<const std::vector<double>*>& behind)
{
    std::vector<std::size_t> rows;
    if (values.size() < kFewest) return rows;
    double sum = 0.0, most = 0.0;
    for (const double x : values) sum += std::abs(x), most = std::max(most, std::abs(x));
    // Mostly it ends here, without a copy.
    if (!(most > kFarBeyond * sum / static_cast<double>(values.size()))) return rows;
    const double usual = usual_size(values);
    if (!(usual > 0.0)) return rows;
    std::vector<double> usual_behind;
    for (const auto* v : behind) usual_behind.push_back(usual_size(*v));
    const auto made = [&](std::size_t from, std::size_t to) {
        for (std::size_t n = 0; n < behind.size(); ++n)
            for (std::size_t k = from > 0 ? from - 1 : 0; k <= to && k < behind[n]->size(); ++k)
                if (std::abs((*behind[n])[k]) > usual_behind[n]) return true;
        return false;
    };
    for (std::size_t k = 0; k < values.size();) {
        std::size_t end = k;
        while (end < values.size() && std::abs(values[end]) > kFarBeyond * usual) ++end;
        if (end > k && end - k <= kTogether && !made(k, end))
            for (std::size_t j = k; j < end; ++j) rows.push_back(j);
        k = end + 1;
    }
    return rows;
}

}  // namespace dqw
