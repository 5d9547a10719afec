// The monitor's channels, faults and stages in words, for people: their names are those of dqw_text.h.
#ifndef DQW_APP_MONITOR_NAMES_HPP
#define DQW_APP_MONITOR_NAMES_HPP

#include <string>

#include "dqw_monitor.h"

namespace dqw {

/// A channel's name in dqwatch.event/1, with its unit as suffix, and how people call it.
struct MonitorChannel {
    const char *parameter, *title;
};
MonitorChannel channel_named(int channel);

/// "a", "b", "c"; empty for a fault that has no phase.
const char* phase_of(const dqw_fault_verdict& fault);

/// "turn short in phase b".
std::string fault_spoken(const dqw_fault_verdict& fault);

/// What has happened, as half a sentence: "the magnets have lost flux".
std::string fault_told(const dqw_fault_verdict& fault);

/// With its first letter large.
std::string capital(std::string text);

/// "stage 2, random learning (coarse values)"; "in service".
const char* stage_spoken(dqw_stage_name stage);

}  // namespace dqw
#endif
