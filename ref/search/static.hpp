// The tracer's model of settled points: v against i and speed, with effects.
#ifndef DQW_REF_SEARCH_STATIC_HPP
#define DQW_REF_SEARCH_STATIC_HPP

#include "ref/search/dynamic.hpp"

namespace dqw {

/// (P6), (P7) with d/dt = 0 and the effects' f + w_e J g. The `delay` is in seconds here: a settled row has no period.
class TraceStatic : public TraceModel {
public:
    TraceStatic(const std::vector<Log>& logs, const std::vector<TraceColumns>& columns, double pole_pairs, Plan plan)
        : logs_(logs), columns_(columns), pole_pairs_(pole_pairs), plan_(std::move(plan))
    {
    }
    const std::vector<std::string>& base_names() const override;
    int channels() const override { return 2; }
    int gains() const override { return 0; }
    bool common_weight() const override { return true; }
    const Plan& plan() const override { return plan_; }
    std::vector<ReportBlock> report(const Point& at, std::size_t rows) const override;
    bool pass(const Point& at, const std::vector<Input>& candidates, std::vector<BlockSum>& sums) const override;

private:
    Moment moment(const Point& at, const Log& log, const TraceColumns& c, std::size_t k) const;
    Vector2 error(const Point& at, const Log& log, const TraceColumns& c, std::size_t k, Moment m) const;
    const std::vector<Log>& logs_;
    const std::vector<TraceColumns>& columns_;
    double pole_pairs_;
    Plan plan_;
};

}  // namespace dqw
#endif
