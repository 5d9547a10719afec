// The paper's neurons of both axes, and nothing else, in Q15.
#include "dqw_learner_q15.h"
#include "target/piece.h"
#include "target/stimulus_q15.h"

static int32_t w_d_q31[3], w_q_q31[4];
static int16_t x_d_q15[3], x_q_q15[4], v_d_q15, v_q_q15;
const uint32_t piece_bytes = sizeof w_d_q31 + sizeof w_q_q31;

void piece_start(void) {}

void piece_load(const stimulus *s)
{
    v_d_q15 = s->v_d_q15;
    v_q_q15 = s->v_q_q15;
    x_d_q15[0] = s->i_d_q15, x_d_q15[1] = (int16_t)(s->i_q_q15 / 8),
    x_d_q15[2] = stimulus_product(s->w_m_q15, s->i_q_q15);
    x_q_q15[0] = s->i_q_q15, x_q_q15[1] = (int16_t)(s->i_d_q15 / 8),
    x_q_q15[2] = stimulus_product(s->w_m_q15, s->i_d_q15), x_q_q15[3] = s->w_m_q15;
}

void piece_step(void)
{
    (void)dqw_learner_step_pu_q15(w_d_q31, x_d_q15, 3, v_d_q15, 16384);
    (void)dqw_learner_step_pu_q15(w_q_q31, x_q_q15, 4, v_q_q15, 16384);
}

void piece_background(void) {}
