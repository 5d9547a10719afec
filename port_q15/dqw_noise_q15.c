#include "dqw_noise_q15.h"

#include <stdbool.h>

#include "dqw_q15.h"

#define PAST 3u
// Q30 sums over 2^13 rows, to means in Q36.
#define TO_MEAN 7u

void dqw_noise_init_q15(dqw_noise_q15 *n)
{
    // The last rows are not read before there are new ones.
    n->i_d_q30 = n->i_q_q30 = n->w_q30 = 0;
    n->rows = 0;
    n->held = 0;
}

void dqw_noise_gap_q15(dqw_noise_q15 *n)
{
    n->held = 0;
}

static void shift(int32_t e[3], int32_t now)
{
    e[2] = e[1];
    e[1] = e[0];
    e[0] = now;
}

void dqw_noise_step_q15(dqw_noise_q15 *n, int32_t e_d_q15, int32_t e_q_q15, int32_t w_step_q15)
{
    if (n->held >= PAST) {
        // Differences below 2^18, products below 2^36.
        const int32_t bend = w_step_q15 - n->w_step_q15;
        const int64_t d_q30 = n->i_d_q30 + (int64_t)(e_d_q15 - n->e_d_q15[2]) * (n->e_d_q15[0] - n->e_d_q15[1]);
        const int64_t q_q30 = n->i_q_q30 + (int64_t)(e_q_q15 - n->e_q_q15[2]) * (n->e_q_q15[0] - n->e_q_q15[1]);
        const int64_t w_q30 = n->w_q30 + (int64_t)bend * bend;
        // A sum of all rows until the memory is full, then each row takes its part away, as a mean of 2^13 forgets.
        const bool full = n->rows >= DQW_NOISE_Q15_MEMORY;
        n->rows = (uint16_t)(n->rows + !full);
        n->i_d_q30 = full ? d_q30 - dqw_q_floor64(d_q30, DQW_NOISE_Q15_SHIFT) : d_q30;
        n->i_q_q30 = full ? q_q30 - dqw_q_floor64(q_q30, DQW_NOISE_Q15_SHIFT) : q_q30;
        n->w_q30 = full ? w_q30 - dqw_q_floor64(w_q30, DQW_NOISE_Q15_SHIFT) : w_q30;
    } else {
        n->held++;
    }
    shift(n->e_d_q15, e_d_q15);
    shift(n->e_q_q15, e_q_q15);
    n->w_step_q15 = w_step_q15;
}

dqw_noise_means_q15 dqw_noise_means_of_q15(const dqw_noise_q15 *n)
{
    const dqw_noise_means_q15 m = {dqw_q31_sat(dqw_q_floor64(n->i_d_q30, TO_MEAN)), dqw_q31_sat(dqw_q_floor64(n->i_q_q30, TO_MEAN)),
                                   dqw_q31_sat(dqw_q_floor64(n->w_q30, TO_MEAN))};
    return m;
}

int64_t dqw_noise_variance_q36(int32_t mean_q36, uint16_t rows, int parts)
{
    const int64_t v_q36 = dqw_q_quotient64((int64_t)mean_q36 * (int64_t)DQW_NOISE_Q15_MEMORY, (int64_t)rows * parts, 0);
    return v_q36 > 0 ? v_q36 : 0;
}
