// The interrupt's step of the condition monitor in float, with the example's configuration and without memory for stage 2.
#include "dqw_monitor.h"
#include "foc_config.h"
#include "target/board.h"
#include "target/piece.h"

static dqw_monitor m;
static dqw_sample sample;
static bool limited;
const uint32_t piece_bytes = sizeof m;

void piece_start(void)
{
    if (dqw_monitor_init(&m, &CONFIG, NULL) != DQW_OK) board_end("no monitor\n", 2);
}

void piece_load(const stimulus *s)
{
    sample.v_d_V = (float)s->v_d_q15 * ((float)STIMULUS_V / 32768);
    sample.v_q_V = (float)s->v_q_q15 * ((float)STIMULUS_V / 32768);
    sample.i_d_A = (float)s->i_d_q15 * ((float)STIMULUS_I / 32768);
    sample.i_q_A = (float)s->i_q_q15 * ((float)STIMULUS_I / 32768);
    sample.w_m_rad_s = (float)s->w_m_q15 * ((float)STIMULUS_W / 32768);
    sample.theta_e_rad = (float)s->theta_e_turn * (6.2831853f / 65536);
    limited = s->limited;
}

void piece_step(void) { (void)dqw_monitor_sample(&m, &sample, limited); }

void piece_background(void)
{
    dqw_monitor_event event;
    (void)dqw_monitor_background(&m, &event);
}
