// A log's rows as the example's board gives them: currents of this row, and the voltage of the next one, which the
// controller decides now, in the stationary frame. The same on every machine, to the last bit.
#ifndef TARGET_FOC_ROWS_H
#define TARGET_FOC_ROWS_H

#include <stdbool.h>
#include <stdio.h>

#include "dqw_transform.h"
#include "foc_board.h"
#include "foc_config.h"

typedef struct foc_row {
    float v_d_V, v_q_V, i_d_A, i_q_A, w_m_rad_s, theta_e_rad;
} foc_row;

typedef struct foc_rows {
    FILE *file;
    foc_row now, next;
} foc_rows;

static inline bool foc_rows_read(foc_rows *r)
{
    r->now = r->next;
    return fread(&r->next, sizeof r->next, 1, r->file) == 1;
}

/// From row `from` on.
static inline bool foc_rows_begin(foc_rows *r, FILE *file, long from)
{
    r->file = file;
    return file != NULL && fseek(file, from * (long)sizeof r->next, SEEK_SET) == 0 && foc_rows_read(r);
}

/// The next row. False: the log is at its end.
static inline bool foc_rows_next(foc_rows *r, board_signals *s)
{
    if (!foc_rows_read(r)) return false;
    // A voltage of the rotating frame, as a mean over its period, is the one held at the period's middle.
    const float half_turn = 0.5f * CONFIG.estimator.dt_s * (float)CONFIG.estimator.pole_pairs;
    float cosine;
    float sine;
    dqw_cosine_sine(r->next.theta_e_rad + half_turn * r->next.w_m_rad_s, &cosine, &sine);
    const dqw_dq v_dq = {r->next.v_d_V, r->next.v_q_V};
    const dqw_alphabeta v = dqw_park_inverse(v_dq, cosine, sine);
    dqw_cosine_sine(r->now.theta_e_rad, &s->cosine, &s->sine);
    const dqw_dq i_dq = {r->now.i_d_A, r->now.i_q_A};
    const dqw_alphabeta i = dqw_park_inverse(i_dq, s->cosine, s->sine);
    s->v_alpha_V = v.alpha;
    s->v_beta_V = v.beta;
    s->i_alpha_A = i.alpha;
    s->i_beta_A = i.beta;
    s->w_m_rad_s = r->now.w_m_rad_s;
    s->limited = false;
    return true;
}

#endif
