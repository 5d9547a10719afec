#include "dqw_model.h"

#include <math.h>

// Largest part of a current that the end correction may be: where it is more, the period is too long for its first term.
#define CORRECTION_MAX 0.1f

void dqw_model_bow(dqw_block *b, const dqw_machine *known, float dt_s)
{
    const float w_e = known->pole_pairs * b->w_m_rad_s;
    if (!(known->R_ohm * dt_s < known->Ld_H) || !(known->R_ohm * dt_s < known->Lq_H) || !(fabsf(w_e) * dt_s < 1.0f)) return;

    // How much the slope of the current changes from the start of a period to its end, on average over the block.
    const float jump_d = (w_e * (b->v_q_V + known->Lq_H * b->di_q_A_s) - known->R_ohm * b->di_d_A_s) * dt_s / known->Ld_H;
    const float jump_q = (-w_e * (b->v_d_V + known->Ld_H * b->di_d_A_s) - known->R_ohm * b->di_q_A_s) * dt_s / known->Lq_H;
    const float fix_d = dt_s / 12.0f * jump_d;
    const float fix_q = dt_s / 12.0f * jump_q;
    const float size = fabsf(b->i_d_A) + fabsf(b->i_q_A) + (fabsf(b->di_d_A_s) + fabsf(b->di_q_A_s)) * dt_s;
    if (!(fabsf(fix_d) + fabsf(fix_q) < CORRECTION_MAX * size)) return;
    b->i_d_A -= fix_d;
    b->i_q_A -= fix_q;
    b->wi_d_A_rad_s -= b->w_m_rad_s * fix_d;
    b->wi_q_A_rad_s -= b->w_m_rad_s * fix_q;
}
