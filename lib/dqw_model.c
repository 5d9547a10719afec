#include "dqw_model.h"

#include <math.h>

dqw_block dqw_model_pair(const dqw_sample *before, const dqw_sample *now, float dt_s)
{
    const dqw_block b = {
        .v_d_V = before->v_d_V,
        .v_q_V = before->v_q_V,
        .i_d_A = 0.5f * (before->i_d_A + now->i_d_A),
        .i_q_A = 0.5f * (before->i_q_A + now->i_q_A),
        .di_d_A_s = (now->i_d_A - before->i_d_A) / dt_s,
        .di_q_A_s = (now->i_q_A - before->i_q_A) / dt_s,
        .wi_d_A_rad_s = 0.5f * (before->w_m_rad_s * before->i_d_A + now->w_m_rad_s * now->i_d_A),
        .wi_q_A_rad_s = 0.5f * (before->w_m_rad_s * before->i_q_A + now->w_m_rad_s * now->i_q_A),
        .w_m_rad_s = 0.5f * (before->w_m_rad_s + now->w_m_rad_s),
    };
    return b;
}

void dqw_model_bow(dqw_block *b, const dqw_machine *known, float dt_s)
{
    const float w_e = known->pole_pairs * b->w_m_rad_s;
    if (!(known->R_ohm * dt_s < known->Ld_H) || !(known->R_ohm * dt_s < known->Lq_H) || !(fabsf(w_e) * dt_s < 1.0f))
        return;

    // [MOD.1] how much the current bends in a period, on average over the block, and a twelfth of it
    const float jump_d = (w_e * (b->v_q_V + known->Lq_H * b->di_q_A_s) - known->R_ohm * b->di_d_A_s) * dt_s /
                         known->Ld_H;
    const float jump_q = (-w_e * (b->v_d_V + known->Ld_H * b->di_d_A_s) - known->R_ohm * b->di_q_A_s) * dt_s /
                         known->Lq_H;
    const float fix_d = dt_s / 12.0f * jump_d;
    const float fix_q = dt_s / 12.0f * jump_q;
    // [MOD.2] that much the trapezoid's means are too large
    b->i_d_A -= fix_d;
    b->i_q_A -= fix_q;
    b->wi_d_A_rad_s -= b->w_m_rad_s * fix_d;
    b->wi_q_A_rad_s -= b->w_m_rad_s * fix_q;
}
