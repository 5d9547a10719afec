#include "dqw_witness.h"

#include <math.h>

#include "dqw_estimator_block.h"
#include "dqw_number.h"

// Electrical angle that a block's half must turn by: less, and what one phase's current leaves about nought is taken for
// a ripple; and where twice that is too much for one block.
#define SLOWEST_RAD 0.08f
#define FASTEST_RAD 1.2f
// A block teaches no more than twice what one of mean power does: in the longest turn of a ripple, 39 blocks, a quarter
// of a weight. In less than a turn, as where the shaft is turned round by strong currents, what stands still in the
// magnet's frame passes for a ripple.
#define STRONG_PART 0.5f

typedef struct {
    float re, im;
} complex_number;

static complex_number product(complex_number a, complex_number b)
{
    const complex_number c = {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
    return c;
}

void dqw_witness_init(dqw_witness *w)
{
    const dqw_witness zero = {0};
    *w = zero;
}

// What a triangle over two halves leaves of a ripple that turns by `turn` in half of it.
static float left_of(float turn_rad)
{
    const float x2 = 0.25f * turn_rad * turn_rad;
    const float sinc = 1.0f - x2 * (1.0f / 6.0f) * (1.0f - x2 * (1.0f / 20.0f) * (1.0f - x2 * (1.0f / 42.0f)));
    return sinc * sinc;
}

bool dqw_witness_learn(dqw_witness *w, const dqw_estimator *e, const dqw_estimator_block *block)
{
    const dqw_estimator_config *c = e->config;
    const dqw_block b = dqw_estimator_means(e, block);
    const float w_e = (float)e->pole_pairs * b.w_m_rad_s;
    const float turn = fabsf(w_e) * c->dt_s * (float)e->window.half;
    if (!dqw_is_direction(block->cosine, block->sine) || !(turn > SLOWEST_RAD) || !(turn < FASTEST_RAD)) return false;

    // [WIT.1] inputs at the middle of the block
    const complex_number once = {block->cosine, -block->sine};
    const float R = dqw_estimator_value(e, DQW_R);
    const float L = 0.5f * (dqw_estimator_value(e, DQW_LD) + dqw_estimator_value(e, DQW_LQ));
    const float induced = w_e * dqw_estimator_value(e, DQW_PSI);
    const float left = left_of(2.0f * turn);
    complex_number twice = product(once, once);
    twice.re *= left;
    twice.im *= left;
    const complex_number conjugate = {b.i_d_A, -b.i_q_A};
    const complex_number with_current = product(twice, conjugate);
    const complex_number impedance = {w_e * L, R};  // j (R - j w_e L)
    const complex_number shorted = product(twice, impedance);
    const float first = -R * left_of(turn);
    const complex_number x[DQW_WITNESS_INPUTS] = {
        {first * once.re, first * once.im},
        with_current,
        {-w_e * with_current.im, w_e * with_current.re},
        {induced * shorted.re, induced * shorted.im},
    };

    // [WIT.2] the shared error
    complex_number error = {e->e_pu[0] * c->v_base_V, e->e_pu[1] * c->v_base_V};
    for (int k = 0; k < DQW_WITNESS_INPUTS; k++) {
        const complex_number weight = {w->re[k], w->im[k]};
        const complex_number said = product(weight, x[k]);
        error.re -= said.re;
        error.im -= said.im;
    }

    if (!dqw_is_finite(error.re + error.im)) return false;

    // [WIT.3] each weight by its own mean power
    if (w->blocks < DQW_WITNESS_MEMORY) w->blocks++;
    const float part = 1.0f / (float)w->blocks;
    for (int k = 0; k < DQW_WITNESS_INPUTS; k++) {
        const float power = x[k].re * x[k].re + x[k].im * x[k].im;
        w->power[k] += (power - w->power[k]) * part;
        // Reactance's input is resistance's, turned by 90 degrees, times the speed.
        if (k == DQW_WITNESS_RESISTANCE) w->across += (w_e * power - w->across) * part;
        if (!(w->power[k] > 0.0f) || w->blocks < DQW_WITNESS_FIRST) continue;
        const float least = STRONG_PART * power;
        const float step = 1.0f / ((float)DQW_WITNESS_MEMORY * (w->power[k] > least ? w->power[k] : least));
        w->re[k] += step * (x[k].re * error.re + x[k].im * error.im);
        w->im[k] += step * (x[k].re * error.im - x[k].im * error.re);
    }
    return true;
}

float dqw_witness_size(const dqw_witness *w, enum dqw_witness_input input)
{
    return sqrtf(w->re[input] * w->re[input] + w->im[input] * w->im[input]);
}

float dqw_witness_speed(const dqw_witness *w)
{
    const float power = w->power[DQW_WITNESS_RESISTANCE];
    return power > 0.0f ? w->across / power : 0.0f;
}

float dqw_witness_sd(const dqw_witness *w, const dqw_estimator *e, enum dqw_witness_input input)
{
    float power = w->power[input];
    if (input == DQW_WITNESS_REACTANCE) power -= dqw_witness_speed(w) * w->across;
    if (w->blocks < DQW_WITNESS_MEMORY || !(power > 0.0f)) return DQW_UNKNOWN;
    const float noise = (e->error_pu2[0] + e->error_pu2[1]) * (0.25f / (float)DQW_WITNESS_MEMORY);
    const float variance = noise + dqw_estimator_witness_pu2(e);
    return e->config->v_base_V * sqrtf(variance / power);
}
