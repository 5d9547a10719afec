// A result as JSON (schema dqwatch.parameters/1) and as text.
#ifndef DQW_APP_REPORT_REPORT_HPP
#define DQW_APP_REPORT_REPORT_HPP

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "ref/log/log.hpp"
#include "ref/log/result.hpp"

namespace dqw {

/// The object of schema dqwatch.parameters/1. Beyond it: nominal values, `excitation`, `residual.axes`, `notes`.
nlohmann::ordered_json result_json(const Result& result, const Machine& nominal);

/// The same for people, notes left out: they go to stderr.
std::string result_text(const Result& result, const Machine& nominal);

/// What was asked for is either estimated or said not to be identifiable, whatever the estimator knows.
void name_what_was_left_out(Result& result, const std::vector<std::string>& asked);

/// JSON text, two spaces deep, ending in a newline; bytes that are no UTF-8 (file names) are replaced.
std::string json_text(const nlohmann::ordered_json& json);

/// What the machine file says about a parameter.
std::optional<double> nominal_of(const Machine& machine, const std::string& parameter);

}  // namespace dqw
#endif
