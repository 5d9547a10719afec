// Noise of the columns that a prediction takes as they are, voltage and speed: what it does to the scores.
#ifndef DQW_REF_MODEL_COLUMN_NOISE_HPP
#define DQW_REF_MODEL_COLUMN_NOISE_HPP

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

#include "ref/model/rows.hpp"

namespace dqw {

/// Standard deviations of white noise of a log's columns.
struct NoiseSizes {
    double v_V[2] = {}, i_A[2] = {}, w_m_rad_s = 0.0;
    double share[2] = {};  ///< of each axis' squared innovations that they are to make

    bool any() const { return v_V[0] > 0.0 || v_V[1] > 0.0 || w_m_rad_s > 0.0; }
};

/// (E110). Noise of the logged voltage stands in what is predicted and in the prediction error, times T/L both: least
/// squares favour an L that is too large; those of a noisy speed a psi that is too small.
class ColumnNoise {
public:
    /// Refers to the logs, which are dynamic ones. `read`: pieces of few rows in all, where others are hardly read.
    explicit ColumnNoise(const std::vector<Log>& logs, std::vector<Piece> read = {});

    /// From what the innovations of R, L_d, L_q, psi (and pole pairs, where base has them) say of the noise, and the
    /// columns themselves. `variance`: of each axis' innovations, A^2.
    NoiseSizes sizes(const Eigen::VectorXd& base, const Eigen::VectorXd& gain, double pole_pairs,
                     const Eigen::VectorXd& variance) const;

    /// What noise of these sizes adds to the scores J'e of each channel on average: half the second difference of the
    /// scores where such noise is put on the logs and taken off. `scores(noise)` gives them, without noise for a
    /// null, one column a channel, below them e'e; an empty matrix where they cannot be had, and then here.
    Eigen::MatrixXd added(const NoiseSizes& sizes, const std::function<Eigen::MatrixXd(const RowNoise*)>& scores);

    /// Half the second difference of anything that is had of the rows; empty where it cannot be had.
    Eigen::MatrixXd second(const NoiseSizes& sizes, const std::function<Eigen::MatrixXd(const RowNoise*)>& of);

private:
    const std::vector<Log>& logs_;
    std::vector<Piece> read_;
    std::optional<Draws> draws_;       ///< from when they are first asked for
    double dt_s_ = 0.0, speed_ = 0.0;  ///< variance of the speed's noise, (rad/s)^2
    double voltage_[2] = {};           ///< the most that white noise of the columns may have, V^2
    double mean_d_A_ = 0.0, square_A2_[2] = {}, square_w_ = 0.0;
};

}  // namespace dqw
#endif
