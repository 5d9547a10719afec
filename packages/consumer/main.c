/* On a host: what was learned, a line each; the exit code is learn()'s. */
#include <stdio.h>

#include "learn.h"

static void say(const char *what, float value, float truth)
{
    if (truth > 0.0f)
        printf("%-7s %.5g, in truth %.5g\n", what, (double)value, (double)truth);
    else
        printf("dqwatch %s\n", what);
}

int main(void)
{
    return learn(say);
}
