#include "dqw_scale.h"

#include <stddef.h>

#include "dqw_q15.h"

static bool full_scale(uint32_t value)
{
    return value >= 1u && value <= DQW_SCALE_MAX;
}

enum dqw_status dqw_scale_check(const dqw_scale *scale)
{
    if (scale == NULL) return DQW_ERR_NULL;
    if (!full_scale(scale->v_full_mV)) return DQW_ERR_V_BASE;
    if (!full_scale(scale->i_full_mA)) return DQW_ERR_I_BASE;
    if (!full_scale(scale->w_full_mrad_s)) return DQW_ERR_W_BASE;
    if (scale->dt_ns < 1u || scale->dt_ns > 1000000000u) return DQW_ERR_DT;
    return DQW_OK;
}

// The products stay below 2^63.
int64_t dqw_scale_R_q40(const dqw_scale *scale, uint32_t R_uohm)
{
    // uOhm mA / mV = 1e-6
    return dqw_q_quotient64((int64_t)R_uohm * scale->i_full_mA, (int64_t)scale->v_full_mV * 1000000, 40);
}

int64_t dqw_scale_L_q40(const dqw_scale *scale, uint32_t L_nH)
{
    // nH mA / (mV ns) = 1
    return dqw_q_quotient64((int64_t)L_nH * scale->i_full_mA, (int64_t)scale->v_full_mV * scale->dt_ns, 40);
}

int64_t dqw_scale_psi_q40(const dqw_scale *scale, uint32_t psi_nWb)
{
    // nWb / (mV ns) = 1e3
    return dqw_q_quotient64((int64_t)psi_nWb * 1000, (int64_t)scale->v_full_mV * scale->dt_ns, 40);
}
