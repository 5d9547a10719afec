#include "ref/effect/input.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "ref/effect/edges.hpp"
#include "ref/effect/filter.hpp"
#include "ref/effect/pulses.hpp"

namespace dqw {
namespace {

constexpr double kRoot3 = 1.7320508075688772;

/// Beyond it tanh differs from +-1 by 2 e^-40 = 8e-18, less than a double's last place.
constexpr double kOne = 20.0;

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

/// A moment where it is not the one that is asked for: to make one costs more than most laws.
using Other = std::optional<Moment>;

/// The moment seen with the angle that it lacks; `m` holds it where it differs.
const Moment& turned(const Input& input, const Moment& at, Other& m)
{
    if (input.shape[1] == 0.0) return at;
    if (!m) m = at;
    const double c = std::cos(input.shape[1]), s = std::sin(input.shape[1]);
    const auto turn = [c, s](double& x, double& y) {
        const double of_x = x;
        x = c * of_x - s * y, y = s * of_x + c * y;
    };
    turn(m->cos_e, m->sin_e);
    turn(m->past_alpha, m->past_beta), turn(m->bow_alpha, m->bow_beta);
    turn(m->held_alpha, m->held_beta), turn(m->before_alpha, m->before_beta);
    return *m;
}

/// The moment as the legs have it: with the currents that flow, in the angle that it lacks. A controller gives back by
/// what it is told, and a mean over turns has none of a sensor's error. (E195)
const Moment& as_legs_have_it(const Input& input, const Moment& at, Other& m)
{
    const bool more = at.told_more.d != 0.0 || at.told_more.q != 0.0;
    if (!more || input.averaged) return turned(input, at, m);
    m = at;
    m->i_d -= at.told_more.d, m->i_q -= at.told_more.q;
    m->past_alpha -= at.past_more_alpha, m->past_beta -= at.past_more_beta;
    return turned(input, *m, m);
}

Phases phases_of(double alpha, double beta)
{
    return {alpha, 0.5 * (kRoot3 * beta - alpha), -0.5 * (kRoot3 * beta + alpha)};
}
Phases phases_of(const Moment& at)
{
    return phases_of(at.cos_e * at.i_d - at.sin_e * at.i_q, at.sin_e * at.i_d + at.cos_e * at.i_q);
}

Vector2 to_dq(const Moment& at, double alpha, double beta)
{
    return {at.cos_e * alpha + at.sin_e * beta, at.cos_e * beta - at.sin_e * alpha};
}

Vector2 of_phases(const Moment& at, double a, double b, double c)
{
    return to_dq(at, (2.0 * a - b - c) / 3.0, (b - c) / kRoot3);
}

/// The leg that rests in the period, or -1.
int resting_of(const Input& input, const Moment& m)
{
    const Phases v = phases_of(m.held_alpha, m.held_beta);
    const double each_V[3] = {v.a, v.b, v.c};
    return resting_leg(input.modulation, each_V);
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

/// Adds the slopes of that, of those of o.
void add_slope_of_sensor(const Moment& at, const double o[4], double f_slope[4], double g_slope[4])
{
    for (int col : {0, 1}) {
        f_slope[col] -= at.R * o[col], f_slope[2 + col] -= at.R * o[2 + col];
        g_slope[col] -= at.Ld * o[col], g_slope[2 + col] -= at.Lq * o[2 + col];
    }
}

/// The same of iron as it is bent at these currents.
void drawn(const Moment& at, Vector2 o, Vector2& f, Vector2& g)
{
    sensor(at, o, f, g);
    g.d -= at.bend_dd_H * o.d + at.bend_dq_H * o.q, g.q -= at.bend_dq_H * o.d + at.bend_qq_H * o.q;
}

/// What the winding lacks where the line has that much more, behind R.
Vector2 lost_flux(const Moment& at, Vector2 o)
{
    Vector2 f, g;
    drawn(at, o, f, g);
    return g;
}

/// What the iron has of the currents that are told. (E195)
Vector2 in_iron(const Moment& at) { return {at.i_d - at.told_more.d, at.i_q - at.told_more.q}; }

void saturation(const Input& input, const Moment& at, Vector2 g[])
{
    const Vector2 i = in_iron(at);
    const double x = i.d / input.shape[0], y = i.q / input.shape[0];
    g[0].d = x * x, g[1].d = x * x * x, g[2].d = x * x * x * x;
    g[3].q = y * y * y, g[4].q = y * y * y * y * y;
}

void cross_saturation(const Input& input, const Moment& at, Vector2 g[])
{
    const Vector2 i = in_iron(at);
    const double x = i.d / input.shape[0], y = i.q / input.shape[0];
    g[0] = {y * y, 2.0 * x * y};
    g[1] = {2.0 * x * y * y, 2.0 * x * x * y};
    g[2] = {y * y * y * y, 4.0 * x * y * y * y};
}

void mapped(const Input& input, const Moment& at, Vector2 g[])
{
    double psi_d[kMostWeights], psi_q[kMostWeights];
    const auto flux = input.law == Law::own_map ? own_flux : cross_flux;
    const Vector2 i = in_iron(at);
    flux(input.shape, i.d, i.q, psi_d, psi_q);
    for (int j = 0; j < weights_of(input.law); ++j) g[j] = {psi_d[j], psi_q[j]};
}

Vector2 plus(Vector2 a, double by, Vector2 b) { return {a.d + by * b.d, a.q + by * b.q}; }

/// What reaches the machine of a voltage at this sample; of a period's, over all of it.
Vector2 reaching(const Moment& at, Vector2 v) { return plus(plus(v, -1.0, at.lost), -1.0, at.lost_in_legs); }
Vector2 reaching_at_end(const Moment& at)
{
    return plus(reaching(at, {at.v_end_d, at.v_end_q}), -1.0, at.lost_at_edges);
}

/// The machine about these currents: incremental inductances, and the flux where their tangent meets no current.
struct Tangent {
    double R, d, q, dq = 0.0;
    Vector2 psi;

    explicit Tangent(const Moment& at) : R(at.R), d(at.Ld), q(at.Lq), psi{at.psi, 0.0}
    {
        const double by_d = d + at.bend_dd_H, by_q = q + at.bend_qq_H, mixed = at.bend_dq_H;
        if (!(std::min(by_d, by_q) > 0.0) || !(by_d * by_q > mixed * mixed)) return;
        d = by_d, q = by_q, dq = mixed, psi = plus(psi, 1.0, at.bent_Wb);
    }
    /// L^-1 times a flux, of currents; of a voltage, their slope.
    Vector2 currents(Vector2 flux) const
    {
        const double by = 1.0 / (d * q - dq * dq);
        return {by * (q * flux.d - dq * flux.q), by * (d * flux.q - dq * flux.d)};
    }
    /// Slope of the currents on the rotor's axes under a voltage; `part` of the flux without currents.
    Vector2 slope(double w_e, Vector2 v, Vector2 i, double part) const
    {
        const Vector2 flux{d * i.d + dq * i.q + part * psi.d, dq * i.d + q * i.q + part * psi.q};
        return currents({v.d - R * i.d + w_e * flux.q, v.q - R * i.q - w_e * flux.d});
    }
};

/// Of each leg at a period's end, what it loses of one volt the way its current flows, and its slope by the current
/// there; 0 of the one that rests.
struct Legs {
    double mean[3] = {}, by_end[3] = {};

    Legs(const Input& input, const Moment& m)
    {
        const Phases p = phases_of(m), x = phases_of(m.past_alpha, m.past_beta),
                     bow = phases_of(m.bow_alpha, m.bow_beta);
        const double now[3] = {p.a, p.b, p.c}, past[3] = {x.a, x.b, x.c}, by[3] = {bow.a, bow.b, bow.c};
        const double k = 1.0 / input.shape[0];
        const int rests = resting_of(input, m);
        for (int leg = 0; leg < 3; ++leg) {
            if (leg == rests) continue;
            const MeanLoss loss(input.loss, k * past[leg], k * by[leg], k * now[leg]);
            mean[leg] = loss.mean, by_end[leg] = k * loss.by_end;
        }
    }
};

double link_of(const Input& input, const Moment& m) { return input.shape[2] > 0.0 ? input.shape[2] : m.v_dc; }

/// Of each leg that switches, of one volt of `back_V` given back by the currents of the row before, as much as either
/// rail leaves room for.
void put_given_back(const Input& input, const Moment& m, const Duties& duty, double back_V, double (&part)[3])
{
    const Phases before = phases_of(m.before_alpha, m.before_beta);
    const double i_A[3] = {before.a, before.b, before.c}, link_V = link_of(input, m);
    for (int leg = 0; leg < 3; ++leg) {
        const double d = duty.of[leg];
        part[leg] = d > 0.0 && d < 1.0 ? LossAt(LossLaw::ramp, i_A[leg] / input.shape[3]).value : 0.0;
        if (!(link_V > 0.0) || back_V == 0.0) continue;
        part[leg] = (std::clamp(d + part[leg] * back_V / link_V, 0.0, 1.0) - d) * link_V / back_V;
    }
}

/// The period that starts at m, from its currents on, under `lost_V` less than the voltage told. (E172)
Pulsed pulsed(const Input& input, const Moment& m, Vector2 lost_V, double back_V)
{
    Pulsed out{};
    out.link_V = link_of(input, m), out.period_s = m.period_s;
    const auto put = [&](double alpha, double beta, double(&to)[3]) {
        const Phases p = phases_of(alpha, beta);
        to[0] = p.a, to[1] = p.b, to[2] = p.c;
    };
    const auto put_dq = [&](Vector2 x, double(&to)[3]) {
        put(m.cos_e * x.d - m.sin_e * x.q, m.sin_e * x.d + m.cos_e * x.q, to);
    };
    // On the rotor's axes, and then as seen from the stator, of a period.
    const Tangent iron(m);
    const Vector2 i{m.i_d, m.i_q}, slope = iron.slope(m.w_e, plus(m.v_now, -1.0, lost_V), i, 1.0),
                                   bend = iron.slope(m.w_e, {m.w_e * m.v_now.q, -m.w_e * m.v_now.d}, slope, 0.0);
    const double T = m.period_s, w = m.w_e;
    put_dq(i, out.i_A);
    put_dq({T * (slope.d - w * i.q), T * (slope.q + w * i.d)}, out.slope_A);
    put_dq({0.5 * T * T * (bend.d - 2.0 * w * slope.q - w * w * i.d),
            0.5 * T * T * (bend.q + 2.0 * w * slope.d - w * w * i.q)},
           out.bend_A);
    double each_V[3], last_V[3];
    put(m.held_alpha, m.held_beta, each_V);
    const Duties duty(input.modulation, each_V, out.link_V);
    std::copy(duty.of, duty.of + 3, out.duty);
    if (back_V != 0.0 && out.link_V > 0.0) {
        double part[3];
        put_given_back(input, m, duty, back_V, part);
        for (int leg = 0; leg < 3; ++leg) out.duty[leg] += part[leg] * back_V / out.link_V;
    }
    // The phases' axes half-way.
    const double h = 0.5 * w * T, c = std::cos(h), s = std::sin(h);
    double of_d[3], of_q[3];
    put_dq({c, s}, of_d), put_dq({-s, c}, of_q);
    for (int k = 0; k < 3; ++k)
        for (int n = 0; n < 3; ++n)
            out.per_H[k][n] = 2.0 / 3.0 * (of_d[k] * of_d[n] / iron.d + of_q[k] * of_q[n] / iron.q);
    const int rests = resting_leg(input.modulation, each_V);
    if (rests < 0) return out;
    put_dq(plus(m.v_now, -std::cos(h), turned_by(h, m.change[0])), last_V);
    const int rested = resting_leg(input.modulation, last_V);
    if (rested != rests && each_V[rests] > 0.0) out.rises = rests;
    if (rested != rests && last_V[rested] > 0.0) out.falls = rested;
    return out;
}

/// What the legs that switch lose of one volt for weight j: the way their current flows, or whichever way it does, or
/// given back by what the current was.
Vector2 lost(const Input& input, const Moment& m, int j, double back_V = 0.0)
{
    // The mean of a period counts at one of its ends alone, and there twice.
    const double all = m.starts || m.ends ? 2.0 : 1.0;
    double u[3] = {};
    if (j == 0 && m.ends) {
        const Legs legs(input, m);
        for (int leg = 0; leg < 3; ++leg) u[leg] = all * legs.mean[leg];
        return of_phases(m, u[0], u[1], u[2]);
    }
    // What all three lose is none of a phase's.
    if (j == 1 && input.modulation == Modulation::centred) return {};
    if (j == 2) {
        const Phases v = phases_of(m.held_alpha, m.held_beta);
        const double each_V[3] = {v.a, v.b, v.c};
        put_given_back(input, m, Duties(input.modulation, each_V, link_of(input, m)), back_V, u);
        return of_phases(m, all * u[0], all * u[1], all * u[2]);
    }
    const Phases p = phases_of(m);
    const double i[3] = {p.a, p.b, p.c};
    const int rests = resting_of(input, m);
    for (int leg = 0; leg < 3; ++leg)
        if (leg != rests) u[leg] = j == 1 ? all : LossAt(input.loss, i[leg] / input.shape[0]).value;
    return of_phases(m, u[0], u[1], u[2]);
}

/// What legs that switch lose of one volt by the signs at their pulses' edges, and its slope by the currents, in a
/// period that starts at m, whose mean counts there alone, and twice.
Vector2 lost_at_edges(const Input& input, const Moment& m, const double weights[], double slope[4])
{
    const double back_V = weights && input.law == Law::dead_given_back ? -weights[2] : 0.0;
    Vector2 others;
    for (int j = 1; j < weights_of(input.law) && weights; ++j)
        others = plus(others, 0.5 * weights[j], lost(input, m, j, back_V));
    const Pulsed period = pulsed(input, m, others, back_V);
    if (!(period.link_V > 0.0)) return {};
    const EdgeLoss loss = lost_at_edges(period, weights ? weights[0] : 0.0, input.shape[0]);
    const double* const u = loss.mean;
    const double* const by = loss.by_start;
    if (slope != nullptr) phase_slopes(m, 2.0 * by[0], 2.0 * by[1], 2.0 * by[2], slope);
    // A dead time at either edge has the pulse late by half of one.
    const double turn = m.w_e * m.period_s / period.link_V;
    return plus({-turn * m.v_now.q, turn * m.v_now.d}, 2.0, of_phases(m, u[0], u[1], u[2]));
}

/// Mean over a turn, whatever the angle: where all legs switch, the first harmonic along the current.
Vector2 over_a_turn(const Input& input, const Moment& at, bool constant)
{
    const double i_A = std::hypot(at.i_d, at.i_q);
    if (!(i_A > 0.0)) return {};
    if (input.modulation == Modulation::centred) {
        const double along = first_harmonic(input.loss, i_A / input.shape[0]) / i_A;
        return {along * at.i_d, along * at.i_q};
    }
    // A leg's step falls within one of them: three legs are off by 2 pi/72 of their part at most.
    constexpr int kPoints = 72;
    // From the current on, so that the result does not depend on how the vectors lie.
    const double start = std::atan2(at.i_q, at.i_d);
    Vector2 sum;
    Moment m = at;
    for (int n = 0; n < kPoints; ++n) {
        const double angle = (n + 0.5) * 2.0 * M_PI / kPoints - start;
        m.cos_e = std::cos(angle), m.sin_e = std::sin(angle);
        m.held_alpha = m.cos_e * at.v_end_d - m.sin_e * at.v_end_q;
        m.held_beta = m.sin_e * at.v_end_d + m.cos_e * at.v_end_q;
        const Vector2 here = lost(input, m, constant ? 1 : 0);
        sum.d += here.d / kPoints, sum.q += here.q / kPoints;
    }
    return sum;
}

/// A voltage late by `late` periods, of a settled point by `late` seconds, (E51); its slope by them. `changes`: of a
/// vector that stands still, or that turns with the rotor.
struct Late {
    Vector2 f, slope;
    Late(const Moment& at, double late, const Vector2* changes)
    {
        if (at.settled) {
            const double c = std::cos(at.w_e * late), s = std::sin(at.w_e * late);
            f = {(1.0 - c) * at.v_end_d - s * at.v_end_q, (1.0 - c) * at.v_end_q + s * at.v_end_d};
            slope = {at.w_e * (s * at.v_end_d - c * at.v_end_q), at.w_e * (s * at.v_end_q + c * at.v_end_d)};
            return;
        }
        for (int n = 0; n < kFewPast && (n == 0 || late > n); ++n) {
            const double part = n + 1 < kFewPast ? std::min(late - n, 1.0) : late - n,
                         inside = std::clamp(part, 0.0, 1.0);
            const auto add = [&](double change, double rate, double& sum, double& by) {
                // What the first part of a period brings has decayed more at its end than the mean has.
                const double fade = 0.5 * rate * at.period_s;
                sum += part * (1.0 - fade * (1.0 - inside)) * change;
                if (part < 1.0 || n + 1 == kFewPast) by = (1.0 - fade * (1.0 - 2.0 * inside)) * change;
            };
            add(changes[n].d, at.R / at.Ld, f.d, slope.d);
            add(changes[n].q, at.R / at.Lq, f.q, slope.q);
        }
    }
};

/// What a current that was sampled `late` seconds after its row has more than at its row: back to third order, under
/// the voltage that acts between the two. (E116)
Vector2 sampled_late(const Moment& at, Vector2 v, double late)
{
    const double turn = -at.w_e * late, c = std::cos(turn), s = std::sin(turn);
    const Vector2 i{at.i_d, at.i_q}, then{c * i.d - s * i.q, s * i.d + c * i.q};
    if (at.settled) return {i.d - then.d, i.q - then.q};
    const Tangent iron(at);
    const double w = at.w_e;
    const Vector2 v_then{c * v.d - s * v.q, s * v.d + c * v.q},
        slope = iron.slope(w, v_then, then, 1.0), bend = iron.slope(w, {w * v_then.q, -w * v_then.d}, slope, 0.0),
        twist = iron.slope(w, {-w * w * v_then.d, -w * w * v_then.q}, bend, 0.0);
    const double by_2 = 0.5 * late * late, by_3 = by_2 * late / 3.0;
    const Vector2 row = plus(plus(plus(then, -late, slope), by_2, bend), -by_3, twist);
    return {i.d - row.d, i.q - row.q};
}

/// Of the voltage's jumps at the last rows, what has not come through a filter by this sample.
Vector2 on_the_way(const Moment& at, double tau_s)
{
    Vector2 missing;
    if (!(tau_s > 0.0)) return missing;
    const double kept = std::exp(-at.period_s / tau_s), half = 0.5 * at.w_e * at.period_s;
    double part = 1.0;
    // The row at which a period starts ends the one before: its last jump is one further back.
    for (int n = at.starts ? 1 : 0; n < at.past; ++n) missing = plus(missing, part *= kept, at.change[n]);
    return turned_by(at.starts ? half : -half, missing);
}

/// A filter as slow as the winding is none of a drive's: slower ones are taken as this part of it.
constexpr double kMostOfWinding = 0.9;

/// A filter of the currents beside what a voltage runs: all of it while that does not jump, less what of its jumps at the
/// last rows has not come through. (E117)
struct Behind {
    using Complex = std::complex<double>;

    Filtered filter;
    Complex run, run_by_d, run_by_q;

    Behind(const Moment& at, double tau) : Behind(at, tau, Tangent(at)) {}

private:
    Behind(const Moment& at, double tau, const Tangent& iron)
        : filter(iron.R, iron.d, iron.q, iron.dq, {iron.psi.d, iron.psi.q}, at.w_e, tau)
    {
        const double turn = at.w_e * at.period_s, half = 0.5 * turn,
                     kept = tau > 0.0 ? left_after(at.period_s / tau) : 0.0;
        if (kept > 0.0) {
            const Complex to_here = std::polar(std::cos(half), at.starts ? half : -half),
                          back = std::polar(1.0, -2.0 * turn);
            Complex turned = 1.0, jumps, mirrored;
            double part = 1.0;
            // The row at which a period starts ends the one before: its last jump is one further back.
            for (int n = at.starts ? 1 : 0; n < at.past; ++n) {
                turned = times(turned, back), part *= kept;
                jumps += part * Complex(at.change[n].d, at.change[n].q);
                mirrored += part * times(turned, {at.change[n].d, -at.change[n].q});
            }
            run = filter.missing(times(to_here, jumps), times(std::conj(to_here), mirrored));
        }
        const Vector2 v = reaching_at_end(at);
        run += filter.of_v({v.d, v.q}) + filter.constant;
        // What is induced goes on with the speed.
        const double by = tau * at.w_dot;
        run_by_d = by * filter.of_v({-iron.dq, iron.d}), run_by_q = by * filter.of_v({-iron.q, iron.dq});
        run += at.i_d * run_by_d + at.i_q * run_by_q + by * filter.of_v({-iron.psi.q, iron.psi.d});
    }
};

/// What of a filter's time constant a winding's response allows.
double within_winding(const Moment& at, double tau_s)
{
    return at.R > 0.0 ? std::min(tau_s, kMostOfWinding * std::min(at.Ld, at.Lq) / at.R) : tau_s;
}

/// What a filtered current has more than the true one. (E117)
Vector2 filtered(const Moment& at, double tau_s, double slope[4] = nullptr)
{
    using Complex = std::complex<double>;
    const Behind behind(at, within_winding(at, tau_s));
    const Complex told(at.i_d, at.i_q), more = told - behind.filter.current(told - behind.run);
    if (slope != nullptr) {
        const Complex by_d = 1.0 - behind.filter.current(1.0 - behind.run_by_d),
                      by_q = Complex(0.0, 1.0) - behind.filter.current(Complex(0.0, 1.0) - behind.run_by_q);
        slope[0] = by_d.real(), slope[1] = by_q.real(), slope[2] = by_d.imag(), slope[3] = by_q.imag();
    }
    return {more.real(), more.imag()};
}

/// What the true current has more than a filter of it would tell.
Vector2 late_current(const Moment& at, double tau_s)
{
    const Behind behind(at, within_winding(at, tau_s));
    const std::complex<double> i(at.i_d, at.i_q), late = i - (behind.filter.of_i(i) + behind.run);
    return {late.real(), late.imag()};
}

/// Of settled points: a conductance across the voltage behind R, or one whose current goes with the voltage's root, or
/// not at all with its size; those go to zero with it below a twentieth of shape[1]. (E175)
Vector2 settled_iron(const Input& input, const Moment& at)
{
    constexpr double kLeastPart = 0.05;
    const Vector2 v = reaching_at_end(at);
    const double d = v.d - at.R * at.i_d, q = v.q - at.R * at.i_q;
    double by = 1.0;
    if (input.shape[0] < 0.0) {
        const double size = std::max(std::hypot(d, q) / input.shape[1], kLeastPart);
        by = input.shape[0] == kHysteresis ? 1.0 / size : 1.0 / std::sqrt(size);
    }
    return lost_flux(at, {by * d, by * q});
}

/// What a filter tells, at the sample, of the pulses of the last periods beyond their mean voltages', each with duties of
/// its own, as a flux along the rotor's axes. (E168)
Vector2 filtered_pulses(const Input& pulses, double tau_s, const Moment& m)
{
    Other seen;
    const Moment& at = turned(pulses, m, seen);
    // Of its own size a pulse is beyond its mean by a quarter at most.
    constexpr double kLeastPart = 1e-3;
    const double link = pulses.shape[0] > 0.0 ? pulses.shape[0] : at.v_dc, half = 0.5 * at.w_e * at.period_s;
    const Angle to_here(at.starts ? half : -half);
    const FilteredPulse pulse(tau_s, at.period_s);
    double of[3] = {}, left = 1.0;
    // What is lost on the way turns along with the rotor, and its jumps are none of the duties'.
    const Angle back(-at.w_e * at.period_s);
    Vector2 reached{at.v_end_d - at.lost.d, at.v_end_q - at.lost.q}, lost = at.lost;
    for (int n = at.starts ? 1 : 0;; ++n) {
        const Vector2 v = plus(reached, 1.0, lost);
        const Phases p = phases_of(at.cos_e * v.d - at.sin_e * v.q, at.sin_e * v.d + at.cos_e * v.q);
        const double each_V[3] = {p.a, p.b, p.c};
        const Duties duty(pulses.modulation, each_V, link);
        const bool last = left * pulse.kept < kLeastPart || n + 1 >= at.past;
        const double part = last ? left : left * (1.0 - pulse.kept);
        for (int leg = 0; leg < 3; ++leg) of[leg] += part * link * pulse.beyond_mean(duty.of[leg]);
        if (last) return of_phases(at, of[0], of[1], of[2]);
        reached = plus(reached, -to_here.cos, to_here.on(at.change[n]));
        lost = back.on(lost), left *= pulse.kept;
    }
}

/// Of one siemens whose current follows in tau_s, what it carries of pulses at the sample beyond what it does of their
/// mean. (E181)
Vector2 pulsed_iron(const Moment& at, double tau_s)
{
    const Vector2 flux = filtered_pulses(*at.pulses, tau_s, at);
    return {flux.d / tau_s, flux.q / tau_s};
}

/// A conductance across the voltage behind R, whose current follows in shape[0] periods. What the line carries of it
/// within a period is not half-way between its ends. (E52)
void iron(const Input& input, const Moment& at, double siemens, Vector2& f, Vector2& g)
{
    if (at.settled) return void(g = settled_iron(input, at));
    const double periods = input.shape[0], kept = periods > 0.0 ? std::exp(-1.0 / periods) : 0.0;
    const double tau = periods * at.period_s + at.lag_s;
    // What has no memory goes by the voltage that acts when the currents are told.
    const bool of_next = at.later && !(periods > 0.0);
    const Vector2 v = of_next ? reaching(at, at.v_next) : plus(reaching_at_end(at), -1.0, on_the_way(at, tau));
    Vector2 e{v.d - at.R * at.i_d, v.q - at.R * at.i_q};
    if (periods > 0.0) {
        // What R takes of the winding's current is late as well.
        Moment winding = at;
        winding.i_d -= siemens * e.d, winding.i_q -= siemens * e.q;
        winding.v_end_d -= at.R * siemens * e.d, winding.v_end_q -= at.R * siemens * e.q;
        e = plus(e, at.R, late_current(winding, tau));
    }
    g = {-at.Ld * e.d, -at.Lq * e.q};
    if (of_next) {
        // R carried what this period's voltage made of it.
        if (at.ends) f = {at.R * (at.v_end_d - at.v_next.d), at.R * (at.v_end_q - at.v_next.q)};
        return;
    }
    const double beside = at.R * (0.5 * (1.0 + kept) - (1.0 - kept) * periods);
    double part = 1.0;
    for (int n = 0; n < at.past && part > 0.0; ++n, part *= kept) f = plus(f, beside * part, at.change[n]);
    if (at.pulses == nullptr || !(periods > 0.0) || !(tau > 0.0)) return;
    Vector2 of_f, of_g;
    drawn(at, pulsed_iron(at, tau), of_f, of_g);
    f = plus(f, 1.0, of_f), g = plus(g, 1.0, of_g);
}

bool turning_drives(const Input& input)
{
    return (input.law == Law::iron_loss || input.law == Law::turn_short) && input.shape[0] == kTurningAlone;
}

constexpr double kNone[3] = {}, kUnit[3][3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};

/// What the iron, or a short by its three weights, draws of a voltage. (E52), (E120)
struct Conductance {
    double dd, dq, qq;

    Conductance(const Input& input, const Moment& at, const double weights[]) : dd(weights[0]), dq(0.0), qq(weights[0])
    {
        if (input.law != Law::turn_short) return;
        const double c = at.cos_e * at.cos_e - at.sin_e * at.sin_e, s = 2.0 * at.cos_e * at.sin_e;
        const double even = weights[0] / 3.0, mirrored = (weights[1] * c + weights[2] * s) / 3.0;
        dd = even + mirrored, dq = (weights[2] * c - weights[1] * s) / 3.0, qq = even - mirrored;
    }
    Vector2 on(Vector2 v) const { return {dd * v.d + dq * v.q, dq * v.d + qq * v.q}; }
};

/// What the line has more where the turning flux alone drives a conductance M: `o = M w_e J (psi + L (i - o))`.
class DrawnByTurning {
public:
    DrawnByTurning(const Input& input, const Moment& at, const double weights[])
        : input_(input), at_(at), of_(input, at, weights),
          drawn_(less(of_.on(induced(at.Ld * at.i_d + at.psi, at.Lq * at.i_q))))
    {
    }
    Vector2 drawn() const { return drawn_; }
    Vector2 by_weight(int j) const
    {
        return less(Conductance(input_, at_, kUnit[j])
                        .on(induced(at_.Ld * (at_.i_d - drawn_.d) + at_.psi, at_.Lq * (at_.i_q - drawn_.q))));
    }
    Vector2 by_i_d() const { return less(of_.on(induced(at_.Ld, 0.0))); }
    Vector2 by_i_q() const { return less(of_.on(induced(0.0, at_.Lq))); }

    /// What the winding's flux then lacks: of iron without what bends it.
    Vector2 lacks(Vector2 o) const
    {
        if (input_.law == Law::turn_short) return lost_flux(at_, o);
        return {-at_.Ld * o.d, -at_.Lq * o.q};
    }

private:
    Vector2 induced(double flux_d, double flux_q) const { return {-at_.w_e * flux_q, at_.w_e * flux_d}; }
    /// Where what is drawn is missing in the flux.
    Vector2 less(Vector2 o) const
    {
        const Vector2 d = of_.on(induced(at_.Ld, 0.0)), q = of_.on(induced(0.0, at_.Lq));
        const double det = (1.0 + d.d) * (1.0 + q.q) - q.d * d.q;
        return {((1.0 + q.q) * o.d - q.d * o.q) / det, ((1.0 + d.d) * o.q - d.q * o.d) / det};
    }

    const Input& input_;
    const Moment& at_;
    Conductance of_;
    Vector2 drawn_;
};

/// Currents and voltage seen from a frame that is `angle` ahead of the rotor: the induced voltage lies elsewhere, and
/// with saliency the flux. (E116)
void seen_ahead(const Moment& at, double psi, double angle, Vector2& f, Vector2& g)
{
    const double e = at.w_e * psi / at.mean_of_held, c = std::cos(angle), s = std::sin(angle);
    f.d += e * s, f.q += e * (c - 1.0);
    // L in that frame less L.
    const double L = at.Lq - at.Ld, of_i = s * s * L, cross = c * s * L;
    g.d += of_i * at.i_d + cross * at.i_q, g.q += cross * at.i_d - of_i * at.i_q;
}

/// What the legs' pulses add to currents that a sensor tells `late_s` after the row, or behind a filter. (E168)
Vector2 of_pulses(const Input& input, double late_s, const Moment& m)
{
    if (input.law == Law::pulsed_lag) {
        const Vector2 flux = filtered_pulses(input, late_s, m);
        // R takes of its current over the filter's time.
        const Tangent iron(m);
        const Vector2 more = iron.currents(flux);
        return plus({-more.d, -more.q}, -iron.R * late_s, iron.currents(more));
    }
    Other seen;
    const Moment& at = turned(input, m, seen);
    const Vector2 v = at.v_next;
    const Phases p = phases_of(at.cos_e * v.d - at.sin_e * v.q, at.sin_e * v.d + at.cos_e * v.q);
    const double each_V[3] = {p.a, p.b, p.c}, link = input.shape[0] > 0.0 ? input.shape[0] : at.v_dc;
    const Duties duty(input.modulation, each_V, link);
    double Vs[3], Vs2[3];
    for (int leg = 0; leg < 3; ++leg) {
        Vs[leg] = link * pulse_beyond_mean(duty.of[leg], late_s, at.period_s);
        Vs2[leg] = link * pulse_moment(duty.of[leg], late_s, at.period_s);
    }
    // The flux stands still while the rotor turns on to the later instant, but for what R takes of its current.
    const double turn = at.w_e * late_s;
    const Tangent iron(at);
    const Vector2 flux = turned_by(-turn, of_phases(at, Vs[0], Vs[1], Vs[2])),
                  before = turned_by(-turn, of_phases(at, Vs2[0], Vs2[1], Vs2[2]));
    return turned_by(turn, iron.currents(plus(flux, -iron.R, iron.currents(before))));
}

/// What the pulses add is no part of the current that the mean voltage runs.
Moment without(Vector2 pulses, Moment at)
{
    at.i_d -= pulses.d, at.i_q -= pulses.q;
    return at;
}

Vector2 shifted_in_pulses(const Input& input, double late_s, const Moment& at)
{
    const Vector2 more = of_pulses(input, late_s, at);
    return plus(more, 1.0, sampled_late(without(more, at), reaching(at, at.v_next), late_s));
}

Vector2 filtered_in_pulses(const Input& input, double tau_s, const Moment& at, double slope[4] = nullptr)
{
    const Vector2 more = of_pulses(input, tau_s, at);
    return plus(more, 1.0, filtered(without(more, at), tau_s, slope));
}

/// What a voltage in pulses leaves of the flux that its mean would bring, and what currents that swing about the mean
/// voltage's add to it where iron bends, as a voltage. (E169), (E180)
Vector2 bent_by_pulses(const Input& input, const Moment& m)
{
    Other seen;
    const Moment& at = turned(input, m, seen);
    const Phases v = phases_of(at.held_alpha, at.held_beta);
    const double each_V[3] = {v.a, v.b, v.c}, link = input.shape[0] > 0.0 ? input.shape[0] : at.v_dc;
    const Duties duty(input.modulation, each_V, link);
    double of[3];
    for (int leg = 0; leg < 3; ++leg) of[leg] = link * second_moment(duty.of[leg]);
    const Vector2 u = of_phases(at, of[0], of[1], of[2]);
    // What the iron has at these currents; as the machine has it where that is none.
    double L_d = at.Ld + at.bend_dd_H, L_q = at.Lq + at.bend_qq_H, L_dq = at.bend_dq_H;
    const bool bends = std::min(L_d, L_q) > 0.0 && L_d * L_q > L_dq * L_dq;
    if (!bends) L_d = at.Ld, L_q = at.Lq, L_dq = 0.0;
    const double by = 1.0 / (L_d * L_q - L_dq * L_dq), d = by * L_q, q = by * L_d, dq = -by * L_dq,
                 half = -0.5 * at.period_s * at.period_s, R = at.R, w = at.w_e;
    const double dd = R * (d * d + dq * dq) - 2.0 * w * dq, qq = R * (q * q + dq * dq) + 2.0 * w * dq,
                 mixed = R * dq * (d + q) + w * (d - q);
    Vector2 f{half * R * (dd * u.d + mixed * u.q), half * R * (mixed * u.d + qq * u.q)};
    const auto is_none = [](double x) { return x == 0.0; };
    if (!bends ||
        (std::all_of(at.by_d_H_A, at.by_d_H_A + 3, is_none) && std::all_of(at.by_q_H_A, at.by_q_H_A + 3, is_none)))
        return f;
    // Each leg's flux about the way that it goes under the mean voltage, and of these the currents.
    double dd_Vs2 = 0.0, dq_Vs2 = 0.0, qq_Vs2 = 0.0;
    const Vector2 each[3] = {of_phases(at, 1, 0, 0), of_phases(at, 0, 1, 0), of_phases(at, 0, 0, 1)};
    for (const int j : {0, 1, 2})
        for (const int k : {0, 1, 2}) {
            const double mean = -2.0 * half * link * link * mean_product(duty.of[j], duty.of[k]);
            dd_Vs2 += mean * each[j].d * each[k].d, dq_Vs2 += mean * each[j].d * each[k].q;
            qq_Vs2 += mean * each[j].q * each[k].q;
        }
    const double s_dd = d * d * dd_Vs2 + 2.0 * d * dq * dq_Vs2 + dq * dq * qq_Vs2,
                 s_dq = d * dq * dd_Vs2 + (d * q + dq * dq) * dq_Vs2 + dq * q * qq_Vs2,
                 s_qq = dq * dq * dd_Vs2 + 2.0 * dq * q * dq_Vs2 + q * q * qq_Vs2;
    const double of_d = -0.5 * R * (at.by_d_H_A[0] * s_dd + 2.0 * at.by_d_H_A[1] * s_dq + at.by_d_H_A[2] * s_qq),
                 of_q = -0.5 * R * (at.by_q_H_A[0] * s_dd + 2.0 * at.by_q_H_A[1] * s_dq + at.by_q_H_A[2] * s_qq);
    f.d += d * of_d + dq * of_q, f.q += dq * of_d + q * of_q;
    return f;
}

void shifted(const Input& input, double shift_s, const Moment& at, Vector2& f, Vector2& g)
{
    switch (static_cast<Instant>(static_cast<int>(input.shape[0]))) {
    case Instant::currents_before:
    case Instant::currents_after: {
        const bool before = static_cast<Instant>(static_cast<int>(input.shape[0])) == Instant::currents_before;
        Vector2 of_f, of_g;
        const Vector2 v = reaching(at, before ? Vector2{at.v_end_d, at.v_end_q} : at.v_next);
        sensor(at, sampled_late(at, v, shift_s), of_f, of_g);
        f = plus(f, 1.0, of_f), g = plus(g, 1.0, of_g);
        break;
    }
    case Instant::angle: seen_ahead(at, at.psi - at.warm_Wb, at.w_e * shift_s, f, g); break;
    case Instant::voltage_turned:
        if (!at.settled) f = plus(f, 1.0, Late(at, shift_s / at.period_s, at.turned).f);
        break;
    case Instant::voltage_frame: f = plus(f, 1.0, plus(at.v_now, -1.0, turned_by(at.w_e * shift_s, at.v_now))); break;
    }
}

void lagging(const Input& input, double tau_s, const Moment& at, Vector2& f, Vector2& g)
{
    if (static_cast<Channel>(static_cast<int>(input.shape[0])) == Channel::speed) {
        const double by = tau_s * at.w_dot / at.mean_of_held;
        f.d -= by * at.Lq * at.i_q, f.q += by * (at.Ld * at.i_d + at.psi);
        return;
    }
    Vector2 of_f, of_g;
    sensor(at, filtered(at, tau_s), of_f, of_g);
    f = plus(f, 1.0, of_f), g = plus(g, 1.0, of_g);
}

/// The part of the voltage that a sagging link lacks, for one unit of the weight. (E118)
double lacking(const Input& input, const Moment& at)
{
    if (static_cast<Sag>(static_cast<int>(input.shape[0])) == Sag::by_its_column) return 1.0 - at.v_dc / input.shape[1];
    if (input.heat > 0) return at.state;
    return 1.5 * (at.v_now.d * at.i_d + at.v_now.q * at.i_q);
}

/// (E119): the angle that is seen is ahead by p (a cos + b sin) of n times the shaft's. What the frame turns faster by
/// is in the speed where that is the encoder's own, else it is not.
void eccentric(const Input& input, const double weights[], const Moment& at, Vector2& f, Vector2& g)
{
    const double p = input.shape[2], n = input.shape[0];
    const double c = n > 1.5 ? at.cos_m * at.cos_m - at.sin_m * at.sin_m : at.cos_m,
                 s = n > 1.5 ? 2.0 * at.cos_m * at.sin_m : at.sin_m;
    seen_ahead(at, at.psi, p * (weights[0] * c + weights[1] * s), f, g);
    const double faster = n * at.w_e * (weights[1] * c - weights[0] * s) / at.mean_of_held;
    if (input.shape[1] > 0.5)
        f.q -= faster * at.psi;
    else
        f.d -= faster * at.Lq * at.i_q, f.q += faster * at.Ld * at.i_d;
}

/// Of laws that are not linear: their slope by weight j, by difference.
template <typename Sum> void slope_by(double weights[], int j, double step, Sum&& sum, Vector2& f, Vector2& g)
{
    Vector2 f0, g0, f1, g1;
    const double at = weights[j];
    weights[j] = at - 0.5 * step, sum(f0, g0);
    weights[j] = at + 0.5 * step, sum(f1, g1);
    weights[j] = at;
    f = {(f1.d - f0.d) / step, (f1.q - f0.q) / step}, g = {(g1.d - g0.d) / step, (g1.q - g0.q) / step};
}

}  // namespace

bool loses_voltage(Law law) { return law == Law::voltage_offset || law == Law::voltage_scale; }

bool shifts_currents(const Input& input)
{
    return input.law == Law::pulsed_shift ||
           (input.law == Law::sample_shift &&
            static_cast<Instant>(static_cast<int>(input.shape[0])) <= Instant::currents_after);
}

bool tells_other_currents(const Input& input)
{
    return input.law == Law::current_offset || input.law == Law::current_gain_mismatch || shifts_currents(input) ||
           filters_currents(input);
}

bool asks_for_lost_in_legs(const Input& input) { return asks_for_lost(input) && input.law != Law::delay; }

bool asks_for_lost(const Input& input)
{
    return shifts_currents(input) || filters_currents(input) || input.law == Law::delay ||
           input.law == Law::iron_loss || input.law == Law::turn_short;
}

Vector2 turned_by(double angle, Vector2 x) { return Angle(angle).on(x); }

namespace {

/// Whether the rotor's axes matter to a law: not to what the stator's phases, a resistance or the voltage alone make.
bool lies_in_rotor(const Input& input)
{
    switch (input.law) {
    case Law::angle_offset:
    case Law::delay:
    case Law::phase_resistance_imbalance:
    case Law::skin_effect:
    case Law::voltage_offset:
    case Law::voltage_scale:
    case Law::winding_temperature: return false;
    case Law::dead_time:
    case Law::dead_clamped:
    case Law::dead_given_back: return input.loss == LossLaw::edges;
    default: return !shifts_angle(input);
    }
}

/// Adds what a matrix [dd dq qd qq] is in a frame that lies back by the angle of that cosine and sine.
void add_turned(double c, double s, const double of[4], double to[4])
{
    const double left[4] = {c * of[0] - s * of[2], c * of[1] - s * of[3], s * of[0] + c * of[2], s * of[1] + c * of[3]};
    to[0] += c * left[0] - s * left[1], to[1] += s * left[0] + c * left[1];
    to[2] += c * left[2] - s * left[3], to[3] += s * left[2] + c * left[3];
}

/// The same as the rotor sees it, whose induced voltage and inductances are not along the axes of an angle that is
/// ahead. (E179)
Moment in_rotors_frame(Moment m)
{
    const Angle ahead = m.ahead;
    m.ahead = Angle();
    const auto turn = [&ahead](double& d, double& q) {
        const Vector2 x = ahead.on({d, q});
        d = x.d, q = x.q;
    };
    turn(m.i_d, m.i_q), turn(m.v_end_d, m.v_end_q);
    for (Vector2* v : {&m.v_next, &m.v_now, &m.lost, &m.lost_in_legs, &m.lost_at_edges, &m.told_more})
        *v = ahead.on(*v);
    for (int n = 0; n < m.past; ++n) m.change[n] = ahead.on(m.change[n]);
    for (Vector2& v : m.turned) v = ahead.on(v);
    const Vector2 e = ahead.back({m.cos_e, m.sin_e});
    m.cos_e = e.d, m.sin_e = e.q;
    return m;
}

bool fits_link(const Input& input)
{
    return is_dead_time(input.law) && input.loss == LossLaw::edges && input.shape[2] > 0.0;
}

/// Eddies whose current follows in shape[0] periods.
bool follows_late(const Input& input) { return input.law == Law::iron_loss && input.shape[0] > 0.0; }

}  // namespace

int free_shapes_of(const Input& input)
{
    const Shape shape = effect_of(input.law).shape;
    const int free = shape == Shape::pulses && input.shape[0] > 0.0 ? 1 : free_of(shape);
    return free + (input.free_angle ? 1 : 0) + (fits_link(input) ? 1 : 0) + (shape == Shape::two_widths ? 1 : 0) +
           (follows_late(input) ? 1 : 0);
}

std::size_t free_shape_of(const Input& input, int n)
{
    // Pulses from a link that has its column leave the angle alone.
    const bool angle_first = effect_of(input.law).shape == Shape::pulses && !(input.shape[0] > 0.0);
    int at = n + (angle_first ? 1 : 0);
    if (!is_dead_time(input.law)) return static_cast<std::size_t>(at);
    if (at >= 1 && !input.free_angle) ++at;
    if (at >= 2 && !fits_link(input)) ++at;
    return static_cast<std::size_t>(at);
}

void evaluate(const Input& input, const Moment& at, Vector2 f[], Vector2 g[], const double weights[])
{
    const int count = weights_of(input.law);
    if (at.ahead.rad != 0.0 && lies_in_rotor(input)) {
        evaluate(input, in_rotors_frame(at), f, g, weights);
        for (int j = 0; j < count; ++j) f[j] = at.ahead.back(f[j]), g[j] = at.ahead.back(g[j]);
        return;
    }
    for (int j = 0; j < count; ++j) f[j] = g[j] = {};
    if (turning_drives(input)) {
        const DrawnByTurning turned(input, at, weights ? weights : kNone);
        for (int j = 0; j < count; ++j) g[j] = turned.lacks(turned.by_weight(j));
        return;
    }
    switch (input.law) {
    case Law::dead_time:
    case Law::dead_clamped:
    case Law::dead_given_back: {
        Other seen;
        const Moment& m = as_legs_have_it(input, at, seen);
        const bool edges = input.loss == LossLaw::edges;
        if (edges ? at.ends : at.starts) break;
        for (int j = 0; j < count; ++j)
            f[j] = input.averaged    ? over_a_turn(input, m, j > 0)
                   : edges && j == 0 ? lost_at_edges(input, m, weights, nullptr)
                                     : lost(input, m, j, j == 2 && weights ? -weights[2] : 0.0);
        break;
    }
    case Law::saturation: saturation(input, at, g); break;
    case Law::cross_saturation: cross_saturation(input, at, g); break;
    case Law::own_map:
    case Law::cross_map: mapped(input, at, g); break;
    case Law::winding_temperature: f[0] = {at.state * (at.i_d + at.bow_d), at.state * at.i_q}; break;
    case Law::magnet_temperature: g[0].d = at.state; break;
    case Law::iron_loss: iron(input, at, weights ? weights[0] : 0.0, f[0], g[0]); break;
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
    case Law::angle_offset: g[0] = {(at.Lq - at.Ld) * at.i_q, (at.Lq - at.Ld) * at.i_d - (at.psi - at.warm_Wb)}; break;
    case Law::delay: f[0] = Late(at, weights ? weights[0] : 0.0, at.change).slope; break;
    case Law::sample_shift:
    case Law::pulsed_shift:
    case Law::pulsed_lag:
    case Law::sensor_lag: {
        // Of a period, or of the time in which a radian passes: a difference bends by a millionth.
        constexpr double kStep = 1e-3;
        const double step = kStep * (at.settled ? 1.0 / (1.0 + std::abs(at.w_e)) : at.period_s);
        double w[1] = {weights ? weights[0] : 0.0};
        const auto sum = [&](Vector2& of_f, Vector2& of_g) { evaluate_sum(input, w, at, of_f, of_g); };
        slope_by(w, 0, step, sum, f[0], g[0]);
        break;
    }
    case Law::voltage_scale: f[0] = plus({}, lacking(input, at), at.v_now); break;
    case Law::turn_short: {
        const Vector2 late = at.lag_s > 0.0 ? on_the_way(at, at.lag_s) : Vector2{},
                      v = at.later ? reaching(at, at.v_next) : plus(reaching_at_end(at), -1.0, late);
        for (int j = 0; j < count; ++j) drawn(at, Conductance(input, at, kUnit[j]).on(v), f[j], g[j]);
        break;
    }
    case Law::encoder_eccentricity: {
        constexpr double kStep = 1e-5;  // rad
        double w[2] = {weights ? weights[0] : 0.0, weights ? weights[1] : 0.0};
        const auto sum = [&](Vector2& of_f, Vector2& of_g) { evaluate_sum(input, w, at, of_f, of_g); };
        for (int j : {0, 1}) slope_by(w, j, kStep, sum, f[j], g[j]);
        break;
    }
    case Law::magnet_asymmetry: {
        // As voltages: a difference of a noisy angle would be noise. (E121)
        const double e = at.w_e / at.mean_of_held, by = e / input.shape[2];
        f[0] = {-by * at.sin_m, e * at.cos_m}, f[1] = {by * at.cos_m, e * at.sin_m};
        break;
    }
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
        Other seen;
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

namespace {

template <int kMost>
void add_up(const Input& input, const double weights[], int count, const Moment& at, Vector2& f, Vector2& g)
{
    Vector2 each_f[kMost], each_g[kMost], of_f, of_g;
    evaluate(input, at, each_f, each_g, weights);
    for (int j = 0; j < count; ++j) of_f = plus(of_f, weights[j], each_f[j]), of_g = plus(of_g, weights[j], each_g[j]);
    f = plus(f, 1.0, of_f), g = plus(g, 1.0, of_g);
}

}  // namespace

void evaluate_sum(const Input& input, const double weights[], const Moment& at, Vector2& f, Vector2& g)
{
    if (at.ahead.rad != 0.0 && lies_in_rotor(input)) {
        Vector2 of_f, of_g;
        evaluate_sum(input, weights, in_rotors_frame(at), of_f, of_g);
        f = plus(f, 1.0, at.ahead.back(of_f)), g = plus(g, 1.0, at.ahead.back(of_g));
        return;
    }
    if (input.law == Law::angle_offset) {
        const double c = std::cos(weights[0]), s = std::sin(weights[0]);
        const double psi = at.psi - at.warm_Wb;
        const double flux_d = at.Ld * (c * at.i_d - s * at.i_q) + psi, flux_q = at.Lq * (s * at.i_d + c * at.i_q);
        g.d += c * flux_d + s * flux_q - at.Ld * at.i_d - psi;
        g.q += c * flux_q - s * flux_d - at.Lq * at.i_q;
        return;
    }
    if (input.law == Law::delay) {
        const Late late(at, weights[0], at.change);
        f.d += late.f.d, f.q += late.f.q;
        return;
    }
    if (turning_drives(input)) {
        const DrawnByTurning turned(input, at, weights);
        g = plus(g, 1.0, turned.lacks(turned.drawn()));
        return;
    }
    if (input.law == Law::pulses) return void(f = plus(f, 1.0, bent_by_pulses(input, at)));
    if (input.law == Law::sample_shift) return shifted(input, weights[0], at, f, g);
    if (input.law == Law::pulsed_shift || input.law == Law::pulsed_lag) {
        const Vector2 o = input.law == Law::pulsed_shift ? shifted_in_pulses(input, weights[0], at)
                                                         : filtered_in_pulses(input, weights[0], at);
        Vector2 of_f, of_g;
        sensor(at, o, of_f, of_g);
        f = plus(f, 1.0, of_f), g = plus(g, 1.0, of_g);
        return;
    }
    if (input.law == Law::sensor_lag) return lagging(input, weights[0], at, f, g);
    if (input.law == Law::encoder_eccentricity) return eccentric(input, weights, at, f, g);
    if (is_map(input.law)) {
        const Vector2 i = in_iron(at);
        const std::array<double, 2> psi = (input.law == Law::own_map ? own_flux_sum
                                                                     : cross_flux_sum)(input.shape, weights, i.d, i.q);
        g = plus(g, 1.0, {psi[0], psi[1]});
        return;
    }
    // But for maps all have few weights, and zeros for the others would cost more than they do.
    constexpr int kFew = 5;
    const int count = weights_of(input.law);
    if (count <= kFew)
        add_up<kFew>(input, weights, count, at, f, g);
    else
        add_up<kMostWeights>(input, weights, count, at, f, g);
}

void evaluate_slope(const Input& input, const double weights[], const Moment& at, double f_slope[4], double g_slope[4])
{
    if (at.ahead.rad != 0.0 && lies_in_rotor(input)) {
        double by_f[4] = {}, by_g[4] = {};
        evaluate_slope(input, weights, in_rotors_frame(at), by_f, by_g);
        const double c = at.ahead.cos, s = -at.ahead.sin;
        add_turned(c, s, by_f, f_slope), add_turned(c, s, by_g, g_slope);
        return;
    }
    if (turning_drives(input)) {
        const DrawnByTurning turned(input, at, weights);
        const Vector2 by_d = turned.lacks(turned.by_i_d()), by_q = turned.lacks(turned.by_i_q());
        g_slope[0] += by_d.d, g_slope[1] += by_q.d, g_slope[2] += by_d.q, g_slope[3] += by_q.q;
        return;
    }
    switch (input.law) {
    case Law::dead_time:
    case Law::dead_clamped:
    case Law::dead_given_back: {
        Other seen;
        const Moment& m = as_legs_have_it(input, at, seen);
        const double k = 1.0 / input.shape[0];
        double slope[3] = {}, out[4];
        if (input.loss == LossLaw::edges) {
            if (at.starts) lost_at_edges(input, m, weights, out);
            for (int j = 0; j < 4 && at.starts; ++j) f_slope[j] += weights[0] * out[j];
            break;
        }
        if (at.ends) {
            const Legs legs(input, m);
            for (int leg = 0; leg < 3; ++leg) slope[leg] = 2.0 * weights[0] * legs.by_end[leg];
        } else {
            const Phases p = phases_of(m);
            const double i[3] = {p.a, p.b, p.c};
            const int rests = resting_of(input, m);
            for (int leg = 0; leg < 3; ++leg)
                if (leg != rests) slope[leg] = weights[0] * k * LossAt(input.loss, k * i[leg]).slope;
        }
        phase_slopes(m, slope[0], slope[1], slope[2], out);
        for (int j = 0; j < 4; ++j) f_slope[j] += out[j];
        break;
    }
    case Law::saturation: {
        const Vector2 i = in_iron(at);
        const double k = 1.0 / input.shape[0], x = k * i.d, y = k * i.q;
        g_slope[0] += k * x * (2.0 * weights[0] + x * (3.0 * weights[1] + 4.0 * x * weights[2]));
        g_slope[3] += k * y * y * (3.0 * weights[3] + 5.0 * y * y * weights[4]);
        break;
    }
    case Law::cross_saturation: {
        const Vector2 i = in_iron(at);
        const double k = 1.0 / input.shape[0], x = k * i.d, y = k * i.q;
        g_slope[0] += k * 2.0 * weights[1] * y * y;
        const double mixed = k * y * (2.0 * weights[0] + 4.0 * weights[1] * x + 4.0 * weights[2] * y * y);
        g_slope[1] += mixed, g_slope[2] += mixed;
        g_slope[3] += k * x * (2.0 * weights[0] + 2.0 * weights[1] * x + 12.0 * weights[2] * y * y);
        break;
    }
    case Law::own_map:
    case Law::cross_map: {
        const auto inductance = input.law == Law::own_map ? own_inductance : cross_inductance;
        const Vector2 i = in_iron(at);
        const std::array<double, 3> L = inductance(input.shape, weights, i.d, i.q);
        g_slope[0] += L[0], g_slope[1] += L[1], g_slope[2] += L[1], g_slope[3] += L[2];
        break;
    }
    case Law::voltage_scale: {
        if (static_cast<Sag>(static_cast<int>(input.shape[0])) == Sag::by_its_column || input.heat > 0) break;
        const double by = 1.5 * weights[0];
        f_slope[0] += by * at.v_now.d * at.v_now.d, f_slope[1] += by * at.v_now.d * at.v_now.q;
        f_slope[2] += by * at.v_now.q * at.v_now.d, f_slope[3] += by * at.v_now.q * at.v_now.q;
        break;
    }
    case Law::clipped_current: {
        Other seen;
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
    case Law::sensor_lag:
    case Law::pulsed_lag: {
        if (!filters_currents(input)) break;
        double more[4];
        filtered(at, weights[0], more);
        add_slope_of_sensor(at, more, f_slope, g_slope);
        break;
    }
    default: break;
    }
}

namespace {

/// Of a filter of the currents, whose slope by them is the same at all.
void lagging_with_slope(const Input& input, double tau_s, const Moment& at, Vector2& f, Vector2& g, double f_slope[4],
                        double g_slope[4])
{
    double slope[4];
    Vector2 of_f, of_g;
    const bool pulses = input.law == Law::pulsed_lag;
    sensor(at, pulses ? filtered_in_pulses(input, tau_s, at, slope) : filtered(at, tau_s, slope), of_f, of_g);
    f = plus(f, 1.0, of_f), g = plus(g, 1.0, of_g);
    add_slope_of_sensor(at, slope, f_slope, g_slope);
}

/// At the end of a period, of one reading of the law.
void lost_with_slope(const Input& input, const double weights[], const Moment& at, Vector2& f, double f_slope[4])
{
    Other seen;
    const Moment& m = as_legs_have_it(input, at, seen);
    const Legs legs(input, m);
    const double by = 2.0 * weights[0];
    double out[4];
    f = plus(f, by, of_phases(m, legs.mean[0], legs.mean[1], legs.mean[2]));
    for (int j = 1; j < weights_of(input.law); ++j) f = plus(f, weights[j], lost(input, m, j));
    phase_slopes(m, by * legs.by_end[0], by * legs.by_end[1], by * legs.by_end[2], out);
    for (int j = 0; j < 4; ++j) f_slope[j] += out[j];
}

/// The same at the start of one, by the pulses' edges.
void lost_at_edges_with_slope(const Input& input, const double weights[], const Moment& at, Vector2& f,
                              double f_slope[4])
{
    Other seen;
    const Moment& m = as_legs_have_it(input, at, seen);
    double out[4] = {};
    f = plus(f, weights[0], lost_at_edges(input, m, weights, out));
    for (int j = 1; j < weights_of(input.law); ++j)
        f = plus(f, weights[j], lost(input, m, j, j == 2 ? -weights[2] : 0.0));
    for (int j = 0; j < 4; ++j) f_slope[j] += weights[0] * out[j];
}

}  // namespace

void evaluate_with_slope(const Input& input, const double weights[], const Moment& at, Vector2& f, Vector2& g,
                         double f_slope[4], double g_slope[4])
{
    if (at.ahead.rad != 0.0 && lies_in_rotor(input)) {
        Vector2 of_f, of_g;
        double by_f[4] = {}, by_g[4] = {};
        evaluate_with_slope(input, weights, in_rotors_frame(at), of_f, of_g, by_f, by_g);
        f = plus(f, 1.0, at.ahead.back(of_f)), g = plus(g, 1.0, at.ahead.back(of_g));
        const double c = at.ahead.cos, s = -at.ahead.sin;
        add_turned(c, s, by_f, f_slope), add_turned(c, s, by_g, g_slope);
        return;
    }
    if (is_dead_time(input.law) && !input.averaged) {
        const bool edges = input.loss == LossLaw::edges;
        if (!edges && at.ends) return lost_with_slope(input, weights, at, f, f_slope);
        if (edges && at.starts) return lost_at_edges_with_slope(input, weights, at, f, f_slope);
    }
    if (filters_currents(input)) return lagging_with_slope(input, weights[0], at, f, g, f_slope, g_slope);
    evaluate_sum(input, weights, at, f, g);
    evaluate_slope(input, weights, at, f_slope, g_slope);
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

bool shifts_angle(const Input& input)
{
    return input.law == Law::sample_shift && input.shape[0] == static_cast<double>(Instant::angle);
}

bool filters_currents(const Input& input)
{
    return input.law == Law::pulsed_lag ||
           (input.law == Law::sensor_lag &&
            static_cast<Channel>(static_cast<int>(input.shape[0])) == Channel::currents);
}

Input dead_time_input(Modulation modulation, double width_A, double start_angle_rad, bool free_angle)
{
    const bool clamped = modulation != Modulation::centred;
    Input in{clamped ? Law::dead_clamped : Law::dead_time, {width_A, start_angle_rad, 0, 0}};
    in.free_angle = free_angle, in.modulation = modulation;
    return in;
}

Input pulsed_input(Law law, Modulation modulation, double link_V, double start_angle_rad, bool free_angle)
{
    Input in{law, {link_V, start_angle_rad, 0, 0}};
    in.free_angle = free_angle, in.modulation = modulation;
    return in;
}

}  // namespace dqw
