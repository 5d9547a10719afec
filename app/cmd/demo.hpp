// `demo`: simulate a servo, learn it, fit it, and compare both with the truth.
#ifndef DQW_APP_CMD_DEMO_HPP
#define DQW_APP_CMD_DEMO_HPP

#include "app/cmd/command.hpp"

namespace dqw {

Command add_demo(CLI::App& app);

}  // namespace dqw
#endif
