#include "ref/search/dynamic.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>

#include "ref/log/residual.hpp"
#include "ref/search/response.hpp"

namespace dqw {
namespace {

constexpr double kLargestRateDt = 15.0;  ///< (R/L + w_e) dt beyond which a log says nothing about L
constexpr int kChunk = 128;              ///< rows gathered before they are added up
constexpr int kIterations = 4;           ///< of the implicit end of a period

/// Voltages held in the last periods, the last first, as the rotor sees them.
using Held = std::array<Vector2, kPast>;
Held held_from(Vector2 v)
{
    Held held;
    held.fill(v);
    return held;
}

/// A voltage held over a period in which the rotor turns by 2 h, from its mean in the rotor's frame.
struct Hold {
    double sinc;
    double bow;  ///< half-way, of a flux that stands in the rotor, while the voltage does not turn with it
    Matrix2 to_start, to_end;  ///< from the frame of a period's start (end) to that of its middle
    Vector2 end;               ///< as seen at the end
    Vector2 change
        /// mean less the mean of the last held voltage, had it gone on; that less the one before ...; as an f of
        /// constant value
        [kPast];
    /// `held`: the last voltages, as seen at the start; as seen at the end, this one first, when done.
    Hold(double h, Vector2 mean, Held& held, bool rotor_held)
    {
        const double c = std::cos(h), s = std::sin(h);
        sinc = std::abs(h) > 1e-4 ? s / h : 1.0 - h * h / 6.0;
        to_start = turn(c, -s), to_end = turn(c, s);
        end = rotor_held ? mean : to_start * Vector2{mean.d / sinc, mean.q / sinc};
        bow = rotor_held ? 0.0 : -0.5 * s * s;
        Vector2 now{mean.d / sinc, mean.q / sinc}, next = end;
        for (int n = 0; n < kPast; ++n) {
            const Vector2 last = to_start * held[static_cast<std::size_t>(n)];
            change[n] = {(now.d - last.d) / c, (now.q - last.q) / c};
            now = last;
            held[static_cast<std::size_t>(n)] = next, next = to_start * last;
        }
    }
};

/// One column of the derivative: the voltage f and the flux g that one unit of a weight adds.
struct Lane {
    Vector2 f0, g0, f1, g1;
};

}  // namespace

TraceDynamic::TraceDynamic(const std::vector<Log>& logs, const std::vector<TraceColumns>& columns, double pole_pairs,
                           Plan plan, bool rotor_held)
    : logs_(logs), columns_(columns), pole_pairs_(pole_pairs), plan_(std::move(plan)), rotor_held_(rotor_held)
{
    for (const Piece& piece : plan_.pieces)
        for (std::size_t k = piece.begin; k < piece.end; ++k) {
            w_max_rad_s_ = std::max(w_max_rad_s_, std::abs(pole_pairs * piece.log->w_m_rad_s[k]));
            if (k + 1 < piece.end) dt_max_s_ = std::max(dt_max_s_, piece.period_s(k));
        }
}

const std::vector<std::string>& TraceDynamic::base_names() const
{
    static const std::vector<std::string> names{"R_ohm", "Ld_H", "Lq_H", "psi_Wb"};
    return names;
}

/// One pass over one piece.
struct TraceDynamic::Run {
    const TraceDynamic& model;
    const Point& at;
    const std::vector<Input>& candidates;
    std::vector<BlockSum>& sums;
    const Eigen::Index columns;
    std::vector<Lane> lanes;
    std::vector<double> s_d, s_q;
    std::size_t block;
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic> rows_d, rows_q;
    int gathered = 0;

    Run(const TraceDynamic& m, const Point& p, const std::vector<Input>& c, std::vector<BlockSum>& s, Eigen::Index n,
        std::size_t first_block)
        : model(m), at(p), candidates(c), sums(s), columns(n), lanes(static_cast<std::size_t>(n)),
          s_d(static_cast<std::size_t>(n)), s_q(static_cast<std::size_t>(n)), block(first_block), rows_d(n + 1, kChunk),
          rows_q(n + 1, kChunk)
    {
    }

    void flush()
    {
        if (gathered == 0) return;
        BlockSum& sum = sums[block];
        sum.rows += gathered;
        sum.gram[0].selfadjointView<Eigen::Lower>().rankUpdate(rows_d.leftCols(gathered));
        sum.gram[1].selfadjointView<Eigen::Lower>().rankUpdate(rows_q.leftCols(gathered));
        gathered = 0;
    }

