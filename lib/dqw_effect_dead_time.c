// dqw_effect_dead_time(): the law of a dead time that is an input of its own.
#include <math.h>
#include <stddef.h>

#include "dqw_effect.h"
#include "dqw_transform.h"

#if DQW_EFFECT_WEIGHTS > 0

// What each phase loses of one volt, turned to dq. (E51)
static dqw_dq law(float width_A, const dqw_sample *s)
{
    const float k = 1.0f / width_A;
    const dqw_dq i = {s->i_d_A, s->i_q_A};
    const dqw_abc phase = dqw_clarke_inverse(dqw_park_inverse(i, s->cosine, s->sine));
    const dqw_abc lost = {tanhf(k * phase.a), tanhf(k * phase.b), tanhf(k * phase.c)};
    return dqw_park(dqw_clarke(lost), s->cosine, s->sine);
}

void dqw_effect_dead_time(const dqw_effect *e, const dqw_sample *last, const dqw_sample *s, float d[], float q[])
{
    int at = 0;
    for (int k = 0; k < e->count; k++) {
        const dqw_effect_config *c = &e->list[k];
        const int weights = dqw_effect_weights_of(e, c->effect);
        if (c->effect == DQW_EFFECT_DEAD_TIME && weights > 0) {
            const dqw_dq now = law(c->shape[0], s);
            const dqw_dq before = last != NULL ? law(c->shape[0], last) : now;
            d[at] = 0.5f * (before.d + now.d);
            q[at] = 0.5f * (before.q + now.q);
        }
        at += weights;
    }
}

#else
typedef int dqw_effect_has_no_dead_time;
#endif
