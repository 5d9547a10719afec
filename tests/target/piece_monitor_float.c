// The interrupt's step of the condition monitor in float, with the example's configuration, dead time and angle on, without memory for stage 2.
#include "dqw_monitor.h"
#include "foc_config.h"
#include "target/board.h"
#include "target/piece.h"
#include "target/stimulus_float.h"

static dqw_monitor m;
static dqw_sample sample;
static bool limited;
const uint32_t piece_bytes = sizeof m;

void piece_start(void)
{
    if (dqw_monitor_init(&m, &CONFIG) != DQW_OK) board_end("no monitor\n", 2);
}

void piece_load(const stimulus *s)
{
    sample = stimulus_float(s);
    limited = s->limited;
}

void piece_step(void) { (void)dqw_monitor_sample(&m, &sample, limited); }

void piece_background(void)
{
    dqw_monitor_change change;
    if (dqw_monitor_background(&m)) (void)dqw_monitor_event(&m, &change);
}
