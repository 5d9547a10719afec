// The example in examples/ fed with a log: on the target each row is an interrupt (PendSV), on the host a call. Both
// print the same lines.
//   firmware ROWS [STORE_AT AGAIN_FROM]    STORE_AT: row at which it stores; AGAIN_FROM: row from which the log goes on
//   after a power cycle
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dqw_text.h"
#include "foc_board.h"
#include "foc_monitor.h"
#include "target/foc_rows.h"

// Every so often there is no sample.
#define MISSING_EVERY 1009u

static foc_rows rows;
static board_signals signals;
static unsigned long row;
static unsigned char flash[sizeof(dqw_monitor_stored)];
static size_t flash_bytes;

bool board_sample(board_signals *now)
{
    *now = signals;
    return row % MISSING_EVERY != 0;
}

// Here the interrupt comes only when it is called.
void board_interrupt(bool on) { (void)on; }

bool board_flash_read(void *to, size_t size)
{
    if (flash_bytes != size) return false;
    (void)memcpy(to, flash, size);
    return true;
}

void board_flash_write(const void *from, size_t size)
{
    (void)memcpy(flash, from, size);
    flash_bytes = size;
}

// Bits, not decimals: what differs in the last place shows.
static unsigned long bits(float x)
{
    union {
        float x;
        uint32_t u;
    } both = {x};
    return both.u;
}

void board_say(const char *what, const char *which, float value, float healthy)
{
    printf("row %lu %s: %s %08lx, healthy %08lx\n", row, what, which, bits(value), bits(healthy));
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

static bool run(FILE *log, long from, unsigned long store_at)
{
    row = (unsigned long)from;
    if (!foc_rows_begin(&rows, log, from) || !foc_monitor_start()) return false;
    for (; foc_rows_next(&rows, &signals); row++) {
        interrupt();
        foc_background();
        if (row == store_at) foc_store();
    }
    printf("%lu rows, %s\n", row - (unsigned long)from, dqw_why_text(foc_why()));
    for (int i = 0; i < DQW_WATCH_CHANNELS; i++) {
        const dqw_reading r = foc_parameter((enum dqw_monitor_channel)i);
        printf("%s %s %08lx %08lx\n", dqw_parameter_text((enum dqw_monitor_channel)i),
               r.usable ? "usable" : "not usable", bits(r.value), bits(r.sd));
    }
    return true;
}

int main(int argc, char *argv[])
{
    FILE *log = argc == 2 || argc == 4 ? fopen(argv[1], "rb") : NULL;
    if (!run(log, 0, argc == 4 ? strtoul(argv[2], NULL, 10) : 0)) return 2;
    if (argc != 4) return 0;
    printf("power cycle, %lu bytes stored\n", (unsigned long)flash_bytes);
    return run(log, strtol(argv[3], NULL, 10), 0) ? 0 : 2;
}
