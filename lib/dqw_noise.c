#include "dqw_noise.h"

#define PAST 3u

void dqw_noise_init(dqw_noise *n)
{
    const dqw_noise zero = {0};
    *n = zero;
}

void dqw_noise_anew(dqw_noise *n)
{
    // The first row's part is all.
    n->of.rows = 0;
    n->held = 0;
}

void dqw_noise_gap(dqw_noise *n)
{
    n->held = 0;
}

void dqw_noise_step(dqw_noise *n, float e_d_A, float e_q_A, float w_step_rad_s, float made_d_A)
{
    const float d_A[2] = {n->e_d_A[0], n->e_d_A[1]};
    const float q_A[2] = {n->e_q_A[0], n->e_q_A[1]};
    if (n->held >= PAST) {
        const uint32_t before = n->of.rows;
        const uint32_t rows = before < DQW_NOISE_MEMORY ? before + 1 : before;
        const float part = 1.0f / (float)rows;
        n->of.rows = rows;
        // [NOI.1] steps three apart, by the difference of those between: what is slow drops out
        const float bend_A = d_A[0] - d_A[1];
        n->of.i_d_A2 += (-0.5f * (e_d_A - n->e_d_A[2]) * bend_A - n->of.i_d_A2) * part;
        n->of.i_q_A2 += (-0.5f * (e_q_A - n->e_q_A[2]) * (q_A[0] - q_A[1]) - n->of.i_q_A2) * part;
        const float bend_rad_s = w_step_rad_s - n->w_step_rad_s;
        n->of.w_rad2_s2 += (bend_rad_s * bend_rad_s * (1.0f / 6.0f) - n->of.w_rad2_s2) * part;
        // [NOI.2] does the voltage's step go with it?
        n->of.answer_A2 += ((made_d_A - n->made_d_A) * bend_A - n->of.answer_A2) * part;
    } else {
        n->held++;
    }
    // [NOI.3] the last three steps
    n->e_d_A[2] = d_A[1];
    n->e_d_A[1] = d_A[0];
    n->e_d_A[0] = e_d_A;
    n->e_q_A[2] = q_A[1];
    n->e_q_A[1] = q_A[0];
    n->e_q_A[0] = e_q_A;
    n->w_step_rad_s = w_step_rad_s;
    n->made_d_A = made_d_A;
}
