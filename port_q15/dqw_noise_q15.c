#include "dqw_noise_q15.h"

#include <stdbool.h>

#include "dqw_q15.h"

#define PAST 3u

void dqw_noise_init_q15(dqw_noise_q15 *n)
{
    // The last rows are not read before there are new ones.
    for (int k = 0; k < DQW_NOISE_Q15_SUMS; k++) n->sum_q30[k] = 0;
    n->answer_q30 = 0;
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

// A sum of all rows until the memory is full, then each row takes its part away, as a mean of 2^13 forgets.
static void add(int64_t *sum_q30, int32_t a_q15, int32_t b_q15, bool full)
{
    // Differences below 2^18, products below 2^36.
    const int64_t sum = *sum_q30 + (int64_t)a_q15 * b_q15;
    *sum_q30 = full ? sum - dqw_q_floor64(sum, DQW_NOISE_Q15_SHIFT) : sum;
}

void dqw_noise_answer_q15(dqw_noise_q15 *n, int32_t made_d_q15)
{
    if (n->held < PAST) return;
    const int32_t *d = n->e_q15[0];
    n->answer_q30 += (int64_t)(made_d_q15 - n->made_q15) * (d[0] - d[1]);
    if (n->rows >= DQW_NOISE_Q15_MEMORY) n->answer_q30 -= dqw_q_floor64(n->answer_q30, DQW_NOISE_Q15_SHIFT - 2);
}

void dqw_noise_step_q15(dqw_noise_q15 *n, int32_t e_d_q15, int32_t e_q_q15, int32_t w_step_q15)
{
    int32_t *d = n->e_q15[0];
    int32_t *q = n->e_q15[1];
    if (n->held >= PAST) {
        // [NOI.1] steps three apart, by the difference of those between: what is slow drops out
        const int32_t bend = w_step_q15 - n->w_step_q15;
        const bool full = n->rows >= DQW_NOISE_Q15_MEMORY;
        n->rows = (uint16_t)(n->rows + !full);
        add(&n->sum_q30[DQW_NOISE_ID_Q15], e_d_q15 - d[2], d[0] - d[1], full);
        add(&n->sum_q30[DQW_NOISE_IQ_Q15], e_q_q15 - q[2], q[0] - q[1], full);
        add(&n->sum_q30[DQW_NOISE_W_Q15], bend, bend, full);
    } else {
        n->held++;
    }
    // [NOI.2] the last three steps
    shift(d, e_d_q15);
    shift(q, e_q_q15);
    n->w_step_q15 = w_step_q15;
}

int64_t dqw_noise_variance_q36(int64_t sum_q30, uint16_t rows, int parts)
{
    const int64_t v_q36 = dqw_q_quotient64(sum_q30, (int64_t)rows * parts, 6);
    return v_q36 > 0 ? v_q36 : 0;
}
