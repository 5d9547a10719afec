#include "learn.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "dqw.h"
#include "residual.hpp"

namespace dqw {
namespace {

constexpr std::uint32_t kReservoir = 50;  // as in the paper
constexpr std::size_t kProgressRows = 65536;
// Half a block's length: short against a re-drawn reference, long against the sampling period.
constexpr double kHalfWindow_s = 2e-3;
constexpr double kMechanicalHalfWindow_s = 25e-3;

float largest(const std::vector<Log>& logs, std::vector<double> Log::*a, std::vector<double> Log::*b)
{
    double most = 0.0;
    for (const Log& log : logs)
        for (const auto* column : {&(log.*a), &(log.*b)})
            for (double x : *column) most = std::max(most, std::abs(x));
    // A channel that is zero throughout teaches nothing; its base only must not divide by zero.
    return most > 1e-30 ? static_cast<float>(most) : 1.0F;
}

float at(const std::vector<double>& column, std::size_t row) { return column.empty() ? 0.0F : static_cast<float>(column[row]); }

float nominal(const std::optional<double>& x) { return static_cast<float>(x.value_or(0.0)); }

std::uint16_t half_window(double span_s, double dt_s, int least)
{
    return static_cast<std::uint16_t>(std::clamp(std::lround(span_s / dt_s), static_cast<long>(least), 10000L));
}

// Calls step(row) for all rows of a log and gap() before each segment.
template <class Gap, class Step> void walk(const Log& log, std::size_t& done, std::size_t total, const LearnOptions& options, Gap gap, Step step)
{
    std::size_t next_segment = 0;
    const std::size_t rows = log.rows();
    for (std::size_t k = 0; k < rows; k++) {
        if (next_segment < log.segments.size() && k == log.segments[next_segment]) {
            gap();
            next_segment++;
        }
        step(k);
        if (options.progress && ++done % kProgressRows == 0) options.progress(static_cast<double>(done) / static_cast<double>(total));
    }
}

std::size_t all_rows(const std::vector<Log>& logs)
{
    std::size_t n = 0;
    for (const Log& log : logs) n += log.rows();
    return n;
}

struct Asked {
    const std::vector<std::string>& names;
    std::vector<std::string> defaults;
    bool operator()(const char* name) const
    {
        const auto& list = names.empty() ? defaults : names;
        return std::find(list.begin(), list.end(), name) != list.end();
    }
};

void note_gate(const dqw_gate& gate, Result& result)
{
    if (gate.nonfinite + gate.saturated + gate.stale > 0)
        result.notes.push_back(fmt::format("skipped {} samples: {} not finite, {} saturated, {} stale", gate.nonfinite + gate.saturated + gate.stale,
                                           gate.nonfinite, gate.saturated, gate.stale));
    if (gate.incomplete > 0) result.notes.push_back(fmt::format("dropped {} blocks with over a quarter of their samples skipped", gate.incomplete));
}

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

void put_electrical(const dqw_estimator& e, const dqw_parameters& q, bool is_static, const Asked& asked, Result& result)
{
    const auto* excited = e.gate.excited;
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
    if (e.pole_pairs != 0)
        result.parameters.push_back({"pole_pairs", static_cast<double>(e.pole_pairs), 0.0, true});
    else if (q.known & DQW_KNOWS_POLE_PAIRS)
        result.parameters.push_back({"pole_pairs", static_cast<double>(q.pole_pairs), q.pole_pairs_raw_sd, false});
    else if (asked("pole_pairs") || (no_p && asked("psi_Wb")))
        result.not_identifiable.push_back({"pole_pairs",
                                           std::isfinite(q.pole_pairs_raw_sd)
                                               ? fmt::format("the cross weights say {:.2f} with a deviation of {:.2f}", q.pole_pairs_raw, q.pole_pairs_raw_sd)
                                               : std::string("the slopes of the currents or their products with the speed are too small"),
                                           "currents that change on both axes while the machine turns, or --pole-pairs"});
}

Result learn_electrical(const std::vector<Log>& logs, const LearnOptions& options)
{
    const Log& first = logs.front();
    const bool is_static = first.regime != Regime::dynamic;
    std::vector<dqw_random_sample> reservoir_d(kReservoir);
    std::vector<dqw_random_sample> reservoir_q(kReservoir);

    dqw_estimator_config config{};
    config.regime = is_static ? DQW_REGIME_STATIC : DQW_REGIME_DYNAMIC;
    config.dt_s = is_static ? 1.0F : static_cast<float>(first.dt_s);
    config.v_base_V = largest(logs, &Log::v_d_V, &Log::v_q_V);
    config.i_base_A = largest(logs, &Log::i_d_A, &Log::i_q_A);
    config.w_base_rad_s = largest(logs, &Log::w_m_rad_s, &Log::w_m_rad_s);
    config.R_ohm = nominal(first.machine.R_ohm);
    config.Ld_H = nominal(first.machine.Ld_H);
    config.Lq_H = nominal(first.machine.Lq_H);
    config.psi_Wb = nominal(first.machine.psi_Wb);
    config.pole_pairs = static_cast<std::uint16_t>(first.machine.pole_pairs.value_or(0.0));
    if (!is_static) config.half_window = half_window(kHalfWindow_s, first.dt_s, 10);
    config.reservoir_d = reservoir_d.data();
    config.reservoir_q = reservoir_q.data();
    config.reservoir = kReservoir;
    config.seed = 1;
    dqw_estimator e;
    if (dqw_estimator_init(&e, &config) != DQW_OK) throw std::invalid_argument("the learners refuse these bases or nominal values");

    std::size_t done = 0;
    const std::size_t total = all_rows(logs);
    for (const Log& log : logs)
        walk(
            log, done, total, options, [&] { dqw_estimator_gap(&e); },
            [&](std::size_t k) {
                const dqw_sample s{at(log.v_d_V, k), at(log.v_q_V, k), at(log.i_d_A, k), at(log.i_q_A, k), at(log.w_m_rad_s, k)};
                if (dqw_estimator_step(&e, &s, false) & DQW_EVENT_LEARNED) dqw_estimator_background(&e);
            });

    Result result;
    result.rows = total;
    result.regime = first.regime;
    Asked asked{options.parameters, {"R_ohm", "Ld_H", "Lq_H", "psi_Wb"}};
    if (first.regime == Regime::standstill) asked.defaults = {"R_ohm"};
    put_electrical(e, e.parameters, is_static, asked, result);
    note_gate(e.gate, result);
    note_stage(e, result);

    // The residual needs p L and p psi only, so where p is not known it is reckoned with p = 1.
    const dqw_parameters q = is_static && e.parameters.pole_pairs == 0 ? dqw_model_read(&e.d, &e.q, 1, DQW_WEIGHT_COMMON) : e.parameters;
    PlainModel model;
    model.pole_pairs = q.pole_pairs != 0 ? q.pole_pairs : 1;
    model.R_ohm = q.R_ohm;
    model.Ld_H = q.Ld_H;
    model.Lq_H = q.Lq_H;
    model.psi_Wb = q.psi_Wb;
    report_residual(logs, model, result);
    return result;
}

void put(Result& result, const char* name, float value, float sd, bool known, const char* why, const char* excitation)
{
    if (known)
        result.parameters.push_back({name, value, sd, false});
    else
        result.not_identifiable.push_back(
            {name, std::isfinite(sd) ? fmt::format("{}: {:.3g} with a deviation of {:.3g}", why, value, sd) : std::string(why), excitation});
}

Result learn_mechanical(const std::vector<Log>& logs, const LearnOptions& options)
{
    const Log& first = logs.front();
    const double torque_constant = first.machine.torque_constant_Nm_A.value_or(0.0);
    Result result;
    result.rows = all_rows(logs);
    result.regime = Regime::mechanical;

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
    config.J_kgm2 = nominal(first.machine.J_kgm2);
    config.B_Nms_rad = nominal(first.machine.B_Nms_rad);
    config.half_window = half_window(kMechanicalHalfWindow_s, first.dt_s, 10);
    dqw_mechanical m;
    if (dqw_mechanical_init(&m, &config) != DQW_OK) throw std::invalid_argument("the learners refuse these bases or nominal values");

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
        walk(
            log, done, result.rows, options, [&] { dqw_mechanical_gap(&m); },
            [&](std::size_t k) {
                dqw_mechanical_step(&m, static_cast<float>(torques[n][k]), at(log.w_m_rad_s, k));
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
    note_gate(m.gate, result);
    PlainModel model;
    model.J_kgm2 = f.J_kgm2;
    model.B_Nms_rad = f.B_Nms_rad;
    model.torque_constant_Nm_A = torque_constant;
    report_residual(logs, model, result);
    return result;
}

void check(const std::vector<Log>& logs, const LearnOptions& options)
{
    static const char* const known[] = {"R_ohm", "Ld_H", "Lq_H", "psi_Wb", "pole_pairs", "J_kgm2", "B_Nms_rad", "torque_constant_Nm_A"};
    for (const std::string& name : options.parameters)
        if (std::find(std::begin(known), std::end(known), name) == std::end(known)) throw std::invalid_argument("unknown parameter '" + name + "'");
    if (logs.empty()) throw std::invalid_argument("no log");
    for (const Log& log : logs) {
        if (log.regime != logs.front().regime) throw std::invalid_argument(log.path + ": its regime differs from " + logs.front().path);
        const bool timed = log.regime == Regime::dynamic || log.regime == Regime::mechanical;
        if (timed && std::abs(log.dt_s / logs.front().dt_s - 1.0) > 1e-3)
            throw std::invalid_argument(log.path + ": its sampling period differs from " + logs.front().path + "; learn them one at a time");
    }
}

}  // namespace

Result learn(const std::vector<Log>& logs, const LearnOptions& options)
{
    check(logs, options);
    return logs.front().regime == Regime::mechanical ? learn_mechanical(logs, options) : learn_electrical(logs, options);
}

}  // namespace dqw
