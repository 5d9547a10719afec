// `demo`: simulate a servo, learn it, fit it, and compare both with the truth.
#ifndef DQW_APP_CMD_DEMO_HPP
#define DQW_APP_CMD_DEMO_HPP

#include "app/cmd/command.hpp"

namespace dqw {

int demo_command(const Options& options);

}  // namespace dqw
#endif
