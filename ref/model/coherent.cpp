#include "ref/model/coherent.hpp"

#include <algorithm>
#include <cmath>

#include "ref/log/symmetric.hpp"

namespace dqw {
namespace {

constexpr double kLeast = 1e-300;

/// Means of `length` values that follow one another.
std::vector<double> means(const std::vector<double>& x, std::size_t length)
{
    std::vector<double> out;
    for (std::size_t k = 0; k + length <= x.size(); k += length) {
        double sum = 0.0;
        for (std::size_t n = k; n < k + length; ++n) sum += x[n];
        out.push_back(sum / static_cast<double>(length));
    }
    return out;
}

double mean_square(const std::vector<double>& x)
{
    double sum = 0.0;
    for (double v : x) sum += v * v;
    return x.empty() ? 0.0 : sum / static_cast<double>(x.size());
}

/// What lasts of a series, a mean square: what values two and three apart have in common, which share no row and no
/// end, less what chance makes of it.
double lasting(const std::vector<double>& e)
{
    // Of a dozen looks a normal exceeds three in one of 40 logs; ends that neighbours share cost 1.2 of it.
    constexpr double kChance = 4.0;
    double most = 0.0;
    for (const std::size_t apart : {2, 3}) {
        if (e.size() < 4 * apart) continue;
        double sum = 0.0;
        for (std::size_t k = apart; k < e.size(); ++k) sum += e[k] * e[k - apart];
        most = std::max(most, std::abs(sum) / static_cast<double>(e.size() - apart));
    }
    // Of few values all may be what lasts: the whole of them is taken for white.
    const double count = static_cast<double>(std::max<std::size_t>(e.size(), 1));
    return std::max(most - kChance * mean_square(e) / std::sqrt(count), 0.0);
}

std::vector<double> channel_of(const std::vector<ReportBlock>& blocks, int channel)
{
    std::vector<double> out;
    for (const ReportBlock& b : blocks) out.push_back(b.residual[channel]);
    return out;
}

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

}  // namespace

Eigen::VectorXd coherent_deviations(const Model& model, const Point& at, const Eigen::MatrixXd& information,
                                    const Eigen::VectorXd& weight)
{
    constexpr double kStep = 1e-3;  // of a value: the residual is linear in all but shapes
    // Means of 5, 20, 80, 320 rows: what lasts 10 rows is seen, and what is drowned in them shows in the longer.
    constexpr std::size_t kRows = 5, kLonger = 4, kScales = 4;
    const Eigen::Index n = at.columns(), first = at.base.size(), last = first + at.gain.size();
    Eigen::VectorXd square = Eigen::VectorXd::Zero(n);
    const std::vector<ReportBlock> here = model.report(at, kRows);
    std::vector<std::vector<double>> residual;
    double most = 0.0;
    for (int c = 0; c < model.channels(); ++c) {
        residual.push_back(channel_of(here, c));
        std::size_t length = 1;
        for (std::size_t scale = 0; scale < kScales; ++scale, length *= kLonger)
            most = std::max(most, lasting(means(residual.back(), length)));
    }
    if (!(most > 0.0)) return square;
    const Eigen::MatrixXd inverse = inverse_of(information);
    std::vector<Eigen::MatrixXd> slope(residual.size());
    for (auto& s : slope) s = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(here.size()), n);
    const Eigen::VectorXd values = at.values();
    for (Eigen::Index j = 0; j < n; ++j) {
        if ((j >= first && j < last) || !(information(j, j) > 0.0)) continue;
        Point moved = at;
        Eigen::VectorXd to = values;
        const double step = std::max(std::abs(values[j]) * kStep, 1e-9);
        to[j] += step;
        moved.set(to);
        const std::vector<ReportBlock> there = model.report(moved, kRows);
        for (std::size_t c = 0; c < slope.size(); ++c)
            for (std::size_t b = 0; b < here.size(); ++b)
                slope[c](static_cast<Eigen::Index>(b), j) = (there[b].residual[c] - here[b].residual[c]) / step;
    }
    for (std::size_t c = 0; c < slope.size(); ++c) {
        const Eigen::MatrixXd moves = slope[c] * inverse;
        for (Eigen::Index j = 0; j < n; ++j) {
            const std::vector<double> by(moves.col(j).data(), moves.col(j).data() + moves.rows());
            double worst = 0.0;
            std::size_t length = 1;
            for (std::size_t scale = 0; scale < kScales; ++scale, length *= kLonger)
                worst = std::max(worst, lasting(means(residual[c], length)) * mean_square(means(by, length)));
            square[j] += worst * std::pow(weight[static_cast<Eigen::Index>(c)], 2);
        }
    }
    return square.cwiseSqrt();
}

Eigen::VectorXd coherent_weight(const std::vector<Log>& logs, const Point& at, const Eigen::VectorXd& variance,
                                double rows)
{
    Eigen::VectorXd weight(2);
    const double dt_s = logs.front().dt_s;
    for (int axis : {0, 1}) {
        const double L = at.base[1 + axis], g = std::clamp(at.gain[axis], 0.0, 1.0),
                     decay = std::exp(-std::abs(at.base[0]) * dt_s / L);
        // What each row gets, summed up until the gain and the winding have forgotten it.
        const double volt_A = dt_s / L / (1.0 - decay * (1.0 - g));
        weight[axis] = rows * volt_A * volt_A / std::max(variance[axis], kLeast);
    }
    return weight;
}

}  // namespace dqw
