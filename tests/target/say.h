// What a program prints, with a C library or without.
#ifndef TARGET_SAY_H
#define TARGET_SAY_H

#include <stdint.h>

void say_text(const char *text);

/// Sixteen digits.
void say_hex(uint64_t x);

/// `name value` and the end of the line.
void say_value(const char *name, uint32_t value);

#endif
