// The trace of a log whose currents firmware may have filtered: as it stands, or from before the filter. (E197)
#ifndef DQW_REF_TRACE_BEHIND_FILTER_HPP
#define DQW_REF_TRACE_BEHIND_FILTER_HPP

#include <functional>
#include <string>
#include <vector>

#include "ref/search/solve.hpp"
#include "ref/trace/setup.hpp"
#include "ref/trace/trace.hpp"

namespace dqw {

/// A trace of logs as they stand, and what asks whether their currents are filtered.
struct Traced {
    TraceResult result;
    Refined plain, best;  ///< what the search took
    std::vector<std::string> base_names;
    double pole_pairs = 0.0;  ///< 0: not known
};

using TraceOf = std::function<Traced(const std::vector<Log>&, const TraceOptions&)>;

/// Whether an effect of that name is sought.
bool is_asked(const TraceOptions& options, Law law);
/// A trace that seeks no effect.
TraceOptions without_effects(TraceOptions options);
/// A trace that seeks that one alone, if it is sought.
TraceOptions with_effect(const TraceOptions& options, Law law);

/// What `trace_of` says of the logs, or, where their currents passed a firmware's filter, of those from before it, with
/// the filter as its first effect. `plain`: of a trace without_effects().
TraceResult trace_behind_filter(const std::vector<Log>& logs, const TraceOptions& options, const TraceOf& trace_of,
                                const TraceSetup& plain);

}  // namespace dqw
#endif
