// What firmware makes of a flux map's table, by hand: bilinear between four nodes, (E165).
#ifndef DQW_TESTS_FLUX_TABLE_HPP
#define DQW_TESTS_FLUX_TABLE_HPP

#include <algorithm>
#include <array>
#include <cmath>

#include "ref/effect/found.hpp"

/// How far d and q bend away from the tangent at zero current, Wb; the weights of the input beside it.
inline std::array<double, 2> bend_of(const dqw::TraceInput& table, double i_d_A, double i_q_A)
{
    const int rows = table.map[0], columns = table.map[2];
    const double x = std::clamp(i_d_A / table.shape[1] + table.map[1], 0.0, rows - 1.0),
                 y = std::clamp(std::abs(i_q_A) / table.shape[2], 0.0, columns - 1.0);
    const int k = std::min(static_cast<int>(x), rows - 2), m = std::min(static_cast<int>(y), columns - 2);
    std::array<double, 2> out{};
    for (int axis = 0; axis < 2; ++axis)
        for (int a = 0; a < 2; ++a)
            for (int b = 0; b < 2; ++b)
                out[static_cast<std::size_t>(axis)] +=
                    (a == 1 ? x - k : 1 + k - x) * (b == 1 ? y - m : 1 + m - y) *
                    table.map[static_cast<std::size_t>(3 + 2 * ((k + a) * columns + m + b) + axis)] / 32768.0 *
                    table.shape[0];
    if (i_q_A < 0.0) out[1] = -out[1];
    return out;
}

#endif
