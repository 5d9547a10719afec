#include "ref/trace/noise.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <random>

#include "ref/effect/range.hpp"
#include "ref/fit/explain.hpp"
#include "ref/log/median.hpp"
#include "ref/log/symmetric.hpp"
#include "ref/model/electrical.hpp"
#include "ref/model/foretold.hpp"
#include "ref/search/solve.hpp"
#include "ref/trace/rules.hpp"

namespace dqw {
namespace {

/// Rows of a chunk; a wild stretch spoils no more of them. Of 20 a mean square scatters by a third. (E48)
constexpr std::size_t kChunk = 200, kLeastChunk = 20;
/// Of a shaft's block: a tenth of them is two.
constexpr double kShaftRows = 20.0;

/// Mean squares of two filters: (1 -4 6 -4 1), at the top of the band, and second differences of means over five rows,
/// around a tenth of the sampling rate. Medians over chunks, so that a few wild stretches do not count.
struct HighBand {
    double top = 0.0, fifth = 0.0;
    static constexpr std::size_t kFive = 5, kReach = 3 * kFive;
    static constexpr double kTopOfWhite = 1 + 16 + 36 + 16 + 1, kMeansOfWhite = 1 + 4 + 1;  ///< squares of the filters
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
                fifth.push_back(b / HighBand::kMeansOfWhite / static_cast<double>(stop - k));
        }
    }
    return {median(top), median(fifth)};
}

/// Mean square of second differences of means over `rows` rows, over that of the filter: a median over chunks of 40 of
/// them; 0 where there are none.
double band_of_means(const std::vector<double>& x, const std::vector<std::size_t>& starts, std::size_t rows)
{
    constexpr std::size_t kMeans = 40, kLeastMeans = 4;
    std::vector<double> sum(x.size() + 1, 0.0), chunks;
    for (std::size_t k = 0; k < x.size(); ++k) sum[k + 1] = sum[k] + x[k];
    const double share = 1.0 / static_cast<double>(rows);
    for (std::size_t s = 0; s < starts.size(); ++s) {
        const std::size_t begin = starts[s], end = s + 1 < starts.size() ? starts[s + 1] : x.size();
        for (std::size_t k = begin; k + 3 * rows < end; k += kMeans * rows) {
            const std::size_t stop = std::min(k + kMeans * rows, end - 3 * rows);
            if (stop < k + kLeastMeans * rows) break;
            double square = 0.0;
            for (std::size_t r = k; r < stop; ++r) {
                const double z = share * (sum[r + rows] - sum[r] - 2.0 * (sum[r + 2 * rows] - sum[r + rows]) +
                                          sum[r + 3 * rows] - sum[r + 2 * rows]);
                square += z * z;
            }
            chunks.push_back(square / HighBand::kMeansOfWhite / static_cast<double>(stop - k));
        }
    }
    return median(chunks);
}

/// Noise of single rows, told apart into noise A |1 - z|^2 of the state's sensor and white noise S, beside the known
/// noise W |1 + z|^2 / 4 of the speed sensor: top = 3.6 A + S + 0.1 W, fifth = 0.133 A + 0.2 S + 0.167 W (sums of squares
/// of the filters in a row: 252/70, 28/4/70; 20/25/6, 30/25/6, 25/25/6), solved for A and S.
struct Apart {
    double differenced, white;

    Apart(HighBand seen, double speed)
        : differenced((seen.top - 5.0 * seen.fifth + 0.7333 * speed) / 2.933),
          white(5.0 * (seen.fifth - 0.1333 * differenced - 0.1667 * speed))
    {
        if (differenced < 0.0) differenced = 0.0, white = std::max(5.0 * seen.fifth - 0.8333 * speed, 0.0);
        if (white < 0.0) white = 0.0, differenced = std::max(seen.top - 0.1 * speed, 0.0) / 3.6;
    }
    /// Variance of a block's mean over `rows` rows.
    double of_block(double speed, double rows, double damped) const
    {
        return 2.0 * differenced / (rows * rows) + differenced * damped * damped / rows + (white + speed) / rows;
    }
};

