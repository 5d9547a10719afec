#include "app/learn/electrical.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "app/base/effect_names.hpp"
#include "app/base/modulation.hpp"
#include "app/learn/modulation.hpp"
#include "app/learn/parts.hpp"
#include "app/learn/passes.hpp"
#include "app/learn/signals.hpp"
#include "dqw_estimator_block.h"
#include "dqw_number.h"

namespace dqw {
namespace {

// Pole pairs of a log too short for the estimator's own rule: every other integer is so many deviations away, and
// itself so near.
constexpr float kPolesSd = 4.0F, kPolesDistance = 0.25F, kPolesMost = 100.0F;

bool is_settled(const std::vector<Log>& logs) { return logs.front().regime != Regime::dynamic; }

/// The mean of the noise reaches over all of it.
bool is_short(const std::vector<Log>& logs) { return all_rows(logs) <= DQW_NOISE_MEMORY; }

const TraceInput* dead_time_of(const std::vector<TraceInput>& inputs)
{
    const auto found = std::find_if(inputs.begin(), inputs.end(),
                                    [](const TraceInput& in) { return in.effect == "dead_time"; });
    return found == inputs.end() ? nullptr : &*found;
}

/// Pole pairs as a run tells them; 0: it does not.
struct Poles {
    std::uint16_t pairs = 0;
    float raw = 0.0F, sd = DQW_UNKNOWN;
};

/// What a run over the logs leaves for the next: then every row is learned, with the noise known from the first one on,
/// and each axis by its own.
struct Before {
    dqw_estimator e{};
    std::array<float, 4> start{};  ///< R, L_d, L_q, psi; 0: not known
    dqw_modulation modulation = DQW_MODULATION_CENTRED;
};

/// The estimator, sample by sample as firmware has it, but that no residual ends it: whoever asks what a log tells
/// wants all of its rows.
class Run {
public:
    Run(const std::vector<Log>& logs, const LearnOptions& options, const std::vector<TraceInput>& inputs,
        double pole_pairs, const Before* before)
        : logs_(logs), inputs_(inputs), pole_pairs_(pole_pairs)
    {
        configure(options, before);
        const dqw_status status = dqw_estimator_init(&e_, &config_);
        if (status != DQW_OK)
            throw std::invalid_argument(fmt::format("the learners refuse this: {}", dqw_status_text(status)));
        // Settled rows need no coarse values, and a run before this one has them.
        if (config_.settled || before != nullptr) dqw_estimator_stage_on(&e_, true);
        if (before != nullptr) take(*before);
        stage_ = e_.stage;
    }
    Run(const Run&) = delete;
    Run& operator=(const Run&) = delete;

    void over(const LearnOptions& options)
    {
        heldout_ += over_rows(
            logs_, options, inputs_, pole_pairs_, [&] { dqw_estimator_missing(&e_, 0); },
            [&](const dqw_sample& s, bool held) {
                (void)dqw_estimator_sample(&e_, &s, held);
                return learn();
            },
            [&] { return now(); });
        // A deviation is of the blocks of this run; after a restart they are that alone.
        if (e_.restarts == 0 && e_.blocks < UINT16_MAX) e_.blocks = static_cast<std::uint16_t>(e_.blocks - carried_);
    }

    /// Of these logs, with what `before` knows of the inductances.
    static dqw_noise_variances noise(const std::vector<Log>& logs, const LearnOptions& options,
                                     const std::vector<TraceInput>& inputs, double pole_pairs, const Before& before)
    {
        Run run(logs, options, inputs, pole_pairs, &before);
        dqw_noise_init(&run.e_.noise);
        run.measures_ = true;
        run.over(quiet(options));
        return run.e_.noise.of;
    }

    const dqw_estimator& estimator() const { return e_; }
    const dqw_estimator_config& config() const { return config_; }
    const dqw_stage& stage() const { return stage_; }
    std::uint32_t heldout() const { return heldout_; }
    std::uint32_t excited(int parameter) const { return excited_[static_cast<std::size_t>(parameter)]; }
    std::uint32_t blocks() const { return handed_; }

