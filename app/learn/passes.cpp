#include "app/learn/passes.hpp"

#include <algorithm>
#include <optional>
#include <stdexcept>

#include "app/base/effect_names.hpp"
#include "app/learn/inputs.hpp"
#include "app/learn/residual.hpp"
#include "app/learn/signals.hpp"

namespace dqw {
namespace {

// Half a block of an electrical log: short against a re-drawn reference, long against the sampling period; and its
// fewest pairs.
constexpr double kElectricalHalf_s = 2e-3;
constexpr int kLeastElectricalHalf = 10;
// Half a block may see this much of an effect's own angle: averaged over more of it, the effect is gone.
constexpr double kHalfAngle_rad = 1.5;
constexpr int kFewestPairs = 3;
constexpr double kLeastHalves = 14.0;

}  // namespace

std::uint16_t half_window_of(const std::vector<Log>& logs, const std::vector<TraceInput>& inputs, double pole_pairs)
{
    const double dt_s = logs.front().dt_s;
    double span_s = kElectricalHalf_s;
    int least = kLeastElectricalHalf;
    // A short log still has blocks enough for a deviation.
    const double most_s = static_cast<double>(all_rows(logs)) / kLeastHalves * dt_s;
    if (most_s < span_s) span_s = most_s, least = kFewestPairs;
    const double w_e = pole_pairs * static_cast<double>(largest(logs, &Log::w_m_rad_s, &Log::w_m_rad_s));
    for (const TraceInput& in : inputs)
        if (angle_order(in) > 0.0 && kHalfAngle_rad / (angle_order(in) * w_e) < span_s) {
            span_s = kHalfAngle_rad / (angle_order(in) * w_e);
            least = kFewestPairs;
        }
    return half_window(span_s, dt_s, least);
}

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
        LearnOptions plain = quiet(options);
        plain.parameters.clear();
        const Learned first = pass(logs, plain, {}, pole_pairs, said.has_value());
        known = first.model;
        if (!said && logs.front().regime == Regime::standstill) pole_pairs = 1.0;
        for (const Estimate& e : first.result.parameters)
            if (e.name == "pole_pairs" && !e.given) found = e, pole_pairs = e.value;
        if (!(pole_pairs > 0.0))
            throw std::invalid_argument(
                "effects need the pole pairs, which this log does not tell; say --pole-pairs N");
        for (double PlainModel::*value :
             {&PlainModel::R_ohm, &PlainModel::Ld_H, &PlainModel::Lq_H, &PlainModel::psi_Wb})
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
    if (again)
        learned = pass(logs, options, completed(options.inputs, logs, learned.model), pole_pairs, said.has_value());
    if (found) learned.result.parameters.push_back(*found);
    report_residual_of(logs, learned.inputs, learned.model, nullptr, learned.result);
    return learned;
}

}  // namespace dqw
