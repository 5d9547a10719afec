#include "ref/fit/dynamic.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "ref/fit/explain.hpp"
#include "ref/fit/pole_pairs.hpp"
#include "ref/fit/publish.hpp"
#include "ref/log/residual.hpp"
#include "ref/model/averaged.hpp"
#include "ref/model/blocks.hpp"
#include "ref/model/dynamic.hpp"

namespace dqw {
namespace {

constexpr std::size_t kLeastRows = 100;
constexpr std::size_t kFirstRows = 20000, kFirstWindow = 1000;  ///< of the part a long log converges on first
constexpr std::size_t kHuge = 1000000;  ///< rows beyond which a pass is dear and standard deviations are tiny
constexpr double kCoarse_rad = 0.6;
constexpr double kGains[] = {0.02, 0.5};

using Dynamic = DynamicModel;

Eigen::VectorXd theta_of(const ElectricalStart& s, double gain)
{
    Eigen::VectorXd theta(Dynamic::kSize);
    theta << s.R_ohm, s.Ld_H, s.Lq_H, s.psi_Wb, gain, gain, s.pole_pairs;
    return theta;
}

/// The start that predicts best, at a gain between the two.
Eigen::VectorXd best_start(Dynamic& model, const std::vector<ElectricalStart>& starts)
{
    Eigen::VectorXd best = theta_of(starts.front(), 0.1);
    double least = HUGE_VAL;
    for (const ElectricalStart& s : starts) {
        const Eigen::VectorXd theta = theta_of(s, 0.1);
        Eigen::VectorXd squares;
        model.prepare(theta);
        if (!model.squares(theta, squares)) continue;
        const double score = std::log(squares[0] + 1e-200) + std::log(squares[1] + 1e-200);
        if (score < least) best = theta, least = score;
    }
    return best;
}

Solution best_of_two_gains(Dynamic& model, const Eigen::VectorXd& start, const std::vector<bool>& free,
                           const Task& task)
{
    SolveOptions options;
    options.passes = 4, options.tolerance = 1e-6, options.sigma_tolerance = 1e-2, options.tick = task.tick;
    Solution best;
    for (double gain : kGains) {
        Eigen::VectorXd theta = start;
        theta[Dynamic::kGainD] = theta[Dynamic::kGainQ] = gain;
        Solution s = solve(model, theta, free, options);
        if (s.ok && (!best.ok || s.log_likelihood > best.log_likelihood)) best = std::move(s);
    }
    return best;
}

/// Flux linkage of the currents, RMS: what psi would have to be compared with.
Eigen::VectorXd typical_of(const Dynamic& model, const Eigen::VectorXd& theta)
{
    Eigen::VectorXd typical = Eigen::VectorXd::Zero(theta.size());
    const Eigen::VectorXd i = (model.power() / static_cast<double>(model.rows())).cwiseSqrt();
    typical[Dynamic::kPsi] = std::hypot(theta[Dynamic::kLd] * i[0], theta[Dynamic::kLq] * i[1]);
    return typical;
}

PlainModel plain_model(const Eigen::VectorXd& theta)
{
    PlainModel model;
    model.R_ohm = theta[Dynamic::kR], model.Ld_H = theta[Dynamic::kLd], model.Lq_H = theta[Dynamic::kLq];
    model.psi_Wb = theta[Dynamic::kPsi], model.pole_pairs = theta[Dynamic::kPolePairs];
    return model;
}

/// Publishes the averaged fit in place of the predicting one where its reported residual is clearly less.
bool publish_averaged(const Task& task, const std::vector<Piece>& pieces, const Dynamic& all, const Solution& predicted,
                      Result& result)
{
    const Eigen::VectorXd& theta = predicted.theta;
    // A steady gain g tells the sensor's share of the innovation: (1 - g) of its variance.
    const auto sensor = [&](int axis) {
        return predicted.noise[axis] * std::sqrt(std::max(0.0, 1.0 - theta[Dynamic::kGainD + axis]));
    };
    const auto model = averaged_electrical(pieces, theta[Dynamic::kPolePairs], sensor(0), sensor(1));
    if (model->rows() < 10) return false;
    SolveOptions options;
    options.tick = task.tick, options.common_weight = true;
    const Solution s = solve(*model, theta.head(4), std::vector<bool>(4, true), options);
    if (!s.ok || !(s.theta[1] > 0.0) || !(s.theta[2] > 0.0)) return false;
    Eigen::VectorXd full = theta;
    full.head(4) = s.theta;
    Result averaged;
    report_residual(task.logs, plain_model(full), averaged);
    if (!clearly_better(*model, averaged.residual_rms, result.residual_rms)) return false;
    result = averaged;
    const Covariance covariance = assess(s, *model, typical_of(all, s.theta));
    publish(task, model->names(), covariance, result);
    result.notes.push_back(
        "the plain model does not hold; fitted to voltages averaged over blocks, which leaves less than prediction");
    note_robust(covariance, result);
    return true;
}

PolePairs pole_pairs_of(const Solution& s, Dynamic& model)
{
    return decide_pole_pairs(assess_excited(s, model, typical_of(model, s.theta)).each[Dynamic::kPolePairs]);
}

bool turns(const std::vector<Log>& logs)
{
    for (const Log& log : logs)
        for (double w : log.w_m_rad_s)
            if (w != 0.0) return true;
    return false;
}

/// Converges on a part of a long log, from the log's own starting values and from two gains.
Solution first_look(const Task& task, const std::vector<Piece>& pieces, const std::vector<bool>& free, PolePairs& p)
{
    Dynamic model(spread_sample(pieces, kFirstRows, kFirstWindow), free[Dynamic::kPolePairs]);
    // At rest the pole pairs have no effect: any number will do.
    std::optional<double> known = task.pole_pairs;
    if (!known && !free[Dynamic::kPolePairs]) known = 1.0;
    Solution s = best_of_two_gains(model, best_start(model, electrical_starts(model.pieces(), known)), free, task);
    if (s.ok && free[Dynamic::kPolePairs]) p = pole_pairs_of(s, model);
    return s;
}

/// theta with p a whole number, and psi such that p psi stays.
Eigen::VectorXd with_whole(Eigen::VectorXd theta, double whole)
{
    theta[Dynamic::kPsi] *= theta[Dynamic::kPolePairs] / whole;
    theta[Dynamic::kPolePairs] = whole;
    return theta;
}

/// From the first look `s`, `p` to the fit of all rows. Pole pairs that stand out already are fixed, and only
/// confirmed: by one step of a fit with all parameters free.
void fit_all(const std::vector<Piece>& pieces, std::vector<bool>& free, const SolveOptions& options, Solution& s,
             PolePairs& p)
{
    std::vector<bool> fixed = free;
    fixed[Dynamic::kPolePairs] = false;
    const bool sought = free[Dynamic::kPolePairs];
    Dynamic without(pieces, false), with(pieces, sought);
    const Solution look = s;
    if (sought && p.clear) {
        s = solve(without, with_whole(look.theta, p.whole), fixed, options);
        SolveOptions step = options;
        step.passes = step.iterations = 1;
        const PolePairs confirmed = pole_pairs_of(solve(with, s.theta, free, step), with);
        if (confirmed.clear && confirmed.whole == p.whole) {
            p = confirmed, free = fixed;
            return;
        }
    }
    s = solve(with, look.theta, free, options);
    if (!sought) return;
    p = pole_pairs_of(s, with);
    if (!p.clear) return;
    free = fixed;
    s = solve(without, with_whole(s.theta, p.whole), free, options);
}

double largest_turn_rad(const std::vector<Piece>& pieces, double pole_pairs)
{
    double largest = 0.0;
    for (const Piece& piece : pieces)
        for (std::size_t k = piece.begin; k + 1 < piece.end; ++k)
            largest = std::max(largest, std::abs(pole_pairs * piece.log->w_m_rad_s[k]) * piece.period_s(k));
    return largest;
}

double product_sd(const Eigen::VectorXd& theta, const Covariance& c)
{
    const double psi = theta[Dynamic::kPsi], p = theta[Dynamic::kPolePairs];
    const double variance = p * p * c.of(Dynamic::kPsi, Dynamic::kPsi) +
                            psi * psi * c.of(Dynamic::kPolePairs, Dynamic::kPolePairs) +
                            2.0 * p * psi * c.of(Dynamic::kPsi, Dynamic::kPolePairs);
    return std::sqrt(std::max(variance, 0.0));
}

}  // namespace

Result fit_dynamic(const Task& task)
{
    const std::vector<Piece> pieces = pieces_of(task.logs, kLeastPiece);
    const std::string& path = task.logs.front().path;
    if (rows_of(pieces) < kLeastRows)
        throw std::invalid_argument(path + ": " + std::to_string(rows_of(pieces)) +
                                    " rows without a gap; a dynamic fit needs at least " + std::to_string(kLeastRows));
    std::vector<bool> free(Dynamic::kSize, true);
    free[Dynamic::kPolePairs] = !task.pole_pairs && turns(task.logs);
    PolePairs p;
    Solution s = first_look(task, pieces, free, p);
    if (!s.ok)
        throw std::invalid_argument(
            path + ": a sampling period spans many time constants of the windings; is this log steady?");
    SolveOptions options;
    options.tick = task.tick;
    if (rows_of(pieces) > kHuge) options.tolerance = 1e-7;
    fit_all(pieces, free, options, s, p);
    Dynamic all(pieces, free[Dynamic::kPolePairs]);
    all.prepare(s.theta);
    const Covariance covariance = assess_excited(s, all, typical_of(all, s.theta));

    Result result;
    Task rest = task;
    report_residual(task.logs, plain_model(s.theta), result);
    const double product = s.theta[Dynamic::kPsi] * s.theta[Dynamic::kPolePairs];
    if (free[Dynamic::kPolePairs] || !covariance.robust || !publish_averaged(task, pieces, all, s, result)) {
        report_pole_pairs(rest, p, product, product_sd(s.theta, covariance), result);
        publish(rest, all.names(), covariance, result);
        note_robust(covariance, result);
    } else {
        report_pole_pairs(rest, p, product, 0.0, result);
    }
    if (const double turn = largest_turn_rad(pieces, s.theta[Dynamic::kPolePairs]); turn > kCoarse_rad)
        result.notes.push_back("the rotor turns by up to " + figure(turn) +
                               " rad in a sampling period; a voltage held that long is " +
                               "hardly meant: average it and call the log steady, or sample faster");
    result.notes.push_back("correction gain of the currents: d " + figure(s.theta[Dynamic::kGainD]) + ", q " +
                           figure(s.theta[Dynamic::kGainQ]));
    return result;
}

}  // namespace dqw
