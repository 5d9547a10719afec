#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

#include "learn_inputs.hpp"
#include "learn_parts.hpp"
#include "learn_residual.hpp"
#include "learn_signals.hpp"

namespace dqw {
namespace {

constexpr std::uint32_t kReservoir = 50;  // as in the paper
// Half a block may see this much of an effect's own angle: averaged over more of it, the effect is gone.
constexpr double kHalfAngle_rad = 1.5;
constexpr int kLeastHalfWindowOfAngle = 3;

void note_stage(const dqw_estimator& e, Result& result)
{
    static const char* const names[] = {"domain knowledge", "random learning", "ordinal learning", "in service"};
    static const char* const whys[] = {"", "the Random Learners did not settle", "the residual stayed above the threshold", "the residual left its band"};
    std::string text = fmt::format("stage {}: {}", e.stage.name == DQW_STAGE_IN_SERVICE ? 4 : static_cast<int>(e.stage.name) + 1, names[e.stage.name]);
    if (e.stage.back != DQW_BACK_NONE)
        text += fmt::format("; went back because {} ({:.1f} %, threshold {:.1f} %)", whys[e.stage.back], 1e-4 * e.stage.residual_ppm,
                            1e-4 * e.stage.threshold_ppm);
    result.notes.push_back(text);
}

std::string why_unknown(const dqw_estimator& e, float value, float sd, std::uint32_t excited_blocks, const char* what)
{
    if (excited_blocks == 0) return fmt::format("{} is below {:.1f} % of its base in all {} blocks", what, 100.0 * e.excitation_pu, e.gate.blocks);
    if (std::isfinite(sd) && value > 0.0F)
        return fmt::format("its deviation is {:.0f} % of it; {} is large enough in {} of {} blocks", 100.0 * sd / value, what, excited_blocks, e.gate.blocks);
    return fmt::format("its effect cannot be told from another parameter's; {} is large enough in {} of {} blocks", what, excited_blocks, e.gate.blocks);
}

void put_electrical(const dqw_estimator& e, const dqw_parameters& q, bool is_static, bool p_given, const Asked& asked, Result& result)
{
    const auto* excited = e.excited;
    const auto both = [&](int d_input, int q_input) { return std::max(excited[d_input], excited[DQW_D_INPUTS + q_input]); };
    const bool no_p = q.pole_pairs == 0;
    const std::string needs_p = "only its product with the pole pairs is in this log, and these are not known";
    struct Row {
        const char *name, *what;
        float value, sd;
        std::uint8_t bit;
        std::uint32_t blocks;
        bool through_p;
        const char* excitation;
    };
    const Row rows[] = {
        {"R_ohm", "the current", q.R_ohm, q.R_sd_ohm, DQW_KNOWS_R, both(DQW_IN_R, DQW_IN_R), false,
         "a current of several levels on either axis, best at low speed"},
        {"Ld_H", is_static ? "i_d times speed" : "the change of i_d (and i_d times speed)", q.Ld_H, q.Ld_sd_H, DQW_KNOWS_LD, both(DQW_IN_L, DQW_IN_CROSS),
         is_static,
         is_static ? "i_d at several levels while the machine turns, and pole_pairs"
                   : "a varying i_d: steps of its reference or a random binary voltage on v_d"},
        {"Lq_H", is_static ? "i_q times speed" : "the change of i_q (and i_q times speed)", q.Lq_H, q.Lq_sd_H, DQW_KNOWS_LQ,
         std::max(excited[DQW_IN_CROSS], excited[DQW_D_INPUTS + DQW_IN_L]), is_static,
         is_static ? "i_q at several levels while the machine turns, and pole_pairs" : "a varying i_q: steps of torque or a random binary voltage on v_q"},
        {"psi_Wb", "the speed", q.psi_Wb, q.psi_sd_Wb, DQW_KNOWS_PSI, excited[DQW_D_INPUTS + DQW_IN_FLUX], true,
         "a turning machine with i_d and i_q at several levels, and pole_pairs where they cannot be found"},
    };
    for (const Row& r : rows) {
        if (!asked(r.name)) continue;
        if (q.known & r.bit)
            result.parameters.push_back({r.name, r.value, r.sd, false});
        else
            result.not_identifiable.push_back(
                {r.name, no_p && r.through_p && r.blocks > 0 ? needs_p : why_unknown(e, r.value, r.sd, r.blocks, r.what), r.excitation});
    }
    if (p_given)
        result.parameters.push_back({"pole_pairs", static_cast<double>(e.pole_pairs), 0.0, true});
    else if (e.pole_pairs == 0 && (q.known & DQW_KNOWS_POLE_PAIRS))
        result.parameters.push_back({"pole_pairs", static_cast<double>(q.pole_pairs), q.pole_pairs_raw_sd, false});
    else if (e.pole_pairs == 0 && (asked("pole_pairs") || (no_p && asked("psi_Wb"))))
        result.not_identifiable.push_back({"pole_pairs",
                                           std::isfinite(q.pole_pairs_raw_sd)
                                               ? fmt::format("the cross weights say {:.2f} with a deviation of {:.2f}", q.pole_pairs_raw, q.pole_pairs_raw_sd)
                                               : std::string("the slopes of the currents or their products with the speed are too small"),
                                           "currents that change on both axes while the machine turns, or --pole-pairs"});
}

/// Times the electrical angle with which an effect comes and goes on the axes; 0: not with the angle.
double order_of(const TraceInput& in)
{
    if (in.effect == "flux_harmonics") return in.shape[0];
    if (in.effect == "current_gain_mismatch" || in.effect == "phase_resistance_imbalance") return 2.0;
    return in.effect == "current_offset" ? 1.0 : 0.0;
}

}  // namespace

std::uint16_t half_window_of(const std::vector<Log>& logs, const std::vector<TraceInput>& inputs, double pole_pairs)
{
    const double dt_s = logs.front().dt_s;
    double span_s = kElectricalHalf_s;
    int least = kLeastElectricalHalf;
    const double w_e = pole_pairs * static_cast<double>(largest(logs, &Log::w_m_rad_s, &Log::w_m_rad_s));
    for (const TraceInput& in : inputs)
        if (order_of(in) > 0.0 && kHalfAngle_rad / (order_of(in) * w_e) < span_s) {
            span_s = kHalfAngle_rad / (order_of(in) * w_e);
            least = kLeastHalfWindowOfAngle;
        }
    return half_window(span_s, dt_s, least);
}

namespace {

/// One pass of lib/.
Learned pass(const std::vector<Log>& logs, const LearnOptions& options, const std::vector<TraceInput>& inputs, double pole_pairs, bool p_given)
{
    const Log& first = logs.front();
    const bool is_static = first.regime != Regime::dynamic;
    std::vector<dqw_random_sample> reservoir_d(kReservoir);
    std::vector<dqw_random_sample> reservoir_q(kReservoir);
    std::vector<dqw_effect_config> list = lists_of(inputs);
    std::vector<double> units;
    for (std::size_t n = 0; n < inputs.size(); n++) {
        units.push_back(weight_unit(inputs[n], first, inputs));
        list[n].start[0] /= static_cast<float>(units[n]);
    }

    dqw_estimator_config config{};
    config.regime = is_static ? DQW_REGIME_STATIC : DQW_REGIME_DYNAMIC;
    config.dt_s = period_of(first, inputs);
    config.v_base_V = largest(logs, &Log::v_d_V, &Log::v_q_V);
    config.i_base_A = largest(logs, &Log::i_d_A, &Log::i_q_A);
    config.w_base_rad_s = largest(logs, &Log::w_m_rad_s, &Log::w_m_rad_s);
    config.R_ohm = nominal(first.machine, options.start, &Machine::R_ohm);
    config.Ld_H = nominal(first.machine, options.start, &Machine::Ld_H);
    config.Lq_H = nominal(first.machine, options.start, &Machine::Lq_H);
    config.psi_Wb = nominal(first.machine, options.start, &Machine::psi_Wb);
    config.pole_pairs = static_cast<std::uint16_t>(pole_pairs);
    if (!is_static) config.half_window = half_window_of(logs, inputs, pole_pairs);
    config.reservoir_d = reservoir_d.data();
    config.reservoir_q = reservoir_q.data();
    config.reservoir = kReservoir;
    config.seed = 1;
    config.effects = list.data();
    config.effect_count = static_cast<std::uint8_t>(list.size());
    dqw_estimator e;
    if (dqw_estimator_init(&e, &config) != DQW_OK) throw std::invalid_argument("the learners refuse these bases, nominal values or shapes of effects");

    std::size_t done = 0;
    std::uint32_t heldout = 0;
    const std::size_t total = all_rows(logs);
    for (const Log& log : logs) {
        const SampleSource sample(log, pole_pairs, inputs);
        walk(
            log, done, total, options, [&] { dqw_estimator_gap(&e); },
            [&](std::size_t k, bool held) {
                // What is held out is not learned, but it heats.
                if (held && list.empty()) return;
                const dqw_sample s = sample(k);
                heldout += held ? 1U : 0U;
                if ((dqw_estimator_step(&e, &s, held) & DQW_EVENT_LEARNED) == 0) return;
                dqw_estimator_background(&e);
                const dqw_parameters& now = e.parameters;
                if (options.block) options.block(log.t_s.empty() ? static_cast<double>(k) : log.t_s[k], {now.R_ohm, now.Ld_H, now.Lq_H, now.psi_Wb});
            });
    }

    Learned learned;
    Result& result = learned.result;
    result.rows = total;
    result.regime = first.regime;
    Asked asked{options.parameters, {"R_ohm", "Ld_H", "Lq_H", "psi_Wb"}};
    if (first.regime == Regime::standstill) asked.defaults = {"R_ohm"};
    put_electrical(e, e.parameters, is_static, p_given, asked, result);
    note_gate(e.gate, heldout, result);
    note_stage(e, result);

    // The residual needs p L and p psi only, so where p is not known it is reckoned with p = 1.
    const dqw_parameters q = is_static && e.parameters.pole_pairs == 0 ? dqw_model_read(&e.d, &e.q, 1, DQW_WEIGHT_COMMON) : e.parameters;
    PlainModel& model = learned.model;
    model.pole_pairs = q.pole_pairs != 0 ? q.pole_pairs : 1;
    model.R_ohm = q.R_ohm;
    model.Ld_H = q.Ld_H;
    model.Lq_H = q.Lq_H;
    model.psi_Wb = q.psi_Wb;
    std::vector<InputRead> read;
    for (std::size_t n = 0; n < inputs.size(); n++) {
        float w[DQW_EFFECT_STARTS], sd[DQW_EFFECT_STARTS];
        const auto weights = static_cast<std::size_t>(dqw_effect_weights(list[n].effect));
        const int known = dqw_estimator_effect(&e, static_cast<int>(n), w, sd);
        read.push_back({inputs[n], {}, static_cast<std::uint32_t>(known)});
        read.back().input.weights.clear();
        for (std::size_t i = 0; i < weights; i++) {
            read.back().input.weights.push_back(static_cast<double>(w[i]) * units[n]);
            read.back().sd.push_back(static_cast<double>(sd[i]) * units[n]);
        }
    }
    put_effects(read, learned);
    return learned;
}

}  // namespace

Learned learn_electrical(const std::vector<Log>& logs, const LearnOptions& options) { return learn_in_passes(logs, options, pass); }

Learned learn_in_passes(const std::vector<Log>& logs, const LearnOptions& options, const Pass& pass)
{
    const Machine& machine = logs.front().machine;
    const std::optional<double> said = machine.pole_pairs ? machine.pole_pairs : options.start.pole_pairs;
    if (options.inputs.empty()) {
        Learned learned = pass(logs, options, {}, said.value_or(0.0), said.has_value());
        report_residual_of(logs, {}, learned.model, nullptr, learned.result);
        return learned;
    }

    // [LEARN.1] what the effects' inputs need to know of the machine
    PlainModel known;
    double pole_pairs = said.value_or(0.0);
    std::optional<Estimate> found;
    if (!said || needs_machine(options.inputs)) {
        LearnOptions plain = options;
        plain.progress = {};
        plain.block = {};
        plain.parameters.clear();
        const Learned first = pass(logs, plain, {}, pole_pairs, said.has_value());
        known = first.model;
        if (!said && logs.front().regime == Regime::standstill) pole_pairs = 1.0;
        for (const Estimate& e : first.result.parameters)
            if (e.name == "pole_pairs" && !e.given) found = e, pole_pairs = e.value;
        if (!(pole_pairs > 0.0)) throw std::invalid_argument("effects need the pole pairs, which this log does not tell; say --pole-pairs N");
        for (double PlainModel::*value : {&PlainModel::R_ohm, &PlainModel::Ld_H, &PlainModel::Lq_H, &PlainModel::psi_Wb})
            if (!(known.*value > 0.0)) known.*value = 0.0;
    }
    const auto nominal_or = [&](std::optional<double> Machine::*value, double otherwise) {
        return (machine.*value).value_or((options.start.*value).value_or(otherwise));
    };
    known.R_ohm = nominal_or(&Machine::R_ohm, known.R_ohm);
    known.Ld_H = nominal_or(&Machine::Ld_H, known.Ld_H);
    known.Lq_H = nominal_or(&Machine::Lq_H, known.Lq_H);
    known.psi_Wb = nominal_or(&Machine::psi_Wb, known.psi_Wb);

    // [LEARN.2] learn; where a shape rests on values that lacked the effects, once more with better ones
    check_room(options.inputs);
    const bool again = needs_machine(options.inputs);
    LearnOptions first = options;
    if (again) first.block = {};
    Learned learned = pass(logs, first, completed(options.inputs, logs, known), pole_pairs, said.has_value());
    if (again) learned = pass(logs, options, completed(options.inputs, logs, learned.model), pole_pairs, said.has_value());
    if (found) learned.result.parameters.push_back(*found);
    report_residual_of(logs, learned.inputs, learned.model, nullptr, learned.result);
    return learned;
}

}  // namespace dqw