/// Of a shaft: white noise S of the torque, and what the speed's sensor makes of its slope, a difference of white noise
/// or, where the speed is itself a difference of angles, one of second order. Both are one, D, to means of m = n/10 rows
/// and of twice as many: 3.3 D/m^2 + S/m and 0.83 D/m^2 + 0.5 S/m (20/6, 20/24).
double shaft_block_variance(const std::vector<double>& x, const std::vector<std::size_t>& starts, double rows,
                            double damped)
{
    const auto few = static_cast<std::size_t>(rows / 10.0);
    const double m = static_cast<double>(few), one = band_of_means(x, starts, few),
                 two = band_of_means(x, starts, 2 * few);
    double white = m * (4.0 * two - one), differenced = 0.6 * m * m * (one - 2.0 * two);
    if (differenced < 0.0) differenced = 0.0, white = 2.0 * m * two;
    if (white < 0.0) white = 0.0, differenced = 1.2 * m * m * two;
    return 2.0 * differenced / (rows * rows) + differenced * damped * damped / rows + white / rows;
}

/// Single rows one after the other, and what is left of them.
struct Singles {
    std::vector<ReportBlock> rows;
    std::vector<std::size_t> starts;  ///< of stretches without a gap
    std::vector<double> residual[2], speed;
    double flux[2] = {};  ///< sums of squares
    double dt_s = 0.0, turned = 0.0;
};

