// Counter-based random numbers: a value is a pure function of seed, stream and index, so that no draw depends on
// another.
#ifndef DQW_SIM_RANDOM_H
#define DQW_SIM_RANDOM_H

#include <stdint.h>

/// 64 random bits. Mixing function of SplitMix64 (Steele, Lea, Flood 2014), applied twice.
uint64_t dqw_sim_random_bits(uint64_t seed, uint64_t stream, uint64_t index);

/// Uniform in the open interval (0, 1).
double dqw_sim_random_uniform(uint64_t seed, uint64_t stream, uint64_t index);

/// Standard normal, by Box and Muller.
double dqw_sim_random_normal(uint64_t seed, uint64_t stream, uint64_t index);

#endif
