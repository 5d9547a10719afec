// The pole pairs by a log's own angle, which turns that often while the shaft turns once.
#ifndef DQW_REF_LOG_TURNS_HPP
#define DQW_REF_LOG_TURNS_HPP

#include <vector>

#include "ref/log/log.hpp"

namespace dqw {

/// Electrical turns in a mechanical one, by the log's own angle, negative where they run against each other; 0 where it
/// does not say.
double turns_of_angles(const std::vector<Log>& logs);

/// A whole number where these turns are near one; else 0.
double pole_pairs_of_angles(const std::vector<Log>& logs);

}  // namespace dqw
#endif
