// The plain model on averages over the blocks of the reported residual.
#ifndef DQW_REF_MODEL_AVERAGED_HPP
#define DQW_REF_MODEL_AVERAGED_HPP

#include <memory>
#include <vector>

#include "ref/log/piece.hpp"
#include "ref/model/linear.hpp"

namespace dqw {

/// Where the plain model lacks an effect, prediction of currents and least residual voltage differ: a voltage that is
/// missing counts as voltage / L there, so that a larger L seems better. These regress the voltage (torque) itself on
/// block means and on the blocks' end currents, less the scatter that white noise of the known variance adds to the
/// regressors. Less efficient than prediction where the model holds; the better fit where it does not.

/// Parameters R, L_d, L_q, psi; two channels, v_d and v_q. `noise_A`: of one sample of i_d and i_q.
std::unique_ptr<LinearModel> averaged_electrical(const std::vector<Piece>& pieces, double pole_pairs, double noise_d_A,
                                                 double noise_q_A);

/// Parameters J, B; one channel, the torque under hats whose halves last `half_s`, (E190). `torque[i]` belongs to
/// pieces[i].
std::unique_ptr<LinearModel> averaged_mechanical(const std::vector<Piece>& pieces,
                                                 const std::vector<const std::vector<double>*>& torque, double half_s);

/// Whether J or B of a prediction is beyond three deviations of the means' and what else these may be off by: 1 % for half
/// a hat of what is fast, and of J the part of the slopes that is noise. (E190)
bool is_off(const Eigen::Vector2d& predicted, const Eigen::Vector2d& means, const Eigen::Vector2d& sd,
            double noise_part);
/// Of the reported residual: a right J leaves up to this much more than one that fits the noise of the blocks' ends.
constexpr double kAlike = 1.05;

/// Whether the averaged fit, with this reported residual (RMS), is clearly better than prediction with that: by more
/// than
/// 3 %, than what its parameters gain by chance, and than 0.5 % of the signal, since a turning voltage held over a
/// period is averaged to no better than that.
bool clearly_better(const LinearModel& model, double averaged, double predicted);

}  // namespace dqw
#endif