    void count(std::size_t row, const Piece& piece, double e_d, double e_q)
    {
        const auto& blocks = model.plan_.blocks;
        while (block < blocks.size() && blocks[block].piece == &piece && row >= blocks[block].end) {
            flush();
            ++block;
        }
        if (block >= blocks.size() || blocks[block].piece != &piece || row < blocks[block].begin) return;
        for (Eigen::Index j = 0; j < columns; ++j)
            rows_d(j, gathered) = -s_d[static_cast<std::size_t>(j)],
                      rows_q(j, gathered) = -s_q[static_cast<std::size_t>(j)];
        rows_d(columns, gathered) = e_d, rows_q(columns, gathered) = e_q;
        if (++gathered == kChunk) flush();
    }

    Moment moment(const Piece& piece, const TraceColumns& c, std::size_t k, Vector2 i, Vector2 v_end, double dt) const
    {
        Moment m;
        m.i_d = i.d, m.i_q = i.q, m.w_e = model.pole_pairs_ * piece.log->w_m_rad_s[k];
        m.cos_e = c.cos_e[k], m.sin_e = c.sin_e[k];
        m.v_end_d = v_end.d, m.v_end_q = v_end.q, m.period_s = dt;
        m.R = at.base[kR], m.Ld = at.base[kLd], m.Lq = at.base[kLq], m.psi = at.base[kPsi];
        return m;
    }

    /// Makes two moments the ends of one period.
    static void pair(const Hold& hold, Moment& m0, Moment& m1)
    {
        m0.starts = m1.ends = true;
        std::copy(std::begin(hold.change), std::end(hold.change), m0.change),
            std::copy(std::begin(hold.change), std::end(hold.change), m1.change);
        m0.mean_of_held = m1.mean_of_held = hold.sinc * hold.to_end.dd;
        // Voltage held, magnet turning: the current bows by the flux' (w_e T)^2/8 over L_d, two thirds of it on
        // average.
        const double c = hold.to_end.dd, s = hold.to_end.qd, bow = hold.bow * m0.psi / m0.Ld;
        m0.bow_d = m1.bow_d = 2.0 / 3.0 * bow;
        m1.bow_alpha = bow * (c * m0.cos_e - s * m0.sin_e), m1.bow_beta = bow * (s * m0.cos_e + c * m0.sin_e);
        m1.past_alpha = m0.cos_e * m0.i_d - m0.sin_e * m0.i_q, m1.past_beta = m0.sin_e * m0.i_d + m0.cos_e * m0.i_q;
    }

    /// `responded`: without what the response holds already.
    void sum_terms(const TraceColumns& c, std::size_t k, Moment& m, bool responded, Vector2& f, Vector2& g) const
    {
        for (const Term& t : at.terms) {
            if (responded && t.input.law == Law::skin_effect) continue;
            m.heat_K = heat_at(c, t.input, k);
            evaluate_sum(t.input, t.weights.data(), m, f, g);
        }
    }

    void slopes(const Moment& m, double f[4], double g[4]) const
    {
        for (const Term& t : at.terms) evaluate_slope(t.input, t.weights.data(), m, f, g);
    }

    /// f and g of every column but the gains, at the start (`end` false) or the end of a period.
    void fill(const TraceColumns& c, std::size_t k, Moment m, bool end)
    {
        std::size_t j = 0;
        const auto put = [&](Vector2 f, Vector2 g) {
            Lane& lane = lanes[j++];
            (end ? lane.f1 : lane.f0) = f, (end ? lane.g1 : lane.g0) = g;
        };
        put({m.i_d, m.i_q}, {});
        put({}, {m.i_d, 0.0});
        put({}, {0.0, m.i_q});
        put({}, {1.0, 0.0});
        j += 2;
        Vector2 f[kMostWeights], g[kMostWeights];
        for (const Term& t : at.terms) {
            m.heat_K = heat_at(c, t.input, k);
            evaluate(t.input, m, f, g, t.weights.data());
            for (int w = 0; w < weights_of(t.input.law); ++w) put(f[w], g[w]);
            for (int s = 0; s < free_shapes_of(t.input); ++s) {
                Term moved = t;
                const double step = s == 0 ? 1e-3 * t.input.shape[0] : 1e-3;
                moved.input.shape[static_cast<std::size_t>(s)] += step;
                Vector2 f0, g0, f1, g1;
                evaluate_sum(t.input, t.weights.data(), m, f0, g0);
                evaluate_sum(moved.input, t.weights.data(), m, f1, g1);
                put({(f1.d - f0.d) / step, (f1.q - f0.q) / step}, {(g1.d - g0.d) / step, (g1.q - g0.q) / step});
            }
        }
        for (const Input& input : candidates) {
            m.heat_K = heat_at(c, input, k);
            evaluate(input, m, f, g);
            for (int w = 0; w < weights_of(input.law); ++w) put(f[w], g[w]);
        }
    }

