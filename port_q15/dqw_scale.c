#include "dqw_scale.h"

#include <stdbool.h>
#include <stddef.h>

static bool full_scale(uint32_t value)
{
    return value >= 1u && value <= DQW_SCALE_MAX;
}

enum dqw_status dqw_scale_check(const dqw_scale *scale)
{
    if (scale == NULL) return DQW_ERR_NULL;
    if (!full_scale(scale->v_full_mV) || !full_scale(scale->i_full_mA) || !full_scale(scale->w_full_mrad_s)) return DQW_ERR_RANGE;
    if (scale->dt_ns < 1u || scale->dt_ns > 1000000000u) return DQW_ERR_RANGE;
    return DQW_OK;
}
