#include "app/format/unit.hpp"

#include <fmt/format.h>

#include <cmath>

namespace dqw {
namespace {

constexpr double pi = 3.14159265358979323846;

enum class Kind { time, voltage, current, speed, angle_e, angle_m, temperature, torque };
/// By what else the number is multiplied or divided.
enum class With { nothing, per_pole_pair, times_pole_pairs, times_v_dc };

struct Unit {
    Kind kind;
    const char* name;
    double factor;
    const char* text;  ///< of the factor
    double offset = 0.0;
    With with = With::nothing;
};

// The first of a kind is SI. An output shaft is said by " output" behind a speed, an angle of the shaft or a torque.
const Unit units[] = {
    {Kind::time, "s", 1, ""},
    {Kind::time, "ms", 1e-3, " · 0.001"},
    {Kind::time, "us", 1e-6, " · 10⁻⁶"},
    {Kind::time, "µs", 1e-6, " · 10⁻⁶"},
    {Kind::time, "ns", 1e-9, " · 10⁻⁹"},
    {Kind::time, "min", 60, " · 60"},
    {Kind::voltage, "V", 1, ""},
    {Kind::voltage, "mV", 1e-3, " · 0.001"},
    {Kind::voltage, "V RMS", 1.4142135623730951, " · √2"},
    {Kind::voltage, "V RMS line", 0.81649658092772603, " · √2/√3"},
    {Kind::voltage, "modulation", 0.57735026918962576, " · v_dc/√3", 0, With::times_v_dc},
    {Kind::voltage, "% of modulation", 0.0057735026918962576, " · v_dc/√3/100", 0, With::times_v_dc},
    {Kind::voltage, "v_dc", 1, " · v_dc", 0, With::times_v_dc},
    {Kind::voltage, "% of v_dc", 0.01, " · v_dc/100", 0, With::times_v_dc},
    {Kind::current, "A", 1, ""},
    {Kind::current, "mA", 1e-3, " · 0.001"},
    {Kind::current, "A RMS", 1.4142135623730951, " · √2"},
    {Kind::speed, "rad/s", 1, ""},
    {Kind::speed, "electrical rad/s", 1, "", 0, With::per_pole_pair},
    {Kind::speed, "rpm", pi / 30, " · 2π/60"},
    {Kind::speed, "erpm", pi / 30, " · 2π/60", 0, With::per_pole_pair},
    {Kind::speed, "turns/s", 2 * pi, " · 2π"},
    {Kind::speed, "Hz", 2 * pi, " · 2π", 0, With::per_pole_pair},
    {Kind::speed, "deg/s", pi / 180, " · π/180"},
    {Kind::angle_e, "rad", 1, ""},
    {Kind::angle_e, "deg", pi / 180, " · π/180"},
    {Kind::angle_e, "turns", 2 * pi, " · 2π"},
    {Kind::angle_e, "16-bit turns", 2 * pi / 65536, " · 2π/65536"},
    {Kind::angle_e, "mechanical rad", 1, "", 0, With::times_pole_pairs},
    {Kind::angle_e, "mechanical deg", pi / 180, " · π/180", 0, With::times_pole_pairs},
    {Kind::angle_e, "mechanical turns", 2 * pi, " · 2π", 0, With::times_pole_pairs},
    {Kind::angle_e, "mechanical 16-bit turns", 2 * pi / 65536, " · 2π/65536", 0, With::times_pole_pairs},
    {Kind::angle_m, "rad", 1, ""},
    {Kind::angle_m, "deg", pi / 180, " · π/180"},
    {Kind::angle_m, "turns", 2 * pi, " · 2π"},
    {Kind::angle_m, "16-bit turns", 2 * pi / 65536, " · 2π/65536"},
    {Kind::temperature, "C", 1, ""},
    {Kind::temperature, "°C", 1, ""},
    {Kind::temperature, "degC", 1, ""},
    {Kind::temperature, "K", 1, " − 273.15", -273.15},
    {Kind::temperature, "kelvin", 1, " − 273.15", -273.15},
    {Kind::torque, "Nm", 1, ""},
    {Kind::torque, "mNm", 1e-3, " · 0.001"},
};

constexpr std::string_view output = " output";

Kind kind_of(Column column)
{
    switch (column) {
    case col_t: return Kind::time;
    case col_v_d:
    case col_v_q:
    case col_v_dc: return Kind::voltage;
    case col_i_d:
    case col_i_q: return Kind::current;
    case col_w_m: return Kind::speed;
    case col_theta_e: return Kind::angle_e;
    case col_theta_m: return Kind::angle_m;
    case col_temp_winding:
    case col_temp_magnet: return Kind::temperature;
    default: return Kind::torque;
    }
}

bool has_output(Kind kind) { return kind == Kind::speed || kind == Kind::angle_m || kind == Kind::torque; }

bool behind_gear(Kind kind, std::string_view& unit)
{
    if (!has_output(kind) || unit.size() <= output.size() || unit.substr(unit.size() - output.size()) != output)
        return false;
    unit.remove_suffix(output.size());
    return true;
}

const Unit* find(Kind kind, std::string_view name)
{
    for (const Unit& unit : units)
        if (unit.kind == kind && name == unit.name) return &unit;
    return nullptr;
}

void need(std::vector<std::string>& needs, const char* what)
{
    for (const std::string& named : needs)
        if (named == what) return;
    needs.emplace_back(what);
}

}  // namespace

std::vector<std::string> unit_names(Column column)
{
    const Kind kind = kind_of(column);
    std::vector<std::string> names;
    for (const Unit& unit : units)
        if (unit.kind == kind) names.emplace_back(unit.name);
    if (has_output(kind)) names.emplace_back("each with \" output\" behind a gear");
    return names;
}

bool is_unit(Column column, std::string_view unit)
{
    behind_gear(kind_of(column), unit);
    return find(kind_of(column), unit);
}

Expression in_si(Column column, const Expression& x, std::string_view name, const Given& given,
                 const std::optional<Expression>& v_dc, std::vector<std::string>& needs)
{
    const Kind kind = kind_of(column);
    const bool geared = behind_gear(kind, name);
    const Unit* unit = find(kind, name);
    if (!unit) return x;
    Expression si = scaled(x, unit->factor, unit->text, unit->offset);
    const auto poles = [&](bool times) {
        if (!given.pole_pairs) return need(needs, "pole pairs");
        const double p = *given.pole_pairs;
        si = scaled(si, times ? p : 1 / p, fmt::format("{}{:g}", times ? " · " : "/", p));
    };
    switch (unit->with) {
    case With::nothing: break;
    case With::per_pole_pair: poles(false); break;
    case With::times_pole_pairs: poles(true); break;
    case With::times_v_dc:
        if (v_dc)
            si = combined(
                {si, *v_dc}, [](const double* v) { return v[0] * v[1]; }, si.text);
        else
            need(needs, "v_dc");
        break;
    }
    if (geared) {
        if (!given.gear)
            need(needs, "gear");
        else
            si = scaled(si, kind == Kind::torque ? 1 / *given.gear : *given.gear,
                        fmt::format("{}{:g}", kind == Kind::torque ? "/" : " · ", *given.gear));
    }
    return si;
}

}  // namespace dqw
