#include "app/monitor/engine.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <stdexcept>

#include "app/learn/parts.hpp"
#include "app/monitor/image.hpp"
#include "app/q15/effect_q15.hpp"
#include "app/q15/fixed_point.hpp"
#include "app/q15/monitor_config.h"
#include "dqw_estimator_block.h"
#include "dqw_estimator_block_q15.h"
#include "dqw_estimator_random.h"
#include "dqw_monitor.h"
#include "dqw_monitor_channel.h"
#include "dqw_monitor_channel_q15.h"
#include "dqw_number.h"
#include "dqw_text.h"

namespace dqw {
namespace {

/// What the monitors of both ports keep under the same names.
template <class Monitor> class PortMonitor : public MonitorEngine {
public:
    std::uint32_t halves() const override { return m_.estimator.halves; }

protected:
    static void accept(dqw_status status, const char* who)
    {
        if (status != DQW_OK)
            throw std::invalid_argument(
                fmt::format("the {} refuses its configuration: {}", who, dqw_status_text(status)));
    }

    template <class Change> MonitorTold told(const Change& e, double value, double sd, dqw_fault_verdict fault) const
    {
        const std::uint64_t half = m_.estimator.window.half;
        return {static_cast<std::uint32_t>(e.sample / half),
                static_cast<std::uint32_t>(e.since / half),
                e.parameter,
                value,
                sd,
                fault};
    }

    /// All but what has been measured.
    MonitorMeasures no_measures() const
    {
        MonitorMeasures r{};
        r.blocks = m_.estimator.blocks;
        r.friction_known = m_.watch.reversals > 0 && m_.watch.looks[DQW_WATCH_FRICTION] > 0;
        r.in_service = m_.estimator.stage.name == DQW_STAGE_IN_SERVICE;
        r.resting = m_.watch.resting;
        return r;
    }

    template <class Stored, class Give> static std::string bytes_of(const Give& give)
    {
        Stored stored{};
        if (!give(&stored)) return "";
        return {reinterpret_cast<const char*>(&stored), sizeof stored};
    }

    template <class Stored, class Take> static std::string taken(const std::string& bytes, const Take& take)
    {
        Stored stored{};
        if (bytes.size() != sizeof stored) return "its size is another";
        std::memcpy(&stored, bytes.data(), sizeof stored);
        const dqw_status status = take(&stored);
        return status == DQW_OK ? "" : dqw_status_text(status);
    }

    MonitorState state_with(const dqw_stage& stage, const dqw_gate& gate, double residual_pu) const
    {
        return {stage,
                gate,
                residual_pu,
                m_.estimator.blocks,
                m_.estimator.missed,
                m_.estimator.restarts,
                m_.witness.blocks,
                m_.watch.looks[DQW_WATCH_FRICTION]};
    }

    Monitor m_{};
};

/// Of lib/.
class FloatMonitor : public PortMonitor<dqw_monitor> {
public:
    explicit FloatMonitor(const MonitorSetup& setup) : config_(setup.config), effects_(lists_of(setup.inputs))
    {
        config_.estimator.effects = effects_.data();
        config_.estimator.effect_count = static_cast<std::uint8_t>(effects_.size());
        config_.estimator.random = &lent_;
        dqw_estimator_random_init(&lent_);
        accept(dqw_monitor_init(&m_, &config_), "monitor");
    }

    void gap(std::uint32_t periods) override { dqw_monitor_missing(&m_, periods); }

    bool sample(const dqw_sample& s) override
    {
        (void)dqw_monitor_sample(&m_, &s, false);
        return m_.estimator.window.over.pending;
    }

    std::optional<MonitorTold> background() override
    {
        dqw_monitor_change e{};
        if (!dqw_monitor_background(&m_) || !dqw_monitor_event(&m_, &e)) return std::nullopt;
        const double unit = channel_unit(measures(), e.parameter);
        return told(e, static_cast<double>(e.value) * unit, sd_of(e.sd) * unit, e.fault);
    }

    std::string image() const override
    {
        std::string bytes;
        put_image(bytes, without_pointers(m_));
        put_image(bytes, without_pointers(lent_));
        return bytes;
    }

    bool take(std::string_view image) override
    {
        dqw_monitor m;
        dqw_estimator_random lent;
        if (!take_image(image, m) || !take_image(image, lent) || !image.empty()) return false;
        point_as(m, m_), point_as(lent, lent_);
        m_ = m, lent_ = lent;
        return true;
    }

    void define() override
    {
        dqw_estimator_random_init(&lent_);
        accept(dqw_monitor_define(&m_, &config_), "monitor");
    }

    std::string store() const override
    {
        return bytes_of<dqw_monitor_stored>([&](dqw_monitor_stored* s) { return dqw_monitor_store(&m_, s); });
    }
    std::string restore(const std::string& stored) override
    {
        return taken<dqw_monitor_stored>(stored,
                                         [&](const dqw_monitor_stored* s) { return dqw_monitor_restore(&m_, s); });
    }

