// The drive's signals as a row of the float library.
#ifndef TARGET_STIMULUS_FLOAT_H
#define TARGET_STIMULUS_FLOAT_H

#include "dqw_sample.h"
#include "target/stimulus.h"

static inline dqw_sample stimulus_float(const stimulus *s)
{
    const float v_V = (float)STIMULUS_V / 32768;
    const float i_A = (float)STIMULUS_I / 32768;
    return dqw_sample_from_dq((float)s->v_d_q15 * v_V, (float)s->v_q_q15 * v_V, (float)s->i_d_q15 * i_A,
                              (float)s->i_q_q15 * i_A, (float)s->w_m_q15 * ((float)STIMULUS_W / 32768),
                              (float)s->theta_e_turn * (6.2831853f / 65536));
}

#endif
