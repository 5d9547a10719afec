#include "ref/log/polled.hpp"

#include <algorithm>
#include <cmath>

namespace dqw {
namespace {

constexpr double kBroken = 1.5;  // of the usual step: a row is missing
constexpr double kMostRepeated = 0.05;
constexpr double kLimited = 0.88;  // of the largest voltage vector

/// The row stands unbroken behind the one before it.
std::vector<char> follows(const Log& log)
{
    std::vector<char> ok(log.rows(), 0);
    const auto same = [](const std::vector<double>& x, std::size_t k) { return x[k] == x[k - 1]; };
    std::vector<std::size_t> repeated;
    for (std::size_t k = 1; k < ok.size(); ++k) {
        ok[k] = log.t_s[k] - log.t_s[k - 1] < kBroken * log.dt_s;
        if (same(log.v_d_V, k) && same(log.v_q_V, k) && same(log.i_d_A, k) && same(log.i_q_A, k)) repeated.push_back(k);
    }
    // More of them are a machine so settled that its means do not move.
    if (static_cast<double>(repeated.size()) < kMostRepeated * static_cast<double>(ok.size()))
        for (const std::size_t k : repeated) ok[k] = 0;
    return ok;
}

bool limited(const Log& log, std::size_t k)
{
    return !log.v_dc_V.empty() && std::hypot(log.v_d_V[k], log.v_q_V[k]) > kLimited * log.v_dc_V[k] / std::sqrt(3.0);
}

/// What the current gains within row k's interval, from the means around it.
double gain(const std::vector<double>& i, std::size_t k)
{
    return (8.0 * (i[k + 1] - i[k - 1]) - i[k + 2] + i[k - 2]) / 12.0;
}

double bend(const std::vector<double>& x, std::size_t k) { return x[k + 1] - 2.0 * x[k] + x[k - 1]; }

PolledRow row_at(const Log& log, std::size_t k, std::size_t s)
{
    const auto &w = log.w_m_rad_s, &i_d = log.i_d_A, &i_q = log.i_q_A;
    PolledRow r;
    r.row = k;
    r.v_V = {log.v_d_V[k], log.v_q_V[k]}, r.i_A = {i_d[k], i_q[k]};
    r.i_abs_A = std::hypot(i_d[k], i_q[k]);
    r.w_rad_s = (13.0 * (w[s] + w[s - 1]) - w[s - 2] - w[s + 1]) / 24.0;
    r.dw_rad_s2 = (w[s + 1] - w[s - 2]) / (3.0 * log.dt_s);
    const double dw = w[s] - w[s - 1], dw_next = w[s + 1] - w[s], dw_last = w[s - 1] - w[s - 2];
    for (std::size_t a = 0; a < 2; ++a) {
        const double di = gain(a == 0 ? i_d : i_q, k);
        r.di_A_s[a] = di / log.dt_s;
        r.wi_A_rad_s[a] = r.w_rad_s * r.i_A[a] + dw * di / 12.0;
    }
    r.dw_unseen_rad_s = std::hypot(0.15 * (dw - 0.5 * (dw_next + dw_last)), (dw_next - dw_last) / 48.0);
    double bent = 0.0;
    for (std::size_t j = k - 1; j <= k + 1; ++j) bent = std::max(bent, std::hypot(bend(i_d, j), bend(i_q, j)));
    r.di_unseen_A_s = 0.2 * bent / log.dt_s;
    r.wi_unseen_A_rad_s = 0.04 * std::abs(dw) * std::hypot(i_d[k + 1] - i_d[k - 1], i_q[k + 1] - i_q[k - 1]);
    return r;
}

/// A settled point is its own mean.
std::vector<PolledRow> points(const Log& log)
{
    std::vector<PolledRow> out;
    for (std::size_t k = 0; k < log.rows(); ++k) {
        if (limited(log, k)) continue;
        PolledRow r{};
        r.row = k;
        r.v_V = {log.v_d_V[k], log.v_q_V[k]}, r.i_A = {log.i_d_A[k], log.i_q_A[k]};
        r.i_abs_A = std::hypot(r.i_A[0], r.i_A[1]), r.w_rad_s = log.w_m_rad_s[k];
        r.wi_A_rad_s = {r.w_rad_s * r.i_A[0], r.w_rad_s * r.i_A[1]};
        out.push_back(r);
    }
    return out;
}

/// What a log lacks as zero.
Log filled(Log log)
{
    for (const auto column : {&Log::v_d_V, &Log::i_d_A})
        if ((log.*column).empty()) (log.*column).assign(log.rows(), 0.0);
    return log;
}

}  // namespace

std::vector<PolledRow> polled_rows(const Log& log, int lag)
{
    if (log.v_d_V.empty() || log.i_d_A.empty()) {
        std::vector<PolledRow> out = polled_rows(filled(log), lag);
        if (log.v_d_V.empty())
            for (PolledRow& r : out) r.voltage = log.v_q_is_size ? PolledVoltage::size : PolledVoltage::q;
        return out;
    }
    if (log.regime == Regime::steady) return points(log);
    std::vector<PolledRow> out;
    const std::vector<char> ok = follows(log);
    const auto unbroken = [&](std::size_t from, std::size_t to) {
        return std::all_of(ok.begin() + static_cast<std::ptrdiff_t>(from), ok.begin() + static_cast<std::ptrdiff_t>(to),
                           [](char c) { return c != 0; });
    };
    const std::size_t n = log.rows(), late = lag > 0 ? static_cast<std::size_t>(lag) : 0,
                      early = lag < 0 ? static_cast<std::size_t>(-lag) : 0;
    for (std::size_t k = 2 + late; k + 2 + early < n; ++k) {
        const std::size_t s = k - late + early;
        // A queue counts rows, so it holds where stamps do.
        if (unbroken(k - 1, k + 3) && unbroken(s - 1, s + 2) && !limited(log, k)) out.push_back(row_at(log, k, s));
    }
    return out;
}

}  // namespace dqw
