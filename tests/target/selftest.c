// The harness on blocks of known length and a call of known depth: status 0 only if every number is right to the last
// one.
// With an argument, a host file that it reads and whose lines it counts: tests/target/run.sh OUT.elf
// tests/target/selftest.c -- -- FILE
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "target/count.h"
#include "target/stack.h"

#define SLED 1000
#define TEXT(x) #x
#define STRING(x) TEXT(x)

static int failed;
static volatile uint32_t copied = 42;
static volatile uint32_t cleared;

static void expect(const char *what, uint32_t value, uint32_t right)
{
    (void)printf("%s %s: %lu, right is %lu\n", value == right ? "ok  " : "FAIL", what, (unsigned long)value,
                 (unsigned long)right);
    if (value != right) failed++;
}

// Executes n nops, 0 .. 1000, and as many other instructions for every n.
__attribute__((naked)) static void sled(__attribute__((unused)) uint32_t n)
{
    __asm__ volatile("adr.w r1, 1f \n"
                     "sub r1, r1, r0, lsl #1 \n"
                     "orr r1, r1, #1 \n"
                     "bx r1 \n"
                     ".p2align 2 \n"
                     ".rept 1000 \n nop \n .endr \n"
                     "1: bx lr");
}

// Every length: from one to the next the clock's phase within the counter's tick differs.
static void count_of_the_sled(void)
{
    uint32_t none = 0, wrong = 0;
    for (uint32_t n = 0; n <= SLED; n++) {
        count_start();
        sled(n);
        const uint32_t counted = count_stop();
        if (n == 0) none = counted;
        if (counted - none != n) wrong++;
    }
    expect("lengths 0 to 1000 counted wrongly", wrong, 0);
}

static void count_of_blocks(void)
{
    count_start();
    expect("nothing", count_stop(), 0);

    count_start();
    __asm__ volatile("nop");
    expect("1 nop", count_stop(), 1);

    count_start();
    __asm__ volatile(".rept 100 \n nop \n .endr");
    expect("100 nops", count_stop(), 100);

    count_start();
    __asm__ volatile(".rept 1000 \n nop \n .endr");
    expect("1000 nops", count_stop(), 1000);

    count_start();
    __asm__ volatile("vmov.f32 s0, #2.0 \n"
                     "vadd.f32 s1, s0, s0 \n"
                     "vdiv.f32 s1, s0, s1 \n"
                     "vsqrt.f32 s1, s1 \n"
                     "vcmp.f32 s1, s0 \n"
                     "vmrs APSR_nzcv, fpscr" ::
                         : "s0", "s1", "cc");
    expect("6 of the floating point unit", count_stop(), 6);

    // Of the two conditional ones one is skipped, and counts.
    count_start();
    __asm__ volatile("movs r0, #1 \n cmp r0, #1 \n ite eq \n moveq r0, #2 \n movne r0, #3" ::: "r0", "cc");
    expect("5 with a condition", count_stop(), 5);

    count_start();
    __asm__ volatile("push {r0-r3} \n ldr r0, [sp] \n str r0, [sp, #4] \n pop {r0-r3}" ::
                         : "r0", "r1", "r2", "r3", "memory");
    expect("4 of memory", count_stop(), 4);

    // More ticks than the 24 bits of SysTick hold.
    count_start();
    __asm__ volatile(
        "movw r0, #0x4240 \n movt r0, #0xF \n 1: mul r1, r0, r0 \n nop \n nop \n subs r0, r0, #1 \n bne 1b" ::
            : "r0", "r1", "cc");
    expect("a loop", count_stop(), 2 + 5 * 1000000);
}

static uint32_t roots(void)
{
    volatile float x = 3.0f;
    for (int i = 0; i < 100; i++) x = x * 0.25f + 1.0f;
    return x > 1.0f;
}

// The same call at every phase of the tick.
static void repeats(void)
{
    uint32_t first = 0, differ = 0;
    for (uint32_t n = 0; n < 200; n++) {
        sled(n);
        count_start();
        (void)roots();
        const uint32_t counted = count_stop();
        if (n == 0) first = counted;
        if (counted != first) differ++;
    }
    expect("repetitions of one call that differ", differ, 0);
}

// Reserves n bytes and writes the lowest.
__attribute__((naked)) static void deep(__attribute__((unused)) uint32_t n)
{
    __asm__ volatile("sub sp, sp, r0 \n str r0, [sp] \n add sp, sp, r0 \n bx lr");
}

__attribute__((naked)) static void pushes(void)
{
    __asm__ volatile("push {r4-r7, lr} \n vpush {s16-s31} \n vpop {s16-s31} \n pop {r4-r7, pc}");
}

static void depth(void)
{
    stack_paint();
    expect("no call: bytes of stack", stack_used(), 0);
    uint32_t wrong = 0;
    for (uint32_t n = 4; n <= STACK_PAINTED; n += 4) {
        if (n > 4096 && n % 4096 != 0) continue;
        stack_paint();
        deep(n);
        if (stack_used() != n) wrong++;
    }
    expect("depths 4 to " STRING(STACK_PAINTED) " measured wrongly", wrong, 0);
    stack_paint();
    pushes();
    expect("5 + 16 registers pushed: bytes of stack", stack_used(), 84);
    stack_paint();
    deep(800);
    pushes();
    deep(8);
    expect("the deepest of three calls", stack_used(), 800);
}

static void started(int argc, char *argv[])
{
    expect(".data", copied, 42);
    expect(".bss", cleared, 0);
    copied = cleared = 1;
    expect("argv begins with the program", argc > 0 && strstr(argv[0], ".elf") != NULL, 1);
    if (argc < 2) return;
    FILE *f = fopen(argv[1], "r");
    expect("the host's file opens", f != NULL, 1);
    if (f == NULL) return;
    unsigned long lines = 0;
    for (int c = fgetc(f); c != EOF; c = fgetc(f)) lines += c == '\n';
    (void)fclose(f);
    (void)printf("     %s: %lu lines\n", argv[1], lines);
}

int main(int argc, char *argv[])
{
    started(argc, argv);
    count_of_blocks();
    count_of_the_sled();
    repeats();
    depth();
    return failed != 0;
}
