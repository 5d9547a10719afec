#include "dqw_normal_q15.h"

#include <stddef.h>

#include "dqw_q15.h"

#define N DQW_NORMAL_INPUTS
// Sums are halved when one of them needs more bits.
#define FULL_BITS 61u
// A pivot below this part of its diagonal says that the direction was never learned. Rounding leaves 2^-29.
#define PIVOT_BITS 22u
// A weight that is tied to such a direction by more than this is not learned either: 2^-10.
#define TIE_Q40 ((int64_t)1 << 30)
#define NOT_LEARNED INT64_MAX
// 2^11, the root of the inverse of the smallest pivot.
#define BOUND_Q20 ((int64_t)1 << 31)
#define TWO_Q60 ((int64_t)1 << 61)

enum dqw_status dqw_normal_init_q15(dqw_normal_q15 *n, int inputs, const int64_t prior_q32[], const int64_t start_q40[])
{
    if (n == NULL || prior_q32 == NULL || start_q40 == NULL) return DQW_ERR_NULL;
    if (inputs < 1 || inputs > N) return DQW_ERR_SIZE;
    for (int i = 0; i < inputs; i++)
        if (prior_q32[i] < 1 || dqw_q_bits64(prior_q32[i]) > 40 || dqw_q_bits64(start_q40[i]) > 60)
            return DQW_ERR_RANGE;
    const dqw_normal_q15 zero = {.inputs = 0};
    *n = zero;
    n->inputs = (uint8_t)inputs;
    for (int i = 0; i < inputs; i++) {
        n->a_q32[DQW_NORMAL_A(i, i)] = prior_q32[i];
        n->b_q32[i] = dqw_q_product64(prior_q32[i], start_q40[i], -40);
        n->c_q32 += dqw_q_product64(n->b_q32[i], start_q40[i], -40) + 1;
    }
    return DQW_OK;
}

static void halve(dqw_normal_q15 *n)
{
    for (int k = 0; k < n->inputs * (n->inputs + 1) / 2; k++) n->a_q32[k] = dqw_q_floor64(n->a_q32[k], 1);
    for (int i = 0; i < n->inputs; i++) n->b_q32[i] = dqw_q_floor64(n->b_q32[i], 1);
    n->c_q32 = dqw_q_floor64(n->c_q32, 1);
}

void dqw_normal_forget_q15(dqw_normal_q15 *n)
{
    for (int k = 0; k < 2; k++) halve(n);
}

void dqw_normal_add_q15(dqw_normal_q15 *n, const int32_t x_q28[], int32_t y_q28)
{
    // [NEQ.1] products to the sums: each below 2^62 in Q56, 2^38 in Q32
    int64_t *a = n->a_q32;
    bool full = false;
    for (int j = 0; j < n->inputs; j++) {
        for (int i = 0; i <= j; i++, a++) *a += dqw_q_round64((int64_t)x_q28[i] * x_q28[j], 24);
        full = full || dqw_q_bits64(a[-1]) > FULL_BITS;
        n->b_q32[j] += dqw_q_round64((int64_t)x_q28[j] * y_q28, 24);
    }
    n->c_q32 += dqw_q_round64((int64_t)y_q28 * y_q28, 24);
    if (full || dqw_q_bits64(n->c_q32) > FULL_BITS) halve(n);
}

void dqw_normal_grow_q15(dqw_normal_q15 *n, int i, int64_t q_q40)
{
    const int64_t own = n->a_q32[DQW_NORMAL_A(i, i)];
    if (q_q40 <= 0 || own <= 0) return;
    // A - a a' q / (1 + q a_ii) = A - a a' part / a_ii, part = q a_ii / (1 + q a_ii): in 0 .. 1.
    const int64_t size_q31 = dqw_q_product64(own, q_q40, -41);  // Q31, up to 2^62
    const int32_t part_q31 = dqw_q_quotient32(size_q31, size_q31 + ((int64_t)1 << 31), 31);
    int64_t column[N];
    for (int k = 0; k < n->inputs; k++) column[k] = n->a_q32[k < i ? DQW_NORMAL_A(k, i) : DQW_NORMAL_A(i, k)];
    const int64_t b = n->b_q32[i];
    int64_t *a = n->a_q32;
    for (int j = 0; j < n->inputs; j++) {
        // |column[j] / own| is up to 2^30 only where own is next to nothing: bounded by the product's own bound.
        const int64_t take_q31 = dqw_q_product64(dqw_q_quotient64(column[j], own, 31), part_q31, -31);
        for (int k = 0; k <= j; k++, a++) *a -= dqw_q_product64(take_q31, column[k], -31);
        n->b_q32[j] -= dqw_q_product64(take_q31, b, -31);
    }
}

