// The tracer's prediction model of a mechanical log: J dw/dt + B w + effects = T, in innovations form (E44).
#ifndef DQW_REF_SEARCH_MECHANICAL_HPP
#define DQW_REF_SEARCH_MECHANICAL_HPP

#include "ref/search/model.hpp"

namespace dqw {

class TraceMechanical : public TraceModel {
public:
    /// `torque[i]` and `angle[i]` (of the shaft; measured or integrated) belong to logs[i]; all outlive the model.
    /// `averaged`: regress the torque itself on means over the blocks of the reported residual, without a prediction.
    /// Less efficient; but where what the model lacks is fast (a shaft that twists), prediction looks at nothing else.
    TraceMechanical(const std::vector<Log>& logs, const std::vector<std::vector<double>>& torque,
                    const std::vector<std::vector<double>>& angle, Plan plan, bool averaged)
        : logs_(logs), torque_(torque), angle_(angle), plan_(std::move(plan)), averaged_(averaged)
    {
    }
    const std::vector<std::string>& base_names() const override;
    int channels() const override { return 1; }
    int gains() const override { return averaged_ ? 0 : 1; }
    bool common_weight() const override { return false; }
    const Plan& plan() const override { return plan_; }
    std::vector<ReportBlock> report(const Point& at, std::size_t rows) const override;
    bool pass(const Point& at, const std::vector<Input>& candidates, std::vector<BlockSum>& sums) const override;

private:
    const std::vector<Log>& logs_;
    const std::vector<std::vector<double>>&torque_, &angle_;
    bool predict(const Point& at, const std::vector<Input>& candidates, std::vector<BlockSum>& sums) const;
    void average(const Point& at, const std::vector<Input>& candidates, std::vector<BlockSum>& sums) const;
    Plan plan_;
    bool averaged_;
};

/// Angle of the shaft: theta_m_rad, or w_m integrated from 0.
std::vector<double> shaft_angle(const Log& log);

}  // namespace dqw
#endif
