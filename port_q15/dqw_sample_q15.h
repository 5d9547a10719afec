// What a controller hands over in each PWM period, in fixed point.
#ifndef DQW_SAMPLE_Q15_H
#define DQW_SAMPLE_Q15_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Terminal signals of one row, as dqw_sample. Of voltages, currents and speed -32768, -32767 and 32767 count as beyond
/// the full scale.
typedef struct dqw_sample_q15 {
    int16_t v_d_q15, v_q_q15;  ///< of v_full
    int16_t i_d_q15, i_q_q15;  ///< of i_full
    int16_t w_m_q15;           ///< of w_full; mechanical
    /// of the electrical angle; read only where the configuration says that there is one
    int16_t cosine_q15, sine_q15;
    /// hundredths of a degree; INT16_MIN: no number. Read only where an effect needs it
    int16_t temp_winding_cC, temp_magnet_cC;
    /// bits 0, 1, 2: the leg of a, b, c does not switch while this voltage is made; read only with
    /// DQW_MODULATION_MASK
    uint8_t resting;
} dqw_sample_q15;

/// A sample from dq and the electrical angle.
///
/// Source   (E2) in docs/EQUATIONS.md
/// Format   Q15 of the full scales; w_m_q15 mechanical; theta_e_turn 65536 a turn
/// Range    any
/// Cost     9 products of 32 bits
/// Context  ISR safe; no state
dqw_sample_q15 dqw_sample_from_dq_q15(int16_t v_d_q15, int16_t v_q_q15, int16_t i_d_q15, int16_t i_q_q15,
                                      int16_t w_m_q15, uint16_t theta_e_turn);

/// A sample from stationary-frame voltages and currents with the cosine and sine of the electrical angle.
///
/// Source   (E2) in docs/EQUATIONS.md
/// Format   Q15 of the full scales; w_m_q15 mechanical
/// Range    any; rounded once; what does not fit stops at the full scale, and so counts as beyond it
/// Cost     8 products of 16 by 16 bits
/// Context  ISR safe; no state
dqw_sample_q15 dqw_sample_from_alphabeta_q15(int16_t v_alpha_q15, int16_t v_beta_q15, int16_t i_alpha_q15,
                                             int16_t i_beta_q15, int16_t w_m_q15, int16_t cosine_q15, int16_t sine_q15);

#ifdef __cplusplus
}
#endif
#endif
