#include "app/base/quantity.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

namespace dqw {
namespace {

/// How a unit is scaled. kg m² takes a power of ten: its prefix would stand before a square.
enum class Scale { prefix, power, none };

struct Unit {
    const char *suffix, *unit;
    Scale scale;
};

/// A name tells its unit by how it ends; longer ends before their own ends.
const Unit suffixes[] = {
    {"_kgm2", "kg m²", Scale::power},
    {"_Nm_A", "Nm/A", Scale::prefix},
    {"_Nms_rad", "Nms/rad", Scale::prefix},
    {"_s2_rad2", "s²/rad²", Scale::power},
    {"_percent", "%", Scale::none},
    {"_rad_s", "rad/s", Scale::none},
    {"_per_K", "/K", Scale::power},
    {"_ohm", "Ω", Scale::prefix},
    {"_rad", "rad", Scale::prefix},
    {"_Nm", "Nm", Scale::prefix},
    {"_Wb", "Wb", Scale::prefix},
    {"_Hz", "Hz", Scale::prefix},
    {"_H", "H", Scale::prefix},
    {"_V", "V", Scale::prefix},
    {"_A", "A", Scale::prefix},
    {"_S", "S", Scale::prefix},
    {"_C", "°C", Scale::none},
    {"_K", "K", Scale::none},
    {"_s", "s", Scale::prefix},
};

const Unit* unit_of(const std::string& parameter)
{
    for (const Unit& u : suffixes) {
        const std::string_view end = u.suffix;
        if (parameter.size() >= end.size() && parameter.compare(parameter.size() - end.size(), end.size(), end) == 0)
            return &u;
    }
    return nullptr;
}

struct Prefix {
    int exponent;
    const char *text, *power;
};
const Prefix prefixes[] = {{6, "M", "10⁶ "},   {3, "k", "10³ "},   {0, "", ""},         {-3, "m", "10⁻³ "},
                           {-6, "µ", "10⁻⁶ "}, {-9, "n", "10⁻⁹ "}, {-12, "p", "10⁻¹² "}};

std::string with_prefix(const Unit& unit, const Prefix& prefix)
{
    return std::string(unit.scale == Scale::prefix ? prefix.text : prefix.power) + unit.unit;
}

/// The power of 1000 that puts `size` between 1 and 1000, within the prefixes there are.
Prefix prefix_of(double size)
{
    for (const Prefix& p : prefixes)
        if (size >= 0.9995 * std::pow(10.0, p.exponent)) return p;
    return size > 0 ? prefixes[6] : prefixes[2];
}

/// Decimals that leave `digits` significant digits of `size`.
int decimals_of(double size, int digits)
{
    if (!(size > 0)) return digits - 1;
    return std::clamp(digits - 1 - static_cast<int>(std::clamp(std::floor(std::log10(size)), -99.0, 99.0)), 0, 9);
}

std::size_t width_of(std::string_view text)
{
    return static_cast<std::size_t>(
        std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xc0) != 0x80; }));
}

}  // namespace

double factor_of(const Quantity& q, const std::string& parameter)
{
    const Unit* unit = unit_of(parameter);
    if (!unit || unit->scale == Scale::none) return 1.0;
    for (const Prefix& p : prefixes)
        if (q.unit == with_prefix(*unit, p)) return std::pow(10.0, -p.exponent);
    return 1.0;
}

/// In the unit that `q` has.
static Quantity rounded(Quantity q, const std::string& parameter, double value, double sd, int digits, int sd_digits)
{
    const double factor = factor_of(q, parameter);
    const bool has_sd = std::isfinite(sd) && sd > 0;
    // At most seven digits of the value: a noise-free log's sd is absurdly small.
    const int most = decimals_of(std::fabs(value) * factor, 7);
    const int decimals = has_sd ? std::min(decimals_of(sd * factor, sd_digits), most)
                                : decimals_of(std::fabs(value) * factor, digits);
    const bool counts = parameter == "pole_pairs" || parameter == "order";
    q.value = counts && value == std::floor(value) ? fmt::format("{:.0f}", value)
                                                   : fmt::format("{:.{}f}", value * factor, decimals);
    if (has_sd)
        q.sd = sd * factor < 0.5 * std::pow(10.0, -decimals) ? fmt::format("{:.1e}", sd * factor)
                                                             : fmt::format("{:.{}f}", sd * factor, decimals);
    return q;
}

Quantity quantity(const std::string& parameter, double value, double sd, int digits, int sd_digits)
{
    const Unit* unit = unit_of(parameter);
    Quantity q;
    q.unit = unit ? unit->unit : "";
    if (unit && unit->scale != Scale::none && std::isfinite(value))
        q.unit = with_prefix(*unit, prefix_of(std::fabs(value)));
    return rounded(q, parameter, value, sd, digits, sd_digits);
}

Quantity quantity_like(const Quantity& like, const std::string& parameter, double value, double sd)
{
    return rounded({"", "", like.unit}, parameter, value, sd, 4, 2);
}

std::string with_sd(const Quantity& q)
{
    const std::string both = q.sd.empty() ? q.value : q.value + " ± " + q.sd;
    if (q.unit.compare(0, 2, "10") == 0) return (q.sd.empty() ? both : "(" + both + ")") + "·" + q.unit;
    return q.unit.empty() ? both : both + " " + q.unit;
}

std::string number_like(const Quantity& like, const std::string& parameter, double value, int digits)
{
    const double scaled = value * factor_of(like, parameter);
    return fmt::format("{:.{}f}", scaled, decimals_of(std::fabs(scaled), digits));
}

std::string table(const std::vector<std::vector<std::string>>& rows)
{
    std::vector<std::size_t> widths;
    for (const auto& row : rows)
        for (std::size_t c = 0; c < row.size(); ++c) {
            if (c == widths.size()) widths.push_back(0);
            widths[c] = std::max(widths[c], width_of(row[c]));
        }
    std::string out;
    for (const auto& row : rows) {
        std::string line;
        for (std::size_t c = 0; c < row.size(); ++c) {
            const std::string pad(widths[c] - width_of(row[c]), ' ');
            line += (c ? "  " : "") + (c ? pad + row[c] : row[c] + pad);
        }
        out += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
    }
    return out;
}

}  // namespace dqw
