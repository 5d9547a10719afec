// Instructions of a step, state and stack of the piece that this is linked with, over the drive's signals. One `name
// value` a line.
#include "target/count.h"
#include "target/piece.h"
#include "target/say.h"
#include "target/stack.h"

#ifndef STEPS
#define STEPS 6000u
#endif

int main(void)
{
    static stimulus s;
    uint32_t worst = 0;
    uint32_t stack = 0;
    uint32_t calls = 0;
    uint32_t sum = 0;
    stimulus_start(&s);
    piece_start();
    for (uint32_t k = 0; k < STEPS; k++) {
        stimulus_next(&s);
        piece_load(&s);
        if (k % 17 == 0) {
            stack_paint();
            piece_step();
            const uint32_t used = stack_used();
            if (used > stack) stack = used;
        } else {
            count_start();
            piece_step();
            const uint32_t n = count_stop();
            if (n > worst) worst = n;
            sum += n;
            calls++;
        }
        piece_background();
    }
    say_value("worst", worst);
    say_value("mean", (sum + calls / 2) / calls);
    say_value("stack", stack);
    say_value("state", piece_bytes);
    return 0;
}
