// The flux at the end of a sampling period, linear in the flux at its start, the mean voltage and psi (E40), tabulated
// over the speed.
#ifndef DQW_REF_SEARCH_RESPONSE_HPP
#define DQW_REF_SEARCH_RESPONSE_HPP

#include <algorithm>
#include <array>
#include <cmath>

#include "ref/effect/input.hpp"
#include "ref/model/period.hpp"

namespace dqw {

struct Matrix2 {
    double dd = 0, dq = 0, qd = 0, qq = 0;
};
inline Matrix2 operator*(const Matrix2& a, const Matrix2& b)
{
    return {a.dd * b.dd + a.dq * b.qd, a.dd * b.dq + a.dq * b.qq, a.qd * b.dd + a.qq * b.qd, a.qd * b.dq + a.qq * b.qq};
}
inline Vector2 operator*(const Matrix2& a, const Vector2& x)
{
    return {a.dd * x.d + a.dq * x.q, a.qd * x.d + a.qq * x.q};
}
inline Matrix2 inverse(const Matrix2& a)
{
    const double k = 1.0 / (a.dd * a.qq - a.dq * a.qd);
    return {k * a.qq, -k * a.dq, -k * a.qd, k * a.dd};
}
inline Matrix2 turn(double c, double s) { return {c, -s, s, c}; }

/// x_{k+1} = of x_k, v, psi over one period: [A | B | C] of (E40), by columns x_d, x_q, v_d, v_q, psi.
using Response = std::array<double, 10>;

inline Response response(double a, double b, double w_dt, double dt)
{
    Response r{};
    const int order = series_order((std::max(std::abs(a), std::abs(b))) * dt + std::abs(w_dt));
    for (std::size_t j = 0; j < 5; ++j) {
        double x_d = j == 0, x_q = j == 1;
        advance_flux(x_d, x_q, a * dt, b * dt, j == 4 ? 1.0 : 0.0, w_dt, j == 2 ? 1.0 : 0.0, j == 3 ? 1.0 : 0.0, dt,
                     order);
        r[2 * j] = x_d, r[2 * j + 1] = x_q;
    }
    return r;
}

/// The same for a voltage that turns with the rotor: B is the series of the integral of e^(Fs), A and C are unchanged.
inline Response response_rotor_held(double a, double b, double w_dt, double dt)
{
    Response r = response(a, b, w_dt, dt);
    const int order = series_order((std::max(std::abs(a), std::abs(b))) * dt + std::abs(w_dt));
    for (std::size_t j = 2; j < 4; ++j) {
        double c_d = j == 2 ? dt : 0.0, c_q = j == 3 ? dt : 0.0, x_d = c_d, x_q = c_q;
        for (int n = 2; n <= order; ++n) {
            const double next = (-a * dt * c_d + w_dt * c_q) / n;
            c_q = (-b * dt * c_q - w_dt * c_d) / n, c_d = next;
            x_d += c_d, x_q += c_q;
        }
        r[2 * j] = x_d, r[2 * j + 1] = x_q;
    }
    return r;
}

/// Resistance over inductance of each axis; `skin` w_e^2 more of the resistance.
struct Rates {
    double R, Ld, Lq, skin;
    bool rotor_held;
    Response at(double w_dt, double dt) const
    {
        const double w = dt > 0.0 ? w_dt / dt : 0.0, r = R + skin * w * w;
        return rotor_held ? response_rotor_held(r / Ld, r / Lq, w_dt, dt) : response(r / Ld, r / Lq, w_dt, dt);
    }
};

/// response() over the speed, tabulated: smooth in it, so a cubic between 256 nodes is exact to 1e-9.
class ResponseTable {
public:
    ResponseTable(const Rates& rates, double w_max, double dt)
        : rates_(rates), dt_(dt), step_(2.0 * std::max(w_max * dt, 1e-9) / (kNodes - 3))
    {
        if (!(dt > 0.0)) return;
        for (int n = 0; n < kNodes; ++n)
            nodes_[static_cast<std::size_t>(n)] = rates.at((n - 0.5 * (kNodes - 1)) * step_, dt);
    }
    Response at(double w_dt, double dt) const
    {
        if (!(dt_ > 0.0)) return rates_.at(w_dt, dt);
        const double place = w_dt / step_ + 0.5 * (kNodes - 1);
        const int n = std::clamp(static_cast<int>(place), 1, kNodes - 3);
        const double u = place - n;
        const double c0 = -u * (u - 1) * (u - 2) / 6, c1 = (u + 1) * (u - 1) * (u - 2) / 2,
                     c2 = -(u + 1) * u * (u - 2) / 2, c3 = (u + 1) * u * (u - 1) / 6;
        const Response *r0 = &nodes_[static_cast<std::size_t>(n - 1)], *r1 = r0 + 1, *r2 = r0 + 2, *r3 = r0 + 3;
        Response r;
        for (std::size_t j = 0; j < r.size(); ++j) r[j] = c0 * (*r0)[j] + c1 * (*r1)[j] + c2 * (*r2)[j] + c3 * (*r3)[j];
        return r;
    }

private:
    static constexpr int kNodes = 256;
    Rates rates_;
    double dt_, step_;
    std::array<Response, kNodes> nodes_;
};

}  // namespace dqw
#endif
