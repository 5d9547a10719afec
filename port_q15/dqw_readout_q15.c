// dqw_model_read_q15(): what the weights of two neurons say together of one machine.
#include "dqw_model_q15.h"

// Parameters, and inputs of one axis.
enum { N = DQW_PARAMETERS_Q15, IN_L = 1, IN_CROSS = 2 };
// Parameters, and inputs of an axis, with every effect that there is room for.
enum { ALL = N + DQW_EFFECT_WEIGHTS };
// Pole pairs are taken for an integer when every other integer is four deviations away, and the estimate itself lies within a quarter.
#define QUARTER_Q10 256
#define POLE_PAIRS_MAX 100
#define ONE_Q28 268435456
#define KNOWN_POLE_PAIRS 16u
// Joint sums may have so many bits, p^2 included.
#define ROOM_BITS 44u
// Bound on the part of a weight that noise on its regressor may have taken: a tenth.
#define SHRUNK_MAX_Q20 104858

typedef struct axis_read {
    const dqw_axis_q15 *a;
    dqw_solution_q15 s;
    int64_t variance_q56;  // of a block's residual, widened by the likeness of neighbours
    int64_t weight_q31;    // the smaller variance over this one
} axis_read;

static void solve(dqw_axis_q15 *a, axis_read *r)
{
    r->a = a;
    dqw_axis_solve_q15(a, &r->s);
    r->variance_q56 = dqw_q_product64(dqw_axis_variance_q56(a, &r->s), dqw_axis_inflation_q20(a), -20);
}

// Variance of both axes' residuals together: an axis counts by its blocks.
static int64_t common(const axis_read *d, const axis_read *q)
{
    const int64_t n_d = d->a->blocks;
    const int64_t n_q = q->a->blocks;
    return dqw_q_quotient64(dqw_q_product64(d->variance_q56, n_d, -20) + dqw_q_product64(q->variance_q56, n_q, -20), n_d + n_q, 20);
}

// Variance of weight i over its square, Q40; INT64_MAX where it was not learned.
static int64_t relative_q40(const axis_read *r, int i)
{
    const int64_t w = r->s.w_q40[i];
    if (r->s.cov_q40[i] == INT64_MAX || w == 0) return INT64_MAX;
    const int64_t variance_q40 = dqw_q_product64(r->s.cov_q40[i], r->variance_q56, -56);
    return dqw_q_quotient64(dqw_q_quotient64(variance_q40, w, 40), w, 40);
}

// p from the cross weights: (p Lq / Ld)(p Ld / Lq) = p^2, whatever the saliency. 0 where they do not tell.
static uint16_t find_pole_pairs(const axis_read *d, const axis_read *q, const dqw_scale *scale)
{
    const int64_t angle_q28 = dqw_scale_angle_q28(scale);
    const int64_t ratio_d_q30 = dqw_q_quotient64(d->s.w_q40[IN_CROSS], d->s.w_q40[IN_L], 30);
    const int64_t ratio_q_q30 = dqw_q_quotient64(q->s.w_q40[IN_CROSS], q->s.w_q40[IN_L], 30);
    int64_t sum_q40 = 0;
    for (int i = IN_L; i <= IN_CROSS; i++) {
        const int64_t v_d = relative_q40(d, i);
        const int64_t v_q = relative_q40(q, i);
        if (v_d > (int64_t)1 << 40 || v_q > (int64_t)1 << 40) return 0;
        sum_q40 += v_d + v_q;
    }
    const int64_t p2_q20 = dqw_q_quotient64(dqw_q_quotient64(dqw_q_product64(ratio_d_q30, ratio_q_q30, -30), angle_q28, 28), angle_q28, 18);
    if (p2_q20 <= 0 || p2_q20 > (int64_t)POLE_PAIRS_MAX * POLE_PAIRS_MAX << 20) return 0;
    const int64_t p_q10 = dqw_q_root64((uint64_t)p2_q20);
    const int64_t sd_q10 = dqw_q_product64(p_q10, dqw_q_root64((uint64_t)sum_q40), -21);
    const int64_t nearest = dqw_q_floor64(p_q10 + 512, 10);
    const int64_t off_q10 = p_q10 > nearest * 1024 ? p_q10 - nearest * 1024 : nearest * 1024 - p_q10;
    return nearest >= 1 && off_q10 < QUARTER_Q10 && 4 * sd_q10 < 1024 - off_q10 ? (uint16_t)nearest : 0;
}

