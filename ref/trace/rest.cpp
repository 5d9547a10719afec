#include "ref/trace/rest.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <unsupported/Eigen/FFT>

#include "ref/effect/range.hpp"
#include "ref/fit/explain.hpp"
#include "ref/log/median.hpp"

namespace dqw {
namespace {

constexpr double kLeastShare = 0.05;     ///< of the excess; what is told below is chance, (E48)
constexpr std::size_t kLeastSeries = 8;  ///< blocks, beside which a share of one axis would be chance
constexpr std::size_t kRare = 50;        ///< one row of so many is an extreme

/// Part of the variance of y that its means over 24 equally filled bins of x explain beyond chance.
double share_by_bins(const std::vector<double>& x, const std::vector<double>& y, double excess)
{
    // They follow twelve waves; each has enough rows for a mean. (E48)
    constexpr std::size_t kBins = 24, kLeastInBin = 4;
    constexpr double kConstant = 1e-9;  // of its size: x is one number and its rounding
    const std::size_t n = x.size();
    if (n < kLeastInBin * kBins || !(excess > 0.0)) return 0.0;
    std::vector<std::size_t> order(n);
    for (std::size_t k = 0; k < n; ++k) order[k] = k;
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return x[a] < x[b]; });
    if (!(x[order[n - 1 - n / kRare]] - x[order[n / kRare]] >
          kConstant * (std::abs(x[order[n - 1]]) + std::abs(x[order[0]]))))
        return 0.0;
    double mean = 0.0, square = 0.0, between = 0.0;
    for (double v : y) mean += v / static_cast<double>(n);
    for (double v : y) square += (v - mean) * (v - mean) / static_cast<double>(n);
    for (std::size_t b = 0; b < kBins; ++b) {
        const std::size_t begin = b * n / kBins, end = (b + 1) * n / kBins;
        double sum = 0.0;
        for (std::size_t k = begin; k < end; ++k) sum += y[order[k]] - mean;
        between += sum * sum / static_cast<double>(end - begin) / static_cast<double>(n);
    }
    return std::clamp((between - square * kBins / static_cast<double>(n)) / excess, 0.0, 1.0);
}

struct Series {
    std::vector<double> y, t, angle, i_d, i_q, speed, heat, v, sign;
};

Series series_of(const TraceSetup& setup, const std::vector<ReportBlock>& blocks, int axis)
{
    Series s;
    for (const ReportBlock& b : blocks) {
        const Log& log = *b.log;
        const std::size_t k = (b.begin + b.end) / 2, n = static_cast<std::size_t>(b.log - setup.logs->data());
        s.y.push_back(b.residual[axis]);
        if (!log.t_s.empty()) s.t.push_back(log.t_s[k]);
        if (!log.w_m_rad_s.empty()) s.speed.push_back(log.w_m_rad_s[k]);
        if (!log.temp_winding_C.empty()) s.heat.push_back(log.temp_winding_C[k]);
        if (setup.regime == Regime::mechanical) {
            s.angle.push_back(setup.angle[n][k]);
            continue;
        }
        const TraceColumns& c = setup.columns[n];
        s.angle.push_back(std::atan2(c.sin_e[k], c.cos_e[k]));
        s.i_d.push_back(at_row(log.i_d_A, k)), s.i_q.push_back(at_row(log.i_q_A, k));
        s.v.push_back(std::hypot(b.measured[0], b.measured[1]));
        Moment m;
        m.i_d = s.i_d.back(), m.i_q = s.i_q.back(), m.cos_e = c.cos_e[k], m.sin_e = c.sin_e[k];
        Vector2 f[kMostWeights], g[kMostWeights];
        // As good as a step: the least dead time that is tried is half as wide.
        constexpr double kNarrow = 0.01;
        evaluate({Law::dead_time, {kNarrow * setup.i_base_A}}, m, f, g);
        s.sign.push_back(axis == 0 ? f[0].d : f[0].q);
    }
    return s;
}

double amplitude_at(const Series& s, int order)
{
    std::complex<double> sum = 0.0;
    for (std::size_t k = 0; k < s.y.size(); ++k) sum += s.y[k] * std::polar(1.0, -order * s.angle[k]);
    return 2.0 * std::abs(sum) / static_cast<double>(std::max<std::size_t>(s.y.size(), 1));
}

