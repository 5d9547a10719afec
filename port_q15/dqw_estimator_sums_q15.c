// The joint neuron in its information form: what rows and noise make of the sums, and the weights that they say.
#include "dqw_estimator_block_q15.h"
#include "dqw_q15.h"

// Where noise is more than this part of all that was learned of a weight, taking it out could run away: 0.05.
#define NOISE_PART_MAX_Q40 54975581389
// What the sums can hold of a variance: 2^21 of the residual's.
#define WIDEST_Q40 ((int64_t)1 << 61)
#define ONE_Q24 16777216

enum { D = 0, Q = 1, N = DQW_PARAMETERS };

int32_t dqw_estimator_error_q28(const dqw_estimator_q15 *e, int axis, const dqw_rows_q15 *r)
{
    int64_t e_q28 = r->y_q28[axis];
    for (int i = 0; i < dqw_estimator_inputs_q15(e); i++)
        e_q28 -= dqw_q_round64((int64_t)r->x_q28[axis][i] * e->w_q24[i], 24u - dqw_estimator_shift_q15(e, i));
    return dqw_q31_sat(e_q28);
}

// Weighed by how little of that axis is noise.
static int32_t lighter(int32_t x_q28, int64_t weigh_q24)
{
    return dqw_q31_sat(dqw_q_round64(x_q28 * weigh_q24, 24));
}

static void show_segment(dqw_estimator_q15 *e, const int32_t x_q28[], int n, int32_t e_q28)
{
#if DQW_MAP_WEIGHTS > 0
    // As the weights are counted, of so many halvings of the input.
    int32_t x[DQW_FOLLOWED] = {0};
    const int followed = dqw_estimator_has_map_q15(e) ? DQW_FOLLOWED : DQW_PARAMETERS;
    for (int i = 0; i < n && i < followed; i++) x[i] = dqw_q31_sat(dqw_estimator_counted_q15(e, i, x_q28[i], 1));
    dqw_segment_row_q15(&e->segment, x, e_q28);
#else
    (void)n;
    dqw_segment_row_q15(&e->segment, x_q28, e_q28);
#endif
}

void dqw_estimator_show_q15(dqw_estimator_q15 *e, int axis, const dqw_rows_q15 *r, uint32_t mask, int64_t weigh_q24)
{
    const int n = dqw_estimator_inputs_q15(e);
    int32_t x_q28[DQW_NORMAL_INPUTS];
    for (int i = 0; i < n; i++) x_q28[i] = (mask >> i & 1u) != 0 ? lighter(r->x_q28[axis][i], weigh_q24) : 0;
    const int32_t e_q28 = lighter(e->e_q28[axis], weigh_q24);
    if (dqw_estimator_follows_q15(e)) show_segment(e, x_q28, n, e_q28);
    // Behind the inputs, the late voltage: what the others leave of it, and of the residual with it, says how late the
    // voltage acts. (E90)
    x_q28[n] = lighter(r->late_q28[axis], weigh_q24);
    dqw_normal_add_q15(&e->normal, x_q28, e_q28);
}

static int64_t weighed(int64_t x_q56, int64_t by_q24)
{
    return dqw_q_product64(x_q56, by_q24, -32);
}

void dqw_estimator_take_noise_out_q15(dqw_estimator_q15 *e, const dqw_rows_q15 *r, const int64_t by_q24[],
                                      const uint32_t mask[])
{
    // Each term below 2^54 2^6 in Q56, 2^52 in Q48; a weight below 2^6: seven such sums are below 2^61.
    const int32_t *w = e->w_q24;
    int64_t z_q48[N] = {0};
    for (int axis = 0; axis < 2; axis++)
        for (int i = 0; i < N; i++) {
            const bool taught = (mask[axis] >> i & 1u) != 0;
            const int64_t noisy_q48 = taught ? weighed(r->noise_q56[axis][i], by_q24[axis]) : 0;
            z_q48[i] += noisy_q48;
            if (i == DQW_LD || i == DQW_LQ) dqw_estimator_keep_noisy_q15(e, i, noisy_q48);
        }
    for (int i = 0; i < N; i++) {
        if (dqw_q_product64(z_q48[i], e->cov_q40[i], -48) > NOISE_PART_MAX_Q40) return;
        z_q48[i] = dqw_q_times64(z_q48[i], w[i], -24);
    }
    for (int axis = 0; axis < 2; axis++) {
        const int L = dqw_estimator_cross_q15(e, axis);
        const int flux = axis == Q ? DQW_PSI : DQW_PSI_Q;
        // To the gradient of one the weight of the other.
        const uint8_t pairs[4][3] = {{DQW_R, DQW_DEAD_TIME, DQW_NOISE_Q15_DEAD_IN_R},
                                     {DQW_DEAD_TIME, DQW_R, DQW_NOISE_Q15_R_IN_DEAD},
                                     {(uint8_t)L, (uint8_t)flux, DQW_NOISE_Q15_SPEED},
                                     {(uint8_t)flux, (uint8_t)L, DQW_NOISE_Q15_SPEED}};
        const int known = (mask[axis] >> L & mask[axis] >> flux & 1u) != 0 ? 4 : 2;
        for (int k = 0; k < known; k++)
            z_q48[pairs[k][0]] += dqw_q_times64(weighed(r->noise_q56[axis][pairs[k][2]], by_q24[axis]), w[pairs[k][1]],
                                                -24);
    }
    for (int i = 0; i < N; i++) {
        // The target's sum keeps above what the gradient explains.
        const int64_t z_q32 = dqw_q_scale64(z_q48[i], -16);
        e->normal.b_q32[i] += z_q32;
        e->normal.c_q32 += dqw_q_size64(dqw_q_times64(z_q32, w[i], -24));
    }
}

int64_t dqw_estimator_size_q24(const dqw_estimator_q15 *e, int i)
{
    if (i == DQW_DEAD_TIME && dqw_estimator_has_dead_time_q15(e)) return ONE_Q24;
    const int32_t w_q24 = e->w_q24[i == DQW_PSI_Q && dqw_estimator_has_psi_q_q15(e) ? DQW_PSI : i];
    return dqw_q_size64(w_q24) * ((int64_t)1 << dqw_estimator_shift_q15(e, i));
}

void dqw_estimator_solve_q15(dqw_estimator_q15 *e)
{
    dqw_normal_q15 *m = &e->normal;
    dqw_solution_q15 s;
    const int n = dqw_estimator_inputs_q15(e);
    // With noise taken out, the gradient may explain more than there was; twice is enough.
    m->c_q32 = 2 * m->c_q32 + 16;
    // The late voltage only watches.
    m->inputs = (uint8_t)n;
    dqw_normal_solve_q15(m, dqw_normal_nought_q40, &s);
    m->inputs = (uint8_t)(n + 1);
    for (int i = 0; i < n; i++) {
        m->b_q32[n] -= dqw_q_product64(m->a_q32[DQW_NORMAL_A(i, n)], s.w_q40[i], -40);
        e->w_q24[i] = dqw_q31_sat(e->w_q24[i] + dqw_q_round64(s.w_q40[i], 16u + dqw_estimator_shift_q15(e, i)));
        e->cov_q40[i] = s.cov_q40[i] < WIDEST_Q40 ? s.cov_q40[i] : WIDEST_Q40;
        m->b_q32[i] = 0;
    }
    m->c_q32 = 0;
}
