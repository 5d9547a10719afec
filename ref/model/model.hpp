// What the solver needs of a prediction model: its innovations and their derivatives, added up.
#ifndef DQW_REF_MODEL_MODEL_HPP
#define DQW_REF_MODEL_MODEL_HPP

#include <Eigen/Dense>
#include <cstddef>
#include <string>
#include <vector>

namespace dqw {

/// Sums of [J e]'[J e], one (n+1) x (n+1) matrix for each block of rows and channel, the innovation e last.
/// Rows are never stored, so that memory does not grow with the log; the blocks show whether e is white.
struct Sums {
    int channels = 0;
    int blocks = 0;
    std::vector<Eigen::MatrixXd> of;  ///< index block * channels + channel

    void reset(int parameters, int channel_count, int block_count);
    const Eigen::MatrixXd& at(int block, int channel) const { return of[index(block, channel)]; }
    Eigen::MatrixXd& at(int block, int channel) { return of[index(block, channel)]; }
    /// Sum over the blocks.
    Eigen::MatrixXd total(int channel) const;

private:
    std::size_t index(int block, int channel) const { return static_cast<std::size_t>(block * channels + channel); }
};

/// A model that predicts one or two measured channels from the past, row by row.
class Model {
public:
    Model() = default;
    Model(const Model&) = delete;
    Model& operator=(const Model&) = delete;
    virtual ~Model() = default;

    /// Names of theta's entries; those of gains are empty.
    virtual const std::vector<std::string>& names() const = 0;
    virtual int channels() const = 0;
    /// Innovations of one channel.
    virtual std::size_t rows() const = 0;
    /// Sum of the squared measured signal of each channel: the scale of what there is to predict.
    virtual Eigen::VectorXd power() const = 0;
    /// Fixes what must not change while theta is searched (weights of a start, series order).
    virtual void prepare(const Eigen::VectorXd& theta) { (void)theta; }
    /// Brings free entries back into range, e.g. a gain onto [0, 1]. `wake` lifts them off a bound to try again.
    virtual void confine(Eigen::VectorXd& theta, const std::vector<bool>& free, bool wake) const
    {
        (void)theta, (void)free, (void)wake;
    }
    /// Whether the innovations stop depending on theta[j] because it sits on a bound.
    virtual bool at_bound(const Eigen::VectorXd& theta, int j) const { return (void)theta, (void)j, false; }
    /// Whether the rows count over which the first sample of a piece is still being forgotten. They always do where
    /// pieces have fewer than 1000 rows on average.
    virtual void count_starts(bool count) { (void)count; }
    /// Adds up all rows in `blocks` blocks. False where theta is outside the model's domain.
    virtual bool sweep(const Eigen::VectorXd& theta, int blocks, Sums& sums) const = 0;
    /// Sum of squared innovations of each channel; false as above. Costs a fraction of sweep().
    virtual bool squares(const Eigen::VectorXd& theta, Eigen::VectorXd& sum) const = 0;
};

}  // namespace dqw
#endif
