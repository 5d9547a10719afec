#include "ref/effect/physical.hpp"

#include <cmath>
#include <string>

namespace dqw {
namespace {

struct Polar {
    double size, angle, size_sd, angle_sd;
};

Polar polar(double a, double b, double a_sd, double b_sd)
{
    const double r = std::hypot(a, b), sd = std::hypot(a_sd, b_sd);
    if (!(r > 0.0)) return {0.0, 0.0, sd, 0.0};
    return {r, std::atan2(b, a), std::hypot(a * a_sd, b * b_sd) / r, std::hypot(b * a_sd, a * b_sd) / (r * r)};
}

}  // namespace

std::vector<Estimate> physical(const std::vector<TraceInput>& inputs, const std::vector<std::vector<double>>& sd,
                               const std::vector<double>& shape_sd, const PlainModel& model)
{
    std::vector<Estimate> out;
    for (std::size_t n = 0; n < inputs.size(); ++n) {
        const TraceInput& in = inputs[n];
        const std::vector<double>&w = in.weights, &s = sd[n];
        const auto shape = [&](std::size_t i) { return i < in.shape.size() ? in.shape[i] : 0.0; };
        const auto fixed = [&](const char* name, double value) { out.push_back({name, value, 0.0, true}); };
        const auto scaled = [&](const char* name, std::size_t i, double by) {
            out.push_back({name, w[i] * by, s[i] * std::abs(by), false});
        };
        const auto plain = [&](std::initializer_list<const char*> names) {
            std::size_t i = 0;
            for (const char* name : names) scaled(name, i, 1.0), ++i;
        };
        if (in.effect == "dead_time") {
            plain({"voltage_V"});
            out.push_back({"width_A", shape(0), shape_sd[n], !(shape_sd[n] > 0.0)});
        } else if (in.effect == "saturation") {
            plain({"psi_d2_Wb", "psi_d3_Wb", "psi_d4_Wb", "psi_q3_Wb", "psi_q5_Wb"});
            fixed("i_base_A", shape(0));
        } else if (in.effect == "cross_saturation") {
            plain({"psi_c12_Wb", "psi_c22_Wb", "psi_c14_Wb"});
            fixed("i_base_A", shape(0));
        } else if (in.effect == "winding_temperature" || in.effect == "magnet_temperature") {
            const bool winding = in.effect == "winding_temperature";
            const double base = winding ? model.R_ohm : model.psi_Wb;
            if (shape(1) > 0.0) {
                // Without a thermometer the rise within the log is known, not the coefficient.
                scaled(winding ? "rise_percent" : "fall_percent", 0, (winding ? 100.0 : -100.0) * in.reach / base);
                fixed("tau_s", shape(1));
            } else {
                scaled(winding ? "alpha_per_K" : "beta_per_K", 0, 1.0 / base);
                fixed("T0_C", shape(0));
            }
        } else if (in.effect == "iron_loss") {
            out.push_back({"R_fe_ohm", 1.0 / w[0], s[0] / (w[0] * w[0]), false});
        } else if (in.effect == "flux_harmonics") {
            const std::string order = std::to_string(static_cast<int>(shape(0)));
            const Polar d = polar(w[0], w[1], s[0], s[1]), q = polar(w[2], w[3], s[2], s[3]);
            out.push_back({"psi_" + order + "d_Wb", d.size, d.size_sd, false});
            out.push_back({"psi_" + order + "q_Wb", q.size, q.size_sd, false});
            out.push_back({"phase_" + order + "d_rad", d.angle, d.angle_sd, false});
            out.push_back({"phase_" + order + "q_rad", q.angle, q.angle_sd, false});
        } else if (in.effect == "current_offset") {
            plain({"i_alpha_A", "i_beta_A"});
        } else if (in.effect == "current_gain_mismatch") {
            const Polar p = polar(w[0], w[1], s[0], s[1]);
            out.push_back({"gain", p.size, p.size_sd, false});
            out.push_back({"axis_rad", 0.5 * p.angle, 0.5 * p.angle_sd, false});
        } else if (in.effect == "angle_offset") {
            plain({"angle_rad"});
        } else if (in.effect == "delay") {
            // A settled row has no period: there the weight is in seconds.
            plain({shape(0) > 0.0 ? "delay_s" : "periods"});
        } else if (in.effect == "skin_effect") {
            scaled("k_s2_rad2", 0, 1.0 / model.R_ohm);
        } else if (in.effect == "phase_resistance_imbalance") {
            plain({"dR_a_ohm", "dR_b_ohm"});
        } else if (in.effect == "voltage_offset") {
            plain({"v_d_V", "v_q_V"});
        } else if (in.effect == "stribeck_friction") {
            plain({"torque_Nm"});
            fixed("speed_rad_s", shape(1));
        } else if (in.effect == "cogging_torque") {
            const Polar p = polar(w[0], w[1], s[0], s[1]);
            out.push_back({"torque_Nm", p.size, p.size_sd, false});
            out.push_back({"phase_rad", p.angle, p.angle_sd, false});
            fixed("order", shape(0));
        } else {
            plain({"torque_Nm"});
        }
    }
    return out;
}

}  // namespace dqw
