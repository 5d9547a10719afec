// Both functions touch no stack themselves: the paint begins at the caller's stack pointer.
#include "target/stack.h"

#if STACK_PAINTED != 65536
#error "the size stands in the assembly below as well"
#endif

__attribute__((naked)) void stack_paint(void)
{
    __asm__ volatile("mov r1, sp \n"
                     "sub r0, sp, #65536 \n"
                     "ldr r2, =0xA5C3965B \n"
                     "1: str r2, [r0], #4 \n"
                     "cmp r0, r1 \n"
                     "bne 1b \n"
                     "bx lr");
}

__attribute__((naked)) uint32_t stack_used(void)
{
    __asm__ volatile("mov r1, sp \n"
                     "sub r0, sp, #65536 \n"
                     "ldr r2, =0xA5C3965B \n"
                     "1: cmp r0, r1 \n"
                     "beq 2f \n"
                     "ldr r3, [r0], #4 \n"
                     "cmp r3, r2 \n"
                     "beq 1b \n"
                     "sub r0, r0, #4 \n"
                     "2: sub r0, r1, r0 \n"
                     "bx lr");
}