    Poles poles() const
    {
        Poles p = poles_;
        if (e_.pole_pairs != 0) {
            p.pairs = e_.pole_pairs;
            return p;
        }
        const float nearest = std::round(p.raw), off = std::fabs(p.raw - nearest);
        if (nearest >= 1.0F && nearest < kPolesMost && off < kPolesDistance && kPolesSd * p.sd < 1.0F - off)
            p.pairs = static_cast<std::uint16_t>(nearest);
        return p;
    }

    Before left() const
    {
        Before b{e_, {}, config_.modulation};
        for (int i = 0; i <= DQW_PSI; ++i) {
            const dqw_reading r = dqw_estimator_read(&e_, static_cast<dqw_parameter>(i));
            if (read_of(r).known()) b.start[static_cast<std::size_t>(i)] = r.value;
        }
        return b;
    }

private:
    void configure(const LearnOptions& options, const Before* before)
    {
        const Log& first = logs_.front();
        for (const TraceInput& in : inputs_)
            if (in.effect != "dead_time") list_.push_back(effect_of(in));
        config_.dt_s = period_of(first, inputs_);
        config_.v_base_V = largest(logs_, &Log::v_d_V, &Log::v_q_V);
        config_.i_base_A = largest(logs_, &Log::i_d_A, &Log::i_q_A);
        config_.w_base_rad_s = largest(logs_, &Log::w_m_rad_s, &Log::w_m_rad_s);
        const std::pair<float dqw_estimator_config::*, std::optional<double> Machine::*> nominals[] = {
            {&dqw_estimator_config::R_ohm, &Machine::R_ohm},
            {&dqw_estimator_config::Ld_H, &Machine::Ld_H},
            {&dqw_estimator_config::Lq_H, &Machine::Lq_H},
            {&dqw_estimator_config::psi_Wb, &Machine::psi_Wb}};
        for (std::size_t i = 0; i < 4; ++i) {
            const auto& [place, member] = nominals[i];
            config_.*place = before != nullptr && before->start[i] > 0.0F
                                 ? before->start[i]
                                 : nominal(first.machine, options.start, member);
        }
        config_.pole_pairs = static_cast<std::uint16_t>(pole_pairs_);
        config_.settled = is_settled(logs_);
        // The first run over a short log has no rows to spare for measuring the noise.
        config_.noise_on_inputs = !config_.settled && (before != nullptr || !is_short(logs_));
        if (!config_.settled) config_.half_window = half_window_of(logs_, inputs_, pole_pairs_);
        config_.excitation_pu = static_cast<float>(kExcitation_pu);
        config_.angle = std::any_of(inputs_.begin(), inputs_.end(),
                                    [](const TraceInput& in) { return needs_angle(in.effect); });
        if (const TraceInput* dead_time = dead_time_of(inputs_)) config_.dead_time_width_A = width_of(*dead_time);
        config_.observed = first.observed;
        config_.voltage_error_V = static_cast<float>(first.voltage_error_V);
        config_.voltage_scale_ppm = static_cast<std::uint32_t>(std::lround(1e6 * first.voltage_scale));
        config_.modulation = before != nullptr ? before->modulation : modulation_of(first, config_, inputs_);
        config_.effects = list_.data();
        config_.effect_count = static_cast<std::uint8_t>(list_.size());
    }

    dqw_effect_config effect_of(const TraceInput& in) const
    {
        dqw_effect_config c = effect_config(in);
        c.start[0] /= static_cast<float>(weight_unit(in, logs_.front(), inputs_));
        return c;
    }

    static float width_of(const TraceInput& dead_time)
    {
        const float width_A = effect_config(dead_time).shape[0];
        if (!dqw_is_positive(width_A)) throw std::invalid_argument("dead_time: its width is not above 0 A");
        return width_A;
    }

