// Rows of a polled log as exact averages of the voltage equations over the interval before each.
#ifndef DQW_REF_LOG_POLLED_HPP
#define DQW_REF_LOG_POLLED_HPP

#include <array>
#include <cstddef>
#include <vector>

#include "ref/log/log.hpp"

namespace dqw {

/// What a log has of the voltage: both axes, that of q alone, or the size of the vector.
enum class PolledVoltage { both, q, size };

/// (E150): one row with what its neighbours tell of the interval; d, q in this order. Speeds are the shaft's.
struct PolledRow {
    std::size_t row = 0;               ///< of the log
    std::array<double, 2> v_V, i_A;    ///< the means
    std::array<double, 2> di_A_s;      ///< what the current gains in the interval, over its length
    double w_rad_s = 0.0;              ///< mean speed
    std::array<double, 2> wi_A_rad_s;  ///< mean of speed times current
    double dw_rad_s2 = 0.0;            ///< its slope
    double dw_unseen_rad_s = 0.0;      ///< by how much the mean speed may be off: (E151)
    double di_unseen_A_s = 0.0, wi_unseen_A_rad_s = 0.0;
    double i_abs_A = 0.0;
    PolledVoltage voltage = PolledVoltage::both;  ///< else v_V[0] is zero
};

/// Rows that two unbroken neighbours on either side complete, currents and voltages taken from `lag` rows later than
/// the speed; settled points as they are. Rows that now and then repeat the last one's means, and those near the
/// largest voltage, are left out.
std::vector<PolledRow> polled_rows(const Log& log, int lag);

}  // namespace dqw
#endif