// The sums with the target behind the inputs, factored: its row is what the inputs explain of it, and what is left.
typedef struct factors {
    int32_t l_q31[DQW_NORMAL_A(0, N + 1)];  // Cholesky's lower factor, row i: DQW_NORMAL_A(k, i), k <= i. |l| <= 1
    int half[N + 1];                        // sums scale by 2^half each way
    uint32_t out;
    int64_t left_q60;  // of the target
} factors;

static int half_of(int64_t own)
{
    // To 59 or 60 bits, by an even number of them.
    const int more = 60 - (int)dqw_q_bits64(own);
    return more >= 0 ? more / 2 : -((1 - more) / 2);
}

// Sum of i by j, 0 <= j <= i; the target's stand apart.
static int64_t sum_of(const dqw_normal_q15 *n, int i, int j)
{
    // cppcheck-suppress negativeIndex; j is 0 at least
    return i < n->inputs ? n->a_q32[DQW_NORMAL_A(j, i)] : j < i ? n->b_q32[j] : n->c_q32;
}

static void factor(const dqw_normal_q15 *n, factors *f)
{
    const int inputs = n->inputs;
    f->out = 0;
    for (int i = 0; i <= inputs; i++) {
        f->half[i] = half_of(sum_of(n, i, i));
        int32_t *row = &f->l_q31[DQW_NORMAL_A(0, i)];
        for (int j = 0; j <= i; j++) {
            const int32_t *above = &f->l_q31[DQW_NORMAL_A(0, j)];
            // Q60, below 2^60; each product is below 2^62 in Q62
            int64_t rest = dqw_q_scale64(sum_of(n, i, j), f->half[i] + f->half[j]);
            for (int k = 0; k < j; k++)
                rest = dqw_q_within64(rest - dqw_q_round64((int64_t)row[k] * above[k], 2), TWO_Q60);
            if (j < i) {
                row[j] = dqw_q_quotient32(rest, above[j], 2);
            } else if (i == inputs) {
                f->left_q60 = rest;
            } else if (rest < (int64_t)1 << (60 - PIVOT_BITS)) {
                row[i] = 0;
                f->out |= 1u << i;
            } else {
                row[i] = dqw_q31_sat((int64_t)dqw_q_root64((uint64_t)rest << 2));
            }
        }
    }
}

// z = L^-1 of a unit vector, Q20: its squares sum to a diagonal element of the inverse. Beyond 2^22 the weight is none.
static int64_t inverse_diagonal_q40(const factors *f, int inputs, int i)
{
    int64_t z_q20[N] = {0};
    int64_t sum_q40 = 0;
    for (int k = i; k < inputs; k++) {
        const int32_t *row = &f->l_q31[DQW_NORMAL_A(0, k)];
        int64_t rest_q51 = k == i ? (int64_t)1 << 51 : 0;
        // 2^62 and a product of 2^31 by less than 2^31
        for (int m = i; m < k; m++) rest_q51 = dqw_q_within64(rest_q51 - row[m] * z_q20[m], BOUND_Q20 * BOUND_Q20);
        z_q20[k] = dqw_q_quotient64(rest_q51, row[k], 0);  // 0 of a direction that was never learned
        if (z_q20[k] >= BOUND_Q20 || z_q20[k] <= -BOUND_Q20) return NOT_LEARNED;
        sum_q40 += z_q20[k] * z_q20[k];
        if (sum_q40 > BOUND_Q20 * BOUND_Q20) return NOT_LEARNED;
    }
    return sum_q40;
}

// t = L^-T y of the first so many. Q40, bounded to 2^17, which is beyond all that is learned, so that sums of them stay
// below 2^62.
static void back(const factors *f, int inputs, const int64_t y_q40[], int64_t t_q40[])
{
    for (int j = inputs - 1; j >= 0; j--) {
        int64_t rest_q40 = y_q40[j];
        for (int k = j + 1; k < inputs; k++) rest_q40 -= dqw_q_times64(t_q40[k], f->l_q31[DQW_NORMAL_A(j, k)], -31);
        t_q40[j] = dqw_q_within64(dqw_q_quotient64(rest_q40, f->l_q31[DQW_NORMAL_A(j, j)], 31), (int64_t)1 << 57);
    }
}

