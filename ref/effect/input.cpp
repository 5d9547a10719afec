#include "ref/effect/input.hpp"

#include <algorithm>
#include <cmath>

namespace dqw {
namespace {

constexpr double kRoot3 = 1.7320508075688772, kLn2 = 0.6931471805599453;

/// Beyond it tanh differs from +-1 by 2 e^-40 = 8e-18, less than a double's last place.
constexpr double kOne = 20.0;
/// Of a difference of two points, below which a mean between them is that of the points to 1e-7 (its square over 12),
/// and the quotient of differences loses digits.
constexpr double kLeastStep = 1e-3;

/// tanh with the error of one exp.
double fast_tanh(double x)
{
    if (x > kOne) return 1.0;
    if (x < -kOne) return -1.0;
    return 1.0 - 2.0 / (std::exp(2.0 * x) + 1.0);
}

struct Phases {
    double a, b, c;
};

/// The moment seen with the angle that it lacks; `m` holds it where it differs.
const Moment& turned(const Input& input, const Moment& at, Moment& m)
{
    if (input.shape[1] == 0.0) return at;
    m = at;
    const double c = std::cos(input.shape[1]), s = std::sin(input.shape[1]);
    m.cos_e = c * at.cos_e - s * at.sin_e, m.sin_e = s * at.cos_e + c * at.sin_e;
    m.past_alpha = c * at.past_alpha - s * at.past_beta, m.past_beta = s * at.past_alpha + c * at.past_beta;
    m.bow_alpha = c * at.bow_alpha - s * at.bow_beta, m.bow_beta = s * at.bow_alpha + c * at.bow_beta;
    return m;
}

Phases phases_of(double alpha, double beta)
{
    return {alpha, 0.5 * (kRoot3 * beta - alpha), -0.5 * (kRoot3 * beta + alpha)};
}
Phases phases_of(const Moment& at)
{
    return phases_of(at.cos_e * at.i_d - at.sin_e * at.i_q, at.sin_e * at.i_d + at.cos_e * at.i_q);
}

/// tanh and ln cosh by one exponential.
struct Soft {
    double x, tanh, log_cosh;
    explicit Soft(double at) : x(at)
    {
        const double size = std::abs(x), e = size < kOne ? std::exp(-2.0 * size) : 0.0;
        tanh = std::copysign((1.0 - e) / (1.0 + e), x);
        log_cosh = size - kLn2 + (e > 0.0 ? std::log1p(e) : 0.0);
    }
};

/// Mean of tanh over a current that goes evenly from one to the other, and its slope by the second.
struct MeanTanh {
    double mean, by_from, by_to;
    MeanTanh(const Soft& from, const Soft& to)
    {
        const double step = to.x - from.x;
        if (std::abs(step) < kLeastStep) {
            mean = 0.5 * (from.tanh + to.tanh), by_from = by_to = 0.5 * (1.0 - mean * mean);
        } else {
            mean = (to.log_cosh - from.log_cosh) / step, by_from = (mean - from.tanh) / step,
            by_to = (to.tanh - mean) / step;
        }
    }
};

/// The same over a bow, two lines by a point off the middle; the slope by its end.
struct Bowed {
    double mean, by_end;
    Bowed(double x, double bow, double y)
    {
        const Soft from(x), middle(0.5 * (x + y) + bow), to(y);
        const MeanTanh first(from, middle), second(middle, to);
        mean = 0.5 * (first.mean + second.mean);
        by_end = 0.5 * (second.by_to + 0.5 * (first.by_to + second.by_from));
    }
};

Vector2 to_dq(const Moment& at, double alpha, double beta)
{
    return {at.cos_e * alpha + at.sin_e * beta, at.cos_e * beta - at.sin_e * alpha};
}

Vector2 of_phases(const Moment& at, double a, double b, double c)
{
    return to_dq(at, (2.0 * a - b - c) / 3.0, (b - c) / kRoot3);
}

double beyond(double i, double limit) { return i > limit ? i - limit : i < -limit ? i + limit : 0.0; }

/// [dd dq qd qq] of of_phases(u(a), u(b), u(c)), from the slopes of u.
void phase_slopes(const Moment& at, double a, double b, double c, double out[4])
{
    // Of (alpha, beta), then turned to dq.
    const double aa = (4.0 * a + b + c) / 6.0, bb = 0.5 * (b + c), ab = (c - b) / (2.0 * kRoot3);
    const double cc = at.cos_e, ss = at.sin_e, mixed = cc * ss * (bb - aa) + (cc * cc - ss * ss) * ab;
    out[0] = cc * cc * aa + 2.0 * cc * ss * ab + ss * ss * bb;
    out[1] = out[2] = mixed;
    out[3] = ss * ss * aa - 2.0 * cc * ss * ab + cc * cc * bb;
}

/// The sensor says i + o: f = -R o, g = -L o.
void sensor(const Moment& at, Vector2 o, Vector2& f, Vector2& g)
{
    f = {-at.R * o.d, -at.R * o.q};
    g = {-at.Ld * o.d, -at.Lq * o.q};
}

void saturation(const Input& input, const Moment& at, Vector2 g[])
{
    const double x = at.i_d / input.shape[0], y = at.i_q / input.shape[0];
    g[0].d = x * x, g[1].d = x * x * x, g[2].d = x * x * x * x;
    g[3].q = y * y * y, g[4].q = y * y * y * y * y;
}

void cross_saturation(const Input& input, const Moment& at, Vector2 g[])
{
    const double x = at.i_d / input.shape[0], y = at.i_q / input.shape[0];
    g[0] = {y * y, 2.0 * x * y};
    g[1] = {2.0 * x * y * y, 2.0 * x * x * y};
    g[2] = {y * y * y * y, 4.0 * x * y * y * y};
}

/// A voltage late by `late` periods, of a settled point by `late` seconds, (E51); its slope by them.
struct Late {
    Vector2 f, slope;
    Late(const Moment& at, double late)
    {
        if (at.settled) {
            const double c = std::cos(at.w_e * late), s = std::sin(at.w_e * late);
            f = {(1.0 - c) * at.v_end_d - s * at.v_end_q, (1.0 - c) * at.v_end_q + s * at.v_end_d};
            slope = {at.w_e * (s * at.v_end_d - c * at.v_end_q), at.w_e * (s * at.v_end_q + c * at.v_end_d)};
            return;
        }
        for (int n = 0; n < kPast && (n == 0 || late > n); ++n) {
            const double part = n + 1 < kPast ? std::min(late - n, 1.0) : late - n, inside = std::clamp(part, 0.0, 1.0);
            const auto add = [&](double change, double rate, double& sum, double& by) {
                // What the first part of a period brings has decayed more at its end than the mean has.
                const double fade = 0.5 * rate * at.period_s;
                sum += part * (1.0 - fade * (1.0 - inside)) * change;
                if (part < 1.0 || n + 1 == kPast) by = (1.0 - fade * (1.0 - 2.0 * inside)) * change;
            };
            add(at.change[n].d, at.R / at.Ld, f.d, slope.d);
            add(at.change[n].q, at.R / at.Lq, f.q, slope.q);
        }
    }
};

}  // namespace

int free_shapes_of(const Input& input) { return free_of(effect_of(input.law).shape) + (input.free_angle ? 1 : 0); }

void evaluate(const Input& input, const Moment& at, Vector2 f[kMostWeights], Vector2 g[kMostWeights],
              const double weights[])
{
    for (int j = 0; j < weights_of(input.law); ++j) f[j] = g[j] = {};
    switch (input.law) {
    case Law::dead_time: {
        Moment seen;
        const Moment& m = turned(input, at, seen);
        if (at.starts) break;
        const Phases p = phases_of(m);
        const double k = 1.0 / input.shape[0];
        if (at.ends) {
            const Phases x = phases_of(m.past_alpha, m.past_beta), bow = phases_of(m.bow_alpha, m.bow_beta);
            const auto twice = [&](double from, double by, double to) {
                return 2.0 * Bowed(k * from, k * by, k * to).mean;
            };
            f[0] = of_phases(m, twice(x.a, bow.a, p.a), twice(x.b, bow.b, p.b), twice(x.c, bow.c, p.c));
        } else {
            f[0] = of_phases(m, fast_tanh(k * p.a), fast_tanh(k * p.b), fast_tanh(k * p.c));
        }
        break;
    }
    case Law::saturation: saturation(input, at, g); break;
    case Law::cross_saturation: cross_saturation(input, at, g); break;
    case Law::winding_temperature: f[0] = {at.heat_K * (at.i_d + at.bow_d), at.heat_K * at.i_q}; break;
    case Law::magnet_temperature: g[0].d = at.heat_K; break;
    case Law::iron_loss:
        g[0] = {-at.Ld * (at.v_end_d - at.R * at.i_d), -at.Lq * (at.v_end_q - at.R * at.i_q)};
        if (!at.settled) f[0] = {0.5 * at.R * at.change[0].d, 0.5 * at.R * at.change[0].q};
        break;
    case Law::flux_harmonics: {
        double c = at.cos_e, s = at.sin_e, cn = 1.0, sn = 0.0;
        for (int n = static_cast<int>(input.shape[0]); n > 0; n /= 2) {
            if (n % 2 != 0) {
                const double turned = cn * c - sn * s;
                sn = sn * c + cn * s, cn = turned;
            }
            const double doubled = c * c - s * s;
            s = 2.0 * c * s, c = doubled;
        }
        g[0].d = cn, g[1].d = sn, g[2].q = cn, g[3].q = sn;
        break;
    }
    case Law::current_offset:
        sensor(at, to_dq(at, 1.0, 0.0), f[0], g[0]);
        sensor(at, to_dq(at, 0.0, 1.0), f[1], g[1]);
        break;
    case Law::current_gain_mismatch: {
        const double alpha = at.cos_e * at.i_d - at.sin_e * at.i_q, beta = at.sin_e * at.i_d + at.cos_e * at.i_q;
        sensor(at, to_dq(at, alpha, -beta), f[0], g[0]);
        sensor(at, to_dq(at, beta, alpha), f[1], g[1]);
        break;
    }
    case Law::angle_offset: g[0] = {(at.Lq - at.Ld) * at.i_q, (at.Lq - at.Ld) * at.i_d - at.psi}; break;
    case Law::delay: f[0] = Late(at, weights ? weights[0] : 0.0).slope; break;
    case Law::skin_effect: f[0] = {at.w_e * at.w_e * (at.i_d + at.bow_d), at.w_e * at.w_e * at.i_q}; break;
    case Law::phase_resistance_imbalance: {
        const double i_d = at.i_d + at.bow_d;
        const Phases p = phases_of(at.cos_e * i_d - at.sin_e * at.i_q, at.sin_e * i_d + at.cos_e * at.i_q);
        f[0] = of_phases(at, p.a, 0.0, 0.0);
        f[1] = of_phases(at, 0.0, p.b, 0.0);
        break;
    }
    case Law::voltage_offset: f[0].d = f[1].q = 1.0 / at.mean_of_held; break;
    case Law::clipped_current: {
        Moment seen;
        const Moment& m = turned(input, at, seen);
        const Phases p = phases_of(m);
        const double limit = input.shape[0];
        const Vector2 missing = of_phases(m, 3.0 * beyond(p.a, limit), 3.0 * beyond(p.b, limit),
                                          3.0 * beyond(p.c, limit));
        sensor(at, {-missing.d, -missing.q}, f[0], g[0]);
        break;
    }
    default: break;
    }
}

void evaluate_sum(const Input& input, const double weights[], const Moment& at, Vector2& f, Vector2& g)
{
    if (input.law == Law::angle_offset) {
        const double c = std::cos(weights[0]), s = std::sin(weights[0]);
        const double flux_d = at.Ld * (c * at.i_d - s * at.i_q) + at.psi, flux_q = at.Lq * (s * at.i_d + c * at.i_q);
        g.d += c * flux_d + s * flux_q - at.Ld * at.i_d - at.psi;
        g.q += c * flux_q - s * flux_d - at.Lq * at.i_q;
        return;
    }
    if (input.law == Law::delay) {
        const Late late(at, weights[0]);
        f.d += late.f.d, f.q += late.f.q;
        return;
    }
    Vector2 each_f[kMostWeights], each_g[kMostWeights];
    evaluate(input, at, each_f, each_g);
    for (int j = 0; j < weights_of(input.law); ++j) {
        f.d += weights[j] * each_f[j].d, f.q += weights[j] * each_f[j].q;
        g.d += weights[j] * each_g[j].d, g.q += weights[j] * each_g[j].q;
    }
}

void evaluate_slope(const Input& input, const double weights[], const Moment& at, double f_slope[4], double g_slope[4])
{
    switch (input.law) {
    case Law::dead_time: {
        Moment seen;
        const Moment& m = turned(input, at, seen);
        const Phases p = phases_of(m);
        const double k = 1.0 / input.shape[0];
        const Phases x = phases_of(m.past_alpha, m.past_beta), bow = phases_of(m.bow_alpha, m.bow_beta);
        const auto slope = [&](double from, double by, double to) {
            if (at.ends) return 2.0 * weights[0] * k * Bowed(k * from, k * by, k * to).by_end;
            const double t = fast_tanh(k * to);
            return weights[0] * k * (1.0 - t * t);
        };
        double out[4];
        phase_slopes(m, slope(x.a, bow.a, p.a), slope(x.b, bow.b, p.b), slope(x.c, bow.c, p.c), out);
        for (int j = 0; j < 4; ++j) f_slope[j] += out[j];
        break;
    }
    case Law::saturation: {
        const double k = 1.0 / input.shape[0], x = k * at.i_d, y = k * at.i_q;
        g_slope[0] += k * x * (2.0 * weights[0] + x * (3.0 * weights[1] + 4.0 * x * weights[2]));
        g_slope[3] += k * y * y * (3.0 * weights[3] + 5.0 * y * y * weights[4]);
        break;
    }
    case Law::cross_saturation: {
        const double k = 1.0 / input.shape[0], x = k * at.i_d, y = k * at.i_q;
        g_slope[0] += k * 2.0 * weights[1] * y * y;
        const double mixed = k * y * (2.0 * weights[0] + 4.0 * weights[1] * x + 4.0 * weights[2] * y * y);
        g_slope[1] += mixed, g_slope[2] += mixed;
        g_slope[3] += k * x * (2.0 * weights[0] + 2.0 * weights[1] * x + 12.0 * weights[2] * y * y);
        break;
    }
    case Law::clipped_current: {
        Moment seen;
        const Moment& m = turned(input, at, seen);
        const Phases p = phases_of(m);
        const auto slope = [&](double i) { return std::abs(i) > input.shape[0] ? 3.0 * weights[0] : 0.0; };
        double out[4];
        phase_slopes(m, slope(p.a), slope(p.b), slope(p.c), out);
        f_slope[0] += at.R * out[0], f_slope[1] += at.R * out[1], f_slope[2] += at.R * out[2],
            f_slope[3] += at.R * out[3];
        g_slope[0] += at.Ld * out[0], g_slope[1] += at.Ld * out[1], g_slope[2] += at.Lq * out[2],
            g_slope[3] += at.Lq * out[3];
        break;
    }
    default: break;
    }
}

void evaluate_torque(const Input& input, double w_m, double theta_m, double torque[kMostWeights])
{
    switch (input.law) {
    case Law::coulomb_friction: torque[0] = fast_tanh(w_m / input.shape[0]); break;
    case Law::direction_asymmetry: torque[0] = std::abs(fast_tanh(w_m / input.shape[0])); break;
    case Law::stribeck_friction: {
        const double part = w_m / input.shape[1];
        torque[0] = fast_tanh(w_m / input.shape[0]) * std::exp(-part * part);
        break;
    }
    case Law::cogging_torque:
        torque[0] = std::cos(input.shape[0] * theta_m);
        torque[1] = std::sin(input.shape[0] * theta_m);
        break;
    case Law::load_torque: torque[0] = 1.0; break;
    default: break;
    }
}

}  // namespace dqw
