// VESC Tool's real-time CSV: one row a reply, currents and voltages are means since the last poll.
#include "app/format/formats.hpp"

namespace dqw {
namespace {

void describe(Import& in)
{
    in.take(col_t, "ms_today", "ms");
    in.take(col_v_dc, "input_voltage", "V");
    in.take(col_i_d, "d_axis_current", "A");
    in.take(col_i_q, "q_axis_current", "A");
    in.take(col_w_m, "erpm", "erpm");
    in.take(col_temp_winding, "temp_motor", "C");
    in.drop("fault_code", is_not_zero, "fault_code is not 0");
    in.host_clock = true;
    if (in.take(col_v_d, "d_axis_voltage", "V") && in.take(col_v_q, "q_axis_voltage", "V")) {
        in.polled = true;
        in.voltage = "phase, peak; mean since the last poll, less the firmware's model of the dead time; lags below "
                     "10 000 erpm";
    } else {
        in.take_duty(in.field("duty_cycle"));
        in.voltage = "none in a file of this age: its size by duty, dead time included";
        in.polled = in.voltage_is_size;
        if (!in.polled) in.regime = Regime::mechanical;
    }
}

}  // namespace

const Format vesc_tool = {"vesc_tool",
                          "VESC Tool, real-time CSV",
                          {"ms_today", "input_voltage", "erpm", "duty_cycle", "d_axis_current", "q_axis_current"},
                          nullptr,
                          describe};

}  // namespace dqw
