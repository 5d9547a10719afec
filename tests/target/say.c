// Numbers as text. Where there is a C library, the text goes to stdout; elsewhere bare.c has say_text.
#include "target/say.h"

#if __STDC_HOSTED__
#include <stdio.h>

void say_text(const char *text) { (void)fputs(text, stdout); }
#endif

void say_hex(uint64_t x)
{
    char text[17];
    for (int i = 0; i < 16; i++) text[i] = "0123456789abcdef"[(x >> (60 - 4 * i)) & 15u];
    text[16] = 0;
    say_text(text);
}

void say_value(const char *name, uint32_t value)
{
    char text[12];
    char *at = text + sizeof text;
    *--at = 0;
    *--at = '\n';
    do {
        *--at = (char)('0' + value % 10u);
        value /= 10u;
    } while (value > 0);
    say_text(name);
    say_text(" ");
    say_text(at);
}
