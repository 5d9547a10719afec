// A firmware that does nothing but monitor, to see how much flash that takes: init, sample, background, event. -DLENT:
// with stage 2's Random
// Learner; -DSTORED: with store and restore; -DEXAMPLE: the calls of examples/foc_monitor.c, texts and all. -DNOTHING:
// only the configuration, and what the compiler takes from its libraries, which any firmware has.
#include <math.h>
#include <string.h>

#include "dqw_estimator_random.h"
#include "foc_board.h"
#include "foc_config.h"
#include "foc_monitor.h"

volatile dqw_sample now;
volatile float told;
void _start(void);

#if defined(NOTHING)
volatile size_t size;
const dqw_monitor_config *volatile config;

void _start(void)
{
    static char bytes[64];
    static char more[64];
    config = &CONFIG;
    memcpy(bytes, more, size);
    memset(more, bytes[0], size);
    for (;;) told = (float)more[0] + sqrtf(now.v_d_V) + fmaxf(now.v_q_V, now.i_d_A) + fminf(now.i_q_A, now.w_m_rad_s);
}

#elif defined(EXAMPLE)
volatile const void *said;

bool board_sample(board_signals *s)
{
    s->limited = false;
    return now.v_d_V > 0.0f;
}
void board_interrupt(bool on) { told = on ? 1.0f : 0.0f; }
void board_say(const char *what, const char *which, float value, float healthy)
{
    said = what;
    said = which;
    told = value;
    told = healthy;
}
bool board_flash_read(void *to, size_t size)
{
    said = to;
    return size == 0;
}
void board_flash_write(const void *from, size_t size)
{
    (void)size;
    said = from;
}

void _start(void)
{
    (void)foc_monitor_start();
    for (;;) {
        foc_pwm_interrupt();
        foc_background();
        told = foc_parameter(DQW_WATCH_R).value + (float)foc_why();
        foc_store();
    }
}

#else
static dqw_monitor m;
#ifdef LENT
static dqw_estimator_random lent;
static dqw_monitor_config with_lent;
#endif
#ifdef STORED
static volatile dqw_monitor_stored flash;
#endif

static void start(void)
{
#ifdef LENT
    with_lent = CONFIG;
    with_lent.estimator.random = &lent;
    dqw_estimator_random_init(&lent);
    (void)dqw_monitor_init(&m, &with_lent);
#else
    (void)dqw_monitor_init(&m, &CONFIG);
#endif
}

void _start(void)
{
    dqw_monitor_change change;
    start();
#ifdef STORED
    dqw_monitor_stored stored = flash;
    (void)dqw_monitor_restore(&m, &stored);
#endif
    for (;;) {
        const dqw_sample s = now;
        (void)dqw_monitor_sample(&m, &s, false);
        if (dqw_monitor_background(&m) && dqw_monitor_event(&m, &change)) told = change.value;
#ifdef STORED
        if (dqw_monitor_store(&m, &stored)) flash = stored;
#endif
    }
}
#endif
