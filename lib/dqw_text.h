// Enumerators in words: the only place that turns them into text.
#ifndef DQW_TEXT_H
#define DQW_TEXT_H

#include "dqw_effect_name.h"
#include "dqw_fault_name.h"
#include "dqw_state.h"
#include "dqw_status.h"
#include "dqw_why.h"

#ifdef __cplusplus
extern "C" {
#endif

/// What init said, as one line: the field that was refused, and what it may be. "half_window: 0 (computed) or 1 ..
/// 10000 pairs".
/// Returns  constant text; "?" for what is no enumerator
/// Context  ISR safe; no state
const char *dqw_status_text(enum dqw_status status);

/// Names as dqwatch writes them: a channel with its unit as suffix, "R_ohm"; a fault, "turn_short"; a stage,
/// "random learning".
/// Returns  constant text; "?" for what is no enumerator
/// Context  ISR safe; no state
#define dqw_parameter_text DQW_SIZED(dqw_parameter_text)
const char *dqw_parameter_text(enum dqw_monitor_channel channel);
const char *dqw_fault_text(enum dqw_fault_name fault);
const char *dqw_stage_text(enum dqw_stage_name stage);

/// Why a monitor is not in service, watches nothing at the moment, or does not watch one channel, as half a sentence:
/// "L_q is not known yet: i_q must move".
/// Returns  constant text; "?" for what is no enumerator
/// Context  ISR safe; no state
const char *dqw_why_text(enum dqw_why why);

#ifdef __cplusplus
}
#endif
#endif
