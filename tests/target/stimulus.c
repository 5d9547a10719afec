// The walk, the machine, and what spoils it.
#include "target/stimulus.h"

// Q12, per unit of the full scales: R = 0.6 ohm, L / T of 0.9 and 1.6 mH, their reactances at full speed, psi = 18 mVs.
#define R_Q12 1053
#define LD_T_Q12 31598
#define LQ_T_Q12 56174
#define XD_Q12 1390
#define XQ_Q12 2472
#define PSI_Q12 2317
// Turns of 2^32 a period at full speed, over 2^15.
#define TURN 918

void stimulus_start(stimulus *s)
{
    const stimulus fresh = {.seed = 2463534242u};
    *s = fresh;
}

uint32_t stimulus_bits(stimulus *s)
{
    s->seed ^= s->seed << 13;
    s->seed ^= s->seed >> 17;
    s->seed ^= s->seed << 5;
    return s->seed;
}

int64_t stimulus_any(stimulus *s)
{
    const uint32_t how = stimulus_bits(s);
    const uint64_t x = (((uint64_t)stimulus_bits(s) << 32) | stimulus_bits(s)) >> (1u + how % 63u);
    return how >> 31 != 0 ? -(int64_t)x : (int64_t)x;
}

// -size .. size - 1
static int32_t drawn(stimulus *s, int32_t size) { return (int32_t)(stimulus_bits(s) % (2u * (uint32_t)size)) - size; }

static int16_t noisy(stimulus *s, int32_t x)
{
    x += drawn(s, 4);
    return (int16_t)(x > 32767 ? 32767 : x < -32768 ? -32768 : x);
}

static void spoil(stimulus *s)
{
    int16_t *const channel[] = {&s->v_d_q15, &s->v_q_q15, &s->i_d_q15, &s->i_q_q15, &s->w_m_q15};
    s->limited = s->n % 991 == 0;
    if (s->n % 977 == 0) *channel[s->n / 977 % 5] = s->n / 977 % 2 == 0 ? 32767 : -32768;
    if (s->n % 5000 > 4700)
        for (int i = 0; i < 5; i++) *channel[i] = 0;
    if (s->n % 2500 > 2480)
        for (int i = 0; i < 5; i++) *channel[i] = (int16_t)drawn(s, 32768);
}

void stimulus_next(stimulus *s)
{
    if (s->n % 64 == 0) s->to_d = drawn(s, 12000);
    if (s->n % 64 == 32) s->to_q = drawn(s, 16000);
    if (s->n % 1024 == 0) s->to_w = drawn(s, 20000);
    const int32_t d = s->d_q23 / 256;
    const int32_t q = s->q_q23 / 256;
    const int32_t w = s->w_q23 / 256;
    s->i_d_q15 = noisy(s, d);
    s->i_q_q15 = noisy(s, q);
    s->w_m_q15 = noisy(s, w);
    s->theta_e_turn = (uint16_t)(s->theta >> 16);
    s->d_q23 += (s->to_d * 256 - s->d_q23) / 64;
    s->q_q23 += (s->to_q * 256 - s->q_q23) / 64;
    s->w_q23 += (s->to_w * 256 - s->w_q23) / 512;
    s->theta += (uint32_t)(w * TURN);
    // The voltage between this sample and the next: currents in the middle of them, in 1/512 of Q15.
    const int64_t d2 = (int64_t)s->d_q23 + d * 256;
    const int64_t q2 = (int64_t)s->q_q23 + q * 256;
    const int64_t v_d = R_Q12 * d2 + LD_T_Q12 * 2 * ((int64_t)s->d_q23 - d * 256) - XQ_Q12 * (w * q2 / 32768);
    const int64_t v_q = R_Q12 * q2 + LQ_T_Q12 * 2 * ((int64_t)s->q_q23 - q * 256) + XD_Q12 * (w * d2 / 32768) +
                        (int64_t)PSI_Q12 * 512 * w;
    s->v_d_q15 = noisy(s, (int32_t)(v_d / (512 * 4096)));
    s->v_q_q15 = noisy(s, (int32_t)(v_q / (512 * 4096)));
    s->n++;
    spoil(s);
}
