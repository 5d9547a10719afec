// Effects that are named, not searched for: the shapes in which they fit a log best.
#ifndef DQW_REF_TRACE_SHAPES_HPP
#define DQW_REF_TRACE_SHAPES_HPP

#include "ref/model/replanned.hpp"
#include "ref/trace/setup.hpp"

namespace dqw {

/// The blocks of a model's plan, none held out: a fit sees all rows but the guards between stretches.
Plan all_seen(const Model& model);

/// (E47). The plain model and every effect of `names`, jointly, fitted to all rows. Which of its shapes an effect
/// takes, the rows held out decide. Throws std::invalid_argument (one line) where the log cannot test an effect. Not
/// ok: no start could be predicted from.
Refined fit_named(const TraceSetup& setup, const std::vector<std::string>& names, const std::function<void()>& tick);

}  // namespace dqw
#endif
