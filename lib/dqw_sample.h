// What a controller hands over in each PWM period.
#ifndef DQW_SAMPLE_H
#define DQW_SAMPLE_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Terminal signals of one row: currents, speed and angle at t_k; voltages as the configuration's voltage_next and
/// voltage_held say, as a rule means from t_k to t_{k+1} in the rotating frame.
typedef struct dqw_sample {
    float v_d_V, v_q_V;  ///< what the inverter applied
    float i_d_A, i_q_A;  ///< at t_k
    float w_m_rad_s;     ///< mechanical
    float cosine, sine;  ///< of the electrical angle; read only where the configuration says that there is one
    float temp_winding_C, temp_magnet_C;  ///< read only where an effect needs it
    /// bits 0, 1, 2: the leg of a, b, c does not switch while this voltage is made; read only with
    /// DQW_MODULATION_MASK
    uint8_t resting;
} dqw_sample;

/// A sample from dq and the electrical angle.
///
/// Source   (E2) in docs/EQUATIONS.md
/// Units    SI; w_m_rad_s mechanical, or electrical over the pole pairs
/// Range    |theta_e_rad| <= 1e5; any float is taken, what is not finite is refused by the step that takes the sample
/// Cost     the table in docs/cost.md; no loop
/// Context  ISR safe; no state
dqw_sample dqw_sample_from_dq(float v_d_V, float v_q_V, float i_d_A, float i_q_A, float w_m_rad_s, float theta_e_rad);

/// A sample from stationary-frame voltages and currents with the cosine and sine of the electrical angle: set
/// voltage_held in the configuration.
///
/// Source   (E2) in docs/EQUATIONS.md
/// Units    SI; w_m_rad_s mechanical, or electrical over the pole pairs
/// Range    any float
/// Cost     the table in docs/cost.md; no loop
/// Context  ISR safe; no state
dqw_sample dqw_sample_from_alphabeta(float v_alpha_V, float v_beta_V, float i_alpha_A, float i_beta_A, float w_m_rad_s,
                                     float cosine, float sine);

#ifdef __cplusplus
}
#endif
#endif
