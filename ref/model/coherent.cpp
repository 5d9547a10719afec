#include "ref/model/coherent.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "ref/log/symmetric.hpp"
#include "ref/model/foretold.hpp"

namespace dqw {
namespace {

constexpr double kLeast = 1e-300;

// Means of 5, 20, 80, 320 rows: what lasts 10 rows is seen, and what is drowned in them shows in the longer.
constexpr std::size_t kRows = 5, kLonger = 4, kScales = 4;

/// Means of values that follow one another, at each scale as they come; a rest of the last is none.
class Means {
public:
    template <typename Visit> void add(double x, Visit&& visit)
    {
        std::size_t length = 1;
        for (std::size_t scale = 0; scale < kScales; ++scale, length *= kLonger) {
            sum_[scale] += x;
            if (++count_[scale] < length) continue;
            visit(scale, sum_[scale] / static_cast<double>(length));
            sum_[scale] = 0.0, count_[scale] = 0;
        }
    }

private:
    double sum_[kScales] = {};
    std::size_t count_[kScales] = {};
};

struct MeanSquare {
    double sum = 0.0;
    std::size_t count = 0;
    void add(double x) { sum += x * x, ++count; }
    double value() const { return count == 0 ? 0.0 : sum / static_cast<double>(count); }
};

/// What lasts of a series, a mean square: what values two and three apart have in common, which share no row and no
/// end, less what chance makes of it.
class Lasting {
public:
    void add(double e)
    {
        for (std::size_t apart : {2, 3})
            if (square_.count >= apart) sum_[apart - 2] += e * last_[apart - 1];
        last_[2] = last_[1], last_[1] = last_[0], last_[0] = e;
        square_.add(e);
    }
    double value() const
    {
        // Of a dozen looks a normal exceeds three in one of 40 logs; ends that neighbours share cost 1.2 of it.
        constexpr double kChance = 4.0;
        double most = 0.0;
        for (std::size_t apart : {2, 3})
            if (square_.count >= 4 * apart)
                most = std::max(most, std::abs(sum_[apart - 2]) / static_cast<double>(square_.count - apart));
        // Of few values all may be what lasts: the whole of them is taken for white.
        const double count = static_cast<double>(std::max<std::size_t>(square_.count, 1));
        return std::max(most - kChance * square_.value() / std::sqrt(count), 0.0);
    }

private:
    double last_[3] = {}, sum_[2] = {};
    MeanSquare square_;
};

Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& m)
{
    constexpr double kLeastEigenvalue = 1e-9;  // of unit columns: what rounding of 10^6 rows leaves
    const Eigen::VectorXd size = m.diagonal().cwiseMax(kLeast).cwiseSqrt().cwiseInverse();
    const Symmetric eigen(size.asDiagonal() * m * size.asDiagonal());
    const Eigen::VectorXd by = eigen.eigenvalues().unaryExpr(
        [](double x) { return x > kLeastEigenvalue ? 1.0 / x : 0.0; });
    return size.asDiagonal() * (eigen.eigenvectors() * by.asDiagonal() * eigen.eigenvectors().transpose()) *
           size.asDiagonal();
}

/// A part of single rows that noise does not have: of white noise of any channel the rows before foretell 0.007 at
/// most.
constexpr double kForetold = 0.01;

/// Whether the rows before foretell more of single rows than noise lets them.
bool is_foretold(const Model& model, const Point& at)
{
    RowsBefore before;
    Foretelling line;
    Foretold foretold;
    model.report_each({at}, 1, [&](const std::vector<ReportBlock>& b) {
        if (before.add(b.front(), line)) foretold.add(line, b.front());
    });
    const Foretold::Part found = foretold.solve();
    return std::max(found.part[0], found.part[1]) > kForetold;
}

/// Of an effect's weights, which may be nothing: ten times what white noise alone makes of each. A row in which another
/// leg begins to rest jumps, and over less would pass for a slope.
Eigen::VectorXd least_steps(const Point& at, const Eigen::MatrixXd& information)
{
    constexpr double kDeviations = 10.0;
    Eigen::VectorXd least = Eigen::VectorXd::Zero(at.columns());
    Eigen::Index j = at.base.size() + at.gain.size();
    for (const Term& t : at.terms) {
        for (int w = 0; w < weights_of(t.input.law); ++w, ++j)
            if (information(j, j) > 0.0) least[j] = kDeviations / std::sqrt(information(j, j));
        j += free_shapes_of(t.input);
    }
    return least;
}

/// How far least squares on means over 20 rows, in which noise of currents is small, puts each column from
/// `points.front()`, where steps of both voltages, this row's and three before, and the voltage across, by speed, are
/// inputs too: what a voltage or a current of another instant leaves. `points`: it, and those with one column moved.
Eigen::VectorXd moved_by_steps(const Model& model, const std::vector<Point>& points, const std::vector<double>& steps)
{
    constexpr std::size_t kMean = 20;
    constexpr Eigen::Index kSteps = 8, kEach = kSteps + 1;
    const auto n = static_cast<Eigen::Index>(steps.size()), all = n + 2 * kEach;
    Eigen::MatrixXd gram[] = {Eigen::MatrixXd::Zero(all, all), Eigen::MatrixXd::Zero(all, all)},
                    sum = Eigen::MatrixXd::Zero(all + 1, 2);
    Eigen::VectorXd to[] = {Eigen::VectorXd::Zero(all), Eigen::VectorXd::Zero(all)};
    double square[2] = {};
    std::size_t count = 0;
    RowsBefore before;
    Foretelling line;
    Eigen::Matrix<double, kSteps, 1> of_v;
    model.report_each(points, 1, [&](const std::vector<ReportBlock>& b) {
        if (!before.add(b.front(), line)) {
            count = 0, sum.setZero();
            return;
        }
        of_v << before.step(0), before.step(1), line.segment<3>(kSlowColumns), line.segment<3>(kSlowColumns + 6);
        for (int c : {0, 1}) {
            for (Eigen::Index j = 0; j < n; ++j) {
                const auto p = static_cast<std::size_t>(j);
                sum(j, c) += (b[p + 1].residual[c] - b[0].residual[c]) / steps[p];
            }
            const Eigen::Index own = n + c * kEach;
            sum.col(c).segment<kSteps>(own) += of_v;
            sum(own + kSteps, c) += b[0].log->w_m_rad_s[b[0].begin] * b[0].measured[1 - c];
            sum(all, c) += b[0].residual[c];
        }
        if (++count < kMean) return;
        for (int c : {0, 1}) {
            const Eigen::VectorXd x = sum.col(c).head(all);
            gram[c] += x * x.transpose(), to[c] -= x * sum(all, c), square[c] += sum(all, c) * sum(all, c);
        }
        count = 0, sum.setZero();
    });
    for (int c : {0, 1}) gram[c] /= std::max(square[c], kLeast), to[c] /= std::max(square[c], kLeast);
    return inverse_of(gram[0] + gram[1]).topRows(n) * (to[0] + to[1]);
}

}  // namespace

