#include "ref/model/settled.hpp"

#include <cmath>

#include "ref/effect/range.hpp"
#include "ref/model/inputs.hpp"

namespace dqw {
namespace {

enum Index { kR, kLd, kLq, kPsi };

/// f + w_e J g
Vector2 settled(const Moment& m, Vector2 f, Vector2 g) { return {f.d - m.w_e * g.q, f.q + m.w_e * g.d}; }

}  // namespace

const std::vector<std::string>& SettledModel::base_names() const
{
    static const std::vector<std::string> names{"R_ohm", "Ld_H", "Lq_H", "psi_Wb"};
    return names;
}

Moment SettledModel::moment(const Point& at, const Log& log, const TraceColumns& c, std::size_t k) const
{
    Moment m;
    m.i_d = at_row(log.i_d_A, k), m.i_q = at_row(log.i_q_A, k);
    m.w_e = log.regime == Regime::standstill ? 0.0 : pole_pairs_ * at_row(log.w_m_rad_s, k);
    m.cos_e = c.cos_e[k], m.sin_e = c.sin_e[k];
    m.v_end_d = at_row(log.v_d_V, k), m.v_end_q = at_row(log.v_q_V, k);
    m.held_alpha = m.cos_e * m.v_end_d - m.sin_e * m.v_end_q, m.held_beta = m.sin_e * m.v_end_d + m.cos_e * m.v_end_q;
    m.v_now = m.v_next = {m.v_end_d, m.v_end_q};
    m.v_dc = at_row(log.v_dc_V, k);
    m.settled = true;
    m.R = at.base[kR], m.Ld = at.base[kLd], m.Lq = at.base[kLq], m.psi = at.base[kPsi];
    return m;
}

Vector2 SettledModel::error(const Point& at, const Log& log, const TraceColumns& c, std::size_t k, Moment m) const
{
    // Whatever bends or warms does so in the rotor's frame, not in that of an angle that is off. (E53)
    double offset = 0.0;
    for (const Term& t : at.terms)
        if (t.input.law == Law::angle_offset) offset += t.weights[0];
    const double co = std::cos(offset), si = std::sin(offset), cos_e = m.cos_e;
    const Vector2 i{co * m.i_d - si * m.i_q, si * m.i_d + co * m.i_q},
        v{co * m.v_end_d - si * m.v_end_q, si * m.v_end_d + co * m.v_end_q};
    m.i_d = i.d, m.i_q = i.q, m.v_end_d = v.d, m.v_end_q = v.q, m.v_now = m.v_next = v;
    m.cos_e = co * cos_e + si * m.sin_e, m.sin_e = co * m.sin_e - si * cos_e;
    Vector2 f{m.R * m.i_d, m.R * m.i_q}, g{m.Ld * m.i_d + m.psi, m.Lq * m.i_q};
    for (const Term& t : at.terms) {
        if (t.input.law == Law::angle_offset) continue;
        m.heat_K = heat_at(c, t.input, k);
        evaluate_sum(t.input, t.weights.data(), m, f, g);
    }
    const Vector2 told = settled(m, f, g), e{v.d - told.d, v.q - told.q};
    return {co * e.d + si * e.q, co * e.q - si * e.d};
}

std::vector<ReportBlock> SettledModel::report(const Point& at, std::size_t) const
{
    std::vector<ReportBlock> out;
    for (const Log& log : logs_) {
        const TraceColumns& c = columns_[static_cast<std::size_t>(&log - logs_.data())];
        for (std::size_t k = 0; k < log.rows(); ++k) {
            const Vector2 e = error(at, log, c, k, moment(at, log, c, k));
            out.push_back({&log, k, k + 1, {at_row(log.v_d_V, k), at_row(log.v_q_V, k)}, {e.d, e.q}});
        }
    }
    return out;
}

bool SettledModel::sweep(const Point& at, const std::vector<Input>* candidates, std::vector<BlockSum>& sums) const
{
    const Eigen::Index n = columns_of(at, candidates);
    sums = empty_sums(plan_.blocks.size(), 2, n);
    if (!at.values().allFinite()) return false;
    Eigen::VectorXd row_d(n + 1), row_q(n + 1);
    for (std::size_t b = 0; b < sums.size(); ++b) {
        const FineBlock& block = plan_.blocks[b];
        const Log& log = *block.piece->log;
        const TraceColumns& c = columns_[static_cast<std::size_t>(&log - logs_.data())];
        for (std::size_t k = block.begin; k < block.end; ++k) {
            const Moment m = moment(at, log, c, k);
            Eigen::Index j = 0;
            const auto put = [&](Vector2 f, Vector2 g) {
                const Vector2 v = settled(m, f, g);
                row_d[j] = -v.d, row_q[j] = -v.q;
                ++j;
            };
            if (candidates != nullptr) {
                put({m.i_d, m.i_q}, {}), put({}, {m.i_d, 0.0}), put({}, {0.0, m.i_q}), put({}, {1.0, 0.0});
                put_inputs(at.terms, *candidates, c, k, m, put);
            }
            const Vector2 e = error(at, log, c, k, m);
            row_d[n] = e.d, row_q[n] = e.q;
            sums[b].gram[0] += row_d * row_d.transpose();
            sums[b].gram[1] += row_q * row_q.transpose();
            sums[b].rows += 1.0;
        }
    }
    return true;
}

}  // namespace dqw
