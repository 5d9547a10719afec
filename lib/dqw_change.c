#include "dqw_change.h"

#define MOST_Q8 (4 * DQW_CHANGE_BAND_Q8)

void dqw_change_init(dqw_change *c)
{
    c->sum_q8 = 0;
    c->above = 0;
}

bool dqw_change_step(dqw_change *c, int32_t deviation_q8, int16_t limit_q8)
{
    const int32_t bounded = deviation_q8 < 0 ? 0 : deviation_q8 > MOST_Q8 ? MOST_Q8 : deviation_q8;
    // |sum| < 32767 + 1024
    int32_t sum = (int32_t)c->sum_q8 + bounded - DQW_CHANGE_BAND_Q8;
    if (sum < 0) sum = 0;
    if (sum > limit_q8) sum = limit_q8;
    c->sum_q8 = (int16_t)sum;
    c->above = (uint16_t)(sum == 0 ? 0 : c->above < UINT16_MAX ? c->above + 1 : UINT16_MAX);
    return sum >= limit_q8;
}
