// Writers of every format that is read, from the formats' descriptions alone: one record of a made-up drive as each
// tool would have written it.
#ifndef DQW_TESTS_VENDOR_WRITERS_HPP
#define DQW_TESTS_VENDOR_WRITERS_HPP

#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

namespace vendor {

constexpr double turn = 6.283185307179586;
constexpr double p = 7, gear = 9, v_dc = 48;

struct Row {
    double t, v_d, v_q, i_d, i_q, w, theta, temp, torque;
    double ia() const { return i_d * std::cos(theta) - i_q * std::sin(theta); }
    double i_beta() const { return i_d * std::sin(theta) + i_q * std::cos(theta); }
    double ib() const { return -ia() / 2 + std::sqrt(3.0) / 2 * i_beta(); }
    double ic() const { return -ia() - ib(); }
    double va() const { return v_d * std::cos(theta) - v_q * std::sin(theta); }
    double v_beta() const { return v_d * std::sin(theta) + v_q * std::cos(theta); }
    double vb() const { return -va() / 2 + std::sqrt(3.0) / 2 * v_beta(); }
    double vc() const { return -va() - vb(); }
    double degrees() const { return std::fmod(theta, turn) * 360 / turn; }
    double erpm() const { return w * p * 60 / turn; }
    double duty() const { return std::hypot(v_d, v_q) * std::sqrt(3.0) / v_dc; }
};

/// A drive that holds its speed, 200 Hz electrical, `dt_s` from row to row.
inline std::vector<Row> record(double dt_s, std::size_t rows = 80)
{
    const double R = 0.05, L = 40e-6, psi = 4e-3, w = 180;
    std::vector<Row> all;
    for (std::size_t k = 0; k < rows; ++k) {
        const double t = dt_s * static_cast<double>(k), x = static_cast<double>(k);
        const double i_d = -2 + std::sin(0.3 * x), i_q = 12 + 3 * std::cos(0.2 * x), e = w * p;
        all.push_back({t, R * i_d - e * L * i_q, R * i_q + e * (L * i_d + psi), i_d, i_q, w, 0.4 + e * t, 41,
                       1.5 * p * psi * i_q});
    }
    return all;
}

/// Settled points, speed and currents of their own.
inline std::vector<Row> settled(double dt_s, std::size_t rows = 80)
{
    std::vector<Row> all = record(dt_s, rows);
    for (std::size_t k = 0; k < rows; ++k) {
        Row& r = all[k];
        r.w = 100 + 20.0 * static_cast<double>(k % 5);
        r.v_d = 0.05 * r.i_d - r.w * p * 40e-6 * r.i_q;
        r.v_q = 0.05 * r.i_q + r.w * p * (40e-6 * r.i_d + 4e-3);
    }
    return all;
}

struct Written {
    const char* format;
    std::vector<Row> rows;
    std::string text;
    const char* columns;         ///< what must come back: t v i(dq) w, q for i_q alone, T temperature, M torque
    double volt, ampere, speed;  ///< half a step of what is written
    const char* extension = "csv";
    const char* toml = "";
};

inline std::string lines(const std::vector<Row>& rows, const std::string& header, const std::string& end,
                         const std::function<std::string(const Row&, std::size_t)>& line)
{
    std::string text = header.empty() ? "" : header + end;
    for (std::size_t k = 0; k < rows.size(); ++k) text += line(rows[k], k) + end;
    return text;
}

inline std::vector<Written> all()
{
    std::vector<Written> out;
    const auto slow = settled(0.02), fast = record(50e-6);
    const auto add = [&](Written w) { out.push_back(std::move(w)); };
    add({"vesc_tool", slow,
         lines(slow,
               "ms_today;input_voltage;temp_mos_max;temp_motor;current_motor;d_axis_current;q_axis_current;erpm;duty_"
               "cycle;fault_code;d_axis_voltage;q_axis_voltage;",
               "\n",
               [](const Row& r, std::size_t) {
                   return fmt::format("{:.0f};48;31.2;{:.1f};{:.2f};{:.2f};{:.2f};{:.0f};{:.3f};0;{:.3f};{:.3f};",
                                      36123400 + 1e3 * r.t, r.temp, r.i_q, r.i_d, r.i_q, r.erpm(), r.duty(), r.v_d,
                                      r.v_q);
               }),
         "vdqwT", 0.0005, 0.005, 0.5});
    add({"vesc_sampled", fast,
         lines(fast, "T;I1;I2;I3;V1;V2;V3;I_tot;V_zero;Phase", "\n",
               [](const Row& r, std::size_t) {
                   const double phase = std::floor(r.degrees() / 1.44) * 1.44;
                   return fmt::format("{:.6g};{:.6g};{:.6g};{:.6g};{:.6g};{:.6g};{:.6g};{:.6g};24;{:.6g};", r.t, r.ia(),
                                      r.ib(), r.ic(), r.va(), r.vb(), r.vc(), r.i_q, phase);
               }),
         "tvdqw", 0.1, 0.21, 8});
    add({"vesc_log", slow,
         lines(slow,
               "Input Voltage:Input Voltage:V:2:0:0;RPM:RPM::2:0:0;Temp Motor:Temp Motor:degC:1:0:0;iq:iq:A:2:0:0;id:"
               "id:A:2:0:0;vq:vq:V:2:0:0;vd:vd:V:2:0:0;Fault:Fault::2:0:0;t_day:Time:s:3:0:1",
               "\n",
               [](const Row& r, std::size_t) {
                   return fmt::format("48.00;{:.2f};{:.1f};{:.2f};{:.2f};{:.2f};{:.2f};0.00;{:.3f}", r.erpm(), r.temp,
                                      r.i_q, r.i_d, r.v_q, r.v_d, 36123.4 + r.t);
               }),
         "vdqwT", 0.005, 0.005, 0.01});
    add({"vesc_ros", slow,
         lines(slow,
               "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.state.voltage_input,field.state."
               "temp_motor,field.state.current_motor,field.state.avg_id,field.state.avg_iq,field.state.duty_cycle,"
               "field.state.speed,field.state.fault_code,field.state.avg_vd,field.state.avg_vq",
               "\n",
               [](const Row& r, std::size_t k) {
                   const long stamp = 1700000000000000000L + std::lround(1e9 * r.t);
                   return fmt::format("{},{},{},,48.0,{},{},{:.2f},{:.2f},{:.3f},{:.1f},0,{:.3f},{:.3f}",
                                      stamp + 420000, k, stamp, r.temp, r.i_q, r.i_d, r.i_q, r.duty(), r.erpm(), r.v_d,
                                      r.v_q);
               }),
         "vdqwT", 0.0005, 0.005, 0.05});
    add({"plotjuggler", slow,
         lines(slow,
               "time,/s/core/state/avg_id,/s/core/state/avg_iq,/s/core/state/avg_vd,/s/core/state/avg_vq,/s/core/state/"
               "current_motor,/s/core/state/duty_cycle,/s/core/state/speed,/s/core/state/temp_motor,/s/core/state/"
               "voltage_input,/imu/x",
               "\n",
               [](const Row& r, std::size_t) {
                   // A sample of another topic between two of this one.
                   return fmt::format("{:.6f},{:.12g},{:.12g},{:.12g},{:.12g},{:.12g},0.1,{:.12g},{},48,\n{:.6f},,,,,,,"
                                      ",,,0.2",
                                      1.7e9 + r.t, r.i_d, r.i_q, r.v_d, r.v_q, r.i_q, r.erpm(), r.temp,
                                      1.7e9 + r.t + 0.007);
               }),
         "vdqwT", 1e-6, 1e-6, 1e-6});
    const double x_per_w = 5.82e-4;  // written over erpm
    add({"tmotor_efficiency", slow,
         lines(slow,
               "timestamp (epoch),loop time (s),des velocity,velocity (Rad/S),ADC Voltage (V),Futek Torque "
               "(Nm),Antagonist Q-Current (A),i_bus,v_bus,v_q,i_q,duty,mosfet_temp,i_d,v_d",
               "\r\n",
               [=](const Row& r, std::size_t k) {
                   if (k < 6) return fmt::format("{},{},0.0,0.0,2.5,0,0,0,0,0,0,0,0,0,0", 1.7e9 + r.t, r.t);
                   return fmt::format("{},{},1,{},2.5,{},0,1.5,48.0,{:.3f},{:.2f},{:.3f},29.2,{:.2f},{:.3f}",
                                      1.7e9 + r.t, r.t, r.erpm() * x_per_w, -9 * r.torque, r.v_q, r.i_q, r.duty(),
                                      r.i_d, r.v_d);
               }),
         "vdqwM", 0.0005, 0.005, 1e-6});
    add({"tmotor_velocity", slow,
         lines(slow, "epoch,loop time,angular velocity (rad/s),i_bus,v_bus,iq,vq,CAN error code,Serial error code",
               "\r\n",
               [=](const Row& r, std::size_t) {
                   return fmt::format("{},{},{},1.5,48.0,{:.2f},{:.3f},0,0.0", 1.7e9 + r.t, r.t, r.erpm() * x_per_w,
                                      r.i_q, r.v_q);
               }),
         "qw", 0.0005, 0.005, 1e-6});
    add({"tmotor_pi", slow,
         lines(slow, "pi_time,motor_position,motor_speed,motor_current,motor_temperature", "\r\n",
               [=](const Row& r, std::size_t) {
                   return fmt::format("{},0,{},{:.2f},{}", r.t, 9 * r.erpm() * x_per_w, r.i_q, r.temp);
               }),
         "qwT", 0, 0.005, 1e-6});
    add({"moteus_csv", slow,
         lines(slow, "time,MODE,POSITION,VELOCITY,TORQUE,Q_CURRENT,D_CURRENT,VOLTAGE,MOTOR_TEMPERATURE,FAULT", "\n",
               [](const Row& r, std::size_t) {
                   return fmt::format("{},10,0.5,{},{},{},{},48,{},0", r.t, r.w / turn / gear, r.torque * gear, r.i_q,
                                      r.i_d, r.temp);
               }),
         "dqwT", 0, 1e-6, 1e-6});
    add({"moteus_stats", slow,
         lines(slow, "timestamp,bus_V,cur1_A,d_A,mode,motor_temp_C,q_A,torque_Nm,velocity", "\r\n",
               [](const Row& r, std::size_t) {
                   return fmt::format("{},48,0,{},10,{},{},{},{}", 1.7e9 + r.t, r.i_d, r.temp, r.i_q, r.torque * gear,
                                      r.w / turn / gear);
               }),
         "dqwT", 0, 1e-6, 1e-6});
    add({"moteus_control", slow,
         lines(slow, "timestamp,d_V,i_d_A,i_q_A,q_V", "\r\n",
               [](const Row& r, std::size_t) { return fmt::format("{},{},0,0,{}", 1.7e9 + r.t, r.v_d, r.v_q); }),
         "v", 1e-6, 0, 0});
    const auto still = record(0.02);  // of rows in motion none would be left
    add({"moteus_jsonl", still,
         lines(still, "", "\n",
               [](const Row& r, std::size_t) {
                   return fmt::format("{{\"controller\": \"1\", \"timestamp\": {:.6f}, \"channel\": \"servo_control\", "
                                      "\"data\": {{\"d_V\": {}, \"q_V\": {}}}}}\n{{\"controller\": \"1\", "
                                      "\"timestamp\": {:.6f}, \"channel\": \"servo_stats\", \"data\": {{\"mode\": 10, "
                                      "\"d_A\": {}, \"q_A\": {}, \"velocity\": {}, \"bus_V\": 48}}}}",
                                      1.7e9 + r.t, r.v_d, r.v_q, 1.7e9 + r.t + 0.001, r.i_d, r.i_q, r.w / turn / gear);
               }),
         "vdqw", 1e-6, 1e-6, 1e-6, "jsonl"});
    add({"moteus_dyno", slow,
         "# Labels:\r\n# g1 = 9.0; g2 = 6.0\r\n" +
             lines(slow,
                   "time [s],a1 velocity [rad/s],a1 q-axis [A],c1 mode,c1 position [rev],c1 vel [Hz],c1 torque "
                   "[Nm],c1 voltage [V],trs605-5 torque [Nm],motor temp [C]",
                   "\r\n",
                   [](const Row& r, std::size_t) {
                       return fmt::format("{},{},0,9,0,{},0,48,{},{}", r.t, r.w / gear, r.w / turn, r.torque * gear,
                                          r.temp);
                   }),
         "wMT", 0, 0, 1e-6});
    const auto array = [&](const std::function<double(const Row&)>& of, int decimals) {
        std::string text;
        for (const Row& r : fast) text += fmt::format("{}{:.{}f}", text.empty() ? "" : ",", of(r), decimals);
        return "[" + text + "]";
    };
    add({"mesc_log", fast,
         "\r\n{\"time\":" + array([](const Row& r) { return r.t; }, 6) +
             ",\"Vbus.V.y1\":" + array([](const Row&) { return 48; }, 2) +
             ",\"Iu.I_phase.y1\":" + array([](const Row& r) { return r.ia(); }, 2) +
             ",\"Iv.I_phase.y1\":" + array([](const Row& r) { return r.ib(); }, 2) +
             ",\"Iw.I_phase.y1\":" + array([](const Row& r) { return r.ic(); }, 2) +
             ",\"Vd.V_dq.y1\":" + array([](const Row& r) { return r.v_d; }, 2) +
             ",\"Vq.V_dq.y1\":" + array([](const Row& r) { return r.v_q; }, 2) + ",\"angle.misc.y1\":" +
             array([](const Row& r) { return std::floor(std::fmod(r.theta, turn) * 65536 / turn); }, 0) +
             "}\r\n\"hall.misc.y1\":[0,0]}\r\n",
         "tvdqw", 0.005, 0.011, 0.1, "txt"});
    add({"mesc_status", slow,
         lines(slow, "", "\r\n",
               [](const Row& r, std::size_t) {
                   return fmt::format("{{\"adc1\":0,\"ehz\":{:.3f},\"error\":0,\"id\":{:.3f},\"iq\":{:.3f},\"TMOT\":"
                                      "{:.3f},\"vbus\":48.000,\"Vd\":{:.3f},\"Vq\":{:.3f}}}",
                                      r.w * p / turn, r.i_d, r.i_q, r.temp + 273.15, r.v_d, r.v_q);
               }),
         "vdqwT", 0.0005, 0.0005, 0.001, "txt"});
    const auto motor = record(1 / 8789.0);
    add({"openinverter_motor", motor,
         lines(motor, "Time(s),count,angle,idc,i1,i2,pwm1,opmode,pwm2,desat,pwm3,iqref,idref,ifw,uq,ud,iq,id,", "\n",
               [](const Row& r, std::size_t k) {
                   const auto percent = [](double v) { return v / v_dc * 65536 / 37637 * 100; };
                   return fmt::format(
                       "{:.6g},{},{:.6g},0,{:.2f},{:.2f},0,1,0,0,0,0,0,0,{:.6g},{:.6g},{},{:.6g},{:.6g},", r.t, k % 256,
                       r.degrees(), r.ia(), r.ib(), percent(r.v_q), percent(r.v_d), 37 * k % 256, r.i_q, r.i_d);
               }),
         "tvdqw", 1e-4, 1e-4, 0.01});
    add({"openinverter_web", slow,
         lines(slow, "Timestamp,id,iq,ud,uq,udc,fstat,tmpm", "\r\n",
               [](const Row& r, std::size_t) {
                   return fmt::format("2024-03-18T23:59:{:06.3f},{:.2f},{:.2f},{:.2f},{:.2f},48.00,{:.2f},{:.2f}", r.t,
                                      r.i_d, r.i_q, r.v_d / v_dc * 65536, r.v_q / v_dc * 65536, r.w * p / turn, r.temp);
               }),
         "tvdqwT", 1e-5, 0.005, 0.005});
    add({"openinverter_spot", slow,
         lines(slow, "Time(s),udc,id,iq,ud,uq,fstat,tmpm", "\n",
               [](const Row& r, std::size_t) {
                   return fmt::format("{:.6g},48,{:.5g},{:.5g},{:.6g},{:.6g},{:.6g},{:.4g}", r.t, r.i_d, r.i_q,
                                      r.v_d / v_dc * 65536, r.v_q / v_dc * 65536, r.w * p / turn, r.temp);
               }),
         "tvdqwT", 1e-3, 5e-4, 1e-3});
    add({"odrive", slow,
         lines(slow,
               "time,odrv0.axis0.motor.current_control.Iq_measured,odrv0.axis0.motor.current_control.Id_measured,odrv0."
               "axis0.encoder.vel_estimate,odrv0.vbus_voltage",
               "\n",
               [](const Row& r, std::size_t k) {
                   if (k == 3) return fmt::format("{},undefined,{},{},48", r.t, r.i_d, r.w / turn);
                   return fmt::format("{},{},{},{},48", r.t, r.i_q, r.i_d, r.w / turn);
               }),
         "dqw", 0, 1e-6, 1e-6});
    add({"simplefoc", slow,
         lines(slow, "", "\r\n",
               [](const Row& r, std::size_t) {
                   return fmt::format("20.0000\t{:.4f}\t{:.4f}\t{:.4f}\t{:.4f}\t{:.4f}\t{:.4f}", r.v_q, r.v_d,
                                      1e3 * r.i_q, 1e3 * r.i_d, r.w, r.theta);
               }),
         "tvdqw", 5e-5, 5e-8, 5e-5, "txt"});
    add({"odri", slow,
         lines(slow, "Time, Position, Velocity, Iq, Uq, Vsupply", "\n",
               [](const Row& r, std::size_t) {
                   return fmt::format("{:.5f}, {:.5f}, {:.5f}, {:.5f}, {:.5f}, 0.48", r.t, r.theta / p, r.w, r.i_q,
                                      r.v_q);
               }),
         "tqw", 5e-6, 5e-6, 5e-6, "txt"});
    add({"float_control", slow,
         lines(slow, "Time(s),State,Distance(km),Duty%,Voltage,I-Motor,T-Mot,Motor-Fault,ERPM", "\r\n",
               [](const Row& r, std::size_t) {
                   return fmt::format("{:.2f},RIDING,0,{:.0f}%,48.0,{:.1f},{:.1f},0,{:.0f}", r.t, 100 * r.duty(), r.i_q,
                                      r.temp, r.erpm());
               }),
         "qwT", 0, 0.05, 0.5});
    std::string entries;
    for (const Row& r : slow)
        entries += fmt::format(
            "{}\n  {{\"timestamp\": {:.0f}, \"speed\": 1, \"dutyCycle\": {:.2f}, \"batteryVolts\": 48, "
            "\"motorCurrent\": {:.1f}, \"motorTemp\": {}, \"controllerTemp\": null}}",
            entries.empty() ? "" : ",", 1.7e12 + 1e3 * r.t, r.duty(), r.i_q, r.temp);
    add({"floaty", slow, "{\n \"id\": \"x\", \"boardId\": \"y\",\n \"logs\": [" + entries + "]}\n", "qT", 0, 0.05, 0,
         "json"});
    std::string scope =
        "Model,MDO3014\nFirmware Version,1.20\n\nWaveform Type,ANALOG\nPoint Format,Y\nHorizontal Units,s\nSample "
        "Interval,5e-05\nRecord Length,80\n,\nLabel,,,\n";
    add({"tektronix", fast,
         scope + lines(fast, "TIME,CH1,CH2,CH3,CH4,CH5", "\n",
                       [](const Row& r, std::size_t) {
                           return fmt::format("{:.6e},{:.7g},{:.7g},{:.7g},{:.7g},{:.7g}", r.t, r.ia() / 10,
                                              r.ib() / 10, (r.va() - r.vb()) / 50, (r.vb() - r.vc()) / 50, r.degrees());
                       }),
         "vdq", 1e-4, 1e-4, 0, "csv",
         "[columns]\ni_dq_A = { from = [\"CH1\", \"CH2\"], scale = 10 }\nv_dq_V = { from = [\"CH3\", \"CH4\"], kind = "
         "\"line\", scale = 50 }\ntheta_e_rad = { from = \"CH5\", unit = \"deg\" }\n"});
    add({"rigol", fast,
         "X,CH1,CH2,CH3,CH4,Start,Increment,\nSequence,Volt,Volt,Volt,Volt,0,5e-05\n" +
             lines(fast, "", "\n",
                   [](const Row& r, std::size_t k) {
                       return fmt::format("{},{:.7g},{:.7g},{:.7g},{:.7g},", k, r.ia(), r.i_beta(), r.va(),
                                          r.degrees());
                   }),
         "tdq", 0, 1e-4, 0, "csv",
         "[columns]\ni_dq_A = { from = [\"CH1\", \"CH2\"], kind = \"alpha_beta\" }\ntheta_e_rad = { from = \"CH4\", "
         "unit "
         "= \"deg\" }\n"});
    return out;
}

}  // namespace vendor
#endif
