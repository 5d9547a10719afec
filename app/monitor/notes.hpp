// What a monitor's run has to explain.
#ifndef DQW_APP_MONITOR_NOTES_HPP
#define DQW_APP_MONITOR_NOTES_HPP

#include <string>
#include <vector>

#include "app/monitor/run.hpp"

namespace dqw {

/// Why it is not in service, and what would help; empty where it was.
std::string why_no_service(const MonitorRun& run);

/// Why a channel is not watched, and what would help: "the motion does not teach it: a turning machine would".
std::string why_not_watched(int channel, dqw_why why);

/// "to stage 1 again at 3.2 s: …".
std::string way_back_text(double t_s, const dqw_stage& stage);

/// What becomes known at the end only.
std::vector<std::string> closing_notes(const MonitorRun& run);

}  // namespace dqw
#endif
