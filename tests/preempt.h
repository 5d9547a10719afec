// An interrupt after any instruction: the trap flag of x86-64 stops the program after each of them, and a handler runs
// in its place. Include it first.
#ifndef PREEMPT_H
#define PREEMPT_H

#if defined(__linux__) && defined(__x86_64__)
#define PREEMPT_HERE 1
#ifndef _GNU_SOURCE
#define _GNU_SOURCE 1  // NOLINT(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp): the names of the registers
#endif
#include <signal.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <ucontext.h>

enum { PREEMPT_TRAP = 0x100 };
static struct {
    volatile long count, at;
    volatile bool stepping;
    void (*interrupt)(void);
} preempt;

static void preempt_handler(int number, siginfo_t *info, void *context)
{
    ucontext_t *c = context;
    (void)number;
    (void)info;
    const long trap = PREEMPT_TRAP;
    const bool now = preempt.stepping && preempt.count++ == preempt.at;
    // What comes after the interrupt need not be stopped.
    if (now || !preempt.stepping)
        c->uc_mcontext.gregs[REG_EFL] &= ~trap;
    else
        c->uc_mcontext.gregs[REG_EFL] |= trap;
    if (now) preempt.interrupt();
    if (now) preempt.stepping = false;
}

/// Run `background` with `interrupt` after its instruction number `at`. Returns false where it ended before.
static inline bool preempt_run(long at, void (*background)(void), void (*interrupt)(void))
{
    struct sigaction trap;
    sigemptyset(&trap.sa_mask);
    trap.sa_flags = SA_SIGINFO;
    trap.sa_sigaction = preempt_handler;
    (void)sigaction(SIGTRAP, &trap, NULL);
    preempt.count = 0;
    preempt.at = at;
    preempt.interrupt = interrupt;
    preempt.stepping = true;
    (void)raise(SIGTRAP);
    background();
    const bool came = !preempt.stepping;
    preempt.stepping = false;
    return came;
}

static struct {
    volatile long count, stride, failed_at;
    volatile long first, last;  ///< so many at the beginning and from this one on, where it is above 0, after each
    volatile bool stepping, tried, back;
    void (*interrupt)(void);
    void *object;
    size_t size;
    unsigned char *base;  ///< the stack below it is what the background uses
} everywhere;

/// The program as it was at an instruction: registers, those of floating point, stack, object.
enum { PREEMPT_STACK = 1 << 18, PREEMPT_WIDE = 1 << 14, PREEMPT_OBJECT = 1 << 16, PREEMPT_RED_ZONE = 128 };
static struct {
    gregset_t registers;
    unsigned char wide[PREEMPT_WIDE], stack[PREEMPT_STACK], object[PREEMPT_OBJECT];
    unsigned char *low;
    size_t wide_size, stack_size;
} preempt_was;

/// A stack of its own for the handler, which writes that of the program.
static unsigned char preempt_own_stack[1 << 17];

/// A stack that AddressSanitizer moves to its heap would not be kept.
extern const char *__asan_default_options(void);  // NOLINT(bugprone-reserved-identifier,cert-dcl37-c,cert-dcl51-cpp)
const char *__asan_default_options(void) { return "detect_stack_use_after_return=0"; }

/// memcpy(), in which AddressSanitizer would object to what lies between variables.
static inline void preempt_copy(void *to, const void *from, size_t size)
{
    __asm__ volatile("rep movsb" : "+D"(to), "+S"(from), "+c"(size) : : "memory");
}

/// How long the registers of floating point are in a signal's frame, as Linux writes there.
static inline size_t preempt_wide_size(const void *wide)
{
    uint32_t software[2];  // magic number, size
    preempt_copy(software, (const unsigned char *)wide + 464, sizeof software);
    return software[0] == 0x46505853u ? software[1] : 512;
}

