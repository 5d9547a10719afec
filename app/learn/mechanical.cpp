#include "app/learn/mechanical.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "app/learn/inputs.hpp"
#include "app/learn/residual.hpp"
#include "app/learn/shaft.hpp"
#include "app/learn/torque_constant.hpp"
#include "dqw_effect.h"
#include "ref/effect/effect.hpp"
#include "ref/model/hat.hpp"
#include "ref/model/lasting.hpp"
#include "ref/model/warming.hpp"

namespace dqw {
namespace {

// A block may see this much of a log: slower steps of torque are rare.
constexpr double kMostPart = 1.0 / 32.0;
// Half a block may see this much of a cogging's own angle.
constexpr double kHalfAngle_rad = 1.5;

// The block's halves are those of a hat, whose slopes the speed's noise hardly makes. (E190)
HatChoice hat_of(const std::vector<Log>& logs)
{
    const std::vector<Piece> pieces = pieces_of(logs, 2);
    return choose_hat(pieces, kMostPart * static_cast<double>(rows_of(pieces)) * logs.front().dt_s);
}

std::uint16_t half_window_of(double dt_s, double span_s, const std::vector<TraceInput>& inputs, double w_m_rad_s)
{
    int least = 10;
    for (const TraceInput& in : inputs)
        if (in.effect == "cogging_torque" && kHalfAngle_rad / (in.shape[0] * w_m_rad_s) < span_s) {
            span_s = kHalfAngle_rad / (in.shape[0] * w_m_rad_s);
            least = 3;
        }
    return half_window(span_s, dt_s, least);
}

void put(Result& result, const char* name, const Read& read, const char* why, const char* excitation)
{
    if (read.known())
        result.parameters.push_back({name, read.value, read.sd, false});
    else
        result.not_identifiable.push_back(
            {name,
             std::isfinite(read.sd) ? fmt::format("{}: {:.3g} with a deviation of {:.3g}", why, read.value, read.sd)
                                    : std::string(why),
             excitation});
}

ShaftLogs shaft_logs(const std::vector<Log>& logs, const LearnOptions& options)
{
    ShaftLogs shaft;
    check_room(options.inputs);
    if (!options.inputs.empty()) shaft.inputs = completed(options.inputs, logs, {});
    shaft.torque_constant_Nm_A = logs.front().machine.torque_constant_Nm_A.value_or(0.0);
    for (const Log& log : logs) {
        shaft.torques.push_back(torque_of(log, shaft.torque_constant_Nm_A, shaft.source));
        for (double t : shaft.torques.back()) shaft.largest_torque_Nm = std::max(shaft.largest_torque_Nm, std::abs(t));
    }
    if (!(shaft.largest_torque_Nm > 1e-30)) shaft.largest_torque_Nm = 1.0;
    shaft.largest_w_rad_s = static_cast<double>(largest(logs, &Log::w_m_rad_s, &Log::w_m_rad_s));
    const HatChoice hat = hat_of(logs);
    shaft.hat_noise_part = hat.noise_part;
    shaft.half_window = half_window_of(logs.front().dt_s, hat.half_s, shaft.inputs, shaft.largest_w_rad_s);
    return shaft;
}

template <class Shaft>
Learned report(const std::vector<Log>& logs, const LearnOptions& options, const ShaftLogs& shaft, const Shaft& m,
               const Read& torque_constant)
{
    Learned learned;
    const Read J_kgm2 = m.read(DQW_J), B_Nms_rad = m.read(DQW_B);
    Result& result = learned.result;
    result.rows = all_rows(logs);
    result.regime = Regime::mechanical;
    result.notes.push_back("torque: " + shaft.source);
    const Asked asked{options.parameters, {"J_kgm2", "B_Nms_rad"}};
    if (asked("J_kgm2"))
        put(result, "J_kgm2", J_kgm2, "the speed's changes do not tell it",
            "steps of torque that accelerate the machine");
    if (asked("B_Nms_rad"))
        put(result, "B_Nms_rad", B_Nms_rad, "no torque that grows with speed stands out",
            "several speeds, held long enough, in both directions");
    if (asked("torque_constant_Nm_A"))
        put(result, "torque_constant_Nm_A", torque_constant,
            "torque_Nm and i_q_A are not both logged, or hardly change",
            "a log with torque_Nm and i_q_A at several levels");
    note_gate(m.gate(), 0, result);
    PlainModel& model = learned.model;
    model.J_kgm2 = J_kgm2.value;
    model.B_Nms_rad = B_Nms_rad.value;
    model.torque_constant_Nm_A = shaft.torque_constant_Nm_A;
    std::vector<InputRead> inputs;
    for (std::size_t n = 0; n < shaft.inputs.size(); n++) inputs.push_back(m.read_effect(n, shaft.inputs[n]));
    put_effects(inputs, learned);
    report_residual_of(logs, learned.inputs, model, nullptr, result);
    m.say(shaft, learned);
    return learned;
}

template <class Shaft> Learned learned_by(const std::vector<Log>& logs, const LearnOptions& options)
{
    const ShaftLogs shaft = shaft_logs(logs, options);
    Shaft m(logs, options, shaft);
    TorqueConstant torque_constant;
    std::size_t done = 0;
    const std::size_t total = all_rows(logs);
    for (std::size_t n = 0; n < logs.size(); n++) {
        const Log& log = logs[n];
        const bool both = !log.torque_Nm.empty() && !log.i_q_A.empty();
        const std::vector<float> angle = shaft.inputs.empty() ? std::vector<float>(log.rows()) : shaft_angle_of(log);
        walk(
            log, done, total, options, [&] { m.gap(); },
            [&](std::size_t k, bool held) {
                if (held) return;
                m.sample(shaft.torques[n][k], log.w_m_rad_s[k], angle[k]);
                if (both) torque_constant.learn(m.current(log.i_q_A[k]), m.torque(log.torque_Nm[k]));
                if (!m.background() || !options.block) return;
                options.block(log.t_s[k], {m.read(DQW_J).value, m.read(DQW_B).value, 0.0, 0.0});
            });
    }
    return report(logs, options, shaft, m, torque_constant.read());
}

Learned learned_once(const std::vector<Log>& logs, const LearnOptions& options)
{
    return options.fixed_point ? learned_by<Q15Shaft>(logs, options) : learned_by<FloatShaft>(logs, options);
}

using Values = std::map<std::string, double>;

Values values_of(const Learned& learned)
{
    Values values;
    for (const Estimate& e : learned.result.parameters) values[e.name] = e.value;
    for (const TraceEffect& effect : learned.effects)
        for (const Estimate& e : effect.parameters) values[effect.name + e.name] = e.value;
    return values;
}

/// Gives each deviation to `more(key, value, sd)`, which makes it wider.
template <class More> void widen(Learned& learned, const More& more)
{
    for (Estimate& e : learned.result.parameters) e.sd = more(e.name, e.value, e.sd);
    for (TraceEffect& effect : learned.effects)
        for (Estimate& e : effect.parameters) e.sd = more(effect.name + e.name, e.value, e.sd);
}

/// Takes B's and the effects' columns at a row into those of a hat.
void take_friction(const std::vector<dqw_effect_config>& effects, double w_m_rad_s, float angle_rad, double part,
                   Eigen::VectorXd& columns)
{
    float x[DQW_EFFECT_STARTS];
    Eigen::Index column = 1;
    columns[column++] -= part * w_m_rad_s;
    for (const dqw_effect_config& effect : effects) {
        dqw_effect_torque(&effect, static_cast<float>(w_m_rad_s), angle_rad, x);
        for (int i = 0; i < dqw_effect_weights(effect.effect); ++i)
            columns[column++] -= part * static_cast<double>(x[i]);
    }
}

/// What a friction that falls along the logs makes of each value, what lasts in the torque that is left, and what noise
/// is left in the slopes. (E190) to (E192)
void widen_by_rest(const std::vector<Log>& logs, const LearnOptions& options, Learned& learned)
{
    constexpr std::size_t kParts = 40;
    // What a trace shows the learners has a reference's deviations beside it.
    if (options.heldout_row != nullptr) return;
    const ShaftLogs shaft = shaft_logs(logs, options);
    std::vector<std::string> names{"J_kgm2", "B_Nms_rad"};
    std::vector<double> friction{0.0, learned.model.B_Nms_rad};
    const std::vector<dqw_effect_config> effects = lists_of(learned.inputs);
    for (std::size_t n = 0; n < effects.size(); ++n)
        for (std::size_t w = 0; w < learned.inputs[n].weights.size(); ++w) {
            names.push_back(learned.inputs[n].effect + "torque_Nm");
            friction.push_back(learned.inputs[n].weights[w]);
        }
    const auto n = static_cast<Eigen::Index>(friction.size());
    const Eigen::Map<const Eigen::VectorXd> of_friction(friction.data(), n);
    std::vector<TimedSum> sums;
    std::vector<Moved> stretches;
    double square = 0.0, hats = 0.0;
    for (std::size_t l = 0; l < logs.size(); ++l) {
        const std::vector<float> angle = shaft_angle_of(logs[l]);
        const std::size_t first = sums.size();
        for (std::size_t part = 0; part < kParts; ++part)
            sums.push_back({static_cast<double>(part) / (kParts - 1) - 0.5, Eigen::MatrixXd::Zero(n + 1, n + 1)});
        for (const Piece& piece : pieces_of(logs[l], 2)) {
            bool follows = false;
            each_hat(piece, piece.begin, piece.end, shaft.half_window, [&](std::size_t k, const Hat& hat) {
                Eigen::VectorXd row = Eigen::VectorXd::Zero(n + 1);
                row[0] = -hat.slope_of(&logs[l].w_m_rad_s[k]);
                for (std::size_t r = 0; r < hat.mean.size(); ++r)
                    take_friction(effects, logs[l].w_m_rad_s[k + r], angle[k + r], hat.mean[r], row);
                row[n] = hat.mean_of(&shaft.torques[l][k]) + row[0] * learned.model.J_kgm2 +
                         row.head(n).dot(of_friction);
                const double when = when_in(logs[l], k + shaft.half_window);
                sums[first + static_cast<std::size_t>((when + 0.5) * (kParts - 1) + 0.5)].gram += row * row.transpose();
                square += row[n] * row[n], hats += 1.0;
                stretches.push_back({row[n], row[0], row[1], follows});
                follows = true;
            });
        }
    }
    if (!(hats > 0.0)) return;
    Eigen::VectorXd more = warming_deviations(sums, of_friction, square / hats);
    const Eigen::Vector2d lasting = lasting_deviations(stretches);
    more[0] = std::hypot(more[0], lasting[0], shaft.hat_noise_part * learned.model.J_kgm2);
    more[1] = std::hypot(more[1], lasting[1]);
    widen(learned, [&](const std::string& key, double, double sd) {
        const auto found = std::find(names.begin(), names.end(), key);
        return found == names.end() ? sd : std::hypot(sd, more[found - names.begin()]);
    });
}

/// What a speed's width that nobody gave may be off by: from it to an eighth of it.
void widen_by_width(const std::vector<Log>& logs, const LearnOptions& options, Learned& learned)
{
    constexpr double kNarrow = 1.0 / 8.0;
    LearnOptions run = quiet(options);
    bool assumed = false;
    for (std::size_t n = 0; n < options.inputs.size(); ++n) {
        const Effect* effect = find_effect(options.inputs[n].effect);
        if (!options.inputs[n].shape.empty() || effect == nullptr || effect->shape != Shape::speed_width) continue;
        run.inputs[n].shape = learned.inputs[n].shape;
        run.inputs[n].shape[0] *= kNarrow, assumed = true;
    }
    if (!assumed) return;
    const Values narrow = values_of(learned_once(logs, run));
    widen(learned, [&](const std::string& key, double value, double sd) {
        const auto found = narrow.find(key);
        return found == narrow.end() ? sd : std::hypot(sd, found->second - value);
    });
}

}  // namespace

Learned learn_mechanical(const std::vector<Log>& logs, const LearnOptions& options)
{
    Learned learned = learned_once(logs, options);
    widen_by_rest(logs, options, learned);
    widen_by_width(logs, options, learned);
    return learned;
}

}  // namespace dqw
