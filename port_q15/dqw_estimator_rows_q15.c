// What a block says: the joint neuron's rows, and the noise on their inputs. All inputs are voltages, Q28 of the full
// one.
#include "dqw_estimator_block_q15.h"
#include "dqw_q15.h"

#define ONE_Q15 32768

enum { D = 0, Q = 1, N = DQW_PARAMETERS };

static int64_t product(int64_t a_q40, int64_t b)
{
    return dqw_q_product64(a_q40, b, -40);
}

dqw_block_q15 dqw_estimator_means_q15(const dqw_estimator_q15_block *b)
{
    return dqw_model_block_q15(b->sums, b->weight);
}

// The correction goes with one over L_d, and L_d with the correction: one that is not learned yet must not run away
// with it. No machine's L_d is beyond these parts of its L_q.
static int64_t salient_q40(int64_t L_d_q40, int64_t L_q_q40)
{
    const int64_t least = dqw_q_floor64(L_q_q40, 2);
    return L_d_q40 < least ? least : L_d_q40 > 2 * L_q_q40 ? 2 * L_q_q40 : L_d_q40;
}

static void exact(const dqw_estimator_q15 *e, const dqw_estimator_q15_block *b, const dqw_units_q15 *u,
                  dqw_block_q15 *m)
{
    *m = dqw_estimator_means_q15(b);
    const int32_t *w = e->w_q24;
    if (e->blocks <= 10 || e->config->settled) return;
    dqw_machine_q15 known = {.R_q40 = dqw_q_times64(u->R_q40, w[DQW_R], -24), .turn_q28 = e->turn_q28};
    for (int axis = 0; axis < 2; axis++) known.L_q40[axis] = dqw_q_times64(u->L_q40[axis], w[DQW_LD + axis], -24);
    known.L_q40[0] = salient_q40(known.L_q40[0], known.L_q40[1]);
    // Of what the cross weights say, the more learned one.
    if (dqw_estimator_seeks_q15(e)) {
        const int i = e->cov_q40[DQW_POLES_LQ_Q15] < e->cov_q40[DQW_POLES_LD_Q15] ? DQW_LQ : DQW_LD;
        known.turn_q28 = dqw_q_quotient64(known.turn_q28 * (int64_t)w[i + DQW_POLES_LD_Q15 - DQW_LD], w[i], 0);
    }
    dqw_model_correct_q15(m, &known);
}

// Mean slope of dead time's input, per full current, Q24.
static int64_t dead_slope_q24(const dqw_estimator_q15_block *b, const dqw_units_q15 *u)
{
    return dqw_q_quotient64(dqw_q_quotient64(b->with.slope_q15, b->with.slopes, 16),
                            DQW_DEAD_TIME_Q15_PARTS * u->width_q40, 33);
}

static void inputs(const dqw_estimator_q15 *e, const dqw_estimator_q15_block *b, const dqw_block_q15 *m,
                   dqw_rows_q15 *r)
{
    const dqw_units_q15 *u = &r->unit;
    const int32_t i_q28[] = {m->i_d, m->i_q};
    const int32_t di_q28[] = {m->di_d, m->di_q};
    const int32_t wi_q28[] = {m->wi_d, m->wi_q};
    const int32_t flux = dqw_q_times32(u->psi_q40, m->w_m, -40);
    const bool dead_time = dqw_estimator_has_dead_time_q15(e);
    for (int axis = 0; axis < 2; axis++) {
        int32_t *x = r->x_q28[axis];
        const int other = 1 - axis;
        for (int i = 0; i < N; i++) x[i] = 0;
        const int32_t across = dqw_q_times32(u->X_q40[other], axis == Q ? wi_q28[other] : -wi_q28[other], -40);
        x[DQW_R] = dqw_q_times32(u->R_q40, i_q28[axis], -40);
        x[DQW_LD + axis] = dqw_q_times32(u->L_q40[axis], di_q28[axis], -40);
        x[dqw_estimator_cross_q15(e, axis)] = across;
        if (axis == Q || dqw_estimator_has_psi_q_q15(e)) x[axis == Q ? DQW_PSI : DQW_PSI_Q] = flux;
        if (!dead_time) continue;
        x[DQW_DEAD_TIME] = dqw_q_quotient32(b->sums[DQW_BLOCK_Q15_SIGNALS + axis],
                                            (int64_t)DQW_DEAD_TIME_Q15_PARTS * b->weight, 12);
        x[DQW_DEAD_CONSTANT] = dqw_q_quotient32(b->sums[DQW_BLOCK_Q15_SIGNALS + 2 + axis],
                                                (int64_t)DQW_DEAD_TIME_Q15_PARTS * b->weight, 12);
    }
#if DQW_EFFECT_WEIGHTS > 0
    const int weights = e->effect.weights;
    for (int axis = 0; axis < 2; axis++)
        for (int i = 0; i < weights; i++)
            r->x_q28[axis][N + i] = dqw_effect_mean_q15(&e->effect, b->sums[DQW_PLAIN_Q15_SIGNALS + axis * weights + i],
                                                        b->weight);
#endif
    r->y_q28[D] = m->v_d;
    r->y_q28[Q] = m->v_q;
}

