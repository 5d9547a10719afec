// What a dead time takes at the edges of the pulses.
#ifndef DQW_REF_EFFECT_EDGES_HPP
#define DQW_REF_EFFECT_EDGES_HPP

namespace dqw {

/// One sampling period of three legs, each with its pulse in the middle.
struct Pulsed {
    double i_A[3];                 ///< currents of the phases at its start
    double slope_A[3], bend_A[3];  ///< what they grow by under its mean voltage, of a period and of its square
    double duty[3];                ///< 0 or 1 of a leg that rests
    double per_H[3][3];            ///< slope of a phase's current by the voltage of a leg, A/(V s)
    double link_V, period_s;
    int rises = -1, falls = -1;  ///< the leg that begins to rest at the upper rail, and the one that rested there
};

/// Of one volt, what each leg loses on average, the way its current flows, and its slope by the current at the start.
struct EdgeLoss {
    double mean[3] = {}, by_start[3] = {};
};

/// The loss of legs that close late, of `loss_V` = v_dc t_d/T. (E172)
/// @param width_A half of what, beside the dead time itself, blurs where the current turns
EdgeLoss lost_at_edges(const Pulsed& period, double loss_V, double width_A);

}  // namespace dqw
#endif