// Of a row of L: what an input, or the target, is of those before it.
static void explain(const factors *f, int i, int64_t t_q40[])
{
    int64_t y_q40[N] = {0};
    for (int j = 0; j < i; j++) y_q40[j] = (int64_t)f->l_q31[DQW_NORMAL_A(j, i)] * 512;
    back(f, i, y_q40, t_q40);
}

const int64_t dqw_normal_nought_q40[N] = {0};

void dqw_normal_solve_q15(const dqw_normal_q15 *n, const int64_t start_q40[], dqw_solution_q15 *s)
{
    factors f;
    int64_t t_q40[N];
    const int inputs = n->inputs;
    factor(n, &f);
    const int half_y = f.half[inputs];
    s->left_q32 = f.left_q60 > 0 ? dqw_q_scale64(f.left_q60, -2 * half_y) : 0;
    s->out = f.out;
    explain(&f, inputs, t_q40);
    for (int i = 0; i < inputs; i++) {
        const bool out = (f.out >> i & 1u) != 0;
        s->w_q40[i] = out ? start_q40[i] : dqw_q_scale64(t_q40[i], f.half[i] - half_y);
        // The sums were scaled from Q32 to Q60.
        const int64_t inverse_q40 = out ? NOT_LEARNED : inverse_diagonal_q40(&f, inputs, i);
        s->cov_q40[i] = inverse_q40 == NOT_LEARNED ? NOT_LEARNED : dqw_q_scale64(inverse_q40, 2 * f.half[i] - 28);
    }
    // A direction that was never learned has a part of others in it: those are not learned either.
    for (int i = 0; i < inputs; i++) {
        if ((f.out >> i & 1u) == 0) continue;
        explain(&f, i, t_q40);
        for (int j = 0; j < i; j++)
            if (t_q40[j] > TIE_Q40 || t_q40[j] < -TIE_Q40) s->cov_q40[j] = NOT_LEARNED;
    }
}

// y = L^-1 of a row, scaled as the sums are; by what power of two besides.
static int forth(const factors *f, int inputs, const int32_t x_q28[], int64_t y_q40[])
{
    int most = -200;
    for (int i = 0; i < inputs; i++) {
        const int bits = (int)dqw_q_bits64(x_q28[i]) + f->half[i];
        if (x_q28[i] != 0 && bits > most) most = bits;
    }
    for (int j = 0; j < inputs; j++) {
        int64_t rest_q40 = dqw_q_scale64(x_q28[j], 40 - most + f->half[j]);
        for (int k = 0; k < j; k++) rest_q40 -= dqw_q_times64(y_q40[k], f->l_q31[DQW_NORMAL_A(k, j)], -31);
        // 0 of a direction that was never learned. Sums of them stay below 2^62.
        y_q40[j] = dqw_q_within64(dqw_q_quotient64(rest_q40, f->l_q31[DQW_NORMAL_A(j, j)], 31), (int64_t)1 << 57);
    }
    return 40 - most;
}

void dqw_normal_alone_q15(const dqw_normal_q15 *n, int32_t x_q28[2][DQW_NORMAL_INPUTS])
{
    factors f;
    int64_t y_q40[N];
    int64_t t_q40[2][N];
    int up[2];
    const int inputs = n->inputs;
    factor(n, &f);
    for (int row = 0; row < 2; row++) {
        up[row] = forth(&f, inputs, x_q28[row], y_q40);
        back(&f, inputs, y_q40, t_q40[row]);
    }
    for (int i = 0; i < inputs; i++) {
        // 0 of one that was left out: so is what is over it. x was scaled by 2^half, P is by as much twice.
        const int64_t own_q40 = inverse_diagonal_q40(&f, inputs, i);
        for (int row = 0; row < 2; row++)
            x_q28[row][i] = own_q40 == NOT_LEARNED
                                ? 0
                                : dqw_q31_sat(dqw_q_quotient64(t_q40[row][i], own_q40, 40 - up[row] - f.half[i]));
    }
}
