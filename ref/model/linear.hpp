// Linear regressions: of means over blocks, and of the torque constant.
#ifndef DQW_REF_MODEL_LINEAR_HPP
#define DQW_REF_MODEL_LINEAR_HPP

#include <array>
#include <functional>

#include "ref/model/regression.hpp"

namespace dqw {

/// y_c = x_c' theta for one or two channels and up to four parameters, row by row.
class LinearModel : public Regression {
public:
    static constexpr int kMost = 4;
    struct Row {
        std::array<double, 2> y{};
        std::array<std::array<double, kMost>, 2> x{};
    };
    /// Hands every row to the visitor; called once for each pass.
    using Source = std::function<void(const std::function<void(const Row&)>&)>;

    LinearModel(std::vector<std::string> names, int channels, Source source);

    /// Variances of white noise on the regressors of each channel; its part in the sums is taken off.
    void set_regressor_noise(const std::array<std::array<double, kMost>, 2>& variance) { noise_ = variance; }

    const std::vector<std::string>& names() const override { return names_; }
    int channels() const override { return channels_; }
    std::size_t rows() const override { return rows_; }
    Eigen::VectorXd power() const override { return power_; }
    void prepare(const Eigen::VectorXd& theta) override;
    bool sweep(const Eigen::VectorXd& theta, std::vector<BlockSum>& sums) const override;
    bool squares(const Eigen::VectorXd& theta, Eigen::VectorXd& sum) const override;

private:
    std::vector<std::string> names_;
    int channels_;
    Source source_;
    std::size_t rows_ = 0;
    Eigen::VectorXd power_;
    std::array<std::array<double, kMost>, 2> noise_{};
    Eigen::VectorXd offset_;  ///< of each channel: what taking off the noise takes off the squares, there
};

}  // namespace dqw
#endif
