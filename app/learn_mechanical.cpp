#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

#include "learn_inputs.hpp"
#include "learn_parts.hpp"
#include "learn_residual.hpp"
#include "learn_signals.hpp"

namespace dqw {
namespace {

constexpr double kHalfWindow_s = 25e-3;
// Half a block may see this much of a cogging's own angle.
constexpr double kHalfAngle_rad = 1.5;

float at(const std::vector<double>& column, std::size_t row) { return column.empty() ? 0.0F : static_cast<float>(column[row]); }

std::uint16_t half_window_of(double dt_s, const std::vector<TraceInput>& inputs, double w_m_rad_s)
{
    double span_s = kHalfWindow_s;
    int least = 10;
    for (const TraceInput& in : inputs)
        if (in.effect == "cogging_torque" && kHalfAngle_rad / (in.shape[0] * w_m_rad_s) < span_s) {
            span_s = kHalfAngle_rad / (in.shape[0] * w_m_rad_s);
            least = 3;
        }
    return half_window(span_s, dt_s, least);
}

void put(Result& result, const char* name, float value, float sd, bool known, const char* why, const char* excitation)
{
    if (known)
        result.parameters.push_back({name, value, sd, false});
    else
        result.not_identifiable.push_back(
            {name, std::isfinite(sd) ? fmt::format("{}: {:.3g} with a deviation of {:.3g}", why, value, sd) : std::string(why), excitation});
}

}  // namespace

Learned learn_mechanical(const std::vector<Log>& logs, const LearnOptions& options)
{
    const Log& first = logs.front();
    const double torque_constant = first.machine.torque_constant_Nm_A.value_or(0.0);
    Learned learned;
    Result& result = learned.result;
    result.rows = all_rows(logs);
    result.regime = Regime::mechanical;
    check_room(options.inputs);
    const std::vector<TraceInput> inputs = options.inputs.empty() ? options.inputs : completed(options.inputs, logs, {});
    const std::vector<dqw_effect_config> list = lists_of(inputs);

    std::vector<std::vector<double>> torques;
    std::string source;
    double largest_torque = 0.0;
    for (const Log& log : logs) {
        torques.push_back(torque_of(log, torque_constant, source));
        for (double t : torques.back()) largest_torque = std::max(largest_torque, std::abs(t));
    }
    result.notes.push_back("torque: " + source);

    dqw_mechanical_config config{};
    config.dt_s = static_cast<float>(first.dt_s);
    config.torque_base_Nm = largest_torque > 1e-30 ? static_cast<float>(largest_torque) : 1.0F;
    config.w_base_rad_s = largest(logs, &Log::w_m_rad_s, &Log::w_m_rad_s);
    config.J_kgm2 = nominal(first.machine, options.start, &Machine::J_kgm2);
    config.B_Nms_rad = nominal(first.machine, options.start, &Machine::B_Nms_rad);
    config.half_window = half_window_of(first.dt_s, inputs, static_cast<double>(config.w_base_rad_s));
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
    for (std::size_t n = 0; n < logs.size(); n++) {
        const Log& log = logs[n];
        const bool both = !log.torque_Nm.empty() && !log.i_q_A.empty();
        const std::vector<float> angle = inputs.empty() ? std::vector<float>(log.rows()) : shaft_angle_of(log);
        walk(
            log, done, result.rows, options, [&] { dqw_mechanical_gap(&m); },
            [&](std::size_t k, bool held) {
                if (held) return;
                dqw_mechanical_step_at(&m, static_cast<float>(torques[n][k]), at(log.w_m_rad_s, k), angle[k]);
                const float i_q = at(log.i_q_A, k);
                if (both) dqw_axis_learn(&torque_axis, &i_q, at(log.torque_Nm, k), 1);
            });
    }

    const Asked asked{options.parameters, {"J_kgm2", "B_Nms_rad"}};
    const dqw_friction f = dqw_mechanical_read(&m);
    if (asked("J_kgm2")) put(result, "J_kgm2", f.J_kgm2, f.J_sd_kgm2, f.J_known, "the speed hardly changes", "steps of torque that accelerate the machine");
    if (asked("B_Nms_rad"))
        put(result, "B_Nms_rad", f.B_Nms_rad, f.B_sd_Nms_rad, f.B_known, "no torque that grows with speed stands out",
            "several speeds, held long enough, in both directions");
    if (asked("torque_constant_Nm_A")) {
        const float kt = dqw_learner_weight(&torque_axis.neuron, 0);
        const float sd = dqw_axis_weight_sd(&torque_axis, 0);
        put(result, "torque_constant_Nm_A", kt, sd, kt > 0.0F && sd < DQW_KNOWN_RATIO * kt, "torque_Nm and i_q_A are not both logged, or hardly change",
            "a log with torque_Nm and i_q_A at several levels");
    }
    note_gate(m.gate, 0, result);
    PlainModel& model = learned.model;
    model.J_kgm2 = f.J_kgm2;
    model.B_Nms_rad = f.B_Nms_rad;
    model.torque_constant_Nm_A = torque_constant;
    std::vector<InputRead> read;
    for (std::size_t n = 0; n < inputs.size(); n++) {
        float w[DQW_EFFECT_STARTS], sd[DQW_EFFECT_STARTS];
        const auto weights = static_cast<std::size_t>(dqw_effect_weights(list[n].effect));
        const int known = dqw_mechanical_effect(&m, static_cast<int>(n), w, sd);
        read.push_back({inputs[n], std::vector<double>(sd, sd + weights), static_cast<std::uint32_t>(known)});
        read.back().input.weights.assign(w, w + weights);
    }
    put_effects(read, learned);
    report_residual_of(logs, learned.inputs, model, nullptr, result);
    return learned;
}

}  // namespace dqw
