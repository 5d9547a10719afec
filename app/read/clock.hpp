// Times as people write them.
#ifndef DQW_APP_READ_CLOCK_HPP
#define DQW_APP_READ_CLOCK_HPP

#include <string_view>

namespace dqw {

/// Seconds of `2024-03-18T10:15:00.123` (since 1970, as if in UTC; a blank for the T, a Z or an offset behind it) or of
/// `10:15:00.123` (since midnight). False for anything else.
bool parse_clock(std::string_view field, double& t_s);

}  // namespace dqw
#endif
