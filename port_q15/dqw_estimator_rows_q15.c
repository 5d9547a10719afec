// What the tracker's block says: the joint neuron's rows, and the noise on their inputs. All inputs are voltages, Q28 of the full one.
#include "dqw_tracker_rows_q15.h"

#include "dqw_q15.h"

#define EXCITATION_Q15 328
// R needs currents of so many of dead time's widths, squared.
#define STEP_MARGIN 16
#define RADIAN_Q28 268435456
#define ONE_Q15 32768
// 8 full voltages; what a step of the full current may take.
#define MOST_BITS 43u
#define SLOPE_MOST_BITS 52u
#define LEAST_BITS 24u

enum { D = 0, Q = 1, N = DQW_TRACK_Q15_WEIGHTS };

static int64_t product(int64_t a_q40, int64_t b)
{
    return dqw_q_product64(a_q40, b, -40);
}

static bool fits(int64_t x_q40, unsigned most)
{
    const unsigned bits = dqw_q_bits64(x_q40);
    return x_q40 > 0 && bits >= LEAST_BITS && bits <= most;
}

bool dqw_tracker_nominal_of_q15(const dqw_tracker_q15_config *config, dqw_tracker_nominal_q15 *n)
{
    const dqw_scale *s = &config->scale;
    const int64_t turn_q28 = dqw_scale_turn_q28(s);
    const uint32_t L_nH[2] = {config->Ld_nH, config->Lq_nH};
    n->R_q40 = dqw_scale_R_q40(s, config->R_uohm);
    n->psi_q40 = dqw_q_product64(dqw_scale_psi_q40(s, config->psi_nWb), turn_q28, -28);
    n->width_q40 = config->angle ? dqw_q_quotient64(config->dead_time_width_mA, s->i_full_mA, 40) : 0;
    bool good = turn_q28 >= 1 && turn_q28 < RADIAN_Q28 && fits(n->R_q40, MOST_BITS) && fits(n->psi_q40, MOST_BITS);
    for (int axis = 0; axis < 2; axis++) {
        n->L_q40[axis] = dqw_scale_L_q40(s, L_nH[axis]);
        n->X_q40[axis] = dqw_q_product64(n->L_q40[axis], turn_q28, -28);
        good = good && fits(n->L_q40[axis], SLOPE_MOST_BITS) && fits(n->X_q40[axis], MOST_BITS);
    }
    return good;
}

dqw_block_q15 dqw_tracker_block_q15(const dqw_tracker_q15 *t)
{
    // Volatile, as the flag that guards them: read after dqw_tracker_waits_q15() and before dqw_tracker_release_q15().
    const volatile int32_t *from = t->block;
    int32_t sums[DQW_BLOCK_Q15_SIGNALS];
    for (int i = 0; i < DQW_BLOCK_Q15_SIGNALS; i++) sums[i] = from[i];
    return dqw_model_block_q15(sums, *(const volatile uint16_t *)&t->weight);
}

static dqw_block_q15 exact_block(const dqw_tracker_q15 *t, const dqw_tracker_nominal_q15 *n)
{
    dqw_block_q15 b = dqw_tracker_block_q15(t);
    const int32_t *w = t->w_q24;
    if (t->blocks <= 10 || w[DQW_TRACK_R_Q15] <= 0 || w[DQW_TRACK_LD_Q15] <= 0 || w[DQW_TRACK_LQ_Q15] <= 0) return b;
    const dqw_parameters_q15 known = {
        .value_q40 = {dqw_q_product64(n->R_q40, w[DQW_TRACK_R_Q15], -24), dqw_q_product64(n->L_q40[D], w[DQW_TRACK_LD_Q15], -24),
                      dqw_q_product64(n->L_q40[Q], w[DQW_TRACK_LQ_Q15], -24)},
        .pole_pairs = t->config->scale.pole_pairs,
        .known = 1u << DQW_R_Q15 | 1u << DQW_LD_Q15 | 1u << DQW_LQ_Q15,
    };
    dqw_model_correct_q15(&b, &known, &t->config->scale);
    return b;
}

// Mean slope of dead time's input, per full current, Q16.
static int64_t dead_slope_q16(const dqw_tracker_q15 *t, const dqw_tracker_nominal_q15 *n)
{
    const uint32_t sum_q15 = *(const volatile uint32_t *)&t->slope_q15;
    const uint16_t slopes = *(const volatile uint16_t *)&t->slopes;
    return slopes == 0 ? 0 : dqw_q_quotient64(dqw_q_quotient64(sum_q15, slopes, 16), n->width_q40, 25);
}

static int32_t dead_input(const dqw_tracker_q15 *t, int axis, int64_t late_q16, int32_t di_q28)
{
    const int64_t part_q30 = 1073741824u / *(const volatile uint16_t *)&t->weight;
    const int64_t sum = *(const volatile int32_t *)&t->block[DQW_BLOCK_Q15_SIGNALS + axis];
    // Its input saw the currents late: on average that is its mean slope times the delay times the current's.
    const int64_t whole_q28 = dqw_q_round64(sum * part_q30, 18) + dqw_q_product64(late_q16, di_q28, -16);
    return dqw_q31_sat(dqw_q_quotient64(whole_q28, DQW_TRACK_Q15_DEAD_PARTS, 0));
}

