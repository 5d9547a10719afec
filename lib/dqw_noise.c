#include "dqw_noise.h"

#define PAST 3u

void dqw_noise_init(dqw_noise *n)
{
    const dqw_noise zero = {0};
    *n = zero;
}

void dqw_noise_gap(dqw_noise *n)
{
    n->held = 0;
}

static void shift(float e[3], float now)
{
    e[2] = e[1];
    e[1] = e[0];
    e[0] = now;
}

void dqw_noise_answer(dqw_noise *n, float made_d_A)
{
    if (n->held < PAST) return;
    const float bend_A = n->e_d_A[0] - n->e_d_A[1];
    const float part = 1.0f / (1.0f + 0.25f * (float)n->of.rows);
    n->of.answer_A2 += ((made_d_A - n->made_d_A) * bend_A - n->of.answer_A2) * part;
}

void dqw_noise_step(dqw_noise *n, float e_d_A, float e_q_A, float w_step_rad_s)
{
    if (n->held >= PAST) {
        // [NOI.1] steps three apart, by the difference of those between: what is slow drops out
        const float bend = w_step_rad_s - n->w_step_rad_s;
        if (n->of.rows < DQW_NOISE_MEMORY) n->of.rows++;
        const float part = 1.0f / (float)n->of.rows;
        n->of.i_d_A2 += (-0.5f * (e_d_A - n->e_d_A[2]) * (n->e_d_A[0] - n->e_d_A[1]) - n->of.i_d_A2) * part;
        n->of.i_q_A2 += (-0.5f * (e_q_A - n->e_q_A[2]) * (n->e_q_A[0] - n->e_q_A[1]) - n->of.i_q_A2) * part;
        n->of.w_rad2_s2 += (bend * bend * (1.0f / 6.0f) - n->of.w_rad2_s2) * part;
    } else {
        n->held++;
    }
    // [NOI.2] the last three steps
    shift(n->e_d_A, e_d_A);
    shift(n->e_q_A, e_q_A);
    n->w_step_rad_s = w_step_rad_s;
}
