// T-Motor AK actuators as TMotorCANControl logs them: speed from CAN, currents and voltages through the UART.
#include "app/format/formats.hpp"

namespace dqw {
namespace {

// What the writer takes for the output speed in rad/s is erpm times this, whatever the motor.
constexpr double written_per_erpm = 5.82e-4;

void take_speed(Import& in, const char* field)
{
    in.take(col_w_m, scaled(in.field(field), 1 / written_per_erpm, "/5.82e-4"), "erpm");
}

void uart(Import& in)
{
    in.take(col_v_dc, "v_bus", "V");
    in.take(col_v_d, "v_d", "V");
    in.take(col_i_d, "i_d", "A");
    if (!in.take(col_v_q, "v_q", "V")) in.take(col_v_q, "vq", "V");
    if (!in.take(col_i_q, "i_q", "A")) in.take(col_i_q, "iq", "A");
    in.drop("v_bus", is_zero, "v_bus is 0: the UART has not answered");
    in.drop("CAN error code", is_not_zero, "CAN error code is not 0");
    in.host_clock = true;
    in.polled = in.columns[col_v_q].has_value();
    if (!in.polled) in.regime = Regime::mechanical;
    in.voltage = !in.polled          ? "none"
                 : in.known(col_v_d) ? "phase, peak; mean since the last query, as VESC's"
                                     : "v_q alone, mean since the last query, as VESC's";
    in.notes.push_back("speed (CAN) and the rest (UART) are not of one instant: as many rows late as were zero");
}

void describe_efficiency(Import& in)
{
    in.take(col_t, "loop time (s)", "s");
    if (in.head.has("velocity (ERPM)"))
        take_speed(in, "velocity (ERPM)");
    else if (in.head.has("velocity (Rad/S)"))
        take_speed(in, "velocity (Rad/S)");
    uart(in);
    // The sensor counts the other way.
    if (in.head.has("Futek Torque (Nm)") && in.given.gear)
        in.take(col_torque, scaled(in.field("Futek Torque (Nm)"), -1, " · −1"), "Nm output");
}

void describe_velocity(Import& in)
{
    in.take(col_t, "loop time", "s");
    take_speed(in, "angular velocity (rad/s)");
    uart(in);
}

bool is_pi(const Head& head)
{
    return head.has("pi_time") || (head.has("loop_time") && head.has("motor_measured_speed"));
}

void describe_pi(Import& in)
{
    if (!in.take(col_t, "pi_time", "s")) in.take(col_t, "loop_time", "s");
    for (const char* name : {"motor_current", "current", "motor_measured_current"})
        if (in.take(col_i_q, name, "A")) break;
    if (in.head.has("motor_speed")) {
        // Nine times the output's speed of the writer, whose gear is 9.
        in.take(col_w_m, scaled(in.field("motor_speed"), 1 / (9 * written_per_erpm), "/9/5.82e-4"), "erpm");
        in.take(col_temp_winding, "motor_temperature", "C");
    } else {
        for (const char* name : {"output_velocity", "velocity", "motor_measured_speed"})
            if (in.take(col_w_m, name, "rad/s output")) break;
        for (const char* name : {"adc_measured_torque", "output_torque", "torque"})
            if (in.take(name == std::string_view("adc_measured_torque") ? col_torque : col_torque_cmd, name,
                        "Nm output"))
                break;
    }
    in.regime = Regime::mechanical;
    in.host_clock = true;
    in.voltage = "none";
}

bool is_efficiency(const Head& head) { return head.has("timestamp (epoch)") && head.has("loop time (s)"); }
bool is_velocity(const Head& head) { return head.has("epoch") && head.has("angular velocity (rad/s)"); }

}  // namespace

const Format tmotor_efficiency = {"tmotor_efficiency",
                                  "T-Motor AK, servo mode, measure_efficiency",
                                  {"timestamp (epoch)", "loop time (s)", "v_bus", "v_q", "i_q", "i_d", "v_d"},
                                  is_efficiency,
                                  describe_efficiency};
const Format tmotor_velocity = {"tmotor_velocity",
                                "T-Motor AK, servo mode, measure_velocity",
                                {"epoch", "loop time", "angular velocity (rad/s)", "v_bus", "iq", "vq"},
                                is_velocity,
                                describe_velocity};
const Format tmotor_pi = {"tmotor_pi", "T-Motor AK, TMotorCANControl's own file", {}, is_pi, describe_pi};

}  // namespace dqw
