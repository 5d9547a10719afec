#include "ref/fit/polled_solve.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "ref/log/median.hpp"

namespace dqw {
namespace {

using Filled = PolledFilled;
using Square = Eigen::Matrix<double, kPolledFilled, kPolledFilled>;
// Of the free weights; their number has a bound, so that they need no heap.
using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kPolledWeights, kPolledWeights>;
using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kPolledWeights, 1>;

constexpr int kTurns = 4, kDirections = 6;  // until the frame, or where the voltage points, stays
constexpr int kRounds = 4;                  // of weights that depend on what is found
constexpr double kQuietest = 0.35;          // of the rows
constexpr double kMoving = 4.0;             // times the quiet rows' residual: left out
constexpr std::size_t kParts = 8;           // stretches that are held out in turn

std::vector<int> free_of(const PolledForm& f)
{
    std::vector<int> out;
    const bool free[] = {f.R, f.Ld && !f.one_L, f.Lq, f.psi, f.V, f.tau, f.late};
    for (int j = 0; j < kPolledWeights; ++j)
        if (free[j]) out.push_back(j);
    return out;
}

struct Sums {
    Matrix gram;
    Vector moment;
};

class Problem {
public:
    Problem(const std::vector<PolledRow>& rows, const PolledForm& form) : rows_(rows), form_(form), free_(free_of(form))
    {
        built_.reserve(rows.size());
    }

    const std::vector<int>& free() const { return free_; }

    /// Weighted least squares over rows of share above 0; the frame is turned until its weight is nothing.
    bool solve(const std::vector<double>& share, PolledVector& x)
    {
        double turn_s = 0.0;
        const int turns = form_.tau ? kTurns : of_size() ? kDirections : 1;
        own_.setZero();
        for (int round = 0; round < turns; ++round) {
            build(turn_s);
            const Sums s = sums(share);
            const Vector d = s.gram.diagonal().cwiseSqrt().cwiseMax(1e-300);
            const Matrix scaled = d.cwiseInverse().asDiagonal() * s.gram * d.cwiseInverse().asDiagonal();
            Eigen::LDLT<Matrix> factors(scaled);
            if (factors.info() != Eigen::Success || !(factors.vectorD().minCoeff() > 1e-9)) return false;
            const Vector found = factors.solve(s.moment.cwiseQuotient(d)).cwiseQuotient(d);
            if (!found.allFinite()) return false;
            inverse_ = d.cwiseInverse().asDiagonal() * factors.solve(Matrix::Identity(d.size(), d.size())) *
                       d.cwiseInverse().asDiagonal();
            x.setZero();
            for (std::size_t j = 0; j < free_.size(); ++j) x[free_[j]] = found[static_cast<Eigen::Index>(j)];
            if (form_.tau) turn_s += x[kPolledTau];
            own_ = x;
        }
        if (form_.tau) x[kPolledTau] = turn_s;
        if (form_.one_L) x[kPolledLd] = x[kPolledLq];
        return true;
    }

    /// Of the rows as the last solve() left them.
    std::array<double, 2> residual(std::size_t k) const
    {
        std::array<double, 2> e;
        for (std::size_t a = 0; a < 2; ++a)
            e[a] = built_[k].y[static_cast<Eigen::Index>(a)] - built_[k].x[a].head<kPolledWeights>().dot(own_);
        return e;
    }

    /// Of the last solve(): one axis' equation, all weights.
    const Filled& row(std::size_t k, std::size_t axis) const { return built_[k].x[axis]; }

    /// Of the free weights.
    Matrix freed(const Square& all) const
    {
        const auto n = static_cast<Eigen::Index>(free_.size());
        Matrix out(n, n);
        for (Eigen::Index j = 0; j < n; ++j)
            for (Eigen::Index k = 0; k < n; ++k)
                out(j, k) = all(free_[static_cast<std::size_t>(j)], free_[static_cast<std::size_t>(k)]);
        return out;
    }

