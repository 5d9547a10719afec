// As much of an Arduino core as the sketches use: Serial, on a host's standard output.
#ifndef ARDUINO_H
#define ARDUINO_H

#include <stdint.h>
#include <stdio.h>

struct Print {
    void begin(unsigned long) {}
    void print(const char *text) { fputs(text, stdout); }
    void print(double value, int digits) { printf("%.*f", digits, value); }
    void println(const char *text = "") { puts(text); }
};
extern Print Serial;

void setup();
void loop();

#endif