// Effects' weights stand behind an axis' own, and behind the parameters; without room for effects there are none.
#if DQW_EFFECT_WEIGHTS > 0
static int effects_of(const dqw_axis_q15 *d)
{
    return d->normal.inputs - DQW_D_Q15_INPUTS;
}

static int place_of(const uint8_t to[], int own, int i)
{
    return i < own ? to[i] : N + i - own;
}

static int64_t part_of(const int64_t factor_q28[], int own, int i)
{
    return i < own ? factor_q28[i] : ONE_Q28;
}
#else
static int effects_of(const dqw_axis_q15 *d)
{
    (void)d;
    return 0;
}

static int place_of(const uint8_t to[], int own, int i)
{
    (void)own;
    return to[i];
}

static int64_t part_of(const int64_t factor_q28[], int own, int i)
{
    (void)own;
    return factor_q28[i];
}
#endif

static int sum_at(int i, int j)
{
    return i < j ? DQW_NORMAL_A(i, j) : DQW_NORMAL_A(j, i);
}

// One axis' part of the joint normal equations, times 2^up: an axis that weighs little keeps its digits. to[i] is the parameter that weight i of the axis' `own` stands for,
// factor[i] how many of it.
static void join(const axis_read *r, int own, const uint8_t to[], const int64_t factor_q28[], int up, dqw_normal_q15 *m)
{
    const dqw_normal_q15 *n = &r->a->normal;
    for (int j = 0; j < n->inputs; j++) {
        // The square of a small angle has few bits in Q28: 7 of settled rows, whose period is a microsecond.
        const int64_t part_q56 = dqw_q_product64(part_of(factor_q28, own, j), r->weight_q31, -3);
        for (int i = 0; i <= j; i++) {
            const int64_t both_q56 = dqw_q_product64(part_of(factor_q28, own, i), part_q56, -28);
            const int at = sum_at(place_of(to, own, i), place_of(to, own, j));
            // Less what the start values brought.
            const int64_t sum_q32 = n->a_q32[DQW_NORMAL_A(i, j)] - (i == j ? DQW_AXIS_Q15_PRIOR_Q32 : 0);
            m->a_q32[at] += dqw_q_product64(sum_q32, both_q56, up - 56);
        }
        const int64_t sum_q32 = n->b_q32[j] - dqw_q_product64(DQW_AXIS_Q15_PRIOR_Q32, r->a->start_q40[j], -40);
        m->b_q32[place_of(to, own, j)] += dqw_q_product64(sum_q32, part_q56, up - 56);
    }
    m->c_q32 += dqw_q_product64(n->c_q32, r->weight_q31, up - 31);
}

// How far the joint sums can be raised.
static int room(const dqw_axis_q15 *a)
{
    unsigned most = dqw_q_bits64(a->normal.c_q32);
    for (int i = 0; i < a->normal.inputs; i++) {
        const unsigned bits = dqw_q_bits64(a->normal.a_q32[DQW_NORMAL_A(i, i)]);
        if (bits > most) most = bits;
    }
    return most < ROOM_BITS ? (int)(ROOM_BITS - most) : 0;
}

// Without p the cross weights stand for no inductance: R from both axes, L_d and L_q from their own slope, each by what is known of it.
static void join_single(const axis_read *r, int input, int parameter, dqw_normal_q15 *m)
{
    if (r->s.cov_q40[input] == INT64_MAX) return;
    const int64_t info_q32 = dqw_q_product64(dqw_q_quotient64((int64_t)1 << 40, r->s.cov_q40[input], 32), r->weight_q31, -31);
    m->a_q32[DQW_NORMAL_A(parameter, parameter)] += info_q32;
    const int64_t b_q32 = dqw_q_product64(info_q32, r->s.w_q40[input], -40);
    m->b_q32[parameter] += b_q32;
    m->c_q32 += dqw_q_product64(b_q32, r->s.w_q40[input], -40) + 1;
}

