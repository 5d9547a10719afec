// Effects that are named, not searched for: fitted with the plain model to all rows.
#ifndef DQW_REF_TRACE_NAMED_HPP
#define DQW_REF_TRACE_NAMED_HPP

#include <functional>
#include <string>
#include <vector>

#include "ref/effect/found.hpp"
#include "ref/log/log.hpp"
#include "ref/log/result.hpp"

namespace dqw {

/// Fits the plain model and the named effects to all rows: what `fit --effect` and `fit --config` do. `effects` of the
/// result has their parameters; an effect that the log cannot determine is in not_identifiable.
struct EffectFit {
    Result result;
    std::vector<TraceEffect> effects;
};
EffectFit fit_effects(const std::vector<Log>& logs, const std::vector<std::string>& effects,
                      const std::vector<std::string>& parameters, std::function<void(double)> progress = {});

}  // namespace dqw
#endif
