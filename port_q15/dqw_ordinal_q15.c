#include "dqw_ordinal_q15.h"

#include <stddef.h>

#include "dqw_log_q15.h"
#include "dqw_q15.h"
#include "dqw_scale.h"

// 0.01 and 0.9995
#define POLE_MIN_Q31 21474836
#define POLE_MAX_Q31 2146409906
// Moved by no more than this part: 1e-4.
#define CONVERGED 10000
// Epochs without rest after which a start is given up: from a good one it takes two to five.
#define RESTLESS_MAX 10
// Longest step of the pole in an epoch: 0.2.
#define STEP_MAX_Q31 429496730
// Step of the constant input's weight: 0.05.
#define WATCH_Q16 3277
// Bound of what is 8 in Q27 and 2048 in Q19.
#define WIDE ((int64_t)1 << 30)
// Pairs that 64 bits hold: products are below 2^30, of the sensitivities below 2^45.
#define PAIRS_MAX ((uint32_t)1 << 31)
#define OUTPUT_MAX ((uint32_t)1 << 18)

static int64_t clamp(int64_t x, int64_t low, int64_t high)
{
    return x < low ? low : x > high ? high : x;
}

enum dqw_status dqw_ordinal_init_q15(dqw_ordinal_q15 *o, const dqw_ordinal_config_q15 *config)
{
    if (o == NULL || config == NULL) return DQW_ERR_NULL;
    if (config->dt_ns < 1 || config->dt_ns > 1000000000u || config->R_uohm < 1 || config->L_nH < 1)
        return DQW_ERR_RANGE;
    if (config->x_full_mV < 1 || config->x_full_mV > 10000000u || config->y_full_mA < 1 ||
        config->y_full_mA > 10000000u)
        return DQW_ERR_RANGE;
    const int64_t h_q40 = dqw_q_quotient64((int64_t)config->R_uohm * config->dt_ns, (int64_t)config->L_nH * 1000000,
                                           40);
    const int64_t less_q31 = dqw_q_round64(dqw_one_less_exp_q40(h_q40), 9);
    const int64_t a_q31 = clamp(((int64_t)1 << 31) - less_q31, POLE_MIN_Q31, POLE_MAX_Q31);
    const int64_t volts = dqw_q_product64(((int64_t)1 << 31) - a_q31, (int64_t)config->x_full_mV * 1000000, -20);
    const int64_t b_q27 = dqw_q_quotient64(volts, (int64_t)config->R_uohm * config->y_full_mA, 16);
    if (b_q27 < 1 << 15 || b_q27 > 1 << 29) return DQW_ERR_RANGE;
    const dqw_ordinal_q15 zero = {0};
    *o = zero;
    o->dt_ns = config->dt_ns;
    o->x_full_mV = config->x_full_mV;
    o->y_full_mA = config->y_full_mA;
    o->form = (uint8_t)config->form;
    o->discretisation = (uint8_t)config->discretisation;
    o->a_q31 = (int32_t)a_q31;
    o->b_q27 = (int32_t)b_q27;
    o->from_pairs = true;
    return DQW_OK;
}

static void watch(dqw_ordinal_q15 *o, int64_t e_q27)
{
    o->w_o_q27 += (int32_t)dqw_q_round64((e_q27 - o->w_o_q27) * WATCH_Q16, 16);  // |e| <= 10, and so |w_o| <= 10 < 16
}

static void sum_up(dqw_ordinal_q15 *o, int32_t x0, int32_t x1, int32_t e, uint32_t most)
{
    if (o->summed >= most) return;
    o->sum[0] += (int64_t)x0 * x0;
    o->sum[1] += (int64_t)x0 * x1;
    o->sum[2] += (int64_t)x1 * x1;
    o->sum[3] += (int64_t)x0 * e;
    o->sum[4] += (int64_t)x1 * e;
    o->summed++;
}

// [OL.1] learn b and a themselves from measured pairs
static void learn_pair(dqw_ordinal_q15 *o, int16_t x_q15, int16_t y_q15)
{
    const int64_t y_q27 = dqw_q_round64((int64_t)o->b_q27 * x_q15, 15) +
                          dqw_q_round64((int64_t)o->a_q31 * o->y_last_q15, 19);
    // The change of y in the place of y: it gives a - 1, and keeps its digits where the pole is near 1
    sum_up(o, x_q15, o->y_last_q15, y_q15 - o->y_last_q15, PAIRS_MAX);
    watch(o, (int64_t)y_q15 * (1 << 12) - y_q27);
}

