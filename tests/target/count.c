// The counter: differences of the board's timer. What a reading itself takes is measured at the start and taken off,
// and blocks of known length are tried.
#include <stdbool.h>

#include "target/board.h"
#include "target/count.h"

static uint32_t begun, empty;

static uint32_t instructions(uint32_t ticks)
{
    return (uint32_t)(((uint64_t)ticks * INSTRUCTIONS + TICKS / 2u) / TICKS);
}

// 2 n + 1 instructions, of which n branches, and what the call takes.
__attribute__((naked, noinline)) static void loop(__attribute__((unused)) uint32_t n)
{
#ifdef __riscv
    __asm__ volatile("1: addi a0, a0, -1 \n bnez a0, 1b \n ret");
#else
    __asm__ volatile(".syntax unified \n 1: subs r0, r0, #1 \n bne 1b \n bx lr");
#endif
}

__attribute__((noinline, noclone)) static uint32_t looped(uint32_t n)
{
    count_start();
    loop(n);
    return count_stop();
}

void count_calibrate(void)
{
    board_timer_on();
    empty = 0;
    count_start();
    empty = count_stop();

    bool exact = true;
    for (uint32_t n = 1; n <= 64; n++) exact = exact && looped(n) - looped(1) == 2u * (n - 1u);
    exact = exact && looped(100000) - looped(1) == 199998u;
    count_start();
    __asm__ volatile("nop \n nop \n nop \n nop \n nop \n nop \n nop \n nop");
    const uint32_t nops = count_stop();
    if (!exact || nops != 8u) board_end("count: not exact: QEMU must run with -icount shift=10\n", 98);
}

__attribute__((noinline)) void count_start(void) { begun = board_ticks(); }

__attribute__((noinline)) uint32_t count_stop(void) { return instructions(board_ticks() - begun) - empty; }
