#include "app/monitor/float.hpp"

#include <cmath>
#include <stdexcept>

#include "app/learn/parts.hpp"
#include "dqw_estimator_block.h"
#include "dqw_estimator_random.h"
#include "dqw_monitor.h"
#include "dqw_number.h"
#include "dqw_text.h"

namespace dqw {
namespace {

class FloatMonitor : public MonitorEngine {
public:
    explicit FloatMonitor(const MonitorSetup& setup) : config_(setup.config), effects_(lists_of(setup.inputs))
    {
        config_.estimator.effects = effects_.data();
        config_.estimator.effect_count = static_cast<std::uint8_t>(effects_.size());
        config_.estimator.random = &lent_;
        dqw_estimator_random_init(&lent_);
        accept(dqw_monitor_init(&m_, &config_));
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
        const std::uint64_t half = m_.estimator.window.half;
        return MonitorTold{static_cast<std::uint32_t>(e.sample / half),
                           static_cast<std::uint32_t>(e.since / half),
                           e.parameter,
                           static_cast<double>(e.value) * unit,
                           sd_of(e.sd) * unit,
                           e.fault};
    }

    void define() override
    {
        dqw_estimator_random_init(&lent_);
        accept(dqw_monitor_define(&m_, &config_));
    }

    std::uint32_t halves() const override { return m_.estimator.halves; }

    MonitorMeasures measures() const override
    {
        MonitorMeasures r{};
        for (int i = 0; i < DQW_PARAMETERS; ++i) {
            const auto at = static_cast<std::size_t>(i);
            r.weight[at] = static_cast<double>(dqw_estimator_value(&m_.estimator, i));
            r.weight_sd[at] = sd_of(dqw_estimator_sd(&m_.estimator, i));
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
        r.blocks = m_.estimator.blocks;
        r.friction_known = m_.watch.reversals > 0 && m_.watch.looks[DQW_WATCH_FRICTION] > 0;
        r.in_service = m_.estimator.stage.name == DQW_STAGE_IN_SERVICE;
        r.resting = m_.watch.resting;
        return r;
    }

    MonitorState state() const override
    {
        return {m_.estimator.stage,
                m_.estimator.gate,
                static_cast<double>(dqw_estimator_residual_pu(&m_.estimator)),
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
            throw std::invalid_argument(std::string("the monitor refuses its configuration: ") +
                                        dqw_status_text(status));
    }

    static double sd_of(float sd) { return sd < DQW_UNKNOWN ? static_cast<double>(sd) : INFINITY; }

    dqw_monitor_config config_;
    const std::vector<dqw_effect_config> effects_;
    dqw_estimator_random lent_{};
    dqw_monitor m_{};
};

}  // namespace

std::unique_ptr<MonitorEngine> float_monitor(const MonitorSetup& setup)
{
    return std::make_unique<FloatMonitor>(setup);
}

}  // namespace dqw