// A voltage one period late differs from that in time by this much: the triangle's weight steps by one a pair. One that
// is held in the stationary frame is turned besides; one that is given in the frame of its own period is not. (E90)
static void late_of(const dqw_estimator_q15 *e, const dqw_estimator_q15_block *b, const dqw_block_q15 *m,
                    dqw_rows_q15 *r)
{
    const bool known = !e->config->settled && e->pole_pairs != 0 && b->whole;
    const int64_t turn_q28 = e->config->voltage_held ? dqw_q_times64(e->turn_q28, m->w_m, -28) : 0;
    // Angles below one radian
    const int32_t across_q28[] = {-m->v_q, m->v_d};
    for (int axis = 0; axis < 2; axis++)
        r->late_q28[axis] = known ? dqw_q31_sat(dqw_q_quotient64(b->v_step_q15[axis], b->weight, 13) +
                                                dqw_q_times64(turn_q28, across_q28[axis], -28))
                                  : 0;
}

static void noise_of_dead_time(const dqw_estimator_q15_block *b, const dqw_units_q15 *u, int64_t var_q36,
                               int64_t held_q56, int64_t noise_q56[])
{
    const int64_t slope_q24 = dead_slope_q24(b, u);
    const int64_t left_q36 = dqw_q_quotient64(var_q36 * b->with.follow_q15, 2 * ONE_Q15 - b->with.follow_q15, 0);
    const int64_t sd_q40 = (int64_t)dqw_q_root64((uint64_t)left_q36) << 22;
    // Where what is left of the current's noise is wide, that of a step; where narrow, tanh's own; and all of it where
    // the currents stay within the width. In the resistance's equation a wide noise also smooths the step, which takes
    // half.
    const int64_t wide_q24 = dqw_q_quotient64(97123608386, 5 * sd_q40 + 6 * u->width_q40,
                                              24);  // 0.53 / 30 / (sd + 1.2 width)
    const int64_t g_q56 = dqw_q_product64(held_q56, slope_q24, -24);
    noise_q56[DQW_DEAD_TIME] = dqw_q_product64(g_q56, slope_q24 > wide_q24 ? slope_q24 : wide_q24, -24);
    noise_q56[DQW_NOISE_Q15_R_IN_DEAD] = product(u->R_q40, g_q56);
    const int64_t smooth_q36 = product(left_q36, dqw_q_quotient64(sd_q40, sd_q40 + u->width_q40, 39));
    noise_q56[DQW_NOISE_Q15_DEAD_IN_R] = product(noise_q56[DQW_NOISE_Q15_R_IN_DEAD],
                                                 dqw_q_quotient64(var_q36 - smooth_q36, var_q36, 40));
}

static int64_t squared(int64_t a_q40, int64_t x_q56)
{
    return product(a_q40, product(a_q40, x_q56));
}