    const Matrix& inverse() const { return inverse_; }

private:
    bool of_size() const { return !rows_.empty() && rows_.front().voltage == PolledVoltage::size; }

    void build(double turn_s)
    {
        if (!built_.empty() && turn_s == built_turn_s_ && !of_size()) return;
        built_turn_s_ = turn_s;
        built_.clear();
        for (const PolledRow& r : rows_) built_.push_back(polled_equations(r, form_.one_L, turn_s, own_));
    }

    Sums sums(const std::vector<double>& share) const
    {
        Square gram = Square::Zero();
        Filled moment = Filled::Zero();
        for (std::size_t k = 0; k < rows_.size(); ++k)
            for (std::size_t a = 0; share[k] > 0.0 && a < 2; ++a) {
                const Filled& x = row(k, a);
                const Filled shared = share[k] * x;
                gram.noalias() += shared * x.transpose();
                moment += share[k] * built_[k].y[static_cast<Eigen::Index>(a)] * x;
            }
        Vector of_free(static_cast<Eigen::Index>(free_.size()));
        for (std::size_t j = 0; j < free_.size(); ++j) of_free[static_cast<Eigen::Index>(j)] = moment[free_[j]];
        return {freed(gram), of_free};
    }

    const std::vector<PolledRow>& rows_;
    PolledForm form_;
    std::vector<int> free_;
    std::vector<PolledEquations, Eigen::aligned_allocator<PolledEquations>> built_;
    double built_turn_s_ = 0.0;
    PolledVector own_ = PolledVector::Zero();
    Matrix inverse_;
};

/// (E151): volts that the row's own averages cannot see.
double unseen_V(const PolledRow& r, const PolledVector& x)
{
    const double L = std::max(std::abs(x[kPolledLd]), std::abs(x[kPolledLq]));
    return std::hypot((std::abs(x[kPolledPsi]) + L * r.i_abs_A) * r.dw_unseen_rad_s,
                      std::hypot(L * r.di_unseen_A_s, L * r.wi_unseen_A_rad_s));
}

/// (E151): what rows count whose unseen volts are these.
void share(const std::vector<double>& h, PolledSolution& s)
{
    const double own = s.quiet_V * s.quiet_V;
    s.share.clear();
    for (const double x : h) {
        const double still = own > 0.0 ? own / (own + x * x) : x > 0.0 ? 0.0 : 1.0;
        s.share.push_back(x > kMoving * s.quiet_V ? 0.0 : still);
    }
}

void weigh(const std::vector<PolledRow>& rows, const Problem& p, PolledSolution& s)
{
    std::vector<double> h, sorted;
    for (const PolledRow& r : rows) h.push_back(unseen_V(r, s.x));
    sorted = h;
    const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(kQuietest * static_cast<double>(sorted.size()));
    std::nth_element(sorted.begin(), at, sorted.end());
    std::vector<double> squares;
    for (std::size_t k = 0; k < rows.size(); ++k)
        if (h[k] <= *at) {
            const auto e = p.residual(k);
            squares.push_back(e[0] * e[0] + e[1] * e[1]);
        }
    // The median of a chi-square of two is 2 ln 2, of one 0.455.
    s.quiet_V = std::sqrt(median(squares) / (equations_a_row(rows) > 1.0 ? 2.0 * std::log(2.0) : 0.455));
    share(h, s);
}

/// (E152).
void judge(const std::vector<PolledRow>& rows, const Problem& p, double noise_rad_s, PolledSolution& s)
{
    const auto n = static_cast<Eigen::Index>(p.free().size());
    std::vector<std::size_t> used;
    double power = 0.0, shares = 0.0;
    for (std::size_t k = 0; k < rows.size(); ++k)
        if (s.share[k] > 0.0) {
            used.push_back(k), shares += s.share[k];
            power += s.share[k] * (s.e_V[k][0] * s.e_V[k][0] + s.e_V[k][1] * s.e_V[k][1]);
        }
    const double count = static_cast<double>(used.size());
    const Matrix white = power / std::max(equations_a_row(rows) * shares - static_cast<double>(n), 1.0) * p.inverse();
    // White errors of unlike size, and what neighbours share.
    std::vector<Filled, Eigen::aligned_allocator<Filled>> scores;
    scores.reserve(used.size());
    for (std::size_t k : used) {
        Filled score = Filled::Zero();
        for (std::size_t a = 0; a < 2; ++a) score += s.share[k] * s.e_V[k][a] * p.row(k, a);
        scores.push_back(score);
    }
    const auto lags = static_cast<std::size_t>(1.5 * std::cbrt(count));
    Square middle = Square::Zero();
    for (std::size_t lag = 0; lag <= lags && lag < used.size(); ++lag) {
        Square product = Square::Zero();
        for (std::size_t k = lag; k < used.size(); ++k) product.noalias() += scores[k] * scores[k - lag].transpose();
        const double bartlett = 1.0 - static_cast<double>(lag) / static_cast<double>(lags + 1);
        middle += bartlett * (lag == 0 ? product : Square(product + product.transpose()));
    }
    const Matrix robust = p.inverse() * p.freed(middle) * p.inverse();
    const double lasting = lasting_V2(s, equations_a_row(rows));
    // (E153)
    Eigen::Index psi = -1;
    for (std::size_t j = 0; j < p.free().size(); ++j)
        if (p.free()[j] == kPolledPsi) psi = static_cast<Eigen::Index>(j);
    const double mean_noise2 = 0.59 * noise_rad_s * noise_rad_s;
    s.follows = psi >= 0 ? mean_noise2 * shares * p.inverse()(psi, psi) : 0.0;
    for (std::size_t j = 0; j < p.free().size(); ++j) {
        const auto i = static_cast<Eigen::Index>(j);
        const double bias = psi >= 0 ? 0.5 * s.follows * s.x[kPolledPsi] * p.inverse()(i, psi) / p.inverse()(psi, psi)
                                     : 0.0;
        s.sd[p.free()[j]] = std::sqrt(std::max({white(i, i), robust(i, i), 0.0}) +
                                      lasting * shares * p.inverse()(i, i) + bias * bias);
    }
}

}  // namespace

double equations_a_row(const std::vector<PolledRow>& rows)
{
    return rows.empty() || rows.front().voltage == PolledVoltage::both ? 2.0 : 1.0;
}

PolledEquations polled_equations(const PolledRow& r, bool one_L, double turn_s, const PolledVector& at)
{
    const double c = turn_s == 0.0 ? 1.0 : std::cos(turn_s * r.w_rad_s),
                 s = turn_s == 0.0 ? 0.0 : std::sin(turn_s * r.w_rad_s);
    PolledEquations e;
    e.y = {c * r.v_V[0] + s * r.v_V[1], c * r.v_V[1] - s * r.v_V[0]};
    const double size = std::max(r.i_abs_A, 1e-12);
    e.x[0] << r.i_A[0], r.di_A_s[0], -r.wi_A_rad_s[1], 0.0, r.i_A[0] / size, -r.w_rad_s * e.y[1], 0.0, 0.0;
    e.x[1] << r.i_A[1], r.wi_A_rad_s[0], r.di_A_s[1], r.w_rad_s, r.i_A[1] / size, r.w_rad_s * e.y[0], r.dw_rad_s2, 0.0;
    for (PolledFilled& x : e.x)
        if (one_L) x[kPolledLq] += x[kPolledLd], x[kPolledLd] = 0.0;
    if (r.voltage == PolledVoltage::both) return e;
    Eigen::Vector2d along(0.0, 1.0);
    if (r.voltage == PolledVoltage::size) {
        along = {e.x[0].head<kPolledWeights>().dot(at), e.x[1].head<kPolledWeights>().dot(at)};
        // Before anything is known the speed says where the voltage points.
        if (!(along.norm() > 0.0)) along = {0.0, r.w_rad_s < 0.0 ? -1.0 : 1.0};
        along.normalize();
        e.y[1] = e.y.norm();
    }
    e.x[1] = (along[0] * e.x[0] + along[1] * e.x[1]).eval();
    e.x[0].setZero(), e.y[0] = 0.0;
    return e;
}

/// (E152): what lasts, from products of residuals that share no instant of the speed.
double lasting_V2(const PolledSolution& s, double per_row)
{
    std::vector<std::size_t> used;
    double power = 0.0, shares = 0.0;
    for (std::size_t k = 0; k < s.share.size(); ++k)
        if (s.share[k] > 0.0) {
            used.push_back(k), shares += s.share[k];
            power += s.share[k] * (s.e_V[k][0] * s.e_V[k][0] + s.e_V[k][1] * s.e_V[k][1]);
        }
    double lasting = 0.0, chance = 0.0;
    for (std::size_t lag = 4; lag <= 7; ++lag) {
        double sum = 0.0, products = 0.0;
        for (std::size_t k = lag; k < used.size(); ++k) {
            const std::size_t i = used[k], j = used[k - lag];
            const double share = std::sqrt(s.share[i] * s.share[j]);
            sum += share * (s.e_V[i][0] * s.e_V[j][0] + s.e_V[i][1] * s.e_V[j][1]);
            products += share;
        }
        if (!(products > 0.0)) continue;
        lasting = std::max(lasting, std::abs(sum) / products);
        // The largest of four by chance is 1.5 deviations.
        chance = 1.5 * power / shares / std::sqrt(per_row * products);
    }
    return std::max(0.0, lasting - chance);
}

PolledSolution solve_polled(const std::vector<PolledRow>& rows, const PolledForm& form, double noise_rad_s,
                            PolledDeviations deviations)
{
    PolledSolution s;
    s.share.assign(rows.size(), 1.0);
    s.e_V.assign(rows.size(), {});
    Problem p(rows, form);
    if (rows.size() < p.free().size()) return s;
    for (int round = 0; round <= kRounds; ++round) {
        if (!p.solve(s.share, s.x)) return s;
        if (round < kRounds) weigh(rows, p, s);
    }
    for (std::size_t k = 0; k < rows.size(); ++k) s.e_V[k] = p.residual(k);
    if (deviations == PolledDeviations::found) judge(rows, p, noise_rad_s, s);
    if (form.one_L) s.sd[kPolledLd] = 0.0;
    s.ok = s.x.allFinite() && s.sd.allFinite();
    return s;
}

PolledSolution under(const PolledSolution& of, const std::vector<PolledRow>& rows, const PolledForm& form)
{
    PolledSolution s = of;
    std::vector<double> h;
    s.e_V.clear();
    for (const PolledRow& r : rows) {
        h.push_back(unseen_V(r, of.x));
        const PolledEquations e = polled_equations(r, form.one_L, of.x[kPolledTau], of.x);
        PolledVector x = of.x;
        x[kPolledTau] = 0.0;
        s.e_V.push_back({e.y[0] - e.x[0].head<kPolledWeights>().dot(x), e.y[1] - e.x[1].head<kPolledWeights>().dot(x)});
    }
    share(h, s);
    return s;
}

std::vector<double> held_out_polled(const std::vector<PolledRow>& rows, const PolledSolution& weighed,
                                    const PolledForm& form)
{
    std::vector<double> out;
    const std::size_t n = rows.size();
    for (std::size_t part = 0; part < kParts; ++part) {
        std::vector<double> share = weighed.share;
        const std::size_t begin = part * n / kParts, end = (part + 1) * n / kParts;
        std::fill(share.begin() + static_cast<std::ptrdiff_t>(begin), share.begin() + static_cast<std::ptrdiff_t>(end),
                  0.0);
        Problem p(rows, form);
        PolledVector x;
        if (!p.solve(share, x)) return {};
        double sum = 0.0;
        for (std::size_t k = begin; k < end; ++k) {
            const auto e = p.residual(k);
            sum += weighed.share[k] * (e[0] * e[0] + e[1] * e[1]);
        }
        out.push_back(sum);
    }
    return out;
}

}  // namespace dqw
