// The mechanical prediction model, in innovations form.
#ifndef DQW_REF_MODEL_MECHANICAL_HPP
#define DQW_REF_MODEL_MECHANICAL_HPP

#include "ref/log/piece.hpp"
#include "ref/model/gain.hpp"
#include "ref/model/model.hpp"

namespace dqw {

/// Integrates J dw_m/dt + B w_m = T over each piece and corrects the speed by a fitted gain. The torque runs straight
/// from one row to the next; an integral forgives what is noisy in it and what is quantised in the speed.
class MechanicalModel : public Model {
public:
    enum Index { kJ, kB, kGain, kSize };

    /// `torque[i]` belongs to the log of `logs[i]`; both must outlive the model.
    MechanicalModel(std::vector<Piece> pieces, const std::vector<Log>& logs,
                    const std::vector<std::vector<double>>& torque);

    const std::vector<std::string>& names() const override;
    int channels() const override { return 1; }
    std::size_t rows() const override { return rows_; }
    Eigen::VectorXd power() const override { return power_; }
    void count_starts(bool count) override { count_starts_ = count || rows_ < 1000 * pieces_.size(); }
    void prepare(const Eigen::VectorXd& theta) override;
    void confine(Eigen::VectorXd& theta, const std::vector<bool>& free, bool wake) const override;
    bool at_bound(const Eigen::VectorXd& theta, int j) const override;
    bool sweep(const Eigen::VectorXd& theta, int blocks, Sums& sums) const override;
    bool squares(const Eigen::VectorXd& theta, Eigen::VectorXd& sum) const override;

private:
    template <typename T, typename Visit> bool run(const T* theta, Visit&& visit) const;
    bool in_domain(const Eigen::VectorXd& theta) const;
    const std::vector<double>& torque_of_piece(const Piece& piece) const;

    std::vector<Piece> pieces_;
    const std::vector<Log>& logs_;
    const std::vector<std::vector<double>>& torque_;
    bool count_starts_ = true;
    std::size_t rows_ = 0;
    double dt_max_s_ = 0.0, dt_mean_s_ = 0.0;
    Eigen::VectorXd power_;
    double decay_ = 1.0;
    GainSchedule reference_;
};

}  // namespace dqw
#endif
