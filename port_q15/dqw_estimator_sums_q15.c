// The joint neuron in its information form: what rows, noise and time make of the sums, and the weights that they say.
#include "dqw_q15.h"
#include "dqw_tracker_q15.h"
#include "dqw_tracker_rows_q15.h"

// Where noise is more than this part of all that was learned of a weight, taking it out could run away: 0.05.
#define NOISE_PART_MAX_Q40 54975581389
// What the sums can hold of a variance: 2^21 of the residual's.
#define WIDEST_Q40 ((int64_t)1 << 61)

enum { D = 0, Q = 1, N = DQW_TRACK_Q15_WEIGHTS };

// One axis' row to the sums, around the weights as solved last; weighed by how little of that axis is noise.
int32_t dqw_tracker_show_q15(dqw_tracker_q15 *t, int axis, const dqw_tracker_rows_q15 *r, uint32_t mask, int64_t weigh_q24)
{
    int32_t x_q28[N];
    int64_t e_q28 = r->y_q28[axis];
    for (int i = 0; i < N; i++) {
        const int32_t x = r->x_q28[axis][i];
        e_q28 -= dqw_q_round64((int64_t)x * t->w_q24[i], 24);
        x_q28[i] = (mask >> i & 1u) != 0 ? dqw_q31_sat(dqw_q_round64(x * weigh_q24, 24)) : 0;
    }
    const int32_t e = dqw_q31_sat(e_q28);
    dqw_normal_add_q15(&t->normal, x_q28, dqw_q31_sat(dqw_q_round64(e * weigh_q24, 24)));
    return e;
}

// Noise of the inputs turns the gradient by C w: put back. Not where it is much of what was learned, there it could run away. (E60)
void dqw_tracker_take_noise_out_q15(dqw_tracker_q15 *t, const dqw_tracker_rows_q15 *r, const int64_t by_q24[], const uint32_t mask[])
{
    // Each term below 2^54 2^6 in Q56, 2^52 in Q48; a weight below 2^6: seven such sums are below 2^61.
    int64_t z_q48[N] = {0};
    for (int axis = 0; axis < 2; axis++)
        for (int i = 0; i < N; i++)
            if ((mask[axis] >> i & 1u) != 0) z_q48[i] += dqw_q_product64(r->var_q56[axis][i], by_q24[axis], -32);
    for (int i = 0; i < N; i++) {
        if (dqw_q_product64(z_q48[i], t->cov_q40[i], -48) > NOISE_PART_MAX_Q40) return;
        z_q48[i] = dqw_q_product64(z_q48[i], t->w_q24[i], -24);
    }
    for (int axis = 0; axis < 2; axis++) {
        const int L = DQW_TRACK_LQ_Q15 - axis;
        const int flux = axis == Q ? DQW_TRACK_PSI_Q15 : DQW_TRACK_PSI_Q_Q15;
        const int64_t by = by_q24[axis];
        z_q48[DQW_TRACK_R_Q15] += dqw_q_product64(dqw_q_product64(r->dead_in_R_q56[axis], by, -32), t->w_q24[DQW_TRACK_DEAD_TIME_Q15], -24);
        z_q48[DQW_TRACK_DEAD_TIME_Q15] += dqw_q_product64(dqw_q_product64(r->R_in_dead_q56[axis], by, -32), t->w_q24[DQW_TRACK_R_Q15], -24);
        if ((mask[axis] >> L & mask[axis] >> flux & 1u) == 0) continue;
        const int64_t shared = dqw_q_product64(r->speed_q56[axis], by, -32);
        z_q48[L] += dqw_q_product64(shared, t->w_q24[flux], -24);
        z_q48[flux] += dqw_q_product64(shared, t->w_q24[L], -24);
    }
    for (int i = 0; i < N; i++) {
        // The target's sum keeps above what the gradient explains.
        const int64_t z_q32 = dqw_q_scale64(z_q48[i], -16);
        t->normal.b_q32[i] += z_q32;
        const int64_t more_q32 = dqw_q_product64(z_q32, t->w_q24[i], -24);
        t->normal.c_q32 += more_q32 < 0 ? -more_q32 : more_q32;
    }
}

// A parameter may wander: its variance grows with time, here in halves of a window, up to where it started. One weight a block, each by the
// time that the last turn took. (E61)
void dqw_tracker_drift_q15(dqw_tracker_q15 *t)
{
    const dqw_tracker_q15_config *c = t->config;
    if (c->drift_ppm == 0) return;
    if (t->turn == 0) {
        t->span = t->at - t->drifted;
        t->drifted = t->at;
    }
    // Of what was never learned nothing can wander away.
    int i = t->turn;
    while (i < N - 1 && ((uint32_t)t->learned >> i & 1u) == 0) i++;
    int next = i + 1;
    while (next < N && ((uint32_t)t->learned >> next & 1u) == 0) next++;
    t->turn = (uint8_t)(next < N ? next : 0);
    const int64_t common_q56 = dqw_tracker_common_variance_q56(t);
    // Nine nominal values squared, over the residual's variance: where it started.
    const int64_t started_q6 = dqw_q_quotient64(9, common_q56, 62);
    const int64_t cap_q40 = started_q6 < WIDEST_Q40 >> 34 ? started_q6 * ((int64_t)1 << 34) : WIDEST_Q40;
    if (t->cov_q40[i] >= cap_q40) return;
    // ns up to 2^37 by halves up to 2^32; ppm^2 up to 2^40
    const int64_t time_q20 = dqw_q_quotient64(dqw_q_product64((int64_t)c->scale.dt_ns * t->window.half, t->span, -8), 1000000000, 28);
    const int64_t rate_q40 = dqw_q_quotient64((int64_t)c->drift_ppm * c->drift_ppm, 1000000000000, 40);
    int64_t q_q40 = dqw_q_quotient64(dqw_q_product64(rate_q40, time_q20, -20), common_q56, 56);
    if (q_q40 > cap_q40) q_q40 = cap_q40;
    dqw_normal_grow_q15(&t->normal, i, q_q40);
    t->cov_q40[i] += q_q40;
}

// Weights that explain all that was shown; the sums go on around them.
void dqw_tracker_solve_q15(dqw_tracker_q15 *t)
{
    static const int64_t stay_q40[N] = {0};
    dqw_solution_q15 s;
    // With noise taken out, the gradient may explain more than there was; twice is enough.
    t->normal.c_q32 = 2 * t->normal.c_q32 + 16;
    dqw_normal_solve_q15(&t->normal, stay_q40, &s);
    for (int i = 0; i < N; i++) {
        t->w_q24[i] = dqw_q31_sat(t->w_q24[i] + dqw_q_round64(s.w_q40[i], 16));
        t->cov_q40[i] = s.cov_q40[i] < WIDEST_Q40 ? s.cov_q40[i] : WIDEST_Q40;
        t->normal.b_q32[i] = 0;
    }
    t->normal.c_q32 = 0;
}
