// A model whose rows are judged by another plan.
#ifndef DQW_REF_MODEL_REPLANNED_HPP
#define DQW_REF_MODEL_REPLANNED_HPP

#include <string>
#include <utility>
#include <vector>

#include "ref/model/model.hpp"

namespace dqw {

/// A model with other rows held out: `plan` has its blocks, in their order, or is folded_plan(), and then only for sums
/// that are folded. `of` outlives it.
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

}  // namespace dqw
#endif
