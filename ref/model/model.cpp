#include "ref/model/model.hpp"

#include <algorithm>

#include "ref/model/plan.hpp"

namespace dqw {

Eigen::Index Point::columns() const
{
    Eigen::Index n = base.size() + gain.size();
    for (const Term& t : terms) n += weights_of(t.input.law) + free_shapes_of(t.input);
    return n;
}

Eigen::VectorXd Point::values() const
{
    Eigen::VectorXd v(columns());
    v << base, gain, Eigen::VectorXd::Zero(columns() - base.size() - gain.size());
    Eigen::Index j = base.size() + gain.size();
    for (const Term& t : terms) {
        for (int w = 0; w < weights_of(t.input.law); ++w) v[j++] = t.weights[static_cast<std::size_t>(w)];
        for (int s = 0; s < free_shapes_of(t.input); ++s) v[j++] = t.input.shape[free_shape_of(t.input, s)];
    }
    return v;
}

void Point::set(const Eigen::VectorXd& v)
{
    base = v.head(base.size());
    gain = v.segment(base.size(), gain.size());
    Eigen::Index j = base.size() + gain.size();
    for (Term& t : terms) {
        for (int w = 0; w < weights_of(t.input.law); ++w) t.weights[static_cast<std::size_t>(w)] = v[j++];
        for (int s = 0; s < free_shapes_of(t.input); ++s) t.input.shape[free_shape_of(t.input, s)] = v[j++];
    }
}

double angle_offset_of(const Point& at)
{
    double sum = 0.0;
    for (const Term& t : at.terms)
        if (t.input.law == Law::angle_offset) sum += t.weights[0];
    return sum;
}

bool operator==(const Point& a, const Point& b)
{
    const auto alike = [](const Term& x, const Term& y) {
        const Input &i = x.input, &j = y.input;
        return x.weights == y.weights && i.law == j.law && i.shape == j.shape && i.heat == j.heat &&
               i.free_angle == j.free_angle && i.loss == j.loss && i.modulation == j.modulation &&
               i.averaged == j.averaged;
    };
    return a.base.size() == b.base.size() && a.base == b.base && a.gain.size() == b.gain.size() && a.gain == b.gain &&
           std::equal(a.terms.begin(), a.terms.end(), b.terms.begin(), b.terms.end(), alike);
}

void add_to(BlockSum& sum, const BlockSum& more)
{
    sum.rows += more.rows;
    for (std::size_t c = 0; c < sum.gram.size(); ++c) sum.gram[c] += more.gram[c];
}

Eigen::MatrixXd total_of(const std::vector<BlockSum>& sums, std::size_t channel)
{
    Eigen::MatrixXd total = sums.front().gram[channel];
    for (std::size_t b = 1; b < sums.size(); ++b) total += sums[b].gram[channel];
    return total;
}

std::vector<BlockSum> empty_sums(std::size_t count, int channels, Eigen::Index n)
{
    const auto each = static_cast<std::size_t>(channels);
    return std::vector<BlockSum>(count, {0.0, std::vector<Eigen::MatrixXd>(each, Eigen::MatrixXd::Zero(n + 1, n + 1))});
}

Eigen::Index columns_of(const Point& at, const std::vector<Input>* candidates)
{
    if (candidates == nullptr) return 0;
    Eigen::Index n = at.columns();
    for (const Input& input : *candidates) n += weights_of(input.law);
    return n;
}

std::vector<ReportBlock> Model::report_some(const Point& at, const WantedBlock& wanted) const
{
    std::vector<ReportBlock> out;
    for (const ReportBlock& b : report(at, 0))
        if (wanted(*b.log, b.begin, b.end)) out.push_back(b);
    return out;
}

std::vector<std::vector<BlockSum>> Model::sweep_gains(const std::vector<Point>& at,
                                                      const std::vector<std::vector<Input>>& candidates,
                                                      bool whole) const
{
    std::vector<Input> inputs;
    for (const std::vector<Input>& group : candidates) inputs.insert(inputs.end(), group.begin(), group.end());
    std::vector<std::vector<BlockSum>> out;
    for (const Point& point : at) {
        std::vector<BlockSum> sums;
        const bool ok = whole ? sweep(point, &inputs, sums) : sweep_some(point, &inputs, false, sums);
        out.push_back(ok && !sums.empty() ? folded(plan(), sums) : std::vector<BlockSum>());
    }
    return out;
}

void Model::report_each(const std::vector<Point>& at, std::size_t rows,
                        const std::function<void(const std::vector<ReportBlock>&)>& visit) const
{
    std::vector<std::vector<ReportBlock>> each;
    for (const Point& point : at) each.push_back(report(point, rows));
    std::vector<ReportBlock> blocks(at.size());
    for (std::size_t b = 0; b < each.front().size(); ++b) {
        for (std::size_t p = 0; p < at.size(); ++p) blocks[p] = each[p][b];
        visit(blocks);
    }
}

}  // namespace dqw
