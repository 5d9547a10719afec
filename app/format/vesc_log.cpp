// VESC logs of VESC Express and of VESC Tool's page Log Analysis: each field is key:name:unit:precision:relative:time.
#include <algorithm>

#include "app/format/formats.hpp"

namespace dqw {
namespace {

bool by_colons(const Head& head)
{
    return !head.fields.empty() && std::count(head.fields[0].begin(), head.fields[0].end(), ':') >= 5;
}

std::string part_of(const std::string& field, int part)
{
    std::size_t from = 0;
    for (; part > 0; --part) {
        const auto colon = field.find(':', from);
        if (colon == field.npos) return "";
        from = colon + 1;
    }
    return field.substr(from, field.find(':', from) - from);
}

/// The field whose key is this; else whose name is.
std::size_t find(const Head& head, std::string_view name)
{
    for (const int part : {0, 1})
        for (std::size_t f = 0; f < head.fields.size(); ++f)
            if (equal_ignoring_case(part_of(head.fields[f], part), name)) return f;
    return Head::none;
}

bool take(Import& in, Column column, std::initializer_list<const char*> keys, const char* unit)
{
    for (const char* key : keys)
        if (in.take(column, find(in.head, key), unit)) return true;
    return false;
}

void describe(Import& in)
{
    const std::size_t time = find(in.head, "t_day");
    const bool whole_seconds = time != Head::none && part_of(in.head.fields[time], 3) == "0";
    if (!whole_seconds) take(in, col_t, {"t_day", "t_trip"}, "s");
    take(in, col_v_dc, {"v_in", "Input Voltage"}, "V");
    take(in, col_i_d, {"id"}, "A");
    take(in, col_i_q, {"iq"}, "A");
    take(in, col_w_m, {"erpm", "RPM"}, "erpm");
    take(in, col_temp_winding, {"t_motor", "Temp Motor"}, "C");
    const bool voltages = take(in, col_v_d, {"vd"}, "V") && take(in, col_v_q, {"vq"}, "V");
    if (whole_seconds) {
        in.notes.push_back("t_day has whole seconds, which 50 rows share: no time, unless --period says how far apart "
                           "rows are; the real-time CSV that this was made of is better");
        in.missing_given.push_back("period");
    }
    const std::size_t fault = find(in.head, "fault");
    if (fault != Head::none) in.rules.push_back({in.field(fault), is_not_zero, "fault is not 0"});
    in.host_clock = true;
    if (voltages) {
        in.polled = true;
        in.voltage = "phase, peak; mean since the last row, less the firmware's model of the dead time";
        return;
    }
    in.voltage = "none";
    in.regime = Regime::mechanical;
    if (!in.columns[col_i_q]) take(in, col_i_q, {"v1_curr_motor", "Current"}, "A");
    const std::size_t duty = find(in.head, "duty");
    if (duty == Head::none) return;
    // VESC Tool writes percent under this key, a script of Express -1..1.
    const bool percent = part_of(in.head.fields[duty], 2) == "%";
    in.take_duty(scaled(in.field(duty), percent ? 0.01 : 1.0, percent ? "/100" : ""));
    in.voltage = "none: its size by duty, dead time included";
    // Whole percents are too coarse for one.
    in.polled = in.voltage_is_size && !percent;
    if (in.polled) in.regime.reset();
}

}  // namespace

const Format vesc_log = {"vesc_log", "VESC Express log, VESC Tool's Log Analysis", {}, by_colons, describe};

}  // namespace dqw
