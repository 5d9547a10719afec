// The electrical prediction model of a dynamic log, in innovations form, (E40).
#ifndef DQW_REF_MODEL_DYNAMIC_HPP
#define DQW_REF_MODEL_DYNAMIC_HPP

#include "ref/log/piece.hpp"
#include "ref/model/gain.hpp"
#include "ref/model/model.hpp"

namespace dqw {

/// Simulates the dq currents over each piece from v_d, v_q, w_m and corrects the state after each row by a gain of each
/// axis, which is a parameter like the others: 1 predicts one step, 0 only simulates. (P6), (P7):
///   L_d di_d/dt = v_d - R i_d + w_e L_q i_q,   L_q di_q/dt = v_q - R i_q - w_e (L_d i_d + psi),   w_e = p w_m
/// The speed of a period is the mean of its two ends.
class DynamicModel : public Model {
public:
    enum Index { kR, kLd, kLq, kPsi, kGainD, kGainQ, kPolePairs, kSize };

    /// `free_pole_pairs`: whether sweep() needs derivatives by p (it costs a sixth more).
    DynamicModel(std::vector<Piece> pieces, bool free_pole_pairs);

    const std::vector<Piece>& pieces() const { return pieces_; }

    const std::vector<std::string>& names() const override;
    int channels() const override { return 2; }
    std::size_t rows() const override { return rows_; }
    Eigen::VectorXd power() const override { return power_; }
    void count_starts(bool count) override { count_starts_ = count || rows_ < 1000 * pieces_.size(); }
    void prepare(const Eigen::VectorXd& theta) override;
    void confine(Eigen::VectorXd& theta, const std::vector<bool>& free, bool wake) const override;
    bool at_bound(const Eigen::VectorXd& theta, int j) const override;
    bool sweep(const Eigen::VectorXd& theta, int blocks, Sums& sums) const override;
    bool squares(const Eigen::VectorXd& theta, Eigen::VectorXd& sum) const override;

private:
    template <int N> bool sweep_jets(const Eigen::VectorXd& theta, Sums& sums) const;
    template <typename T, typename W, typename Visit>
    bool run(const T* theta, const W& pole_pairs, Visit&& visit) const;
    bool in_domain(const Eigen::VectorXd& theta) const;

    std::vector<Piece> pieces_;
    bool free_pole_pairs_;
    bool count_starts_ = true;
    std::size_t rows_ = 0;
    double w_max_rad_s_ = 0.0, dt_max_s_ = 0.0, dt_mean_s_ = 0.0;
    Eigen::VectorXd power_;
    double decay_[2] = {1.0, 1.0};
    GainSchedule reference_[2];  ///< its weights stay while theta is searched
};

}  // namespace dqw
#endif
