// A trace made up by hand, for what only shows one: dead time on a servo that turns to and fro.
#ifndef DQW_TESTS_TRACE_SAMPLE_HPP
#define DQW_TESTS_TRACE_SAMPLE_HPP

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

#include "app/trace/report.hpp"

namespace trace_sample {

/// Nearly normal, of deviation 1.
class Noise {
public:
    double operator()()
    {
        double sum = 0.0;
        for (int k = 0; k < 12; ++k) {
            state_ = state_ * 6364136223846793005u + 1442695040888963407u;
            sum += static_cast<double>(state_ >> 33) / 2147483648.0;
        }
        return sum - 6.0;
    }

private:
    std::uint64_t state_ = 1;
};

inline dqw::TraceAxisBlocks axis(const std::string& name)
{
    dqw::TraceAxisBlocks out;
    out.axis = name;
    return out;
}

inline void fill_blocks(dqw::TraceResult& r, std::size_t blocks)
{
    dqw::TraceBlocks& b = r.blocks;
    dqw::TraceAxisBlocks d = axis("d"), q = axis("q");
    Noise noise;
    double theta = 0.0;
    for (std::size_t k = 0; k < blocks; ++k) {
        const double t = static_cast<double>(k) * 2e-3, w = 150 * std::sin(3.14 * t),
                     i_q = 6 * std::sin(10.7 * t) + 2 * std::sin(40 * t), i_d = -2 + 1.5 * std::sin(23 * t);
        theta += 4 * w * 2e-3;
        b.t_s.push_back(t);
        b.theta_e_rad.push_back(std::fmod(theta, 6.283185307));
        b.i_d_A.push_back(i_d);
        b.i_q_A.push_back(i_q);
        b.w_m_rad_s.push_back(w);
        b.heldout.push_back(static_cast<char>(k * 20 / blocks % 2));
        const double rest_d = 0.15 * noise(), rest_q = 0.15 * noise();
        const double lack_d = r.effects.empty() ? 0.0 : 2 * std::tanh(i_d / 2) + 0.3 * std::cos(6 * theta);
        const double lack_q = r.effects.empty() ? 0.0 : 4.6 * std::tanh(i_q / 0.3) - 0.64 * i_q;
        const auto put = [&](dqw::TraceAxisBlocks& to, double model, double lack, double rest) {
            to.measured.push_back(model + lack + rest);
            to.residual_before.push_back(lack + rest);
            to.residual_after.push_back(rest);
        };
        put(d, 1.2 * i_d - 0.0112 * w * i_q, lack_d, rest_d);
        put(q, 1.2 * i_q + 0.48 * w, lack_q, rest_q);
    }
    b.axes = {d, q};
    for (const char* name : {"d", "q"}) {
        dqw::TraceSpectrum s;
        s.axis = name;
        for (int order = 0; order <= 24; ++order) {
            s.order.push_back(order);
            s.before.push_back(order % 6 == 0 ? 0.6 / (1 + order / 6.0) : 0.02);
            s.after.push_back(0.015);
        }
        for (int f = 1; f <= 2500; ++f) {
            s.frequency_Hz.push_back(0.1 * f);
            s.before_at.push_back(0.3 / (1 + 0.05 * f) + 0.02 * std::fabs(noise()));
            s.after_at.push_back(0.01 + 0.01 * std::fabs(noise()));
        }
        b.spectra.push_back(s);
    }
}

/// `verdict`: any of the four.
inline dqw::TraceReport report(const std::string& verdict, std::size_t blocks)
{
    dqw::TraceReport out;
    out.logs = {"data/servo.csv"};
    dqw::TraceResult& r = out.trace;
    r.verdict = verdict;
    r.rows = 20 * blocks;
    r.heldout_rows = r.rows / 2;
    r.noise_floor = 0.15;
    r.before.parameters = {{"R_ohm", 2.83, 0.04, false},
                           {"Lq_H", 2.81e-3, 1.2e-5, false},
                           {"psi_Wb", 0.1204, 1e-4, false},
                           {"pole_pairs", 4, 0, true}};
    r.after.parameters = {{"R_ohm", 1.21, 0.012, false},
                          {"Lq_H", 2.80e-3, 7e-6, false},
                          {"psi_Wb", 0.1201, 3e-5, false},
                          {"pole_pairs", 4, 0, true}};
    r.before.heldout_rms = 1.53, r.after.heldout_rms = 0.16;
    r.before.axes = {{"d", 1.2, 14.2}, {"q", 1.8, 4.6}};
    r.after.axes = {{"d", 0.15, 1.71}, {"q", 0.17, 0.43}};
    if (verdict == "explained" || verdict == "partly_explained")
        r.effects = {{"dead_time", {{"voltage_V", 3.61, 0.10, false}, {"width_A", 0.31, 0.02, false}}, 0.16, {}, ""}};
    if (verdict == "partly_explained") {
        r.effects.push_back(
            {"iron_loss", {{"R_fe_ohm", 420, 13, false}}, 0.158, {"angle_offset", "delay"}, "a second speed"});
        r.rest = {{"a line at 37 Hz", "q", 0.61}};
        r.rest_signature = "a line at 37 Hz on the q axis";
    }
    if (r.effects.empty()) (verdict == "clean" ? r.before : r.after) = verdict == "clean" ? r.after : r.before;
    r.rejected = {{"saturation", "explains less than dead_time", 1.31},
                  {"winding_temperature", "no temperature column", std::numeric_limits<double>::quiet_NaN()}};
    r.structure = {{"signs of the phase currents", "q", 0.97}};
    r.notes = {"2 gaps in time"};
    r.inputs = {{"dead_time", {0.31}, {3.61}}};
    fill_blocks(r, blocks);
    return out;
}

}  // namespace trace_sample
#endif
