// Pole pairs from the motion: while they are not known, the flux of the other axis' current has a weight of its own, p
// times its inductance. What it costs, in squared residuals, to say that both are p of their own inductances: that is a
// parabola over p, and says p and its deviation. (E91)
#include "dqw_estimator_block_q15.h"
#include "dqw_q15.h"

// Blocks, and deviations to every other integer, squared, that an integer needs; and how near it must be: a quarter.
#define LEAST_BLOCKS 100
#define EVIDENCE_SD2 36
#define POLE_PAIRS_MAX 99
#define ONE_Q20 1048576
#define QUARTER_Q20 262144
// Sums of so many bits times what pole pairs make of them still fit.
#define ROOM_BITS 50u

enum { BEFORE = DQW_POLES_LQ_Q15 + 1, AFTER = DQW_PSI + 1 };

// The machine's own weights, and which of them a slot is p/8 of.
static const uint8_t stands_for[BEFORE] = {DQW_R, DQW_LD, DQW_LQ, DQW_PSI, DQW_LD, DQW_LQ};

static int64_t part(int64_t x, int slot, int32_t p)
{
    return slot >= DQW_PSI ? dqw_q_times64(x, p, -3) : x;
}

static int64_t sum_of(const dqw_normal_q15 *m, int i, int j)
{
    return m->a_q32[i < j ? DQW_NORMAL_A(i, j) : DQW_NORMAL_A(j, i)];
}

// The sums around weights that keep to p pole pairs, and what these are.
static void fold(const dqw_estimator_q15 *e, int32_t p, dqw_normal_q15 *m, dqw_solution_q15 *s)
{
    static const int64_t least[AFTER] = {1, 1, 1, 1};
    const int32_t *w = e->w_q24;
    // Off by this much where the inductances stay, and the cross weights follow them.
    const int64_t off_q24[2] = {dqw_q_times64(w[DQW_LD], p, -3) - w[DQW_POLES_LD_Q15],
                                dqw_q_times64(w[DQW_LQ], p, -3) - w[DQW_POLES_LQ_Q15]};
    (void)dqw_normal_init_q15(m, AFTER, least, dqw_normal_nought_q40);
    for (int j = 0; j < BEFORE; j++) {
        const int to = stands_for[j];
        const int64_t gradient_q32 = dqw_q_product64(sum_of(&e->normal, j, DQW_POLES_LD_Q15), off_q24[0], -24) +
                                     dqw_q_product64(sum_of(&e->normal, j, DQW_POLES_LQ_Q15), off_q24[1], -24);
        m->b_q32[to] -= part(gradient_q32, j, p);
        if (j >= DQW_POLES_LD_Q15) m->c_q32 += dqw_q_product64(gradient_q32, off_q24[j - DQW_POLES_LD_Q15], -24);
        for (int i = 0; i < BEFORE; i++)
            if (stands_for[i] <= to)
                m->a_q32[DQW_NORMAL_A(stands_for[i], to)] += part(part(sum_of(&e->normal, i, j), i, p), j, p);
    }
    if (m->c_q32 < 1) m->c_q32 = 1;
    dqw_normal_solve_q15(m, dqw_normal_nought_q40, s);
}

static int64_t cost_q32(const dqw_estimator_q15 *e, int32_t p)
{
    dqw_normal_q15 m;
    dqw_solution_q15 s;
    fold(e, p, &m, &s);
    return s.left_q32;
}

