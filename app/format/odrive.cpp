// ODrive GUI's plot.csv: the properties that somebody chose, by their paths.
#include "app/format/formats.hpp"

namespace dqw {
namespace {

bool by_path(const Head& head)
{
    if (!head.has("time")) return false;
    for (const std::string& field : head.fields)
        if (field.compare(0, 4, "odrv") == 0 && field.find(".axis") != field.npos) return true;
    return false;
}

void describe(Import& in)
{
    const auto take = [&](Column column, const char* name, const char* unit) {
        return in.take(column, in.head.find_ending(name), unit);
    };
    take(col_t, "time", "s");
    take(col_w_m, "encoder.vel_estimate", "turns/s");
    take(col_i_q, "Iq_measured", "A");
    take(col_i_d, "Id_measured", "A");
    take(col_v_dc, "vbus_voltage", "V");
    take(col_temp_winding, "motor_thermistor.temperature", "C");
    const std::size_t alpha = in.head.find_ending("final_v_alpha"), beta = in.head.find_ending("final_v_beta"),
                      phase = in.head.find_ending("phase");
    in.host_clock = true;
    in.regime = Regime::mechanical;
    in.voltage = "none of dq among the properties";
    in.notes.push_back("vel_estimate is taken as turns/s, as since firmware 0.5; before it was counts/s");
    if (alpha != Head::none && beta != Head::none && phase != Head::none) {
        in.take(col_theta_e, phase, "rad");
        in.take_park(col_v_d, col_v_q, {in.field(alpha), in.field(beta)});
        in.voltage = "final_v_alpha, final_v_beta, commanded, turned by phase: of one instant only if stamps agree";
        if (in.known(col_i_d) && in.known(col_i_q)) in.regime = Regime::steady;
    }
}

}  // namespace

const Format odrive = {"odrive", "ODrive GUI, plot.csv", {"time"}, by_path, describe};

}  // namespace dqw
