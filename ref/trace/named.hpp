// Effects that are named, not searched for: fitted with the plain model to all rows.
#ifndef DQW_REF_TRACE_NAMED_HPP
#define DQW_REF_TRACE_NAMED_HPP

#include <Eigen/Core>
#include <functional>
#include <optional>
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

/// R, L_d, L_q, psi of a fit with effects, and the deviations that its blocks scatter by: infinite where the rows do not
/// tell.
struct NamedLook {
    Eigen::Vector4d value, sd;
};

/// The same fit of at most 20 000 of dynamic logs' rows, their pole pairs known. Returns nothing where they are too few,
/// where it does not converge, or ends as no machine.
std::optional<NamedLook> look_at_named(const std::vector<Log>& logs, const std::vector<std::string>& effects,
                                       double pole_pairs);

}  // namespace dqw
#endif
