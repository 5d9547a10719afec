// A check sum over words: any one that differs makes another sum.
#ifndef DQW_HASH_H
#define DQW_HASH_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// FNV-1a, byte by byte.
static inline uint32_t dqw_hash_begin(void)
{
    return 2166136261u;
}

/// One word on.
static inline uint32_t dqw_hash_add(uint32_t hash, uint32_t word)
{
    for (int i = 0; i < 4; i++) {
        hash = (hash ^ (word & 0xffu)) * 16777619u;
        word >>= 8;
    }
    return hash;
}

/// All that an array, or a struct without padding, holds: what dqw_hash_add() makes of its words where their lowest
/// byte stands first.
static inline uint32_t dqw_hash_bytes(uint32_t hash, const void *from, size_t bytes)
{
    const unsigned char *byte = (const unsigned char *)from;
    for (size_t i = 0; i < bytes; i++) hash = (hash ^ byte[i]) * 16777619u;
    return hash;
}

#ifdef __cplusplus
}
#endif
#endif
