// Between SI and the whole numbers of port_q15/.
#ifndef DQW_APP_FIXED_POINT_HPP
#define DQW_APP_FIXED_POINT_HPP

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>

namespace dqw {

/// Full scales leave so much room above the largest signal.
constexpr double kRoom = 1.01;

/// A full scale for a signal, in parts of its unit: 1e3 for milli. Throws std::invalid_argument where that is above `most`.
inline std::uint32_t full_scale(double largest, double parts, const char* what, std::uint32_t most)
{
    const double full = std::ceil(parts * kRoom * largest);
    if (!(full <= most)) throw std::invalid_argument(fmt::format("{} up to {:.4g} is more than fixed point takes: {}", what, largest, most / parts));
    return static_cast<std::uint32_t>(std::max(full, 1.0));
}

/// A nominal value or shape as a whole number, bounded.
inline std::uint32_t whole(double x) { return static_cast<std::uint32_t>(std::clamp(std::round(x), 0.0, 4e9)); }

inline std::int16_t q15(double value, double full)
{
    return static_cast<std::int16_t>(std::clamp(std::floor(value / full * 32768.0 + 0.5), -32768.0, 32767.0));
}

inline double si(std::int64_t x_q40, double unit) { return static_cast<double>(x_q40) * 0x1p-40 * unit; }

}  // namespace dqw
#endif
