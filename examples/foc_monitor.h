// The condition monitor of one motor, as the rest of a motor controller sees it.
#ifndef FOC_MONITOR_H
#define FOC_MONITOR_H

#include <stdbool.h>

#include "dqw_tracker.h"

/// Once, before the interrupt runs. False: the configuration is refused.
bool foc_monitor_start(void);

/// At the end of the FOC loop, every PWM period.
void foc_pwm_interrupt(void);

/// In the main loop or a low-priority task, at least every 20 PWM periods.
void foc_background(void);

/// A parameter and its standard deviation, SI. False: not to be used.
bool foc_parameter(enum dqw_tracker_weight which, float *value, float *sd);

/// The healthy machine is known; it is watched some eighty looks later, when its healthy values have been taken.
bool foc_in_service(void);

#endif
