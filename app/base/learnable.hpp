// Which effects of the catalogue firmware's learners have a law of, and why the others have none.
#ifndef DQW_APP_BASE_LEARNABLE_HPP
#define DQW_APP_BASE_LEARNABLE_HPP

#include <string>
#include <vector>

#include "ref/effect/found.hpp"

namespace dqw {

/// All names of the catalogue, electrical ones first.
const std::vector<std::string>& traced_names();

/// Why the learners cannot take an input: "sample_shift is not learned: ..."; empty where they can.
std::string not_learned(const TraceInput& in);

/// Those that they have a law of.
std::vector<TraceInput> learnable(const std::vector<TraceInput>& inputs);

/// A line for each name of the others.
std::vector<std::string> notes_on_others(const std::vector<TraceInput>& inputs);

}  // namespace dqw
#endif
