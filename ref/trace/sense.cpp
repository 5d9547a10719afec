#include "ref/trace/sense.hpp"

#include <algorithm>
#include <cmath>

#include "ref/effect/effect.hpp"
#include "ref/fit/explain.hpp"

namespace dqw {
namespace {

// What a drive's engineer would not believe, (E48).
constexpr double kMostDriving = 1.1;  ///< asymmetry over Coulomb friction, as both are known
constexpr double kMostOfBase = 0.5;   ///< a sensor's or a flux's error beyond this part of its base is none
constexpr double kSlow = 0.4;         ///< part of the top speed below which Stribeck friction fades
constexpr double kMostWidth = 2.0;    ///< of the largest current: at half of its width a tanh is straight within 8 %
/// Over those at zero current: saturation takes most of an inductance at most, and adds none; what a fitted polynomial
/// of fourth order adds beside its end is left room. Against the magnet's flux iron comes out of the saturation in
/// which it is without current.
constexpr double kLeastInductance = 0.05, kMostInductance[2] = {6.0, 3.0};
/// Of a short's current and that mirrored on its phase, which are the same: a factor e^0.5 is beyond any noise that
/// lets it be confirmed.
constexpr double kMostUnlike = 0.5;
constexpr double kMostPeriods = 2.5;   ///< rows farther apart are not one row's, and more than three are not looked at
constexpr double kMostClipping = 5.0;  ///< of the weight of a clipped current, either way of 1; not varied
constexpr std::size_t kRowsLooked = 500, kRare = 50;  ///< rows of a log; one of so many may be extreme

/// Incremental inductances at the log's own currents, over those at zero current; rare extremes apart, where a
/// polynomial ends.
std::string inductance_sense(const TraceSetup& setup, const Point& at)
{
    std::vector<double> part[2];
    for (const Log& log : *setup.logs) {
        const std::size_t rows = std::min(log.i_d_A.size(), log.i_q_A.size());
        for (std::size_t k = 0; k < rows; k += std::max<std::size_t>(rows / kRowsLooked, 1)) {
            Moment m;
            m.i_d = log.i_d_A[k], m.i_q = log.i_q_A[k];
            double f[4] = {}, g[4] = {};
            for (const Term& t : at.terms)
                if (bends(t.input.law)) evaluate_slope(t.input, t.weights.data(), m, f, g);
            part[0].push_back(1.0 + g[0] / at.base[1]), part[1].push_back(1.0 + g[3] / at.base[2]);
        }
    }
    for (std::size_t axis = 0; axis < 2 && !part[axis].empty(); ++axis) {
        std::vector<double>& all = part[axis];
        std::sort(all.begin(), all.end());
        const double least = all[all.size() / kRare], most = all[all.size() - 1 - all.size() / kRare];
        if (least < kLeastInductance) return "an incremental inductance would vanish";
        if (most > kMostInductance[axis]) return "an incremental inductance would grow " + figure(most) + " times";
    }
    return "";
}

/// Whether the co-energy of a map is convex at the log's own currents, extremes apart: where it is not, it is no
/// iron. (E140)
std::string convex_sense(const TraceSetup& setup, const Point& at)
{
    std::size_t looked = 0, bent = 0;
    for (const Log& log : *setup.logs) {
        const std::size_t rows = std::min(log.i_d_A.size(), log.i_q_A.size());
        for (std::size_t k = 0; k < rows; k += std::max<std::size_t>(rows / kRowsLooked, 1)) {
            Moment m;
            m.i_d = log.i_d_A[k], m.i_q = log.i_q_A[k];
            double f[4] = {}, g[4] = {at.base[1], 0.0, 0.0, at.base[2]};
            for (const Term& t : at.terms)
                if (bends(t.input.law)) evaluate_slope(t.input, t.weights.data(), m, f, g);
            ++looked, bent += g[0] > 0.0 && g[0] * g[3] - g[1] * g[2] > 0.0 ? 0 : 1;
        }
    }
    return bent * kRare > looked ? "an incremental inductance would be negative" : "";
}

bool is_of_other_side(const TraceInput& in)
{
    const auto which = static_cast<Instant>(static_cast<int>(in.shape[0]));
    return (which == Instant::currents_before && in.weights[0] > 0.0) ||
           (which == Instant::currents_after && in.weights[0] < 0.0);
}

bool has(const Point& at, Law law)
{
    return std::any_of(at.terms.begin(), at.terms.end(), [&](const Term& t) { return t.input.law == law; });
}

double coulomb_of(const Point& at)
{
    for (const Term& t : at.terms)
        if (t.input.law == Law::coulomb_friction) return t.weights[0];
    return 0.0;
}

}  // namespace

std::string sense_of(const TraceSetup& setup, const Point& at)
{
    PlainModel plain;
    if (setup.regime == Regime::mechanical) {
        if (!(at.base[0] > 0.0)) return "the inertia would be negative";
        if (at.base[1] < 0.0) return "the viscous friction would be negative";
    } else {
        plain.R_ohm = at.base[0], plain.Ld_H = at.base[1], plain.Lq_H = at.base[2], plain.psi_Wb = at.base[3];
        if (!(at.base[0] > 0.0)) return "the resistance would be negative";
        const bool turns = setup.regime != Regime::standstill;
        if (turns && (!(at.base[1] > 0.0) || !(at.base[2] > 0.0))) return "an inductance would be negative";
        const bool mapped = has(at, Law::own_map) || has(at, Law::cross_map);
        if (mapped || has(at, Law::saturation) || has(at, Law::cross_saturation)) {
            std::string why = mapped ? convex_sense(setup, at) : inductance_sense(setup, at);
            if (!why.empty()) return why;
        }
    }
    const double dt_s = setup.logs->front().dt_s;
    for (const Term& t : at.terms) {
        if (t.input.law == Law::pulses) continue;
        const TraceInput in = input_of(setup, at, t);
        const std::vector<std::vector<double>> sd{std::vector<double>(in.weights.size(), 0.0)};
        const Effect* effect = find_effect(in.effect);
        // A fault of the record is no effect, but its measure must make sense too.
        if (!effect) {
            if (!(in.weights[0] > 1.0 / kMostClipping && in.weights[0] < kMostClipping))
                return "no clipped sensor does that";
            continue;
        }
        // Told as the polynomial beside it, which says nothing where it is far from it.
        if (is_map(t.input.law)) continue;
        for (const Estimate& e : physical({in}, sd, {0.0}, plain))
            for (const EffectParameter& p : effect->parameters)
                if (e.name == p.name && !(e.value >= p.least && e.value <= p.most))
                    return e.name + " would be " + figure(e.value) + ", outside " + figure(p.least) + " to " +
                           figure(p.most);
        if (in.effect == "current_offset" && std::hypot(in.weights[0], in.weights[1]) > kMostOfBase * setup.i_base_A)
            return "the offset would be half of the largest current";
        if (in.effect == "turn_short" &&
            !(std::abs(std::log(std::hypot(in.weights[1], in.weights[2]) / in.weights[0])) < kMostUnlike))
            return "it would not be of one phase";
        // The voltage that it is carried back with is that of the other side, which a controller makes of the currents.
        if (in.effect == "sample_shift" && is_of_other_side(in)) return "the currents would be of the other side";
        if ((in.effect == "sample_shift" || in.effect == "sensor_lag") && channel_of(in) != "speed" && dt_s > 0.0 &&
            std::abs(in.weights[0]) > kMostPeriods * dt_s)
            return "it would be " + figure(in.weights[0] / dt_s) + " periods";
        if (in.effect == "direction_asymmetry" && std::abs(in.weights[0]) > kMostDriving * coulomb_of(at))
            return "friction would drive the shaft one way: it would be more than Coulomb friction";
        if (in.effect == "stribeck_friction" && in.shape[1] > kSlow * setup.speed_base_rad_s)
            return "it would fade at " + figure(in.shape[1]) + " rad/s, the log's own speeds: viscous friction";
        if (t.input.law == Law::dead_given_back && !(t.weights[0] > 0.0 && t.weights[2] < 0.0))
            return "what is given back would not be what is lost";
        if (in.effect == "dead_time" && in.shape[0] > kMostWidth * setup.i_base_A)
            return "its width would be beyond the largest current: a resistance";
    }
    return "";
}

std::string doubt_of(const TraceSetup& setup, const Point& plain, const TraceFit& fit, bool noise)
{
    // In percent. A fit of rows in time leaves the effects, each some percent of the voltage; settled points behind an
    // inverter, whose dead time is most of it, up to 25 % of what was measured. (E48)
    constexpr double kMostLeft = 10.0, kMostLeftSettled = 30.0;
    // Of noise alone, on a log that hardly moves: what a model explains three quarters of has its columns right.
    constexpr double kMostNoise = 50.0;
    const char* const ask = ": are columns, units and signs those of the log format?";
    if (setup.regime == Regime::mechanical)
        return plain.base[0] < 0.0 ? std::string("the inertia comes out negative") + ask : "";
    if (setup.regime == Regime::dynamic && plain.base[0] < 0.0 && plain.base[1] < 0.0 && plain.base[2] < 0.0)
        return std::string("resistance and inductances come out negative") + ask;
    if (!setup.turns_apart.empty()) return setup.turns_apart;
    double left = 0.0, all = 0.0;
    for (const AxisResidual& a : fit.axes) {
        const double measured = a.percent > 0.0 ? 100.0 * a.rms / a.percent : 0.0;
        left += a.rms * a.rms, all += measured * measured;
    }
    if (!fit.axes.empty() && !(all > 0.0))
        return setup.regime == Regime::mechanical ? "no torque in any row"
                                                  : "no voltage in any row: is this the log that was meant?";
    const double percent = all > 0.0 ? 100.0 * std::sqrt(left / all) : 0.0;
    const bool dynamic = setup.regime == Regime::dynamic;
    const double most = !dynamic ? kMostLeftSettled : noise ? kMostNoise : kMostLeft;
    if (percent > most) return "the plain model leaves " + figure(percent) + " % of the voltage" + ask;
    return "";
}

}  // namespace dqw
