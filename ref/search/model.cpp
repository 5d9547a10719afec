#include "ref/search/model.hpp"

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
        for (int s = 0; s < free_shapes_of(t.input); ++s) v[j++] = t.input.shape[static_cast<std::size_t>(s)];
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
        for (int s = 0; s < free_shapes_of(t.input); ++s) t.input.shape[static_cast<std::size_t>(s)] = v[j++];
    }
}

}  // namespace dqw
