#include "app/learn/mechanical_q15.hpp"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

#include "app/base/effect_names.hpp"
#include "app/learn/shaft.hpp"
#include "app/learn/signals.hpp"
#include "app/learn/torque_constant.hpp"
#include "app/q15/fixed_point.hpp"
#include "dqw_shaft_q15.h"

namespace dqw {
namespace {

struct Units {
    double torque_Nm, w_rad_s, J_kgm2, B_Nms_rad;
};

Units units_of(const dqw_shaft_scale& scale)
{
    const double torque = 1e-6 * scale.torque_full_uNm, w = 1e-3 * scale.w_full_mrad_s;
    return {torque, w, torque * 1e-9 * scale.dt_ns / w, torque / w};
}

dqw_torque_q15_config torque_config(const TraceInput& input)
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

double sd_of(std::int64_t sd_q40, double unit) { return sd_q40 == INT64_MAX ? INFINITY : si(sd_q40, unit); }

/// Known where the deviation is below a quarter of the value: what a report may still name.
ShaftValue value_of(const dqw_reading_q15& r, double unit)
{
    const double value = si(r.value_q40, unit), sd = sd_of(r.sd_q40, unit);
    return {value, sd, value > 0.0 && sd < kKnownRatio * value};
}

}  // namespace

Learned learn_mechanical_q15(const std::vector<Log>& logs, const LearnOptions& options)
{
    const Log& first = logs.front();
    const ShaftLogs shaft = shaft_logs(logs, options);
    std::vector<dqw_torque_q15_config> list;
    for (const TraceInput& in : shaft.inputs) list.push_back(torque_config(in));

    dqw_shaft_q15_config config{};
    config.scale.torque_full_uNm = full_scale(shaft.largest_torque_Nm, 1e6, "a torque", DQW_SHAFT_TORQUE_MAX);
    config.scale.w_full_mrad_s = full_scale(shaft.largest_w_rad_s, 1e3, "a speed", DQW_SCALE_MAX);
    config.scale.dt_ns = whole(1e9 * first.dt_s);
    config.J_gmm2 = whole(1e9 * static_cast<double>(nominal(first.machine, options.start, &Machine::J_kgm2)));
    config.B_nNms_rad = whole(1e9 * static_cast<double>(nominal(first.machine, options.start, &Machine::B_Nms_rad)));
    config.half_window = static_cast<std::uint8_t>(std::min<std::uint16_t>(shaft.half_window, DQW_WINDOW_Q15_HALF));
    // lib/'s threshold, of the largest signal: a coarse encoder puts many blocks right at it.
    config.excitation_q15 = static_cast<std::uint16_t>(std::lround(0.002 / kRoom * 32768.0));
    // A host has the time to solve after every block, as the float learners do.
    config.solve_blocks = 1;
    config.effects = list.data();
    config.effect_count = static_cast<std::uint8_t>(list.size());
    dqw_shaft_q15 m;
    if (dqw_shaft_init_q15(&m, &config) != DQW_OK)
        throw std::invalid_argument(
            "the fixed-point learners refuse these full scales, nominal values or shapes of effects");
    const Units units = units_of(config.scale);
    // As sixteen bits give it.
    const double i_full_A = kRoom * static_cast<double>(largest(logs, &Log::i_q_A, &Log::i_q_A));
    const auto quantised = [](double x, double full) { return q15(x, full) * full / 32768.0; };
    TorqueConstant torque_constant;

    std::size_t done = 0;
    const std::size_t total = all_rows(logs);
    for (std::size_t n = 0; n < logs.size(); n++) {
        const Log& log = logs[n];
        const bool both = !log.torque_Nm.empty() && !log.i_q_A.empty();
        const std::vector<float> angle = shaft.inputs.empty() ? std::vector<float>(log.rows()) : shaft_angle_of(log);
        walk(
            log, done, total, options, [&] { dqw_shaft_missing_q15(&m, 0); },
            [&](std::size_t k, bool held) {
                if (held) return;
                (void)dqw_shaft_sample_q15(&m, q15(shaft.torques[n][k], units.torque_Nm),
                                           q15(log.w_m_rad_s[k], units.w_rad_s), turn_of(static_cast<double>(angle[k])),
                                           false);
                if (both)
                    torque_constant.learn(quantised(log.i_q_A[k], i_full_A),
                                          quantised(log.torque_Nm[k], units.torque_Nm));
                if (!dqw_shaft_background_q15(&m) || !options.block) return;
                options.block(log.t_s[k], {si(dqw_shaft_read_q15(&m, DQW_J).value_q40, units.J_kgm2),
                                           si(dqw_shaft_read_q15(&m, DQW_B).value_q40, units.B_Nms_rad), 0.0, 0.0});
            });
    }

    ShaftRead read{value_of(dqw_shaft_read_q15(&m, DQW_J), units.J_kgm2),
                   value_of(dqw_shaft_read_q15(&m, DQW_B), units.B_Nms_rad),
                   torque_constant.read(),
                   {}};
    for (std::size_t n = 0; n < shaft.inputs.size(); n++) {
        std::int64_t w_q40[DQW_EFFECT_STARTS], sd_q40[DQW_EFFECT_STARTS];
        const int known = dqw_shaft_read_effect_q15(&m, static_cast<int>(n), w_q40, sd_q40);
        InputRead input{shaft.inputs[n], {}, static_cast<std::uint32_t>(known)};
        input.input.weights.clear();
        for (int i = 0; i < dqw_effect_weights(list[n].effect); ++i) {
            input.input.weights.push_back(si(w_q40[i], units.torque_Nm));
            input.sd.push_back(sd_of(sd_q40[i], units.torque_Nm));
        }
        read.inputs.push_back(input);
    }
    Learned learned;
    report_shaft(logs, options, shaft, read, m.gate, learned);
    learned.result.notes.push_back(
        fmt::format("fixed point; full scales {:.4g} Nm, {:.4g} rad/s", units.torque_Nm, units.w_rad_s));
    if (shaft.half_window > config.half_window)
        learned.result.notes.push_back(
            fmt::format("blocks of twice {} pairs, where float has twice {}", config.half_window, shaft.half_window));
    learned.unit = {units.J_kgm2, units.B_Nms_rad, 0.0, 0.0};
    return learned;
}

}  // namespace dqw
