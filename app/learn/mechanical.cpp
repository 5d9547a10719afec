#include "app/learn/mechanical.hpp"

#include "app/learn/shaft.hpp"

#include <cmath>
#include <stdexcept>

#include "app/learn/signals.hpp"
#include "app/learn/torque_constant.hpp"
#include "dqw_number.h"

namespace dqw {
namespace {

float at(const std::vector<double>& column, std::size_t row)
{
    return column.empty() ? 0.0F : static_cast<float>(column[row]);
}

double sd_of(float sd) { return sd < DQW_UNKNOWN ? static_cast<double>(sd) : INFINITY; }

/// Known where the deviation is below a quarter of the value: what a report may still name.
ShaftValue value_of(const dqw_reading& r)
{
    return {r.value, sd_of(r.sd), r.value > 0.0F && sd_of(r.sd) < kKnownRatio * static_cast<double>(r.value)};
}

}  // namespace

Learned learn_mechanical(const std::vector<Log>& logs, const LearnOptions& options)
{
    const Log& first = logs.front();
    const ShaftLogs shaft = shaft_logs(logs, options);
    const std::vector<dqw_effect_config> list = lists_of(shaft.inputs);

    dqw_shaft_config config{};
    config.dt_s = static_cast<float>(first.dt_s);
    config.torque_base_Nm = static_cast<float>(shaft.largest_torque_Nm);
    config.w_base_rad_s = static_cast<float>(shaft.largest_w_rad_s);
    config.J_kgm2 = nominal(first.machine, options.start, &Machine::J_kgm2);
    config.B_Nms_rad = nominal(first.machine, options.start, &Machine::B_Nms_rad);
    config.half_window = shaft.half_window;
    config.effects = list.data();
    config.effect_count = static_cast<std::uint8_t>(list.size());
    dqw_shaft m;
    if (dqw_shaft_init(&m, &config) != DQW_OK)
        throw std::invalid_argument("the learners refuse these bases, nominal values or shapes of effects");

    TorqueConstant torque_constant;

    std::size_t done = 0;
    const std::size_t total = all_rows(logs);
    for (std::size_t n = 0; n < logs.size(); n++) {
        const Log& log = logs[n];
        const bool both = !log.torque_Nm.empty() && !log.i_q_A.empty();
        const std::vector<float> angle = shaft.inputs.empty() ? std::vector<float>(log.rows()) : shaft_angle_of(log);
        walk(
            log, done, total, options, [&] { dqw_shaft_missing(&m, 0); },
            [&](std::size_t k, bool held) {
                if (held) return;
                (void)dqw_shaft_sample(&m, static_cast<float>(shaft.torques[n][k]), at(log.w_m_rad_s, k), angle[k],
                                       false);
                if (both) torque_constant.learn(log.i_q_A[k], log.torque_Nm[k]);
                if (!dqw_shaft_background(&m) || !options.block) return;
                options.block(log.t_s[k], {static_cast<double>(dqw_shaft_read(&m, DQW_J).value),
                                           static_cast<double>(dqw_shaft_read(&m, DQW_B).value), 0.0, 0.0});
            });
    }

    ShaftRead read{
        value_of(dqw_shaft_read(&m, DQW_J)), value_of(dqw_shaft_read(&m, DQW_B)), torque_constant.read(), {}};
    for (std::size_t n = 0; n < shaft.inputs.size(); n++) {
        float w[DQW_EFFECT_STARTS], sd[DQW_EFFECT_STARTS];
        const auto weights = static_cast<std::size_t>(dqw_effect_weights(list[n].effect));
        const int known = dqw_shaft_read_effect(&m, static_cast<int>(n), w, sd);
        read.inputs.push_back({shaft.inputs[n], {}, static_cast<std::uint32_t>(known)});
        read.inputs.back().input.weights.assign(w, w + weights);
        for (std::size_t i = 0; i < weights; i++) read.inputs.back().sd.push_back(sd_of(sd[i]));
    }
    Learned learned;
    report_shaft(logs, options, shaft, read, m.gate, learned);
    return learned;
}

}  // namespace dqw
