#include "ref/trace/noise.hpp"

#include <algorithm>
#include <cmath>

#include "ref/fit/explain.hpp"
#include "ref/log/symmetric.hpp"
#include "ref/trace/rules.hpp"

namespace dqw {
namespace {

/// Rows of a chunk; a wild stretch spoils no more of them. Of 20 a mean square scatters by a third. (E48)
constexpr std::size_t kChunk = 200, kLeastChunk = 20;

double median(std::vector<double> x)
{
    if (x.empty()) return 0.0;
    std::nth_element(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2), x.end());
    return x[x.size() / 2];
}

/// Mean squares of two filters: (1 -4 6 -4 1), at the top of the band, and second differences of means over five rows,
/// around a tenth of the sampling rate. Medians over chunks, so that a few wild stretches do not count.
struct HighBand {
    double top = 0.0, fifth = 0.0;
    static constexpr std::size_t kFive = 5, kReach = 3 * kFive;
    static constexpr double kTopOfWhite = 1 + 16 + 36 + 16 + 1, kFifthOfMeans = 1 + 4 + 1;  ///< squares of the filters
};

HighBand high_band(const std::vector<double>& x, const std::vector<std::size_t>& starts)
{
    std::vector<double> top, fifth;
    for (std::size_t s = 0; s < starts.size(); ++s) {
        const std::size_t begin = starts[s], end = s + 1 < starts.size() ? starts[s + 1] : x.size();
        for (std::size_t k = begin; k + HighBand::kReach < end; k += kChunk) {
            const std::size_t stop = std::min(k + kChunk, end - HighBand::kReach);
            if (stop < k + kLeastChunk) break;
            double a = 0.0, b = 0.0;
            for (std::size_t r = k; r < stop; ++r) {
                const double y = x[r] - 4.0 * x[r + 1] + 6.0 * x[r + 2] - 4.0 * x[r + 3] + x[r + 4];
                double z = 0.0;
                for (std::size_t n = r; n < r + HighBand::kFive; ++n)
                    z += 0.2 * (x[n] - 2.0 * x[n + HighBand::kFive] + x[n + 2 * HighBand::kFive]);
                a += y * y, b += z * z;
            }
            top.push_back(a / HighBand::kTopOfWhite / static_cast<double>(stop - k)),
                fifth.push_back(b / HighBand::kFifthOfMeans / static_cast<double>(stop - k));
        }
    }
    return {median(top), median(fifth)};
}

/// Variance of a block's mean over `rows` rows, told apart into noise A |1 - z|^2 of the state's sensor, white noise S,
/// and the known noise W |1 + z|^2 / 4 of the speed sensor: top = 3.6 A + S + 0.1 W, fifth = 0.133 A + 0.2 S + 0.167 W
/// (sums of squares of the filters in a row: 252/70, 28/4/70; 20/25/6, 30/25/6, 25/25/6), solved for A and S.
double block_variance(HighBand seen, double speed, double rows, double damped)
{
    double differenced = (seen.top - 5.0 * seen.fifth + 0.7333 * speed) / 2.933;
    double white = 5.0 * (seen.fifth - 0.1333 * differenced - 0.1667 * speed);
    if (differenced < 0.0) differenced = 0.0, white = std::max(5.0 * seen.fifth - 0.8333 * speed, 0.0);
    if (white < 0.0) white = 0.0, differenced = std::max(seen.top - 0.1 * speed, 0.0) / 3.6;
    return 2.0 * differenced / (rows * rows) + differenced * damped * damped / rows + (white + speed) / rows;
}

/// Single rows one after the other: what is left of them, and the voltage of each.
struct Singles {
    std::vector<std::size_t> starts;  ///< of stretches without a gap
    std::vector<double> residual[2], measured[2], speed;
    double flux[2] = {};  ///< sums of squares
    double dt_s = 0.0, turned = 0.0;
};

Singles singles_of(const TraceSetup& setup, const Point& at)
{
    const std::vector<ReportBlock> single = setup.full->report(at, 1);
    const int channels = setup.full->channels();
    Singles s;
    for (std::size_t k = 0; k < single.size(); ++k) {
        const ReportBlock& b = single[k];
        if (k == 0 || single[k - 1].log != b.log || single[k - 1].end != b.begin) s.starts.push_back(k);
        for (int c = 0; c < channels; ++c)
            s.residual[c].push_back(b.residual[c]), s.measured[c].push_back(b.measured[c]);
        s.speed.push_back(b.log->w_m_rad_s[b.begin]);
        s.dt_s = b.log->dt_s;
        if (channels == 2) {
            s.turned += std::pow(setup.pole_pairs * s.speed.back() * s.dt_s, 2) / static_cast<double>(single.size());
            const double d = at.base[1] * b.log->i_d_A[b.begin] + at.base[3], q = at.base[2] * b.log->i_q_A[b.begin];
            s.flux[0] += q * q, s.flux[1] += d * d;
        }
    }
    return s;
}

/// What foretells row k, (E123): steps of the voltage before it, and residuals two rows and more before, both axes'.
/// The first three (a one, and both residuals' slow means) are slow structure, and count for neither.
constexpr Eigen::Index kSlow = 3, kFast = 12, kAll = kSlow + kFast;
constexpr std::size_t kSlowRows = 20, kBefore = kSlowRows + 4;  ///< a block's; rows that a line looks back
constexpr std::size_t kMostLines = 32768;                       ///< of a regression: its parts are then known to 0.03 %
using Line = Eigen::Matrix<double, kAll, 1>;

Line line_of(const Singles& s, const std::vector<double> (&sum)[2], std::size_t k)
{
    Line x;
    x(0) = 1.0;
    Eigen::Index n = kSlow;
    for (int c : {0, 1}) {
        const double slow = (sum[c][k - 1] - sum[c][k - 1 - kSlowRows]) / static_cast<double>(kSlowRows);
        x(1 + c) = slow;
        for (std::size_t lag : {1, 2, 3}) x(n++) = s.measured[c][k - lag] - s.measured[c][k - lag - 1];
        for (std::size_t lag : {2, 3, 4}) x(n++) = s.residual[c][k - lag] - slow;
    }
    return x;
}

/// The part of each axis' residual that its past foretells beyond chance; takes that off where it is beyond kFollowed.
double take_followed(Singles& s)
{
    std::vector<double> sum[2];
    for (int c : {0, 1}) {
        sum[c].assign(1, 0.0);
        for (double e : s.residual[c]) sum[c].push_back(sum[c].back() + e);
    }
    const std::size_t rows = s.residual[0].size(), stride = std::max<std::size_t>(rows / kMostLines, 1);
    const auto each = [&](std::size_t step, auto&& work) {
        for (std::size_t n = 0; n < s.starts.size(); ++n) {
            const std::size_t end = n + 1 < s.starts.size() ? s.starts[n + 1] : rows;
            for (std::size_t k = s.starts[n] + kBefore; k < end; k += step) work(k, line_of(s, sum, k));
        }
    };
    Eigen::Matrix<double, kAll, kAll> g = Eigen::Matrix<double, kAll, kAll>::Zero();
    Eigen::Matrix<double, kAll, 2> h = Eigen::Matrix<double, kAll, 2>::Zero();
    Eigen::Vector2d square = Eigen::Vector2d::Zero();
    double lines = 0.0;
    each(stride, [&](std::size_t k, const Line& x) {
        const Eigen::RowVector2d y(s.residual[0][k], s.residual[1][k]);
        g += x * x.transpose(), h += x * y, square += y.cwiseAbs2().transpose(), lines += 1.0;
    });
    constexpr double kLeastLines = 10.0 * kAll;
    if (lines < kLeastLines) return 0.0;
    // A column that never moves, as a voltage without steps, stays out.
    const Line size = g.diagonal().cwiseSqrt().cwiseMax(1e-300);
    const Eigen::MatrixXd unit = size.cwiseInverse().asDiagonal() * g * size.cwiseInverse().asDiagonal();
    const Eigen::MatrixXd to = size.cwiseInverse().asDiagonal() * h;
    const Eigen::MatrixXd all = pseudo_inverse(unit) * to,
                          slow = pseudo_inverse(unit.topLeftCorner(kSlow, kSlow)) * to.topRows(kSlow);
    double most = 0.0;
    Eigen::Matrix<double, kAll, 2> take = Eigen::Matrix<double, kAll, 2>::Zero();
    for (int c : {0, 1}) {
        const double without = square(c) - to.col(c).head(kSlow).dot(slow.col(c)),
                     with = square(c) - to.col(c).dot(all.col(c));
        if (!(without > 0.0)) continue;
        const double part = 1.0 - with / without - static_cast<double>(kFast) / lines;
        most = std::max(most, part);
        if (part > kFollowed) take.col(c).tail(kFast) = all.col(c).tail(kFast).cwiseQuotient(size.tail(kFast));
    }
    if (take.isZero()) return most;
    std::vector<double> left[2] = {s.residual[0], s.residual[1]};
    each(1, [&](std::size_t k, const Line& x) {
        for (int c : {0, 1}) left[c][k] -= x.dot(take.col(c));
    });
    for (int c : {0, 1}) s.residual[c] = std::move(left[c]);
    return most;
}

double moving_floor(const TraceSetup& setup, const Point& at, const Singles& s)
{
    const int channels = setup.full->channels();
    const double count = static_cast<double>(s.speed.size()), speed_noise = high_band(s.speed, s.starts).top,
                 rows = static_cast<double>(block_rows(setup.logs->front()));
    double sum = 0.0;
    for (int c = 0; c < channels; ++c) {
        const double inertia = channels == 2 ? at.base[1 + c] : at.base[0],
                     drag = channels == 2 ? at.base[0] : at.base[1];
        const double w = channels == 2 ? setup.pole_pairs * setup.pole_pairs * speed_noise * s.flux[c] / count : 0.0;
        // The other axis' current, of about the same noise, comes in by the turning.
        const double across = channels == 2 ? at.base[2 - c] / inertia : 0.0;
        sum += block_variance(high_band(s.residual[c], s.starts), w, rows,
                              std::sqrt(std::pow(drag * s.dt_s / inertia, 2) + across * across * s.turned));
    }
    return std::sqrt(sum / channels);
}

Noise moving_noise(const TraceSetup& setup, const Point& at)
{
    Singles s = singles_of(setup, at);
    if (s.speed.empty()) return {};
    Noise out;
    out.floor = out.raw = moving_floor(setup, at, s);
    if (setup.full->channels() == 2) out.followed = take_followed(s);
    if (out.followed > kFollowed) out.floor = std::min(out.raw, moving_floor(setup, at, s));
    return out;
}

double settled_floor(const TraceSetup& setup, const Point& at)
{
    const std::vector<ReportBlock> blocks = setup.full->report(at, 1);
    std::vector<double> square;
    for (std::size_t k = 2; k < blocks.size(); ++k) {
        if (blocks[k].log != blocks[k - 2].log) continue;
        double sum = 0.0;
        for (int c = 0; c < 2; ++c) {
            const double y = blocks[k].residual[c] - 2.0 * blocks[k - 1].residual[c] + blocks[k - 2].residual[c];
            sum += y * y / 6.0;
        }
        square.push_back(0.5 * sum);
    }
    if (square.empty()) return 0.0;
    double mean = 0.0;
    for (double x : square) mean += x / static_cast<double>(square.size());
    return std::sqrt(mean);
}

}  // namespace

Noise noise_of(const TraceSetup& setup, const Point& at)
{
    const bool moving = setup.regime == Regime::dynamic || setup.regime == Regime::mechanical;
    if (moving) return moving_noise(setup, at);
    const double floor = settled_floor(setup, at);
    return {floor, floor, 0.0};
}

std::string doubt_of(const Noise& noise, double rms)
{
    // Thirty times what a right model leaves; of 32 clean blind logs each left 0.86 to 1.11.
    constexpr double kMuch = 0.25, kFarBelow = 0.5;
    const std::string ask = ": are currents or voltages filtered, held or late?";
    if (rms < kFarBelow * noise.floor || (rms < noise.floor / kStructured && noise.followed > kFollowed))
        return "blocks leave " + figure(rms / noise.floor) +
               " of what the noise of single rows would leave in them, "
               "so that is no noise" +
               ask;
    if ((rms <= kStructured * noise.raw && rms > kStructured * noise.floor) ||
        (rms <= kStructured * noise.floor && noise.followed > kMuch))
        return figure(100.0 * noise.followed) +
               " % of what looks like noise in single rows follows from the rows "
               "before" +
               ask;
    return "";
}

}  // namespace dqw