static void inputs(const dqw_tracker_q15 *t, const dqw_tracker_nominal_q15 *n, const dqw_block_q15 *b, dqw_tracker_rows_q15 *r)
{
    // cppcheck-suppress ctuuninitvar; this sets it
    int32_t *d = r->x_q28[D];
    int32_t *q = r->x_q28[Q];
    const int64_t late_q16 = n->width_q40 > 0 ? dqw_q_quotient64(dead_slope_q16(t, n) * (ONE_Q15 - t->follow_q15), t->follow_q15, 0) : 0;
    const int32_t flux = dqw_q31_sat(product(n->psi_q40, b->w_m));
    d[DQW_TRACK_R_Q15] = dqw_q31_sat(product(n->R_q40, b->i_d));
    q[DQW_TRACK_R_Q15] = dqw_q31_sat(product(n->R_q40, b->i_q));
    d[DQW_TRACK_LD_Q15] = dqw_q31_sat(product(n->L_q40[D], b->di_d));
    q[DQW_TRACK_LD_Q15] = dqw_q31_sat(product(n->X_q40[D], b->wi_d));
    d[DQW_TRACK_LQ_Q15] = dqw_q31_sat(-product(n->X_q40[Q], b->wi_q));
    q[DQW_TRACK_LQ_Q15] = dqw_q31_sat(product(n->L_q40[Q], b->di_q));
    d[DQW_TRACK_PSI_Q15] = 0;
    q[DQW_TRACK_PSI_Q15] = flux;
    d[DQW_TRACK_PSI_Q_Q15] = t->config->angle ? flux : 0;
    q[DQW_TRACK_PSI_Q_Q15] = 0;
    d[DQW_TRACK_DEAD_TIME_Q15] = n->width_q40 > 0 ? dead_input(t, D, late_q16, b->di_d) : 0;
    q[DQW_TRACK_DEAD_TIME_Q15] = n->width_q40 > 0 ? dead_input(t, Q, late_q16, b->di_q) : 0;
    r->y_q28[D] = b->v_d;
    r->y_q28[Q] = b->v_q;
}

// mean_q40: what a mean holds of a variance.
static void noise_of_dead_time(const dqw_tracker_q15 *t, const dqw_tracker_nominal_q15 *n, int axis, int64_t var_q36, int64_t mean_q40, dqw_tracker_rows_q15 *r)
{
    const int64_t slope_q16 = dead_slope_q16(t, n);
    const int64_t held_q56 = dqw_q_product64(var_q36, mean_q40, -20);
    const int64_t left_q36 = dqw_q_quotient64(var_q36 * t->follow_q15, 2 * ONE_Q15 - t->follow_q15, 0);
    const int64_t sd_q40 = (int64_t)dqw_q_root64((uint64_t)left_q36) << 22;
    // Where what is left of the current's noise is wide, that of a step; where narrow, tanh's own; and all of it where the currents stay
    // within the width. In the resistance's equation a wide noise also smooths the step, which takes half.
    const int64_t wide_q16 = dqw_q_quotient64(582741650317, sd_q40 + dqw_q_quotient64(6 * n->width_q40, 5, 0), 16);  // 0.53
    const int64_t g_q56 = dqw_q_quotient64(dqw_q_product64(held_q56, slope_q16, -16), DQW_TRACK_Q15_DEAD_PARTS, 0);
    r->var_q56[axis][DQW_TRACK_DEAD_TIME_Q15] = dqw_q_quotient64(dqw_q_product64(g_q56, slope_q16 > wide_q16 ? slope_q16 : wide_q16, -16),
                                                                 DQW_TRACK_Q15_DEAD_PARTS, 0);
    r->R_in_dead_q56[axis] = product(n->R_q40, g_q56);
    const int64_t smooth_q36 = dqw_q_product64(left_q36, dqw_q_quotient64(sd_q40, sd_q40 + n->width_q40, 30), -31);
    r->dead_in_R_q56[axis] = dqw_q_product64(r->R_in_dead_q56[axis], dqw_q_quotient64(var_q36 - smooth_q36, var_q36, 30), -30);
}

