// What an inverter or a filter that no one has declared hides in a fit's parameters.
#ifndef DQW_REF_FIT_HIDDEN_LOSS_HPP
#define DQW_REF_FIT_HIDDEN_LOSS_HPP

#include <Eigen/Core>
#include <vector>

#include "ref/log/piece.hpp"
#include "ref/model/model.hpp"

namespace dqw {

struct HiddenLoss {
    Eigen::VectorXd loss_sd, filter_sd;     ///< by which R, L_d, L_q, psi may be off by either
    double probable = 0.0;                  ///< that there is a loss
    double filtered = 0.0, filter_s = 0.0;  ///< that the currents are filtered; by what time constant, if so
};

/// A loss of voltage with the sign of each leg's current, of any usual width and modulation, and a filter of the
/// currents: how probable either is, and what it would take from the parameters of `at`, a plain fit with gains; `sigma`
/// of both axes' innovations. Of a log without an angle no filter: it lies in the stator's frame.
///
/// Source   (E166) in docs/EQUATIONS.md
/// Cost     one sweep over 20 000 rows of them at most
HiddenLoss hidden_loss(const std::vector<Piece>& pieces, double pole_pairs, const Point& at,
                       const Eigen::VectorXd& sigma);

}  // namespace dqw
#endif
