// Learned or fitted effects as JSON (of the schema dqwatch.parameters/1) and as text.
#ifndef DQW_APP_REPORT_EFFECT_HPP
#define DQW_APP_REPORT_EFFECT_HPP

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "ref/effect/found.hpp"

namespace dqw {

/// The list "effects": name and physical parameters of each.
nlohmann::ordered_json effects_json(const std::vector<TraceEffect>& effects);

/// A table for people; empty where there is no effect.
std::string effects_text(const std::vector<TraceEffect>& effects);

}  // namespace dqw
#endif