// [OL.2] with b and a held for the epoch, learn their correction from the neuron's own output and its sensitivities
static void learn_output(dqw_ordinal_q15 *o, int16_t x_q15, int16_t y_q15)
{
    const int64_t y_before_q27 = o->y_hat_q27;
    const int64_t y_hat_q27 = dqw_q_round64(o->a_q31 * y_before_q27, 31) + dqw_q_round64((int64_t)o->b_q27 * x_q15, 15);
    const int64_t s_b_q19 = dqw_q_round64((int64_t)o->a_q31 * o->s_q19[0], 31) + (int64_t)x_q15 * (1 << 4);
    const int64_t s_a_q19 = dqw_q_round64((int64_t)o->a_q31 * o->s_q19[1], 31) + dqw_q_round64(y_before_q27, 8);
    o->y_hat_q27 = (int32_t)clamp(y_hat_q27, -WIDE, WIDE);
    o->s_q19[0] = (int32_t)clamp(s_b_q19, -WIDE, WIDE);
    o->s_q19[1] = (int32_t)clamp(s_a_q19, -WIDE, WIDE);
    const int32_t e_q27 = y_q15 * (1 << 12) - o->y_hat_q27;  // |e_q27| <= 9 * 2^27
    // In Q11 and Q19: |s| <= 2^22, |e| < 2^23
    sum_up(o, dqw_q_round32(o->s_q19[0], 8), dqw_q_round32(o->s_q19[1], 8), dqw_q_round32(e_q27, 8), OUTPUT_MAX);
    watch(o, e_q27);
}

void dqw_ordinal_step_q15(dqw_ordinal_q15 *o, int16_t x_q15, int16_t y_q15)
{
    if (dqw_scale_beyond(x_q15) || dqw_scale_beyond(y_q15)) {
        if (o->skipped < UINT32_MAX) o->skipped++;
        o->started = false;
        return;
    }
    if (o->started) {
        // The first epoch learns from pairs in either form: a start for the output error that is near enough to be
        // linear.
        if (o->form == DQW_ORDINAL_PAIRS_Q15 || o->from_pairs)
            learn_pair(o, o->x_last_q15, y_q15);
        else
            learn_output(o, o->x_last_q15, y_q15);
        if (o->learned < UINT32_MAX) o->learned++;
    } else {
        o->y_hat_q27 = y_q15 * (1 << 12);
        o->s_q19[0] = o->s_q19[1] = 0;
        o->started = true;
    }
    o->x_last_q15 = x_q15;
    o->y_last_q15 = y_q15;
}

static int more(int a, int b)
{
    return a > b ? a : b;
}

// Two equations in two unknowns: out[i] = solution[i] 2^q[i]. False where the sums do not tell the two apart.
static bool solve(const int64_t sum[5], const int q[2], int64_t out[2])
{
    // Each unknown by its own power of two, the right side by a third: then all have 30 bits.
    const int p0 = more(0, ((int)dqw_q_bits64(sum[0]) - 29) / 2);
    const int p1 = more(0, ((int)dqw_q_bits64(sum[2]) - 29) / 2);
    const int64_t a00 = dqw_q_scale64(sum[0], -2 * p0);
    const int64_t a01 = dqw_q_scale64(sum[1], -p0 - p1);
    const int64_t a11 = dqw_q_scale64(sum[2], -2 * p1);
    const int t = more((int)dqw_q_bits64(sum[3]) - p0, (int)dqw_q_bits64(sum[4]) - p1) - 30;
    const int64_t r0 = dqw_q_scale64(sum[3], -p0 - t);
    const int64_t r1 = dqw_q_scale64(sum[4], -p1 - t);
    const int64_t det = a00 * a11 - a01 * a01;  // < 2^60
    if (det <= dqw_q_floor64(a00 * a11, 22)) return false;
    out[0] = dqw_q_quotient64(a11 * r0 - a01 * r1, det, t - p0 + q[0]);  // |numerator| < 2^61
    out[1] = dqw_q_quotient64(a00 * r1 - a01 * r0, det, t - p1 + q[1]);
    return true;
}

