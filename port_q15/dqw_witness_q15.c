#include "dqw_witness_q15.h"

#include "dqw_q15.h"
#include "dqw_estimator_block_q15.h"

// Electrical angle that a block's half must turn by, 0.08 and 1.2 rad: less, and what one phase's current leaves about
// nought is taken for a ripple; and where twice that is too much for one block.
#define SLOWEST_Q28 21474836
#define FASTEST_Q28 322122547
#define ONE_Q28 268435456
// A block teaches no more than twice what one of mean power does: in the longest turn of a ripple, 39 blocks, a quarter
// of a weight. In less than a turn, as where the shaft is turned round by strong currents, what stands still in the
// magnet's frame passes for a ripple.
#define STRONG_SHIFT 1

// Q30 of 1, Q28 of a full scale, or Q26 of the full voltage.
typedef struct {
    int32_t re, im;
} complex_number;

// a b 2^-n
static void multiply(complex_number *a, const complex_number *b, int n)
{
    // Each below 2^31 by 2^30
    const int64_t re = (int64_t)a->re * b->re - (int64_t)a->im * b->im;
    const int64_t im = (int64_t)a->re * b->im + (int64_t)a->im * b->re;
    a->re = dqw_q31_sat(dqw_q_scale64(re, -n));
    a->im = dqw_q31_sat(dqw_q_scale64(im, -n));
}

// Inputs up to 16 full voltages, more than nominal parameters take of full signals; errors up to 4. So products of two
// have a bit to spare.
static int32_t bounded(int64_t x)
{
    return (int32_t)dqw_q_within64(x, (int64_t)1 << 30);
}

// a by 2^-n, bounded.
static void scale(complex_number *a, int64_t by, int n)
{
    a->re = bounded(dqw_q_times64(by, a->re, -n));
    a->im = bounded(dqw_q_times64(by, a->im, -n));
}

void dqw_witness_init_q15(dqw_witness_q15 *w)
{
    const dqw_witness_q15 zero = {.blocks = 0};
    *w = zero;
}

// What a triangle over two halves leaves of a ripple that turns by `turn`, up to 2.4 rad, in half of it. Q28
static int64_t left_of(int64_t turn_q28)
{
    const int32_t x2_q28 = (int32_t)dqw_q_round64(turn_q28 * turn_q28, 30);  // up to 1.5
    const int64_t by_42 = ONE_Q28 - x2_q28 / 42;
    const int64_t by_20 = ONE_Q28 - dqw_q_round64((int64_t)(x2_q28 / 20) * by_42, 28);
    const int64_t sinc = ONE_Q28 - dqw_q_round64((int64_t)(x2_q28 / 6) * by_20, 28);
    return dqw_q_round64(sinc * sinc, 28);
}

int64_t dqw_witness_short_q40(const dqw_estimator_q15_config *config)
{
    dqw_units_q15 n;
    (void)dqw_units_of_q15(config, config->scale.pole_pairs, &n);
    return dqw_q_quotient64(n.R_q40, n.R_q40 + dqw_q_floor64(n.X_q40[0] + n.X_q40[1], 1), 40);
}

int32_t dqw_witness_mean_L_q24(const dqw_estimator_q15_config *config, int32_t Ld_q24, int32_t Lq_q24)
{
    dqw_units_q15 u;
    (void)dqw_units_of_q15(config, config->scale.pole_pairs, &u);
    const int64_t both_q40 = dqw_q_times64(u.L_q40[0], Ld_q24, -24) + dqw_q_times64(u.L_q40[1], Lq_q24, -24);
    // Halves: each alone may be 2^62.
    return dqw_q_quotient32(dqw_q_floor64(both_q40, 1), dqw_q_floor64(u.L_q40[0], 1) + dqw_q_floor64(u.L_q40[1], 1),
                            24);
}

// What one unit of each weight adds to the block's voltage, Q26.
static void inputs(const dqw_estimator_q15 *t, const dqw_estimator_q15_block *block, const dqw_block_q15 *b,
                   int64_t turn_q28, complex_number x[])
{
    dqw_units_q15 n;
    (void)dqw_units_of_q15(t->config, t->pole_pairs, &n);
    const int32_t *w = t->w_q24;
    const int32_t w_q28 = b->w_m;
    const int64_t R_q40 = dqw_q_times64(n.R_q40, w[DQW_R], -24);
    const int64_t X_nominal_q40 = dqw_q_floor64(n.X_q40[0] + n.X_q40[1], 1);
    const int64_t L_q40 = dqw_q_times64(n.X_q40[0], w[DQW_LD], -25) + dqw_q_times64(n.X_q40[1], w[DQW_LQ], -25);

    const complex_number once = {block->with.cosine_q15 * 32768, -block->with.sine_q15 * 32768};  // Q30
    complex_number *offset = &x[DQW_WITNESS_OFFSET];
    *offset = once;
    scale(offset, -dqw_q_product64(R_q40, left_of(turn_q28), -28), 44);

    complex_number twice = once;
    multiply(&twice, &once, 30);
    scale(&twice, left_of(2 * turn_q28), 28);
    complex_number *resistance = &x[DQW_WITNESS_RESISTANCE];
    resistance->re = b->i_d;
    resistance->im = -b->i_q;
    multiply(resistance, &twice, 30);  // Q28
    complex_number turned = *resistance;
    scale(resistance, n.R_q40, 42);
    scale(&turned, dqw_q_times64(X_nominal_q40, w_q28, -28), 42);
    x[DQW_WITNESS_REACTANCE].re = -turned.im;
    x[DQW_WITNESS_REACTANCE].im = turned.re;

    // e j (R - j w_e L), of nominal R and reactance together: up to the weights themselves, which are below 64
    const int64_t both_q40 = n.R_q40 + X_nominal_q40;
    complex_number *shorted = &x[DQW_WITNESS_SHORT];
    shorted->re = dqw_q_quotient32(dqw_q_times64(L_q40, w_q28, -28), both_q40, 24);
    shorted->im = dqw_q_quotient32(R_q40, both_q40, 24);
    multiply(shorted, &twice, 30);
    scale(shorted, dqw_q_times64(dqw_q_times64(n.psi_q40, w[DQW_PSI], -24), w_q28, -28), 38);
}

