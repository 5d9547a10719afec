#include "ref/effect/columns.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "ref/effect/range.hpp"
#include "ref/log/wanted.hpp"

namespace dqw {
namespace {

/// Slope of the electrical speed over some rows each way, by least squares: of single rows it is the sensor's noise.
std::vector<double> speed_slope(const Log& log, double pole_pairs)
{
    constexpr std::size_t kEachWay = 10;
    std::vector<double> slope(log.rows());
    for (std::size_t s = 0; s < log.segments.size(); ++s) {
        const std::size_t begin = log.segments[s], end = s + 1 < log.segments.size() ? log.segments[s + 1] : log.rows();
        for (std::size_t k = begin; k < end; ++k) {
            ask_at(k);
            const std::size_t from = k - std::min(kEachWay, k - begin), to = std::min(k + kEachWay + 1, end);
            double n = 0.0, t = 0.0, w = 0.0, tt = 0.0, tw = 0.0;
            for (std::size_t j = from; j < to; ++j) {
                const double x = log.t_s[j] - log.t_s[k];
                n += 1.0, t += x, w += log.w_m_rad_s[j], tt += x * x, tw += x * log.w_m_rad_s[j];
            }
            const double spread = n * tt - t * t;
            if (spread > 0.0) slope[k] = pole_pairs * (n * tw - t * w) / spread;
        }
    }
    return slope;
}

/// A temperature over T_0. Of rows in time, whose magnet's flux is differenced, the mean over a part of the log in which
/// it moves evenly: a thermometer's noise, from row to row, would be volts. (E174)
std::vector<double> above_reference(const Log& log, const std::vector<double>& temperature_C)
{
    constexpr std::size_t kPart = 128;
    std::vector<double> above(temperature_C.size()), sum(above.size() + 1);
    for (std::size_t k = 0; k < above.size(); ++k)
        above[k] = temperature_C[k] - kReferenceTemperature_C, sum[k + 1] = sum[k] + above[k];
    if (above.empty() || log.regime != Regime::dynamic || !std::isfinite(sum.back())) return above;
    for (std::size_t s = 0; s < log.segments.size(); ++s) {
        const std::size_t begin = log.segments[s],
                          end = s + 1 < log.segments.size() ? log.segments[s + 1] : above.size();
        for (std::size_t k = begin; k < end; ++k) {
            const std::size_t each = std::min({(end - begin) / kPart, k - begin, end - 1 - k});
            above[k] = (sum[k + each + 1] - sum[k - each]) / static_cast<double>(2 * each + 1);
        }
    }
    return above;
}

/// Angle of the shaft: its own column, or the electrical one, whose turns are counted; empty where rows are missing in
/// between.
std::vector<double> shaft_turns(const Log& log, const std::vector<double>& electrical, double pole_pairs)
{
    if (!log.theta_m_rad.empty()) return log.theta_m_rad;
    if (!(pole_pairs > 0.0) || log.t_s.empty() || log.segments.size() > 1) return {};
    std::vector<double> angle(electrical.size());
    for (std::size_t k = 1; k < angle.size(); ++k)
        angle[k] = angle[k - 1] + std::remainder(electrical[k] - electrical[k - 1], 2.0 * M_PI) / pole_pairs;
    return angle;
}

/// The link's capacitor gives what its source does not at once. `period`: the log's, over those that kLinkTimes
/// counts.
std::vector<std::vector<float>> source_powers(const Log& log, double period)
{
    const std::size_t rows = log.rows();
    std::vector<double> taken_W(rows);
    for (std::size_t k = 0; k < rows; ++k) {
        const std::size_t next = std::min(k + 1, rows - 1);
        taken_W[k] = 0.75 * (log.v_d_V[k] * (log.i_d_A[k] + log.i_d_A[next]) +
                             log.v_q_V[k] * (log.i_q_A[k] + log.i_q_A[next]));
    }
    std::vector<std::vector<float>> out;
    for (const double periods : kLinkTimes) {
        const double part = 1.0 - std::exp(-period / periods);
        std::vector<float> given_W(rows);
        double now_W = 0.0;
        for (std::size_t k = 0, segment = 0; k < rows; ++k) {
            ask_at(k);
            // What it was before a gap in time is not known.
            if (segment < log.segments.size() && k == log.segments[segment]) now_W = taken_W[k], ++segment;
            given_W[k] = static_cast<float>(now_W);
            now_W += part * (taken_W[k] - now_W);
        }
        out.push_back(std::move(given_W));
    }
    return out;
}

}  // namespace

TraceColumns trace_columns(const Log& log, double pole_pairs, double i_base_A, double span_s, double period_s)
{
    TraceColumns c;
    const std::size_t rows = log.rows();
    c.cos_e.resize(rows), c.sin_e.resize(rows);
    const double p = pole_pairs > 0.0 ? pole_pairs : 1.0;
    double integrated = 0.0;
    std::vector<double> electrical(rows);
    for (std::size_t k = 0; k < rows; ++k) {
        ask_at(k);
        if (k > 0 && !log.t_s.empty() && !log.w_m_rad_s.empty())
            integrated += p * 0.5 * (log.w_m_rad_s[k] + log.w_m_rad_s[k - 1]) * (log.t_s[k] - log.t_s[k - 1]);
        double angle = integrated;
        if (!log.theta_m_rad.empty()) angle = p * log.theta_m_rad[k];
        if (!log.theta_e_rad.empty()) angle = log.theta_e_rad[k];
        c.cos_e[k] = std::cos(angle), c.sin_e[k] = std::sin(angle), electrical[k] = angle;
    }
    for (double angle : shaft_turns(log, electrical, pole_pairs))
        c.cos_m.push_back(std::cos(angle)), c.sin_m.push_back(std::sin(angle));
    if (!log.t_s.empty() && !log.w_m_rad_s.empty()) c.w_dot = speed_slope(log, p);
    c.winding_K = above_reference(log, log.temp_winding_C), c.magnet_K = above_reference(log, log.temp_magnet_C);
    const auto square = [&](std::size_t k) {
        return (std::pow(at_row(log.i_d_A, k), 2) + std::pow(at_row(log.i_q_A, k), 2)) / (i_base_A * i_base_A);
    };
    const bool settled_without_time = log.t_s.empty() && log.regime == Regime::steady;
    const auto warm_in = [&](const std::vector<std::size_t>& order) {
        for (const double memory : kOwnHeatRows) {
            const double kept = memory > 0.0 ? std::exp(-1.0 / memory) : 0.0;
            std::vector<double> h(rows);
            double now = order.empty() ? 0.0 : square(order.front());
            for (const std::size_t k : order) h[k] = now = kept * now + (1.0 - kept) * square(k);
            c.own_heat.push_back(std::move(h));
        }
    };
    if (settled_without_time) {
        std::vector<std::size_t> order(rows);
        std::iota(order.begin(), order.end(), std::size_t{0});
        warm_in(order);
        warm_in(rows_across(log, i_base_A));
    }
    if (log.t_s.empty() || !(span_s > 0.0)) return c;
    if (log.regime == Regime::dynamic) c.source_W = source_powers(log, period_s > 0.0 ? log.dt_s / period_s : 1.0);
    for (double part : kHeatTimes) {
        std::vector<float> h(rows);
        const double tau = part * span_s;
        double now = 0.0;
        for (std::size_t k = 1; k < rows; ++k) {
            ask_at(k);
            const double z = (log.t_s[k] - log.t_s[k - 1]) / tau, kept = std::exp(-z);
            now = kept * now + (1.0 - kept) * square(k - 1);
            h[k] = static_cast<float>(now);
        }
        c.heat.push_back(std::move(h));
    }
    for (double t : log.t_s) c.part.push_back((t - log.t_s.front()) / span_s);
    return c;
}

std::vector<std::size_t> rows_across(const Log& log, double i_base_A)
{
    constexpr double kSame = 0.01;  // of the largest current, as of one operating point
    constexpr std::size_t kLeast = 3;
    const std::size_t rows = log.rows();
    const auto same = [&](const std::vector<double>& column, std::size_t a, std::size_t b) {
        return std::abs(at_row(column, a) - at_row(column, b)) <= kSame * i_base_A;
    };
    const auto speeds = std::minmax_element(log.w_m_rad_s.begin(), log.w_m_rad_s.end());
    const bool one_speed = rows > 0 && *speeds.second - *speeds.first <=
                                           kSame * std::max(std::abs(*speeds.first), std::abs(*speeds.second));
    for (const bool d_stays : {true, false}) {
        const std::vector<double>&stays = d_stays ? log.i_d_A : log.i_q_A, &runs = d_stays ? log.i_q_A : log.i_d_A;
        std::size_t each = 1;
        while (each < rows && same(stays, each, 0) && !same(runs, each, each - 1)) ++each;
        bool grid = each >= kLeast && each < rows && rows % each == 0 && rows / each >= kLeast && one_speed;
        for (std::size_t k = each; grid && k < rows; ++k)
            grid = same(runs, k, k % each) && (k % each == 0 ? !same(stays, k, k - 1) : same(stays, k, k - 1));
        if (!grid) continue;
        std::vector<std::size_t> out;
        for (std::size_t n = 0; n < each; ++n)
            for (std::size_t k = n; k < rows; k += each) out.push_back(k);
        return out;
    }
    return {};
}

double state_at(const TraceColumns& columns, const Input& input, std::size_t k)
{
    if (input.law == Law::voltage_scale)
        return input.heat > 0 ? columns.source_W[static_cast<std::size_t>(input.heat - 1)][k] : 0.0;
    // The magnet follows the winding where it has no thermometer of its own.
    if (input.heat < 0) return columns.winding_K[k];
    if (input.heat >= kOwnHeat) return columns.own_heat[static_cast<std::size_t>(input.heat - kOwnHeat)][k];
    if (by_time(input)) return -std::expm1(-columns.part[k] / kHeatTimes[input.heat - kHeatsOfAKind - 1]);
    if (input.heat > 0) return columns.heat[static_cast<std::size_t>(input.heat - 1)][k];
    if (input.law == Law::winding_temperature) return columns.winding_K[k];
    if (input.law == Law::magnet_temperature) return columns.magnet_K[k];
    return 0.0;
}

}  // namespace dqw
