// The condition monitor in a motor controller: one call in the PWM interrupt, the slow part in the main loop. docs/INTEGRATION.md says
// what each signal must be, and what to do on each event.
#include "foc_monitor.h"

#include <math.h>

#include "foc_board.h"
#include "foc_config.h"

static dqw_monitor monitor;
// Needed until the stage is past random learning, and again after a way back.
static dqw_monitor_random lent;

bool foc_monitor_start(void)
{
    dqw_monitor_random_init(&lent);
    return dqw_monitor_init(&monitor, &CONFIG, &lent) == DQW_OK;
}

void foc_pwm_interrupt(void)
{
    dqw_sample now;
    bool limited = false;
    // A period without a sample is a period: time goes on by calls.
    if (!board_signals(&now, &limited)) now.i_d_A = NAN;
    (void)dqw_monitor_sample(&monitor, &now, limited);
}

void foc_background(void)
{
    dqw_monitor_event event;
    if (dqw_monitor_background(&monitor, &event)) board_event(&event);
    // The model no longer fits: trace a log of it on the host, and give the monitor what was missing. Until then it learns anew.
    if (dqw_monitor_stage(&monitor) == DQW_STAGE_DOMAIN) {
        board_interrupt(false);
        dqw_monitor_random_init(&lent);
        (void)dqw_monitor_define(&monitor, &CONFIG, &lent);
        board_interrupt(true);
    }
}

bool foc_parameter(enum dqw_tracker_weight which, float *value, float *sd)
{
    *value = dqw_tracker_value(&monitor.tracker, which);
    *sd = dqw_tracker_sd(&monitor.tracker, which);
    // Not learned yet, or not from this motion: the deviation says so. Do not use the value then. Dead time and the flux on the other axis
    // may be negative.
    return *sd < 0.1f * (*value < 0.0f ? -*value : *value);
}

bool foc_in_service(void) { return dqw_monitor_stage(&monitor) == DQW_STAGE_IN_SERVICE; }
