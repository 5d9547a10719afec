#include "ref/effect/flux_map.hpp"

#include <algorithm>
#include <cmath>

namespace dqw {
namespace {

constexpr int kMost = kOwnCells;

/// Functions of one current with their first two slopes, in cells.
struct Family {
    double value[kMost], slope[kMost], bend[kMost];
    int count = 0;

    void add(double v, double s, double b) { value[count] = v, slope[count] = s, bend[count] = b, ++count; }
    /// Bends from 0 to 1 over one cell, `t` cells from its begin outward, and stays so beyond; `side` is where it lies.
    void add_ramp(double t, double side)
    {
        if (t <= 0.0)
            add(0.0, 0.0, 0.0);
        else if (t < 1.0)
            add(t * t * t / 6.0, side * 0.5 * t * t, t);
        else
            add(0.5 * t * t - 0.5 * t + 1.0 / 6.0, side * (t - 0.5), 1.0);
    }
};

/// Cells of one axis: `below` of `cells` lie left of zero current.
struct Axis {
    double cell_A = 1.0;
    int below = 0;

    Axis(double least_A, double most_A, int cells)
    {
        const double span = most_A - least_A;
        below = std::clamp(static_cast<int>(std::lround(-least_A / span * cells)), least_A < 0.0 ? 1 : 0,
                           most_A > 0.0 ? cells - 1 : cells);
        if (below > 0) cell_A = -least_A / below;
        if (below < cells) cell_A = std::max(below > 0 ? cell_A : 0.0, most_A / (cells - below));
    }
};

void add_ramps(const Axis& axis, double x, int cells, Family& out)
{
    for (int k = 0; k < axis.below; ++k) out.add_ramp(-x - k, -1.0);
    for (int k = 0; k < cells - axis.below; ++k) out.add_ramp(x - k, 1.0);
}

/// Even in y.
void add_even_ramps(double y, int cells, Family& out)
{
    for (int k = 0; k < cells; ++k) out.add_ramp(std::abs(y) - k, y < 0.0 ? -1.0 : 1.0);
}

struct Own {
    Axis d;
    double q_cell_A;
    Family of_d, of_q;

    Own(const std::array<double, 4>& shape, double i_d_A, double i_q_A)
        : d(shape[0], shape[1], kOwnCells), q_cell_A(shape[2] / kOwnCells)
    {
        add_ramps(d, i_d_A / d.cell_A, kOwnCells, of_d);
        add_even_ramps(i_q_A / q_cell_A, kOwnCells, of_q);
    }
};

struct Cross {
    Axis d;
    double q_cell_A, unit;  ///< of the co-energy over that of a weight, A
    Family of_d, of_q;

    Cross(const std::array<double, 4>& shape, double i_d_A, double i_q_A)
        : d(shape[0], shape[1], kCrossCells), q_cell_A(shape[2] / kCrossCells), unit(std::sqrt(d.cell_A * q_cell_A))
    {
        const double x = i_d_A / d.cell_A, y = i_q_A / q_cell_A;
        of_d.add(x, 1.0, 0.0), of_d.add(0.5 * x * x, x, 1.0);
        add_ramps(d, x, kCrossCells, of_d);
        of_q.add(0.5 * y * y, y, 1.0);
        add_even_ramps(y, kCrossCells, of_q);
    }
};

/// The functions of i_q under these weights, of one of i_d.
struct InQ {
    double value = 0.0, slope = 0.0, bend = 0.0;

    InQ(const Family& of_q, const double weights[])
    {
        for (int b = 0; b < of_q.count; ++b)
            value += weights[b] * of_q.value[b], slope += weights[b] * of_q.slope[b], bend += weights[b] * of_q.bend[b];
    }
};

}  // namespace

void own_flux(const std::array<double, 4>& shape, double i_d_A, double i_q_A, double psi_d[], double psi_q[])
{
    const Own own(shape, i_d_A, i_q_A);
    for (int k = 0; k < kOwnCells; ++k) {
        psi_d[k] = own.of_d.slope[k], psi_q[k] = 0.0;
        psi_d[kOwnCells + k] = 0.0, psi_q[kOwnCells + k] = own.of_q.slope[k];
    }
}

void cross_flux(const std::array<double, 4>& shape, double i_d_A, double i_q_A, double psi_d[], double psi_q[])
{
    const Cross c(shape, i_d_A, i_q_A);
    const double by_d = c.unit / c.d.cell_A, by_q = c.unit / c.q_cell_A;
    int j = 0;
    for (int a = 0; a < c.of_d.count; ++a)
        for (int b = 0; b < c.of_q.count; ++b, ++j)
            psi_d[j] = by_d * c.of_d.slope[a] * c.of_q.value[b], psi_q[j] = by_q * c.of_d.value[a] * c.of_q.slope[b];
}

std::array<double, 2> own_flux_sum(const std::array<double, 4>& shape, const double weights[], double i_d_A,
                                   double i_q_A)
{
    const Own own(shape, i_d_A, i_q_A);
    double d = 0.0, q = 0.0;
    for (int k = 0; k < kOwnCells; ++k)
        d += weights[k] * own.of_d.slope[k], q += weights[kOwnCells + k] * own.of_q.slope[k];
    return {d, q};
}

std::array<double, 2> cross_flux_sum(const std::array<double, 4>& shape, const double weights[], double i_d_A,
                                     double i_q_A)
{
    const Cross c(shape, i_d_A, i_q_A);
    double d = 0.0, q = 0.0;
    for (int a = 0; a < c.of_d.count; ++a) {
        const InQ by(c.of_q, weights + a * c.of_q.count);
        d += c.of_d.slope[a] * by.value, q += c.of_d.value[a] * by.slope;
    }
    return {c.unit / c.d.cell_A * d, c.unit / c.q_cell_A * q};
}

std::array<double, 3> own_inductance(const std::array<double, 4>& shape, const double weights[], double i_d_A,
                                     double i_q_A)
{
    const Own own(shape, i_d_A, i_q_A);
    double dd = 0.0, qq = 0.0;
    for (int k = 0; k < kOwnCells; ++k)
        dd += weights[k] * own.of_d.bend[k], qq += weights[kOwnCells + k] * own.of_q.bend[k];
    return {dd / own.d.cell_A, 0.0, qq / own.q_cell_A};
}

std::array<double, 3> cross_inductance(const std::array<double, 4>& shape, const double weights[], double i_d_A,
                                       double i_q_A)
{
    const Cross c(shape, i_d_A, i_q_A);
    double dd = 0.0, dq = 0.0, qq = 0.0;
    for (int a = 0; a < c.of_d.count; ++a) {
        const InQ by(c.of_q, weights + a * c.of_q.count);
        dd += c.of_d.bend[a] * by.value, dq += c.of_d.slope[a] * by.slope, qq += c.of_d.value[a] * by.bend;
    }
    const double by_d = c.d.cell_A, by_q = c.q_cell_A;
    return {c.unit / (by_d * by_d) * dd, c.unit / (by_d * by_q) * dq, c.unit / (by_q * by_q) * qq};
}

}  // namespace dqw
