// The shaft's sample in float, a soft friction with it; blocks are learned in the background.
#include "dqw_shaft.h"
#include "target/board.h"
#include "target/piece.h"

static const dqw_shaft_config config = {.dt_s = 1e-3f,
                                        .torque_base_Nm = 1.5f,
                                        .w_base_rad_s = STIMULUS_W,
                                        .J_kgm2 = 2e-3f,
                                        .B_Nms_rad = 1e-3f,
                                        .coulomb = true,
                                        .coulomb_width_rad_s = 1};
static dqw_shaft shaft;
static float torque_Nm, w_m_rad_s;
static bool limited;
const uint32_t piece_bytes = sizeof shaft;

void piece_start(void)
{
    if (dqw_shaft_init(&shaft, &config) != DQW_OK) board_end("no shaft\n", 2);
}

// What turns the shaft here is the drive's current.
void piece_load(const stimulus *s)
{
    torque_Nm = (float)s->i_q_q15 * (1.5f / 32768);
    w_m_rad_s = (float)s->w_m_q15 * ((float)STIMULUS_W / 32768);
    limited = s->limited;
}

void piece_step(void) { (void)dqw_shaft_sample(&shaft, torque_Nm, w_m_rad_s, 0, limited); }

void piece_background(void) { (void)dqw_shaft_background(&shaft); }
