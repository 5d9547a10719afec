// The voltage of one sampling period, held while the rotor turns.
#ifndef DQW_REF_MODEL_HOLD_HPP
#define DQW_REF_MODEL_HOLD_HPP

#include <algorithm>
#include <array>
#include <cmath>

#include "ref/model/response.hpp"

namespace dqw {

/// Voltages held in the last periods, the last first, as the rotor sees them.
using Held = std::array<Vector2, kPast>;

/// A voltage held over a period in which the rotor turns by 2 h, from its mean in the rotor's frame.
struct Hold {
    double sinc;
    double bow;  ///< half-way, of a flux that stands in the rotor, while the voltage does not turn with it
    Matrix2 to_start, to_end;  ///< from the frame of a period's start (end) to that of its middle
    Vector2 end;               ///< as seen at the end
    Vector2 middle;            ///< half-way
    int past;                  ///< changes that are worked out
    /// mean less the mean of the last held voltage, had it gone on; that less the one before ...; as an f of constant
    /// value
    Vector2 change[kPast];
    Vector2 begin;             ///< as seen at the start
    Vector2 turned[kFewPast];  ///< the same changes where each was turned along with the rotor to this period

    /// `held`: the last voltages, as seen at the start; as seen at the end, this one first, when done.
    Hold(double h, Vector2 mean, Held& held, bool rotor_held, int past_periods) : past(past_periods)
    {
        const double c = std::cos(h), s = std::sin(h);
        sinc = std::abs(h) > 1e-4 ? s / h : 1.0 - h * h / 6.0;
        to_start = turn(c, -s), to_end = turn(c, s);
        end = rotor_held ? mean : to_start * Vector2{mean.d / sinc, mean.q / sinc};
        bow = rotor_held ? 0.0 : -0.5 * s * s;
        middle = mean;
        begin = rotor_held ? mean : to_end * Vector2{mean.d / sinc, mean.q / sinc};
        Vector2 now{mean.d / sinc, mean.q / sinc}, next = end;
        const Matrix2 period = to_end * to_end;
        Matrix2 along = period;
        Vector2 along_now = now;
        for (int n = 0; n < past; ++n) {
            const Vector2 last = to_start * held[static_cast<std::size_t>(n)];
            change[n] = {(now.d - last.d) / c, (now.q - last.q) / c};
            // At the speed of now: what it changed by in the periods between turns a change by as little.
            if (n < kFewPast) {
                const Vector2 along_last = along * last;
                turned[n] = {(along_now.d - along_last.d) / c, (along_now.q - along_last.q) / c};
                along_now = along_last, along = along * period;
            }
            now = last;
            held[static_cast<std::size_t>(n)] = next, next = to_start * last;
        }
    }

    /// Makes two moments the ends of this period.
    void pair(Moment& m0, Moment& m1) const
    {
        m0.starts = m1.ends = true;
        for (Moment* m : {&m0, &m1}) {
            m->past = past;
            std::copy(change, change + past, m->change);
            std::copy(std::begin(turned), std::end(turned), m->turned);
        }
        m0.v_now = begin, m1.v_now = end;
        m0.mean_of_held = m1.mean_of_held = sinc * to_end.dd;
        // Voltage held, magnet turning: the current bows by the flux' (w_e T)^2/8 over L_d, two thirds of it on
        // average.
        const double c = to_end.dd, s = to_end.qd, bow_A = bow * m0.psi / m0.Ld;
        m0.bow_d = m1.bow_d = 2.0 / 3.0 * bow_A;
        const double half_c = c * m0.cos_e - s * m0.sin_e, half_s = s * m0.cos_e + c * m0.sin_e;
        for (Moment* m : {&m0, &m1})
            m->held_alpha = half_c * middle.d - half_s * middle.q, m->held_beta = half_s * middle.d + half_c * middle.q;
        m1.bow_alpha = bow_A * half_c, m1.bow_beta = bow_A * half_s;
        m1.past_alpha = m0.cos_e * m0.i_d - m0.sin_e * m0.i_q, m1.past_beta = m0.sin_e * m0.i_d + m0.cos_e * m0.i_q;
    }
};

}  // namespace dqw
#endif
