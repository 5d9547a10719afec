// moteus: csv_output.py, tview's files, and the dyno of two moteus with a torque sensor.
#include <cmath>
#include <cstdlib>

#include "app/format/formats.hpp"

namespace dqw {
namespace {

bool is_fault_or_stopped(double mode) { return mode <= 1.0; }

void describe_csv(Import& in)
{
    in.take(col_t, "time", "s");
    in.take(col_w_m, "VELOCITY", "turns/s output");
    in.take(col_theta_m, "POSITION", "turns output");
    in.take(col_i_q, "Q_CURRENT", "A");
    in.take(col_i_d, "D_CURRENT", "A");
    in.take(col_torque_cmd, "TORQUE", "Nm output");
    in.take(col_v_dc, "VOLTAGE", "V");
    in.take(col_temp_winding, "MOTOR_TEMPERATURE", "C");
    in.drop("FAULT", is_not_zero, "FAULT is not 0");
    in.drop("MODE", is_fault_or_stopped, "MODE is 0 (stopped) or 1 (fault)");
    in.host_clock = true;
    in.regime = Regime::mechanical;
    in.voltage = "none: no register has the motor's";
    if (in.known(col_torque_cmd)) in.notes.push_back("torque_cmd_Nm is TORQUE, the controller's own of the current");
}

bool is_csv(const Head& head)
{
    const std::size_t position = head.find("POSITION");
    return head.has("time") && position != Head::none && head.fields[position] == "POSITION" && head.has("VELOCITY");
}

void describe_stats(Import& in)
{
    in.take(col_t, "timestamp", "s");
    in.take(col_i_d, "d_A", "A");
    in.take(col_i_q, "q_A", "A");
    in.take(col_w_m, "velocity", "turns/s output");
    if (!in.take(col_v_dc, "filt_bus_V", "V")) in.take(col_v_dc, "bus_V", "V");
    in.take(col_temp_winding, "motor_temp_C", "C");
    in.take(col_torque_cmd, "torque_Nm", "Nm output");
    in.drop("mode", is_fault_or_stopped, "mode is 0 (stopped) or 1 (fault)");
    in.host_clock = true;
    if (in.take(col_v_d, "control.d_V", "V") && in.take(col_v_q, "control.q_V", "V")) {
        in.regime = Regime::steady;
        in.voltage = "phase, peak, commanded; of the nearest servo_control";
        return;
    }
    in.regime = Regime::mechanical;
    in.voltage = "none here: in the file of the channel servo_control, to be given beside this";
}

void describe_control(Import& in)
{
    in.take(col_t, "timestamp", "s");
    in.take(col_v_d, "d_V", "V");
    in.take(col_v_q, "q_V", "V");
    in.host_clock = true;
    in.voltage = "phase, peak, commanded";
    in.notes.push_back("currents and speed are in the file of the channel servo_stats, to be given beside this");
}

/// `g1 = 1.0` of the comments.
std::optional<double> commented(const Head& head, const std::string& name)
{
    for (const std::string& line : head.comments) {
        const auto at = line.find(name + " = ");
        if (at == line.npos) continue;
        const double value = std::strtod(line.c_str() + at + name.size() + 3, nullptr);
        if (value > 0 && std::isfinite(value)) return value;
    }
    return {};
}

/// Speed of the rotor over that of the output, where the first rows show it.
std::optional<double> gear_of_rows(const Head& head)
{
    const std::size_t output = head.find("a1 velocity [rad/s]"), rotor = head.find("c1 vel [Hz]");
    double oo = 0, ro = 0;
    for (const auto& row : head.rows) {
        if (row.size() <= output || row.size() <= rotor) continue;
        const double o = std::strtod(row[output].c_str(), nullptr), r = std::strtod(row[rotor].c_str(), nullptr);
        oo += o * o, ro += 6.283185307179586 * r * o;
    }
    if (!(oo > 0) || !(ro > 0)) return {};
    return ro / oo;
}

void describe_dyno(Import& in)
{
    in.take(col_t, "time [s]", "s");
    in.take(col_w_m, "c1 vel [Hz]", "turns/s");
    in.take(col_theta_m, "c1 position [rev]", "turns");
    in.take(col_temp_winding, "motor temp [C]", "C");
    in.take(col_v_dc, "c1 voltage [V]", "V");
    std::optional<double> gear;
    if (!in.given.gear) gear = commented(in.head, "g1");
    if (!in.given.gear && !gear) gear = gear_of_rows(in.head);
    for (const char* sensor : {"trd605 torque [Nm]", "trs605-5 torque [Nm]"}) {
        if (!in.head.has(sensor)) continue;
        if (gear) {
            char text[32];
            std::snprintf(text, sizeof text, "/%.3g", *gear);
            in.take(col_torque, scaled(in.field(sensor), 1 / *gear, text), "Nm");
        } else {
            in.take(col_torque, sensor, "Nm output");
        }
    }
    in.drop("c1 mode", is_zero, "c1 mode is 0: a poll without an answer");
    in.host_clock = true;
    in.regime = Regime::mechanical;
    in.voltage = "none";
    in.notes.push_back("a1 q-axis [A] is no measurement but c1 torque over kt_1, and left out");
}

bool is_stats(const Head& head) { return head.has("timestamp") && head.has("q_A") && head.has("d_A"); }
bool is_control(const Head& head) { return head.has("timestamp") && head.has("q_V") && head.has("d_V"); }

}  // namespace

const Format moteus_csv = {
    "moteus_csv", "moteus, csv_output.py", {"time", "POSITION", "VELOCITY"}, is_csv, describe_csv};
const Format moteus_stats = {"moteus_stats",
                             "moteus tview, channel servo_stats",
                             {"timestamp", "d_A", "q_A", "velocity"},
                             is_stats,
                             describe_stats};
const Format moteus_control = {
    "moteus_control", "moteus tview, channel servo_control", {"timestamp", "d_V", "q_V"}, is_control, describe_control};
const Format moteus_dyno = {"moteus_dyno",
                            "two moteus face to face with a FUTEK sensor, futek_testing.py",
                            {"time [s]", "a1 velocity [rad/s]", "c1 vel [Hz]", "c1 mode"},
                            nullptr,
                            describe_dyno};

}  // namespace dqw
