// One PWM period of the plain machine, exactly enough.
#ifndef DQW_REF_MODEL_PERIOD_HPP
#define DQW_REF_MODEL_PERIOD_HPP

#include <cmath>

namespace dqw {

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
inline int series_order(double rate_dt)
{
    int n = 1;
    for (double term = rate_dt; n < 60 && !(term < 1e-10); term *= rate_dt / n) ++n;
    return n;
}

/// Advances x = (L_d i_d, L_q i_q), Wb, over dt of (P6), (P7) by their Taylor series:
///   x_d' = v_d - a x_d + w x_q,   x_q' = v_q - b x_q - w x_d - w psi,   a = R/L_d, b = R/L_q, 1/s; w = w_e, rad/s
/// The voltage is held in the stationary frame: seen from the rotor it turns by -w t, and (v_d, v_q) are its means over
/// dt, so at the start it is v e^(jh) / sinc h = v (h cot h + j h) with h = w dt / 2.
/// T: double or Jet. W: type of the speed, double where the pole pairs are known. Cost: 10 order products of a Jet.
template <typename T, typename W>
inline void advance_flux(T& x_d, T& x_q, const T& a_dt, const T& b_dt, const T& psi, const W& w_dt, double v_d,
                         double v_q, double dt, int order)
{
    const W h = 0.5 * w_dt;
    const W c = h_cot_h(h);
    W u_d = dt * (v_d * c - v_q * h);
    W u_q = dt * (v_q * c + v_d * h);
    T c_d = u_d - a_dt * x_d + w_dt * x_q;
    T c_q = u_q - b_dt * x_q - w_dt * (x_d + psi);
    x_d += c_d;
    x_q += c_q;
    for (int n = 2; n <= order; ++n) {
        const double r = 1.0 / n;
        const W turned = w_dt * u_q * (1.0 / (n - 1));
        u_q = -(w_dt * u_d) * (1.0 / (n - 1));
        u_d = turned;
        const T next = (u_d - a_dt * c_d + w_dt * c_q) * r;
        c_q = (u_q - b_dt * c_q - w_dt * c_d) * r;
        c_d = next;
        x_d += c_d;
        x_q += c_q;
    }
}

}  // namespace dqw
#endif
