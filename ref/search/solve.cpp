#include "ref/search/solve.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "ref/log/symmetric.hpp"

namespace dqw {
namespace {

/// Keeps logarithms and quotients of zero finite; any double above the least will do.
constexpr double kLeast = 1e-300;
/// Sums of 10^6 squares carry rounding of 10^6 epsilon = 2e-10 of themselves: an eigenvalue of unit columns below is
/// none.
constexpr double kLeastEigenvalue = 1e-9;
/// Over the larger variance: a column that is exact on one axis weighs 10^6 there, still far from what rounding hides.
constexpr double kLeastVariance = 1e-6;

void total_up(const Model& model, Left& left)
{
    const auto& blocks = model.plan().blocks;
    double rows[2] = {}, square[2][8] = {};
    for (std::size_t b = 0; b < blocks.size(); ++b) {
        const int h = blocks[b].heldout ? 1 : 0;
        rows[h] += left.rows[b];
        for (std::size_t c = 0; c < left.of.size(); ++c) square[h][c] += left.of[c][b];
    }
    double* ll[2] = {&left.seen, &left.heldout};
    for (int h = 0; h < 2; ++h) {
        *ll[h] = 0.0;
        if (!(rows[h] > 0.0)) continue;
        const double channels = static_cast<double>(left.of.size());
        if (model.common_weight()) {
            double all = 0.0;
            for (std::size_t c = 0; c < left.of.size(); ++c) all += square[h][c];
            *ll[h] = -0.5 * channels * rows[h] * std::log(all / (channels * rows[h]) + kLeast);
        } else {
            for (std::size_t c = 0; c < left.of.size(); ++c)
                *ll[h] -= 0.5 * rows[h] * std::log(square[h][c] / rows[h] + kLeast);
        }
    }
}

std::vector<Eigen::MatrixXd> total_of_seen(const Model& model, const std::vector<BlockSum>& sums, double& rows)
{
    const auto& blocks = model.plan().blocks;
    std::vector<Eigen::MatrixXd> total;
    rows = 0.0;
    for (std::size_t b = 0; b < blocks.size(); ++b) {
        if (blocks[b].heldout) continue;
        rows += sums[b].rows;
        for (std::size_t c = 0; c < sums[b].gram.size(); ++c) {
            if (total.size() <= c)
                total.push_back(Eigen::MatrixXd::Zero(sums[b].gram[c].rows(), sums[b].gram[c].cols()));
            total[c] += sums[b].gram[c];
        }
    }
    return total;
}

/// Entries of a row that are not zero: of many columns a step moves few.
std::vector<Eigen::Index> entries_of(const Eigen::VectorXd& row)
{
    std::vector<Eigen::Index> at;
    for (Eigen::Index j = 0; j < row.size(); ++j)
        if (row[j] != 0.0) at.push_back(j);
    return at;
}

double quadratic(const Eigen::MatrixXd& gram, const Eigen::VectorXd& row, const std::vector<Eigen::Index>& at)
{
    double sum = 0.0;
    for (const Eigen::Index j : at) {
        double of_column = 0.0;
        for (const Eigen::Index i : at) of_column += gram(i, j) * row[i];
        sum += of_column * row[j];
    }
    return std::max(sum, 0.0);
}

/// Variance of each channel of the rows seen, after the step.
Eigen::VectorXd variances(const Model& model, const std::vector<Eigen::MatrixXd>& total, double rows,
                          const Eigen::VectorXd& with_e)
{
    const std::vector<Eigen::Index> at = entries_of(with_e);
    Eigen::VectorXd v(static_cast<Eigen::Index>(total.size()));
    for (std::size_t c = 0; c < total.size(); ++c)
        v[static_cast<Eigen::Index>(c)] = quadratic(total[c], with_e, at) / std::max(rows, 1.0) + kLeast;
    if (model.common_weight()) {
        // An axis without current or voltage says nothing about the noise.
        double sum = 0.0, told = 0.0;
        for (std::size_t c = 0; c < total.size(); ++c)
            if (total[c].diagonal().maxCoeff() > 0.0) sum += v[static_cast<Eigen::Index>(c)], told += 1.0;
        v.setConstant(told > 0.0 ? sum / told : v.mean());
    }
    return v.cwiseMax(v.maxCoeff() * kLeastVariance);
}

Eigen::VectorXd with_error(const Eigen::VectorXd& delta)
{
    Eigen::VectorXd row(delta.size() + 1);
    row << delta, 1.0;
    return row;
}

}  // namespace

Left left_after(const Model& model, const std::vector<BlockSum>& sums, const Eigen::VectorXd& delta)
{
    Left left;
    const Eigen::VectorXd row = with_error(delta);
    const std::vector<Eigen::Index> at = entries_of(row);
    left.of.resize(static_cast<std::size_t>(model.channels()));
    for (const BlockSum& s : sums) {
        left.rows.push_back(s.rows);
        for (std::size_t c = 0; c < left.of.size(); ++c) left.of[c].push_back(quadratic(s.gram[c], row, at));
    }
    total_up(model, left);
    return left;
}

Left left_of(const Model& model, const std::vector<BlockSum>& sums)
{
    return left_after(model, sums, Eigen::VectorXd::Zero(sums.front().gram.front().rows() - 1));
}

Prior prior_of(const Point& at, const std::vector<Input>& candidates)
{
    const Eigen::Index n = columns_of(at, &candidates);
    Prior prior{Eigen::VectorXd::Zero(n), Eigen::VectorXd::Zero(n)};
    prior.value.head(at.columns()) = at.values();
    Eigen::Index j = at.base.size() + at.gain.size();
    const auto put = [&](const Input& input, int shapes) {
        if (is_map(input.law)) prior.stiffness.segment(j, weights_of(input.law)).setConstant(input.shape[3]);
        j += weights_of(input.law) + shapes;
    };
    for (const Term& t : at.terms) put(t.input, free_shapes_of(t.input));
    for (const Input& input : candidates) put(input, 0);
    return prior;
}

Seen seen_of(const Model& model, const std::vector<BlockSum>& sums)
{
    Seen seen;
    seen.total = total_of_seen(model, sums, seen.rows);
    return seen;
}

Eigen::VectorXd linear_step(const Model& model, const Seen& seen, const std::vector<Eigen::Index>& use, double damping,
                            const Prior& prior)
{
    const std::vector<Eigen::MatrixXd>& total = seen.total;
    const double rows = seen.rows;
    const Eigen::Index n = total.front().rows() - 1, m = static_cast<Eigen::Index>(use.size());
    Eigen::VectorXd delta = Eigen::VectorXd::Zero(n);
    // Weights and step in turn; where these do not settle them, the next pass goes on.
    constexpr int kRounds = 3;
    for (int round = 0; round < kRounds; ++round) {
        const Eigen::VectorXd v = variances(model, total, rows, with_error(delta));
        Eigen::MatrixXd a = Eigen::MatrixXd::Zero(m, m);
        Eigen::VectorXd b = Eigen::VectorXd::Zero(m);
        for (std::size_t c = 0; c < total.size(); ++c) {
            const double w = 1.0 / v[static_cast<Eigen::Index>(c)];
            for (Eigen::Index i = 0; i < m; ++i) {
                b[i] -= w * total[c](use[static_cast<std::size_t>(i)], n);
                for (Eigen::Index j = 0; j < m; ++j)
                    a(i, j) += w * total[c](use[static_cast<std::size_t>(i)], use[static_cast<std::size_t>(j)]);
            }
        }
        for (Eigen::Index i = 0; i < m; ++i) {
            const Eigen::Index j = use[static_cast<std::size_t>(i)];
            a(i, i) += prior.stiffness[j], b[i] -= prior.stiffness[j] * prior.value[j];
        }
        const Eigen::VectorXd size = a.diagonal().cwiseMax(kLeast).cwiseSqrt();
        Eigen::MatrixXd unit = size.cwiseInverse().asDiagonal() * a * size.cwiseInverse().asDiagonal();
        for (Eigen::Index i = 0; i < m; ++i)
            if (!(a(i, i) > kLeast)) unit.row(i).setZero(), unit.col(i).setZero();
        const Symmetric eigen(unit);
        Eigen::VectorXd z = eigen.eigenvectors().transpose() * b.cwiseQuotient(size);
        for (Eigen::Index i = 0; i < m; ++i)
            z[i] = eigen.eigenvalues()[i] > kLeastEigenvalue ? z[i] / (eigen.eigenvalues()[i] + damping) : 0.0;
        const Eigen::VectorXd step = (eigen.eigenvectors() * z).cwiseQuotient(size);
        delta.setZero();
        // What an eigenvector's rounding leaves where there is no column would be divided by next to nothing.
        for (Eigen::Index i = 0; i < m; ++i)
            if (a(i, i) > kLeast) delta[use[static_cast<std::size_t>(i)]] = step[i];
    }
    return delta;
}

Better beside_law_noise(Better over, double nats)
{
    const double raw = over.nats;
    over.nats += nats;
    if (raw != 0.0) over.t *= over.nats / raw, over.nats_each *= over.nats / raw;
    return over;
}

Better better(const Model& model, const Left& a, const Left& b)
{
    const auto& blocks = model.plan().blocks;
    std::vector<double> gain;
    const double floor = kLeast;
    // Settled points' errors are no noise of one size: a block whose error is far below the mean does not count there.
    double mean_square = 0.0, rows = 0.0;
    for (std::size_t k = 0; k < blocks.size(); ++k)
        if (blocks[k].heldout) {
            rows += a.rows[k];
            for (const auto& channel : b.of) mean_square += channel[k];
        }
    mean_square = mean_square / std::max(rows * static_cast<double>(b.of.size()), 1.0) + kLeast;
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        if (!blocks[k].heldout || !(a.rows[k] > 0.0)) continue;
        double g = 0.0;
        if (model.common_weight()) {
            double x = 0.0, y = 0.0;
            for (std::size_t c = 0; c < a.of.size(); ++c) x += a.of[c][k], y += b.of[c][k];
            const double size = a.rows[k] * static_cast<double>(a.of.size()) * mean_square;
            g = 0.5 * std::log((x + size) / (y + size));
        } else {
            for (std::size_t c = 0; c < a.of.size(); ++c)
                g += 0.5 * std::log((a.of[c][k] + floor) / (b.of[c][k] + floor));
        }
        gain.push_back(g);
    }
    Better out;
    out.nats = b.heldout - a.heldout;
    const double n = static_cast<double>(gain.size());
    out.nats_each = out.nats * n / std::max(rows, 1.0);
    // Of two blocks a deviation has one degree of freedom, and tells nothing.
    constexpr std::size_t kLeastBlocks = 3;
    if (gain.size() < kLeastBlocks) return out;
    double mean = 0.0, square = 0.0, lag = 0.0;
    for (double g : gain) mean += g / n;
    for (std::size_t k = 0; k < gain.size(); ++k) {
        square += (gain[k] - mean) * (gain[k] - mean);
        if (k > 0) lag += (gain[k] - mean) * (gain[k - 1] - mean);
    }
    // A hundred blocks then still count as 2.6: however alike, they are of several stretches.
    constexpr double kMostLag = 0.95;
    const double r = std::clamp(lag / std::max(square, kLeast), 0.0, kMostLag);
    const double sd = std::sqrt(square / (n - 1.0) / n);
    out.t = sd > 0.0 ? mean / sd * std::sqrt((1.0 - r) / (1.0 + r)) : 0.0;
    return out;
}

