// The tracer's prediction model of a dynamic log: the innovations form with effects (E44), linearised by hand.
#ifndef DQW_REF_TRACE_DYNAMIC_HPP
#define DQW_REF_TRACE_DYNAMIC_HPP

#include "trace_model.hpp"

namespace dqw {

/// Columns that a log brings for effects, or what stands in for them.
struct TraceColumns {
    std::vector<double> cos_e, sin_e;         ///< of the angle: measured, or integrated from 0
    std::vector<double> winding_K, magnet_K;  ///< above 25 degC; empty without the column
    std::vector<std::vector<double>> heat;    ///< heating states (E55), one for each time constant
};

constexpr double kReferenceTemperature_C = 25.0;
/// Time constants of the heating states tried, over the length of the log.
constexpr double kHeatTimes[] = {0.05, 0.25, 1.0, 20.0};

TraceColumns trace_columns(const Log& log, double pole_pairs, double i_base_A, double span_s);

/// Heat of a Moment at row k: the log's temperature above 25 degC or a heating state.
double heat_at(const TraceColumns& columns, const Input& input, std::size_t k);

class TraceDynamic : public TraceModel {
public:
    enum Index { kR, kLd, kLq, kPsi, kBase };

    /// `columns[i]` belongs to logs[i]; both outlive the model.
    TraceDynamic(const std::vector<Log>& logs, const std::vector<TraceColumns>& columns, double pole_pairs, Plan plan);

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
    double w_max_rad_s_ = 0.0, dt_max_s_ = 0.0;
};

}  // namespace dqw
#endif
