#include "app/monitor/readings.hpp"

#include <cmath>

namespace dqw {
namespace {

constexpr double nothing = std::numeric_limits<double>::quiet_NaN();

MonitorReading known_where(double value, double sd, double healthy, double unit, bool watched)
{
    if (!std::isfinite(sd)) return {};
    return {value * unit, sd * unit, watched ? healthy * unit : nothing};
}

MonitorReading temperature_reading(const MonitorMeasures& m, const MonitorReading& R)
{
    if (!m.in_service || !(m.alpha_per_K > 0.0) || !(m.cold_R_ohm > 0.0)) return {};
    return {(R.value / m.cold_R_ohm - 1.0) / m.alpha_per_K, R.sd / (m.cold_R_ohm * m.alpha_per_K), nothing};
}

}  // namespace

double channel_unit(const MonitorMeasures& m, int channel)
{
    const double L = 0.5 * (m.weight[DQW_LD] + m.weight[DQW_LQ]);
    switch (channel) {
    case DQW_WATCH_ANGLE: return 1.0 / m.weight[DQW_PSI];
    case DQW_WATCH_RESISTANCE: return 3.0;
    case DQW_WATCH_REACTANCE: return 3.0 / L;
    case DQW_WATCH_SHORT: return 3.0;
    default: return 1.0;
    }
}

MonitorReadings readings_of(const MonitorMeasures& m)
{
    const bool watched = m.in_service && !m.resting;
    MonitorReadings all;
    for (std::size_t i = 0; i < m.weight.size(); ++i)
        all[i] = known_where(m.weight[i], m.weight_sd[i], m.healthy[i], channel_unit(m, static_cast<int>(i)), watched);
    for (std::size_t k = 0; k < m.ripple.size(); ++k)
        all[DQW_WATCH_OFFSET + k] = known_where(m.ripple[k], m.ripple_sd[k], m.healthy_ripple[k],
                                                channel_unit(m, DQW_WATCH_OFFSET + static_cast<int>(k)), watched);
    if (m.in_service && m.friction_known)
        all[DQW_WATCH_FRICTION] = known_where(m.friction_Nm, m.friction_sd_Nm, m.healthy_friction_Nm, 1.0, watched);
    all[DQW_WATCH_TEMPERATURE] = temperature_reading(m, all[DQW_WATCH_R]);
    if (m.blocks > 0) all[DQW_WATCH_RESIDUAL] = {m.residual_V, nothing, watched ? m.healthy_residual_V : nothing};
    return all;
}

}  // namespace dqw
