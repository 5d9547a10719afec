#include "dqw_gate.h"

static void count(uint32_t *c)
{
    if (*c < UINT32_MAX) (*c)++;
}

void dqw_gate_init(dqw_gate *g, uint32_t stale_limit)
{
    const dqw_gate zero = {0};
    *g = zero;
    g->stale_limit = stale_limit;
}

uint32_t dqw_gate_check(dqw_gate *g, dqw_gate_sample s)
{
    if (!s.finite) {
        count(&g->nonfinite);
        return DQW_EVENT_NONFINITE;
    }
    if (s.repeated)
        count(&g->repeats);
    else
        g->repeats = 0;
    if (s.saturated) {
        count(&g->saturated);
        return DQW_EVENT_SATURATED;
    }
    if (g->stale_limit != 0 && g->repeats >= g->stale_limit) {
        count(&g->stale);
        return DQW_EVENT_STALE;
    }
    count(&g->accepted);
    return 0;
}
