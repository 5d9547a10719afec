// The normal equations over the drive's signals as inputs: sums, weights and deviations every so often; the last input
// begins late.
#include "dqw_normal_q15.h"
#include "target/hash.h"
#include "target/hash_room.h"
#include "target/stimulus.h"

static void put_sums(hash *h, const dqw_normal_q15 *n)
{
    for (int i = 0; i < n->inputs * (n->inputs + 1) / 2; i++) hash_put(h, n->a_q32[i]);
    for (int i = 0; i < n->inputs; i++) hash_put(h, n->b_q32[i]);
    hash_put(h, n->c_q32);
}

static void put_solution(hash *h, const dqw_solution_q15 *s, int inputs)
{
    for (int i = 0; i < inputs; i++) {
        hash_put(h, s->w_q40[i]);
        hash_put(h, s->cov_q40[i]);
    }
    hash_put(h, s->out);
    hash_put(h, s->left_q32);
}

hash hash_normal(void)
{
    static stimulus s;
    dqw_normal_q15 *n = &hash_shared.normal.sums;
    dqw_solution_q15 *solution = &hash_shared.normal.solution;
    static const int64_t prior_q32[4] = {1 << 20, 1 << 22, 1 << 24, 1};
    static const int64_t start_q40[4] = {(int64_t)1 << 39, 0, -((int64_t)1 << 40), 0};
    hash h = HASH_EMPTY;
    stimulus_start(&s);
    hash_put(&h, dqw_normal_init_q15(n, 4, prior_q32, start_q40));
    for (int k = 1; k <= 6000; k++) {
        stimulus_next(&s);
        const int32_t x_q28[4] = {s.i_d_q15 * 8192, s.i_q_q15 * 65535, s.w_m_q15 * 8192, k < 3000 ? 0 : 1 << 28};
        dqw_normal_add_q15(n, x_q28, s.v_q_q15 * 65535);
        if (k % 100 == 0) dqw_normal_grow_q15(n, k / 100 % 4, (int64_t)k << 10);
        if (k % 10 == 0) put_sums(&h, n);
        if (k % 200 != 0) continue;
        dqw_normal_solve_q15(n, start_q40, solution);
        put_solution(&h, solution, 4);
        int32_t alone_q28[2][DQW_NORMAL_INPUTS] = {{x_q28[0], x_q28[1], x_q28[2], x_q28[3]}, {1, -x_q28[0], k, 0}};
        dqw_normal_alone_q15(n, alone_q28);
        for (int i = 0; i < 4; i++) hash_put(&h, alone_q28[0][i]), hash_put(&h, alone_q28[1][i]);
    }
    return h;
}
