#include "app/monitor/q15.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "app/q15/effect_q15.hpp"
#include "app/q15/fixed_point.hpp"
#include "app/q15/monitor_config.h"
#include "dqw_estimator_block_q15.h"
#include "dqw_text.h"

namespace dqw {
namespace {

constexpr double kFaultRoom = DQW_Q15_ROOM;
constexpr double kQ24 = 0x1p-24, kQ28 = 0x1p-28, kQ40 = 0x1p-40;

std::vector<dqw_effect_q15_config> effects_of(const MonitorSetup& setup, const dqw_scale& scale)
{
    std::vector<dqw_effect_q15_config> list;
    for (const TraceInput& in : setup.inputs) list.push_back(effect_config_q15(in, full_scales(scale), 1.0, 0.0));
    return list;
}

class Q15Monitor : public MonitorEngine {
public:
    explicit Q15Monitor(const MonitorSetup& setup)
        : config_(q15_monitor_config(setup)), effects_(effects_of(setup, config_.estimator.scale))
    {
        config_.estimator.effects = effects_.data();
        config_.estimator.effect_count = static_cast<std::uint8_t>(effects_.size());
        accept(dqw_monitor_init_q15(&m_, &config_));
    }

    void gap(std::uint32_t periods) override { dqw_monitor_missing_q15(&m_, periods); }

    bool sample(const dqw_sample& s) override
    {
        dqw_sample_q15 x;
        const bool good = fixed(s, full_, x);
        // Sixteen bits have no not-a-number: the port is told of a limit, and it is counted here.
        if (!good) ++not_numbers_;
        (void)dqw_monitor_sample_q15(&m_, &x, !good);
        return m_.estimator.window.over.pending;
    }

    std::optional<MonitorTold> background() override
    {
        dqw_monitor_change_q15 e{};
        if (!dqw_monitor_background_q15(&m_) || !dqw_monitor_event_q15(&m_, &e)) return std::nullopt;
        const double unit = kQ40 * unit_of(e.parameter) * channel_unit(measures(), e.parameter);
        const std::uint64_t half = m_.estimator.window.half;
        return MonitorTold{static_cast<std::uint32_t>(e.sample / half),
                           static_cast<std::uint32_t>(e.since / half),
                           e.parameter,
                           static_cast<double>(e.value_q40) * unit,
                           sd_of(e.sd_q40) * unit,
                           {e.fault.name, static_cast<float>(e.fault.confidence_q15) / 32768.0F, e.fault.phase}};
    }

    void define() override { accept(dqw_monitor_define_q15(&m_, &config_)); }

    std::uint32_t halves() const override { return m_.estimator.halves; }

    MonitorMeasures measures() const override
    {
        MonitorMeasures r{};
        for (int i = 0; i < DQW_PARAMETERS; ++i) {
            const auto at = static_cast<std::size_t>(i);
            const dqw_reading_q15 now = read(i);
            r.weight[at] = static_cast<double>(now.value_q40) * kQ40 * unit_of(i);
            r.weight_sd[at] = sd_of(now.sd_q40) * kQ40 * unit_of(i);
            r.healthy[at] = m_.healthy.weight_q24[i] * kQ24 * unit_of(i);
        }
        for (int k = 0; k < DQW_WITNESS_INPUTS; ++k) {
            const auto at = static_cast<std::size_t>(k);
            const dqw_reading_q15 now = read(DQW_WATCH_OFFSET + k);
            const double unit = unit_of(DQW_WATCH_OFFSET + k);
            r.ripple[at] = static_cast<double>(now.value_q40) * kQ40 * unit;
            r.ripple_sd[at] = sd_of(now.sd_q40) * kQ40 * unit;
            r.healthy_ripple[at] = std::hypot(m_.healthy.re_q28[k], m_.healthy.im_q28[k]) * kQ28 * unit;
        }
        const double torque_Nm = kQ24 * unit_of(DQW_WATCH_FRICTION);
        r.friction_Nm = m_.friction_q24 * torque_Nm;
        r.friction_sd_Nm = std::sqrt(2.0 * static_cast<double>(m_.spread_q48) / m_.watch.reversals) * torque_Nm;
        r.healthy_friction_Nm = m_.healthy.friction_q24 * torque_Nm;
        r.cold_R_ohm = m_.healthy.cold_R_q24 * kQ24 * unit_of(DQW_WATCH_R);
        r.alpha_per_K = 1e-6 * config_.alpha_ppm_per_K;
        r.residual_V = full_.v_V * std::sqrt(std::ldexp(static_cast<double>(m_.estimator.recent_q54), -54));
        r.healthy_residual_V = full_.v_V * std::sqrt(std::ldexp(static_cast<double>(m_.healthy.residual_q54), -54));
        r.blocks = m_.estimator.blocks;
        r.friction_known = m_.watch.reversals > 0 && m_.watch.looks[DQW_WATCH_FRICTION] > 0;
        r.in_service = m_.estimator.stage.name == DQW_STAGE_IN_SERVICE;
        r.resting = m_.watch.resting;
        return r;
    }

