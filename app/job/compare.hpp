// One log by float learners, fixed-point learners and the reference fit.
#ifndef DQW_APP_JOB_COMPARE_HPP
#define DQW_APP_JOB_COMPARE_HPP

#include <vector>

#include "app/job/options.hpp"
#include "app/learn/inputs.hpp"
#include "app/report/compare.hpp"
#include "ref/log/log.hpp"

namespace dqw {

/// A log that was read, and the effects asked for; the comparison has what was noted so far.
struct ToCompare {
    std::vector<Log> logs;
    LearnConfig config;
    Comparison comparison;
};

/// Reads the log; throws InputError.
ToCompare log_to_compare(const Options& options);

/// All three estimates of it; throws InputError.
Comparison compare_log(ToCompare what, const Options& options);

}  // namespace dqw
#endif
