#include "dqw_sample_q15.h"

#include "dqw_transform_q15.h"

dqw_sample_q15 dqw_sample_from_dq_q15(int16_t v_d_q15, int16_t v_q_q15, int16_t i_d_q15, int16_t i_q_q15,
                                      int16_t w_m_q15, uint16_t theta_e_turn)
{
    dqw_sample_q15 s = {
        .v_d_q15 = v_d_q15, .v_q_q15 = v_q_q15, .i_d_q15 = i_d_q15, .i_q_q15 = i_q_q15, .w_m_q15 = w_m_q15};
    dqw_cosine_sine_q15(theta_e_turn, &s.cosine_q15, &s.sine_q15);
    return s;
}

dqw_sample_q15 dqw_sample_from_alphabeta_q15(int16_t v_alpha_q15, int16_t v_beta_q15, int16_t i_alpha_q15,
                                             int16_t i_beta_q15, int16_t w_m_q15, int16_t cosine_q15, int16_t sine_q15)
{
    const dqw_alphabeta_q15 v = {v_alpha_q15, v_beta_q15};
    const dqw_alphabeta_q15 i = {i_alpha_q15, i_beta_q15};
    const dqw_dq_q15 v_dq = dqw_park_q15(v, cosine_q15, sine_q15);
    const dqw_dq_q15 i_dq = dqw_park_q15(i, cosine_q15, sine_q15);
    const dqw_sample_q15 s = {.v_d_q15 = v_dq.d,
                              .v_q_q15 = v_dq.q,
                              .i_d_q15 = i_dq.d,
                              .i_q_q15 = i_dq.q,
                              .w_m_q15 = w_m_q15,
                              .cosine_q15 = cosine_q15,
                              .sine_q15 = sine_q15};
    return s;
}
