// ODRI uOmodri text: spaces behind each comma, no d axis; Vsupply is a raw input and no DC link.
#include "app/format/formats.hpp"

namespace dqw {
namespace {

void describe(Import& in)
{
    in.take(col_t, "Time", "s");
    in.take(col_w_m, "Velocity", "rad/s");
    in.take(col_theta_m, "Position", "rad");
    in.take(col_i_q, "Iq", "A");
    in.take(col_v_q, "Uq", "V");
    in.host_clock = true;
    in.regime = Regime::mechanical;
    in.voltage = in.known(col_v_q) ? "v_q alone, commanded" : "none";
}

}  // namespace

const Format odri = {"odri", "ODRI uOmodri text", {"Time", "Position", "Velocity", "Iq"}, nullptr, describe};

}  // namespace dqw
