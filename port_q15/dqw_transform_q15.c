#include "dqw_transform_q15.h"

#include <stdbool.h>

#include "dqw_q15.h"

// 1/3 in Q16, less 1/3 of a last place.
#define THIRD_Q16 21845
// 1/sqrt(3) in Q15 is 18918.614, that is 18919 less 0.386.
#define INV_SQRT3_Q15 18919
// sqrt(3)/2 in Q15 is 28377.92.
#define HALF_SQRT3_Q15 28378

dqw_alphabeta_q15 dqw_clarke_q15(dqw_abc_q15 x)
{
    // |zero| <= 98304, and its product < 2^31 - 2^15
    const int32_t zero = x.a + x.b + x.c;
    const int32_t side = x.b - x.c;
    const int32_t beta_q30 = side * INV_SQRT3_Q15 - dqw_q_floor32(3 * side, 3);
    const dqw_alphabeta_q15 y = {dqw_q15_sat(x.a - dqw_q_round32(zero * THIRD_Q16, 16)),
                                 dqw_q15_sat(dqw_q_round32(beta_q30, 15))};
    return y;
}

dqw_abc_q15 dqw_clarke_inverse_q15(dqw_alphabeta_q15 x)
{
    const int32_t half_q30 = x.alpha * -(1 << 14);
    const int32_t side_q30 = x.beta * HALF_SQRT3_Q15;  // |half| + |side| < 1.4 * 2^30
    const dqw_abc_q15 y = {x.alpha, dqw_q15_sat(dqw_q_round32(half_q30 + side_q30, 15)),
                           dqw_q15_sat(dqw_q_round32(half_q30 - side_q30, 15))};
    return y;
}

// a b + c d, rounded once: the sum of two products may need 33 bits.
static int16_t turned(int16_t a, int16_t b, int16_t c, int16_t d)
{
    return dqw_q15_sat((int32_t)dqw_q_round64((int64_t)a * b + (int64_t)c * d, 15));
}

// No int16_t is the negative of -32768: the sum of two products is small enough where it is subtracted.
static int16_t turned_back(int16_t a, int16_t b, int16_t c, int16_t d)
{
    return dqw_q15_sat((int32_t)dqw_q_round64((int64_t)a * b - (int64_t)c * d, 15));
}

dqw_dq_q15 dqw_park_q15(dqw_alphabeta_q15 x, int16_t cos_q15, int16_t sin_q15)
{
    const dqw_dq_q15 y = {turned(cos_q15, x.alpha, sin_q15, x.beta), turned_back(cos_q15, x.beta, sin_q15, x.alpha)};
    return y;
}

dqw_alphabeta_q15 dqw_park_inverse_q15(dqw_dq_q15 x, int16_t cos_q15, int16_t sin_q15)
{
    const dqw_alphabeta_q15 y = {turned_back(cos_q15, x.d, sin_q15, x.q), turned(sin_q15, x.d, cos_q15, x.q)};
    return y;
}

dqw_dq_q15 dqw_park_paper_q15(dqw_alphabeta_q15 x, int16_t cos_q15, int16_t sin_q15)
{
    const dqw_dq_q15 y = {turned_back(cos_q15, x.alpha, sin_q15, x.beta), turned(cos_q15, x.beta, sin_q15, x.alpha)};
    return y;
}

void dqw_cosine_sine_q15(uint16_t theta_turn, int16_t *cos_q15, int16_t *sin_q15)
{
    // Quarter turns, and what is left of them as u: -1 .. 1 is an eighth of a turn either way.
    const uint32_t n = ((uint32_t)theta_turn + 8192u) >> 14;
    const int32_t u_q13 = (int32_t)theta_turn - (int32_t)(n << 14);
    const int32_t u2_q15 = dqw_q_round32(u_q13 * u_q13, 11);  // 0 .. 2^15
    // sin = u (pi/4 - u2 (c3 - u2 (c5 - u2 c7))), c_k = (pi/4)^k / k!; every product < 2^31
    const int32_t s5_q20 = 2611 - dqw_q_round32(u2_q15 * 38, 15);
    const int32_t s3_q18 = 21167 - dqw_q_round32(u2_q15 * s5_q20, 17);
    const int32_t s1_q17 = 102944 - dqw_q_round32(u2_q15 * s3_q18, 16);
    // cos = 1 - u2 (c2 - u2 (c4 - u2 (c6 - u2 c8)))
    const int32_t c6_q22 = 1367 - dqw_q_round32(u2_q15 * 15, 15);
    const int32_t c4_q20 = 16624 - dqw_q_round32(u2_q15 * c6_q22, 17);
    const int32_t c2_q17 = 40426 - dqw_q_round32(u2_q15 * c4_q20, 18);
    const int32_t s = dqw_q_round32(u_q13 * s1_q17, 15);
    const int32_t c = 32768 - dqw_q_round32(u2_q15 * c2_q17, 17);
    const bool swap = (n & 1u) != 0;
    const int32_t a = swap ? s : c;
    const int32_t b = swap ? c : s;
    *cos_q15 = dqw_q15_sat(((n + 1u) & 2u) != 0 ? -a : a);
    *sin_q15 = dqw_q15_sat((n & 2u) != 0 ? -b : b);
}