bool confirmed(const Model& model, const Better& gain)
{
    // A normal exceeds 4 in 3 of 100000 cases: in one log of a hundred that makes a few hundred tries.
    constexpr double kLeastT = 4.0;
    // With any one of these halved or doubled, the 3000-rpm grid, the four inverter sweeps, heating (with 0, 1 and 20 %
    // noise), standstill (0 and 1 %) and joint_24v (0) still get the same verdict, effects and look-alikes.
    constexpr double kUnevenT = 2.0, kFewT = 1.5, kUneven = 15.0, kFew = 40.0;
    if (gain.nats < kLeastNats) return false;
    const double uneven = gain.t * gain.nats_each;
    return gain.t >= kLeastT || (gain.t >= kUnevenT && uneven >= kUneven) ||
           (gain.t >= kFewT && uneven >= (model.common_weight() ? kUneven : kFew));
}

namespace {

/// What a point loses of its log-likelihood for not being what was likely before.
double unlikely(const Point& at)
{
    const Prior prior = prior_of(at, {});
    return 0.5 * prior.stiffness.dot(prior.value.cwiseAbs2());
}

/// Values that a pass' step does not leave.
struct Limits {
    Eigen::VectorXd low, high;
};

/// Where the linear step still says something. Predictions hold 1/L: from an L that is too small its linear step at
/// most doubles L, from one twice too large it ends at zero. psi may start at zero and R at a wrong sign; they are
/// linear. A gain goes to the next of kScreenGains, an angle to the next that is tried; a width's neighbour is two
/// passes away. As (E48) has it.
Limits limits_of(const Point& at)
{
    constexpr double kLess = 0.6, kMore = 1.2, kGainTimes = 5.0, kWidthTimes = 2.0, kAngle_rad = 0.3;
    // It forgets over 10^4 rows, more than three windows of the search: below, there is no correction.
    constexpr double kGainLeast = 1e-4;
    const Eigen::VectorXd old = at.values();
    Limits to{Eigen::VectorXd::Constant(old.size(), -HUGE_VAL), Eigen::VectorXd::Constant(old.size(), HUGE_VAL)};
    const Eigen::Index first_gain = at.base.size(), first_weight = first_gain + at.gain.size();
    for (Eigen::Index j = 1; j < std::min<Eigen::Index>(3, first_gain); ++j)
        to.low[j] = old[j] - kLess * std::abs(old[j]), to.high[j] = old[j] + kMore * std::abs(old[j]);
    for (Eigen::Index j = first_gain; j < first_weight; ++j)
        to.low[j] = std::max(kGainLeast, old[j] / kGainTimes), to.high[j] = std::min(1.0, old[j] * kGainTimes);
    Eigen::Index j = first_weight;
    for (const Term& t : at.terms) {
        j += weights_of(t.input.law);
        for (int s = 0; s < free_shapes_of(t.input); ++s, ++j)
            if (is_angle(t.input, free_shape_of(t.input, s)))
                to.low[j] = old[j] - kAngle_rad, to.high[j] = old[j] + kAngle_rad;
            else
                to.low[j] = old[j] / kWidthTimes, to.high[j] = old[j] * kWidthTimes;
    }
    return to;
}

/// Sums of e and its derivatives, after a step in which e is linear.
void step(Eigen::MatrixXd& gram, const Eigen::VectorXd& row)
{
    const Eigen::VectorXd by = gram * row;
    const Eigen::Index e = row.size() - 1;
    gram.col(e) = by, gram.row(e) = by.transpose(), gram(e, e) = row.dot(by);
}

/// Where the linear step ends. It goes on to the first limit, which stays, and from there with the others: each part of
/// it ascends, which a step that is cut off need not.
Eigen::VectorXd step_within(const Model& model, const Refined& from, double damping)
{
    const Seen seen = seen_of(model, from.sums);
    const Limits limits = limits_of(from.point);
    Prior prior = prior_of(from.point, {});
    const Eigen::VectorXd old = from.point.values();
    Eigen::VectorXd to = old.cwiseMax(limits.low).cwiseMin(limits.high);
    std::vector<Eigen::Index> use;
    for (Eigen::Index j = 0; j < old.size(); ++j) use.push_back(j);
    while (!use.empty()) {
        Seen there = seen;
        for (Eigen::MatrixXd& gram : there.total) step(gram, with_error(to - old));
        prior.value = to;
        const Eigen::VectorXd delta = linear_step(model, there, use, damping, prior);
        double part = 1.0;
        auto first = use.end();
        for (auto at = use.begin(); at != use.end(); ++at) {
            const Eigen::Index j = *at;
            const double room = (delta[j] > 0.0 ? limits.high[j] : limits.low[j]) - to[j];
            if (std::abs(delta[j]) * part > std::abs(room)) part = room / delta[j], first = at;
        }
        to += part * delta;
        if (first == use.end()) break;
        to[*first] = delta[*first] > 0.0 ? limits.high[*first] : limits.low[*first];
        use.erase(first);
    }
    return to;
}

/// Whether a step bends nothing: of each column it is a small part of what is there.
bool is_short(const Eigen::VectorXd& from, const Eigen::VectorXd& to)
{
    constexpr double kPart = 0.1;
    return ((to - from).cwiseAbs().array() <= kPart * from.cwiseAbs().array()).all();
}

/// A point and its sums after a step that is so short that they are linear in it.
Refined stepped(const Model& model, Refined at, const Eigen::VectorXd& values)
{
    const Eigen::VectorXd row = with_error(values - at.point.values());
    for (BlockSum& s : at.sums)
        for (Eigen::MatrixXd& gram : s.gram) step(gram, row);
    at.point.set(values);
    at.left = left_of(model, at.sums);
    return at;
}

/// A point as it is, by the rows seen, with derivatives by its columns and the weights of `candidates`, or without any.
Refined seen_at(const Model& model, const Point& at, const std::vector<Input>* candidates)
{
    Refined out;
    out.point = at;
    out.ok = model.sweep_some(at, candidates, false, out.sums);
    if (out.ok) out.left = left_of(model, out.sums);
    return out;
}

/// With the rows held out, where sweeps have left them out.
Refined completed(const Model& model, Refined at)
{
    const auto& blocks = model.plan().blocks;
    std::vector<std::size_t> missing;
    for (std::size_t b = 0; b < blocks.size(); ++b)
        if (blocks[b].heldout && at.ok && !(at.sums[b].rows > 0.0)) missing.push_back(b);
    const std::vector<Input> none;
    std::vector<BlockSum> heldout;
    if (missing.empty()) return at;
    at.ok = model.sweep_some(at.point, &none, true, heldout);
    for (const std::size_t b : missing) at.sums[b] = std::move(heldout[b]);
    if (at.ok) at.left = left_of(model, at.sums);
    return at;
}

}  // namespace