    MonitorMeasures measures() const override
    {
        MonitorMeasures r = no_measures();
        for (int i = 0; i < DQW_WATCH_OFFSET; ++i) {
            const auto at = static_cast<std::size_t>(i);
            const dqw_reading now = dqw_monitor_read(&m_, static_cast<dqw_monitor_channel>(i));
            r.weight[at] = static_cast<double>(now.value);
            r.weight_sd[at] = sd_of(now.sd);
            r.healthy[at] = static_cast<double>(m_.healthy.weight[i]);
        }
        for (int k = 0; k < DQW_WITNESS_INPUTS; ++k) {
            const auto input = static_cast<dqw_witness_input>(k);
            r.ripple[input] = static_cast<double>(dqw_witness_size(&m_.witness, input));
            r.ripple_sd[input] = sd_of(dqw_witness_sd(&m_.witness, &m_.estimator, input));
            r.healthy_ripple[input] = std::hypot(static_cast<double>(m_.healthy.re[input]),
                                                 static_cast<double>(m_.healthy.im[input]));
        }
        r.friction_Nm = static_cast<double>(m_.friction_Nm);
        r.friction_sd_Nm = std::sqrt(2.0 * static_cast<double>(m_.spread_Nm2) / m_.watch.reversals);
        r.healthy_friction_Nm = static_cast<double>(m_.healthy.friction_Nm);
        r.cold_R_ohm = static_cast<double>(m_.healthy.cold_R_ohm);
        r.alpha_per_K = static_cast<double>(config_.alpha_per_K);
        const auto base_V = static_cast<double>(config_.estimator.v_base_V);
        r.residual_V = base_V * std::sqrt(static_cast<double>(m_.estimator.recent_pu2));
        r.healthy_residual_V = base_V * std::sqrt(static_cast<double>(m_.healthy.residual_pu2));
        return r;
    }

    MonitorState state() const override
    {
        return state_with(m_.estimator.stage, m_.estimator.gate,
                          static_cast<double>(dqw_estimator_residual_pu(&m_.estimator)));
    }

    MonitorSights sights() const override
    {
        const MonitorMeasures now = measures();
        MonitorSights all;
        for (int i = 0; i < DQW_WATCH_CHANNELS; ++i) {
            const auto channel = static_cast<dqw_monitor_channel>(i);
            const float least = dqw_monitor_sensitivity(&m_, channel);
            MonitorSight& s = all[static_cast<std::size_t>(i)];
            if (least < DQW_UNKNOWN) s.least = static_cast<double>(least) * channel_unit(now, i);
            if (i < DQW_WATCH_TEMPERATURE && m_.healthy.weight[DQW_R] > 0.0F)
                s.band = static_cast<double>(dqw_monitor_band_of(&m_, i)) * channel_unit(now, i);
            s.why = dqw_monitor_unwatched(&m_, channel);
        }
        return all;
    }

private:
    static double sd_of(float sd) { return sd < DQW_UNKNOWN ? static_cast<double>(sd) : INFINITY; }

    dqw_monitor_config config_;
    const std::vector<dqw_effect_config> effects_;
    dqw_estimator_random lent_{};
};

constexpr double kFaultRoom = DQW_Q15_ROOM;
constexpr double kQ24 = 0x1p-24, kQ28 = 0x1p-28, kQ40 = 0x1p-40;

std::vector<dqw_effect_q15_config> effects_of(const MonitorSetup& setup, const dqw_scale& scale)
{
    std::vector<dqw_effect_q15_config> list;
    for (const TraceInput& in : setup.inputs) list.push_back(effect_config_q15(in, full_scales(scale), 1.0, 0.0));
    return list;
}

/// Of port_q15/.
class Q15Monitor : public PortMonitor<dqw_monitor_q15> {
public:
    explicit Q15Monitor(const MonitorSetup& setup)
        : config_(q15_monitor_config(setup)), effects_(effects_of(setup, config_.estimator.scale))
    {
        config_.estimator.effects = effects_.data();
        config_.estimator.effect_count = static_cast<std::uint8_t>(effects_.size());
        accept(dqw_monitor_init_q15(&m_, &config_), "fixed-point monitor");
    }

    void gap(std::uint32_t periods) override { dqw_monitor_missing_q15(&m_, periods); }

    bool sample(const dqw_sample& s) override
    {
        dqw_sample_q15 x;
        const bool good = fixed(s, full_, x);
        const std::uint32_t before = m_.estimator.gate.nonfinite;
        (void)dqw_monitor_sample_q15(&m_, &x, !good);
        // Sixteen bits have no not-a-number: the port is told of a limit, and it is counted here. With an angle it sees
        // by itself that there is none.
        if (!good && m_.estimator.gate.nonfinite == before) ++not_numbers_;
        return m_.estimator.window.over.pending;
    }

