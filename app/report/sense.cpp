#include "app/report/sense.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "ref/log/turns.hpp"

namespace dqw {
namespace {

constexpr std::size_t kBlock = 20;      // rows
constexpr double kBeyondNoise = 4.0;    // variance of block means over what white noise alone gives them
constexpr double kMisfitPercent = 5.0;  // the threshold of the learners' stages
constexpr double kRounding = 1e-7;      // relative: below this a signal does not move

struct Scatter {
    double blocks = 0.0;  // variance of block means
    double noise = 0.0;   // the same, if all were white noise: from second differences, which slow signals do not reach
    double square = 0.0;  // mean square
};

Scatter scatter(const std::vector<Log>& logs, std::vector<double> Log::*column)
{
    double sum = 0.0;
    double sum2 = 0.0;
    double second = 0.0;
    double square = 0.0;
    double blocks = 0.0;
    double rows = 0.0;
    for (const Log& log : logs) {
        const std::vector<double>& x = log.*column;
        for (std::size_t k = 0; k + kBlock <= x.size(); k += kBlock) {
            double mean = 0.0;
            for (std::size_t j = k; j < k + kBlock; j++) {
                mean += x[j] / kBlock;
                square += x[j] * x[j];
                if (j > 0 && j + 1 < x.size()) second += std::pow(x[j + 1] - 2.0 * x[j] + x[j - 1], 2);
            }
            sum += mean, sum2 += mean * mean, blocks += 1.0, rows += kBlock;
        }
    }
    if (blocks < 2.0) return {1.0, 0.0, 1.0};
    return {std::max(0.0, sum2 / blocks - sum * sum / (blocks * blocks)), second / rows / 6.0 / kBlock, square / rows};
}

bool moves(const std::vector<Log>& logs, std::vector<double> Log::*column)
{
    const Scatter s = scatter(logs, column);
    return s.blocks > kBeyondNoise * s.noise + kRounding * kRounding * s.square;
}

bool turns(const std::vector<Log>& logs)
{
    for (const Log& log : logs)
        if (std::any_of(log.w_m_rad_s.begin(), log.w_m_rad_s.end(), [](double w) { return w != 0.0; })) return true;
    return false;
}

// Takes every parameter that `doubtful` names back.
template <class Doubtful> void withhold(Result& result, const Doubtful& doubtful, const std::string& excitation)
{
    std::vector<Estimate> kept;
    for (const Estimate& e : result.parameters) {
        const std::string why = e.given ? std::string() : doubtful(e);
        if (why.empty())
            kept.push_back(e);
        else
            result.not_identifiable.push_back({e.name, why, excitation});
    }
    result.parameters = kept;
}

}  // namespace

std::string allow_for_slip(const std::vector<Log>& logs, std::vector<Estimate>& parameters)
{
    constexpr double kSlips = 0.02;
    const double turns = turns_of_angles(logs), p = logs.front().machine.pole_pairs.value_or(0.0);
    const double part = turns != 0.0 && p > 0.0 ? std::abs(turns / p - 1.0) : 0.0;
    if (!(part > kSlips)) return "";
    for (Estimate& e : parameters)
        if (!e.given) e.sd = std::max(e.sd, part * std::abs(e.value));
    return fmt::format("warning: theta_e_rad turns {:.4g} times as far as the shaft, and the pole pairs are {:g}: the "
                       "speed slips, and no parameter is known better than by that",
                       turns, p);
}

void check_sense(const std::vector<Log>& logs, Result& result)
{
    withhold(
        result, [&](const Estimate& e) { return why_observed(logs.front().observed, e.name); }, kForObserved);
    if (result.regime == Regime::dynamic && turns(logs) && !moves(logs, &Log::i_d_A) && !moves(logs, &Log::i_q_A) &&
        !moves(logs, &Log::w_m_rad_s))
        withhold(
            result,
            [](const Estimate&) {
                return std::string("currents and speed stay within their own noise: one operating point, where all "
                                   "parameters act together");
            },
            "steps of i_d, i_q and speed");
    withhold(
        result,
        [](const Estimate& e) {
            const bool positive = e.name == "B_Nms_rad" || e.value > 0.0;
            return positive ? std::string()
                            : fmt::format(
                                  "it comes out as {:.3g}, which no machine has: a sign or a column is probably wrong",
                                  e.value);
        },
        "a check of the signs and columns of voltage, current and speed");

    if (const std::string slip = allow_for_slip(logs, result.parameters); !slip.empty()) result.notes.push_back(slip);
    for (const AxisResidual& axis : result.axes) {
        if (!(axis.percent > kMisfitPercent) || !(axis.rms > 0.1 * result.residual_rms)) continue;
        if (axis.percent > 100.0 && !result.not_identifiable.empty())
            result.notes.push_back(fmt::format(
                "warning: the residual on {} says nothing: parameters that it needs are not known", axis.axis));
        else
            result.notes.push_back(fmt::format("warning: the model leaves {:.3g} % of {} unexplained; the values take "
                                               "up what it lacks (wrong signs, columns or units included)",
                                               axis.percent, axis.axis));
    }
}

}  // namespace dqw
