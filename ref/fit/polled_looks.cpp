#include "ref/fit/polled_looks.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "ref/fit/polled_logs.hpp"

namespace dqw {
namespace {

constexpr double kLeastWorth = 30.0;  // rows of a look
constexpr double kWander = 0.5;       // of a parameter: how far it may move in a log, for weights that a look lacks
constexpr PolledWeight kWeights[kLooked] = {kPolledR, kPolledLd, kPolledLq, kPolledPsi};

using Vector = Eigen::Matrix<double, kLooked, 1>;
using Matrix = Eigen::Matrix<double, kLooked, kLooked>;

/// Mean square of an axis' residual, each row as it counts.
double power(const PolledSolution& s, double per_row, std::size_t from, std::size_t to)
{
    double sum = 0.0, rows = 0.0;
    for (std::size_t k = from; k <= to; ++k)
        sum += s.share[k] * (s.e_V[k][0] * s.e_V[k][0] + s.e_V[k][1] * s.e_V[k][1]), rows += per_row * s.share[k];
    return sum / std::max(rows, 1.0);
}

/// By how much sums of neighbours' residuals vary more than white ones would.
double neighbours(const PolledSolution& s)
{
    std::vector<std::array<double, 2>> e;
    for (std::size_t k = 0; k < s.share.size(); ++k)
        if (s.share[k] > 0.0) e.push_back({std::sqrt(s.share[k]) * s.e_V[k][0], std::sqrt(s.share[k]) * s.e_V[k][1]});
    const auto lags = static_cast<std::size_t>(1.5 * std::cbrt(static_cast<double>(e.size())));
    double power = 0.0, factor = 1.0;
    for (const auto& x : e) power += x[0] * x[0] + x[1] * x[1];
    for (std::size_t lag = 1; lag <= lags && lag < e.size(); ++lag) {
        double sum = 0.0;
        for (std::size_t k = lag; k < e.size(); ++k) sum += e[k][0] * e[k - lag][0] + e[k][1] * e[k - lag][1];
        factor += 2.0 * (1.0 - static_cast<double>(lag) / static_cast<double>(lags + 1)) * sum / power;
    }
    return power > 0.0 ? std::max(1.0, factor) : 1.0;
}

/// Sums over a look's rows.
struct Sums {
    Matrix gram = Matrix::Zero();
    Vector moment = Vector::Zero();
    double rows = 0.0, i_A2 = 0.0, v_V2 = 0.0;
    std::size_t first = 0, last = 0;
};

class Looks {
public:
    Looks(const Log& log, const PolledLogs& p) : log_(log), p_(p) {}

    std::vector<Sums> gather(double least_s) const
    {
        std::vector<Sums> out;
        Sums now;
        for (std::size_t k = 0; k < p_.rows.size(); ++k) {
            if (!(p_.solution.share[k] > 0.0)) continue;
            if (now.rows == 0.0) now.first = k;
            add(k, now);
            if (now.rows >= kLeastWorth && time(k) - time(now.first) >= least_s) out.push_back(now), now = {};
        }
        if (now.rows > 0.0 && !out.empty()) {
            Sums& last = out.back();
            last.gram += now.gram, last.moment += now.moment, last.rows += now.rows, last.i_A2 += now.i_A2,
                last.v_V2 += now.v_V2, last.last = now.last;
        }
        return out;
    }

    /// Mean square of what a look leaves with its own change.
    double left(const Sums& s, const Vector& change) const
    {
        PolledSolution now = p_.solution;
        for (std::size_t k = s.first; k <= s.last; ++k) {
            const PolledEquations e = polled_equations(p_.rows[k], p_.form.one_L, p_.solution.x[kPolledTau],
                                                       p_.solution.x);
            for (int a = 0; a < 2; ++a)
                for (std::size_t j = 0; j < kLooked; ++j)
                    now.e_V[k][static_cast<std::size_t>(a)] -= e.x[static_cast<std::size_t>(a)][kWeights[j]] *
                                                               change[static_cast<Eigen::Index>(j)];
        }
        return power(now, equations_a_row(p_.rows), s.first, s.last);
    }

    double time(std::size_t k) const { return log_.t_s[p_.rows[k].row]; }

private:
    void add(std::size_t k, Sums& s) const
    {
        const PolledEquations e = polled_equations(p_.rows[k], p_.form.one_L, p_.solution.x[kPolledTau], p_.solution.x);
        for (int a = 0; a < 2; ++a) {
            Vector x;
            for (std::size_t j = 0; j < kLooked; ++j)
                x[static_cast<Eigen::Index>(j)] = e.x[static_cast<std::size_t>(a)][kWeights[j]];
            s.gram += p_.solution.share[k] * x * x.transpose();
            s.moment += p_.solution.share[k] * p_.solution.e_V[k][static_cast<std::size_t>(a)] * x;
        }
        const PolledRow& r = p_.rows[k];
        s.i_A2 += p_.solution.share[k] * r.i_abs_A * r.i_abs_A;
        s.v_V2 += p_.solution.share[k] * (r.v_V[0] * r.v_V[0] + r.v_V[1] * r.v_V[1]);
        s.rows += p_.solution.share[k], s.last = k;
    }

