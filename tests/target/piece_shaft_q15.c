// The shaft's sample in Q15, a soft friction with it; blocks are learned in the background.
#include "dqw_shaft_q15.h"
#include "target/board.h"
#include "target/piece.h"

static const dqw_shaft_q15_config config = {.scale = {1500000, 1000 * STIMULUS_W, 1000000},
                                            .J_gmm2 = 2000000,
                                            .B_nNms_rad = 1000000,
                                            .coulomb = true,
                                            .coulomb_width_urad_s = 1000000};
static dqw_shaft_q15 m;
static int16_t torque_q15, w_m_q15;
static bool limited;
const uint32_t piece_bytes = sizeof m;

void piece_start(void)
{
    if (dqw_shaft_init_q15(&m, &config) != DQW_OK) board_end("no shaft\n", 2);
}

// What turns the shaft here is the drive's current.
void piece_load(const stimulus *s)
{
    torque_q15 = s->i_q_q15;
    w_m_q15 = s->w_m_q15;
    limited = s->limited;
}

void piece_step(void) { (void)dqw_shaft_sample_q15(&m, torque_q15, w_m_q15, 0, limited); }

void piece_background(void) { (void)dqw_shaft_background_q15(&m); }
