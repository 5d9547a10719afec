// The columns of the log format, and what each regime needs of them.
#ifndef DQW_APP_BASE_COLUMNS_HPP
#define DQW_APP_BASE_COLUMNS_HPP

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "ref/log/log.hpp"

namespace dqw {

enum Column : std::size_t {
    col_t,
    col_v_d,
    col_v_q,
    col_i_d,
    col_i_q,
    col_w_m,
    col_theta_e,
    col_theta_m,
    col_v_dc,
    col_temp_winding,
    col_temp_magnet,
    col_torque,
    col_torque_cmd,
    column_count
};

struct ColumnInfo {
    Column id;
    const char* name;
    std::vector<double> Log::*values;
};

/// Name and place of each column, indexed by Column.
extern const std::array<ColumnInfo, column_count> columns;

/// The column called `name`.
std::optional<Column> column_named(std::string_view name);

/// Which columns a file has.
using ColumnSet = std::array<bool, column_count>;

/// The regime that the columns alone tell: mechanical without voltages, standstill without speed, polled where v_d or
/// i_d are missing, which no other can do without.
/// Nothing where the rows must decide, or where columns are missing.
std::optional<Regime> regime_of_columns(const ColumnSet& has);

/// The required columns that `has` lacks; a mechanical log's torque is one of three, said in one item.
std::vector<std::string> missing_columns(Regime regime, const ColumnSet& has, bool torque_constant_known);

/// The columns that a plain fit of this regime can use; the rest is for tracing.
ColumnSet columns_of_plain_model(Regime regime);

const char* name_of(Regime regime);
std::optional<Regime> regime_named(std::string_view name);

}  // namespace dqw
#endif