    void take(const Before& before)
    {
        const dqw_estimator& from = before.e;
        follows_ = true;
        e_.noise.of = from.noise.of;
        // All the rows that there are, even where the estimator would like more.
        e_.noise.of.rows = std::max(from.noise.of.rows, DQW_NOISE_ROWS);
        e_.lead = e_.given.lead = from.given.lead;
        e_.follow = 2.0F / (2.0F + e_.lead);
        for (int axis = 0; axis < 2; ++axis) {
            e_.step_A_per_V[axis] = e_.given.step_A_per_V[axis] = from.given.step_A_per_V[axis];
            if (from.blocks > 0) e_.error_pu2[axis] = from.error_pu2[axis];
        }
        if (from.blocks == 0) return;
        std::copy(std::begin(from.score2), std::end(from.score2), e_.score2);
        std::copy(std::begin(from.score_lag), std::end(from.score_lag), e_.score_lag);
        std::copy(std::begin(from.lasting_pu2), std::end(from.lasting_pu2), e_.lasting_pu2);
        std::copy(std::begin(from.alone_pu2), std::end(from.alone_pu2), e_.alone_pu2);
        std::copy(std::begin(from.slow_alone_pu2), std::end(from.slow_alone_pu2), e_.slow_alone_pu2);
        e_.slow_pu2 = from.slow_pu2;
        e_.blocks = carried_ = kBlocksCarried;
    }

    /// The block that waits, if there is one.
    bool learn()
    {
        dqw_estimator_block block;
        if (!dqw_estimator_take(&e_, &block) || measures_) return false;
        ++handed_;
        const bool coarse = e_.stage.name == DQW_STAGE_RANDOM;
        const bool learned = dqw_estimator_learn(&e_, &block);
        count_excited(block);
        // The noise that was measured with all of a run's rows stands.
        if (follows_) e_.given_ready = false;
        if (!learned) return false;
        if (!config_.settled && e_.pole_pairs == 0) dqw_poles_evidence(&e_, &poles_.raw, &poles_.sd);
        if (coarse)
            stage_ = e_.stage;
        else if (stage_.name != DQW_STAGE_DOMAIN)
            step_stage();
        return true;
    }

    void step_stage()
    {
        const auto ppm = static_cast<std::uint32_t>(
            std::min(1e6 * static_cast<double>(dqw_estimator_recent_pu(&e_)), 4e9));
        (void)dqw_stage_step(&stage_, true, ppm);
    }

    void count_excited(const dqw_estimator_block& block)
    {
        if (!config_.settled) {
            for (std::size_t i = 0; i < excited_.size(); ++i) excited_[i] += e_.excess_q10[i] > 0 ? 1U : 0U;
            return;
        }
        const dqw_block m = dqw_estimator_means(&e_, &block);
        const float i = config_.excitation_pu * config_.i_base_A, w = config_.excitation_pu * config_.w_base_rad_s;
        excited_[DQW_R] += std::max(std::fabs(m.i_d_A), std::fabs(m.i_q_A)) >= i ? 1U : 0U;
        excited_[DQW_LD] += std::fabs(m.wi_d_A_rad_s) >= w * config_.i_base_A ? 1U : 0U;
        excited_[DQW_LQ] += std::fabs(m.wi_q_A_rad_s) >= w * config_.i_base_A ? 1U : 0U;
        excited_[DQW_PSI] += std::fabs(m.w_m_rad_s) >= w ? 1U : 0U;
    }

    /// 0: not known yet.
    std::array<double, 4> now() const
    {
        std::array<double, 4> all{};
        for (int i = 0; i <= DQW_PSI; ++i) {
            const dqw_reading r = dqw_estimator_read(&e_, static_cast<dqw_parameter>(i));
            if (r.sd < DQW_UNKNOWN) all[static_cast<std::size_t>(i)] = static_cast<double>(r.value);
        }
        return all;
    }

