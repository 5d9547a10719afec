// The example in examples/ fed with a log: on the target each row is an interrupt (PendSV), on the host a call. Both print the same lines.
#include <stdint.h>
#include <stdio.h>

#include "dqw_fault.h"
#include "foc_board.h"
#include "foc_monitor.h"

static FILE *rows;
static dqw_sample row;
static unsigned long events;

bool board_signals(dqw_sample *now, bool *limited)
{
    *now = row;
    *limited = false;
    return true;
}

// Here the interrupt comes only when it is called.
void board_interrupt(bool on) { (void)on; }

// Bits, not decimals: what differs in the last place shows.
static unsigned long bits(float x)
{
    union {
        float x;
        uint32_t u;
    } both = {x};
    return both.u;
}

void board_event(const dqw_monitor_event *e)
{
    events++;
    printf("event half %lu since %lu channel %d fault %d phase %d value %08lx confidence %08lx\n", (unsigned long)e->half, (unsigned long)e->since,
           (int)e->parameter, (int)e->fault.name, (int)e->fault.phase, bits(e->value), bits(e->fault.confidence));
}

#ifdef __arm__
void pendsv(void);
void pendsv(void) { foc_pwm_interrupt(); }

static void interrupt(void)
{
    *(volatile uint32_t *)0xE000ED04u = 1u << 28;
    __asm__ volatile("dsb \n isb" ::: "memory");
}
#else
static void interrupt(void) { foc_pwm_interrupt(); }
#endif

int main(int argc, char *argv[])
{
    rows = argc == 2 ? fopen(argv[1], "rb") : NULL;
    if (rows == NULL || !foc_monitor_start()) return 2;
    float x[6];
    unsigned long n = 0;
    while (fread(x, sizeof x, 1, rows) == 1) {
        row = dqw_sample_from_dq(x[0], x[1], x[2], x[3], x[4], x[5]);
        interrupt();
        foc_background();
        n++;
    }
    printf("%lu rows, %lu events, %s\n", n, events, foc_in_service() ? "in service" : "not in service");
    for (int i = 0; i < DQW_TRACK_WEIGHTS; i++) {
        float value;
        float sd;
        const bool valid = foc_parameter((enum dqw_tracker_weight)i, &value, &sd);
        printf("weight %d %s %08lx %08lx\n", i, valid ? "valid" : "not valid", bits(value), bits(sd));
    }
    return 0;
}