Eigen::VectorXd coherent_deviations(const Model& model, const Point& at, const Eigen::MatrixXd& information,
                                    const LastingVolt& volt)
{
    constexpr double kStep = 1e-3;  // of a value: the residual is linear in all but shapes
    const Eigen::Index n = at.columns(), first = at.base.size(), last = first + at.gain.size();
    const auto channels = static_cast<std::size_t>(model.channels());
    Eigen::VectorXd square = Eigen::VectorXd::Zero(n);
    std::vector<Means> residual(channels);
    std::vector<std::array<Lasting, kScales>> lasting(channels);
    model.report_each({at}, kRows, [&](const std::vector<ReportBlock>& here) {
        for (std::size_t c = 0; c < channels; ++c)
            residual[c].add(here[0].residual[c], [&](std::size_t scale, double e) { lasting[c][scale].add(e); });
    });
    double most = 0.0;
    for (const auto& of_channel : lasting)
        for (const Lasting& l : of_channel) most = std::max(most, l.value());
    const bool brief = channels == 2 && is_foretold(model, at);
    if (!(most > 0.0) && !brief) return square;

    const Eigen::VectorXd least = least_steps(at, information);
    // The point, and those with one value moved.
    std::vector<Point> points{at};
    std::vector<Eigen::Index> column;
    std::vector<double> steps;
    for (Eigen::Index j = 0; j < n; ++j) {
        if ((j >= first && j < last) || !(information(j, j) > 0.0)) continue;
        Eigen::VectorXd to = at.values();
        steps.push_back(std::max({std::abs(to[j]) * kStep, 1e-9, least[j]}));
        to[j] += steps.back();
        column.push_back(j);
        points.push_back(at);
        points.back().set(to);
    }
    // A product of some blocks at a time.
    constexpr Eigen::Index kChunk = 1024;
    const Eigen::MatrixXd inverse = inverse_of(information);
    std::vector<Eigen::MatrixXd> slope(channels, Eigen::MatrixXd::Zero(kChunk, n));
    std::vector<std::vector<Means>> moves(channels, std::vector<Means>(static_cast<std::size_t>(n)));
    std::vector<std::vector<std::array<MeanSquare, kScales>>> moved(
        channels, std::vector<std::array<MeanSquare, kScales>>(static_cast<std::size_t>(n)));
    Eigen::Index gathered = 0;
    const auto flush = [&] {
        for (std::size_t c = 0; c < channels; ++c) {
            const Eigen::MatrixXd by = slope[c] * inverse;
            for (std::size_t j = 0; j < moved[c].size(); ++j)
                for (Eigen::Index b = 0; b < gathered; ++b)
                    moves[c][j].add(by(b, static_cast<Eigen::Index>(j)),
                                    [&](std::size_t scale, double mean) { moved[c][j][scale].add(mean); });
        }
        gathered = 0;
    };
    model.report_each(points, kRows, [&](const std::vector<ReportBlock>& blocks) {
        for (std::size_t c = 0; c < channels; ++c)
            for (std::size_t p = 0; p < column.size(); ++p)
                slope[c](gathered, column[p]) = (blocks[p + 1].residual[c] - blocks[0].residual[c]) / steps[p];
        if (++gathered == kChunk) flush();
    });
    flush();
    for (std::size_t c = 0; c < channels; ++c) {
        const auto axis = static_cast<Eigen::Index>(c);
        for (std::size_t j = 0; j < moved[c].size(); ++j) {
            double worst = 0.0, rows = kRows;
            for (std::size_t scale = 0; scale < kScales; ++scale, rows *= kLonger)
                worst = std::max(worst, std::pow(1.0 - std::pow(volt.kept[axis], rows), 4) * lasting[c][scale].value() *
                                            moved[c][j][scale].value());
            square[static_cast<Eigen::Index>(j)] += worst * std::pow(volt.weight[axis], 2);
        }
    }
    if (brief) {
        const Eigen::VectorXd far = moved_by_steps(model, points, steps);
        // An effect's own weights stay: iron loss is as good as such a step, and its rivals judge that.
        for (std::size_t k = 0; k < column.size() && column[k] < first; ++k)
            square[column[k]] += std::pow(far[static_cast<Eigen::Index>(k)], 2);
    }
    return square.cwiseSqrt();
}

LastingVolt lasting_volt(const std::vector<Log>& logs, const Point& at, const Eigen::VectorXd& variance, double rows)
{
    LastingVolt volt{Eigen::VectorXd(2), Eigen::VectorXd(2)};
    const double dt_s = logs.front().dt_s;
    for (int axis : {0, 1}) {
        const double L = at.base[1 + axis], g = std::clamp(at.gain[axis], 0.0, 1.0),
                     decay = std::exp(-std::abs(at.base[0]) * dt_s / L);
        // What each row gets, summed up until the gain and the winding have forgotten it.
        volt.kept[axis] = decay * (1.0 - g);
        const double volt_A = dt_s / L / (1.0 - volt.kept[axis]);
        volt.weight[axis] = rows * volt_A * volt_A / std::max(variance[axis], kLeast);
    }
    return volt;
}

}  // namespace dqw
