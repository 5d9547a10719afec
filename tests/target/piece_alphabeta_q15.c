// A sample of the stationary frame, in Q15.
#include "dqw_sample_q15.h"
#include "target/piece.h"

static int16_t v_alpha_q15, v_beta_q15, i_alpha_q15, i_beta_q15, w_m_q15, cosine_q15, sine_q15;
static dqw_sample_q15 sample;
const uint32_t piece_bytes = sizeof sample;

void piece_start(void) {}

void piece_load(const stimulus *s)
{
    v_alpha_q15 = s->v_d_q15;
    v_beta_q15 = s->v_q_q15;
    i_alpha_q15 = s->i_d_q15;
    i_beta_q15 = s->i_q_q15;
    w_m_q15 = s->w_m_q15;
    const dqw_sample_q15 angle = dqw_sample_from_dq_q15(0, 0, 0, 0, 0, s->theta_e_turn);
    cosine_q15 = angle.cosine_q15;
    sine_q15 = angle.sine_q15;
}

void piece_step(void)
{
    sample = dqw_sample_from_alphabeta_q15(v_alpha_q15, v_beta_q15, i_alpha_q15, i_beta_q15, w_m_q15, cosine_q15,
                                           sine_q15);
}

void piece_background(void) {}
