// From reset to main on a Cortex-M4F, with the host's files, arguments and exit status by semihosting.
#include <stdint.h>
#include <stdlib.h>

#include "target/board.h"
#include "target/count.h"

#define CPACR (*(volatile uint32_t *)0xE000ED88u)
#define FPU_ON (0xFu << 20)

// Memory protection: region n's base and size. No access is what a size with no other bit says; else the default map
// holds.
#define MPU_CONTROL (*(volatile uint32_t *)0xE000ED94u)
#define MPU_BASE (*(volatile uint32_t *)0xE000ED9Cu)
#define MPU_SIZE (*(volatile uint32_t *)0xE000EDA0u)
#define MPU_VALID 0x10u
#define MPU_4K ((11u << 1) | 1u)
#define MPU_ON 5u

// Semihosting calls, and what they take.
#define SYS_WRITE0 0x04
#define SYS_GET_CMDLINE 0x15
#define SYS_EXIT_EXTENDED 0x20
#define APPLICATION_EXIT 0x20026u
#define FAULT_STATUS 99u

#define ARGUMENTS 16

extern uint32_t data_start[], data_end[], bss_start[], bss_end[], stack_floor[], stack_top[];
extern const uint32_t data_load[];
extern void initialise_monitor_handles(void);
extern int main(int argc, char *argv[]);
void reset(void);

static int host(int call, const void *block)
{
    register int r0 __asm__("r0") = call;
    register const void *r1 __asm__("r1") = block;
    __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

void board_end(const char *message, uint32_t status)
{
    const uint32_t how[] = {APPLICATION_EXIT, status};
    (void)host(SYS_WRITE0, message);
    (void)host(SYS_EXIT_EXTENDED, how);
    for (;;) {}
}

__attribute__((used)) static void die(void) { board_end("hard fault\n", FAULT_STATUS); }

// The fault may have been the stack's: begin a new one.
__attribute__((naked)) static void fault(void) { __asm__ volatile("ldr r0, =stack_top \n msr msp, r0 \n b die"); }

// Words of the command line, split at blanks.
static int split(char *line, char *argv[])
{
    int argc = 0;
    for (; *line != 0 && argc < ARGUMENTS; argc++) {
        argv[argc] = line;
        while (*line != 0 && *line != ' ') line++;
        while (*line == ' ') *line++ = 0;
    }
    argv[argc] = NULL;
    return argc;
}

void reset(void)
{
    static char line[1024];
    static char *argv[ARGUMENTS + 1];
    CPACR |= FPU_ON;
    // Below the stack and at address 0, which holds the vectors, the board would not fault by itself.
    MPU_BASE = MPU_VALID | 0u;
    MPU_SIZE = MPU_4K;
    MPU_BASE = (uint32_t)stack_floor | MPU_VALID | 1u;
    MPU_SIZE = MPU_4K;
    MPU_CONTROL = MPU_ON;
    __asm__ volatile("dsb \n isb" ::: "memory");
    const uint32_t *from = data_load;
    for (uint32_t *to = data_start; to < data_end; to++) *to = *from++;
    for (uint32_t *to = bss_start; to < bss_end; to++) *to = 0;
    initialise_monitor_handles();
    struct {
        char *line;
        uint32_t size;
    } command = {line, sizeof line};
    if (host(SYS_GET_CMDLINE, &command) != 0) line[0] = 0;
    count_calibrate();
    exit(main(split(line, argv), argv));
}

// A program may have an interrupt: it sets PendSV pending.
void pendsv(void);
__attribute__((weak)) void pendsv(void) { fault(); }

// Initial stack; reset, NMI, hard fault, and the faults that could be told apart. No other interrupt is ever enabled.
__attribute__((section(".vectors"), used)) static const struct {
    uint32_t *stack;
    void (*handler[15])(void);
} vectors = {stack_top, {reset, fault, fault, fault, fault, fault, 0, 0, 0, 0, fault, fault, 0, pendsv, fault}};