    const std::vector<Log>& logs_;
    const std::vector<TraceInput>& inputs_;
    const double pole_pairs_;
    std::vector<dqw_effect_config> list_;
    dqw_estimator_config config_{};
    dqw_estimator e_{};
    dqw_stage stage_{};
    Poles poles_;
    std::uint16_t carried_ = 0;
    bool follows_ = false, measures_ = false;
    std::uint32_t heldout_ = 0, handed_ = 0;
    std::array<std::uint32_t, 4> excited_{};
};

const char* why_back(dqw_stage_back why)
{
    switch (why) {
    case DQW_BACK_NONE: break;
    case DQW_BACK_NOT_CONVERGED: return "the Random Learners did not settle";
    case DQW_BACK_THRESHOLD: return "the residual stayed above the threshold";
    case DQW_BACK_LEFT_BAND: return "the residual left its band";
    }
    return "";
}

void note_stage(const dqw_stage& stage, Result& result)
{
    std::string text = fmt::format("stage {}: {}",
                                   stage.name == DQW_STAGE_IN_SERVICE ? 4 : static_cast<int>(stage.name) + 1,
                                   dqw_stage_text(stage.name));
    if (stage.back != DQW_BACK_NONE)
        text += fmt::format("; went back because {} ({:.1f} %, threshold {:.1f} %)", why_back(stage.back),
                            1e-4 * stage.residual_ppm, 1e-4 * stage.threshold_ppm);
    result.notes.push_back(text);
}

std::string why_unknown(const Run& run, const dqw_reading& r, std::uint32_t excited, const char* what)
{
    const double percent = 100.0 * kExcitation_pu;
    if (excited == 0)
        return fmt::format("{} is below {:.1f} % of its base, or of the size of its noise, in all {} blocks", what,
                           percent, run.blocks());
    if (r.sd < DQW_UNKNOWN && r.value > 0.0F)
        return fmt::format("its deviation is {:.0f} % of it; {} is large enough in {} of {} blocks",
                           100.0 * static_cast<double>(r.sd / r.value), what, excited, run.blocks());
    return fmt::format("its effect cannot be told from another parameter's; {} is large enough in {} of {} blocks",
                       what, excited, run.blocks());
}

void put_pole_pairs(const dqw_estimator& e, const Poles& poles, bool p_given, const Asked& asked, Result& result)
{
    if (p_given)
        result.parameters.push_back({"pole_pairs", static_cast<double>(e.pole_pairs), 0.0, true});
    else if (poles.pairs != 0)
        result.parameters.push_back(
            {"pole_pairs", static_cast<double>(poles.pairs), static_cast<double>(poles.sd), false});
    else if (asked("pole_pairs") || asked("psi_Wb"))
        result.not_identifiable.push_back(
            {"pole_pairs",
             poles.sd < DQW_UNKNOWN
                 ? fmt::format("the cross weights say {:.2f} with a deviation of {:.2f}", poles.raw, poles.sd)
                 : std::string("the slopes of the currents or their products with the speed are too small"),
             "currents that change on both axes while the machine turns, or --pole-pairs"});
}

void put_electrical(const Run& run, const Asked& asked, Result& result)
{
    const dqw_estimator& e = run.estimator();
    const bool settled = run.config().settled;
    const std::string needs_p = "only its product with the pole pairs is in this log, and these are not known";
    const struct {
        const char *name, *what;
        dqw_parameter parameter;
        bool through_p;
        const char* excitation;
    } rows[] = {
        {"R_ohm", "the current", DQW_R, false, "a current of several levels on either axis, best at low speed"},
        {"Ld_H", settled ? "i_d times speed" : "the change of i_d (and i_d times speed)", DQW_LD, settled,
         settled ? "i_d at several levels while the machine turns, and pole_pairs"
                 : "a varying i_d: steps of its reference or a random binary voltage on v_d"},
        {"Lq_H", settled ? "i_q times speed" : "the change of i_q (and i_q times speed)", DQW_LQ, settled,
         settled ? "i_q at several levels while the machine turns, and pole_pairs"
                 : "a varying i_q: steps of torque or a random binary voltage on v_q"},
        {"psi_Wb", "the speed", DQW_PSI, true,
         "a turning machine with i_d and i_q at several levels, and pole_pairs where they cannot be found"},
    };
    for (const auto& row : rows) {
        if (!asked(row.name)) continue;
        const dqw_reading r = dqw_estimator_read(&e, row.parameter);
        const std::uint32_t excited = run.excited(row.parameter);
        if (read_of(r).known())
            result.parameters.push_back({row.name, static_cast<double>(r.value), static_cast<double>(r.sd), false});
        else if (const std::string hidden = why_observed(run.config().observed, row.name); !hidden.empty())
            result.not_identifiable.push_back({row.name, hidden, kForObserved});
        else
            result.not_identifiable.push_back(
                {row.name,
                 e.pole_pairs == 0 && row.through_p && excited > 0 ? needs_p : why_unknown(run, r, excited, row.what),
                 row.excitation});
    }
}

/// As many runs over the logs as it takes; the last one counts.
std::unique_ptr<Run> run_all(const std::vector<Log>& logs, const LearnOptions& options,
                             const std::vector<TraceInput>& inputs, double pole_pairs, Poles& poles)
{
    std::unique_ptr<Run> run;
    Before before;
    bool heard = false;
    for (int n = 0; n < kMostRuns; ++n) {
        run = std::make_unique<Run>(logs, options, inputs, pole_pairs, n == 0 ? nullptr : &before);
        run->over(options_of_run(options, n, heard));
        if (is_settled(logs)) break;
        Before after = run->left();
        const double began = pole_pairs;
        if (pole_pairs == 0.0) {
            poles = run->poles();
            pole_pairs = poles.pairs;
        }
        if (n > 0 && runs_agree(before.e.given.step_A_per_V, began, after.e.given.step_A_per_V, pole_pairs)) break;
        if (is_short(logs)) after.e.noise.of = Run::noise(logs, options, inputs, pole_pairs, after);
        before = after;
    }
    return run;
}

/// One pass of lib/.
Learned pass(const std::vector<Log>& logs, const LearnOptions& options, const std::vector<TraceInput>& inputs,
             double pole_pairs, bool p_given)
{
    const Log& first = logs.front();
    Poles poles;
    const auto run = run_all(logs, options, inputs, pole_pairs, poles);
    const dqw_estimator& e = run->estimator();

    Learned learned;
    Result& result = learned.result;
    const Asked asked = begin_result(logs, options, result);
    put_electrical(*run, asked, result);
    put_pole_pairs(e, poles, p_given, asked, result);
    note_gate(e.gate, run->heldout(), result);
    note_stage(run->stage(), result);

    const auto value = [&](dqw_parameter p) { return static_cast<double>(dqw_estimator_value(&e, p)); };
    learned.model = plain_model(e.pole_pairs, {value(DQW_R), value(DQW_LD), value(DQW_LQ), value(DQW_PSI)});
    std::vector<InputRead> read;
    int at = 0;
    for (const TraceInput& in : inputs) {
        float w[DQW_EFFECT_STARTS], sd[DQW_EFFECT_STARTS];
        int known = 0;
        if (in.effect == "dead_time") {
            w[0] = dqw_estimator_value(&e, DQW_DEAD_TIME);
            sd[0] = dqw_estimator_sd_value(&e, DQW_DEAD_TIME);
            known = static_cast<int>(dqw_effect_known(w, sd, 1));
        } else {
            known = dqw_estimator_read_effect(&e, at++, w, sd);
        }
        read.push_back(input_read(in, known, w, sd, weight_unit(in, first, inputs)));
        if (in.effect != "dead_time") continue;
        InputRead& r = read.back();
        const dqw_modulation modulation = run->config().modulation;
        r.input.modulation = modulation_text(modulation);
        if (const std::string note = note_on_modulation(first, modulation); !note.empty()) result.notes.push_back(note);
        if (modulation == DQW_MODULATION_CENTRED) continue;
        r.input.weights.push_back(value(DQW_DEAD_CONSTANT));
        r.sd.push_back(static_cast<double>(dqw_estimator_sd_value(&e, DQW_DEAD_CONSTANT)));
    }
    put_effects(read, learned);
    return learned;
}

}  // namespace

dqw_modulation modulation_of_run(const std::vector<Log>& logs, const LearnOptions& options,
                                 const std::vector<TraceInput>& inputs, double pole_pairs)
{
    return Run(logs, options, inputs, pole_pairs, nullptr).config().modulation;
}

Learned learn_electrical(const std::vector<Log>& logs, const LearnOptions& options)
{
    return learn_in_passes(logs, options, pass);
}

}  // namespace dqw
