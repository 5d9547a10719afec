// What of the catalogue a log can test, in which shapes, and what it cannot, and why.
#ifndef DQW_REF_TRACE_CANDIDATES_HPP
#define DQW_REF_TRACE_CANDIDATES_HPP

#include "ref/trace/setup.hpp"

namespace dqw {

/// Fills the candidates and the untestable ones of a setup whose columns stand. `only`: names of the effects to try;
/// empty: all, and the faults of the record that could be mistaken for them.
void add_candidates(TraceSetup& setup, const std::vector<std::string>& only);

}  // namespace dqw
#endif
