// Both functions touch no stack themselves: the paint begins at the caller's stack pointer.
#include "target/stack.h"

#define TEXT(x) #x
#define STRING(x) TEXT(x)

// clang-format off
#ifdef __riscv
__attribute__((naked)) void stack_paint(void)
{
    __asm__ volatile("li a0, " STRING(STACK_PAINTED) " \n"
                     "sub a0, sp, a0 \n"
                     "li a1, 0xA5C3965B \n"
                     "1: sw a1, 0(a0) \n"
                     "addi a0, a0, 4 \n"
                     "bne a0, sp, 1b \n"
                     "ret");
}

__attribute__((naked)) uint32_t stack_used(void)
{
    __asm__ volatile("li a0, " STRING(STACK_PAINTED) " \n"
                     "sub a0, sp, a0 \n"
                     "li a1, 0xA5C3965B \n"
                     "1: beq a0, sp, 2f \n"
                     "lw a2, 0(a0) \n"
                     "bne a2, a1, 2f \n"
                     "addi a0, a0, 4 \n"
                     "j 1b \n"
                     "2: sub a0, sp, a0 \n"
                     "ret");
}
#else
__attribute__((naked)) void stack_paint(void)
{
    __asm__ volatile(".syntax unified \n"
                     "mov r1, sp \n"
                     "ldr r0, =" STRING(STACK_PAINTED) " \n"
                     "subs r0, r1, r0 \n"
                     "ldr r2, =0xA5C3965B \n"
                     "1: str r2, [r0] \n"
                     "adds r0, r0, #4 \n"
                     "cmp r0, r1 \n"
                     "bne 1b \n"
                     "bx lr \n"
                     ".ltorg");
}

__attribute__((naked)) uint32_t stack_used(void)
{
    __asm__ volatile(".syntax unified \n"
                     "mov r1, sp \n"
                     "ldr r0, =" STRING(STACK_PAINTED) " \n"
                     "subs r0, r1, r0 \n"
                     "ldr r2, =0xA5C3965B \n"
                     "1: cmp r0, r1 \n"
                     "beq 2f \n"
                     "ldr r3, [r0] \n"
                     "cmp r3, r2 \n"
                     "bne 2f \n"
                     "adds r0, r0, #4 \n"
                     "b 1b \n"
                     "2: subs r0, r1, r0 \n"
                     "bx lr \n"
                     ".ltorg");
}
#endif
// clang-format on