static void noise_of(const dqw_estimator_q15 *e, const dqw_estimator_q15_block *b, const dqw_block_q15 *m,
                     dqw_rows_q15 *r)
{
    const dqw_units_q15 *u = &r->unit;
    const int64_t h = e->window.half;
    const int64_t sum = h * (h + 1);
    // (h (4 h^2 - 1) / 6 + h^2) / S^2, and 2 h / S^2: up to 2^22 over up to 2^30; Q40, and 2^20 more from a variance in
    // Q36
    const int64_t mean_q60 = dqw_q_quotient64(h * (4 * h * h - 1) + 6 * h * h, 6 * sum * sum, 60);
    const int64_t slope_q60 = dqw_q_quotient64(2 * h, sum * sum, 60);
    int64_t var_q36[DQW_NOISE_Q15_SUMS];
    int64_t held_q56[DQW_NOISE_Q15_SUMS];
    for (int k = 0; k < DQW_NOISE_Q15_SUMS; k++) {
        var_q36[k] = dqw_noise_variance_q36(b->with.noise_q30[k], b->with.rows, k < DQW_NOISE_W_Q15 ? -2 : 6);
        held_q56[k] = product(var_q36[k], mean_q60);
    }
    const int64_t w_q56 = held_q56[DQW_NOISE_W_Q15];
    const int64_t w2_q56 = (int64_t)m->w_m * m->w_m;
    const int32_t i_q28[2] = {m->i_d, -m->i_q};
    for (int axis = 0; axis < 2; axis++) {
        int64_t *noise = r->noise_q56[axis];
        const int other = 1 - axis;
        const int64_t i2_q56 = (int64_t)i_q28[other] * i_q28[other];
        const int64_t both_q56 = dqw_q_product64(w2_q56, held_q56[other], -56) +
                                 dqw_q_product64(w_q56, i2_q56 + var_q36[other] * 1048576, -56);
        for (int i = 0; i < DQW_NOISE_Q15_COVARIANCES; i++) noise[i] = 0;
        noise[DQW_R] = squared(u->R_q40, held_q56[axis]);
        noise[DQW_LD + axis] = squared(u->L_q40[axis], product(var_q36[axis], slope_q60));
        noise[dqw_estimator_cross_q15(e, axis)] = squared(u->X_q40[other], both_q56);
        if (axis == Q || dqw_estimator_has_psi_q_q15(e)) {
            noise[axis == Q ? DQW_PSI : DQW_PSI_Q] = squared(u->psi_q40, w_q56);
            noise[DQW_NOISE_Q15_SPEED] = product(u->X_q40[other],
                                                 product(u->psi_q40, dqw_q_times64(w_q56, i_q28[other], -28)));
        }
        if (dqw_estimator_has_dead_time_q15(e) && var_q36[axis] > 0)
            noise_of_dead_time(b, u, var_q36[axis], held_q56[axis], noise);
        // A noise of half the full voltage is more than anybody learns from: sums of such variances stay within their
        // bits.
        const int64_t most = (int64_t)1 << 54;
        for (int i = 0; i < DQW_NOISE_Q15_COVARIANCES; i++) noise[i] = dqw_q_within64(noise[i], most);
    }
}

void dqw_estimator_rows_of_q15(const dqw_estimator_q15 *e, const dqw_estimator_q15_block *b, dqw_rows_q15 *r)
{
    (void)dqw_units_of_q15(e->config, e->pole_pairs, &r->unit);
    // [ROW.1] means, without what the trapezoid has too much
    dqw_block_q15 m;
    exact(e, b, &r->unit, &m);

    // [ROW.2] inputs and targets of both axes
    inputs(e, b, &m, r);

    // [ROW.3] the noise of the inputs
    // Of settled rows nobody measures it: there are no rows, and so all of it is 0.
    noise_of(e, b, &m, r);

    // [ROW.4] by how much a voltage one period late would differ
    late_of(e, b, &m, r);
}
