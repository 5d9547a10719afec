// SimpleFOC's monitor(): one to seven numbers between tabs, without names and without time.
#include "app/base/input_error.hpp"
#include "app/base/text.hpp"
#include "app/format/formats.hpp"

namespace dqw {
namespace {

bool has_four_decimals(const std::string& text)
{
    const auto point = text.find('.');
    return point != text.npos && text.size() - point == 5;
}

/// Four decimals everywhere, and as many numbers as the library writes by default, or with all bits set.
bool by_look(const Head& head)
{
    if (!head.headerless || head.separator != '\t' || (head.fields.size() != 7 && head.fields.size() != 4))
        return false;
    for (const auto& row : head.rows)
        for (const std::string& field : row)
            if (!has_four_decimals(field)) return false;
    return !head.rows.empty();
}

void describe(Import& in)
{
    const auto take = [&](Column column, int field, const char* unit) {
        in.take(column, static_cast<std::size_t>(field - 1), unit);
    };
    if (in.head.fields.size() == 7) {
        take(col_v_q, 2, "V"), take(col_v_d, 3, "V"), take(col_i_q, 4, "mA"), take(col_i_d, 5, "mA");
        take(col_w_m, 6, "rad/s"), take(col_theta_m, 7, "rad");
        in.voltage = "phase, peak, commanded";
    } else if (in.head.fields.size() == 4) {
        take(col_v_q, 2, "V"), take(col_w_m, 3, "rad/s"), take(col_theta_m, 4, "rad");
        in.voltage = "v_q alone, commanded";
        in.notes.push_back("of 4 numbers only v_q, speed and angle are of use: currents come with "
                           "monitor_variables of all 7");
    } else {
        throw InputError(in.head.path, in.head.line,
                         counted(in.head.fields.size(), "number") +
                             " a line; expected 7 (target, voltage q, d, current q, d, velocity, angle) or 4");
    }
    in.row_period_s = in.given.period_s;
    in.host_clock = true;
    if (in.head.fields.size() == 7) in.regime = Regime::steady;
    if (!in.given.period_s) in.missing_given.push_back("period");
}

}  // namespace

const Format simplefoc = {"simplefoc", "SimpleFOC, monitor()", {}, by_look, describe};

}  // namespace dqw
