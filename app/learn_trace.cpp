#include "learn_trace.hpp"

#include "learn.hpp"
#include "learn_residual.hpp"

namespace dqw {

TraceFit learn_fit(const std::vector<Log>& logs, const TraceResult& trace, bool with_effects)
{
    LearnOptions options;
    if (with_effects) options.inputs = trace.inputs;
    options.heldout_row = &trace.heldout_row;
    for (const Estimate& e : trace.after.parameters)
        if (e.name == "pole_pairs") options.start.pole_pairs = e.value;
    const Learned learned = learn_all(logs, options);
    Result judged;
    report_residual_of(logs, learned.inputs, learned.model, &trace.heldout_row, judged);
    return {learned.result.parameters, judged.residual_rms, judged.axes};
}

}  // namespace dqw
