// How deep a call reached into the stack.
#ifndef TARGET_STACK_H
#define TARGET_STACK_H

#include <stdint.h>

/// Bytes painted, the most that can be seen.
#ifndef STACK_PAINTED
#define STACK_PAINTED 65536
#endif

/// Paint what is below the caller's stack pointer.
void stack_paint(void);

/// Bytes below the caller's stack pointer down to the lowest one overwritten since stack_paint(), of the same caller.
/// What a call reserves but never writes is not seen; compare with gcc's -fstack-usage where that matters.
uint32_t stack_used(void);

#endif
