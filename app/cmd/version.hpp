// What this dqwatch is, and what it was built with.
#ifndef DQW_APP_CMD_VERSION_HPP
#define DQW_APP_CMD_VERSION_HPP

#include <string>

namespace dqw {

/// "dqwatch 0.2.0", then a line for each part that it was built with.
std::string version_text();

}  // namespace dqw
#endif
