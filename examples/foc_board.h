// What the example needs from a motor controller. Yours has these already, under other names.
#ifndef FOC_BOARD_H
#define FOC_BOARD_H

#include <stdbool.h>

#include "dqw_monitor.h"

/// What the FOC loop knows in this PWM period: the currents, speed and angle just sampled, and the voltage that acts from now to the next
/// period: where the timer loads it a period later, the one decided in the last. `limited`: the inverter cannot give it, or a sensor is at its limit.
bool board_signals(dqw_sample *now, bool *limited);

/// Let the PWM interrupt come, or hold it back.
void board_interrupt(bool on);

/// Tell someone: CAN, UART, a fault log.
void board_event(const dqw_monitor_event *event);

#endif
