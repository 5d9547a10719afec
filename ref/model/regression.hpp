// What Ceres' cost needs: errors of one or two channels and their derivatives, added up.
#ifndef DQW_REF_MODEL_REGRESSION_HPP
#define DQW_REF_MODEL_REGRESSION_HPP

#include <memory>

#include "ref/model/model.hpp"

namespace dqw {

/// Errors as a function of a vector theta. Rows are never stored, so that memory does not grow with the log.
class Regression {
public:
    Regression() = default;
    Regression(const Regression&) = delete;
    Regression& operator=(const Regression&) = delete;
    virtual ~Regression() = default;

    /// Names of theta's entries; those of gains, which stay on [0, 1], are empty.
    virtual const std::vector<std::string>& names() const = 0;
    virtual int channels() const = 0;
    /// Errors of one channel.
    virtual std::size_t rows() const = 0;
    /// Sum of the squared measured signal of each channel: the scale of what there is to predict.
    virtual Eigen::VectorXd power() const = 0;
    /// Fixes what must not change while theta is searched.
    virtual void prepare(const Eigen::VectorXd& theta) { (void)theta; }
    /// Whether the rows count over which the first sample of a piece is still being forgotten. They always do where
    /// pieces have fewer than 1000 rows on average.
    virtual void count_starts(bool count) { (void)count; }
    /// Adds up all rows in block_count() blocks, which show whether errors are white. False where theta is outside the
    /// domain.
    virtual bool sweep(const Eigen::VectorXd& theta, std::vector<BlockSum>& sums) const = 0;
    /// Sum of squared errors of each channel; false as above. Costs a fraction of sweep().
    virtual bool squares(const Eigen::VectorXd& theta, Eigen::VectorXd& sum) const = 0;

    bool is_gain(Eigen::Index j) const { return names()[static_cast<std::size_t>(j)].empty(); }
};

/// A model without effects. theta: its base, then its gains.
class WithoutEffects : public Regression {
public:
    /// `base`: names of theta's first entries. The model's plan is an even_plan().
    WithoutEffects(std::unique_ptr<Model> model, std::vector<std::string> base);

    const std::vector<std::string>& names() const override { return names_; }
    int channels() const override { return model_->channels(); }
    std::size_t rows() const override { return rows_; }
    Eigen::VectorXd power() const override { return power_; }
    void prepare(const Eigen::VectorXd& theta) override;
    void count_starts(bool count) override;
    bool sweep(const Eigen::VectorXd& theta, std::vector<BlockSum>& sums) const override;
    bool squares(const Eigen::VectorXd& theta, Eigen::VectorXd& sum) const override;

private:
    Point point(const Eigen::VectorXd& theta) const;

    std::unique_ptr<Model> model_;
    std::vector<std::string> names_;
    bool count_starts_ = true;
    std::size_t rows_ = 0;
    Eigen::VectorXd power_;
};

}  // namespace dqw
#endif
