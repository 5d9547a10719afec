// The reference: a batch fit of whole logs of one machine by prediction error, on Ceres.
#ifndef DQW_REF_FIT_FIT_HPP
#define DQW_REF_FIT_FIT_HPP

#include <functional>
#include <string>
#include <vector>

#include "ref/log/log.hpp"
#include "ref/log/result.hpp"

namespace dqw {

struct FitOptions {
    std::vector<std::string> parameters;        ///< asked for; empty: the regime's default
    std::function<void(double)> progress = {};  ///< called with 0..1 now and then
};

/// Fits the plain model to all logs jointly. All logs must have one regime; throws std::invalid_argument otherwise
/// (with a one-line message), or where a log is too short to fit.
Result fit(const std::vector<Log>& logs, const FitOptions& options = {});

}  // namespace dqw
#endif
