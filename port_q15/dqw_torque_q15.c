#include "dqw_torque_q15.h"
#include "dqw_effect_kind.h"

#include <stdbool.h>
#include <stddef.h>

#include "dqw_q15.h"
#include "dqw_scale.h"
#include "dqw_transform_q15.h"

// 2 / ln 2 and 1 / sqrt(ln 2).
#define TWO_PER_LN2_Q28 774541002
#define PER_ROOT_LN2_Q28 322423842
// A width may be so many times narrower than the full scale, that is four last places, and so many times wider.
#define NARROW 8192
#define WIDE 16
#define PERIODS_MAX 1000u
#define ONE_Q16 65536u

// w_full over a speed, times a factor: Q15 or Q16. 0 outside the range of a width.
static uint32_t per_speed(uint32_t speed_urad_s, uint32_t w_full_mrad_s, int32_t factor_q28, int bits)
{
    if (w_full_mrad_s > DQW_SCALE_MAX) return 0;
    const int64_t full_urad_s = (int64_t)w_full_mrad_s * 1000;
    if ((int64_t)speed_urad_s * NARROW < full_urad_s || speed_urad_s > WIDE * full_urad_s) return 0;
    // 10^10 2^29.6 < 2^63
    return (uint32_t)dqw_q_quotient64(full_urad_s * factor_q28, speed_urad_s, bits - 28);
}

uint32_t dqw_soft_rate_q15(uint32_t width_urad_s, uint32_t w_full_mrad_s)
{
    return per_speed(width_urad_s, w_full_mrad_s, TWO_PER_LN2_Q28, 16);
}

static uint32_t size_of(int16_t x)
{
    return (uint32_t)(x < 0 ? -x : x);
}

// 2^-t, Q16, for t < 16 in Q15: 1 - f (c1 - f (c2 - f (c3 - f c4))) of the fraction, halved as often as the whole part
// says.
static uint32_t half_to_the(uint32_t t_q15)
{
    const uint32_t f_q16 = (t_q15 & 32767u) << 1;
    // Every product is below 2^32 less the rounding.
    const uint32_t s3_q20 = 56773u - ((f_q16 * 30743u + (1u << 17)) >> 18);
    const uint32_t s2_q18 = 62904u - ((f_q16 * s3_q20 + (1u << 17)) >> 18);
    const uint32_t s1_q16 = 45426u - ((f_q16 * s2_q18 + (1u << 17)) >> 18);
    const uint32_t p_q16 = ONE_Q16 - ((f_q16 * s1_q16 + (1u << 15)) >> 16);
    const unsigned halvings = t_q15 >> 15;
    return (p_q16 + ((1u << halvings) >> 1)) >> halvings;
}

// tanh(|w| / width), Q15.
static uint32_t soft(uint32_t rate_q16, uint32_t size_q15)
{
    // rate |w| < 2^31 2^15
    const uint32_t t_q15 = (uint32_t)dqw_q_mul32x16((int32_t)rate_q16, size_q15, 16);
    if (t_q15 >= 16u << 15) return 32768u;
    const uint32_t e_q16 = half_to_the(t_q15);
    // The inverse is rounded down: half a place more is its middle. 32767 (2^17 + 1) < 2^32 - 2^16
    const uint32_t inverse_q17 = 2u * dqw_q16_inverse((ONE_Q16 + e_q16 + 1u) >> 1) + 1u;
    return (((ONE_Q16 - e_q16) >> 1) * inverse_q17 + (1u << 16)) >> 17;
}

int32_t dqw_soft_sign_q15(uint32_t rate_q16, int16_t w_q15)
{
    const int32_t s_q15 = (int32_t)soft(rate_q16, size_of(w_q15));
    return w_q15 < 0 ? -s_q15 : s_q15;
}

// exp(-(w / fall)^2), Q16.
static uint32_t fallen(uint32_t fall_q15, uint32_t size_q15)
{
    const uint32_t u_q14 = (uint32_t)dqw_q_mul32x16((int32_t)fall_q15, size_q15, 16);
    return u_q14 > 65535u ? 0u : half_to_the((u_q14 * u_q14) >> 13);
}

enum dqw_status dqw_torque_init_q15(dqw_torque_q15 *t, const dqw_torque_q15_config *config, uint32_t w_full_mrad_s)
{
    if (t == NULL || config == NULL) return DQW_ERR_NULL;
    const dqw_torque_q15_config *c = config;
    if (!dqw_effect_is_mechanical(c->effect)) return DQW_ERR_RANGE;
    const bool falls = c->effect == DQW_EFFECT_STRIBECK_FRICTION;
    const bool cogs = c->effect == DQW_EFFECT_COGGING_TORQUE;
    const bool friction = !cogs && c->effect != DQW_EFFECT_LOAD_TORQUE;
    dqw_torque_q15 n = {.effect = (uint8_t)c->effect};
    if (friction) n.rate_q16 = dqw_soft_rate_q15(c->width_urad_s, w_full_mrad_s);
    if (falls) n.fall_q15 = per_speed(c->fall_urad_s, w_full_mrad_s, PER_ROOT_LN2_Q28, 15);
    if (cogs) n.periods = c->periods;
    if ((friction && n.rate_q16 == 0) || (falls && n.fall_q15 == 0) ||
        (cogs && (n.periods < 1u || n.periods > PERIODS_MAX)))
        return DQW_ERR_RANGE;
    *t = n;
    return DQW_OK;
}

void dqw_torque_at_q15(const dqw_torque_q15 *t, int16_t w_m_q15, uint16_t theta_m_turn, int32_t x_q15[])
{
    const uint32_t size_q15 = size_of(w_m_q15);
    switch (t->effect) {
    case DQW_EFFECT_COULOMB_FRICTION: x_q15[0] = dqw_soft_sign_q15(t->rate_q16, w_m_q15); break;
    case DQW_EFFECT_DIRECTION_ASYMMETRY: x_q15[0] = (int32_t)soft(t->rate_q16, size_q15); break;
    case DQW_EFFECT_STRIBECK_FRICTION: {
        // 2^15 2^16 and the rounding are below 2^32
        const int32_t s_q15 = (int32_t)((soft(t->rate_q16, size_q15) * fallen(t->fall_q15, size_q15) + (1u << 15)) >>
                                        16);
        x_q15[0] = w_m_q15 < 0 ? -s_q15 : s_q15;
        break;
    }
    case DQW_EFFECT_COGGING_TORQUE: {
        int16_t cosine;
        int16_t sine;
        dqw_cosine_sine_q15((uint16_t)((uint32_t)t->periods * theta_m_turn), &cosine, &sine);
        x_q15[0] = cosine;
        x_q15[1] = sine;
        break;
    }
    case DQW_EFFECT_LOAD_TORQUE:
    default: x_q15[0] = 32768; break;
    }
}
