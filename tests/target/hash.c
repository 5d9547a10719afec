// A hash of the whole trajectory of each fixed-point module, one `name hash` a line: every machine and every compiler
// must print the same.
#include "target/hash.h"
#include "target/say.h"

#define ROW(name) {#name, hash_##name},
static const struct {
    const char *name;
    hash (*run)(void);
} modules[] = {HASH_MODULES(ROW)};

int main(void)
{
    for (unsigned i = 0; i < sizeof modules / sizeof modules[0]; i++) {
        const hash h = modules[i].run();
        say_text(modules[i].name);
        say_text(" ");
        say_hex(h);
        say_text("\n");
        // The trajectory did not get where it should.
        if (h == 0) return 1;
    }
    return 0;
}