static inline void preempt_keep(const ucontext_t *c)
{
    preempt_copy(preempt_was.registers, c->uc_mcontext.gregs, sizeof preempt_was.registers);
    preempt_was.wide_size = preempt_wide_size(c->uc_mcontext.fpregs);
    preempt_was.low = (unsigned char *)c->uc_mcontext.gregs[REG_RSP] - PREEMPT_RED_ZONE;
    preempt_was.stack_size = (size_t)(everywhere.base - preempt_was.low);
    if (preempt_was.wide_size > PREEMPT_WIDE || preempt_was.stack_size > PREEMPT_STACK) abort();
    preempt_copy(preempt_was.wide, c->uc_mcontext.fpregs, preempt_was.wide_size);
    preempt_copy(preempt_was.stack, preempt_was.low, preempt_was.stack_size);
    preempt_copy(preempt_was.object, everywhere.object, everywhere.size);
}

static inline void preempt_restore(ucontext_t *c)
{
    preempt_copy(c->uc_mcontext.gregs, preempt_was.registers, sizeof preempt_was.registers);
    preempt_copy(c->uc_mcontext.fpregs, preempt_was.wide, preempt_was.wide_size);
    preempt_copy(preempt_was.low, preempt_was.stack, preempt_was.stack_size);
    preempt_copy(everywhere.object, preempt_was.object, everywhere.size);
}

static void everywhere_handler(int number, siginfo_t *info, void *context)
{
    ucontext_t *c = context;
    (void)number;
    (void)info;
    const long trap = PREEMPT_TRAP;
    // It was interrupted and judged: on from there as if it had not been.
    if (everywhere.back) {
        preempt_restore(c);
        everywhere.back = false;
        everywhere.stepping = true;
        c->uc_mcontext.gregs[REG_EFL] |= trap;
        return;
    }
    if (!everywhere.stepping) {
        c->uc_mcontext.gregs[REG_EFL] &= ~trap;
        return;
    }
    c->uc_mcontext.gregs[REG_EFL] |= trap;
    const long now = everywhere.count++;
    const bool each = now < everywhere.first || (everywhere.last > 0 && now >= everywhere.last);
    // Once the background has returned there is nothing left to interrupt.
    if ((!each && now % everywhere.stride != 0) || (unsigned char *)c->uc_mcontext.gregs[REG_RSP] > everywhere.base)
        return;
    preempt_keep(c);
    everywhere.tried = true;
    everywhere.stepping = false;
    c->uc_mcontext.gregs[REG_EFL] &= ~trap;
    everywhere.interrupt();
}

/// Run `background`, which writes `object[size]` alone, with `interrupt` after each of its instructions in turn, or of
/// those in the middle every stride-th, and ask `equal` each time how it ended. Returns how many instructions there
/// were; minus the first one after which it did not end well.
static inline long preempt_everywhere(long stride, void *object, size_t size, void (*background)(void),
                                      void (*interrupt)(void), bool (*equal)(void))
{
    const stack_t own = {.ss_sp = preempt_own_stack, .ss_size = sizeof preempt_own_stack};
    struct sigaction trap;
    sigemptyset(&trap.sa_mask);
    trap.sa_flags = SA_SIGINFO | SA_ONSTACK;
    trap.sa_sigaction = everywhere_handler;
    if (size > PREEMPT_OBJECT || sigaltstack(&own, NULL) != 0) abort();
    (void)sigaction(SIGTRAP, &trap, NULL);
    everywhere.count = everywhere.failed_at = 0;
    everywhere.stride = stride;
    everywhere.object = object;
    everywhere.size = size;
    everywhere.interrupt = interrupt;
    everywhere.base = (unsigned char *)__builtin_frame_address(0) + 16;
    everywhere.tried = everywhere.back = false;
    everywhere.stepping = true;
    (void)raise(SIGTRAP);
    background();
    everywhere.stepping = false;
    if (everywhere.tried) {
        everywhere.tried = false;
        if (equal()) {
            everywhere.back = true;
            (void)raise(SIGTRAP);
        }
        everywhere.failed_at = everywhere.count;
    }
    return everywhere.failed_at != 0 ? -everywhere.failed_at : everywhere.count;
}
#else
#define PREEMPT_HERE 0
#endif

#endif