Refined swept(const Model& model, const Point& at)
{
    Refined out;
    out.point = at;
    out.ok = model.pass(at, {}, out.sums);
    if (out.ok) out.left = left_of(model, out.sums);
    return out;
}

Refined swept_seen(const Model& model, const Point& at)
{
    const std::vector<Input> none;
    return seen_at(model, at, &none);
}

Refined refine(const Model& model, Refined best, int passes, double worth)
{
    if (!best.ok) return best;
    // Of the ten nats that confirm an effect.
    constexpr double kSettled = 0.2;
    // Of a unit column: nothing beside any eigenvalue that counts; what first bends a step; where hardly any is left.
    constexpr double kDampingLeast = kLeastEigenvalue, kDampingFirst = 1e-4, kDampingMost = 1e3;
    // Seven steps in a row that fail end the search; damping that helped right after one stays, as (E48) has it.
    constexpr double kGrows = 10.0, kFalls = 0.1, kHardlyLess = 0.97;
    // The last steps that tell what the next may gain, and how many of those count.
    constexpr std::size_t kTelling = 3;
    constexpr int kMostSteps = 12;
    double damping = kDampingLeast, promised = 0.0;
    std::vector<double> gains;  ///< or what was promised, where that was more
    const auto gain_of = [&](const Refined& to) {
        return to.ok ? to.left.seen - best.left.seen + unlikely(best.point) - unlikely(to.point) : 0.0;
    };
    bool failed = false;
    for (int pass = 1; pass < passes; ++pass) {
        Refined end = stepped(model, best, step_within(model, best, damping));
        // A step that is hardly another fails as well.
        for (; failed && damping < kDampingMost && gain_of(end) > kHardlyLess * promised; damping *= kGrows)
            end = stepped(model, best, step_within(model, best, kGrows * damping));
        promised = gain_of(end);
        if (promised < kSettled && (failed || is_short(best.point.values(), end.point.values()))) {
            if (!failed && promised > 0.0) best = std::move(end);
            break;
        }
        // Of a step that is bent, what a whole one would gain.
        const double whole = damping > kDampingFirst
                                 ? gain_of(stepped(model, best, step_within(model, best, kDampingLeast)))
                                 : promised;
        const Point& there = end.point;
        // After a step that failed the next often does too, which errors alone tell; within rounding they may not.
        Refined trial = failed ? seen_at(model, there, nullptr) : swept_seen(model, there);
        if (failed && trial.ok && gain_of(trial) > -2.0 * kSettled) trial = swept_seen(model, there);
        const double gained = gain_of(trial);
        const bool had_failed = std::exchange(failed, !(trial.ok && gained > 0.0));
        gains.push_back(std::max(gained, whole));
        if (!failed) {
            best = std::move(trial);
            if (!had_failed) damping = std::max(damping * kFalls, kDampingLeast);
            if (gained < kSettled) break;
        } else {
            if (trial.ok && -gained < kSettled) break;
            damping = std::max(damping * kGrows, kDampingFirst);
            if (damping > kDampingMost) break;
        }
        const int left = std::min(passes - pass, kMostSteps);
        if (gains.size() >= kTelling &&
            best.left.seen + left * *std::max_element(gains.end() - kTelling, gains.end()) < worth)
            break;
    }
    return completed(model, std::move(best));
}