/// |mean of e^(j angle)|: 1 where the angle stands still, near 0 where it goes round.
double amplitude_of_angle(const Series& s)
{
    std::complex<double> sum = 0.0;
    for (double a : s.angle) sum += std::polar(1.0, a);
    return std::abs(sum) / static_cast<double>(std::max<std::size_t>(s.angle.size(), 1));
}

constexpr std::size_t kMostPoints = 65536, kLeastPoints = 32;  ///< of a spectrum: what a plot shows; what has lines

/// Amplitudes of an evenly sampled series, Hann window; at most 2^16 points of it.
void amplitudes(const std::vector<double>& y, double period_s, std::vector<double>& frequency_Hz,
                std::vector<double>& amplitude)
{
    std::size_t n = 1;
    while (2 * n <= y.size() && n < kMostPoints) n *= 2;
    if (n < kLeastPoints) return;
    std::vector<double> x(n);
    double mean = 0.0;
    for (std::size_t k = 0; k < n; ++k) mean += y[k] / static_cast<double>(n);
    for (std::size_t k = 0; k < n; ++k)
        x[k] = (y[k] - mean) * (1.0 - std::cos(2.0 * M_PI * static_cast<double>(k) / static_cast<double>(n)));
    std::vector<std::complex<double>> spectrum;
    Eigen::FFT<double> fft;
    fft.fwd(spectrum, x);
    frequency_Hz.clear(), amplitude.clear();
    for (std::size_t k = 1; k < n / 2; ++k) {
        frequency_Hz.push_back(static_cast<double>(k) / (static_cast<double>(n) * period_s));
        amplitude.push_back(2.0 * std::abs(spectrum[k]) / static_cast<double>(n));
    }
}

/// The longest run of blocks that follow one another.
std::vector<double> longest_run(const std::vector<ReportBlock>& blocks, int axis, double& period_s)
{
    std::vector<double> best, now;
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        if (k > 0 && (blocks[k].log != blocks[k - 1].log || blocks[k].begin != blocks[k - 1].end)) now.clear();
        now.push_back(blocks[k].residual[axis]);
        if (now.size() > best.size())
            best = now, period_s = blocks[k].log->dt_s * static_cast<double>(blocks[k].end - blocks[k].begin);
    }
    return best;
}

/// Settled rows are apart by turns of which nobody counts parts, and means are over turns.
bool has_angle(const TraceSetup& setup)
{
    return setup.regime != Regime::steady || everywhere(*setup.logs, &Log::theta_e_rad) ||
           everywhere(*setup.logs, &Log::theta_m_rad);
}

const char* axis_name(const TraceSetup& setup, int axis)
{
    return setup.regime == Regime::mechanical ? "torque" : axis == 0 ? "d" : "q";
}

void add_line(const TraceSetup& setup, const std::vector<ReportBlock>& blocks, int axis, double excess,
              std::vector<TraceCorrelate>& out)
{
    double period_s = 0.0;
    const std::vector<double> y = longest_run(blocks, axis, period_s);
    std::vector<double> f, a;
    if (setup.regime == Regime::steady || setup.regime == Regime::standstill || !(period_s > 0.0)) return;
    amplitudes(y, period_s, f, a);
    constexpr std::size_t kLeastBins = 16;  // for a median beside the line
    if (a.size() < kLeastBins) return;
    const std::size_t top = static_cast<std::size_t>(std::max_element(a.begin(), a.end()) - a.begin());
    // Hann spreads a line of amplitude A over bins that sum to A^2 (1/4 + 1 + 1/4), and its variance is A^2/2.
    constexpr std::size_t kWide = 2;
    double local = 0.0;
    for (std::size_t k = top >= kWide ? top - kWide : 0; k < std::min(top + kWide + 1, a.size()); ++k)
        local += a[k] * a[k] / 3.0;
    const double level = median(a);
    // Of 2^15 bins of white noise the largest exceeds 5 medians in one of a thousand logs; what is left is not white.
    constexpr double kLine = 8.0;
    if (top > kWide && a[top] > kLine * level)
        out.push_back(
            {"a line at " + figure(f[top]) + " Hz", axis_name(setup, axis), std::clamp(local / excess, 0.0, 1.0)});
}

}  // namespace

