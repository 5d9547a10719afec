#include "ref/model/settled.hpp"

#include <algorithm>
#include <cmath>

#include "ref/effect/range.hpp"
#include "ref/model/inputs.hpp"

namespace dqw {
namespace {

enum Index { kR, kLd, kLq, kPsi };

/// f + w_e J g
Vector2 settled(const Moment& m, Vector2 f, Vector2 g) { return {f.d - m.w_e * g.q, f.q + m.w_e * g.d}; }

/// The incremental inductance half-way to the current that the iron leaves to the winding, so that what it takes of the
/// flux is true to second order. (E175)
void put_bends(const Point& at, Moment& m)
{
    if (std::none_of(at.terms.begin(), at.terms.end(), [](const Term& t) { return bends(t.input.law); })) return;
    Moment between = m;
    for (const Term& t : at.terms) {
        if (t.input.law != Law::iron_loss) continue;
        Vector2 f, g;
        evaluate_sum(t.input, t.weights.data(), m, f, g);
        between.i_d += 0.5 * g.d / m.Ld, between.i_q += 0.5 * g.q / m.Lq;
    }
    double f[4] = {}, g[4] = {};
    for (const Term& t : at.terms)
        if (bends(t.input.law)) evaluate_slope(t.input, t.weights.data(), between, f, g);
    m.bend_dd_H = g[0], m.bend_dq_H = g[1], m.bend_qq_H = g[3];
}

}  // namespace

const std::vector<std::string>& SettledModel::base_names() const
{
    static const std::vector<std::string> names{"R_ohm", "Ld_H", "Lq_H", "psi_Wb"};
    return names;
}

Moment SettledModel::moment(const Point& at, const Log& log, const TraceColumns& c, std::size_t k, double offset) const
{
    Moment m;
    const Vector2 i = turned_by(offset, {at_row(log.i_d_A, k), at_row(log.i_q_A, k)}),
                  v = turned_by(offset, {at_row(log.v_d_V, k), at_row(log.v_q_V, k)}),
                  axis = turned_by(-offset, {c.cos_e[k], c.sin_e[k]});
    m.i_d = i.d, m.i_q = i.q, m.v_end_d = v.d, m.v_end_q = v.q, m.v_now = m.v_next = v;
    m.cos_e = axis.d, m.sin_e = axis.q;
    m.w_e = log.regime == Regime::standstill ? 0.0 : pole_pairs_ * at_row(log.w_m_rad_s, k);
    m.held_alpha = m.cos_e * v.d - m.sin_e * v.q, m.held_beta = m.sin_e * v.d + m.cos_e * v.q;
    m.v_dc = at_row(log.v_dc_V, k);
    m.settled = true;
    m.R = at.base[kR], m.Ld = at.base[kLd], m.Lq = at.base[kLq], m.psi = at.base[kPsi];
    put_state(at.terms, c, k, m);
    put_lost(at.terms, m);
    put_bends(at, m);
    put_told(at.terms, c, k, m);
    return m;
}

Vector2 SettledModel::error(const Point& at, const TraceColumns& c, std::size_t k, double offset, Moment m) const
{
    const double R = at.base[kR], psi = at.base[kPsi];
    Vector2 f{R * m.i_d, R * m.i_q}, g{m.Ld * m.i_d + psi, m.Lq * m.i_q};
    for (const Term& t : at.terms) {
        if (t.input.law == Law::angle_offset) continue;
        m.state = state_at(c, t.input, k);
        evaluate_sum(t.input, t.weights.data(), m, f, g);
    }
    const Vector2 told = settled(m, f, g);
    return turned_by(-offset, {m.v_end_d - told.d, m.v_end_q - told.q});
}

std::vector<ReportBlock> SettledModel::report(const Point& at, std::size_t) const
{
    std::vector<ReportBlock> out;
    const double offset = angle_offset_of(at);
    for (const Log& log : logs_) {
        const TraceColumns& c = columns_[static_cast<std::size_t>(&log - logs_.data())];
        for (std::size_t k = 0; k < log.rows(); ++k) {
            const Vector2 e = error(at, c, k, offset, moment(at, log, c, k, offset));
            out.push_back({&log, k, k + 1, {at_row(log.v_d_V, k), at_row(log.v_q_V, k)}, {e.d, e.q}});
        }
    }
    return out;
}

/// The column of an angle offset that is on: with all that stands in the rotor's frame, by difference.
void SettledModel::put_angle(const Point& at, const Log& log, const TraceColumns& c, std::size_t k, double offset,
                             Eigen::VectorXd& row_d, Eigen::VectorXd& row_q) const
{
    constexpr double kStep = 1e-5;  // rad: bends by a 10^-10th
    Eigen::Index j = at.base.size();
    for (const Term& t : at.terms) {
        if (t.input.law == Law::angle_offset) {
            const auto at_offset = [&](double by) { return error(at, c, k, by, moment(at, log, c, k, by)); };
            const Vector2 more = at_offset(offset + kStep), less = at_offset(offset - kStep);
            row_d[j] = (more.d - less.d) / (2.0 * kStep), row_q[j] = (more.q - less.q) / (2.0 * kStep);
        }
        j += weights_of(t.input.law) + free_shapes_of(t.input);
    }
}

bool SettledModel::sweep(const Point& at, const std::vector<Input>* candidates, std::vector<BlockSum>& sums) const
{
    const Eigen::Index n = columns_of(at, candidates);
    sums = empty_sums(plan_.blocks.size(), 2, n);
    if (!at.values().allFinite()) return false;
    const double offset = angle_offset_of(at);
    Eigen::VectorXd row_d(n + 1), row_q(n + 1);
    Units units;
    for (std::size_t b = 0; b < sums.size(); ++b) {
        const FineBlock& block = plan_.blocks[b];
        const Log& log = *block.piece->log;
        const TraceColumns& c = columns_[static_cast<std::size_t>(&log - logs_.data())];
        for (std::size_t k = block.begin; k < block.end; ++k) {
            const Moment m = moment(at, log, c, k, offset);
            Eigen::Index j = 0;
            const auto put = [&](Vector2 f, Vector2 g) {
                const Vector2 v = turned_by(-offset, settled(m, f, g));
                row_d[j] = -v.d, row_q[j] = -v.q;
                ++j;
            };
            if (candidates != nullptr) {
                put({m.i_d, m.i_q}, {}), put({}, {m.i_d, 0.0}), put({}, {0.0, m.i_q}), put({}, {1.0, 0.0});
                Moment of_units = m;
                put_inputs(at.terms, *candidates, c, k, of_units, units, put);
                put_angle(at, log, c, k, offset, row_d, row_q);
            }
            const Vector2 e = error(at, c, k, offset, m);
            row_d[n] = e.d, row_q[n] = e.q;
            sums[b].gram[0] += row_d * row_d.transpose();
            sums[b].gram[1] += row_q * row_q.transpose();
            sums[b].rows += 1.0;
        }
    }
    return true;
}

}  // namespace dqw
