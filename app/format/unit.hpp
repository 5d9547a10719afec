// Units by name: the factor and offset to SI, and what else must be known for it.
#ifndef DQW_APP_FORMAT_UNIT_HPP
#define DQW_APP_FORMAT_UNIT_HPP

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/base/columns.hpp"
#include "app/format/expression.hpp"

namespace dqw {

/// What no file says, or not every file.
struct Given {
    std::optional<double> pole_pairs, gear, v_dc_V, period_s;
};

/// The unit's names for a column of this kind, as they may be written: "rad/s, rpm, erpm, …".
std::vector<std::string> unit_names(Column column);

/// Is there a unit of this name for the column?
bool is_unit(Column column, std::string_view unit);

/// `x` in SI by (E133). What is needed and not given is added to `needs`, by name: pole pairs, gear, v_dc.
Expression in_si(Column column, const Expression& x, std::string_view unit, const Given& given,
                 const std::optional<Expression>& v_dc, std::vector<std::string>& needs);

}  // namespace dqw
#endif
