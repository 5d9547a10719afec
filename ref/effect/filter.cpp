#include "ref/effect/filter.hpp"

namespace dqw {
namespace {

using Complex = std::complex<double>;

/// The two axes' values d, q, and what each has by the other, as a matrix.
Plane axes(double d, double q, double dq) { return {0.5 * (d + q), {0.5 * (d - q), dq}}; }

Plane operator*(const Plane& a, const Plane& b)
{
    return {times(a.of, b.of) + times(a.mirrored, std::conj(b.mirrored)),
            times(a.of, b.mirrored) + times(a.mirrored, std::conj(b.of))};
}
Plane operator*(double a, const Plane& b) { return {a * b.of, a * b.mirrored}; }

Complex inverse(Complex z) { return std::conj(z) / std::norm(z); }

}  // namespace

Filtered::Filtered(double R, double Ld, double Lq, double L_dq, Complex psi, double w_e, double tau_s)
{
    const Complex j(0.0, 1.0), turns(1.0, tau_s * w_e);
    const double det = Ld * Lq - L_dq * L_dq;
    const Plane L = axes(Ld, Lq, L_dq), by_L = axes(Lq / det, Ld / det, -L_dq / det);
    const Plane voltage{R + j * w_e * L.of, j * w_e * L.mirrored}, change = -tau_s * (by_L * voltage);
    // M change + turns M = 1 by Cayley and Hamilton.
    const double trace = 2.0 * change.of.real(), product = std::norm(change.of) - std::norm(change.mirrored);
    const Complex by_whole = inverse(times(turns, turns) + trace * turns + product);
    of_i = {times(turns + trace - change.of, by_whole), times(-change.mirrored, by_whole)};
    const Plane rise = -tau_s * (of_i * by_L);
    of_v = {rise.of, times(rise.mirrored, inverse({1.0, 2.0 * tau_s * w_e}))};
    constant = times(-tau_s * inverse(turns), of_i(by_L(times(-j * w_e, psi))));
}

Complex Filtered::current(Complex told) const
{
    const double product = std::norm(of_i.of) - std::norm(of_i.mirrored);
    return (times(std::conj(of_i.of), told) - times(of_i.mirrored, std::conj(told))) / product;
}

Complex Filtered::missing(Complex jumps, Complex mirrored) const
{
    return -(times(of_v.of, jumps) + times(of_v.mirrored, mirrored));
}

}  // namespace dqw
