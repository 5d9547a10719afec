// A sample of the stationary frame, in float.
#include "dqw_sample.h"
#include "dqw_transform.h"
#include "target/piece.h"

static float v_alpha_V, v_beta_V, i_alpha_A, i_beta_A, w_m_rad_s, cosine, sine;
static dqw_sample sample;
const uint32_t piece_bytes = sizeof sample;

void piece_start(void) {}

void piece_load(const stimulus *s)
{
    v_alpha_V = (float)s->v_d_q15;
    v_beta_V = (float)s->v_q_q15;
    i_alpha_A = (float)s->i_d_q15;
    i_beta_A = (float)s->i_q_q15;
    w_m_rad_s = (float)s->w_m_q15;
    dqw_cosine_sine((float)s->theta_e_turn * (6.2831853f / 65536), &cosine, &sine);
}

void piece_step(void)
{
    sample = dqw_sample_from_alphabeta(v_alpha_V, v_beta_V, i_alpha_A, i_beta_A, w_m_rad_s, cosine, sine);
}

void piece_background(void) {}
