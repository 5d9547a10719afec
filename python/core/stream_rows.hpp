// Rows of Python's, one or a block, as samples of lib/.
#ifndef DQW_PYTHON_STREAM_ROWS_HPP
#define DQW_PYTHON_STREAM_ROWS_HPP

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "app/read/row_source.hpp"
#include "dqw_sample.h"

namespace dqw::python {

/// One row; NaN: not said.
struct Row {
    double t_s, v_d_V, v_q_V, i_d_A, i_q_A, w_m_rad_s, theta_e_rad, temp_winding_C, temp_magnet_C;
};
constexpr std::size_t row_fields = 9;
extern const std::array<const char*, row_fields> row_names;

/// Where each field of a Row is in a table. Throws std::invalid_argument where one that is needed is not there or holds
/// no numbers.
class RowColumns {
public:
    explicit RowColumns(const RowSource& table);
    Row of(const double* values) const;

private:
    std::array<std::optional<std::size_t>, row_fields> at_;
};

/// A sample; an angle that is needed and is none makes it one that is refused and counted.
dqw_sample sample_of(const Row& row, bool angle);

/// The time of rows in a stream: as told, else a period after the last.
class Times {
public:
    Times(double period_s) : period_s_(period_s) {}
    /// Periods that are missing before this row; `row.t_s` becomes its time. Throws std::invalid_argument where time
    /// goes back.
    double take(Row& row);
    double last_s() const { return last_s_; }
    std::uint64_t rows() const { return rows_; }
    void set(double last_s, std::uint64_t rows) { last_s_ = last_s, rows_ = rows; }

private:
    double period_s_, last_s_ = 0.0;
    std::uint64_t rows_ = 0;
};

}  // namespace dqw::python
#endif
