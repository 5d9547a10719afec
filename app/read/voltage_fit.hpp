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
};

/// Does a gap in time stand before row k?
bool gap_before(const SpeedProbe& p, std::size_t k);

enum Unknown : std::size_t { R, Ld, Lq, pLd, pLq, ppsi, unknown_count };

struct VoltageFit {
    std::array<double, unknown_count> value, sd;
    std::array<double, unknown_count> share;  ///< of each term in the voltage, RMS over RMS
    double left = 0.0;                        ///< of the voltage, 0 to 1
    bool known(Unknown u) const { return sd[u] < 0.1 * std::fabs(value[u]) && value[u] > 0; }
};

/// Signs of the columns, and whether d and q are exchanged, before the fit.
struct Axes {
    double v_d = 1, v_q = 1, i_d = 1, i_q = 1;
    bool exchanged = false;
};

/// With w as logged, over blocks of 20 rows (dynamic) or row by row, of `most_rows` at most. Wants v, i, w.
VoltageFit fit_voltages(const SpeedProbe& p, const Axes& axes = {}, std::size_t most_rows = 1000000);

}  // namespace dqw
#endif