Singles singles_of(const TraceSetup& setup, const Point& at)
{
    Singles s;
    s.rows = setup.full->report(at, 1);
    const std::vector<ReportBlock>& single = s.rows;
    const int channels = setup.full->channels();
    for (std::size_t k = 0; k < single.size(); ++k) {
        const ReportBlock& b = single[k];
        if (k == 0 || single[k - 1].log != b.log || single[k - 1].end != b.begin) s.starts.push_back(k);
        for (int c = 0; c < channels; ++c) s.residual[c].push_back(b.residual[c]);
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

constexpr std::size_t kMostLines = 32768;  ///< of a regression: its parts are then known to 0.03 %

/// The part of each axis' residual that its past foretells beyond chance; takes that off where it is beyond kFollowed.
double take_followed(Singles& s)
{
    const std::size_t stride = std::max<std::size_t>(s.residual[0].size() / kMostLines, 1);
    const auto each = [&](auto&& work) {
        RowsBefore rows;
        Foretelling line;
        for (std::size_t k = 0; k < s.rows.size(); ++k)
            if (rows.add(s.rows[k], line)) work(k, line, s.rows[k]);
    };
    Foretold foretold;
    each([&](std::size_t k, const Foretelling& line, const ReportBlock& b) {
        if (k % stride == 0) foretold.add(line, b);
    });
    const Foretold::Part found = foretold.solve();
    if (std::max(found.part[0], found.part[1]) > kFollowed)
        each([&](std::size_t k, const Foretelling& line, const ReportBlock&) {
            for (int c : {0, 1})
                if (found.part[c] > kFollowed) s.residual[c][k] -= line.dot(found.of_line.col(c));
        });
    return std::max(found.part[0], found.part[1]);
}

Point without_dead_time(Point at)
{
    const auto is_it = [](const Term& t) { return is_dead_time(t.input.law); };
    at.terms.erase(std::remove_if(at.terms.begin(), at.terms.end(), is_it), at.terms.end());
    return at;
}

/// What noise of the currents, sd_A on each axis, makes of a dead time in a block, a mean square of both axes: where a
/// leg's current turns, its loss changes by much within that noise. A few rows in a hundred, which no median sees. Of the
/// rows that a search looks at, drawn once.
double noise_of_dead_time(const TraceSetup& setup, const Point& at, const double (&sd_A)[2])
{
    const Point without = without_dead_time(at);
    if (without.terms.size() == at.terms.size()) return 0.0;
    const std::vector<Log> clean = copies_of(setup.search().plan().pieces);
    std::vector<Log> noisy = clean;
    std::vector<TraceColumns> columns;
    std::mt19937_64 bits{1};
    std::normal_distribution<double> normal;
    for (Log& log : noisy) {
        columns.push_back(trace_columns(log, setup.pole_pairs, setup.i_base_A, setup.span_s, log.dt_s));
        for (std::size_t k = 0; k < log.rows(); ++k)
            log.i_d_A[k] += sd_A[0] * normal(bits), log.i_q_A[k] += sd_A[1] * normal(bits);
    }
    const auto moved = [&](const Point& point) {
        const auto report = [&](const std::vector<Log>& logs) {
            return ElectricalModel(logs, columns, setup.pole_pairs, {}, setup.rotor_held).report(point, 0);
        };
        const std::vector<ReportBlock> a = report(clean), b = report(noisy);
        double square = 0.0;
        for (std::size_t k = 0; k < a.size(); ++k)
            for (int c : {0, 1}) square += std::pow(b[k].residual[c] - a[k].residual[c], 2);
        return a.empty() ? 0.0 : square / static_cast<double>(2 * a.size());
    };
    return std::max(moved(at) - moved(without), 0.0);
}

double moving_floor(const TraceSetup& setup, const Point& at, const Singles& s)
{
    const int channels = setup.full->channels();
    const double count = static_cast<double>(s.speed.size()), speed_noise = high_band(s.speed, s.starts).top,
                 rows = static_cast<double>(block_rows(setup.logs->front()));
    double sum = 0.0, sd_A[2] = {};
    for (int c = 0; c < channels; ++c) {
        const double inertia = channels == 2 ? at.base[1 + c] : at.base[0],
                     drag = channels == 2 ? at.base[0] : at.base[1];
        const double w = channels == 2 ? setup.pole_pairs * setup.pole_pairs * speed_noise * s.flux[c] / count : 0.0;
        // The other axis' current, of about the same noise, comes in by the turning.
        const double across = channels == 2 ? at.base[2 - c] / inertia : 0.0;
        const double damped = std::sqrt(std::pow(drag * s.dt_s / inertia, 2) + across * across * s.turned);
        double variance = channels == 1 && rows >= kShaftRows
                              ? shaft_block_variance(s.residual[c], s.starts, rows, damped)
                              : 0.0;
        if (!(variance > 0.0)) {
            const Apart apart(high_band(s.residual[c], s.starts), w);
            sd_A[c] = std::sqrt(apart.differenced) * s.dt_s / inertia;
            variance = apart.of_block(w, rows, damped);
        }
        sum += variance;
    }
    return std::sqrt(sum / channels + (channels == 2 ? noise_of_dead_time(setup, at, sd_A) : 0.0));
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

/// Of rows that follow one another, by second differences.
double floor_in_time(const std::vector<ReportBlock>& blocks)
{
    double sum = 0.0;
    std::size_t count = 0;
    for (std::size_t k = 2; k < blocks.size(); ++k) {
        if (blocks[k].log != blocks[k - 2].log) continue;
        for (int c = 0; c < 2; ++c) {
            const double y = blocks[k].residual[c] - 2.0 * blocks[k - 1].residual[c] + blocks[k - 2].residual[c];
            sum += y * y / 6.0, ++count;
        }
    }
    return count ? std::sqrt(sum / static_cast<double>(count)) : HUGE_VAL;
}

/// Of rows of like currents and speeds, wherever they stand in time: each against the plane through its nearest. Points
/// that jump leave all of what the model lacks in their order's differences, and next to none here.
double floor_in_the_plane(const std::vector<ReportBlock>& blocks)
{
    constexpr std::size_t kMostRows = 2000;  ///< looked at; of these a mean square is known to 3 %
    std::vector<const ReportBlock*> rows;
    const std::size_t stride = (blocks.size() + kMostRows - 1) / kMostRows;
    for (std::size_t k = 0; k < blocks.size(); k += stride) rows.push_back(&blocks[k]);
    const auto n = static_cast<Eigen::Index>(rows.size());
    Eigen::MatrixXd where(n, 3), left(n, 2);
    for (Eigen::Index k = 0; k < n; ++k) {
        const ReportBlock& b = *rows[static_cast<std::size_t>(k)];
        where.row(k) << at_row(b.log->i_d_A, b.begin), at_row(b.log->i_q_A, b.begin), at_row(b.log->w_m_rad_s, b.begin);
        left.row(k) << b.residual[0], b.residual[1];
    }
    where.rowwise() -= where.colwise().mean().eval();
    Eigen::Index varied = 0;
    for (Eigen::Index c = 0; c < 3; ++c)
        if (const double sd = where.col(c).norm(); sd > 0.0) where.col(varied++) = where.col(c) / sd;
    const Eigen::Index nearest = 2 * varied + 2;
    if (varied == 0 || n <= 2 * nearest) return HUGE_VAL;
    double sum = 0.0;
    std::vector<std::pair<double, Eigen::Index>> far;
    for (Eigen::Index k = 0; k < n; ++k) {
        far.clear();
        for (Eigen::Index j = 0; j < n; ++j)
            if (j != k) far.emplace_back((where.row(j) - where.row(k)).leftCols(varied).squaredNorm(), j);
        std::nth_element(far.begin(), far.begin() + nearest, far.end());
        Eigen::MatrixXd plane(nearest, varied + 1), of(nearest, 2);
        for (Eigen::Index m = 0; m < nearest; ++m) {
            const Eigen::Index j = far[static_cast<std::size_t>(m)].second;
            plane(m, 0) = 1.0, plane.row(m).tail(varied) = (where.row(j) - where.row(k)).leftCols(varied);
            of.row(m) = left.row(j);
        }
        // How much of each neighbour stands in the plane's value at the row.
        const Eigen::VectorXd part = least_squares(plane.transpose(), Eigen::VectorXd::Unit(varied + 1, 0));
        sum += (left.row(k) - part.transpose() * of).squaredNorm() / (1.0 + part.squaredNorm());
    }
    return std::sqrt(sum / static_cast<double>(2 * n));
}

/// The smaller: each holds the noise, and more or less of what the model lacks.
double settled_floor(const TraceSetup& setup, const Point& at)
{
    const std::vector<ReportBlock> blocks = setup.full->report(at, 1);
    const double floor = std::min(floor_in_time(blocks), floor_in_the_plane(blocks));
    return std::isfinite(floor) ? floor : 0.0;
}

}  // namespace

Noise noise_of(const TraceSetup& setup, const Point& at)
{
    const bool moving = setup.regime == Regime::dynamic || setup.regime == Regime::mechanical;
    if (moving) return moving_noise(setup, at);
    const double rows = settled_floor(setup, at);
    const Refined fitted = swept(*setup.full, at);
    return {fitted.ok ? rows * std::sqrt(1.0 + unseen_part(*setup.full, fitted)) : rows, rows, 0.0};
}

std::string doubt_of(const Noise& noise, double rms)
{
    // Thirty times what a right model leaves; of 32 clean blind logs each left 0.86 to 1.11.
    constexpr double kMuch = 0.25, kFarBelow = 0.5;
    // What the fit carries into rows held out hangs on few weights: by chance it is often next to nothing.
    const double floor = noise.of_rows();
    const std::string ask = ": are currents or voltages filtered, held or late?";
    if (rms < kFarBelow * floor || (rms < floor / kStructured && noise.followed > kFollowed))
        return "blocks leave " + figure(rms / floor) +
               " of what the noise of single rows would leave in them, "
               "so that is no noise" +
               ask;
    if ((rms <= kStructured * noise.raw && rms > kStructured * floor) ||
        (rms <= kStructured * floor && noise.followed > kMuch))
        return figure(100.0 * noise.followed) +
               " % of what looks like noise in single rows follows from the rows "
               "before" +
               ask;
    return "";
}

}  // namespace dqw
