// Fits on the rows seen, judged on the rows held out.
#ifndef DQW_REF_SEARCH_SOLVE_HPP
#define DQW_REF_SEARCH_SOLVE_HPP

#include <cmath>
#include <functional>

#include "ref/model/model.hpp"

namespace dqw {

/// What a point, or a linear step from it, leaves in each fine block.
struct Left {
    std::vector<double> rows;             ///< of each block
    std::vector<std::vector<double>> of;  ///< [channel][block] sum of squares
    double seen = 0.0, heldout = 0.0;     ///< log-likelihoods: -1/2 sum_c N_c ln(mean square), up to a constant
};

/// Left of the sums as they are, and after the step `delta` of all columns (linear in it).
Left left_of(const Model& model, const std::vector<BlockSum>& sums);
Left left_after(const Model& model, const std::vector<BlockSum>& sums, const Eigen::VectorXd& delta);

/// The sums of the rows seen.
struct Seen {
    std::vector<Eigen::MatrixXd> total;  ///< of each channel
    double rows = 0.0;
};
Seen seen_of(const Model& model, const std::vector<BlockSum>& sums);

/// What is held for likely before a log is seen: weights about zero, each by its stiffness, (E142).
struct Prior {
    Eigen::VectorXd stiffness, value;  ///< of each column of a sweep: one over its variance, and where it is
};
Prior prior_of(const Point& at, const std::vector<Input>& candidates);

/// The step of the columns `use` that leaves least on the rows seen; `damping` in units of each column's own square.
/// A column that others span to 1e-9 does not move.
Eigen::VectorXd linear_step(const Model& model, const Seen& seen, const std::vector<Eigen::Index>& use, double damping,
                            const Prior& prior);

/// How much better `b` is than `a` on the held-out blocks, (E45).
struct Better {
    double nats = 0.0;       ///< gain of log-likelihood
    double t = 0.0;          ///< of the blocks' log ratios, shrunk by their correlation
    double nats_each = 0.0;  ///< the gain if each block counted as one row: rows within a block may all be alike
};
Better better(const Model& model, const Left& a, const Left& b);
/// With as many nats more, each block alike. (E167)
Better beside_law_noise(Better over, double nats);
/// Gain on rows that no fit saw that is no chance: with the noise known, without an effect the likelihoods' ratio has a
/// mean of at most 1, so by Markov's inequality it exceeds e^10 in fewer than one case in 20000.
constexpr double kLeastNats = 10.0;

/// Whether that is more than chance: ten nats, and t above 4. An effect may show in few blocks, strongly: where t times
/// the gain that would be left if each block were one row is above 15, a t of 2 does; 1.5 where it is above 40, and
/// among settled points.
bool confirmed(const Model& model, const Better& gain);

/// A point with all of its columns fitted to the rows seen.
struct Refined {
    Point point;
    std::vector<BlockSum> sums;
    Left left;
    Eigen::VectorXd added;  ///< what the scores of the rows seen add up to, (E110); empty: zero
    bool ok = false;
};

/// A point as it is; not ok outside the model's domain.
Refined swept(const Model& model, const Point& at);
/// The same of the rows seen: a start of refine(), for which those held out do not matter.
Refined swept_seen(const Model& model, const Point& at);

/// Gauss-Newton from `start`, damped and within what a linear step tells, at most `passes` passes, of which a start
/// that was swept has had one; a last step that gains next to nothing is linear, and takes none. They run through
/// the rows seen; those held out are swept at its end. Gains stay within [1e-4, 1]. It ends early where as much as
/// the last steps gained, or promised, in each of twelve passes more would not bring the log-likelihood of the rows
/// seen to `worth`.
Refined refine(const Model& model, Refined start, int passes, double worth = -HUGE_VAL);
inline Refined refine(const Model& model, const Point& start, int passes, double worth = -HUGE_VAL)
{
    return refine(model, swept_seen(model, start), passes, worth);
}

/// What noise of columns adds to the scores of the rows seen, one column a channel, where its squared errors have that
/// mean; empty where it cannot be had.
using AddedScores = std::function<Eigen::MatrixXd(const Point& at, const Eigen::VectorXd& variance, double rows)>;

/// From the least squares to where the scores add up to what noise of columns adds to them, (E110).
Refined take_off_noise(const Model& model, const Refined& refined, const AddedScores& added);

/// Information of the rows seen: J'J over each channel's variance, which is given too.
Eigen::MatrixXd seen_information(const Model& model, const Refined& refined, Eigen::VectorXd& variance, double& rows);

/// Covariances of the columns of a refined point: as white noise has them, and as the scores of the seen blocks
/// scatter. Of any one direction the wider holds.
struct Spreads {
    Eigen::MatrixXd white, scatter;
    std::vector<bool> told;  ///< whether the rows tell the column
};
Spreads spreads_of(const Model& model, const Refined& refined);

/// What noise of the rows seen adds to the mean square of a value held out, by way of the columns, over the noise's own:
/// mean of J C J'/sigma^2, (E46).
double unseen_part(const Model& model, const Refined& refined);

/// Covariance of the columns of a refined point, each as wide as the scatter of the seen blocks' scores has it;
/// infinite on the diagonal where the rows do not tell it.
Eigen::MatrixXd covariance(const Model& model, const Refined& refined);
/// Standard deviation of each column.
Eigen::VectorXd deviations(const Model& model, const Refined& refined);

}  // namespace dqw
#endif