double rms_of(const std::vector<ReportBlock>& blocks, int channels)
{
    double sum = 0.0;
    for (const ReportBlock& b : blocks)
        for (int c = 0; c < channels; ++c) sum += b.residual[c] * b.residual[c];
    return blocks.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(blocks.size()) / channels);
}

std::vector<TraceCorrelate> correlates(const TraceSetup& setup, const std::vector<ReportBlock>& blocks, double floor)
{
    std::vector<TraceCorrelate> out;
    for (int axis = 0; axis < setup.full->channels(); ++axis) {
        const Series s = series_of(setup, blocks, axis);
        double square = 0.0;
        for (double y : s.y) square += y * y / static_cast<double>(s.y.size());
        const double excess = square - floor * floor;
        // Below, the RMS is that of noise within a fortieth: there is nothing to share out.
        constexpr double kLeastExcess = 0.05;
        if (!(excess > kLeastExcess * floor * floor) || s.y.size() < kLeastSeries) continue;
        const auto add = [&](const std::string& with, double share) {
            if (share > kLeastShare) out.push_back({with, axis_name(setup, axis), share});
        };
        if (!s.t.empty()) add("time", share_by_bins(s.t, s.y, excess));
        if (!s.speed.empty()) add("speed", share_by_bins(s.speed, s.y, excess));
        if (!s.heat.empty()) add("temperature", share_by_bins(s.heat, s.y, excess));
        if (!s.i_d.empty())
            add("i_d", share_by_bins(s.i_d, s.y, excess)), add("i_q", share_by_bins(s.i_q, s.y, excess)),
                add("voltage", share_by_bins(s.v, s.y, excess));
        if (!s.sign.empty() && has_angle(setup)) {
            double xy = 0.0, xx = 0.0;
            for (std::size_t k = 0; k < s.y.size(); ++k) xy += s.sign[k] * s.y[k], xx += s.sign[k] * s.sign[k];
            if (xx > 0.0)
                add("signs of the phase currents",
                    std::clamp(xy * xy / xx / static_cast<double>(s.y.size()) / excess, 0.0, 1.0));
        }
        // An angle that is evenly everywhere on three eighths of a turn has 0.78, on half a turn 0.64.
        constexpr double kSwept = 0.7;
        const bool swept = has_angle(setup) && amplitude_of_angle(s) < kSwept;
        for (int order : swept ? std::vector<int>{1, 2, 3, 6, 12} : std::vector<int>{}) {
            const double a = amplitude_at(s, order);
            add("angle, order " + std::to_string(order), std::clamp(0.5 * a * a / excess, 0.0, 1.0));
        }
        add_line(setup, blocks, axis, excess, out);
    }
    std::stable_sort(out.begin(), out.end(),
                     [](const TraceCorrelate& a, const TraceCorrelate& b) { return a.share > b.share; });
    return out;
}

std::vector<TraceSpectrum> spectra(const TraceSetup& setup, const std::vector<ReportBlock>& before,
                                   const std::vector<ReportBlock>& after)
{
    std::vector<TraceSpectrum> out;
    for (int axis = 0; axis < setup.full->channels(); ++axis) {
        TraceSpectrum s;
        s.axis = axis_name(setup, axis);
        const Series x = series_of(setup, before, axis), y = series_of(setup, after, axis);
        for (int order = 1; order <= 24; ++order)
            s.order.push_back(order), s.before.push_back(amplitude_at(x, order)),
                s.after.push_back(amplitude_at(y, order));
        if (setup.regime == Regime::dynamic || setup.regime == Regime::mechanical) {
            double period_s = 0.0;
            const std::vector<double> b = longest_run(before, axis, period_s), a = longest_run(after, axis, period_s);
            if (period_s > 0.0)
                amplitudes(b, period_s, s.frequency_Hz, s.before_at),
                    amplitudes(a, period_s, s.frequency_Hz, s.after_at);
        }
        out.push_back(s);
    }
    return out;
}

