// What the example needs from a motor controller. Yours has these already, under other names.
#ifndef FOC_BOARD_H
#define FOC_BOARD_H

#include <stdbool.h>
#include <stddef.h>

/// What the FOC loop knows in this PWM period, SI. The configuration says what the voltage and the speed are.
typedef struct board_signals {
    float i_alpha_A, i_beta_A;  ///< sampled at the start of this period
    float cosine, sine;         ///< of the electrical angle at that moment
    float w_m_rad_s;            ///< at that moment
    float v_alpha_V,
        /// decided in this period, times V_dc as measured. The timer loads it at its end: it acts in the next one
        v_beta_V;
    bool limited;  ///< the inverter cannot give that voltage, or an ADC is at its end
} board_signals;

/// This period's signals. False: there are none, the ADC or the encoder was late.
bool board_sample(board_signals *now);

/// Let the PWM interrupt come, or hold it back.
void board_interrupt(bool on);

/// Tell someone: CAN, UART, a fault log.
void board_say(const char *what, const char *which, float value, float healthy);

/// A place that outlives a power cycle.
bool board_flash_read(void *to, size_t size);
void board_flash_write(const void *from, size_t size);

#endif
