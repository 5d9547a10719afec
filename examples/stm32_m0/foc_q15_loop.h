// What a FOC loop in fixed point and its condition monitor tell each other.
#ifndef FOC_Q15_LOOP_H
#define FOC_Q15_LOOP_H

#include <stdbool.h>
#include <stdint.h>

/// One period's signals, parts of the full scales.
typedef struct foc_q15 {
    int16_t i_alpha_q15, i_beta_q15, link_q15;  ///< measured
    // Of the loop:
    int16_t cosine_q15, sine_q15;     ///< of the electrical angle as the currents were sampled
    int16_t w_m_q15;                  ///< mechanical speed
    int16_t v_alpha_q15, v_beta_q15;  ///< decided in this period, from the link as measured
    uint16_t duty_q15[3];             ///< of the legs, 0 .. 32768
    bool limited;                     ///< the inverter cannot give that voltage
} foc_q15;

/// The controller's own loop.
void current_loop(foc_q15 *now);

/// False: the configuration was refused, or the ADC did not start.
bool foc_q15_start(void);
void foc_q15_background(void);

#endif
