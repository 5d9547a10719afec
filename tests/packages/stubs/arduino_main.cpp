// The main program of a core: setup, then one turn of the loop.
#include <Arduino.h>

Print Serial;

int main()
{
    setup();
    loop();
}