static int64_t deviation_q40(int64_t cov_q40, int64_t variance_q56, int up)
{
    return cov_q40 != INT64_MAX ? (int64_t)dqw_q_root64((uint64_t)dqw_q_product64(cov_q40, variance_q56, up - 48)) << 16 : INT64_MAX;
}

dqw_parameters_q15 dqw_model_read_q15(dqw_axis_q15 *d, dqw_axis_q15 *q, const dqw_scale *scale, bool settled)
{
    static const uint8_t to_d[] = {DQW_R_Q15, DQW_LD_Q15, DQW_LQ_Q15};
    static const uint8_t to_q[] = {DQW_R_Q15, DQW_LQ_Q15, DQW_LD_Q15, DQW_PSI_Q15};
    axis_read on_d;
    axis_read on_q;
    solve(d, &on_d);
    solve(q, &on_q);
    int64_t least_q56 = on_d.variance_q56 < on_q.variance_q56 ? on_d.variance_q56 : on_q.variance_q56;
    on_d.weight_q31 = settled ? INT32_MAX : dqw_q_quotient64(least_q56, on_d.variance_q56, 31);
    on_q.weight_q31 = settled ? INT32_MAX : dqw_q_quotient64(least_q56, on_q.variance_q56, 31);
    if (settled) least_q56 = common(&on_d, &on_q);

    dqw_parameters_q15 out = {.pole_pairs = scale->pole_pairs != 0 ? scale->pole_pairs : find_pole_pairs(&on_d, &on_q, scale)};
    if (out.pole_pairs != 0) out.known = KNOWN_POLE_PAIRS;
    dqw_normal_q15 m;
    int up = 0;
    const int effects = out.pole_pairs != 0 ? effects_of(d) : 0;
    static const int64_t zero[ALL] = {0};
#if DQW_EFFECT_WEIGHTS > 0
    int64_t prior_q32[ALL];
    for (int i = 0; i < N + effects; i++) prior_q32[i] = 1;
#else
    static const int64_t prior_q32[N] = {1, 1, 1, 1};
#endif
    (void)dqw_normal_init_q15(&m, N + effects, prior_q32, zero);
    if (out.pole_pairs != 0) {
        const int64_t p_q28 = dqw_scale_angle_q28(scale) * out.pole_pairs;
        const int64_t factor_q28[] = {ONE_Q28, ONE_Q28, p_q28, p_q28};
        up = room(d) < room(q) ? room(d) : room(q);
        join(&on_d, DQW_D_Q15_INPUTS, to_d, factor_q28, up, &m);
        join(&on_q, DQW_Q_Q15_INPUTS, to_q, factor_q28, up, &m);
    } else {
        join_single(&on_d, 0, DQW_R_Q15, &m);
        join_single(&on_q, 0, DQW_R_Q15, &m);
        join_single(&on_d, IN_L, DQW_LD_Q15, &m);
        join_single(&on_q, IN_L, DQW_LQ_Q15, &m);
    }
    dqw_solution_q15 s;
    dqw_normal_solve_q15(&m, zero, &s);

    const int64_t blocks = d->blocks > q->blocks ? d->blocks : q->blocks;
    for (int i = 0; i < N; i++) {
        const int64_t sd_q40 = deviation_q40(s.cov_q40[i], least_q56, up);
        out.value_q40[i] = s.w_q40[i];
        out.sd_q40[i] = sd_q40;
        if (sd_q40 == INT64_MAX || s.w_q40[i] <= 0 || sd_q40 >= dqw_q_floor64(s.w_q40[i], 2)) continue;
        // A regressor that is mostly noise shrinks its weight by up to n (sd / w)^2, however small the deviation gets. (E20)
        const int64_t ratio_q20 = dqw_q_quotient64(sd_q40, s.w_q40[i], 20);
        if (!settled && dqw_q_product64(ratio_q20 * ratio_q20, blocks, -20) > SHRUNK_MAX_Q20) continue;
        out.known |= (uint8_t)(1u << i);
    }
#if DQW_EFFECT_WEIGHTS > 0
    for (int i = 0; i < DQW_EFFECT_WEIGHTS; i++) {
        out.effect_q40[i] = i < effects ? s.w_q40[N + i] : 0;
        out.effect_sd_q40[i] = i < effects ? deviation_q40(s.cov_q40[N + i], least_q56, up) : INT64_MAX;
    }
#endif
    return out;
}
