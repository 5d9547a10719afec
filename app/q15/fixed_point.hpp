// Between SI and the whole numbers of port_q15/.
#ifndef DQW_APP_Q15_FIXED_POINT_HPP
#define DQW_APP_Q15_FIXED_POINT_HPP

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <stdexcept>

#include "dqw_estimator_q15.h"
#include "dqw_sample.h"
#include "dqw_scale.h"

namespace dqw {

/// Full scales leave so much room above the largest signal.
constexpr double kRoom = 1.01;

/// A full scale for a signal, in parts of its unit: 1e3 for milli. Throws std::invalid_argument where that is above
/// `most`.
inline std::uint32_t full_scale(double largest, double parts, const char* what, std::uint32_t most)
{
    const double full = std::ceil(parts * kRoom * largest);
    if (!(full <= most))
        throw std::invalid_argument(
            fmt::format("{} up to {:.4g} is more than fixed point takes: {}", what, largest, most / parts));
    return static_cast<std::uint32_t>(std::max(full, 1.0));
}

/// A nominal value or shape as a whole number, bounded.
inline std::uint32_t whole(double x) { return static_cast<std::uint32_t>(std::clamp(std::round(x), 0.0, 4e9)); }

inline std::int16_t q15(double value, double full)
{
    return static_cast<std::int16_t>(std::clamp(std::floor(value / full * 32768.0 + 0.5), -32768.0, 32767.0));
}

/// Full scales in SI, and the period.
struct FullScales {
    double v_V, i_A, w_rad_s, dt_s;
};
inline FullScales full_scales(const dqw_scale& s)
{
    return {1e-3 * s.v_full_mV, 1e-3 * s.i_full_mA, 1e-3 * s.w_full_mrad_s, 1e-9 * s.dt_ns};
}

/// An angle as 65536 parts of a turn.
inline std::uint16_t turn_of(double angle_rad)
{
    return static_cast<std::uint16_t>(std::llround(angle_rad / 6.283185307179586 * 65536.0) & 65535);
}

inline std::int16_t hundredths(float temp_C)
{
    return std::isfinite(temp_C) ? static_cast<std::int16_t>(
                                       std::clamp(std::round(100.0 * static_cast<double>(temp_C)), -32767.0, 32767.0))
                                 : INT16_MIN;
}

/// False where a channel is no number: sixteen bits have none.
inline bool fixed(const dqw_sample& s, const FullScales& full, dqw_sample_q15& x)
{
    x = {};
    const double v_d = static_cast<double>(s.v_d_V), v_q = static_cast<double>(s.v_q_V),
                 i_d = static_cast<double>(s.i_d_A), i_q = static_cast<double>(s.i_q_A),
                 w_m = static_cast<double>(s.w_m_rad_s);
    if (!std::isfinite(v_d + v_q + i_d + i_q + w_m)) return false;
    x.v_d_q15 = q15(v_d, full.v_V);
    x.v_q_q15 = q15(v_q, full.v_V);
    x.i_d_q15 = q15(i_d, full.i_A);
    x.i_q_q15 = q15(i_q, full.i_A);
    x.w_m_q15 = q15(w_m, full.w_rad_s);
    x.cosine_q15 = q15(static_cast<double>(s.cosine), 1.0);
    x.sine_q15 = q15(static_cast<double>(s.sine), 1.0);
    x.temp_winding_cC = hundredths(s.temp_winding_C);
    x.temp_magnet_cC = hundredths(s.temp_magnet_C);
    x.resting = s.resting;
    return true;
}

/// What 1 of dqw_estimator_unit_q15() is: uOhm, nH, nH, nWb, uV, nWb, uV.
constexpr std::array kUnitQ15 = {1e-6, 1e-9, 1e-9, 1e-9, 1e-6, 1e-9, 1e-6};
static_assert(kUnitQ15.size() == DQW_PARAMETERS, "one for each");

/// What 1 of a parameter's reading is, SI.
inline double unit_q15(const dqw_estimator_q15_config& c, int parameter)
{
    return dqw_estimator_unit_q15(&c, static_cast<dqw_parameter>(parameter)) *
           kUnitQ15[static_cast<std::size_t>(parameter)];
}

inline double si(std::int64_t x_q40, double unit) { return static_cast<double>(x_q40) * 0x1p-40 * unit; }

}  // namespace dqw
#endif
