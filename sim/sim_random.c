#include "sim_random.h"

#include <math.h>

static uint64_t mix(uint64_t z)
{
    z += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

uint64_t dqw_sim_random_bits(uint64_t seed, uint64_t stream, uint64_t index)
{
    return mix(mix(mix(seed) ^ stream) ^ index);
}

double dqw_sim_random_uniform(uint64_t seed, uint64_t stream, uint64_t index)
{
    // 52 bits and a half: never 0, never 1.
    return ((double)(dqw_sim_random_bits(seed, stream, index) >> 12) + 0.5) * 0x1p-52;
}

double dqw_sim_random_normal(uint64_t seed, uint64_t stream, uint64_t index)
{
    const double u1 = dqw_sim_random_uniform(seed, stream, 2 * index);
    const double u2 = dqw_sim_random_uniform(seed, stream, 2 * index + 1);
    return sqrt(-2.0 * log(u1)) * cos(6.283185307179586 * u2);
}
