#include "ref/trace/firmware_filter.hpp"

#include <algorithm>
#include <cmath>
#include <complex>

#include "ref/trace/sampled_instant.hpp"
#include "ref/trace/setup.hpp"

namespace dqw {
namespace {

/// A fit beside a filter of so many rows.
struct Beside {
    Refined fit;
    double late = 0.0, rows = 0.0;  ///< rows of the filter; rows judged
    double nats = -HUGE_VAL;
    std::vector<double> of_block;  ///< its nats
    double each() const { return nats / rows; }
};

/// `gains`: whether others than that of the start are tried.
Beside beside(const std::vector<Log>& logs, double pole_pairs, const Point& start, bool stator, double late, int passes,
              bool gains)
{
    Beside out;
    out.late = late;
    const std::vector<Log> before = before_filter(logs, pole_pairs, {late, 0.0, stator});
    const std::unique_ptr<TraceSetup> setup = trace_setup(before, {}, Variant::usual, pole_pairs);
    const Model& model = setup->search();
    out.fit = gains ? refine_gains(model, start, passes) : refine(model, start, passes);
    const Left& left = out.fit.left;
    for (const double r : left.rows) out.rows += r;
    if (!out.fit.ok || !(out.rows > 0.0)) return out;
    const double n = out.rows;
    // By so much less the currents as logged scatter.
    const double by_row = 2.0 * std::log1p(late);
    out.of_block.assign(left.rows.size(), 0.0);
    out.nats = 0.0;
    for (const auto& axis : left.of) {
        double square = 0.0;
        for (const double x : axis) square += x;
        const double mean = square / n;
        out.nats -= 0.5 * n * std::log(mean);
        for (std::size_t b = 0; b < axis.size(); ++b)
            out.of_block[b] -= 0.5 * (axis[b] / mean + left.rows[b] * std::log(mean));
    }
    out.nats += n * by_row;
    for (std::size_t b = 0; b < left.rows.size(); ++b) out.of_block[b] += left.rows[b] * by_row;
    return out;
}

std::optional<FilterFit> fit_axes(const std::vector<Log>& logs, double pole_pairs, const Point& start, bool stator,
                                  double rows)
{
    constexpr int kPasses = 12;
    const Beside first = beside(logs, pole_pairs, start, stator, rows, kPasses, true);
    if (!first.fit.ok) return {};
    const auto at = [&](double n, bool gains = false) {
        return beside(logs, pole_pairs, first.fit.point, stator, n, kPasses, gains);
    };
    // Readings are a root of two apart. By golden section, to where a parabola does the rest: some hundredths, or less
    // where hardly any noise makes the likelihood steep, of another gain on either side.
    constexpr double kGolden = 0.6180339887, kReach = 1.6, kClose = 1.06, kClosest = 1.0001, kSteep = 20.0;
    double low = rows / kReach, high = rows * kReach, of_low = -HUGE_VAL, of_high = -HUGE_VAL;
    const auto between = [&](double part) { return low * std::pow(high / low, part); };
    Beside a = at(between(1.0 - kGolden)), b = at(between(kGolden));
    const auto steep = [&] { return std::max(a.nats, b.nats) - std::min(of_low, of_high) > kSteep; };
    while (high / low > kClose || (steep() && high / low > kClosest)) {
        if (a.nats > b.nats)
            high = b.late, of_high = b.nats, b = std::move(a), a = at(between(1.0 - kGolden));
        else
            low = a.late, of_low = a.nats, a = std::move(b), b = at(between(kGolden));
    }
    FilterFit out;
    out.filter.stator = stator;
    // A parabola; its width as the blocks' slopes scatter.
    const double n = 0.5 * (low + high), h = 0.4 * (high - low);
    const Beside middle = at(n, true), less = at(n - h, true), more = at(n + h, true);
    if (!middle.fit.ok || !less.fit.ok || !more.fit.ok) return {};
    const double slope = (more.nats - less.nats) / (2.0 * h),
                 bend = (2.0 * middle.nats - less.nats - more.nats) / (h * h);
    if (!(bend > 0.0)) return {};
    // A vertex outside is of no parabola.
    if (!(std::abs(slope / bend) < high - low)) return {};
    out.filter.rows = n + slope / bend;
    double square = 0.0;
    for (std::size_t k = 0; k < middle.of_block.size(); ++k) {
        const double of_block = (more.of_block[k] - less.of_block[k]) / (2.0 * h);
        square += of_block * of_block;
    }
    // Noise that follows itself from row to row by so much, before the filter, moves the likelihood's slope.
    constexpr double kColour = 0.02;
    out.filter.sd = std::hypot(std::sqrt(square), kColour * 2.0 * middle.rows / ((1.0 + n) * (1.0 + n))) / bend;
    out.nats_each = middle.each(), out.rows = middle.rows, out.base = middle.fit.point.base;
    out.moves = (more.fit.point.base - less.fit.point.base).cwiseAbs() * (out.filter.sd / (2.0 * h));
    out.frames = Eigen::VectorXd::Zero(out.base.size());
    return out;
}

/// The fit with the instant of a sampling that makes it likeliest, of a microsecond at most, which the filter's rows
/// would take; nothing where none is likelier.
std::optional<Point> with_sampling(const std::vector<Log>& logs, double pole_pairs, const Point& start,
                                   const FilterFit& filter)
{
    constexpr int kPasses = 12;
    const std::string name = name_of(Law::sample_shift);
    const auto shifts = [](const Term& t) { return t.input.law == Law::sample_shift; };
    if (std::any_of(start.terms.begin(), start.terms.end(), shifts)) return {};
    Point at = start;
    at.base = filter.base;
    const std::vector<Log> before = before_filter(logs, pole_pairs, filter.filter);
    const std::unique_ptr<TraceSetup> setup = trace_setup(before, {name}, Variant::usual, pole_pairs);
    const Model& model = setup->search();
    const Refined without = refine_gains(model, at, kPasses);
    double most = without.ok ? without.left.seen + without.left.heldout + kLeastNats : HUGE_VAL;
    std::optional<Point> best;
    for (const Candidate& c : setup->candidates) {
        if (c.inputs.size() != 1 || c.inputs.front().law != Law::sample_shift) continue;
        Point with = without.point;
        with.terms.push_back({c.inputs.front(), {}});
        const Refined r = refine(model, with, kPasses);
        if (!r.ok || !(r.left.seen + r.left.heldout > most) || !may_be_sampling(r.point, name)) continue;
        most = r.left.seen + r.left.heldout, best = r.point;
    }
    return best;
}

}  // namespace

std::vector<Log> before_filter(const std::vector<Log>& logs, double pole_pairs, const FirmwareFilter& filter)
{
    using Complex = std::complex<double>;
    std::vector<Log> out = logs;
    for (std::size_t l = 0; l < logs.size(); ++l) {
        const Log& log = logs[l];
        for (std::size_t s = 0; s < log.segments.size(); ++s) {
            const std::size_t begin = log.segments[s],
                              end = s + 1 < log.segments.size() ? log.segments[s + 1] : log.rows();
            for (std::size_t k = begin; k < end && end - begin > 1; ++k) {
                const std::size_t to = std::max(k, begin + 1), from = to - 1;
                const Complex now(log.i_d_A[to], log.i_q_A[to]), last(log.i_d_A[from], log.i_q_A[from]);
                const double w_e = 0.5 * pole_pairs * (log.w_m_rad_s[from] + log.w_m_rad_s[to]);
                const Complex late = now - (filter.stator ? last * std::polar(1.0, -w_e * log.dt_s) : last);
                out[l].i_d_A[k] += filter.rows * late.real(), out[l].i_q_A[k] += filter.rows * late.imag();
            }
        }
    }
    return out;
}

double nats_each_beside(const std::vector<Log>& logs, double pole_pairs, const Point& start,
                        const FirmwareFilter& filter)
{
    constexpr int kFew = 4;
    const Beside out = beside(logs, pole_pairs, start, filter.stator, filter.rows, kFew, true);
    return out.fit.ok ? out.each() : -HUGE_VAL;
}

std::optional<FilterFit> fit_filter(const std::vector<Log>& logs, double pole_pairs, const Point& start, double rows,
                                    bool sampling)
{
    std::optional<FilterFit> best = fit_axes(logs, pole_pairs, start, false, rows),
                             other = fit_axes(logs, pole_pairs, start, true, rows);
    if (!best || (other && other->nats_each > best->nats_each)) std::swap(best, other);
    if (!best) return {};
    if (other && (best->nats_each - other->nats_each) * best->rows < kLeastNats) {
        best->filter.sd = std::hypot(best->filter.sd, best->filter.rows - other->filter.rows);
        best->frames = (best->base - other->base).cwiseAbs();
        return best;
    }
    const std::optional<Point> sampled = sampling ? with_sampling(logs, pole_pairs, start, *best) : std::nullopt;
    if (!sampled) return best;
    const FirmwareFilter& near = best->filter;
    std::optional<FilterFit> anew = fit_axes(logs, pole_pairs, *sampled, near.stator, near.rows);
    return anew && anew->nats_each > best->nats_each ? anew : best;
}

}  // namespace dqw