    /// The terms' mean voltage over the period from row k, from measured currents. `held`: the last voltages as seen at
    /// its start, and then at its end.
    Vector2 lost(const Piece& piece, const TraceColumns& c, std::size_t k, double dt, Held& held) const
    {
        const Log& log = *piece.log;
        const double h = 0.5 * model.pole_pairs_ * 0.5 * (log.w_m_rad_s[k] + log.w_m_rad_s[k + 1]) * dt;
        const Vector2 v_end = held[0];
        const Hold hold(h, {log.v_d_V[k], log.v_q_V[k]}, held, model.rotor_held_);
        Moment m0 = moment(piece, c, k, {log.i_d_A[k], log.i_q_A[k]}, v_end, dt);
        Moment m1 = moment(piece, c, k + 1, {log.i_d_A[k + 1], log.i_q_A[k + 1]}, hold.end, dt);
        pair(hold, m0, m1);
        Vector2 f0, g0, f1, g1;
        sum_terms(c, k, m0, false, f0, g0);
        sum_terms(c, k + 1, m1, false, f1, g1);
        const Vector2 a = hold.to_start * Vector2{0.5 * f0.d - g0.d / dt, 0.5 * f0.q - g0.q / dt};
        const Vector2 b = hold.to_end * Vector2{0.5 * f1.d + g1.d / dt, 0.5 * f1.q + g1.q / dt};
        return {hold.sinc * (a.d + b.d), hold.sinc * (a.q + b.q)};
    }