// The joint neuron goes on with what was learned, and with p; dead time and the other flux are new.
static void go_on(dqw_estimator_q15 *e, int32_t p)
{
    // [POL.1] both cross weights are p inductances
    dqw_normal_q15 m;
    dqw_solution_q15 s;
    fold(e, p, &m, &s);

    // [POL.2] units of the joint neuron; dead time and the other flux in the place of the cross weights
    const int n = dqw_estimator_inputs_q15(e);
    int32_t w_q24[DQW_ESTIMATOR_Q15_INPUTS];
    for (int i = 0; i < n; i++) w_q24[i] = i < DQW_PSI ? e->w_q24[i] : 0;
    w_q24[DQW_PSI] = dqw_q31_sat(dqw_q_quotient64(e->w_q24[DQW_PSI], p, 3));
    e->pole_pairs = (uint16_t)p;
    e->turn_q28 = (int32_t)dqw_scale_turn_q28(&e->config->scale, e->pole_pairs);
    dqw_units_q15 u;
    (void)dqw_units_of_q15(e->config, e->pole_pairs, &u);
    for (int j = DQW_DEAD_TIME; j <= n; j++) {
        for (int i = 0; i < j; i++) e->normal.a_q32[DQW_NORMAL_A(i, j)] = 0;
        e->normal.a_q32[DQW_NORMAL_A(j, j)] = 1;
        if (j == n) break;
        e->cov_q40[j] = dqw_estimator_start_cov_q40(e, &u, j);
        e->normal.a_q32[DQW_NORMAL_A(j, j)] = dqw_q_quotient64((int64_t)1 << 40, e->cov_q40[j], 32);
        e->excess_q10[j] = 0;
    }
    for (int k = 0; k < DQW_NORMAL_A(0, AFTER); k++) e->normal.a_q32[k] = m.a_q32[k];
    for (int i = 0; i < n; i++) {
        e->w_q24[i] = i < AFTER ? dqw_q31_sat(w_q24[i] + dqw_q_round64(s.w_q40[i], 16)) : 0;
        if (i < AFTER) e->cov_q40[i] = s.cov_q40[i] < (int64_t)1 << 61 ? s.cov_q40[i] : (int64_t)1 << 61;
        e->normal.b_q32[i] = 0;
    }
    e->normal.b_q32[n] = e->normal.c_q32 = 0;
    e->learned &= (1u << AFTER) - 1u;

    // [POL.3] what had no weight until now is in all that was learned: a start, and no more
    if (e->wide_q28 == 0 && !e->config->encoder_offset) return;
    for (int i = 0; i < n; i++) w_q24[i] = e->w_q24[i];
    dqw_estimator_start_q15(e, w_q24);
}

// An inductance's slope that noise on its currents has shrunk would tell too many pole pairs: by less than a quarter,
// where nobody takes it out.
static bool shrunk(const dqw_estimator_q15 *e, const dqw_estimator_q15_block *b, int32_t p)
{
    if (e->config->noise_on_inputs) return false;
    // cppcheck-suppress uninitvar; every element is set
    dqw_rows_q15 r;
    dqw_estimator_rows_of_q15(e, b, &r);
    for (int axis = 0; axis < 2; axis++) {
        const int i = DQW_LD + axis;
        const int64_t part_q20 = dqw_q_product64(dqw_q_product64(r.noise_q56[axis][i], e->cov_q40[i], -56), e->blocks,
                                                 -20);
        if ((e->learned >> i & 1u) != 0 && part_q20 * p > QUARTER_Q20) return true;
    }
    return false;
}

void dqw_poles_find_q15(dqw_estimator_q15 *e, const dqw_estimator_q15_block *b)
{
    if (e->blocks < LEAST_BLOCKS) return;
    for (int i = DQW_R; i < BEFORE; i++)
        if (dqw_q_bits64(e->normal.a_q32[DQW_NORMAL_A(i, i)]) > ROOM_BITS) return;
    // From the ratio of weights that is known better, to where the parabola has its foot.
    const int own = e->cov_q40[DQW_POLES_LQ_Q15] < e->cov_q40[DQW_POLES_LD_Q15] ? DQW_LQ : DQW_LD;
    const int cross = own + DQW_POLES_LD_Q15 - DQW_LD;
    if ((e->learned >> own & e->learned >> cross & 1u) == 0) return;
    int64_t p = dqw_q_quotient64(e->w_q24[cross], e->w_q24[own], 3);
    for (int turns = 0; turns < 3; turns++) {
        if (p < 1 || p > POLE_PAIRS_MAX) return;
        const int64_t here = cost_q32(e, (int32_t)p);
        const int64_t less = cost_q32(e, (int32_t)p - 1);
        const int64_t more = cost_q32(e, (int32_t)p + 1);
        const int64_t twice = less + more - 2 * here;
        if (twice <= 0) return;
        // (less - more) / (4 twice/2)
        const int64_t off_q20 = dqw_q_quotient64(less - more, twice, 19);
        if (off_q20 > ONE_Q20 / 2 || off_q20 < -ONE_Q20 / 2) {
            p += dqw_q_round64(off_q20, 20);
            continue;
        }
        const int64_t size_q20 = dqw_q_size64(off_q20);
        const int64_t sd2_q32 = dqw_q_product64(dqw_estimator_common_variance_q56(e),
                                                dqw_estimator_inflation_q20(e, own), -44);
        const int64_t apart_q20 = dqw_q_floor64((ONE_Q20 - size_q20) * (ONE_Q20 - size_q20), 20);
        const bool told = size_q20 < QUARTER_Q20 &&
                          (int64_t)2 * EVIDENCE_SD2 * sd2_q32 < dqw_q_product64(twice, apart_q20, -20);
        if (told && dqw_scale_turn_q28(&e->config->scale, (uint32_t)p) < 268435456 && !shrunk(e, b, (int32_t)p))
            go_on(e, (int32_t)p);
        return;
    }
}
