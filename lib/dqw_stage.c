#include "dqw_stage.h"

#define THRESHOLD_PPM 50000u

void dqw_stage_init(dqw_stage *s, uint32_t threshold_ppm)
{
    const dqw_stage zero = {0};
    *s = zero;
    s->threshold_ppm = threshold_ppm != 0 ? threshold_ppm : THRESHOLD_PPM;
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

bool dqw_stage_step(dqw_stage *s, bool random_converged, uint32_t residual_ppm)
{
    const enum dqw_stage_name before = s->name;
    if (s->blocks < UINT32_MAX) s->blocks++;
    switch (s->name) {
    case DQW_STAGE_DOMAIN: break;
    case DQW_STAGE_RANDOM:
        if (random_converged)
            enter(s, DQW_STAGE_ORDINAL);
        else if (s->blocks >= DQW_STAGE_RANDOM_BLOCKS)
            go_back(s, DQW_BACK_NOT_CONVERGED, residual_ppm);
        break;
    case DQW_STAGE_ORDINAL:
        if (s->blocks < DQW_STAGE_ORDINAL_BLOCKS) break;
        if (residual_ppm <= s->threshold_ppm)
            enter(s, DQW_STAGE_IN_SERVICE);
        else
            go_back(s, DQW_BACK_THRESHOLD, residual_ppm);
        break;
    case DQW_STAGE_IN_SERVICE:
        if (residual_ppm > s->threshold_ppm) go_back(s, DQW_BACK_LEFT_BAND, residual_ppm);
        break;
    }
    return s->name != before;
}

bool dqw_stage_forgets(uint32_t blocks)
{
    // All of them while stage 3 is not judged.
    return blocks == 50u || blocks == 100u || blocks == 200u || blocks == 400u;
}
