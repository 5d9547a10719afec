#include "dqw_log_q15.h"

#include "dqw_q15.h"

#define ONE_Q40 ((int64_t)1 << 40)
#define LN2_Q40 INT64_C(762123384786)

int64_t dqw_one_less_exp_q40(int64_t x_q40)
{
    if (x_q40 <= 0) return 0;
    int halvings = 0;
    while (x_q40 >= LN2_Q40 && halvings < 40) x_q40 -= LN2_Q40, halvings++;
    if (halvings == 40) return ONE_Q40;
    // 1 - exp(-x) = x (1 - x/2 (1 - x/3 (1 - ...))), x < ln 2
    int64_t sum_q40 = ONE_Q40;
    for (int k = 14; k >= 2; k--) sum_q40 = ONE_Q40 - dqw_q_quotient64(dqw_q_product64(x_q40, sum_q40, -40), k, 0);
    const int64_t less_q40 = dqw_q_product64(x_q40, sum_q40, -40);
    return halvings == 0 ? less_q40 : ONE_Q40 - dqw_q_scale64(ONE_Q40 - less_q40, -halvings);
}

int64_t dqw_minus_log_q40(int32_t x_q31)
{
    if (x_q31 <= 0) return 0;
    const int doublings = (int)dqw_q_clz32((uint32_t)x_q31) - 1;
    const int64_t m_q31 = (int64_t)x_q31 * ((int64_t)1 << doublings);  // 1/2 .. 1
    // -ln m = 2 (z + z^3/3 + ...), z = (1 - m) / (1 + m) <= 1/3
    const int64_t one_q31 = (int64_t)1 << 31;
    const int64_t z_q40 = dqw_q_quotient64(one_q31 - m_q31, one_q31 + m_q31, 40);
    const int64_t z2_q40 = dqw_q_product64(z_q40, z_q40, -40);
    int64_t sum_q40 = 0;
    for (int n = 21; n > 0; n -= 2) sum_q40 = dqw_q_product64(z2_q40, sum_q40, -40) + dqw_q_quotient64(ONE_Q40, n, 0);
    return doublings * LN2_Q40 + 2 * dqw_q_product64(z_q40, sum_q40, -40);
}
