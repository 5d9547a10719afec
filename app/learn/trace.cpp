#include "app/learn/trace.hpp"

#include <algorithm>

#include "app/learn/learn.hpp"
#include "app/learn/residual.hpp"

namespace dqw {

TraceFit learn_fit(const std::vector<Log>& logs, const TraceResult& trace, bool with_effects)
{
    LearnOptions options;
    if (with_effects) options.inputs = trace.inputs;
    options.heldout_row = &trace.heldout_row;
    for (const Estimate& e : trace.after.parameters)
        if (e.name == "pole_pairs") options.start.pole_pairs = e.value;
    // Where the tracer knows none, 1 stands for them here as there.
    const bool known = trace.regime == Regime::mechanical || options.start.pole_pairs.has_value();
    if (!known) options.start.pole_pairs = 1.0;
    Learned learned = learn_all(logs, options);
    Result judged;
    report_residual_of(logs, learned.inputs, learned.model, &trace.heldout_row, judged);
    auto& parameters = learned.result.parameters;
    if (!known)
        parameters.erase(std::remove_if(parameters.begin(), parameters.end(),
                                        [](const Estimate& e) { return e.name == "pole_pairs"; }),
                         parameters.end());
    // In parts of the signal that the trace's own are of.
    for (AxisResidual& axis : judged.axes)
        for (const AxisResidual& own : trace.before.axes)
            if (axis.axis == own.axis) axis.percent = own.rms > 0.0 ? own.percent * axis.rms / own.rms : axis.percent;
    return {parameters, judged.residual_rms, judged.axes};
}

}  // namespace dqw
