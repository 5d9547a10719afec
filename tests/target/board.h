// A board's timer, as QEMU has it. QEMU's clock moves on by 1024 ns an instruction under `-icount shift=10`, and the
// timer reads that clock:
// TICKS of the timer are INSTRUCTIONS. A tick is far shorter than an instruction, so rounding the difference of two
// readings is exact.
#ifndef TARGET_BOARD_H
#define TARGET_BOARD_H

#include <stdint.h>

#define BOARD_REGISTER(address) (*(volatile uint32_t *)(uintptr_t)(address))

#if defined(__riscv)
// virt: mtime of the CLINT, 10 MHz, always on.
#define TICKS 256u
#define INSTRUCTIONS 25u
static inline void board_timer_on(void) {}
static inline uint32_t board_ticks(void) { return BOARD_REGISTER(0x0200BFF8); }

#elif defined(__ARM_ARCH_6M__)
// microbit: TIMER0 of the nRF51, 16 MHz. Writing CAPTURE[0] copies the counter to CC[0].
#define TICKS 2048u
#define INSTRUCTIONS 125u
static inline void board_timer_on(void)
{
    BOARD_REGISTER(0x40008508) = 3u;  // BITMODE: 32
    BOARD_REGISTER(0x40008510) = 0u;  // PRESCALER: none
    BOARD_REGISTER(0x40008000) = 1u;  // START
}
static inline uint32_t board_ticks(void)
{
    BOARD_REGISTER(0x40008040) = 1u;
    return BOARD_REGISTER(0x40008540);
}

#elif defined(__ARM_ARCH)
// mps2: timer 0 counts down. 25 MHz on an385 and an386; 20 MHz on an505, at its secure address.
#if defined(__ARM_ARCH_8M_MAIN__)
#define BOARD_TIMER 0x50000000u
#define TICKS 512u
#define INSTRUCTIONS 25u
#else
#define BOARD_TIMER 0x40000000u
#define TICKS 128u
#define INSTRUCTIONS 5u
#endif
static inline void board_timer_on(void)
{
    BOARD_REGISTER(BOARD_TIMER) = 0u;
    BOARD_REGISTER(BOARD_TIMER + 8u) = UINT32_MAX;
    BOARD_REGISTER(BOARD_TIMER + 4u) = UINT32_MAX;
    BOARD_REGISTER(BOARD_TIMER) = 1u;
}
static inline uint32_t board_ticks(void) { return ~BOARD_REGISTER(BOARD_TIMER + 4u); }
#endif

/// Prints and ends the program with a status. The start-up code has it.
void board_end(const char *message, uint32_t status);

#endif
