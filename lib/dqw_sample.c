#include "dqw_sample.h"

#include "dqw_number.h"
#include "dqw_transform.h"

// Angles beyond this have lost their fraction of a turn in single precision.
#define THETA_MAX_RAD 1e5f

dqw_sample dqw_sample_from_dq(float v_d_V, float v_q_V, float i_d_A, float i_q_A, float w_m_rad_s, float theta_e_rad)
{
    // No angle: no direction either.
    dqw_sample s = {.v_d_V = v_d_V, .v_q_V = v_q_V, .i_d_A = i_d_A, .i_q_A = i_q_A, .w_m_rad_s = w_m_rad_s};
    if (dqw_within(theta_e_rad, THETA_MAX_RAD)) dqw_cosine_sine(theta_e_rad, &s.cosine, &s.sine);
    return s;
}

dqw_sample dqw_sample_from_alphabeta(float v_alpha_V, float v_beta_V, float i_alpha_A, float i_beta_A, float w_m_rad_s,
                                     float cosine, float sine)
{
    const dqw_alphabeta v = {v_alpha_V, v_beta_V};
    const dqw_alphabeta i = {i_alpha_A, i_beta_A};
    const dqw_dq v_dq = dqw_park(v, cosine, sine);
    const dqw_dq i_dq = dqw_park(i, cosine, sine);
    const dqw_sample s = {.v_d_V = v_dq.d,
                          .v_q_V = v_dq.q,
                          .i_d_A = i_dq.d,
                          .i_q_A = i_dq.q,
                          .w_m_rad_s = w_m_rad_s,
                          .cosine = cosine,
                          .sine = sine};
    return s;
}
