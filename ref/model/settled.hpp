// The model of settled points: v against i and speed, with any effects.
#ifndef DQW_REF_MODEL_SETTLED_HPP
#define DQW_REF_MODEL_SETTLED_HPP

#include "ref/effect/columns.hpp"
#include "ref/model/model.hpp"

namespace dqw {

/// (P6), (P7) with d/dt = 0 and the effects' f + w_e J g. The `delay` is in seconds here: a settled row has no period.
class SettledModel : public Model {
public:
    SettledModel(const std::vector<Log>& logs, const std::vector<TraceColumns>& columns, double pole_pairs, Plan plan)
        : logs_(logs), columns_(columns), pole_pairs_(pole_pairs), plan_(std::move(plan))
    {
    }
    const std::vector<std::string>& base_names() const override;
    int channels() const override { return 2; }
    int gains() const override { return 0; }
    bool common_weight() const override { return true; }
    const Plan& plan() const override { return plan_; }
    const std::vector<double>& measured(const Log& log, int axis) const override
    {
        return axis == 0 ? log.v_d_V : log.v_q_V;
    }
    std::vector<ReportBlock> report(const Point& at, std::size_t rows) const override;
    bool sweep(const Point& at, const std::vector<Input>* candidates, std::vector<BlockSum>& sums) const override;

private:
    /// In the rotor's frame, `offset` rad behind the log's: whatever bends or warms does so there. (E53)
    Moment moment(const Point& at, const Log& log, const TraceColumns& c, std::size_t k, double offset) const;
    /// Of its moment at the same offset, in the log's frame.
    Vector2 error(const Point& at, const TraceColumns& c, std::size_t k, double offset, Moment m) const;
    void put_angle(const Point& at, const Log& log, const TraceColumns& c, std::size_t k, double offset,
                   Eigen::VectorXd& row_d, Eigen::VectorXd& row_q) const;
    const std::vector<Log>& logs_;
    const std::vector<TraceColumns>& columns_;
    double pole_pairs_;
    Plan plan_;
};

}  // namespace dqw
#endif
