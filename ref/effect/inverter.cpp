#include "ref/effect/inverter.hpp"

#include <cmath>
#include <cstddef>
#include <iterator>

namespace dqw {
namespace {

constexpr double kLn2 = 0.6931471805599453;
/// Beyond it tanh differs from +-1 by 2 e^-40 = 8e-18, less than a double's last place.
constexpr double kOne = 20.0;
/// Of a difference of two points, below which a mean between them is that of the points to 1e-7 (its square over 12),
/// and the quotient of differences loses digits.
constexpr double kLeastStep = 1e-3;
constexpr const char* kLaws[] = {"tanh", "ramp", "arctan", "capacitor", "plateau", "edges"};
constexpr const char* kNames[] = {"centred", "clamped_low", "clamped_high", "clamped_60"};

/// Mean over a current that goes evenly from one to the other, and its slopes by both.
struct Line {
    double mean, by_from, by_to;
    Line(const LossAt& from, const LossAt& to)
    {
        const double step = to.x - from.x;
        if (std::abs(step) < kLeastStep) {
            mean = 0.5 * (from.value + to.value), by_from = by_to = 0.25 * (from.slope + to.slope);
        } else {
            mean = (to.integral - from.integral) / step, by_from = (mean - from.value) / step,
            by_to = (to.value - mean) / step;
        }
    }
};

}  // namespace

const char* name_of(LossLaw law) { return kLaws[static_cast<std::size_t>(law)]; }
const char* name_of(Modulation modulation) { return kNames[static_cast<std::size_t>(modulation)]; }

Modulation modulation_named(const std::string& name)
{
    for (const Modulation m : kModulations)
        if (name == name_of(m)) return m;
    return Modulation::centred;
}

int resting_leg(Modulation modulation, const double v_V[3])
{
    if (modulation == Modulation::centred) return -1;
    int rests = 0;
    const auto before = [&](double a, double b) {
        switch (modulation) {
        case Modulation::clamped_low: return a < b;
        case Modulation::clamped_high: return a > b;
        default: return std::abs(a) > std::abs(b);
        }
    };
    for (int k : {1, 2})
        if (before(v_V[k], v_V[rests])) rests = k;
    return rests;
}

LossAt::LossAt(LossLaw law, double at) : x(at), value(0.0), slope(0.0), integral(0.0)
{
    const double size = std::abs(x);
    switch (law) {
    case LossLaw::tanh: {
        const double e = size < kOne ? std::exp(-2.0 * size) : 0.0;
        value = (1.0 - e) / (1.0 + e), slope = 1.0 - value * value;
        integral = size - kLn2 + (e > 0.0 ? std::log1p(e) : 0.0);
        break;
    }
    case LossLaw::edges:
    case LossLaw::ramp:
        value = std::fmin(size, 1.0), slope = size < 1.0 ? 1.0 : 0.0;
        integral = size < 1.0 ? 0.5 * size * size : size - 0.5;
        break;
    case LossLaw::arctan:
        value = M_2_PI * std::atan(size), slope = M_2_PI / (1.0 + size * size);
        integral = size * value - M_1_PI * std::log1p(size * size);
        break;
    case LossLaw::capacitor: {
        const bool swings = size < 1.0;
        value = swings ? 0.5 * size : 1.0 - 0.5 / size;
        slope = swings ? 0.5 : 0.5 / (size * size);
        integral = swings ? 0.25 * size * size : size - 0.5 * std::log(size) - 0.75;
        break;
    }
    case LossLaw::plateau:
        if (size > 0.5) value = std::fmin(size - 0.5, 1.0), slope = size < 1.5 ? 1.0 : 0.0;
        integral = size < 1.5 ? 0.5 * value * value : size - 1.0;
        break;
    }
    value = std::copysign(value, x);
}

MeanLoss::MeanLoss(LossLaw law, double x, double bow, double y)
{
    const LossAt from(law, x), middle(law, 0.5 * (x + y) + bow), to(law, y);
    const Line first(from, middle), second(middle, to);
    mean = 0.5 * (first.mean + second.mean);
    by_end = 0.5 * (second.by_to + 0.5 * (first.by_to + second.by_from));
}

double first_harmonic(LossLaw law, double amplitude)
{
    // Midpoints of a quarter turn: of a step, the whole error is that of the cosine, (pi/32)^2/24.
    constexpr int kPoints = 16;
    double sum = 0.0;
    for (int n = 0; n < kPoints; ++n) {
        const double c = std::cos((n + 0.5) * M_PI_2 / kPoints);
        sum += LossAt(law, amplitude * c).value * c;
    }
    return 2.0 / kPoints * sum;
}

}  // namespace dqw
