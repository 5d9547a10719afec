// An inverter's own loss: how it grows with a leg's current, and which leg rests for a period. (E113), (E114)
#ifndef DQW_REF_EFFECT_INVERTER_HPP
#define DQW_REF_EFFECT_INVERTER_HPP

#include <string>

namespace dqw {

/// How the loss of a leg grows with its current over a width, odd, from 0 to 1.
enum class LossLaw {
    tanh,       ///< smooth: ripple and noise blur the step
    ramp,       ///< straight up to the width
    arctan,     ///< a long tail
    capacitor,  ///< the output swings on its capacitance: half at the width, then 1 - width/(2 |i|)
    plateau,    ///< ripple turns the current within the period: nothing up to half of the width, all from 1.5 of it
    edges       ///< a ramp of the current at each of the pulse's edges, its ripple included
};
constexpr LossLaw kLossLaws[] = {LossLaw::tanh,      LossLaw::ramp,    LossLaw::arctan,
                                 LossLaw::capacitor, LossLaw::plateau, LossLaw::edges};

/// A leg's loss as it usually is, of the largest voltage: what dead times of 0.5 to 2 us take at 10 to 20 kHz.
constexpr double kUsualLoss = 0.02;

/// Which legs switch.
enum class Modulation {
    centred,       ///< all three
    clamped_low,   ///< the lowest phase rests
    clamped_high,  ///< the highest
    clamped_60     ///< the one furthest from the middle
};
constexpr Modulation kModulations[] = {Modulation::centred, Modulation::clamped_low, Modulation::clamped_high,
                                       Modulation::clamped_60};

const char* name_of(LossLaw law);
const char* name_of(Modulation modulation);
/// Of a name that none has: centred.
Modulation modulation_named(const std::string& name);

/// The leg (0, 1, 2) that rests while these phase voltages are made, or -1.
int resting_leg(Modulation modulation, const double v_V[3]);

/// A law at x, the current over the width: its value, its slope, its integral from 0.
struct LossAt {
    double x, value, slope, integral;
    LossAt(LossLaw law, double x);
};

/// Mean of the law over a current that goes from x to y by a point `bow` off the middle between them, and its slope by
/// y.
struct MeanLoss {
    double mean, by_end;
    MeanLoss(LossLaw law, double x, double bow, double y);
};

/// First harmonic of the law of a sine of this amplitude, over the amplitude's sign: 4/pi where it is large.
double first_harmonic(LossLaw law, double amplitude);

}  // namespace dqw
#endif
