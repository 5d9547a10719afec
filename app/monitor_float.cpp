// The monitor of lib/.
#include <cmath>
#include <limits>
#include <stdexcept>

#include "dqw_monitor.h"
#include "dqw_number.h"
#include "monitor_engine.hpp"

namespace dqw {
namespace {

/// What lib/ does not know is infinite here.
double deviation(float sd) { return sd < DQW_UNKNOWN ? static_cast<double>(sd) : std::numeric_limits<double>::infinity(); }

class FloatMonitor : public MonitorEngine {
public:
    explicit FloatMonitor(const MonitorSetup& setup) : config_(setup.config)
    {
        dqw_monitor_random_init(&lent_);
        accept(dqw_monitor_init(&m_, &config_, &lent_));
    }

    void gap(std::uint32_t periods) override { dqw_tracker_gap(&m_.tracker, periods); }

    bool sample(const dqw_sample& s) override
    {
        (void)dqw_monitor_sample(&m_, &s, false);
        return m_.tracker.pending;
    }

    std::optional<MonitorTold> background() override
    {
        dqw_monitor_event e{};
        if (!dqw_monitor_background(&m_, &e)) return std::nullopt;
        const double unit = channel_unit(measures(), e.parameter);
        return MonitorTold{e.half, e.since, e.parameter, static_cast<double>(e.value) * unit, static_cast<double>(e.sd) * unit, e.fault};
    }

    void define() override
    {
        dqw_monitor_random_init(&lent_);
        accept(dqw_monitor_define(&m_, &config_, &lent_));
    }

    std::uint32_t halves() const override { return m_.tracker.halves; }

    MonitorMeasures measures() const override
    {
        MonitorMeasures r{};
        for (int i = 0; i < DQW_TRACK_WEIGHTS; ++i) {
            const auto weight = static_cast<dqw_tracker_weight>(i);
            r.weight[weight] = static_cast<double>(dqw_tracker_value(&m_.tracker, weight));
            r.weight_sd[weight] = deviation(dqw_tracker_sd(&m_.tracker, weight));
            r.healthy[weight] = static_cast<double>(m_.healthy[weight]);
        }
        for (int k = 0; k < DQW_WITNESS_INPUTS; ++k) {
            const auto input = static_cast<dqw_witness_input>(k);
            r.ripple[input] = static_cast<double>(dqw_witness_size(&m_.witness, input));
            r.ripple_sd[input] = deviation(dqw_witness_sd(&m_.witness, &m_.tracker, input));
            r.healthy_ripple[input] = std::hypot(static_cast<double>(m_.healthy_re[input]), static_cast<double>(m_.healthy_im[input]));
        }
        r.friction_Nm = static_cast<double>(m_.friction_Nm);
        r.friction_sd_Nm = std::sqrt(2.0 * static_cast<double>(m_.spread_Nm2) / m_.watch.reversals);
        r.healthy_friction_Nm = static_cast<double>(m_.healthy_friction_Nm);
        r.cold_R_ohm = static_cast<double>(m_.cold_R_ohm);
        r.alpha_per_K = static_cast<double>(config_.alpha_per_K);
        const auto base_V = static_cast<double>(config_.tracker.v_base_V);
        r.residual_V = base_V * std::sqrt(static_cast<double>(m_.residual_pu2));
        r.healthy_residual_V = base_V * std::sqrt(static_cast<double>(m_.healthy_residual_pu2));
        r.blocks = m_.tracker.blocks;
        r.friction_known = m_.watch.reversals > 0 && m_.watch.looks[DQW_WATCH_FRICTION] > 0;
        r.in_service = m_.stage.name == DQW_STAGE_IN_SERVICE;
        r.resting = m_.watch.resting;
        return r;
    }

    MonitorState state() const override
    {
        return {m_.stage,
                m_.tracker.gate,
                static_cast<double>(dqw_tracker_residual_pu(&m_.tracker)),
                m_.tracker.blocks,
                m_.tracker.missed,
                m_.tracker.restarts,
                m_.witness.blocks,
                m_.watch.looks[DQW_WATCH_FRICTION]};
    }

private:
    static void accept(dqw_status status)
    {
        if (status != DQW_OK) throw std::invalid_argument("the monitor refuses these bases or nominal values");
    }

    const dqw_monitor_config& config_;
    dqw_monitor m_{};
    dqw_monitor_random lent_{};
};

}  // namespace

std::unique_ptr<MonitorEngine> float_monitor(const MonitorSetup& setup) { return std::make_unique<FloatMonitor>(setup); }

}  // namespace dqw