    std::optional<MonitorTold> background() override
    {
        dqw_monitor_change_q15 e{};
        if (!dqw_monitor_background_q15(&m_) || !dqw_monitor_event_q15(&m_, &e)) return std::nullopt;
        const double unit = kQ40 * unit_of(e.parameter) * channel_unit(measures(), e.parameter);
        return told(e, static_cast<double>(e.value_q40) * unit, sd_of(e.sd_q40) * unit,
                    {e.fault.name, static_cast<float>(e.fault.confidence_q15) / 32768.0F, e.fault.phase});
    }

    std::string image() const override
    {
        std::string bytes;
        put_image(bytes, without_pointers(m_));
        put_image(bytes, not_numbers_);
        return bytes;
    }

    bool take(std::string_view image) override
    {
        dqw_monitor_q15 m;
        std::uint32_t not_numbers = 0;
        if (!take_image(image, m) || !take_image(image, not_numbers) || !image.empty()) return false;
        point_as(m, m_);
        m_ = m, not_numbers_ = not_numbers;
        return true;
    }

    void define() override { accept(dqw_monitor_define_q15(&m_, &config_), "fixed-point monitor"); }

    std::string store() const override
    {
        return bytes_of<dqw_monitor_stored_q15>(
            [&](dqw_monitor_stored_q15* s) { return dqw_monitor_store_q15(&m_, s); });
    }
    std::string restore(const std::string& stored) override
    {
        return taken<dqw_monitor_stored_q15>(
            stored, [&](const dqw_monitor_stored_q15* s) { return dqw_monitor_restore_q15(&m_, s); });
    }

    MonitorMeasures measures() const override
    {
        MonitorMeasures r = no_measures();
        for (int i = 0; i < DQW_WATCH_OFFSET; ++i) {
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
        return state_with(stage, gate, kFaultRoom * dqw_estimator_residual_q28(&m_.estimator) * kQ28);
    }

    MonitorSights sights() const override
    {
        const MonitorMeasures now = measures();
        MonitorSights all;
        for (int i = 0; i < DQW_WATCH_CHANNELS; ++i) {
            const auto channel = static_cast<dqw_monitor_channel>(i);
            const std::int64_t least_q40 = dqw_monitor_sensitivity_q15(&m_, channel);
            MonitorSight& s = all[static_cast<std::size_t>(i)];
            if (least_q40 != INT64_MAX)
                s.least = static_cast<double>(least_q40) * kQ40 * unit_of(i) * channel_unit(now, i);
            if (i < DQW_WATCH_TEMPERATURE && m_.healthy.weight_q24[DQW_R] > 0)
                s.band = dqw_monitor_band_of_q15(&m_, i) * kQ24 * unit_of(i) * channel_unit(now, i);
            s.why = dqw_monitor_unwatched_q15(&m_, channel);
        }
        return all;
    }

private:
    dqw_reading_q15 read(int channel) const
    {
        return dqw_monitor_read_q15(&m_, static_cast<dqw_monitor_channel>(channel));
    }

    static double sd_of(std::int64_t sd_q40) { return sd_q40 == INT64_MAX ? INFINITY : static_cast<double>(sd_q40); }

    double unit_of(int channel) const { return channel_unit_q15(config_.estimator, channel); }

    dqw_monitor_q15_config config_;
    const std::vector<dqw_effect_q15_config> effects_;
    const FullScales full_ = full_scales(config_.estimator.scale);
    std::uint32_t not_numbers_ = 0;
};

}  // namespace

dqw_monitor_q15_config q15_monitor_config(const MonitorSetup& setup)
{
    return dqw_monitor_config_in_q15(&setup.config, DQW_Q15_ROOM);
}

double channel_unit_q15(const dqw_estimator_q15_config& c, int channel)
{
    const auto unit = [&](int i) { return unit_q15(c, i); };
    const FullScales full = full_scales(c.scale);
    switch (channel) {
    case DQW_WATCH_OFFSET: return full.i_A;
    case DQW_WATCH_RESISTANCE: return unit(DQW_R);
    case DQW_WATCH_REACTANCE: return 0.5 * (unit(DQW_LD) + unit(DQW_LQ));
    case DQW_WATCH_SHORT: return kQ40 * static_cast<double>(dqw_witness_short_q40(&c)) / unit(DQW_R);
    case DQW_WATCH_FRICTION: return 1.5 * c.scale.pole_pairs * unit(DQW_PSI) * full.i_A;
    case DQW_WATCH_TEMPERATURE:
    case DQW_WATCH_MAP_D:
    case DQW_WATCH_MAP_Q: return 1.0;
    case DQW_WATCH_RESIDUAL: return full.v_V;
    default: return unit(channel);
    }
}

std::unique_ptr<MonitorEngine> monitor_engine(const MonitorSetup& setup, bool fixed_point)
{
    if (fixed_point) return std::make_unique<Q15Monitor>(setup);
    return std::make_unique<FloatMonitor>(setup);
}

}  // namespace dqw
