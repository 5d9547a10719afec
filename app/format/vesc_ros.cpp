// The ROS message VescState of `rostopic echo -p`, and of PlotJuggler's export by vesc_state().
#include "app/format/vesc_state.hpp"

#include "app/format/formats.hpp"

namespace dqw {

void vesc_state(Import& in)
{
    const auto take = [&](Column column, const char* name, const char* unit) {
        return in.take(column, in.head.find_ending(name), unit);
    };
    take(col_v_dc, "voltage_input", "V");
    take(col_w_m, "speed", "erpm");
    take(col_temp_winding, "temp_motor", "C");
    take(col_i_d, "avg_id", "A");
    if (!take(col_i_q, "avg_iq", "A") && take(col_i_q, "current_motor", "A"))
        in.notes.push_back("i_q_A is current_motor, which is i_q where no field is weakened");
    in.host_clock = true;
    const std::size_t fault = in.head.find_ending("fault_code");
    if (fault != Head::none) in.rules.push_back({in.field(fault), is_not_zero, "fault_code is not 0"});
    if (take(col_v_d, "avg_vd", "V") && take(col_v_q, "avg_vq", "V")) {
        in.polled = true;
        in.voltage = "phase, peak; mean since the last poll, less the firmware's model of the dead time";
        return;
    }
    in.voltage = "none in this message: |v| by duty, dead time included";
    const std::size_t duty = in.head.find_ending("duty_cycle");
    if (duty != Head::none) in.take_duty(in.field(duty));
    in.polled = in.voltage_is_size;
    if (!in.polled) in.regime = Regime::mechanical;
}

namespace {

bool by_time(const Head& head)
{
    return head.has("%time") && head.find_ending("speed") != Head::none && head.find_ending("duty_cycle") != Head::none;
}

void describe(Import& in)
{
    if (!in.take(col_t, in.head.find("field.header.stamp"), "ns")) in.take(col_t, "%time", "ns");
    vesc_state(in);
}

}  // namespace

const Format vesc_ros = {"vesc_ros", "ROS VescState, rostopic echo -p", {"%time"}, by_time, describe};

}  // namespace dqw
