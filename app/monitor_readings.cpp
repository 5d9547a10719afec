#include "monitor_readings.hpp"

#include <cmath>

namespace dqw {
namespace {

constexpr double nothing = std::numeric_limits<double>::quiet_NaN();

double tracked(const dqw_monitor& m, dqw_tracker_weight weight) { return static_cast<double>(dqw_tracker_value(&m.tracker, weight)); }

MonitorReading weight_reading(const dqw_monitor& m, int channel, bool watched)
{
    const auto weight = static_cast<dqw_tracker_weight>(channel);
    const auto sd = static_cast<double>(dqw_tracker_sd(&m.tracker, weight));
    if (!std::isfinite(sd)) return {};
    const double unit = channel_unit(m, channel);
    return {tracked(m, weight) * unit, sd * unit, watched ? static_cast<double>(m.healthy[channel]) * unit : nothing};
}

MonitorReading witness_reading(const dqw_monitor& m, int channel, bool watched)
{
    const auto input = static_cast<dqw_witness_input>(channel - DQW_WATCH_OFFSET);
    const auto sd = static_cast<double>(dqw_witness_sd(&m.witness, &m.tracker, input));
    if (!std::isfinite(sd)) return {};
    const double unit = channel_unit(m, channel);
    const auto healthy = static_cast<double>(std::hypot(m.healthy_re[input], m.healthy_im[input]));
    return {static_cast<double>(dqw_witness_size(&m.witness, input)) * unit, sd * unit, watched ? healthy * unit : nothing};
}

MonitorReading friction_reading(const dqw_monitor& m, bool in_service, bool watched)
{
    if (!in_service || m.watch.reversals == 0 || m.watch.looks[DQW_WATCH_FRICTION] == 0) return {};
    const double sd = std::sqrt(2.0 * static_cast<double>(m.spread_Nm2) / m.watch.reversals);
    return {static_cast<double>(m.friction_Nm), sd, watched ? static_cast<double>(m.healthy_friction_Nm) : nothing};
}

MonitorReading temperature_reading(const dqw_monitor& m, const MonitorReading& R, bool in_service)
{
    const auto alpha_per_K = static_cast<double>(dqw_monitor_config_of(&m)->alpha_per_K);
    const auto cold = static_cast<double>(m.cold_R_ohm);
    if (!in_service || !(alpha_per_K > 0.0) || !(cold > 0.0)) return {};
    return {(R.value / cold - 1.0) / alpha_per_K, R.sd / (cold * alpha_per_K), nothing};
}

MonitorReading residual_reading(const dqw_monitor& m, bool watched)
{
    if (m.tracker.blocks == 0) return {};
    const auto base = static_cast<double>(dqw_monitor_config_of(&m)->tracker.v_base_V);
    return {base * std::sqrt(static_cast<double>(m.residual_pu2)), nothing, watched ? base * std::sqrt(static_cast<double>(m.healthy_residual_pu2)) : nothing};
}

}  // namespace

double channel_unit(const dqw_monitor& m, int channel)
{
    const double L = 0.5 * (tracked(m, DQW_TRACK_LD) + tracked(m, DQW_TRACK_LQ));
    switch (channel) {
    case DQW_WATCH_ANGLE: return 1.0 / tracked(m, DQW_TRACK_PSI);
    case DQW_WATCH_RESISTANCE: return 3.0;
    case DQW_WATCH_REACTANCE: return 3.0 / L;
    case DQW_WATCH_SHORT: return 3.0;
    default: return 1.0;
    }
}

MonitorReadings readings_of(const dqw_monitor& m)
{
    const bool in_service = dqw_monitor_stage(&m) == DQW_STAGE_IN_SERVICE, watched = in_service && !m.watch.resting;
    MonitorReadings all;
    for (int channel = 0; channel < DQW_WATCH_CHANNELS; ++channel) {
        MonitorReading& r = all[static_cast<std::size_t>(channel)];
        if (channel < DQW_TRACK_WEIGHTS)
            r = weight_reading(m, channel, watched);
        else if (channel < DQW_WATCH_FRICTION)
            r = witness_reading(m, channel, watched);
        else if (channel == DQW_WATCH_FRICTION)
            r = friction_reading(m, in_service, watched);
        else if (channel == DQW_WATCH_TEMPERATURE)
            r = temperature_reading(m, all[DQW_WATCH_R], in_service);
        else
            r = residual_reading(m, watched);
    }
    return all;
}

}  // namespace dqw