static void noise_of(const dqw_tracker_q15 *t, const dqw_tracker_nominal_q15 *n, const dqw_block_q15 *b, dqw_tracker_rows_q15 *r)
{
    const int64_t h = t->window.half;
    const int64_t sum = h * (h + 1);
    // (h (4 h^2 - 1) / 6 + h^2) / S^2, and 2 h / S^2: up to 2^22 over up to 2^27
    const int64_t mean_q40 = dqw_q_quotient64(h * (4 * h * h - 1) + 6 * h * h, 6 * sum * sum, 40);
    const int64_t slope_q40 = dqw_q_quotient64(2 * h, sum * sum, 40);
    const uint16_t rows = *(const volatile uint16_t *)&t->noise.rows;
    const volatile dqw_noise_means_q15 *m = &t->means;
    const int64_t var_q36[2] = {dqw_noise_variance_q36(m->i_d_q36, rows, -2), dqw_noise_variance_q36(m->i_q_q36, rows, -2)};
    const int64_t w_q56 = dqw_q_product64(dqw_noise_variance_q36(m->w_q36, rows, 6), mean_q40, -20);
    const int32_t i_q28[2] = {b->i_d, b->i_q};
    for (int axis = 0; axis < 2; axis++) {
        int64_t *var = r->var_q56[axis];
        const int other = 1 - axis;
        const int64_t held_q56 = dqw_q_product64(var_q36[axis], mean_q40, -20);
        const int64_t held_other_q56 = dqw_q_product64(var_q36[other], mean_q40, -20);
        const int64_t w2_q56 = (int64_t)b->w_m * b->w_m;
        const int64_t i2_q56 = (int64_t)i_q28[other] * i_q28[other];
        const int64_t both_q56 = dqw_q_product64(w2_q56, held_other_q56, -56) + dqw_q_product64(w_q56, i2_q56 + var_q36[other] * 1048576, -56);
        const int64_t flux_q56 = product(n->psi_q40, product(n->psi_q40, w_q56));
        var[DQW_TRACK_R_Q15] = product(n->R_q40, product(n->R_q40, held_q56));
        var[DQW_TRACK_LD_Q15 + axis] = product(n->L_q40[axis], product(n->L_q40[axis], dqw_q_product64(var_q36[axis], slope_q40, -20)));
        var[DQW_TRACK_LQ_Q15 - axis] = product(n->X_q40[other], product(n->X_q40[other], both_q56));
        var[DQW_TRACK_PSI_Q15] = axis == Q ? flux_q56 : 0;
        var[DQW_TRACK_PSI_Q_Q15] = axis == D && t->config->angle ? flux_q56 : 0;
        var[DQW_TRACK_DEAD_TIME_Q15] = 0;
        const int64_t shared_q56 = product(n->X_q40[other], product(n->psi_q40, dqw_q_product64(w_q56, i_q28[other], -28)));
        r->speed_q56[axis] = axis == Q ? shared_q56 : t->config->angle ? -shared_q56 : 0;
        r->dead_in_R_q56[axis] = r->R_in_dead_q56[axis] = 0;
        if (n->width_q40 > 0 && var_q36[axis] > 0) noise_of_dead_time(t, n, axis, var_q36[axis], mean_q40, r);
    }
}

static void least_of(const dqw_tracker_q15 *t, const dqw_tracker_nominal_q15 *n, dqw_tracker_rows_q15 *r)
{
    const int32_t part_q15 = t->config->excitation_q15 != 0 ? t->config->excitation_q15 : EXCITATION_Q15;
    const int64_t dead_q40 = dqw_q_quotient64(1, DQW_TRACK_Q15_DEAD_PARTS, 40);
    const int64_t whole_q40[N] = {n->R_q40, n->X_q40[D], n->X_q40[Q], n->psi_q40, dead_q40, n->psi_q40};
    for (int i = 0; i < N; i++) {
        const int64_t x_q40 = dqw_q_product64(whole_q40[i], part_q15, -15);
        r->least_q56[i] = dqw_q_product64(x_q40, x_q40, -24);
    }
    // Among currents as small as dead time's step, its shape decides what is left for R.
    const int64_t step_q40 = product(n->R_q40, n->width_q40);
    const int64_t step2_q56 = dqw_q_product64(step_q40, step_q40, -24);
    const int64_t most_q56 = (int64_t)1 << 57;  // of 1.4 full voltages: nobody learns R there
    r->least_q56[DQW_TRACK_R_Q15] += STEP_MARGIN * (step2_q56 < most_q56 ? step2_q56 : most_q56);
}

// A noise of half the full voltage is more than anybody learns from: sums of such variances stay within their bits.
static void bound(int64_t *x_q56)
{
    const int64_t most = (int64_t)1 << 54;
    if (*x_q56 > most) *x_q56 = most;
    if (*x_q56 < -most) *x_q56 = -most;
}

static void bound_noise(dqw_tracker_rows_q15 *r)
{
    for (int axis = 0; axis < 2; axis++) {
        for (int i = 0; i < N; i++) bound(&r->var_q56[axis][i]);
        bound(&r->speed_q56[axis]);
        bound(&r->dead_in_R_q56[axis]);
        bound(&r->R_in_dead_q56[axis]);
    }
}

void dqw_tracker_rows_of_q15(const dqw_tracker_q15 *t, dqw_tracker_rows_q15 *r)
{
    dqw_tracker_nominal_q15 n;
    (void)dqw_tracker_nominal_of_q15(t->config, &n);
    const dqw_block_q15 b = exact_block(t, &n);
    inputs(t, &n, &b, r);
    noise_of(t, &n, &b, r);
    bound_noise(r);
    least_of(t, &n, r);
}
