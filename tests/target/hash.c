// A hash of the whole trajectory of each fixed-point module, one `name hash` a line: every machine and every compiler must print the same.
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
        say_text(modules[i].name);
        say_text(" ");
        say_hex(modules[i].run());
        say_text("\n");
    }
    return 0;
}
