// VESC Tool's sampled data: phase currents and voltages at the sampling instant, with the electrical angle.
#include <cmath>
#include <cstdlib>

#include "app/base/input_error.hpp"
#include "app/format/formats.hpp"

namespace dqw {
namespace {

bool by_name(const Head& head)
{
    if (!head.has("I_tot") || !head.has("Phase") || !head.has("T")) return false;
    return head.has("I1") && head.has("I2") && head.has("I3");
}

double number(const Head& head, std::size_t row, const char* name)
{
    const std::size_t f = head.find(name);
    return f < head.rows[row].size() ? std::strtod(head.rows[row][f].c_str(), nullptr) : 0.0;
}

/// Two kinds of file that no fit can use say so by their numbers.
void refuse_useless(const Head& head)
{
    bool counts = head.rows.size() > 2, still = counts;
    for (std::size_t k = 0; k < head.rows.size(); ++k) {
        still = still && number(head, k, "Phase") == 0.0;
        for (const char* name : {"I1", "I2", "I3"}) {
            const double i = number(head, k, name);
            counts = counts && i == std::floor(i) && i > 200;
        }
    }
    if (counts)
        throw InputError(
            head.path, head.line + 1,
            "raw ADC counts, whose offsets and scales are not in the file; expected data sampled in amperes "
            "and volts");
    if (still)
        throw InputError(head.path, head.line + 1,
                         "Phase is 0: the motor did not run under FOC when it was sampled, and there is no dq");
}

void describe(Import& in)
{
    refuse_useless(in.head);
    in.take(col_t, "T", "s");
    // Stored in 250 steps a turn, cut off: half a step is missing on average.
    in.take(col_theta_e, scaled(in.field("Phase"), 1.0, " + 0.72°", 0.72), "deg");
    in.take_park(col_i_d, col_i_q, clarke_of_phases({in.field("I1"), in.field("I2"), in.field("I3")}));
    if (in.head.has("V1") && in.head.has("V2") && in.head.has("V3"))
        in.take_park(col_v_d, col_v_q, clarke_of_phases({in.field("V1"), in.field("V2"), in.field("V3")}));
    in.voltage = "phase voltages at the sampling instant: means only on boards with phase filters";
    in.speed_from_angle = true;
    in.regime = Regime::dynamic;
    in.notes.push_back("without phase filters V1 to V3 are no mean voltages, and a fit of them is worth nothing");
}

}  // namespace

const Format vesc_sampled = {"vesc_sampled",
                             "VESC Tool, sampled data",
                             {"T", "I1", "I2", "I3", "V1", "V2", "V3", "I_tot", "Phase"},
                             by_name,
                             describe};

}  // namespace dqw
