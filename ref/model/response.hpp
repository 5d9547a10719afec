// The flux at the end of a sampling period, linear in the flux at its start, the mean voltage and psi (E40), tabulated
// over the speed.
#ifndef DQW_REF_MODEL_RESPONSE_HPP
#define DQW_REF_MODEL_RESPONSE_HPP

#include <vector>

#include "ref/effect/input.hpp"

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
inline Matrix2 operator+(const Matrix2& a, const Matrix2& b)
{
    return {a.dd + b.dd, a.dq + b.dq, a.qd + b.qd, a.qq + b.qq};
}
inline Matrix2 operator*(double k, const Matrix2& a) { return {k * a.dd, k * a.dq, k * a.qd, k * a.qq}; }
inline Vector2 operator+(const Vector2& a, const Vector2& b) { return {a.d + b.d, a.q + b.q}; }
inline Vector2 operator-(const Vector2& a, const Vector2& b) { return {a.d - b.d, a.q - b.q}; }
inline Vector2 operator*(double k, const Vector2& a) { return {k * a.d, k * a.q}; }
inline double determinant(const Matrix2& a) { return a.dd * a.qq - a.dq * a.qd; }
inline Matrix2 inverse(const Matrix2& a)
{
    const double k = 1.0 / determinant(a);
    return {k * a.qq, -k * a.dq, -k * a.qd, k * a.dd};
}
inline Matrix2 turn(double c, double s) { return {c, -s, s, c}; }

/// x_{k+1} = A x_k + B v + C psi over one period, by columns x_d, x_q, v_d, v_q, psi.
struct Response {
    std::array<double, 10> of;

    Matrix2 A() const { return {of[0], of[2], of[1], of[3]}; }
    Matrix2 B() const { return {of[4], of[6], of[5], of[7]}; }
    Vector2 C() const { return {of[8], of[9]}; }
    Vector2 operator()(Vector2 x, Vector2 v, double psi) const { return A() * x + B() * v + psi * C(); }
};

/// The response at one speed, and, where they were asked for, its slopes by R dt/L_d, R dt/L_q and w_e dt.
using Responses = std::array<Response, 4>;

/// What a response depends on beside speed and period; `skin` w_e^2 more of the resistance. `rotor_held`: the voltage
/// turns with the rotor.
struct Rates {
    double R, Ld, Lq, skin;
    bool rotor_held, slopes;
    /// Resistance at a speed.
    double resistance(double w_e) const { return R + skin * w_e * w_e; }
    Responses at(double w_dt, double dt) const;
};

/// The responses over the speed, tabulated: smooth in it, so a cubic between 256 nodes is exact to 1e-9.
class ResponseTable {
public:
    static constexpr int kNodes = 256;

    ResponseTable(const Rates& rates, double w_max, double dt);
    double dt_s() const { return dt_s_; }
    Responses at(double w_dt) const;

private:
    bool slopes_;
    double dt_s_, step_;
    std::vector<Responses> nodes_;
};

}  // namespace dqw
#endif
