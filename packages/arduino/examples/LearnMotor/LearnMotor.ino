// Learns a simulated motor and prints what it found. For a real one see docs/INTEGRATION.md and examples/simplefoc.
#include <dqw.h>

#include "learn.h"

static void say(const char *what, float value, float truth)
{
    Serial.print(truth > 0 ? "" : "dqwatch ");
    Serial.print(what);
    if (truth > 0) {
        Serial.print(" ");
        Serial.print(value, 6);
        Serial.print(", in truth ");
        Serial.print(truth, 6);
    }
    Serial.println();
}

void setup()
{
    Serial.begin(115200);
    Serial.println(learn(say) == 0 ? "learned" : "not learned");
}

void loop() {}
