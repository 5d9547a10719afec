#include "dqw_transform.h"

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
