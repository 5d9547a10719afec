// From reset to main without a C library, on Cortex-M and on RISC-V, and what a compiler calls by itself. Output and
// end by semihosting.
#include <stddef.h>
#include <stdint.h>

#include "target/board.h"
#include "target/count.h"
#include "target/say.h"

// Semihosting calls.
#define SYS_WRITE0 0x04
#define SYS_EXIT_EXTENDED 0x20
#define APPLICATION_EXIT 0x20026u
#define FAULT_STATUS 99u

extern uint32_t data_start[], data_end[], bss_start[], bss_end[], stack_top[];
extern uint32_t data_load[];
extern int main(void);
void reset(void);
void *memcpy(void *restrict to, const void *restrict from, size_t n);
void *memset(void *to, int c, size_t n);

__attribute__((noinline)) static void host(int call, const void *block)
{
#ifdef __riscv
    register int a0 __asm__("a0") = call;
    register const void *a1 __asm__("a1") = block;
    __asm__ volatile(
        ".balign 16 \n .option push \n .option norvc \n slli x0, x0, 0x1f \n ebreak \n srai x0, x0, 7 \n .option pop"
        : "+r"(a0)
        : "r"(a1)
        : "memory");
#else
    register int r0 __asm__("r0") = call;
    register const void *r1 __asm__("r1") = block;
    __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
#endif
}

void say_text(const char *text) { host(SYS_WRITE0, text); }

void board_end(const char *message, uint32_t status)
{
    const uint32_t how[] = {APPLICATION_EXIT, status};
    say_text(message);
    host(SYS_EXIT_EXTENDED, how);
    for (;;) {}
}

__attribute__((used)) static void die(void) { board_end("fault\n", FAULT_STATUS); }

__attribute__((used, noreturn)) static void start(void)
{
#ifdef __ARM_FP
    BOARD_REGISTER(0xE000ED88) |= 0xFu << 20;
    __asm__ volatile("dsb \n isb" ::: "memory");
#endif
    const uint32_t *from = data_load;
    for (uint32_t *to = data_start; to < data_end; to++) *to = *from++;
    for (uint32_t *to = bss_start; to < bss_end; to++) *to = 0;
    count_calibrate();
    board_end("", (uint32_t)main());
    for (;;) {}
}

#ifdef __riscv
// The board begins at the first address of the code.
__attribute__((naked, section(".vectors"))) void reset(void)
{
    __asm__ volatile(".option arch, +zicsr \n la sp, stack_top \n la t0, 1f \n csrw mtvec, t0 \n j start \n .balign 4 "
                     "\n 1: la sp, stack_top \n j die");
}
#else
__attribute__((used)) void reset(void) { start(); }

// The fault may have been the stack's: begin a new one.
__attribute__((naked)) static void fault(void)
{
    __asm__ volatile(".syntax unified \n ldr r0, =stack_top \n msr msp, r0 \n bl die \n .ltorg");
}

// Initial stack; reset; every other exception is a fault.
__attribute__((section(".vectors"), used)) static const struct {
    uint32_t *stack;
    void (*handler[15])(void);
} vectors = {stack_top, {reset, fault, fault, fault, fault, fault, 0, 0, 0, 0, fault, fault, 0, fault, fault}};
#endif

// Words where they are aligned, as a C library does. run_on.sh keeps the compiler from making a call of the same
// function out of a loop.
void *memcpy(void *restrict to, const void *restrict from, size_t n)
{
    uint8_t *t = to;
    const uint8_t *f = from;
    if ((((uintptr_t)t | (uintptr_t)f) & 3u) == 0) {
        for (; n >= 4; n -= 4, t += 4, f += 4) *(uint32_t *)(void *)t = *(const uint32_t *)(const void *)f;
    }
    for (; n > 0; n--) *t++ = *f++;
    return to;
}

void *memset(void *to, int c, size_t n)
{
    uint8_t *t = to;
    const uint32_t word = (uint32_t)(uint8_t)c * 0x01010101u;
    if (((uintptr_t)t & 3u) == 0) {
        for (; n >= 4; n -= 4, t += 4) *(uint32_t *)(void *)t = word;
    }
    for (; n > 0; n--) *t++ = (uint8_t)c;
    return to;
}
