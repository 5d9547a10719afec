#include "ref/trace/shapes.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "ref/trace/column_noise.hpp"

namespace dqw {
namespace {

constexpr std::size_t kRefined = 3;  ///< choices that are fitted, the best first
/// Of shapes, each until none changes; of fits, each until it gains no more: ends that hardly any reaches.
constexpr int kRounds = 4, kSearchPasses = 12, kPasses = 30;

/// The shapes of one effect.
using Shapes = std::vector<const Candidate*>;

Shapes shapes_of(const TraceSetup& setup, const std::string& name)
{
    for (const TraceRejected& r : setup.untestable)
        if (r.name == name) {
            const std::string begin = "not tested: ",
                              why = r.why.rfind(begin, 0) == 0 ? r.why.substr(begin.size()) : r.why;
            throw std::invalid_argument(setup.logs->front().path + ": " + name + " cannot be fitted: " + why);
        }
    Shapes shapes;
    for (const Candidate& c : setup.candidates)
        if (c.names() == std::vector<std::string>{name}) shapes.push_back(&c);
    if (shapes.empty())
        throw std::invalid_argument(setup.logs->front().path + ": " + name + " cannot be fitted to a log of this kind");
    return shapes;
}

struct Choice {
    Point point;  ///< a linear step from where it was chosen
    double heldout = -HUGE_VAL;
};

constexpr double kLeastPart = 0.1;  ///< of a start: from it refine() comes back in two passes

/// Linear steps from one point, for any shapes: all of them are columns of the same sums.
class Steps {
public:
    Steps(const Model& model, const Point& at, const std::vector<Shapes>& effects)
        : model_(model, folded_plan()), at_(at), effects_(effects)
    {
        std::vector<Input> inputs;
        Eigen::Index column = at.columns();
        for (const Shapes& shapes : effects) {
            first_.emplace_back();
            for (const Candidate* c : shapes) {
                first_.back().push_back(column);
                for (const Input& input : c->inputs) inputs.push_back(input), column += weights_of(input.law);
            }
        }
        sums_ = model.sweep_gains({at}, {inputs}, true).front();
        ok_ = !sums_.empty();
        prior_ = prior_of(at, inputs);
        if (ok_) seen_ = seen_of(model_, sums_);
    }
    bool ok() const { return ok_; }

    /// `picked[n]`: shape of effect n.
    Choice step(const std::vector<std::size_t>& picked) const
    {
        std::vector<Eigen::Index> use;
        // The gain stays: a step of it is far from linear.
        for (Eigen::Index j = 0; j < at_.base.size(); ++j) use.push_back(j);
        for (Eigen::Index j = at_.base.size() + at_.gain.size(); j < at_.columns(); ++j) use.push_back(j);
        for (std::size_t n = 0; n < effects_.size(); ++n) {
            Eigen::Index column = first_[n][picked[n]];
            for (const Input& input : effects_[n][picked[n]]->inputs)
                for (int w = 0; w < weights_of(input.law); ++w) use.push_back(column++);
        }
        const Eigen::VectorXd delta = linear_step(model_, seen_, use, 0.0, prior_);
        Choice out{at_, left_after(model_, sums_, delta).heldout};
        out.point.set(at_.values() + delta.head(at_.columns()));
        // R, L and J are none below zero: so far the step is not linear.
        for (Eigen::Index j = 0; j + 1 < at_.base.size(); ++j)
            out.point.base[j] = std::max(out.point.base[j], kLeastPart * at_.base[j]);
        for (std::size_t n = 0; n < effects_.size(); ++n) {
            Eigen::Index column = first_[n][picked[n]];
            for (const Input& input : effects_[n][picked[n]]->inputs) {
                Term term{input, {}};
                for (int w = 0; w < weights_of(input.law); ++w)
                    term.weights[static_cast<std::size_t>(w)] = delta[column++];
                out.point.terms.push_back(term);
            }
        }
        return out;
    }

private:
    const Replanned model_;
    const Point& at_;
    const std::vector<Shapes>& effects_;
    std::vector<std::vector<Eigen::Index>> first_;  ///< columns of each shape of each effect
    std::vector<BlockSum> sums_;                    ///< folded
    Seen seen_;                                     ///< their total
    Prior prior_;
    bool ok_ = false;
};

/// The best shapes, one effect after the other, until none changes.
Choice best_shapes(const Model& model, const Point& at, const std::vector<Shapes>& effects)
{
    const Steps steps(model, at, effects);
    if (!steps.ok()) return {at, -HUGE_VAL};
    std::vector<std::size_t> picked(effects.size(), 0);
    Choice best = steps.step(picked);
    bool changed = true;
    for (int round = 0; round < kRounds && changed; ++round) {
        changed = false;
        for (std::size_t n = 0; n < effects.size(); ++n)
            for (std::size_t s = 0; s < effects[n].size(); ++s) {
                std::vector<std::size_t> trial = picked;
                trial[n] = s;
                if (trial == picked) continue;
                const Choice c = steps.step(trial);
                if (c.heldout > best.heldout) best = c, picked = trial, changed = true;
            }
    }
    return best;
}

/// Where to begin: the log's own starting points, and each once fitted without the effects.
std::vector<Point> beginnings(const Model& model, const std::vector<Point>& starts)
{
    std::vector<Point> out;
    for (Point start : starts) {
        Refined plain = refine(model, start, kSearchPasses);
        if (!plain.ok && start.base.size() == 4) {
            // An axis whose current is all noise starts with hardly any inductance.
            start.base[1] = start.base[2] = std::max(start.base[1], start.base[2]);
            plain = refine(model, start, kSearchPasses);
        }
        if (plain.ok) out.insert(out.end(), {start, plain.point});
    }
    return out;
}

}  // namespace

Plan all_seen(const Model& model)
{
    Plan plan = model.plan();
    for (FineBlock& b : plan.blocks) b.heldout = false;
    return plan;
}

Refined fit_named(const TraceSetup& setup, const std::vector<std::string>& names, const std::function<void()>& tick)
{
    std::vector<Shapes> effects;
    for (const std::string& name : names) effects.push_back(shapes_of(setup, name));
    const Model& model = setup.search();
    std::vector<Choice> choices;
    for (const Point& start : beginnings(model, setup.starts)) {
        std::vector<double> gains(std::begin(kScreenGains), std::end(kScreenGains));
        if (model.gains() == 0) gains.resize(1);
        for (double gain : gains) {
            Point at = start;
            at.gain.setConstant(gain);
            choices.push_back(best_shapes(model, at, effects));
            if (tick) tick();
        }
    }
    std::sort(choices.begin(), choices.end(), [](const Choice& a, const Choice& b) { return a.heldout > b.heldout; });
    Refined best;
    for (std::size_t k = 0; k < std::min(kRefined, choices.size()); ++k) {
        Refined r = refine(model, choices[k].point, kSearchPasses);
        if (r.ok && (!best.ok || r.left.heldout > best.left.heldout)) best = std::move(r);
        if (tick) tick();
    }
    if (!best.ok) return best;
    const Replanned all(*setup.full, all_seen(*setup.full));
    return without_column_noise(setup, all, refine(all, best.point, kPasses));
}

}  // namespace dqw
