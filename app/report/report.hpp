// A result as JSON (schema dqwatch.parameters/1) and as text.
#ifndef DQW_APP_REPORT_REPORT_HPP
#define DQW_APP_REPORT_REPORT_HPP

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "ref/effect/found.hpp"
#include "ref/log/log.hpp"
#include "ref/log/result.hpp"

namespace dqw {

/// The object of schema dqwatch.parameters/1. Beyond it: nominal values, `excitation`, `residual.axes`, `notes`.
nlohmann::ordered_json result_json(const Result& result, const Machine& nominal,
                                   const std::vector<TraceEffect>& effects = {});

/// The same for people, notes left out: they go to stderr.
std::string result_text(const Result& result, const Machine& nominal, const std::vector<TraceEffect>& effects = {});

/// Value and deviation of each, by name; of what was given that it was.
nlohmann::ordered_json parameters_json(const std::vector<Estimate>& parameters);

/// "not usable: L_d, ψ"; empty where all are.
std::string not_usable_text(const std::vector<Estimate>& parameters);

/// Residual of each axis.
nlohmann::ordered_json axes_json(const std::vector<AxisResidual>& axes);

/// What was asked for is either estimated or said not to be identifiable, whatever the estimator knows.
void name_what_was_left_out(Result& result, const std::vector<std::string>& asked);

/// JSON text, two spaces deep, ending in a newline; bytes that are no UTF-8 (file names) are replaced.
std::string json_text(const nlohmann::ordered_json& json);

}  // namespace dqw
#endif
