// Oscilloscopes: volts of channels whose meaning and scale the machine file must tell.
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>

#include "app/format/formats.hpp"

namespace dqw {
namespace {

/// What the machine file must tell, and the speed by the angle that it names.
void tell(Import& in)
{
    in.voltage = "as the machine file says; edges of the PWM are in it";
    in.notes.push_back("channels are volts of probes: say under [columns] which is what");
    in.speed_from_angle = true;
}

bool is_tektronix(const Head& head)
{
    if (!head.has("TIME") || !head.has("CH1")) return false;
    for (const std::string& line : head.comments)
        if (line.find("Model,") != std::string::npos || line.find("Sample Interval,") != std::string::npos) return true;
    return false;
}

void describe_tektronix(Import& in)
{
    in.take(col_t, "TIME", "s");
    // TIME has 7 digits, too few beyond some rows.
    for (const std::string& line : in.head.comments) {
        const std::string name = "Sample Interval,";
        const auto at = line.find(name);
        const double interval_s = at == line.npos ? 0 : std::strtod(line.c_str() + at + name.size(), nullptr);
        if (!(interval_s > 0) || !std::isfinite(interval_s)) continue;
        in.row_period_s = interval_s;
        in.columns[col_t].reset();
    }
    tell(in);
}

bool is_rigol(const Head& head) { return head.has("X") && head.has("Start") && head.has("Increment"); }

void describe_rigol(Import& in)
{
    in.short_rows = true;
    const std::size_t start = in.head.find("Start"), increment = in.head.find("Increment");
    tell(in);
    // The line below the header has units, and in the last two places the numbers.
    if (in.head.units.size() <= start || in.head.units.size() <= increment) return;
    const double t0_s = std::strtod(in.head.units[start].c_str(), nullptr);
    const double step_s = std::strtod(in.head.units[increment].c_str(), nullptr);
    if (!(step_s > 0) || !std::isfinite(step_s) || !std::isfinite(t0_s)) return;
    in.take_si(col_t, scaled(in.field("X"), step_s, fmt::format(" · {:g} s + {:g} s", step_s, t0_s), t0_s));
    in.columns[col_t]->unit = "rows";
}

}  // namespace

const Format tektronix = {"tektronix", "Tektronix oscilloscope", {"TIME", "CH1"}, is_tektronix, describe_tektronix};
const Format rigol = {"rigol", "Rigol oscilloscope", {"X", "Start", "Increment"}, is_rigol, describe_rigol};

}  // namespace dqw