    MonitorState state() const override
    {
        // Parts of the full voltage, told as parts of the base.
        dqw_stage stage = m_.estimator.stage;
        stage.threshold_ppm = whole(kFaultRoom * stage.threshold_ppm);
        stage.residual_ppm = whole(kFaultRoom * stage.residual_ppm);
        dqw_gate gate = m_.estimator.gate;
        gate.saturated -= not_numbers_;
        gate.nonfinite += not_numbers_;
        return {stage,
                gate,
                kFaultRoom * dqw_estimator_residual_q28(&m_.estimator) * kQ28,
                m_.estimator.blocks,
                m_.estimator.missed,
                m_.estimator.restarts,
                m_.witness.blocks,
                m_.watch.looks[DQW_WATCH_FRICTION]};
    }

private:
    static void accept(dqw_status status)
    {
        if (status != DQW_OK)
            throw std::invalid_argument(
                fmt::format("the fixed-point monitor refuses its configuration: {}", dqw_status_text(status)));
    }

    dqw_reading_q15 read(int channel) const
    {
        return dqw_monitor_read_q15(&m_, static_cast<dqw_monitor_channel>(channel));
    }

    static double sd_of(std::int64_t sd_q40) { return sd_q40 == INT64_MAX ? INFINITY : static_cast<double>(sd_q40); }

    /// What 1 of a channel's reading is, SI.
    double unit_of(int channel) const
    {
        const dqw_estimator_q15_config& t = config_.estimator;
        const auto unit = [&](int i) { return unit_q15(t, i); };
        switch (channel) {
        case DQW_WATCH_OFFSET: return full_.i_A;
        case DQW_WATCH_RESISTANCE: return unit(DQW_R);
        case DQW_WATCH_REACTANCE: return 0.5 * (unit(DQW_LD) + unit(DQW_LQ));
        case DQW_WATCH_SHORT: return kQ40 * static_cast<double>(dqw_witness_short_q40(&t)) / unit(DQW_R);
        case DQW_WATCH_FRICTION: return 1.5 * t.scale.pole_pairs * unit(DQW_PSI) * full_.i_A;
        case DQW_WATCH_TEMPERATURE: return 1.0;
        case DQW_WATCH_RESIDUAL: return full_.v_V;
        default: return unit(channel);
        }
    }

    dqw_monitor_q15_config config_;
    const std::vector<dqw_effect_q15_config> effects_;
    const FullScales full_ = full_scales(config_.estimator.scale);
    dqw_monitor_q15 m_{};
    std::uint32_t not_numbers_ = 0;
};

}  // namespace

dqw_monitor_q15_config q15_monitor_config(const MonitorSetup& setup)
{
    return dqw_monitor_config_in_q15(&setup.config, DQW_Q15_ROOM);
}

std::unique_ptr<MonitorEngine> q15_monitor(const MonitorSetup& setup) { return std::make_unique<Q15Monitor>(setup); }

}  // namespace dqw
