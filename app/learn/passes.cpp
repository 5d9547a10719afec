#include "app/learn/passes.hpp"

#include <optional>
#include <stdexcept>

#include "app/base/effect_names.hpp"
#include "app/base/parameters.hpp"
#include "app/learn/inputs.hpp"
#include "app/learn/residual.hpp"

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

constexpr std::size_t kElectrical = DQW_PSI + 1;  // of kParameters
static_assert(kParameters[DQW_R].model == &PlainModel::R_ohm && kParameters[DQW_PSI].model == &PlainModel::psi_Wb);

/// What a pass without effects tells of the machine; 0: nothing.
struct Known {
    PlainModel model;
    double pole_pairs = 0.0;
    std::optional<Estimate> found;  ///< the pole pairs, where the log told them
};

Known learn_plain(const std::vector<Log>& logs, const LearnOptions& options, const std::optional<double>& said,
                  const Pass& pass)
{
    LearnOptions plain = quiet(options);
    plain.parameters.clear();
    const Learned first = pass(logs, plain, {}, said.value_or(0.0), said.has_value());
    Known known{first.model, said.value_or(0.0), {}};
    if (!said && logs.front().regime == Regime::standstill) known.pole_pairs = 1.0;
    for (const Estimate& e : first.result.parameters)
        if (e.name == "pole_pairs" && !e.given) known.found = e, known.pole_pairs = e.value;
    if (!(known.pole_pairs > 0.0))
        throw std::invalid_argument("effects need the pole pairs, which this log does not tell; say --pole-pairs N");
    for (std::size_t i = 0; i < kElectrical; ++i)
        if (double& value = known.model.*(kParameters[i].model); !(value > 0.0)) value = 0.0;
    return known;
}

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

Asked begin_result(const std::vector<Log>& logs, const LearnOptions& options, Result& result)
{
    result.rows = all_rows(logs);
    result.regime = logs.front().regime;
    if (result.regime == Regime::standstill) return {options.parameters, {"R_ohm"}};
    return {options.parameters, {"R_ohm", "Ld_H", "Lq_H", "psi_Wb"}};
}

PlainModel plain_model(std::uint16_t pole_pairs, const std::array<double, 4>& values)
{
    PlainModel model;
    model.pole_pairs = pole_pairs != 0 ? pole_pairs : 1;
    for (std::size_t i = 0; i < kElectrical; ++i) model.*(kParameters[i].model) = values[i];
    return model;
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
    // What the effects' inputs need to know of the machine; where a shape rests on values that lacked the effects, once
    // more with better ones.
    const bool again = needs_machine(options.inputs);
    Known known;
    if (!said || again) known = learn_plain(logs, options, said, pass);
    known.pole_pairs = said.value_or(known.pole_pairs);
    for (std::size_t i = 0; i < kElectrical; ++i) {
        const Parameter& p = kParameters[i];
        double& value = known.model.*(p.model);
        value = (machine.*(p.nominal)).value_or((options.start.*(p.nominal)).value_or(value));
    }
    check_room(options.inputs);
    LearnOptions first = options;
    if (again) first.block = {};
    const auto learn_with = [&](const LearnOptions& how, const PlainModel& model) {
        return pass(logs, how, completed(options.inputs, logs, model), known.pole_pairs, said.has_value());
    };
    Learned learned = learn_with(first, known.model);
    if (again) learned = learn_with(options, learned.model);
    if (known.found) learned.result.parameters.push_back(*known.found);
    report_residual_of(logs, learned.inputs, learned.model, nullptr, learned.result);
    return learned;
}

}  // namespace dqw