Refined take_off_noise(const Model& model, const Refined& refined, const AddedScores& added)
{
    constexpr int kRounds = 4;
    // Of R and L, in a step and in all: beyond, the model bends; a change that no deviation shows.
    constexpr double kMost = 0.3, kSettled = 1e-5;
    Refined best = refined, next = refined;
    for (int round = 0; round < kRounds; ++round) {
        double rows = 0.0;
        const std::vector<Eigen::MatrixXd> total = total_of_seen(model, next.sums, rows);
        const Eigen::Index n = total.front().rows() - 1;
        const Eigen::VectorXd v = variances(model, total, rows, with_error(Eigen::VectorXd::Zero(n)));
        const Eigen::MatrixXd scores = added(next.point, v, rows);
        if (scores.size() == 0) return best;
        next.added = scores * v.cwiseInverse();
        Eigen::MatrixXd m = Eigen::MatrixXd::Zero(n, n);
        Eigen::VectorXd score = -next.added;
        for (std::size_t c = 0; c < total.size(); ++c) {
            m += total[c].topLeftCorner(n, n) / v[static_cast<Eigen::Index>(c)];
            score += total[c].col(n).head(n) / v[static_cast<Eigen::Index>(c)];
        }
        const Prior prior = prior_of(next.point, {});
        m += prior.stiffness.asDiagonal();
        score += prior.stiffness.cwiseProduct(prior.value);
        const Eigen::VectorXd size = m.diagonal().cwiseMax(kLeast).cwiseSqrt();
        const Eigen::MatrixXd unit = size.cwiseInverse().asDiagonal() * m * size.cwiseInverse().asDiagonal();
        const Symmetric eigen(unit);
        Eigen::VectorXd z = eigen.eigenvectors().transpose() * score.cwiseQuotient(size);
        for (Eigen::Index i = 0; i < n; ++i)
            z[i] = eigen.eigenvalues()[i] > kLeastEigenvalue ? z[i] / eigen.eigenvalues()[i] : 0.0;
        const Eigen::VectorXd step = -(eigen.eigenvectors() * z).cwiseQuotient(size);
        const Eigen::VectorXd old = next.point.values();
        double most = kLeast;
        for (Eigen::Index j = 0; j < next.point.base.size(); ++j)
            most = std::max(most, std::abs(step[j]) / (std::abs(old[j]) + kLeast));
        const Eigen::VectorXd values = old + std::min(1.0, kMost / most) * step;
        const Limits limits = limits_of(next.point);
        next.point.set(values.cwiseMax(limits.low).cwiseMin(limits.high));
        if (!model.pass(next.point, {}, next.sums)) return best;
        next.left = left_of(model, next.sums);
        // What it takes for noise is the model's error.
        const Eigen::Index few = std::min<Eigen::Index>(next.point.base.size(), 3);
        const Eigen::VectorXd first = refined.point.base.head(few), moved = next.point.base.head(few) - first;
        if ((moved.cwiseAbs() - kMost * first.cwiseAbs()).maxCoeff() > 0.0) return refined;
        best = next;
        if (most < kSettled) break;
    }
    return best;
}