    bool run(const Piece& piece, const TraceColumns& c)
    {
        const Log& log = *piece.log;
        const double R = at.base[kR], Ld = at.base[kLd], Lq = at.base[kLq], psi = at.base[kPsi];
        const double g_d = std::clamp(at.gain[0], 0.0, 1.0), g_q = std::clamp(at.gain[1], 0.0, 1.0);
        // A resistance that grows with the speed is stiff where it is large: it belongs into the response.
        double skin = 0.0;
        for (const Term& t : at.terms)
            if (t.input.law == Law::skin_effect) skin += t.weights[0];
        const ResponseTable table({R, Ld, Lq, skin, model.rotor_held_}, model.w_max_rad_s_, piece.dt_s);
        std::fill(s_d.begin(), s_d.end(), 0.0), std::fill(s_q.begin(), s_q.end(), 0.0);
        const std::size_t gain_lane = kBase;
        Vector2 i{log.i_d_A[piece.begin], log.i_q_A[piece.begin]};
        Held held = held_from({log.v_d_V[piece.begin], log.v_q_V[piece.begin]});
        const bool with_terms = !at.terms.empty();
        for (std::size_t k = piece.begin; k + 1 < piece.end; ++k) {
            const double dt = piece.period_s(k),
                         w_dt = model.pole_pairs_ * 0.5 * (log.w_m_rad_s[k] + log.w_m_rad_s[k + 1]) * dt,
                         h = 0.5 * w_dt;
            const Response r = table.at(w_dt, dt);
            const Matrix2 A{r[0], r[2], r[1], r[3]}, B{r[4], r[6], r[5], r[7]};
            const Vector2 v{log.v_d_V[k], log.v_q_V[k]};
            const Vector2 v_end = held[0];
            const Hold hold(h, v, held, model.rotor_held_);
            const Matrix2 &to_start = hold.to_start, &to_end = hold.to_end,
                          Bs{hold.sinc * B.dd, hold.sinc * B.dq, hold.sinc * B.qd, hold.sinc * B.qq};
            const Vector2 end_v = hold.end;

            Moment m0 = moment(piece, c, k, i, v_end, dt), m1;
            pair(hold, m0, m1);
            Vector2 x = A * Vector2{Ld * i.d, Lq * i.q};
            const Vector2 push = B * v;
            x.d += push.d + r[8] * psi, x.q += push.q + r[9] * psi;
            const Matrix2 P = Bs * to_end;
            Matrix2 jacobian{Ld, 0.0, 0.0, Lq}, start{A.dd * Ld, A.dq * Lq, A.qd * Ld, A.qq * Lq};
            Vector2 next;
            if (with_terms) {
                Vector2 f0, g0;
                double fs[4] = {}, gs[4] = {};
                sum_terms(c, k, m0, true, f0, g0);
                slopes(m0, fs, gs);
                const Matrix2 Q = Bs * to_start;
                const Vector2 given = Q * Vector2{g0.d / dt - 0.5 * f0.d, g0.q / dt - 0.5 * f0.q};
                const Matrix2 change0 = Q * Matrix2{gs[0] / dt - 0.5 * fs[0], gs[1] / dt - 0.5 * fs[1],
                                                    gs[2] / dt - 0.5 * fs[2], gs[3] / dt - 0.5 * fs[3]};
                start = {start.dd + change0.dd, start.dq + change0.dq, start.qd + change0.qd, start.qq + change0.qq};
                x.d += given.d, x.q += given.q;
                next = i;
                for (int n = 0; n < kIterations; ++n) {
                    m1 = moment(piece, c, k + 1, next, end_v, dt);
                    pair(hold, m0, m1);
                    Vector2 f1, g1;
                    sum_terms(c, k + 1, m1, true, f1, g1);
                    double fe[4] = {}, ge[4] = {};
                    slopes(m1, fe, ge);
                    const Vector2 taken = P * Vector2{0.5 * f1.d + g1.d / dt, 0.5 * f1.q + g1.q / dt};
                    const Matrix2 d = P * Matrix2{0.5 * fe[0] + ge[0] / dt, 0.5 * fe[1] + ge[1] / dt,
                                                  0.5 * fe[2] + ge[2] / dt, 0.5 * fe[3] + ge[3] / dt};
                    jacobian = {Ld + d.dd, d.dq, d.qd, Lq + d.qq};
                    const Vector2 step = inverse(jacobian) *
                                         Vector2{x.d - taken.d - Ld * next.d, x.q - taken.q - Lq * next.q};
                    next.d += step.d, next.q += step.q;
                    if (std::abs(step.d) + std::abs(step.q) < 1e-9 * (std::abs(next.d) + std::abs(next.q) + 1e-9))
                        break;
                }
            } else {
                next = {x.d / Ld, x.q / Lq};
            }
            m1 = moment(piece, c, k + 1, next, end_v, dt);
            pair(hold, m0, m1);
            if (!std::isfinite(next.d) || !std::isfinite(next.q)) return false;

            fill(c, k, m0, false);
            fill(c, k + 1, m1, true);
            const Matrix2 J = inverse(jacobian), T = J * start, S = J * (Bs * to_start), E = J * P;
            const double inv_dt = 1.0 / dt;
            for (std::size_t j = 0; j < lanes.size(); ++j) {
                const Lane& l = lanes[j];
                const Vector2 a{l.g0.d * inv_dt - 0.5 * l.f0.d, l.g0.q * inv_dt - 0.5 * l.f0.q},
                    b{l.g1.d * inv_dt + 0.5 * l.f1.d, l.g1.q * inv_dt + 0.5 * l.f1.q};
                const double d = T.dd * s_d[j] + T.dq * s_q[j] + S.dd * a.d + S.dq * a.q - E.dd * b.d - E.dq * b.q;
                const double q = T.qd * s_d[j] + T.qq * s_q[j] + S.qd * a.d + S.qq * a.q - E.qd * b.d - E.qq * b.q;
                s_d[j] = d, s_q[j] = q;
            }
            const double e_d = log.i_d_A[k + 1] - next.d, e_q = log.i_q_A[k + 1] - next.q;
            count(k + 1, piece, e_d, e_q);
            // The first rows' noise is forgotten as a running mean forgets it.
            const double young = 1.0 / (static_cast<double>(k - piece.begin) + 2.0);
            const double k_d = std::max(g_d, young), k_q = std::max(g_q, young);
            for (std::size_t j = 0; j < lanes.size(); ++j) s_d[j] *= 1.0 - k_d, s_q[j] *= 1.0 - k_q;
            if (g_d >= young) s_d[gain_lane] += e_d;
            if (g_q >= young) s_q[gain_lane + 1] += e_q;
            i = {next.d + k_d * e_d, next.q + k_q * e_q};
        }
        flush();
        return true;
    }
};

std::vector<ReportBlock> TraceDynamic::report(const Point& at, std::size_t rows) const
{
    std::vector<ReportBlock> out;
    PlainModel plain;
    plain.pole_pairs = pole_pairs_;
    plain.rotor_held = rotor_held_;
    plain.R_ohm = at.base[kR], plain.Ld_H = at.base[kLd], plain.Lq_H = at.base[kLq], plain.psi_Wb = at.base[kPsi];
    const std::vector<Input> none;
    std::vector<BlockSum> unused;
    Run run(*this, at, none, unused, at.columns(), 0);
    for (const Log& log : logs_) {
        const std::size_t n = rows > 0 ? rows : block_rows(log);
        const TraceColumns& c = columns_[static_cast<std::size_t>(&log - logs_.data())];
        for (const Piece& piece : pieces_of(log, 2)) {
            Held held = held_from({log.v_d_V[piece.begin], log.v_q_V[piece.begin]});
            for (std::size_t k = piece.begin; k + n < piece.end; k += n) {
                ReportBlock b{&log, k, k + n, {}, {}};
                const double time_s = span_s(piece, k, n);
                for (std::size_t r = k; r < k + n; ++r) {
                    const double dt = piece.period_s(r);
                    add_period(log, plain, r, dt, b.residual[0], b.residual[1]);
                    b.measured[0] += log.v_d_V[r] * dt, b.measured[1] += log.v_q_V[r] * dt;
                    if (!at.terms.empty()) {
                        const Vector2 lost = run.lost(piece, c, r, dt, held);
                        b.residual[0] -= lost.d * dt, b.residual[1] -= lost.q * dt;
                    }
                }
                b.residual[0] = (b.residual[0] - plain.Ld_H * (log.i_d_A[k + n] - log.i_d_A[k])) / time_s;
                b.residual[1] = (b.residual[1] - plain.Lq_H * (log.i_q_A[k + n] - log.i_q_A[k])) / time_s;
                b.measured[0] /= time_s, b.measured[1] /= time_s;
                out.push_back(b);
            }
        }
    }
    return out;
}

bool TraceDynamic::pass(const Point& at, const std::vector<Input>& candidates, std::vector<BlockSum>& sums) const
{
    Eigen::Index n = at.columns();
    for (const Input& input : candidates) n += weights_of(input.law);
    sums.resize(plan_.blocks.size());
    for (BlockSum& s : sums) {
        s.rows = 0.0;
        s.gram.resize(2);
        for (auto& g : s.gram) g.setZero(n + 1, n + 1);
    }
    const double l_min = std::min(at.base[kLd], at.base[kLq]);
    double R_most = std::abs(at.base[kR]);
    for (const Term& t : at.terms)
        if (t.input.law == Law::skin_effect) R_most += std::abs(t.weights[0]) * w_max_rad_s_ * w_max_rad_s_;
    if (!at.values().allFinite() || !(l_min > 0.0) || (R_most / l_min + w_max_rad_s_) * dt_max_s_ > kLargestRateDt)
        return false;
    // A piece's blocks are its own: pieces are worked on side by side, and the sums do not depend on how.
    std::vector<std::size_t> first(plan_.pieces.size(), plan_.blocks.size());
    for (std::size_t b = plan_.blocks.size(); b-- > 0;)
        first[static_cast<std::size_t>(plan_.blocks[b].piece - plan_.pieces.data())] = b;
    std::atomic<std::size_t> next{0};
    std::atomic<bool> ok{true};
    const auto work = [&] {
        for (std::size_t p = next++; p < plan_.pieces.size(); p = next++) {
            const Piece& piece = plan_.pieces[p];
            Run run(*this, at, candidates, sums, n, first[p]);
            if (!run.run(piece, columns_[static_cast<std::size_t>(piece.log - logs_.data())])) ok = false;
        }
    };
    std::vector<std::thread> others;
    const std::size_t hands = std::min<std::size_t>(std::max(1U, std::thread::hardware_concurrency()),
                                                    plan_.pieces.size());
    for (std::size_t k = 1; k < hands; ++k) others.emplace_back(work);
    work();
    for (std::thread& t : others) t.join();
    for (BlockSum& s : sums)
        for (auto& g : s.gram) g.triangularView<Eigen::StrictlyUpper>() = g.transpose();
    return ok;
}

}  // namespace dqw