    const Log& log_;
    const PolledLogs& p_;
};

/// Where a weight of the look is not told it stays near the head's: a prior as wide as it may wander.
Vector changes(const Sums& s, const Vector& wander, double white_V2, Matrix& inverse)
{
    // A weight that is not free has no room: its row is the prior's alone.
    Matrix a = s.gram;
    for (Eigen::Index j = 0; j < a.rows(); ++j) {
        if (wander[j] > 0.0) {
            a(j, j) += white_V2 / (wander[j] * wander[j]);
            continue;
        }
        a.row(j).setZero(), a.col(j).setZero(), a(j, j) = 1.0;
    }
    Vector moment = s.moment;
    for (Eigen::Index j = 0; j < a.rows(); ++j)
        if (!(wander[j] > 0.0)) moment[j] = 0.0;
    const Vector d = a.diagonal().cwiseSqrt().cwiseInverse();
    inverse = d.asDiagonal() * Matrix(d.asDiagonal() * a * d.asDiagonal()).inverse() * d.asDiagonal();
    return inverse * moment;
}

Log head_of(const Log& log, double head_s)
{
    Log head = log;
    const auto rows = std::upper_bound(log.t_s.begin(), log.t_s.end(), log.t_s.front() + head_s) - log.t_s.begin();
    for (const auto column : {&Log::t_s, &Log::v_d_V, &Log::v_q_V, &Log::i_d_A, &Log::i_q_A, &Log::w_m_rad_s,
                              &Log::v_dc_V, &Log::temp_winding_C, &Log::temp_magnet_C})
        if (!(head.*column).empty()) (head.*column).resize(static_cast<std::size_t>(rows));
    return head;
}

}  // namespace

PolledLooks polled_looks(const Log& log, double least_s, double head_s)
{
    const double pole_pairs = log.machine.pole_pairs.value_or(1.0);
    const PolledLogs first = solve_logs({head_of(log, head_s)}, pole_pairs), p = under(first, log, pole_pairs);
    if (!p.solution.ok)
        throw std::invalid_argument(log.path + ": the settled rows are all of one kind: nothing comes apart");
    const Looks looks(log, p);
    PolledLooks out;
    out.holds_dead_time = !p.form.V || !tells(p.solution, kPolledR);
    out.follows = p.solution.follows > kFollows;
    Vector wander = Vector::Zero();
    for (std::size_t j = 0; j < kLooked; ++j) {
        const bool free = kWeights[j] == kPolledLd ? !p.form.one_L : kWeights[j] != kPolledPsi || p.form.psi;
        const bool in_speed = kWeights[j] == kPolledR || kWeights[j] == kPolledPsi;
        out.known[j] = free && tells(p.solution, kWeights[j]) && !(out.follows && in_speed);
        out.head[j] = p.solution.x[kWeights[j]], out.head_sd[j] = p.solution.sd[kWeights[j]];
        if (free) wander[static_cast<Eigen::Index>(j)] = kWander * std::abs(out.head[j]);
    }
    // The head's residual says what lasts and what neighbours share; a look whose own is larger is as much less sure.
    const double white = power(first.solution, equations_a_row(p.rows), 0, first.rows.size() - 1),
                 lasting = lasting_V2(first.solution, equations_a_row(first.rows)),
                 own = white * neighbours(first.solution);
    out.head_V = std::sqrt(white);
    for (const Sums& s : looks.gather(least_s)) {
        Matrix inverse;
        const Vector change = changes(s, wander, white, inverse);
        const double left = looks.left(s, change) / white, worse = std::max(1.0, left);
        PolledLook look;
        look.from_s = looks.time(s.first), look.to_s = looks.time(s.last), look.rows = s.rows;
        look.i_A = std::sqrt(s.i_A2 / s.rows), look.v_V = std::sqrt(s.v_V2 / s.rows), look.worse = left;
        for (std::size_t j = 0; j < kLooked; ++j) {
            const auto i = static_cast<Eigen::Index>(j);
            look.change[j] = change[i];
            look.sd[j] = std::sqrt(worse * own * inverse(i, i));
            look.lasting[j] = std::sqrt(worse * lasting * look.rows * inverse(i, i));
        }
        out.looks.push_back(look);
    }
    return out;
}

}  // namespace dqw
