// A sample whose voltage acts later, or is held in the stationary frame, or whose speed is electrical.
#include "dqw_estimator_block.h"
#include "dqw_number.h"

// An angle that a voltage turns by in one and a half periods: where it is more, nobody controls the current.
#define TURN_MOST 1.0f

void dqw_estimator_adapt(dqw_estimator *e, const dqw_sample *s, dqw_sample *x)
{
    const dqw_estimator_config *c = e->config;
    *x = *s;
    if (c->speed_electrical) x->w_m_rad_s /= (float)c->pole_pairs;
    if (c->voltage_next) {
        x->v_d_V = e->commanded ? e->command_d_V : 0.0f;
        x->v_q_V = e->commanded ? e->command_q_V : 0.0f;
        e->command_d_V = s->v_d_V;
        e->command_q_V = s->v_q_V;
        x->resting = e->command_resting;
        e->command_resting = s->resting;
    }
    if (c->voltage_held) {
        float turn = (c->voltage_next ? 1.5f : 0.5f) * (float)c->pole_pairs * x->w_m_rad_s * c->dt_s;
        turn = turn > TURN_MOST ? TURN_MOST : turn < -TURN_MOST ? -TURN_MOST : turn;
        // To 3e-5 within half a radian; and less by the sine of half a period's angle over that angle, the mean of what
        // turns by. (E89)
        const float turn2 = turn * turn;
        const float mean = 1.0f - turn2 * (c->voltage_next ? 1.0f / 54.0f : 1.0f / 6.0f);
        const float cosine = mean * (1.0f - turn2 * (0.5f - turn2 * (1.0f / 24.0f)));
        const float sine = mean * turn * (1.0f - turn2 * (1.0f / 6.0f - turn2 * (1.0f / 120.0f)));
        const float v_d = x->v_d_V;
        x->v_d_V = cosine * v_d + sine * x->v_q_V;
        x->v_q_V = cosine * x->v_q_V - sine * v_d;
    }
}

bool dqw_sample_finite(const dqw_sample *came, const dqw_sample *s)
{
    return dqw_is_finite(came->v_d_V) && dqw_is_finite(came->v_q_V) && dqw_is_finite(s->i_d_A) &&
           dqw_is_finite(s->i_q_A) && dqw_is_finite(s->w_m_rad_s);
}
