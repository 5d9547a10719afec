#include "dqw_stage.h"

static uint16_t count_of(uint32_t blocks)
{
    return (uint16_t)(blocks == 0 ? 1u : blocks < UINT16_MAX ? blocks : UINT16_MAX);
}

void dqw_stage_init(dqw_stage *s, uint32_t threshold_ppm, uint32_t random_limit, uint32_t ordinal_blocks)
{
    const dqw_stage zero = {0};
    *s = zero;
    s->threshold_ppm = threshold_ppm;
    s->random_limit = count_of(random_limit);
    s->ordinal_blocks = count_of(ordinal_blocks);
}

static void enter(dqw_stage *s, enum dqw_stage_name name)
{
    s->name = name;
    s->blocks = 0;
}

static void go_back(dqw_stage *s, enum dqw_stage_back why, uint32_t residual_ppm)
{
    s->back = why;
    s->residual_ppm = residual_ppm;
    if (s->times_back < UINT16_MAX) s->times_back++;
    enter(s, DQW_STAGE_DOMAIN);
}

void dqw_stage_define(dqw_stage *s)
{
    if (s->name == DQW_STAGE_DOMAIN) enter(s, DQW_STAGE_RANDOM);
}

bool dqw_stage_step(dqw_stage *s, dqw_stage_input in)
{
    const enum dqw_stage_name before = s->name;
    if (s->blocks < UINT32_MAX) s->blocks++;
    switch (s->name) {
    case DQW_STAGE_DOMAIN: break;
    case DQW_STAGE_RANDOM:
        if (in.random_converged)
            enter(s, DQW_STAGE_ORDINAL);
        else if (s->blocks >= s->random_limit)
            go_back(s, DQW_BACK_NOT_CONVERGED, in.residual_ppm);
        break;
    case DQW_STAGE_ORDINAL:
        if (s->blocks < s->ordinal_blocks) break;
        if (in.residual_ppm <= s->threshold_ppm)
            enter(s, DQW_STAGE_IN_SERVICE);
        else
            go_back(s, DQW_BACK_THRESHOLD, in.residual_ppm);
        break;
    case DQW_STAGE_IN_SERVICE:
        if (in.residual_recent_ppm > s->threshold_ppm) go_back(s, DQW_BACK_LEFT_BAND, in.residual_recent_ppm);
        break;
    }
    return s->name != before;
}
