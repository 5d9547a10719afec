#include "stream_rows.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <stdexcept>

namespace dqw::python {
namespace {

constexpr double nothing = std::numeric_limits<double>::quiet_NaN();
constexpr double kTurn_rad = 6.283185307179586;
constexpr std::size_t first_needed = 1, last_needed = 5;
// Rows so far apart are neighbours still.
constexpr double kLate = 1.5;

}  // namespace

const std::array<const char*, row_fields> row_names = {
    "t_s", "v_d_V", "v_q_V", "i_d_A", "i_q_A", "w_m_rad_s", "theta_e_rad", "temp_winding_C", "temp_magnet_C"};

RowColumns::RowColumns(const RowSource& table)
{
    for (std::size_t f = 0; f < table.fields().size(); ++f)
        for (std::size_t k = 0; k < row_fields; ++k)
            if (table.fields()[f] == row_names[k]) {
                if (at_[k]) throw std::invalid_argument(fmt::format("column {} is there twice", row_names[k]));
                at_[k] = f;
            }
    for (std::size_t k = 0; k < row_fields; ++k) {
        if (!at_[k] && k >= first_needed && k <= last_needed)
            throw std::invalid_argument(fmt::format(
                "no column {}; expected v_d_V, v_q_V, i_d_A, i_q_A, w_m_rad_s, and t_s, theta_e_rad where there are",
                row_names[k]));
        const std::string type = at_[k] ? table.no_numbers(*at_[k]) : "";
        if (!type.empty())
            throw std::invalid_argument(
                fmt::format("column {} is of type {}; expected real numbers, such as float64", row_names[k], type));
    }
}

Row RowColumns::of(const double* values) const
{
    const auto value = [&](std::size_t k) { return at_[k] ? values[*at_[k]] : nothing; };
    return {value(0), value(1), value(2), value(3), value(4), value(5), value(6), value(7), value(8)};
}

dqw_sample sample_of(const Row& row, bool angle)
{
    const bool lost = angle && !std::isfinite(row.theta_e_rad);
    // Single precision keeps the digits of a small angle alone.
    const float theta = angle && !lost ? static_cast<float>(std::remainder(row.theta_e_rad, kTurn_rad)) : 0.0F;
    dqw_sample s = dqw_sample_from_dq(static_cast<float>(lost ? nothing : row.v_d_V), static_cast<float>(row.v_q_V),
                                      static_cast<float>(row.i_d_A), static_cast<float>(row.i_q_A),
                                      static_cast<float>(row.w_m_rad_s), theta);
    s.temp_winding_C = static_cast<float>(row.temp_winding_C);
    s.temp_magnet_C = static_cast<float>(std::isnan(row.temp_magnet_C) ? row.temp_winding_C : row.temp_magnet_C);
    return s;
}

double Times::take(Row& row)
{
    double missing = 0.0;
    if (std::isnan(row.t_s)) {
        row.t_s = rows_ == 0 ? last_s_ : last_s_ + period_s_;
    } else if (!std::isfinite(row.t_s) || (rows_ > 0 && !(row.t_s > last_s_))) {
        throw std::invalid_argument(
            fmt::format("t_s is {} after {}; expected time to increase from row to row", row.t_s, last_s_));
    } else if (rows_ > 0 && row.t_s - last_s_ > kLate * period_s_) {
        missing = std::round((row.t_s - last_s_) / period_s_) - 1.0;
    }
    last_s_ = row.t_s;
    ++rows_;
    return missing;
}

}  // namespace dqw::python
