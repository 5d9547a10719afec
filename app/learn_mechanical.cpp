#include "learn_mechanical.hpp"

#include <cmath>
#include <stdexcept>

#include "learn_signals.hpp"

namespace dqw {
namespace {

float at(const std::vector<double>& column, std::size_t row) { return column.empty() ? 0.0F : static_cast<float>(column[row]); }

ShaftValue torque_constant_of(const dqw_axis& axis)
{
    const float kt = dqw_learner_weight(&axis.neuron, 0);
    const float sd = dqw_axis_weight_sd(&axis, 0);
    return {kt, sd, kt > 0.0F && sd < DQW_KNOWN_RATIO * kt};
}

}  // namespace

Learned learn_mechanical(const std::vector<Log>& logs, const LearnOptions& options)
{
    const Log& first = logs.front();
    const ShaftLogs shaft = shaft_logs(logs, options);
    const std::vector<dqw_effect_config> list = lists_of(shaft.inputs);

    dqw_mechanical_config config{};
    config.dt_s = static_cast<float>(first.dt_s);
    config.torque_base_Nm = static_cast<float>(shaft.largest_torque_Nm);
    config.w_base_rad_s = static_cast<float>(shaft.largest_w_rad_s);
    config.J_kgm2 = nominal(first.machine, options.start, &Machine::J_kgm2);
    config.B_Nms_rad = nominal(first.machine, options.start, &Machine::B_Nms_rad);
    config.half_window = shaft.half_window;
    config.effects = list.data();
    config.effect_count = static_cast<std::uint8_t>(list.size());
    dqw_mechanical m;
    if (dqw_mechanical_init(&m, &config) != DQW_OK) throw std::invalid_argument("the learners refuse these bases, nominal values or shapes of effects");

    // K_t from the same neuron with one static input.
    dqw_learner_config torque_config{};
    torque_config.inputs = 1;
    torque_config.step_size = 1.0F;
    torque_config.x_base[0] = largest(logs, &Log::i_q_A, &Log::i_q_A);
    torque_config.y_base = config.torque_base_Nm;
    dqw_axis torque_axis;
    if (dqw_axis_init(&torque_axis, &torque_config) != DQW_OK) throw std::invalid_argument("the learners refuse these bases");

    std::size_t done = 0;
    const std::size_t total = all_rows(logs);
    for (std::size_t n = 0; n < logs.size(); n++) {
        const Log& log = logs[n];
        const bool both = !log.torque_Nm.empty() && !log.i_q_A.empty();
        const std::vector<float> angle = shaft.inputs.empty() ? std::vector<float>(log.rows()) : shaft_angle_of(log);
        walk(
            log, done, total, options, [&] { dqw_mechanical_gap(&m); },
            [&](std::size_t k, bool held) {
                if (held) return;
                const std::uint32_t event = dqw_mechanical_step_at(&m, static_cast<float>(shaft.torques[n][k]), at(log.w_m_rad_s, k), angle[k]);
                const float i_q = at(log.i_q_A, k);
                if (both) dqw_axis_learn(&torque_axis, &i_q, at(log.torque_Nm, k), 1);
                if ((event & DQW_EVENT_LEARNED) == 0 || !options.block) return;
                const dqw_friction now = dqw_mechanical_read(&m);
                options.block(log.t_s[k], {static_cast<double>(now.J_kgm2), static_cast<double>(now.B_Nms_rad), 0.0, 0.0});
            });
    }

    const dqw_friction f = dqw_mechanical_read(&m);
    ShaftRead read{{f.J_kgm2, f.J_sd_kgm2, f.J_known}, {f.B_Nms_rad, f.B_sd_Nms_rad, f.B_known}, torque_constant_of(torque_axis), {}};
    for (std::size_t n = 0; n < shaft.inputs.size(); n++) {
        float w[DQW_EFFECT_STARTS], sd[DQW_EFFECT_STARTS];
        const auto weights = static_cast<std::size_t>(dqw_effect_weights(list[n].effect));
        const int known = dqw_mechanical_effect(&m, static_cast<int>(n), w, sd);
        read.inputs.push_back({shaft.inputs[n], std::vector<double>(sd, sd + weights), static_cast<std::uint32_t>(known)});
        read.inputs.back().input.weights.assign(w, w + weights);
    }
    Learned learned;
    report_shaft(logs, options, shaft, read, m.gate, learned);
    return learned;
}

}  // namespace dqw
