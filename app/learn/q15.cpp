#include "app/learn/q15.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "app/base/effect_names.hpp"
#include "app/learn/inputs.hpp"
#include "app/learn/parts.hpp"
#include "app/learn/passes.hpp"
#include "app/learn/signals.hpp"
#include "app/q15/effect_q15.hpp"
#include "app/q15/fixed_point.hpp"

namespace dqw {
namespace {

const char* const names[] = {"R_ohm", "Ld_H", "Lq_H", "psi_Wb"};
const char* const excitations[] = {
    "a current of several levels on either axis, best at low speed",
    "a varying i_d, or a turning machine with i_d at several levels",
    "a varying i_q, or a turning machine with i_q at several levels",
    "a turning machine with i_d and i_q at several levels, and pole_pairs where they cannot be found"};

/// Rows that the mean of the noise reaches over: of a shorter log none are spared for measuring it.
constexpr std::size_t kShort = DQW_NOISE_Q15_MEMORY;

struct Read {
    double value = 0.0, sd = INFINITY;
    bool known() const { return value > 0.0 && sd < kKnownRatio * value; }
};

Read read(const dqw_estimator_q15& e, int i)
{
    const dqw_reading_q15 r = dqw_estimator_read_q15(&e, static_cast<dqw_parameter>(i));
    const double unit = unit_q15(*e.config, i);
    return {si(r.value_q40, unit), r.sd_q40 == INT64_MAX ? INFINITY : si(r.sd_q40, unit)};
}

dqw_estimator_q15_config config_of(const std::vector<Log>& logs, const LearnOptions& options,
                                   const std::vector<TraceInput>& inputs, double pole_pairs)
{
    const Log& first = logs.front();
    const bool is_static = first.regime != Regime::dynamic;
    dqw_estimator_q15_config c{};
    c.settled = is_static;
    // A host has the time to solve after every block, as the float learners do.
    c.solve_blocks = 1;
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
    c.excitation_q15 = static_cast<std::uint16_t>(std::lround(32768.0 * kExcitation_pu));
    c.noise_on_inputs = !is_static && all_rows(logs) > kShort;
    c.angle = std::any_of(inputs.begin(), inputs.end(), [](const TraceInput& in) { return needs_angle(in.effect); });
    if (!is_static)
        c.half_window = static_cast<std::uint8_t>(
            std::min<std::uint16_t>(half_window_of(logs, inputs, pole_pairs), DQW_WINDOW_Q15_HALF));
    return c;
}

void put(const dqw_estimator_q15& e, const Asked& asked, bool p_given, std::uint16_t said, Result& result)
{
    for (int i = 0; i <= DQW_PSI; ++i) {
        if (!asked(names[i])) continue;
        const Read r = read(e, i);
        const auto [value, sd] = r;
        if (r.known())
            result.parameters.push_back({names[i], value, sd, false});
        else
            result.not_identifiable.push_back({names[i],
                                               std::isfinite(sd) && value > 0.0
                                                   ? fmt::format("its deviation is {:.0f} % of it", 100.0 * sd / value)
                                                   : std::string("its effect cannot be told from another parameter's"),
                                               excitations[i]});
    }
    if (p_given)
        result.parameters.push_back({"pole_pairs", static_cast<double>(said), 0.0, true});
    else if (e.pole_pairs != 0)
        result.parameters.push_back({"pole_pairs", static_cast<double>(e.pole_pairs), 0.0, false});
    else if (asked("pole_pairs") || asked("psi_Wb"))
        result.not_identifiable.push_back(
            {"pole_pairs", "the cross weights do not tell them",
             "currents that change on both axes while the machine turns, or --pole-pairs"});
}

/// What the run before knows in place of the nominal values.
void start_from(const dqw_estimator_q15& before, dqw_estimator_q15_config& config)
{
    std::uint32_t* const nominals[] = {&config.R_uohm, &config.Ld_nH, &config.Lq_nH, &config.psi_nWb};
    for (int i = 0; i <= DQW_PSI; ++i) {
        const Read r = read(before, i);
        if (r.known()) *nominals[i] = whole(r.value / kUnitQ15[static_cast<std::size_t>(i)]);
    }
}

/// What the run before left of its noise and of its residual: then every row is learned, and each axis by its own.
void take(const dqw_estimator_q15& before, const dqw_estimator_q15_config& began, dqw_estimator_q15& e)
{
    e.noise = before.noise;
    dqw_noise_gap_q15(&e.noise);
    // All the rows that there are, even where the estimator would like more.
    if (e.noise.rows > 0 && e.noise.rows < DQW_NOISE_ROWS) {
        for (std::int64_t& sum : e.noise.sum_q30) sum = sum * DQW_NOISE_ROWS / e.noise.rows;
        e.noise.rows = DQW_NOISE_ROWS;
    }
    std::copy(std::begin(before.given.step_q15), std::end(before.given.step_q15), e.step_q15);
    std::copy(std::begin(before.given.step_q15), std::end(before.given.step_q15), e.given.step_q15);
    e.follow_q15 = e.given.follow_q15 = before.given.follow_q15;
    std::copy(std::begin(before.error_q56), std::end(before.error_q56), e.error_q56);
    for (int i = 0; i < DQW_ESTIMATOR_Q15_SCORES; ++i) {
        const auto parameter = static_cast<dqw_parameter>(i);
        // A score goes with its input, and so with the weight's unit.
        const double ratio = i > DQW_PSI ? 1.0
                                         : std::pow(static_cast<double>(dqw_estimator_unit_q15(e.config, parameter)) /
                                                        static_cast<double>(
                                                            std::max(dqw_estimator_unit_q15(&began, parameter), 1U)),
                                                    2.0);
        e.score2_q68[i] = static_cast<std::int64_t>(
            std::clamp(ratio * static_cast<double>(before.score2_q68[i]), -0x1p60, 0x1p60));
        e.score_lag_q68[i] = static_cast<std::int64_t>(
            std::clamp(ratio * static_cast<double>(before.score_lag_q68[i]), -0x1p60, 0x1p60));
    }
    e.blocks = kBlocksCarried;
}

enum class RunKind : std::uint8_t { first, follows, measures };

/// The half that was handed over: nobody learns it.
void forget(dqw_estimator_q15& e)
{
    std::int32_t block[DQW_ESTIMATOR_Q15_SIGNALS], sum[2];
    std::uint16_t weight = 0;
    (void)dqw_window_join_q15(&e.window, &e.rise, block, &weight, sum);
    dqw_handover_release(&e.window.over);
}

/// One run over the logs, or one that only measures their noise. Returns the rows held out.
std::uint32_t over(const std::vector<Log>& logs, const LearnOptions& options, const std::vector<TraceInput>& inputs,
                   double pole_pairs, const FullScales& full, RunKind kind, dqw_estimator_q15& e)
{
    const std::uint16_t carried = e.blocks;
    std::size_t done = 0;
    std::uint32_t heldout = 0;
    const std::size_t total = all_rows(logs);
    for (const Log& log : logs) {
        const SampleSource sample(log, pole_pairs, inputs);
        walk(
            log, done, total, options, [&] { dqw_estimator_missing_q15(&e, 0); },
            [&](std::size_t k, bool held) {
                // What is held out is not learned, but it heats.
                if (held && inputs.empty()) return;
                dqw_sample_q15 x;
                const bool good = fixed(sample(k), full, x);
                heldout += held ? 1U : 0U;
                (void)dqw_estimator_sample_q15(&e, &x, held || !good);
                const bool learned = kind != RunKind::measures && dqw_estimator_background_q15(&e);
                if (kind == RunKind::measures && dqw_handover_waits(&e.window.over)) forget(e);
                // The noise that was measured with all of a run's rows stands.
                if (kind != RunKind::first) e.given.ready = false;
                if (!learned || !options.block) return;
                std::array<double, 4> now{};
                for (std::size_t i = 0; i < now.size(); ++i) now[i] = read(e, static_cast<int>(i)).value;
                options.block(log.t_s.empty() ? static_cast<double>(k) : log.t_s[k], now);
            });
    }
    // A deviation is of the blocks of this run.
    if (e.restarts == 0 && e.blocks < UINT16_MAX) e.blocks = static_cast<std::uint16_t>(e.blocks - carried);
    return heldout;
}

/// One pass of port_q15/.
Learned pass(const std::vector<Log>& logs, const LearnOptions& options, const std::vector<TraceInput>& inputs,
             double pole_pairs, bool p_given)
{
    const Log& first = logs.front();
    dqw_estimator_q15_config config = config_of(logs, options, inputs, pole_pairs);
    const FullScales full = full_scales(config.scale);
    std::vector<dqw_effect_q15_config> list;
    std::vector<double> effect_units;
    for (const TraceInput& in : inputs) {
        // A settled log's delay is in seconds.
        const double weight_unit = in.effect == "delay" && config.settled ? full.dt_s : 1.0;
        list.push_back(effect_config_q15(in, full, weight_unit,
                                         config.settled ? static_cast<double>(period_of(first, inputs)) : 0.0));
        effect_units.push_back(effect_unit(list.back().effect, full) * weight_unit);
    }
    config.effects = list.data();
    config.effect_count = static_cast<std::uint8_t>(list.size());
    dqw_estimator_q15 e{};
    std::uint32_t heldout = 0;
    const std::size_t total = all_rows(logs);
    const auto begin = [&](const dqw_estimator_q15* before) {
        const dqw_estimator_q15_config began = config;
        if (before != nullptr) start_from(*before, config);
        if (dqw_estimator_init_q15(&e, &config) != DQW_OK)
            throw std::invalid_argument(
                "the fixed-point learners refuse these full scales, nominal values or shapes of effects");
        // Whoever asks what a log tells wants all of its rows, whatever its residual.
        e.stage.threshold_ppm = UINT32_MAX;
        // Settled rows need no coarse values, and a run before this one has them.
        if (config.settled || before != nullptr) (void)dqw_stage_step(&e.stage, true, 0);
        if (before != nullptr) take(*before, began, e);
    };
    begin(nullptr);
    bool heard = false;
    heldout = over(logs, options_of_run(options, 0, heard), inputs, pole_pairs, full, RunKind::first, e);
    for (int n = 1; n < kMostRuns && !config.settled; ++n) {
        dqw_estimator_q15 before = e;
        if (pole_pairs == 0.0) config.scale.pole_pairs = e.pole_pairs;
        config.noise_on_inputs = true;
        // The mean of the noise reaches over all of a short log: measured with the inductances as they are known now.
        if (total <= kShort) {
            begin(&before);
            dqw_noise_init_q15(&e.noise);
            (void)over(logs, quiet(options), inputs, pole_pairs, full, RunKind::measures, e);
            before.noise = e.noise;
        }
        begin(&before);
        heldout = over(logs, options_of_run(options, n, heard), inputs, pole_pairs, full, RunKind::follows, e);
        if (runs_agree(before.given.step_q15, before.pole_pairs, e.given.step_q15, e.pole_pairs)) break;
    }

    Learned learned;
    Result& result = learned.result;
    result.rows = total;
    result.regime = first.regime;
    Asked asked{options.parameters, {"R_ohm", "Ld_H", "Lq_H", "psi_Wb"}};
    if (first.regime == Regime::standstill) asked.defaults = {"R_ohm"};
    put(e, asked, p_given, config.scale.pole_pairs, result);
    note_gate(e.gate, heldout, result);
    result.notes.push_back(
        fmt::format("fixed point; full scales {:.4g} V, {:.4g} A, {:.4g} rad/s", full.v_V, full.i_A, full.w_rad_s));
    for (int i = 0; i <= DQW_PSI; ++i) learned.unit[static_cast<std::size_t>(i)] = unit_q15(config, i);
    PlainModel& model = learned.model;
    model.pole_pairs = e.pole_pairs != 0 ? e.pole_pairs : 1;
    double* const values[] = {&model.R_ohm, &model.Ld_H, &model.Lq_H, &model.psi_Wb};
    for (int i = 0; i <= DQW_PSI; ++i) *values[i] = read(e, i).value;
    std::vector<InputRead> of_inputs;
    for (std::size_t n = 0; n < inputs.size(); ++n) {
        std::int64_t w[DQW_EFFECT_STARTS], sd[DQW_EFFECT_STARTS];
        const int known = dqw_estimator_read_effect_q15(&e, static_cast<int>(n), w, sd);
        of_inputs.push_back({inputs[n], {}, static_cast<std::uint32_t>(known)});
        of_inputs.back().input.weights.clear();
        for (int i = 0; i < dqw_effect_weights(list[n].effect); ++i) {
            of_inputs.back().input.weights.push_back(si(w[i], effect_units[n]));
            of_inputs.back().sd.push_back(sd[i] == INT64_MAX ? INFINITY : si(sd[i], effect_units[n]));
        }
    }
    put_effects(of_inputs, learned);
    return learned;
}

}  // namespace

Learned learn_q15(const std::vector<Log>& logs, const LearnOptions& options)
{
    return learn_in_passes(logs, options, pass);
}

dqw_estimator_q15_config q15_config_of(const std::vector<Log>& logs, const LearnOptions& options, double pole_pairs)
{
    return config_of(logs, options, {}, pole_pairs);
}

}  // namespace dqw
