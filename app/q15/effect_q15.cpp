#include "app/q15/effect_q15.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "app/base/effect_names.hpp"

namespace dqw {
namespace {

constexpr double kStartMost = 0x1p60;

template <class Integer> Integer whole(double value, const TraceInput& input)
{
    const double rounded = std::round(value);
    if (!(rounded >= static_cast<double>(std::numeric_limits<Integer>::min()) &&
          rounded <= static_cast<double>(std::numeric_limits<Integer>::max())))
        throw std::invalid_argument(fmt::format("{}: its shape is more than fixed point takes", input.effect));
    return static_cast<Integer>(rounded);
}

}  // namespace

double effect_unit(dqw_effect_name name, const FullScales& full)
{
    switch (row_of(name).unit) {
    case Unit::V: return full.v_V;
    case Unit::A: return full.i_A;
    case Unit::Wb: return full.v_V * full.dt_s;
    case Unit::ohm: return full.v_V / full.i_A;
    case Unit::S: return full.i_A / full.v_V;
    case Unit::ohm_s2: return full.v_V * full.dt_s * full.dt_s / full.i_A;
    default: return 1.0;
    }
}

dqw_effect_q15_config effect_config_q15(const TraceInput& input, const FullScales& full, double weight_unit,
                                        double row_s)
{
    const dqw_effect_config f = effect_config(input);
    const auto shape = [&](std::size_t i, double unit) { return static_cast<double>(f.shape[i]) / unit; };
    dqw_effect_q15_config c{};
    c.effect = f.effect;
    switch (row_of(f.effect).shape) {
    case Shape::current_width:
    case Shape::current_unit: c.i_uA = whole<std::uint32_t>(shape(0, 1e-6), input); break;
    case Shape::heat:
        c.T_0_cC = whole<std::int16_t>(shape(0, 1e-2), input);
        // A time constant of nothing would be none.
        c.tau_us = f.shape[1] > 0.0F ? std::max<std::uint64_t>(whole<std::uint64_t>(shape(1, 1e-6), input), 1) : 0;
        c.i_uA = whole<std::uint32_t>(shape(2, 1e-6), input);
        c.row_us = whole<std::uint32_t>(row_s * 1e6, input);
        break;
    case Shape::R_L:
        c.R_uohm = whole<std::uint32_t>(shape(0, 1e-6), input);
        c.Ld_nH = whole<std::uint32_t>(shape(1, 1e-9), input);
        c.Lq_nH = whole<std::uint32_t>(shape(2, 1e-9), input);
        break;
    case Shape::L_psi:
        c.Ld_nH = whole<std::uint32_t>(shape(0, 1e-9), input);
        c.Lq_nH = whole<std::uint32_t>(shape(1, 1e-9), input);
        c.psi_nWb = whole<std::uint32_t>(shape(2, 1e-9), input);
        break;
    case Shape::flux_cells:
        c.psi_nWb = whole<std::uint32_t>(shape(0, 1e-9), input);
        c.cell_d_uA = whole<std::uint32_t>(shape(1, 1e-6), input);
        c.cell_q_uA = whole<std::uint32_t>(shape(2, 1e-6), input);
        c.map = f.map;
        break;
    case Shape::order: c.order = whole<std::uint16_t>(shape(0, 1.0), input); break;
    default: break;
    }
    const double unit = effect_unit(f.effect, full) * weight_unit;
    for (std::size_t i = 0; i < DQW_EFFECT_STARTS; ++i)
        c.start_q40[i] = static_cast<std::int64_t>(
            std::clamp(std::round(static_cast<double>(f.start[i]) / unit * 0x1p40), -kStartMost, kStartMost));
    return c;
}

}  // namespace dqw
