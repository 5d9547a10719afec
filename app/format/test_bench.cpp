// Settled points of a test bench: units in brackets behind the names, RMS values of a power analyser.
#include "app/format/formats.hpp"

namespace dqw {
namespace {

std::size_t find(const Head& head, std::string_view part)
{
    for (std::size_t f = 0; f < head.fields.size(); ++f)
        if (head.fields[f].find(part) != std::string::npos) return f;
    return Head::none;
}

bool by_brackets(const Head& head) { return find(head, "[1/min]") != Head::none && find(head, "URMS_") != Head::none; }

void describe(Import& in)
{
    in.take(col_w_m, find(in.head, "[1/min]"), "rpm");
    in.take(col_torque, find(in.head, "M_HM"), "Nm");
    in.take(col_temp_winding, find(in.head, "T_MOTOR"), "C");
    in.take(col_temp_magnet, find(in.head, "T_Rotor"), "C");
    in.voltage = "RMS of a power analyser; no dq";
    if (find(in.head, "IRMS_") != Head::none) {
        in.notes.push_back(
            "RMS values under current have no dq: read the flux off an open circuit; of shorted terminals "
            "R and L, by v_d_V, v_q_V and i_d_A = { value = 0 } and i_q_A = { from = \"…\", unit = \"A RMS\" }");
        return;
    }
    // All the voltage is the magnet's, ahead of it by a quarter turn.
    const std::size_t mean = find(in.head, "average_voltage"),
                      volts = mean != Head::none ? mean : find(in.head, "URMS_");
    if (volts == Head::none) return;
    in.take_si(col_v_q, in.field(volts));
    in.columns[col_v_q]->needs.emplace_back("line or phase");
    for (const Column c : {col_v_d, col_i_d, col_i_q}) in.take_si(c, constant(0.0));
    in.regime = Regime::steady;
    in.notes.push_back("RMS volts and no currents: read as an open circuit");
}

}  // namespace

const Format test_bench = {"test_bench", "test bench, settled points with a power analyser", {}, by_brackets, describe};

}  // namespace dqw
