// Values with a standard deviation, in units with engineering prefixes.
#ifndef DQW_APP_BASE_QUANTITY_HPP
#define DQW_APP_BASE_QUANTITY_HPP

#include <string>
#include <vector>

namespace dqw {

/// A value in one prefix, rounded to two digits of its standard deviation: {"370.2", "1.9", "mΩ"}.
struct Quantity {
    std::string value, sd, unit;
};

/// `parameter` decides the unit, by its SI suffix; without one it has none. Rounded to `sd_digits` of
/// a finite sd; without one `digits` digits, sd empty.
Quantity quantity(const std::string& parameter, double value, double sd, int digits = 4, int sd_digits = 2);

/// The same in the prefix that `like` got.
Quantity quantity_like(const Quantity& like, const std::string& parameter, double value, double sd);

/// By what a value in SI is multiplied to be in the unit of `q`.
double factor_of(const Quantity& q, const std::string& parameter);

/// "370.2 ± 1.9 mΩ", "(333 ± 14)·10⁻⁶ kg m²".
std::string with_sd(const Quantity& q);

/// As `quantity`, in the prefix that `like` got: for a column of comparable numbers.
std::string number_like(const Quantity& like, const std::string& parameter, double value, int digits = 4);

/// Columns of a text table, padded to the widest cell by characters, not bytes (UTF-8). The first column is
/// left-aligned, the others right-aligned, two spaces between; the first row is the heading.
std::string table(const std::vector<std::vector<std::string>>& rows);

}  // namespace dqw
#endif
