// One number for a whole trajectory: FNV-1a over every value put in, eight bytes each.
#ifndef TARGET_HASH_H
#define TARGET_HASH_H

#include <stdint.h>

typedef uint64_t hash;

#define HASH_EMPTY 14695981039346656037u

static inline void hash_put(hash *h, int64_t x)
{
    const uint64_t bytes = (uint64_t)x;
    for (unsigned i = 0; i < 64; i += 8) *h = (*h ^ (bytes >> i & 255u)) * 1099511628211u;
}

/// The modules, in the order of the table; hash_NAME.c has hash_NAME(). A further one is a name here.
#define HASH_MODULES(X)                                                                                                \
    X(q15) X(learner) X(transform) X(random) X(normal) X(segment) X(window) X(estimator) X(effect) X(shaft) X(monitor)

#define HASH_DECLARE(name) hash hash_##name(void);
HASH_MODULES(HASH_DECLARE)

#endif