namespace {

/// Of the currents, from each row to the next.
std::vector<double> moves_of(const Log& log)
{
    std::vector<double> out;
    for (std::size_t k = 1; k < log.rows(); ++k)
        out.push_back(std::abs(log.i_d_A[k] - log.i_d_A[k - 1]) + std::abs(log.i_q_A[k] - log.i_q_A[k - 1]));
    return out;
}

/// How many rows each sample stands where all stand as many, which chance does not do: 1 where they do not. Samples
/// that are the same stand twice as long.
std::size_t stands_each(const std::vector<double>& moves)
{
    constexpr std::size_t kLongest = 50, kLeastMoves = 100;
    // Of random runs half are even at most, a third multiples of three: of a hundred, ninety never.
    constexpr double kNearlyAll = 0.9;
    std::size_t multiples[kLongest + 1] = {}, moved = 0, run = 1;
    for (const double move : moves) {
        if (!(move > 0.0)) {
            ++run;
            continue;
        }
        for (std::size_t n = 2; n <= std::min(run, kLongest); ++n)
            if (run % n == 0) ++multiples[n];
        ++moved, run = 1;
    }
    for (std::size_t n = kLongest; n > 1 && moved >= kLeastMoves; --n)
        if (static_cast<double>(multiples[n]) > kNearlyAll * static_cast<double>(moved)) return n;
    return 1;
}

/// Rows of a log that repeat the currents of the row before to the last digit, and by chance would not.
std::size_t held_rows(const Log& log, const std::vector<double>& moves)
{
    // A hold is short, and what the current did meanwhile shows at its end.
    constexpr std::size_t kLongestHeld = 10;
    constexpr double kCatchesUp = 0.3;
    // Steps of the converter in a usual move. Where neither axis turns, chance repeats both in one of 1100 rows at 20,
    // in one of 2000 at 27.
    constexpr double kFine = 20.0;
    const std::vector<double>& angle = log.theta_e_rad.empty() ? log.theta_m_rad : log.theta_e_rad;
    // A frame that turns moves both axes by less than a converter's step: that is seen where the angle stands.
    const auto stands = [&](std::size_t row) { return !angle.empty() && angle[row] == angle[row - 1]; };
    std::vector<double> moved;
    double least[2] = {HUGE_VAL, HUGE_VAL};
    for (std::size_t k = 1; k < log.rows(); ++k) {
        const double move = moves[k - 1];
        if (!(move > 0.0)) continue;
        moved.push_back(move);
        double& of_kind = least[stands(k) ? 1 : 0];
        of_kind = std::min(of_kind, move);
    }
    const double usual = median(moved);
    // On a coarse converter a repeated value is nothing; on a fine one it is a held sample, unless the current rests.
    if (2 * moved.size() < moves.size()) return 0;
    std::size_t held = 0, run = 0, fine = 0;
    for (std::size_t k = 1; k < log.rows(); ++k) {
        if (moves[k - 1] == 0.0) {
            ++run;
            if (usual > kFine * least[stands(k) ? 1 : 0]) ++fine;
            continue;
        }
        if (run <= kLongestHeld && moves[k - 1] > kCatchesUp * usual) held += fine;
        run = fine = 0;
    }
    return held;
}

}  // namespace

std::string record_fault(const std::vector<Log>& logs)
{
    // A few are no fault. (E48)
    constexpr std::size_t kFewHeld = 5, kRareHeld = 2000;
    std::size_t held = 0, rows = 0;
    for (const Log& log : logs) {
        if (log.regime != Regime::dynamic) return "";
        const std::vector<double> moves = moves_of(log);
        if (const std::size_t each = stands_each(moves); each > 1)
            return (logs.size() > 1 ? log.path + ": " : "") + "the currents of each sample stand in " +
                   std::to_string(each) + " rows: held samples";
        rows += log.rows(), held += held_rows(log, moves);
    }
    if (held > kFewHeld && held > rows / kRareHeld)
        return std::to_string(held) +
               " rows repeat the currents of the row before to the last digit: held or dropped samples";
    return "";
}

}  // namespace dqw
