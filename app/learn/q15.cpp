#include "app/learn/q15.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "app/base/effect_names.hpp"
#include "app/base/modulation.hpp"
#include "app/learn/electrical.hpp"
#include "app/learn/modulation.hpp"
#include "app/learn/parts.hpp"
#include "app/learn/passes.hpp"
#include "app/learn/signals.hpp"
#include "app/q15/effect_q15.hpp"
#include "app/q15/fixed_point.hpp"
#include "dqw_estimator_block_q15.h"

namespace dqw {
namespace {

struct Told {
    dqw_parameter id;
    const char *name, *excitation;
};
constexpr Told kTold[] = {
    {DQW_R, "R_ohm", "a current of several levels on either axis, best at low speed"},
    {DQW_LD, "Ld_H", "a varying i_d, or a turning machine with i_d at several levels"},
    {DQW_LQ, "Lq_H", "a varying i_q, or a turning machine with i_q at several levels"},
    {DQW_PSI, "psi_Wb",
     "a turning machine with i_d and i_q at several levels, and pole_pairs where they cannot be found"}};

/// Rows that the mean of the noise reaches over: of a shorter log none are spared for measuring it.
constexpr std::size_t kShort = DQW_NOISE_Q15_MEMORY;

Read read(const dqw_estimator_q15& e, int i)
{
    return read_of(dqw_estimator_read_q15(&e, static_cast<dqw_parameter>(i)), unit_q15(*e.config, i));
}

/// In the frame that the learners' own laws are of.
std::array<double, 4> values_of(const dqw_estimator_q15& e)
{
    std::array<double, 4> all{};
    for (std::size_t i = 0; i < all.size(); ++i) {
        const int weight = static_cast<int>(i);
        all[i] = std::ldexp(dqw_estimator_value_q24(&e, weight), -24) * unit_q15(*e.config, weight);
    }
    return all;
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
    c.observed = first.observed;
    c.voltage_error_mV = whole(1e3 * first.voltage_error_V);
    c.voltage_scale_ppm = whole(1e6 * first.voltage_scale);
    c.noise_on_inputs = !is_static && all_rows(logs) > kShort;
    c.angle = std::any_of(inputs.begin(), inputs.end(), [](const TraceInput& in) { return needs_angle(in.effect); });
    if (!is_static)
        c.half_window = static_cast<std::uint8_t>(
            std::min<std::uint16_t>(half_window_of(logs, inputs, pole_pairs), DQW_WINDOW_Q15_HALF));
    return c;
}

void put(const dqw_estimator_q15& e, const Asked& asked, bool p_given, std::uint16_t said, Result& result)
{
    for (const auto& [id, name, excitation] : kTold) {
        if (!asked(name)) continue;
        const Read r = read(e, id);
        const auto [value, sd] = r;
        if (r.known())
            result.parameters.push_back({name, value, sd, false});
        else if (const std::string hidden = why_observed(e.config->observed, name); !hidden.empty())
            result.not_identifiable.push_back({name, hidden, kForObserved});
        else
            result.not_identifiable.push_back({name,
                                               std::isfinite(sd) && value > 0.0
                                                   ? fmt::format("its deviation is {:.0f} % of it", 100.0 * sd / value)
                                                   : std::string("its effect cannot be told from another parameter's"),
                                               excitation});
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
    e.lead_q12 = e.given.lead_q12 = before.given.lead_q12;
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

/// The half that was handed over: nobody learns it.
void forget(dqw_estimator_q15& e)
{
    std::int32_t block[DQW_ESTIMATOR_Q15_SIGNALS], sum[2];
    std::uint16_t weight = 0;
    (void)dqw_window_join_q15(&e.window, &e.rise, block, &weight, sum);
    dqw_handover_release(&e.window.over);
}

/// The estimator of port_q15/, run after run over the same logs.
class Runs {
public:
    Runs(const std::vector<Log>& logs, const LearnOptions& options, const std::vector<TraceInput>& inputs,
         double pole_pairs)
        : logs_(logs), options_(options), inputs_(inputs), pole_pairs_(pole_pairs),
          config_(config_of(logs, options, inputs, pole_pairs))
    {
        for (const TraceInput& in : inputs) {
            // A settled log's delay is in seconds.
            const double weight_unit = in.effect == "delay" && config_.settled ? full_.dt_s : 1.0;
            list_.push_back(effect_config_q15(
                in, full_, weight_unit, config_.settled ? static_cast<double>(period_of(logs.front(), inputs)) : 0.0));
            effect_units_.push_back(effect_unit(list_.back().effect, full_) * weight_unit);
        }
        if (any_dead_time()) config_.modulation = modulation_of_run(logs, options, inputs, pole_pairs);
        config_.effects = list_.data();
        config_.effect_count = static_cast<std::uint8_t>(list_.size());
    }
    Runs(const Runs&) = delete;
    Runs& operator=(const Runs&) = delete;

    /// As many runs over the logs as it takes; the last one counts.
    void run()
    {
        begin(nullptr);
        bool heard = false;
        over(options_of_run(options_, 0, heard), RunKind::first);
        for (int n = 1; n < kMostRuns && !config_.settled; ++n) {
            dqw_estimator_q15 before = e_;
            if (pole_pairs_ == 0.0) config_.scale.pole_pairs = e_.pole_pairs;
            config_.noise_on_inputs = true;
            if (all_rows(logs_) <= kShort) measure_noise(before);
            begin(&before);
            over(options_of_run(options_, n, heard), RunKind::follows);
            if (runs_agree(before.given.step_q15, before.pole_pairs, e_.given.step_q15, e_.pole_pairs)) break;
        }
    }

    Learned learned(bool p_given) const
    {
        Learned learned;
        Result& result = learned.result;
        const Asked asked = begin_result(logs_, options_, result);
        put(e_, asked, p_given, config_.scale.pole_pairs, result);
        note_gate(e_.gate, heldout_, result);
        result.notes.push_back(fmt::format("fixed point; full scales {:.4g} V, {:.4g} A, {:.4g} rad/s", full_.v_V,
                                           full_.i_A, full_.w_rad_s));
        for (int i = 0; i <= DQW_PSI; ++i) learned.unit[static_cast<std::size_t>(i)] = unit_q15(config_, i);
        learned.model = plain_model(e_.pole_pairs, values_of(e_));
        std::vector<InputRead> of_inputs;
        for (std::size_t n = 0; n < inputs_.size(); ++n) {
            std::int64_t w[DQW_EFFECT_STARTS], sd[DQW_EFFECT_STARTS];
            const int known = dqw_estimator_read_effect_q15(&e_, static_cast<int>(n), w, sd);
            of_inputs.push_back(input_read(inputs_[n], known, w, sd, effect_units_[n]));
            if (inputs_[n].effect == "dead_time") put_legs(of_inputs.back(), result);
        }
        put_effects(of_inputs, learned);
        return learned;
    }

private:
    bool any_dead_time() const
    {
        return std::any_of(inputs_.begin(), inputs_.end(),
                           [](const TraceInput& in) { return in.effect == "dead_time"; });
    }

    /// Which legs switch, and what those lose whichever way their current flows.
    void put_legs(InputRead& dead_time, Result& result) const
    {
        dead_time.input.modulation = modulation_text(config_.modulation);
        const std::string note = note_on_modulation(logs_.front(), config_.modulation);
        if (!note.empty()) result.notes.push_back(note);
        if (config_.modulation == DQW_MODULATION_CENTRED) return;
        const Read constant = read(e_, DQW_DEAD_CONSTANT);
        dead_time.input.weights.push_back(constant.value);
        dead_time.sd.push_back(constant.sd);
    }

    enum class RunKind : std::uint8_t { first, follows, measures };

    void begin(const dqw_estimator_q15* before)
    {
        const dqw_estimator_q15_config began = config_;
        if (before != nullptr) start_from(*before, config_);
        if (dqw_estimator_init_q15(&e_, &config_) != DQW_OK)
            throw std::invalid_argument(
                "the fixed-point learners refuse these full scales, nominal values or shapes of effects");
        // Whoever asks what a log tells wants all of its rows, whatever its residual.
        e_.stage.threshold_ppm = UINT32_MAX;
        // Settled rows need no coarse values, and a run before this one has them.
        if (config_.settled || before != nullptr) (void)dqw_stage_step(&e_.stage, true, 0);
        if (before != nullptr) take(*before, began, e_);
    }

    /// The mean of the noise reaches over all of a short log: measured with the inductances as they are known now.
    void measure_noise(dqw_estimator_q15& before)
    {
        begin(&before);
        dqw_noise_init_q15(&e_.noise);
        over(quiet(options_), RunKind::measures);
        before.noise = e_.noise;
    }

    void over(const LearnOptions& options, RunKind kind)
    {
        const std::uint16_t carried = e_.blocks;
        heldout_ = over_rows(
            logs_, options, inputs_, pole_pairs_, [&] { dqw_estimator_missing_q15(&e_, 0); },
            [&](const dqw_sample& sample, bool held) {
                dqw_sample_q15 x;
                const bool good = fixed(sample, full_, x);
                (void)dqw_estimator_sample_q15(&e_, &x, held || !good);
                const bool learned = kind != RunKind::measures && dqw_estimator_background_q15(&e_);
                if (kind == RunKind::measures && dqw_handover_waits(&e_.window.over)) forget(e_);
                // The noise that was measured with all of a run's rows stands.
                if (kind != RunKind::first) e_.given.ready = false;
                return learned;
            },
            [&] { return values_of(e_); });
        // A deviation is of the blocks of this run.
        if (e_.restarts == 0 && e_.blocks < UINT16_MAX) e_.blocks = static_cast<std::uint16_t>(e_.blocks - carried);
    }

    const std::vector<Log>& logs_;
    const LearnOptions& options_;
    const std::vector<TraceInput>& inputs_;
    const double pole_pairs_;
    dqw_estimator_q15_config config_;
    const FullScales full_ = full_scales(config_.scale);
    std::vector<dqw_effect_q15_config> list_;
    std::vector<double> effect_units_;
    dqw_estimator_q15 e_{};
    std::uint32_t heldout_ = 0;
};

/// One pass of port_q15/.
Learned pass(const std::vector<Log>& logs, const LearnOptions& options, const std::vector<TraceInput>& inputs,
             double pole_pairs, bool p_given)
{
    Runs runs(logs, options, inputs, pole_pairs);
    runs.run();
    return runs.learned(p_given);
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
