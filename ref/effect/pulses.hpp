// What three legs' pulses do to the currents within a period, which their mean voltage does not. (E168)
#ifndef DQW_REF_EFFECT_PULSES_HPP
#define DQW_REF_EFFECT_PULSES_HPP

#include "ref/effect/inverter.hpp"

namespace dqw {

/// Of three legs, what each spends on the upper rail, as a part of the period, for these phase voltages from this link.
/// Beyond the hexagon the vector is made shorter.
struct Duties {
    double of[3];
    Duties(Modulation modulation, const double v_V[3], double link_V);
};

/// Of a leg of one volt of link whose pulse is in the middle of its period: what its voltage adds to the mean one
/// within the first u seconds, V s. Within the last ones it is the same. Odd in u.
double pulse_beyond_mean(double duty, double u_s, double period_s);

/// Its integral from the row on over those u seconds, V s^2; even in u.
double pulse_moment(double duty, double u_s, double period_s);

/// What of the first a filter tells at the period's end: the mean over the past, weighed by its decay, V s. Odd in tau.
struct FilteredPulse {
    double kept;  ///< of what it told a period before

    FilteredPulse(double tau_s, double period_s);
    double beyond_mean(double duty) const;

private:
    double tau_s_, rate_, all_;  ///< rate: half of a period's time constants; all: what a period lets come through
};

/// Mean of its voltage beyond the mean one times the square of the time from the middle, both in periods; per volt of
/// link. (E169)
double second_moment(double duty);

/// Mean over a period of the product of two such legs' flux beyond the mean voltage's, per square of the link and of the
/// period. (E180)
double mean_product(double duty, double other);

}  // namespace dqw
#endif
