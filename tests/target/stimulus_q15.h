// The drive's signals as a row of the fixed-point port, and its full scales.
#ifndef TARGET_STIMULUS_Q15_H
#define TARGET_STIMULUS_Q15_H

#include "dqw_q15.h"
#include "dqw_scale.h"
#include "target/stimulus.h"

#define STIMULUS_SCALE                                                                                                 \
    {                                                                                                                  \
        .v_full_mV = 1000 * STIMULUS_V, .i_full_mA = 1000 * STIMULUS_I, .w_full_mrad_s = 1000 * STIMULUS_W,            \
        .dt_ns = STIMULUS_DT_NS, .pole_pairs = STIMULUS_PAIRS                                                          \
    }

static inline dqw_sample_q15 stimulus_sample(const stimulus *s)
{
    const dqw_sample_q15 sample = dqw_sample_from_dq_q15(s->v_d_q15, s->v_q_q15, s->i_d_q15, s->i_q_q15, s->w_m_q15,
                                                         s->theta_e_turn);
    return sample;
}

/// Q15 times Q15, Q15, rounded: speed times current, as firmware makes an input of it.
static inline int16_t stimulus_product(int16_t a, int16_t b) { return dqw_q15_sat(dqw_q_round32(a * b, 15)); }

#endif
