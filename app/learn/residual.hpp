// The residual of what the learners found, effects included: lib/'s own inputs with the learned weights, taken off the
// log.
#ifndef DQW_APP_LEARN_RESIDUAL_HPP
#define DQW_APP_LEARN_RESIDUAL_HPP

#include <vector>

#include "ref/effect/found.hpp"
#include "ref/log/residual.hpp"

namespace dqw {

/// (E43) as report_residual(), with effects; percentages are of what was measured. Where `heldout_row` is given, of the
/// rows alone that it marks: blocks begin where a marked stretch does.
void report_residual_of(const std::vector<Log>& logs, const std::vector<TraceInput>& inputs, const PlainModel& model,
                        const std::vector<char>* heldout_row, Result& result);

}  // namespace dqw
#endif
