// The interrupt's step of the condition monitor in float, with the example's configuration, but with a voltage that acts now; its background beside
// it. LENT: with memory for stage 2; STORED: with store and restore.
#include "dqw_estimator_random.h"
#include "dqw_monitor.h"
#include "foc_config.h"
#include "target/board.h"
#include "target/piece.h"
#include "target/stimulus_float.h"

static dqw_monitor_config config;
static dqw_monitor m;
static dqw_sample sample;
static bool limited;
#ifdef LENT
static dqw_estimator_random lent;
#endif
#ifdef STORED
static dqw_monitor_stored stored;
#endif
const uint32_t piece_bytes = sizeof m;

void piece_start(void)
{
    config = CONFIG;
    config.estimator.voltage_next = config.estimator.voltage_held = false;
#ifdef LENT
    dqw_estimator_random_init(&lent);
    config.estimator.random = &lent;
#endif
    if (dqw_monitor_init(&m, &config) != DQW_OK) board_end("no monitor\n", 2);
#ifdef STORED
    (void)dqw_monitor_restore(&m, &stored);
#endif
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
#ifdef STORED
    (void)dqw_monitor_store(&m, &stored);
#endif
}
