// The voltage equations by least squares of columns as they stand: enough to judge units and signs by.
#ifndef DQW_APP_READ_VOLTAGE_FIT_HPP
#define DQW_APP_READ_VOLTAGE_FIT_HPP

#include <array>
#include <cmath>
#include <cstddef>

#include "app/base/columns.hpp"
#include "ref/log/log.hpp"

namespace dqw {

/// The rows to judge by: a pointer per column that is there.
struct SpeedProbe {
    std::array<const double*, column_count> column = {};
    std::size_t rows = 0;
    double median_dt_s = 0.0;
    Regime regime = Regime::dynamic;
    bool v_q_is_size = false;  ///< of the voltage's vector

    /// Without v_d or i_d: i_d is then zero, and v_q alone tells.
    bool is_half() const { return !column[col_v_d] || !column[col_i_d]; }
};

/// Of a column that is not there 0.
double rms(const double* x, std::size_t rows);

/// Does a gap in time stand before row k?
bool gap_before(const SpeedProbe& p, std::size_t k);

enum Unknown : std::size_t { R, Ld, Lq, pLd, pLq, ppsi, unknown_count };

struct VoltageFit {
    std::array<double, unknown_count> value, sd;
    std::array<double, unknown_count> share;  ///< of each term in the voltage, RMS over RMS
    double left = 0.0;                        ///< of the voltage, 0 to 1
    std::size_t equations = 0;
    bool known(Unknown u) const { return sd[u] < 0.1 * std::fabs(value[u]) && value[u] > 0; }
    /// Does the term explain half as much as what is left, or more? Errors that rows have in common do not.
    bool certain(Unknown u) const { return std::pow(value[u] / sd[u], 2) > 0.5 * static_cast<double>(equations); }
};

/// Signs of the columns, and whether d and q are exchanged, before the fit.
struct Axes {
    double v_d = 1, v_q = 1, i_d = 1, i_q = 1;
    bool exchanged = false;
};

/// With w as logged, over blocks of 20 rows (dynamic) or row by row, of `most_rows` at most. Wants v, i, w; of half a
/// log v_q, i_q, w, with its signs of v_q and i_q alone.
VoltageFit fit_voltages(const SpeedProbe& p, const Axes& axes = {}, std::size_t most_rows = 1000000);

}  // namespace dqw
#endif
