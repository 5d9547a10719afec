#include "ref/trace/determined.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "ref/log/symmetric.hpp"
#include "ref/trace/column_noise.hpp"
#include "ref/trace/shapes.hpp"

namespace dqw {

using namespace assessing;

namespace {

std::vector<std::string> column_names(const Model& model, const Point& at)
{
    std::vector<std::string> names = model.base_names();
    names.resize(static_cast<std::size_t>(at.base.size() + at.gain.size()));
    for (const Term& t : at.terms) {
        const std::string name = name_of(t.input.law);
        names.push_back(std::find(names.begin(), names.end(), name) == names.end() ? name : "");
        names.resize(names.size() + static_cast<std::size_t>(weights_of(t.input.law) + free_shapes_of(t.input)) - 1);
    }
    return names;
}

/// Information of the columns, each channel weighed by what is left of it.
Eigen::MatrixXd information(const Model& model, const std::vector<BlockSum>& sums)
{
    const Eigen::Index n = sums.front().gram.front().rows() - 1;
    std::vector<Eigen::MatrixXd> total(static_cast<std::size_t>(model.channels()), Eigen::MatrixXd::Zero(n + 1, n + 1));
    double most = 0.0;
    for (std::size_t c = 0; c < total.size(); ++c) {
        for (const BlockSum& s : sums) total[c] += s.gram[c];
        most = std::max(most, total[c](n, n));
    }
    // As in a step: an axis weighs 10^6 of the other's at most, and zero divides nothing.
    const double least = 1e-6 * most + 1e-300;
    Eigen::MatrixXd m = Eigen::MatrixXd::Zero(n, n);
    for (const Eigen::MatrixXd& t : total)
        m += t.topLeftCorner(n, n) / (model.common_weight() ? 1.0 : std::max(t(n, n), least));
    return m;
}

/// A size of each base parameter that would matter: psi beside the flux linkage of the currents.
Eigen::VectorXd typical_of(const TraceSetup& setup, const Point& at)
{
    Eigen::VectorXd typical = at.base.cwiseAbs();
    if (setup.regime == Regime::mechanical) return typical;
    double d = 0.0, q = 0.0, rows = 0.0;
    for (const Log& log : *setup.logs) {
        for (double i : log.i_d_A) d += i * i;
        for (double i : log.i_q_A) q += i * i;
        rows += static_cast<double>(log.rows());
    }
    // A magnet of a tenth of it is hardly one.
    constexpr double kMatters = 0.1;
    const double of_currents = std::sqrt((at.base[1] * at.base[1] * d + at.base[2] * at.base[2] * q) /
                                         std::max(rows, 1.0));
    typical[3] = std::max(typical[3], kMatters * of_currents);
    return typical;
}

/// Verdicts that do not need deviations: no effect, or only together with others.
void mark_undetermined(const Eigen::MatrixXd& m, const Eigen::VectorXd& typical, const std::vector<std::string>& names,
                       std::vector<Assessment>& base)
{
    const auto effect = [&](Eigen::Index j) { return typical[j] * std::sqrt(m(j, j)); };
    double largest = 0.0;
    for (Eigen::Index j = 0; j < typical.size(); ++j) largest = std::max(largest, effect(j));
    const Eigen::VectorXd size = m.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const Symmetric eigen(size.asDiagonal() * m * size.asDiagonal());
    for (std::size_t j = 0; j < base.size(); ++j) {
        const auto column = static_cast<Eigen::Index>(j);
        std::set<int> partners;  // of several directions each once
        if (!(effect(column) > kNoEffect * largest)) {
            base[j].verdict = Verdict::no_effect;
            continue;
        }
        for (Eigen::Index k = 0; k < m.rows(); ++k) {
            const Eigen::VectorXd v = eigen.eigenvectors().col(k);
            if (eigen.eigenvalues()[k] > kCollinear || std::abs(v[column]) < kPartner) continue;
            for (Eigen::Index other = 0; other < v.size(); ++other)
                if (other != column && std::abs(v[other]) >= kPartner &&
                    !names[static_cast<std::size_t>(other)].empty())
                    partners.insert(static_cast<int>(other));
            base[j].partners.assign(partners.begin(), partners.end());
            base[j].verdict = base[j].partners.empty() ? Verdict::uncertain : Verdict::collinear;
        }
    }
}

/// Deviations if nothing corrected the state. Noise that the gains let into it looks like excitation.
Eigen::VectorXd simulated(const Model& model, const Refined& refined)
{
    Refined bare = refined;
    bare.point.gain.setZero();
    if (!model.pass(bare.point, {}, bare.sums)) return deviations(model, refined);
    const Eigen::Index first = bare.point.base.size(), count = bare.point.gain.size();
    if (bare.added.size() > 0) bare.added.segment(first, count).setZero();
    for (BlockSum& s : bare.sums)
        for (Eigen::MatrixXd& g : s.gram) g.middleRows(first, count).setZero(), g.middleCols(first, count).setZero();
    return deviations(model, bare);
}

}  // namespace

void Determined::widen(const Eigen::VectorXd& more)
{
    sd = (sd.array().square() + more.array().square()).sqrt();
    for (std::size_t j = 0; j < base.size(); ++j)
        base[j].sd = std::hypot(base[j].sd, more[static_cast<Eigen::Index>(j)]);
}

bool Determined::knows(const Point& at, const std::string& effect) const
{
    Eigen::Index j = at.base.size() + at.gain.size();
    for (const Term& t : at.terms) {
        for (int w = 0; w < weights_of(t.input.law); ++w)
            if (effect == name_of(t.input.law) &&
                sd[j + w] < kUncertain * std::abs(t.weights[static_cast<std::size_t>(w)]))
                return true;
        j += weights_of(t.input.law) + free_shapes_of(t.input);
    }
    return false;
}

Determined determined_of(const TraceSetup& setup, const Refined& refined)
{
    const Replanned model(*setup.full, all_seen(*setup.full));
    const Point& at = refined.point;
    Determined d;
    d.sd = whole_deviations(setup, model, refined);
    d.names = column_names(model, at);
    const Eigen::VectorXd bare = model.gains() > 0 ? simulated(model, refined) : d.sd, typical = typical_of(setup, at);
    for (Eigen::Index j = 0; j < at.base.size(); ++j) {
        Assessment a;
        a.value = at.base[j], a.sd = d.sd[j];
        if (const double sd = std::max(d.sd[j], bare[j]); !(sd <= kUncertain * typical[j]))
            a.verdict = Verdict::uncertain, a.sd = sd;
        d.base.push_back(a);
    }
    mark_undetermined(information(model, refined.sums), typical, d.names, d.base);
    return d;
}

}  // namespace dqw
