// Effects that are named, not searched for: the shapes in which they fit a log best.
#ifndef DQW_REF_TRACE_SHAPES_HPP
#define DQW_REF_TRACE_SHAPES_HPP

#include "ref/trace/setup.hpp"

namespace dqw {

/// A model with other rows held out: `plan` has its blocks, in their order. `of` outlives it.
class Replanned : public Model {
public:
    Replanned(const Model& of, Plan plan) : of_(of), plan_(std::move(plan)) {}
    const std::vector<std::string>& base_names() const override { return of_.base_names(); }
    int channels() const override { return of_.channels(); }
    int gains() const override { return of_.gains(); }
    bool common_weight() const override { return of_.common_weight(); }
    const Plan& plan() const override { return plan_; }
    std::vector<ReportBlock> report(const Point& at, std::size_t rows) const override { return of_.report(at, rows); }
    const std::vector<double>& measured(const Log& log, int c) const override { return of_.measured(log, c); }
    bool sweep(const Point& at, const std::vector<Input>* candidates, std::vector<BlockSum>& sums) const override
    {
        return of_.sweep(at, candidates, sums);
    }

private:
    const Model& of_;
    Plan plan_;
};

/// The blocks of a model's plan, none held out: a fit sees all rows but the guards between stretches.
Plan all_seen(const Model& model);

/// (E47). The plain model and every effect of `names`, jointly, fitted to all rows. Which of its shapes an effect
/// takes, the rows held out decide. Throws std::invalid_argument (one line) where the log cannot test an effect. Not
/// ok: no start could be predicted from.
Refined fit_named(const TraceSetup& setup, const std::vector<std::string>& names, const std::function<void()>& tick);

}  // namespace dqw
#endif
