#include "dqw_noise_q15.h"

#include <stdbool.h>

#include "dqw_q15.h"

#define PAST 3u

void dqw_noise_init_q15(dqw_noise_q15 *n)
{
    // The last rows are not read before there are new ones.
    int64_t *sum_q30 = n->sum_q30;
    sum_q30[0] = sum_q30[1] = sum_q30[2] = sum_q30[DQW_NOISE_ANSWER_Q15] = 0;
    n->rows = 0;
    n->held = n->turn = 0;
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

// Differences below 2^18, products below 2^36.
static void add(int64_t *sum_q30, int32_t a_q15, int32_t b_q15)
{
    *sum_q30 += (int64_t)a_q15 * b_q15;
}

// A sum of all rows until the memory is full, then each row takes its part away, as a mean of 2^13 forgets: of each
// sum four rows' at once.
static void forget(int64_t *sum_q30)
{
    *sum_q30 -= dqw_q_floor64(*sum_q30, DQW_NOISE_Q15_SHIFT - 2);
}

void dqw_noise_step_q15(dqw_noise_q15 *n, int32_t e_d_q15, int32_t e_q_q15, int32_t w_step_q15, int32_t made_d_q15,
                        uint32_t at)
{
    int32_t *d = n->e_q15[0];
    int32_t *q = n->e_q15[1];
    if (n->held >= PAST) {
        // [NOI.1] steps three apart, by the difference of those between: what is slow drops out
        const int32_t bend = w_step_q15 - n->w_step_q15;
        const int32_t bend_d_q15 = d[0] - d[1];
        if (n->rows < DQW_NOISE_Q15_MEMORY) {
            n->rows++;
        } else {
            forget(&n->sum_q30[n->turn & 3u]);
            n->turn = (uint8_t)(n->turn + 1u);
        }
        // [NOI.2] does the voltage's step go with it?
        if ((at & 3u) == 2u) add(&n->sum_q30[DQW_NOISE_ANSWER_Q15], made_d_q15 - n->made_q15, bend_d_q15);
        add(&n->sum_q30[DQW_NOISE_ID_Q15], e_d_q15 - d[2], bend_d_q15);
        add(&n->sum_q30[DQW_NOISE_IQ_Q15], e_q_q15 - q[2], q[0] - q[1]);
        add(&n->sum_q30[DQW_NOISE_W_Q15], bend, bend);
    } else {
        n->held++;
    }
    // [NOI.3] the last three steps
    shift(d, e_d_q15);
    shift(q, e_q_q15);
    n->w_step_q15 = w_step_q15;
    n->made_q15 = made_d_q15;
}

int64_t dqw_noise_variance_q36(int64_t sum_q30, uint16_t rows, int parts)
{
    const int64_t v_q36 = dqw_q_quotient64(sum_q30, (int64_t)rows * parts, 6);
    return v_q36 > 0 ? v_q36 : 0;
}
