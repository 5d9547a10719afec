// Why a log cannot determine a parameter, in words and figures.
#ifndef DQW_REF_FIT_EXPLAIN_HPP
#define DQW_REF_FIT_EXPLAIN_HPP

#include <string>
#include <vector>

#include "ref/fit/assess.hpp"
#include "ref/log/log.hpp"
#include "ref/log/result.hpp"

namespace dqw {

/// The reason and the remedy. `names` belongs to the entries of the theta that was assessed; never quotes the value.
NotIdentifiable explain(const std::string& name, const Assessment& assessment, const std::vector<std::string>& names,
                        const std::vector<Log>& logs);

/// What the next log should contain so that `name` can be told.
std::string excitation_for(const std::string& name, Regime regime);

/// Four significant digits, for reasons and notes.
std::string figure(double x);

}  // namespace dqw
#endif
