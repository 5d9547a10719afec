#include "dqw_transform.h"

#include <stdbool.h>
#include <stdint.h>

#define INV_SQRT3 0.57735026919f
#define HALF_SQRT3 0.86602540378f

dqw_alphabeta dqw_clarke(dqw_abc x)
{
    const dqw_alphabeta y = {(2.0f * x.a - x.b - x.c) / 3.0f, (x.b - x.c) * INV_SQRT3};
    return y;
}

dqw_abc dqw_clarke_inverse(dqw_alphabeta x)
{
    const float half = -0.5f * x.alpha;
    const float side = HALF_SQRT3 * x.beta;
    const dqw_abc y = {x.alpha, half + side, half - side};
    return y;
}

dqw_dq dqw_park(dqw_alphabeta x, float cos_theta, float sin_theta)
{
    const dqw_dq y = {cos_theta * x.alpha + sin_theta * x.beta, cos_theta * x.beta - sin_theta * x.alpha};
    return y;
}

dqw_alphabeta dqw_park_inverse(dqw_dq x, float cos_theta, float sin_theta)
{
    const dqw_alphabeta y = {cos_theta * x.d - sin_theta * x.q, sin_theta * x.d + cos_theta * x.q};
    return y;
}

dqw_dq dqw_park_paper(dqw_alphabeta x, float cos_theta, float sin_theta)
{
    return dqw_park(x, cos_theta, -sin_theta);
}

void dqw_cosine_sine(float theta_rad, float *cosine, float *sine)
{
    // Quarter turns, and what is left of them: pi/2 in three parts, so that little is lost where there are many.
    float quarters = theta_rad * 0.63661977f;
    if (!(quarters < 1e5f && quarters > -1e5f)) quarters = theta_rad = 0.0f;
    const int32_t n = (int32_t)(quarters + (quarters < 0.0f ? -0.5f : 0.5f));
    const float k = (float)n;
    const float x = ((theta_rad - k * 1.5703125f) - k * 4.8375129e-4f) - k * 7.5497900e-8f;
    const float x2 = x * x;
    const float s = x * (1.0f - x2 * (1.0f / 6.0f) * (1.0f - x2 * (1.0f / 20.0f) * (1.0f - x2 * (1.0f / 42.0f))));
    const float c = 1.0f -
                    x2 * 0.5f *
                        (1.0f - x2 * (1.0f / 12.0f) * (1.0f - x2 * (1.0f / 30.0f) * (1.0f - x2 * (1.0f / 56.0f))));
    const bool swap = (n & 1) != 0;
    const float a = swap ? s : c;
    const float b = swap ? c : s;
    *cosine = ((n + 1) & 2) != 0 ? -a : a;
    *sine = (n & 2) != 0 ? -b : b;
}