Eigen::MatrixXd seen_information(const Model& model, const Refined& refined, Eigen::VectorXd& variance, double& rows)
{
    const std::vector<Eigen::MatrixXd> total = total_of_seen(model, refined.sums, rows);
    const Eigen::Index n = total.front().rows() - 1;
    variance = variances(model, total, rows, with_error(Eigen::VectorXd::Zero(n)));
    Eigen::MatrixXd m = Eigen::MatrixXd::Zero(n, n);
    for (std::size_t c = 0; c < total.size(); ++c)
        m += total[c].topLeftCorner(n, n) / variance[static_cast<Eigen::Index>(c)];
    m += prior_of(refined.point, {}).stiffness.asDiagonal();
    return m;
}

namespace {

/// Inverse of the information, in units that make its diagonal 1.
struct Inverse {
    Eigen::VectorXd size, told;   ///< unit of a column; of each eigenvector its eigenvalue's inverse, or 0
    Eigen::MatrixXd vectors, of;  ///< eigenvectors; the inverse

    Inverse(const std::vector<Eigen::MatrixXd>& total, const Eigen::VectorXd& v, const Eigen::VectorXd& stiffness)
    {
        const Eigen::Index n = stiffness.size();
        Eigen::MatrixXd m = stiffness.asDiagonal();
        for (std::size_t c = 0; c < total.size(); ++c)
            m += total[c].topLeftCorner(n, n) / v[static_cast<Eigen::Index>(c)];
        size = m.diagonal().cwiseMax(kLeast).cwiseSqrt();
        const Symmetric eigen(size.cwiseInverse().asDiagonal() * m * size.cwiseInverse().asDiagonal());
        told = eigen.eigenvalues().unaryExpr([](double x) { return x > kLeastEigenvalue ? 1.0 / x : 0.0; });
        vectors = eigen.eigenvectors();
        of = vectors * told.asDiagonal() * vectors.transpose();
    }
    Eigen::MatrixXd in_units(const Eigen::MatrixXd& unitless) const
    {
        return size.cwiseInverse().asDiagonal() * unitless * size.cwiseInverse().asDiagonal();
    }
    /// How many columns the rows tell by themselves: tr(C J'J/v).
    double told_by(const Eigen::MatrixXd& total, double v) const
    {
        const Eigen::Index n = size.size();
        return (in_units(of).cwiseProduct(total.topLeftCorner(n, n))).sum() / v;
    }
};

/// Each channel's variance times what brings the squares that a fit leaves to those of the noise, N/(N - gamma), (E42).
/// `says`: whether these squares say anything: not where hardly more values were seen than the columns take up.
Eigen::VectorXd freed(const Model& model, const std::vector<Eigen::MatrixXd>& total, double rows,
                      const Eigen::VectorXd& v, const Inverse& by, bool& says)
{
    // One value, less what rounding or a prior takes of it.
    constexpr double kLeastLeft = 0.9;
    Eigen::VectorXd values(v.size()), told(v.size());
    for (Eigen::Index c = 0; c < v.size(); ++c) {
        const Eigen::MatrixXd& t = total[static_cast<std::size_t>(c)];
        values[c] = t.diagonal().maxCoeff() > 0.0 ? rows : 0.0, told[c] = by.told_by(t, v[c]);
    }
    if (model.common_weight()) values.setConstant(values.sum()), told.setConstant(told.sum());
    const Eigen::VectorXd left = values - told;
    says = (left.array() >= kLeastLeft || values.array() == 0.0).all();
    return values.cwiseQuotient(left.cwiseMax(kLeastLeft)).cwiseMax(1.0);
}

/// What the rows seen tell of the columns.
struct Told {
    double rows = 0.0;
    bool noise = true;  ///< known: as many values as weights leave none
    std::vector<Eigen::MatrixXd> total;
    Eigen::VectorXd v, more;  ///< the noise's variance of each channel, and how often that is what a fit leaves
    Inverse inverse;
};

Told told_of(const Model& model, const Refined& refined)
{
    double rows = 0.0;
    bool noise = true;
    std::vector<Eigen::MatrixXd> total = total_of_seen(model, refined.sums, rows);
    const Eigen::VectorXd least = variances(model, total, rows,
                                            with_error(Eigen::VectorXd::Zero(total.front().rows() - 1))),
                          stiffness = prior_of(refined.point, {}).stiffness;
    Eigen::VectorXd v = least, more;
    Inverse inverse(total, v, stiffness);
    // What is likely before counts for more where the noise is larger: the second time hardly anything changes.
    constexpr int kRounds = 2;
    for (int round = 0; round < kRounds; ++round) {
        more = freed(model, total, rows, v, inverse, noise);
        v = least.cwiseProduct(more);
        inverse = Inverse(total, v, stiffness);
    }
    return {rows, noise, std::move(total), v, more, std::move(inverse)};
}

}  // namespace

