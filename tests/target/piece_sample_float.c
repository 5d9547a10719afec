// A sample of dq and the angle, in float.
#include "dqw_sample.h"
#include "target/piece.h"

static float v_d_V, v_q_V, i_d_A, i_q_A, w_m_rad_s, theta_e_rad;
static dqw_sample sample;
const uint32_t piece_bytes = sizeof sample;

void piece_start(void) {}

void piece_load(const stimulus *s)
{
    v_d_V = (float)s->v_d_q15;
    v_q_V = (float)s->v_q_q15;
    i_d_A = (float)s->i_d_q15;
    i_q_A = (float)s->i_q_q15;
    w_m_rad_s = (float)s->w_m_q15;
    theta_e_rad = (float)s->theta_e_turn * (6.2831853f / 65536);
}

void piece_step(void) { sample = dqw_sample_from_dq(v_d_V, v_q_V, i_d_A, i_q_A, w_m_rad_s, theta_e_rad); }

void piece_background(void) {}
