// The condition monitor of one motor, as the rest of a motor controller sees it.
#ifndef FOC_MONITOR_H
#define FOC_MONITOR_H

#include <stdbool.h>

#include "dqw_monitor.h"

/// Once, before the interrupt runs. False: the configuration is refused, and board_say() has said which field.
bool foc_monitor_start(void);

/// At the end of the FOC loop, every PWM period.
void foc_pwm_interrupt(void);

/// In the main loop or a low-priority task, at least every 20 PWM periods.
void foc_background(void);

/// A parameter as it is now: use `value` where it is `usable`, and nowhere else.
dqw_reading foc_parameter(enum dqw_monitor_channel which);

/// DQW_WHY_IN_SERVICE: the machine is watched. Else why not; dqw_why_text() has it in words.
enum dqw_why foc_why(void);

/// Before the power goes, or once a day.
void foc_store(void);

#endif