double unseen_part(const Model& model, const Refined& refined)
{
    const Told told = told_of(model, refined);
    const auto& blocks = model.plan().blocks;
    double sum = 0.0, values = 0.0;
    // An axis without current or voltage has no noise to compare with.
    const auto told_axes = std::count_if(told.total.begin(), told.total.end(),
                                         [](const Eigen::MatrixXd& t) { return t.diagonal().maxCoeff() > 0.0; });
    for (std::size_t b = 0; b < blocks.size(); ++b) {
        if (!blocks[b].heldout) continue;
        values += refined.sums[b].rows * static_cast<double>(told_axes);
        for (std::size_t c = 0; c < told.total.size(); ++c)
            sum += told.inverse.told_by(refined.sums[b].gram[c], told.v[static_cast<Eigen::Index>(c)]);
    }
    return values > 0.0 ? sum / values : 0.0;
}

Spreads spreads_of(const Model& model, const Refined& refined)
{
    const Told told = told_of(model, refined);
    const Inverse& inverse = told.inverse;
    const Eigen::Index n = inverse.size.size();
    // Rows and blocks are correlated where the model lacks something: scores of neighbours are joined, half a stretch
    // of ten together, as (E48) has it.
    constexpr int kJoined = 5;
    Eigen::MatrixXd scatter = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd score = Eigen::VectorXd::Zero(n);
    int joined = 0;
    const auto& blocks = model.plan().blocks;
    for (std::size_t b = 0; b < blocks.size(); ++b) {
        if (blocks[b].heldout) continue;
        for (std::size_t c = 0; c < told.total.size(); ++c)
            score += std::sqrt(told.more[static_cast<Eigen::Index>(c)]) / told.v[static_cast<Eigen::Index>(c)] *
                     refined.sums[b].gram[c].col(n).head(n);
        if (refined.added.size() > 0)
            score -= refined.sums[b].rows / told.rows / std::sqrt(told.more.mean()) * refined.added;
        if (++joined == kJoined) scatter += score * score.transpose(), score.setZero(), joined = 0;
    }
    scatter += score * score.transpose();
    Spreads out;
    out.white = inverse.in_units(inverse.of);
    out.scatter = inverse.in_units(inverse.of * inverse.in_units(scatter) * inverse.of);
    for (Eigen::Index j = 0; j < n; ++j) {
        // A direction that the rows do not tell. Within rounding, one that does not concern the column is no part of
        // it.
        constexpr double kMostLost = 1e-3;
        double lost = 0.0;
        for (Eigen::Index k = 0; k < n; ++k)
            if (!(inverse.told[k] > 0.0)) lost += inverse.vectors(j, k) * inverse.vectors(j, k);
        out.told.push_back(told.noise && !(lost > kMostLost || !(inverse.size[j] > std::sqrt(kLeast))));
    }
    return out;
}

Eigen::MatrixXd covariance(const Model& model, const Refined& refined)
{
    const Spreads s = spreads_of(model, refined);
    // Each column by the wider of the two, together as the white noise has them.
    const Eigen::VectorXd wider =
        s.scatter.diagonal().cwiseQuotient(s.white.diagonal().cwiseMax(kLeast)).cwiseMax(1.0).cwiseSqrt();
    Eigen::MatrixXd out = wider.asDiagonal() * s.white * wider.asDiagonal();
    for (Eigen::Index j = 0; j < out.cols(); ++j)
        if (!s.told[static_cast<std::size_t>(j)]) out(j, j) = HUGE_VAL;
    return out;
}

Eigen::VectorXd deviations(const Model& model, const Refined& refined)
{
    return covariance(model, refined).diagonal().cwiseSqrt();
}

}  // namespace dqw
