// The model of a mechanical log, J dw/dt + B w + any effects = T, in innovations form, (E40), (E44).
#ifndef DQW_REF_MODEL_MECHANICAL_HPP
#define DQW_REF_MODEL_MECHANICAL_HPP

#include "ref/model/gain.hpp"
#include "ref/model/model.hpp"

namespace dqw {

/// The torque runs straight from one row to the next; an integral forgives what is noisy in it and what is quantised in
/// the speed.
class MechanicalModel : public Model {
public:
    /// `torque[i]` and `angle[i]` (of the shaft; measured or integrated; without effects none is needed) belong to
    /// logs[i]; all outlive the model.
    /// `hat_half_s` above 0: regress the torque itself on means under such hats, without a prediction, (E190). Less
    /// efficient; but where what the model lacks is fast (a shaft that twists), or the speed's noise is not white,
    /// prediction looks at nothing else.
    MechanicalModel(const std::vector<Log>& logs, const std::vector<std::vector<double>>& torque,
                    const std::vector<std::vector<double>>& angle, Plan plan, double hat_half_s = 0.0);

    const std::vector<std::string>& base_names() const override;
    int channels() const override { return 1; }
    int gains() const override { return hat_half_s_ > 0.0 ? 0 : 1; }
    bool common_weight() const override { return false; }
    const Plan& plan() const override { return plan_; }
    const std::vector<double>& measured(const Log& log, int) const override { return log.w_m_rad_s; }
    void weigh_starts(const Point& at, bool count) override;
    std::vector<ReportBlock> report(const Point& at, std::size_t rows) const override;
    bool sweep(const Point& at, const std::vector<Input>* candidates, std::vector<BlockSum>& sums) const override;

private:
    struct Run;
    bool predict(const Point& at, const std::vector<Input>* candidates, std::vector<BlockSum>& sums) const;
    void average(const Point& at, const std::vector<Input>* candidates, std::vector<BlockSum>& sums) const;

    const std::vector<Log>& logs_;
    const std::vector<std::vector<double>>&torque_, &angle_;
    Plan plan_;
    double hat_half_s_, dt_max_s_ = 0.0, dt_mean_s_ = 0.0;
    StartWeights weights_;
};

/// Angle of the shaft: theta_m_rad, or w_m integrated from 0.
std::vector<double> shaft_angle(const Log& log);

}  // namespace dqw
#endif