static void toward(int32_t *weight_q28, int64_t x, int64_t by)
{
    *weight_q28 = dqw_q31_sat(*weight_q28 + dqw_q_quotient64(x, by, 16));
}

bool dqw_witness_learn_q15(dqw_witness_q15 *w, const dqw_estimator_q15 *t, const dqw_estimator_q15_block *block)
{
    const dqw_block_q15 b = dqw_estimator_means_q15(block);
    const int64_t turn_q28 = dqw_q_size64(dqw_q_times64((int64_t)t->turn_q28 * t->window.half, b.w_m, -28));
    if (t->pole_pairs == 0 || !dqw_scale_is_direction(block->with.cosine_q15, block->with.sine_q15) ||
        turn_q28 <= SLOWEST_Q28 || turn_q28 >= FASTEST_Q28)
        return false;

    // [WIT.1] inputs at the middle of the block
    complex_number x[DQW_WITNESS_INPUTS];
    inputs(t, block, &b, turn_q28, x);

    // [WIT.2] the shared error
    complex_number error = {t->e_q28[0], t->e_q28[1]};
    for (int k = 0; k < DQW_WITNESS_INPUTS; k++) {
        complex_number said = {w->re_q28[k], w->im_q28[k]};
        multiply(&said, &x[k], 26);
        error.re = bounded((int64_t)error.re - said.re);
        error.im = bounded((int64_t)error.im - said.im);
    }

    // [WIT.3] each weight by its own mean power
    if (w->blocks < DQW_WITNESS_MEMORY) w->blocks++;
    for (int k = 0; k < DQW_WITNESS_INPUTS; k++) {
        const complex_number *at = &x[k];
        const int64_t power = (int64_t)at->re * at->re + (int64_t)at->im * at->im;
        int64_t mean = w->power_q52[k];
        mean += dqw_q_product64(power - mean, (1u << 31) / w->blocks, -31);
        w->power_q52[k] = mean;
        if (mean <= 0 || w->blocks < DQW_WITNESS_FIRST) continue;
        const int64_t least = dqw_q_floor64(power, STRONG_SHIFT);
        const int64_t by = dqw_q_times64(mean > least ? mean : least, DQW_WITNESS_MEMORY, -10);  // Q42
        // Q54 over Q42
        toward(&w->re_q28[k], (int64_t)at->re * error.re + (int64_t)at->im * error.im, by);
        toward(&w->im_q28[k], (int64_t)at->re * error.im - (int64_t)at->im * error.re, by);
    }
    const complex_number *of = &x[DQW_WITNESS_RESISTANCE];
    const complex_number *with = &x[DQW_WITNESS_REACTANCE];
    const int64_t across = (int64_t)with->im * of->re - (int64_t)with->re * of->im;
    w->across_q52 += dqw_q_product64(across - w->across_q52, (1u << 31) / w->blocks, -31);
    return true;
}

int32_t dqw_witness_size_q28(const dqw_witness_q15 *w, enum dqw_witness_input input)
{
    return dqw_q_length32(w->re_q28[input], w->im_q28[input]);
}

int32_t dqw_witness_speed_q24(const dqw_witness_q15 *w)
{
    return dqw_q_quotient32(w->across_q52, w->power_q52[DQW_WITNESS_RESISTANCE], 24);
}

int32_t dqw_witness_sd_q28(const dqw_witness_q15 *w, const dqw_estimator_q15 *t, enum dqw_witness_input input)
{
    int64_t power_q52 = w->power_q52[input];
    if (input == DQW_WITNESS_REACTANCE) power_q52 -= dqw_q_times64(w->across_q52, dqw_witness_speed_q24(w), -24);
    if (w->blocks < DQW_WITNESS_MEMORY || power_q52 <= 0) return INT32_MAX;
    const int64_t noise_q56 = dqw_q_quotient64(t->error_q56[0] + t->error_q56[1], 4 * (int64_t)DQW_WITNESS_MEMORY, 0);
    const int64_t v_q56 = dqw_q_quotient64(noise_q56 + dqw_estimator_witness_q56(t), power_q52, 52);
    return dqw_q31_sat(dqw_q_root64((uint64_t)v_q56));
}