bool dqw_ordinal_end_epoch_q15(dqw_ordinal_q15 *o)
{
    if (o->epochs < UINT32_MAX) o->epochs++;
    o->started = false;
    const bool pairs = o->form == DQW_ORDINAL_PAIRS_Q15;

    // [OL.3] what the epoch says of both weights
    const bool of_pairs = pairs || o->from_pairs;
    static const int of_pairs_q[] = {27, 31};
    static const int of_output_q[] = {27 - 8, 31 - 8};
    int64_t found[2];
    const bool solved = solve(o->sum, of_pairs ? of_pairs_q : of_output_q, found);
    // A Gauss-Newton step is kept short, and the pole inside a passive circuit's range: the neuron's own output then
    // stays bounded, and far from the truth, where the linearisation overshoots, the next epoch can come back.
    int64_t a_q31 = o->a_q31;
    int64_t b_q27 = o->b_q27;
    if (solved && of_pairs) {
        a_q31 = ((int64_t)1 << 31) + found[1];
        b_q27 = found[0];
    } else if (solved) {
        a_q31 += clamp(found[1], -STEP_MAX_Q31, STEP_MAX_Q31);
        b_q27 = clamp(b_q27 + found[0], b_q27 / 10, 10 * b_q27);
    }
    a_q31 = clamp(a_q31, POLE_MIN_Q31, POLE_MAX_Q31);
    b_q27 = clamp(b_q27, -WIDE, WIDE);
    const bool inside = b_q27 > 0 && a_q31 > POLE_MIN_Q31 && a_q31 < POLE_MAX_Q31;
    const int64_t moved_a = a_q31 < o->a_q31 ? o->a_q31 - a_q31 : a_q31 - o->a_q31;
    const int64_t moved_b = b_q27 < o->b_q27 ? o->b_q27 - b_q27 : b_q27 - o->b_q27;
    const bool still = solved && moved_a * CONVERGED <= o->a_q31 && moved_b * CONVERGED <= b_q27;
    o->converged = pairs || (!o->from_pairs && inside && still);
    // [OL.4] from which weights, and how, the next epoch learns
    // Pairs that say what no passive circuit can are no start; nor is one from which no epoch comes to rest. Learn from
    // pairs again.
    const bool done_with_pairs = o->from_pairs && solved && inside;
    o->restless = still || o->from_pairs ? 0 : (uint8_t)(o->restless + 1);
    if (done_with_pairs) o->from_pairs = false;
    // The next epoch counts anew.
    if (o->restless >= RESTLESS_MAX) o->from_pairs = true;
    o->a_q31 = (int32_t)a_q31;
    o->b_q27 = (int32_t)b_q27;
    if (!pairs) {
        o->summed = 0;
        for (int i = 0; i < 5; i++) o->sum[i] = 0;
    }
    return o->converged;
}

// x_full / y_full v in micro-ohm, v in Q30.
static int64_t of_full(const dqw_ordinal_q15 *o, int64_t v_q30)
{
    return dqw_q_quotient64(dqw_q_product64(v_q30, (int64_t)o->x_full_mV * 1000000, -20), o->y_full_mA, -10);
}

// L / dt v in micro-ohm, v in Q30.
static int64_t of_slope(const dqw_ordinal_q15 *o, uint32_t L_nH, int64_t v_q30)
{
    return dqw_q_quotient64(dqw_q_product64(v_q30, (int64_t)L_nH * 1000000, -20), o->dt_ns, -10);
}

int32_t dqw_ordinal_R_from_x_q15(const dqw_ordinal_q15 *o, uint32_t L_nH)
{
    if (o->b_q27 <= 0) return 0;
    if (o->discretisation == DQW_ORDINAL_BACKWARD_Q15)
        return dqw_q31_sat(of_full(o, dqw_q_quotient64((int64_t)1 << 27, o->b_q27, 30)) -
                           of_slope(o, L_nH, (int64_t)1 << 30));
    return dqw_q31_sat(of_full(o, dqw_q_quotient64(((int64_t)1 << 31) - o->a_q31, o->b_q27, 26)));
}

int32_t dqw_ordinal_R_from_y_q15(const dqw_ordinal_q15 *o, uint32_t L_nH)
{
    if (o->a_q31 <= 0) return 0;
    if (o->discretisation == DQW_ORDINAL_BACKWARD_Q15)
        return dqw_q31_sat(of_slope(o, L_nH, dqw_q_quotient64(((int64_t)1 << 31) - o->a_q31, o->a_q31, 30)));
    return dqw_q31_sat(of_slope(o, L_nH, dqw_q_round64(dqw_minus_log_q40(o->a_q31), 10)));
}
