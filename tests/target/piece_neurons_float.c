// The paper's neurons of both axes, and nothing else, in float.
#include "dqw_learner.h"
#include "target/piece.h"

static float w_d[3], w_q[4], x_d[3], x_q[4], v_d, v_q;
const uint32_t piece_bytes = sizeof w_d + sizeof w_q;

void piece_start(void) {}

void piece_load(const stimulus *s)
{
    const float i_d = (float)s->i_d_q15 / 32768;
    const float i_q = (float)s->i_q_q15 / 32768;
    const float w = (float)s->w_m_q15 / 32768;
    v_d = (float)s->v_d_q15 / 32768;
    v_q = (float)s->v_q_q15 / 32768;
    x_d[0] = i_d, x_d[1] = i_q / 8, x_d[2] = w * i_q;
    x_q[0] = i_q, x_q[1] = i_d / 8, x_q[2] = w * i_d, x_q[3] = w;
}

void piece_step(void)
{
    (void)dqw_learner_step_pu(w_d, x_d, 3, v_d, 0.5f);
    (void)dqw_learner_step_pu(w_q, x_q, 4, v_q, 0.5f);
}

void piece_background(void) {}
