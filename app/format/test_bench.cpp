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
    in.notes.push_back("RMS values without dq: of an open circuit they give the flux by hand, p·ψ = U·√2/w_m of phase "
                       "voltages, U·√2/√3/w_m of line voltages");
}

}  // namespace

const Format test_bench = {"test_bench", "test bench, settled points with a power analyser", {}, by_brackets, describe};

}  // namespace dqw
