#include "dqw_change.h"

#define MOST_Q5 (4 * DQW_CHANGE_BAND_Q5)

void dqw_change_init(dqw_change *c)
{
    c->sum_q5 = 0;
    c->above = 0;
}

bool dqw_change_step(dqw_change *c, int32_t deviation_q5, uint8_t limit_q5)
{
    const int32_t bounded = deviation_q5 < 0 ? 0 : deviation_q5 > MOST_Q5 ? MOST_Q5 : deviation_q5;
    // sum <= 255 + 128 - 32
    int32_t sum = (int32_t)c->sum_q5 + bounded - DQW_CHANGE_BAND_Q5;
    if (sum < 0) sum = 0;
    if (sum > limit_q5) sum = limit_q5;
    c->sum_q5 = (uint8_t)sum;
    c->above = (uint8_t)(sum == 0 ? 0 : c->above < UINT8_MAX ? c->above + 1 : UINT8_MAX);
    return sum >= limit_q5;
}
