// The shaft learners of both ports with SI outside.
#ifndef DQW_APP_LEARN_SHAFT_HPP
#define DQW_APP_LEARN_SHAFT_HPP

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "app/base/effect_names.hpp"
#include "app/learn/parts.hpp"
#include "app/learn/signals.hpp"
#include "app/q15/fixed_point.hpp"
#include "dqw_shaft_q15.h"

namespace dqw {

/// Of the largest signals: a slope below the usual threshold takes its torque, too, and blocks are so long that noise
/// makes none.
constexpr float kExcitation = 1e-4f;

/// What the learners are shown of mechanical logs.
struct ShaftLogs {
    std::vector<TraceInput> inputs;            ///< effects, their shapes completed
    std::vector<std::vector<double>> torques;  ///< Nm, one list a log
    std::string source;                        ///< where they are from
    double torque_constant_Nm_A = 0.0;         ///< as the machine file says; else 0
    double largest_torque_Nm = 0.0;            ///< 1 where there is none: a base only must not divide by zero
    double largest_w_rad_s = 0.0;              ///< the same
    std::uint16_t half_window = 0;             ///< pairs
    double hat_noise_part = 0.0;               ///< of the slopes' mean square, under hats as wide as a block
};

/// The shaft learners of lib/, SI outside.
class FloatShaft {
public:
    FloatShaft(const std::vector<Log>& logs, const LearnOptions& options, const ShaftLogs& shaft)
        : list_(lists_of(shaft.inputs))
    {
        const Log& first = logs.front();
        config_.dt_s = static_cast<float>(first.dt_s);
        config_.torque_base_Nm = static_cast<float>(shaft.largest_torque_Nm);
        config_.w_base_rad_s = static_cast<float>(shaft.largest_w_rad_s);
        config_.J_kgm2 = nominal(first.machine, options.start, &Machine::J_kgm2);
        config_.B_Nms_rad = nominal(first.machine, options.start, &Machine::B_Nms_rad);
        config_.half_window = shaft.half_window;
        config_.excitation_pu = kExcitation;
        config_.effects = list_.data();
        config_.effect_count = static_cast<std::uint8_t>(list_.size());
        if (dqw_shaft_init(&m_, &config_) != DQW_OK)
            throw std::invalid_argument("the learners refuse these bases, nominal values or shapes of effects");
    }
    void gap() { dqw_shaft_missing(&m_, 0); }
    void sample(double torque_Nm, double w_m_rad_s, float angle_rad)
    {
        (void)dqw_shaft_sample(&m_, static_cast<float>(torque_Nm), static_cast<float>(w_m_rad_s), angle_rad, false);
    }
    bool background() { return dqw_shaft_background(&m_); }
    Read read(dqw_shaft_parameter which) const { return read_of(dqw_shaft_read(&m_, which)); }
    InputRead read_effect(std::size_t n, const TraceInput& input) const
    {
        float w[DQW_EFFECT_STARTS], sd[DQW_EFFECT_STARTS];
        return input_read(input, dqw_shaft_read_effect(&m_, static_cast<int>(n), w, sd), w, sd, 1.0);
    }
    const dqw_gate& gate() const { return m_.gate; }
    /// What it makes of a logged torque or current.
    static double torque(double torque_Nm) { return torque_Nm; }
    static double current(double i_A) { return i_A; }
    static void say(const ShaftLogs&, Learned&) {}

private:
    const std::vector<dqw_effect_config> list_;
    dqw_shaft_config config_{};
    dqw_shaft m_{};
};

inline dqw_torque_q15_config torque_config(const TraceInput& input)
{
    const dqw_effect_config c = effect_config(input);
    const double periods = c.shape[0];
    if (c.effect == DQW_EFFECT_COGGING_TORQUE && (periods != std::floor(periods) || periods > 1000.0))
        throw std::invalid_argument(
            fmt::format("{} periods of cogging_torque; fixed point takes a whole number up to 1000", periods));
    dqw_torque_q15_config out{};
    out.effect = c.effect;
    out.width_urad_s = whole(1e6 * static_cast<double>(c.shape[0]));
    out.fall_urad_s = whole(1e6 * static_cast<double>(c.shape[1]));
    out.periods = c.effect == DQW_EFFECT_COGGING_TORQUE ? static_cast<std::uint16_t>(periods) : std::uint16_t{0};
    for (int i = 0; i < dqw_effect_weights(c.effect); ++i)
        out.start_uNm[i] = static_cast<std::int32_t>(
            std::clamp(std::round(1e6 * static_cast<double>(c.start[i])), -2e9, 2e9));
    return out;
}

/// The same of port_q15/.
class Q15Shaft {
public:
    Q15Shaft(const std::vector<Log>& logs, const LearnOptions& options, const ShaftLogs& shaft)
        : i_full_A_(kRoom * static_cast<double>(largest(logs, &Log::i_q_A, &Log::i_q_A)))
    {
        const Log& first = logs.front();
        for (const TraceInput& in : shaft.inputs) list_.push_back(torque_config(in));
        dqw_shaft_scale& scale = config_.scale;
        scale.torque_full_uNm = full_scale(shaft.largest_torque_Nm, 1e6, "a torque", DQW_SHAFT_TORQUE_MAX);
        scale.w_full_mrad_s = full_scale(shaft.largest_w_rad_s, 1e3, "a speed", DQW_SCALE_MAX);
        scale.dt_ns = whole(1e9 * first.dt_s);
        config_.J_gmm2 = whole(1e9 * static_cast<double>(nominal(first.machine, options.start, &Machine::J_kgm2)));
        config_.B_nNms_rad = whole(1e9 *
                                   static_cast<double>(nominal(first.machine, options.start, &Machine::B_Nms_rad)));
        config_.half_window = static_cast<std::uint8_t>(
            std::min<std::uint16_t>(shaft.half_window, DQW_WINDOW_Q15_HALF));
        config_.excitation_q15 = static_cast<std::uint16_t>(std::lround(kExcitation / kRoom * 32768.0));
        // A host has the time to solve after every block, as the float learners do.
        config_.solve_blocks = 1;
        config_.effects = list_.data();
        config_.effect_count = static_cast<std::uint8_t>(list_.size());
        if (dqw_shaft_init_q15(&m_, &config_) != DQW_OK)
            throw std::invalid_argument(
                "the fixed-point learners refuse these full scales, nominal values or shapes of effects");
        torque_Nm_ = 1e-6 * scale.torque_full_uNm;
        w_rad_s_ = 1e-3 * scale.w_full_mrad_s;
        J_kgm2_ = torque_Nm_ * 1e-9 * scale.dt_ns / w_rad_s_;
        B_Nms_rad_ = torque_Nm_ / w_rad_s_;
    }
    void gap() { dqw_shaft_missing_q15(&m_, 0); }
    void sample(double torque_Nm, double w_m_rad_s, float angle_rad)
    {
        (void)dqw_shaft_sample_q15(&m_, q15(torque_Nm, torque_Nm_), q15(w_m_rad_s, w_rad_s_),
                                   turn_of(static_cast<double>(angle_rad)), false);
    }
    bool background() { return dqw_shaft_background_q15(&m_); }
    Read read(dqw_shaft_parameter which) const
    {
        return read_of(dqw_shaft_read_q15(&m_, which), which == DQW_J ? J_kgm2_ : B_Nms_rad_);
    }
    InputRead read_effect(std::size_t n, const TraceInput& input) const
    {
        std::int64_t w[DQW_EFFECT_STARTS], sd[DQW_EFFECT_STARTS];
        return input_read(input, dqw_shaft_read_effect_q15(&m_, static_cast<int>(n), w, sd), w, sd, torque_Nm_);
    }
    const dqw_gate& gate() const { return m_.gate; }
    double torque(double torque_Nm) const { return quantised(torque_Nm, torque_Nm_); }
    double current(double i_A) const { return quantised(i_A, i_full_A_); }
    void say(const ShaftLogs& shaft, Learned& learned) const
    {
        std::vector<std::string>& notes = learned.result.notes;
        notes.push_back(fmt::format("fixed point; full scales {:.4g} Nm, {:.4g} rad/s", torque_Nm_, w_rad_s_));
        if (shaft.half_window > config_.half_window)
            notes.push_back(fmt::format("blocks of twice {} pairs, where float has twice {}", config_.half_window,
                                        shaft.half_window));
        learned.unit = {J_kgm2_, B_Nms_rad_, 0.0, 0.0};
    }

private:
    /// As sixteen bits give it.
    static double quantised(double x, double full) { return q15(x, full) * full / 32768.0; }

    const double i_full_A_;
    double torque_Nm_ = 0.0, w_rad_s_ = 0.0, J_kgm2_ = 0.0, B_Nms_rad_ = 0.0;  // what 1 stands for
    std::vector<dqw_torque_q15_config> list_;
    dqw_shaft_q15_config config_{};
    dqw_shaft_q15 m_{};
};

}  // namespace dqw
#endif
