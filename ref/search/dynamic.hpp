// The tracer's prediction model of a dynamic log: the innovations form with effects (E44), linearised by hand.
#ifndef DQW_REF_SEARCH_DYNAMIC_HPP
#define DQW_REF_SEARCH_DYNAMIC_HPP

#include "ref/effect/columns.hpp"
#include "ref/search/model.hpp"

namespace dqw {

class TraceDynamic : public TraceModel {
public:
    enum Index { kR, kLd, kLq, kPsi, kBase };

    /// `columns[i]` belongs to logs[i]; both outlive the model. `rotor_held`: within a period the voltage turns with
    /// the rotor.
    TraceDynamic(const std::vector<Log>& logs, const std::vector<TraceColumns>& columns, double pole_pairs, Plan plan,
                 bool rotor_held = false);

    const std::vector<std::string>& base_names() const override;
    int channels() const override { return 2; }
    int gains() const override { return 2; }
    bool common_weight() const override { return false; }
    const Plan& plan() const override { return plan_; }
    std::vector<ReportBlock> report(const Point& at, std::size_t rows) const override;
    bool pass(const Point& at, const std::vector<Input>& candidates, std::vector<BlockSum>& sums) const override;

private:
    struct Run;
    const std::vector<Log>& logs_;
    const std::vector<TraceColumns>& columns_;
    double pole_pairs_;
    Plan plan_;
    bool rotor_held_;
    double w_max_rad_s_ = 0.0, dt_max_s_ = 0.0;
};

}  // namespace dqw
#endif
