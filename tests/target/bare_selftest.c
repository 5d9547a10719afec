// The harness without a C library on what is known beforehand: .data, .bss, blocks of known length at many phases,
// stacks of known depth.
#include <stdbool.h>
#include <stdint.h>

#include "target/count.h"
#include "target/say.h"
#include "target/stack.h"

static uint32_t failed;
static volatile uint32_t copied = 42;
static volatile uint32_t cleared;

static void expect(const char *what, uint32_t value, uint32_t right)
{
    if (value == right) return;
    failed++;
    say_text("FAIL ");
    say_value(what, value);
}

// Reaches n words into the stack, in 4 n + 3 instructions.
__attribute__((naked, noinline)) static void deep(__attribute__((unused)) uint32_t n)
{
#ifdef __riscv
    __asm__ volatile(
        "mv a1, sp \n 1: addi sp, sp, -4 \n sw a0, 0(sp) \n addi a0, a0, -1 \n bnez a0, 1b \n mv sp, a1 \n ret");
#else
    __asm__ volatile(".syntax unified \n mov r1, sp \n 1: sub sp, #4 \n str r0, [sp] \n subs r0, r0, #1 \n bne 1b \n "
                     "mov sp, r1 \n bx lr");
#endif
}

__attribute__((noinline, noclone)) static uint32_t counted(uint32_t n)
{
    count_start();
    deep(n);
    return count_stop();
}

int main(void)
{
    expect(".data", copied, 42);
    expect(".bss", cleared, 0);
    count_start();
    expect("nothing", count_stop(), 0);
    for (uint32_t n = 1; n <= 1000; n++) expect("instructions", counted(n) - counted(1), 4 * (n - 1));
    for (uint32_t n = 1; n <= STACK_PAINTED / 4; n++) {
        stack_paint();
        deep(n);
        expect("stack", stack_used(), 4 * n);
    }
    if (failed == 0) say_text("exact\n");
    return failed != 0;
}
