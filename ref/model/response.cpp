#include "ref/model/response.hpp"

#include <ceres/jet.h>

#include <algorithm>
#include <cmath>

namespace dqw {
namespace {

using Jet = ceres::Jet<double, 3>;

double part(double x, int) { return x; }
double part(const Jet& x, int n) { return n == 0 ? x.a : x.v[n - 1]; }

/// h cot h; error below 1e-11 for |h| < 0.5. `T` is double or a ceres::Jet.
template <typename T> T h_cot_h(const T& h)
{
    using std::cos;
    using std::sin;
    const T s = h * h;
    if (s < T(0.25))
        return 1.0 -
               s * (1.0 / 3.0 +
                    s * (1.0 / 45.0 +
                         s * (2.0 / 945.0 + s * (1.0 / 4725.0 + s * (2.0 / 93555.0 + s * (1382.0 / 638512875.0))))));
    return h * cos(h) / sin(h);
}

/// Terms of the series of advance_flux() whose truncation is below 1e-10 of the state, for `rate_dt` =
/// (max(R/L) + |w_e|) dt: rate_dt^n / n! < 1e-10. At most 60, enough up to rate_dt = 15.
int series_order(double rate_dt)
{
    int n = 1;
    for (double term = rate_dt; n < 60 && !(term < 1e-10); term *= rate_dt / n) ++n;
    return n;
}

/// Advances x = (L_d i_d, L_q i_q), Wb, over dt of (P6), (P7) by their Taylor series:
///   x_d' = v_d - a x_d + w x_q,   x_q' = v_q - b x_q - w x_d - w psi,   a = R/L_d, b = R/L_q, 1/s; w = w_e, rad/s
/// The voltage is held in the stationary frame: seen from the rotor it turns by -w t, and (v_d, v_q) are its means over
/// dt, so at the start it is v e^(jh) / sinc h = v (h cot h + j h) with h = w dt / 2.
/// `rotor_held`: it turns with the rotor, and is v all along. Cost: 10 order products of a Jet.
template <typename T>
void advance_flux(T& x_d, T& x_q, const T& a_dt, const T& b_dt, const T& psi, const T& w_dt, double v_d, double v_q,
                  double dt, bool rotor_held, int order)
{
    const T h = rotor_held ? T(0.0) : 0.5 * w_dt, w_u = 2.0 * h;
    const T c = h_cot_h(h);
    T u_d = dt * (v_d * c - v_q * h);
    T u_q = dt * (v_q * c + v_d * h);
    T c_d = u_d - a_dt * x_d + w_dt * x_q;
    T c_q = u_q - b_dt * x_q - w_dt * (x_d + psi);
    x_d += c_d;
    x_q += c_q;
    for (int n = 2; n <= order; ++n) {
        const double r = 1.0 / n;
        const T turned = w_u * u_q * (1.0 / (n - 1));
        u_q = -(w_u * u_d) * (1.0 / (n - 1));
        u_d = turned;
        const T next = (u_d - a_dt * c_d + w_dt * c_q) * r;
        c_q = (u_q - b_dt * c_q - w_dt * c_d) * r;
        c_d = next;
        x_d += c_d;
        x_q += c_q;
    }
}

/// Columns x_d, x_q, v_d, v_q, psi of one response after the other.
template <typename T>
void respond(const T& a_dt, const T& b_dt, const T& w_dt, double dt, bool rotor_held, int slopes, Responses& out)
{
    const int order = series_order(std::max(std::abs(part(a_dt, 0)), std::abs(part(b_dt, 0))) +
                                   std::abs(part(w_dt, 0)));
    for (std::size_t j = 0; j < 5; ++j) {
        T x_d(j == 0 ? 1.0 : 0.0), x_q(j == 1 ? 1.0 : 0.0);
        advance_flux(x_d, x_q, a_dt, b_dt, T(j == 4 ? 1.0 : 0.0), w_dt, j == 2 ? 1.0 : 0.0, j == 3 ? 1.0 : 0.0, dt,
                     rotor_held, order);
        for (int n = 0; n <= slopes; ++n) {
            Response& r = out[static_cast<std::size_t>(n)];
            r.of[2 * j] = part(x_d, n), r.of[2 * j + 1] = part(x_q, n);
        }
    }
}

}  // namespace

Responses Rates::at(double w_dt, double dt) const
{
    const double r_dt = resistance(dt > 0.0 ? w_dt / dt : 0.0) * dt;
    Responses out;
    if (slopes)
        respond(Jet(r_dt / Ld, 0), Jet(r_dt / Lq, 1), Jet(w_dt, 2), dt, rotor_held, 3, out);
    else
        respond(r_dt / Ld, r_dt / Lq, w_dt, dt, rotor_held, 0, out);
    return out;
}

ResponseTable::ResponseTable(const Rates& rates, double w_max, double dt)
    : slopes_(rates.slopes), dt_s_(dt), step_(2.0 * std::max(w_max * dt, 1e-9) / (kNodes - 3)), nodes_(kNodes)
{
    for (int n = 0; n < kNodes; ++n)
        nodes_[static_cast<std::size_t>(n)] = rates.at((n - 0.5 * (kNodes - 1)) * step_, dt);
}

Responses ResponseTable::at(double w_dt) const
{
    const double place = w_dt / step_ + 0.5 * (kNodes - 1);
    const int n = std::clamp(static_cast<int>(place), 1, kNodes - 3);
    const double u = place - n;
    const double c0 = -u * (u - 1) * (u - 2) / 6, c1 = (u + 1) * (u - 1) * (u - 2) / 2, c2 = -(u + 1) * u * (u - 2) / 2,
                 c3 = (u + 1) * u * (u - 1) / 6;
    const Responses* r = &nodes_[static_cast<std::size_t>(n - 1)];
    Responses out;
    for (std::size_t m = 0; m < (slopes_ ? out.size() : 1); ++m) {
        const auto &r0 = r[0][m].of, &r1 = r[1][m].of, &r2 = r[2][m].of, &r3 = r[3][m].of;
        for (std::size_t j = 0; j < r0.size(); ++j) out[m].of[j] = c0 * r0[j] + c1 * r1[j] + c2 * r2[j] + c3 * r3[j];
    }
    return out;
}

}  // namespace dqw
