#include "ref/fit/polled_logs.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "ref/fit/assess.hpp"

namespace dqw {
namespace {

constexpr std::size_t kLeastRows = 12;
constexpr int kEarliest = -2, kLatest = 10;  // rows that currents and voltages may come after the speed
constexpr double kClearlyLate = 0.8;         // of the residual with no lag
constexpr double kClearlyTurned = 0.8;       // of the squares held out
constexpr double kLeastCurrent = 0.15;       // of the 95th percentile: below, dead time clamps
constexpr double kInverter = 0.01;  // of the link: what dead time and drops are, where the log does not show more
constexpr double kAlong = 0.05, kAcross = 0.2;  // of it: what is not constant along the current
constexpr double kSwing = 0.4;
constexpr double kUnseen = 0.3;  // of the current: an i_d that is not in the log

double quantile(std::vector<double> x, double part)
{
    if (x.empty()) return 0.0;
    const auto at = x.begin() + static_cast<std::ptrdiff_t>(part * static_cast<double>(x.size() - 1));
    std::nth_element(x.begin(), at, x.end());
    return *at;
}

/// (E153): what an instant speed is off by, from its third differences.
double speed_noise(const Log& log)
{
    if (log.regime == Regime::steady) return 0.0;
    const auto& w = log.w_m_rad_s;
    std::vector<double> squares;
    for (std::size_t k = 3; k < w.size(); ++k)
        squares.push_back(std::pow(w[k] - 3.0 * (w[k - 1] - w[k - 2]) - w[k - 3], 2));
    // Its square is 20 times that of one, and the median of a chi-square of one 0.455.
    return std::sqrt(quantile(squares, 0.5) / 9.1);
}

std::vector<PolledRow> electrical(std::vector<PolledRow> rows, double pole_pairs)
{
    for (PolledRow& r : rows) {
        r.w_rad_s *= pole_pairs, r.dw_unseen_rad_s *= pole_pairs, r.wi_unseen_A_rad_s *= pole_pairs;
        r.dw_rad_s2 *= pole_pairs;
        for (double& wi : r.wi_A_rad_s) wi *= pole_pairs;
    }
    return rows;
}

struct Told {
    PolledForm form;
    PolledSolution solution;
};

/// The fullest form that the rows can tell, and its weights.
Told told_by(const std::vector<PolledRow>& rows, double noise_rad_s, PolledDeviations deviations)
{
    Told t;
    PolledForm& form = t.form;
    form.psi = std::any_of(rows.begin(), rows.end(), [](const PolledRow& r) { return r.w_rad_s != 0.0; });
    form.late = std::any_of(rows.begin(), rows.end(), [](const PolledRow& r) { return r.dw_rad_s2 != 0.0; });
    t.solution = solve_polled(rows, form, noise_rad_s);
    const auto again = [&] { t.solution = solve_polled(rows, form, noise_rad_s, deviations); };
    if (!tells(t.solution, kPolledLd)) form.one_L = true, again();
    if (!t.solution.ok) form.late = false, again();
    if (!t.solution.ok) form.V = false, again();
    // Without v_d only what i_q gains in a row shows L.
    if (!t.solution.ok && equations_a_row(rows) < 2.0) form.Ld = form.Lq = false, again();
    return t;
}

double rms(const PolledSolution& s)
{
    double sum = 0.0;
    for (const auto& e : s.e_V) sum += e[0] * e[0] + e[1] * e[1];
    return std::sqrt(sum / std::max(1.0, 2.0 * static_cast<double>(s.e_V.size())));
}

/// (E154): rows by which currents and voltages come after the speed, where that is plain.
int lag_of(const Log& log, double pole_pairs, double noise_rad_s)
{
    if (log.regime == Regime::steady) return 0;
    const auto left = [&](int lag) {
        const auto rows = electrical(polled_rows(log, lag), pole_pairs);
        if (rows.size() < kLeastRows) return HUGE_VAL;
        const PolledSolution s = told_by(rows, noise_rad_s, PolledDeviations::left_out).solution;
        return s.ok ? rms(s) : HUGE_VAL;
    };
    const double none = left(0);
    int best = 0;
    double least = kClearlyLate * none;
    for (int lag = kEarliest; lag <= kLatest; ++lag)
        if (const double now = lag == 0 ? HUGE_VAL : left(lag); now < least) best = lag, least = now;
    return best;
}

/// (E152): an inverter's loss is not quite constant, nor quite along the current.
void allow_for_inverter(const std::vector<Log>& logs, PolledLogs& p)
{
    double i2 = 0.0, wobble2 = 0.0, w2 = 0.0, wi2[2] = {}, shares = 0.0;
    std::vector<double> link;
    for (const Log& log : logs) link.insert(link.end(), log.v_dc_V.begin(), log.v_dc_V.end());
    const bool told = !link.empty();
    for (std::size_t k = 0; k < p.rows.size(); ++k) {
        const PolledRow& r = p.rows[k];
        const double share = p.solution.share[k];
        wobble2 += share * std::pow(r.di_unseen_A_s * logs[p.log[k]].dt_s, 2);
        i2 += share * r.i_abs_A * r.i_abs_A, w2 += share * r.w_rad_s * r.w_rad_s, shares += share;
        for (std::size_t a = 0; a < 2; ++a) wi2[a] += share * r.wi_A_rad_s[a] * r.wi_A_rad_s[a];
        if (!told) link.push_back(std::sqrt(3.0) * std::hypot(r.v_V[0], r.v_V[1]));
    }
    p.sd_of_rows = p.solution.sd;
    const double volts = p.inverter_V = std::max(kInverter * quantile(link, told ? 0.5 : 1.0),
                                                 std::abs(p.solution.x[kPolledV]));
    const auto widen = [&](int weight, double by_V, double square) {
        double& sd = p.solution.sd[weight];
        if (sd > 0.0 && square > 0.0) sd = std::hypot(sd, by_V * std::sqrt(shares / square));
    };
    // Where the current swings within rows, its direction's mean is not the mean's direction.
    const double swing = kSwing * std::sqrt(wobble2 / std::max(i2, 1e-300));
    widen(kPolledR, (kAlong + swing) * volts, i2), widen(kPolledPsi, kAlong * volts, w2);
    widen(kPolledLd, kAcross * volts, wi2[0]), widen(kPolledLq, kAcross * volts, wi2[1]);
    // An i_d that is not in the log is not zero where a controller weakens the field, or its angle is off.
    const bool unseen = std::any_of(logs.begin(), logs.end(), [](const Log& log) { return log.i_d_A.empty(); });
    double& sd = p.solution.sd[kPolledPsi];
    if (unseen && sd > 0.0)
        sd = std::hypot(sd, kUnseen * std::hypot(p.solution.x[kPolledLq], p.solution.sd[kPolledLq]) *
                                std::sqrt(i2 / std::max(shares, 1e-300)));
}

/// Where dead time clamps.
void leave_out_small(PolledLogs& p)
{
    std::size_t kept = 0;
    for (std::size_t k = 0; k < p.rows.size(); ++k)
        if (p.rows[k].i_abs_A >= p.least_A) p.rows[kept] = p.rows[k], p.log[kept] = p.log[k], ++kept;
    p.rows.resize(kept), p.log.resize(kept);
}

}  // namespace

bool tells(const PolledSolution& s, int weight)
{
    return s.ok && s.sd[weight] < assessing::kUncertain * std::abs(s.x[weight]);
}

PolledLogs solve_logs(const std::vector<Log>& logs, double pole_pairs)
{
    PolledLogs p;
    std::size_t all = 0;
    for (std::size_t l = 0; l < logs.size(); ++l) {
        const double noise = pole_pairs * speed_noise(logs[l]);
        p.lag.push_back(lag_of(logs[l], pole_pairs, noise));
        const auto rows = electrical(polled_rows(logs[l], p.lag.back()), pole_pairs);
        p.rows.insert(p.rows.end(), rows.begin(), rows.end());
        p.log.insert(p.log.end(), rows.size(), l);
        p.noise_rad_s = std::max(p.noise_rad_s, noise), all += logs[l].rows();
    }
    std::vector<double> sizes;
    for (const PolledRow& r : p.rows) sizes.push_back(r.i_abs_A);
    p.least_A = kLeastCurrent * quantile(sizes, 0.95);
    leave_out_small(p);
    const std::size_t kept = p.rows.size();
    if (kept < kLeastRows)
        throw std::invalid_argument(logs.front().path + ": of " + std::to_string(all) + " rows " +
                                    std::to_string(kept) +
                                    " have current and two unbroken neighbours on either side; a fit of polled rows "
                                    "needs at least " +
                                    std::to_string(kLeastRows));
    const Told told = told_by(p.rows, p.noise_rad_s, PolledDeviations::found);
    p.form = told.form, p.solution = told.solution;
    PolledForm turned = p.form;
    turned.tau = true;
    const PolledSolution with = solve_polled(p.rows, turned, p.noise_rad_s);
    const auto sum = [](const std::vector<double>& x) { return std::accumulate(x.begin(), x.end(), 0.0); };
    // Both judged on the same rows: those of the plain form.
    const auto without = held_out_polled(p.rows, p.solution, p.form),
               found = held_out_polled(p.rows, p.solution, turned);
    if (equations_a_row(p.rows) > 1.0 && p.solution.ok && with.ok && !without.empty() && !found.empty() &&
        sum(found) < kClearlyTurned * sum(without))
        p.form = turned, p.solution = with;
    allow_for_inverter(logs, p);
    return p;
}

PolledLogs under(const PolledLogs& of, const Log& log, double pole_pairs)
{
    PolledLogs p = of;
    p.rows = electrical(polled_rows(log, of.lag.front()), pole_pairs);
    p.log.assign(p.rows.size(), 0);
    leave_out_small(p);
    p.solution = under(of.solution, p.rows, of.form);
    return p;
}

std::vector<Log> settled_logs(const std::vector<Log>& logs)
{
    if (logs.empty() || logs.front().regime != Regime::polled) return logs;
    for (const Log& log : logs)
        if (log.v_d_V.empty() || log.i_d_A.empty())
            throw std::invalid_argument(log.path +
                                        ": without v_d_V or i_d_A its rows are no points of both axes; fit and "
                                        "monitor take it");
    const double pole_pairs = logs.front().machine.pole_pairs.value_or(1.0);
    const PolledLogs p = solve_logs(logs, pole_pairs);
    std::vector<Log> out;
    for (const Log& log : logs) {
        Log settled;
        settled.path = log.path, settled.machine = log.machine, settled.regime = Regime::steady;
        settled.modulation = log.modulation, settled.observed = log.observed, settled.of_polled = true;
        settled.voltage_error_V = std::hypot(log.voltage_error_V, kAcross * p.inverter_V);
        const PolledVector& sd = p.solution.sd;
        settled.rows_sd = {sd[kPolledR], sd[p.form.one_L ? kPolledLq : kPolledLd], sd[kPolledLq], sd[kPolledPsi]};
        out.push_back(settled);
    }
    for (std::size_t k = 0; k < p.rows.size(); ++k) {
        // At a half the row's own averages are off by as much as settled rows are noisy.
        if (!(p.solution.share[k] > 0.5)) continue;
        const PolledRow& r = p.rows[k];
        const Log& from = logs[p.log[k]];
        Log& to = out[p.log[k]];
        to.t_s.push_back(from.t_s[r.row]);
        const double turn = p.solution.x[kPolledTau] * r.w_rad_s, c = std::cos(turn), sine = std::sin(turn);
        to.v_d_V.push_back(c * r.v_V[0] + sine * r.v_V[1] - p.solution.x[kPolledLd] * r.di_A_s[0]);
        to.v_q_V.push_back(c * r.v_V[1] - sine * r.v_V[0] - p.solution.x[kPolledLq] * r.di_A_s[1]);
        to.i_d_A.push_back(r.i_A[0]), to.i_q_A.push_back(r.i_A[1]);
        to.w_m_rad_s.push_back(r.w_rad_s / pole_pairs);
        for (const auto column : {&Log::v_dc_V, &Log::temp_winding_C, &Log::temp_magnet_C})
            if (!(from.*column).empty()) (to.*column).push_back((from.*column)[r.row]);
    }
    const auto settled = std::accumulate(out.begin(), out.end(), std::size_t{0},
                                         [](std::size_t n, const Log& log) { return n + log.rows(); });
    if (settled < kLeastRows)
        throw std::invalid_argument(logs.front().path + ": " + std::to_string(settled) + " settled rows; at least " +
                                    std::to_string(kLeastRows) + " are needed");
    return out;
}

}  // namespace dqw
