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
#include <sys/wait.h>
#include <ucontext.h>
#include <unistd.h>

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
    volatile bool stepping, child;
    void (*interrupt)(void);
} everywhere;

static void everywhere_handler(int number, siginfo_t *info, void *context)
{
    ucontext_t *c = context;
    (void)number;
    (void)info;
    const long trap = PREEMPT_TRAP;
    if (!everywhere.stepping) {
        c->uc_mcontext.gregs[REG_EFL] &= ~trap;
        return;
    }
    c->uc_mcontext.gregs[REG_EFL] |= trap;
    const long now = everywhere.count++;
    const bool each = now < everywhere.first || (everywhere.last > 0 && now >= everywhere.last);
    if (!each && now % everywhere.stride != 0) return;
    // A copy of the program is interrupted here, and runs on; this one goes to the next instruction.
    const pid_t copy = fork();
    if (copy == 0) {
        everywhere.child = true;
        everywhere.stepping = false;
        c->uc_mcontext.gregs[REG_EFL] &= ~trap;
        everywhere.interrupt();
        return;
    }
    int status = 1;
    if (copy < 0 || waitpid(copy, &status, 0) < 0 || status != 0) {
        everywhere.failed_at = everywhere.count;
        everywhere.stepping = false;
        c->uc_mcontext.gregs[REG_EFL] &= ~trap;
    }
}

/// Run `background` with `interrupt` after each of its instructions in turn, or of those in the middle every stride-th,
/// and ask `equal` each time how it ended. Returns how many instructions there were; minus the first one after which it
/// did not end well.
static inline long preempt_everywhere(long stride, void (*background)(void), void (*interrupt)(void),
                                      bool (*equal)(void))
{
    struct sigaction trap;
    sigemptyset(&trap.sa_mask);
    trap.sa_flags = SA_SIGINFO;
    trap.sa_sigaction = everywhere_handler;
    (void)sigaction(SIGTRAP, &trap, NULL);
    everywhere.count = everywhere.failed_at = 0;
    everywhere.stride = stride;
    everywhere.interrupt = interrupt;
    everywhere.child = false;
    everywhere.stepping = true;
    (void)raise(SIGTRAP);
    background();
    // First: a copy that were made once the next line has read `child` would take itself for the program, and run all
    // the rest as well.
    everywhere.stepping = false;
    if (everywhere.child) _exit(equal() ? 0 : 1);
    return everywhere.failed_at != 0 ? -everywhere.failed_at : everywhere.count;
}
#else
#define PREEMPT_HERE 0
#endif

#endif
