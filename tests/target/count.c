// QEMU's clock moves on by 2^shift ns an instruction under `-icount shift=...`; a timer of the board reads that clock. Its tick is
// 40 ns, so shift 0 would show one tick in 40 instructions. With shift 7 an instruction is 128 ns = 3.2 ticks: the difference of
// two readings is wrong by less than a tick, less than a third of an instruction, and rounding gives the exact number.
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

#include "target/count.h"

// Ticks per instruction as a fraction: 128 ns / 40 ns.
#define TICKS 16u
#define INSTRUCTIONS 5u

// What the calibration tries.
#define KNOWN 1601u

// The board's timer 0: counts down, 32 bits.
typedef struct timer {
    uint32_t control, value, reload;
} timer;
#define TIMER ((volatile timer *)0x40000000u)

static bool ready;
static uint32_t begun, empty;

static uint32_t instructions(uint32_t ticks) { return (uint32_t)(((uint64_t)ticks * INSTRUCTIONS + TICKS / 2u) / TICKS); }

static void calibrate(void)
{
    ready = true;
    TIMER->control = 0;
    TIMER->reload = UINT32_MAX;
    TIMER->value = UINT32_MAX;
    TIMER->control = 1;
    empty = 0;
    count_start();
    empty = count_stop();

    count_start();
    __asm__ volatile("movw r0, #800 \n 1: subs r0, r0, #1 \n bne 1b" ::: "r0", "cc");
    const uint32_t counted = count_stop();
    if (counted != KNOWN) {
        (void)fprintf(stderr, "count: %u for %u instructions: QEMU must run with -icount shift=7\n", (unsigned)counted, KNOWN);
        exit(98);
    }
}

__attribute__((noinline)) void count_start(void)
{
    if (!ready) calibrate();
    begun = TIMER->value;
}

__attribute__((noinline)) uint32_t count_stop(void) { return instructions(begun - TIMER->value) - empty; }
