// A firmware that does nothing but monitor, to see how much flash that takes. -DLEND: with stage 2's Random Learner. -DNOTHING: only
// the configuration, and what the compiler takes from its libraries, which any firmware has.
#include <math.h>
#include <string.h>

#include "foc_config.h"

volatile dqw_sample now;
volatile float told;
void _start(void);

#ifdef NOTHING
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
#else
static dqw_monitor m;
#ifdef LEND
static dqw_monitor_random lent;
#endif

void _start(void)
{
    dqw_monitor_event event;
#ifdef LEND
    dqw_monitor_random_init(&lent);
    (void)dqw_monitor_init(&m, &CONFIG, &lent);
#else
    (void)dqw_monitor_init(&m, &CONFIG, NULL);
#endif
    for (;;) {
        const dqw_sample s = now;
        (void)dqw_monitor_sample(&m, &s, false);
        if (dqw_monitor_background(&m, &event)) told = event.value;
    }
}
#endif
