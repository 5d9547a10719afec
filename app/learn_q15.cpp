// The fixed-point learners of port_q15/ over logs, as a core without floating point would run them.
#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

#include "dqw_estimator_q15.h"
#include "fixed_point.hpp"
#include "learn_parts.hpp"
#include "learn_residual.hpp"
#include "learn_signals.hpp"

namespace dqw {
namespace {

const char* const names[] = {"R_ohm", "Ld_H", "Lq_H", "psi_Wb"};
const char* const excitations[] = {"a current of several levels on either axis, best at low speed",
                                   "a varying i_d, or a turning machine with i_d at several levels",
                                   "a varying i_q, or a turning machine with i_q at several levels",
                                   "a turning machine with i_d and i_q at several levels, and pole_pairs where they cannot be found"};

/// Full scales in SI, and what one unit of each parameter is.
struct Units {
    double v_V, i_A, w_rad_s, parameter[DQW_PARAMETERS_Q15];
};

Units units_of(const dqw_scale& scale)
{
    const double v = 1e-3 * scale.v_full_mV, i = 1e-3 * scale.i_full_mA, dt = 1e-9 * scale.dt_ns;
    return {v, i, 1e-3 * scale.w_full_mrad_s, {v / i, v * dt / i, v * dt / i, v * dt}};
}

dqw_estimator_q15_config config_of(const std::vector<Log>& logs, const LearnOptions& options, double pole_pairs)
{
    const Log& first = logs.front();
    const bool is_static = first.regime != Regime::dynamic;
    dqw_estimator_q15_config c{};
    c.settled = is_static;
    // A host has the time to read after every block, as the float learners do.
    c.read_blocks = 1;
    c.scale.v_full_mV = full_scale(largest(logs, &Log::v_d_V, &Log::v_q_V), 1e3, "a voltage", DQW_SCALE_MAX);
    c.scale.i_full_mA = full_scale(largest(logs, &Log::i_d_A, &Log::i_q_A), 1e3, "a current", DQW_SCALE_MAX);
    c.scale.w_full_mrad_s = full_scale(largest(logs, &Log::w_m_rad_s, &Log::w_m_rad_s), 1e3, "a speed", DQW_SCALE_MAX);
    // Settled rows have no period: a microsecond keeps inductances and flux of settled rows in range.
    c.scale.dt_ns = is_static ? 1000U : static_cast<std::uint32_t>(std::clamp(std::round(1e9 * first.dt_s), 1.0, 1e9));
    c.scale.pole_pairs = static_cast<std::uint16_t>(pole_pairs);
    c.R_uohm = whole(1e6 * static_cast<double>(nominal(first.machine, options.start, &Machine::R_ohm)));
    c.Ld_nH = whole(1e9 * static_cast<double>(nominal(first.machine, options.start, &Machine::Ld_H)));
    c.Lq_nH = whole(1e9 * static_cast<double>(nominal(first.machine, options.start, &Machine::Lq_H)));
    c.psi_nWb = whole(1e9 * static_cast<double>(nominal(first.machine, options.start, &Machine::psi_Wb)));
    if (!is_static)
        c.half_window = static_cast<std::uint8_t>(
            std::min<std::uint16_t>(half_window(kElectricalHalf_s, first.dt_s, kLeastElectricalHalf), DQW_WINDOW_Q15_HALF));
    return c;
}

void put(const dqw_parameters_q15& p, const Units& units, const Asked& asked, bool p_given, std::uint16_t said, Result& result)
{
    for (int i = 0; i < DQW_PARAMETERS_Q15; ++i) {
        if (!asked(names[i])) continue;
        const double value = si(p.value_q40[i], units.parameter[i]);
        const double sd = p.sd_q40[i] == INT64_MAX ? INFINITY : si(p.sd_q40[i], units.parameter[i]);
        if ((p.known >> i & 1U) != 0)
            result.parameters.push_back({names[i], value, sd, false});
        else
            result.not_identifiable.push_back({names[i],
                                               std::isfinite(sd) && value > 0.0 ? fmt::format("its deviation is {:.0f} % of it", 100.0 * sd / value)
                                                                                : std::string("its effect cannot be told from another parameter's"),
                                               excitations[i]});
    }
    if (p_given)
        result.parameters.push_back({"pole_pairs", static_cast<double>(said), 0.0, true});
    else if (p.pole_pairs != 0)
        result.parameters.push_back({"pole_pairs", static_cast<double>(p.pole_pairs), 0.0, false});
    else if (asked("pole_pairs") || asked("psi_Wb"))
        result.not_identifiable.push_back(
            {"pole_pairs", "the cross weights do not tell them", "currents that change on both axes while the machine turns, or --pole-pairs"});
}

}  // namespace

Learned learn_q15(const std::vector<Log>& logs, const LearnOptions& options)
{
    const Log& first = logs.front();
    if (!options.inputs.empty()) throw std::invalid_argument("effects are not in the fixed-point learners yet. Leave --arith q15 out");
    const std::optional<double> said = first.machine.pole_pairs ? first.machine.pole_pairs : options.start.pole_pairs;
    const dqw_estimator_q15_config config = config_of(logs, options, said.value_or(0.0));
    const Units units = units_of(config.scale);
    dqw_estimator_q15 e;
    if (dqw_estimator_init_q15(&e, &config) != DQW_OK) throw std::invalid_argument("the fixed-point learners refuse these full scales or nominal values");

    std::size_t done = 0;
    const std::size_t total = all_rows(logs);
    for (const Log& log : logs) {
        const SampleSource sample(log, said.value_or(0.0), {});
        walk(
            log, done, total, options, [&] { dqw_estimator_gap_q15(&e); },
            [&](std::size_t k, bool held) {
                if (held) return;
                const dqw_sample s = sample(k);
                const double all = static_cast<double>(s.v_d_V) + static_cast<double>(s.v_q_V) + static_cast<double>(s.i_d_A) + static_cast<double>(s.i_q_A) +
                                   static_cast<double>(s.w_m_rad_s);
                dqw_sample_q15 x{};
                if (std::isfinite(all))
                    x = {q15(static_cast<double>(s.v_d_V), units.v_V),         q15(static_cast<double>(s.v_q_V), units.v_V),
                         q15(static_cast<double>(s.i_d_A), units.i_A),         q15(static_cast<double>(s.i_q_A), units.i_A),
                         q15(static_cast<double>(s.w_m_rad_s), units.w_rad_s), 0};
                (void)dqw_estimator_step_q15(&e, &x, !std::isfinite(all));
                if ((dqw_estimator_background_q15(&e) & DQW_EVENT_LEARNED) == 0 || !options.block) return;
                // As read last: a reading of our own would change what follows.
                std::array<double, 4> now{};
                for (std::size_t i = 0; i < now.size(); ++i) now[i] = si(e.parameters.value_q40[i], units.parameter[i]);
                options.block(log.t_s.empty() ? static_cast<double>(k) : log.t_s[k], now);
            });
    }
    dqw_estimator_read_q15(&e);

    Learned learned;
    Result& result = learned.result;
    result.rows = total;
    result.regime = first.regime;
    Asked asked{options.parameters, {"R_ohm", "Ld_H", "Lq_H", "psi_Wb"}};
    if (first.regime == Regime::standstill) asked.defaults = {"R_ohm"};
    put(e.parameters, units, asked, said.has_value(), config.scale.pole_pairs, result);
    note_gate(e.gate, 0, result);
    result.notes.push_back(fmt::format("fixed point; full scales {:.4g} V, {:.4g} A, {:.4g} rad/s", units.v_V, units.i_A, units.w_rad_s));
    std::copy(std::begin(units.parameter), std::end(units.parameter), learned.unit.begin());
    PlainModel& model = learned.model;
    model.pole_pairs = e.parameters.pole_pairs != 0 ? e.parameters.pole_pairs : 1;
    double* const values[] = {&model.R_ohm, &model.Ld_H, &model.Lq_H, &model.psi_Wb};
    for (int i = 0; i < DQW_PARAMETERS_Q15; ++i) *values[i] = si(e.parameters.value_q40[i], units.parameter[i]);
    report_residual_of(logs, {}, model, nullptr, result);
    return learned;
}

dqw_estimator_q15_config q15_config_of(const std::vector<Log>& logs, const LearnOptions& options, double pole_pairs)
{
    return config_of(logs, options, pole_pairs);
}

}  // namespace dqw
