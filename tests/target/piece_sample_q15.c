// A sample of dq and the angle, in Q15.
#include "dqw_sample_q15.h"
#include "target/piece.h"

static int16_t v_d_q15, v_q_q15, i_d_q15, i_q_q15, w_m_q15;
static uint16_t theta_e_turn;
static dqw_sample_q15 sample;
const uint32_t piece_bytes = sizeof sample;

void piece_start(void) {}

void piece_load(const stimulus *s)
{
    v_d_q15 = s->v_d_q15;
    v_q_q15 = s->v_q_q15;
    i_d_q15 = s->i_d_q15;
    i_q_q15 = s->i_q_q15;
    w_m_q15 = s->w_m_q15;
    theta_e_turn = s->theta_e_turn;
}

void piece_step(void) { sample = dqw_sample_from_dq_q15(v_d_q15, v_q_q15, i_d_q15, i_q_q15, w_m_q15, theta_e_turn); }

void piece_background(void) {}
