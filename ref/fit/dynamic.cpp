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
#include "ref/model/coherent.hpp"
#include "ref/model/column_noise.hpp"
#include "ref/model/electrical.hpp"
#include "ref/model/plan.hpp"

namespace dqw {
namespace {

constexpr std::size_t kLeastRows = 100;
constexpr std::size_t kFirstRows = 20000, kFirstWindow = 1000;  ///< of the part a long log converges on first
constexpr std::size_t kHuge = 1000000;  ///< rows beyond which a pass is dear and standard deviations are tiny
constexpr double kCoarse_rad = 0.6;
constexpr double kGains[] = {0.02, 0.5};
constexpr double kLikely = 0.5, kTelling = 0.02;  ///< a loss is told from this probability, and part of R, on

/// Entries of theta.
enum Index { kR, kLd, kLq, kPsi, kPolePairs, kGainD, kGainQ, kSize };

WithoutEffects dynamic_model(const Task& task, std::vector<Piece> pieces, const RowNoise* noise = nullptr)
{
    static const std::vector<TraceColumns> none;
    return {std::make_unique<ElectricalModel>(task.logs, none, 1.0, even_plan(std::move(pieces), 1), false, noise),
            {"R_ohm", "Ld_H", "Lq_H", "psi_Wb", "pole_pairs"}};
}

Eigen::VectorXd theta_of(const ElectricalStart& s, double gain)
{
    Eigen::VectorXd theta(kSize);
    theta << s.R_ohm, s.Ld_H, s.Lq_H, s.psi_Wb, s.pole_pairs, gain, gain;
    return theta;
}

/// The start that predicts best, at a gain between the two.
Eigen::VectorXd best_start(Regression& model, const std::vector<ElectricalStart>& starts)
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

Solution best_of_two_gains(Regression& model, const Eigen::VectorXd& start, const std::vector<bool>& free,
                           const Task& task)
{
    SolveOptions options;
    options.passes = 4, options.tolerance = 1e-6, options.sigma_tolerance = 1e-2, options.tick = task.tick;
    Solution best;
    for (double gain : kGains) {
        Eigen::VectorXd theta = start;
        theta[kGainD] = theta[kGainQ] = gain;
        Solution s = solve(model, theta, free, options);
        if (s.ok && (!best.ok || s.log_likelihood > best.log_likelihood)) best = std::move(s);
    }
    return best;
}

/// Flux linkage of the currents, RMS: what psi would have to be compared with.
Eigen::VectorXd typical_of(const Regression& model, const Eigen::VectorXd& theta)
{
    Eigen::VectorXd typical = Eigen::VectorXd::Zero(theta.size());
    const Eigen::VectorXd i = (model.power() / static_cast<double>(model.rows())).cwiseSqrt();
    typical[kPsi] = std::hypot(theta[kLd] * i[0], theta[kLq] * i[1]);
    return typical;
}

PlainModel plain_model(const Eigen::VectorXd& theta)
{
    PlainModel model;
    model.R_ohm = theta[kR], model.Ld_H = theta[kLd], model.Lq_H = theta[kLq];
    model.psi_Wb = theta[kPsi], model.pole_pairs = theta[kPolePairs];
    return model;
}

/// Adds what the model's error may hide to the deviations, (E111), and what an inverter may, `loss`; of the pole pairs
/// it takes them as they are. `averaged`: a fit of means over blocks, whose rows are volts.
void add_hidden(const Task& task, const std::vector<Piece>& pieces, const Eigen::VectorXd& theta, const Solution& s,
                double rows, bool averaged, const HiddenLoss& loss, Covariance& covariance)
{
    static const std::vector<TraceColumns> none;
    const ElectricalModel model(task.logs, none, theta[kPolePairs], even_plan(pieces, 1));
    const Point at{theta.head(4), averaged ? Eigen::VectorXd() : Eigen::VectorXd(theta.tail(2)), {}};
    std::vector<int> columns{kR, kLd, kLq, kPsi};
    if (!averaged) columns.insert(columns.end(), {kGainD, kGainQ});
    const auto n = static_cast<Eigen::Index>(columns.size());
    Eigen::MatrixXd information = Eigen::MatrixXd::Zero(n, n);
    for (Eigen::Index c = 0; c < s.sigma.size(); ++c) {
        const Eigen::MatrixXd total = total_of(s.sums, static_cast<std::size_t>(c)) / (s.sigma[c] * s.sigma[c]);
        for (Eigen::Index i = 0; i < n; ++i)
            for (Eigen::Index j = 0; j < n; ++j)
                information(i, j) += total(columns[static_cast<std::size_t>(i)], columns[static_cast<std::size_t>(j)]);
    }
    const Eigen::VectorXd variance = s.sigma.cwiseAbs2();
    const LastingVolt volt = averaged
                                 ? LastingVolt{rows * variance.cwiseInverse(), Eigen::VectorXd::Zero(variance.size())}
                                 : lasting_volt(task.logs, at, variance, rows);
    const Eigen::VectorXd hidden = coherent_deviations(model, at, information, volt);
    for (Eigen::Index j = 0; j < 4; ++j) {
        Assessment& a = covariance.each[static_cast<std::size_t>(j)];
        if (a.verdict != Verdict::determined) continue;
        const double more = std::hypot(hidden[j], loss.loss_sd[j], loss.filter_sd[j]);
        covariance.of(j, j) += more * more;
        a.sd = std::hypot(a.sd, more);
    }
}

/// Publishes the averaged fit in place of the predicting one where its reported residual is clearly less.
bool publish_averaged(const Task& task, const std::vector<Piece>& pieces, const Regression& all,
                      const Solution& predicted, Result& result)
{
    const Eigen::VectorXd& theta = predicted.theta;
    // A steady gain g tells the sensor's share of the innovation: (1 - g) of its variance.
    const auto sensor = [&](int axis) {
        return predicted.noise[axis] * std::sqrt(std::max(0.0, 1.0 - theta[kGainD + axis]));
    };
    const auto model = averaged_electrical(pieces, theta[kPolePairs], sensor(0), sensor(1));
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
    Covariance covariance = assess(s, *model, typical_of(all, s.theta));
    // A prediction that does not hold may be no machine's at all: what hides is sought beside these values.
    const HiddenLoss loss = hidden_loss(pieces, full[kPolePairs], {full.head(4), full.tail(2), {}}, predicted.sigma);
    add_hidden(task, pieces, full, s, static_cast<double>(model->rows()), true, loss, covariance);
    publish(task, model->names(), covariance, result);
    result.notes.push_back(
        "the plain model does not hold; fitted to voltages averaged over blocks, which leaves less than prediction");
    note_robust(covariance, result);
    return true;
}

PolePairs pole_pairs_of(const Solution& s, Regression& model)
{
    return decide_pole_pairs(assess_excited(s, model, typical_of(model, s.theta)).each[kPolePairs]);
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
    const std::vector<Piece> part = spread_sample(pieces, kFirstRows, kFirstWindow);
    WithoutEffects model = dynamic_model(task, part);
    // At rest the pole pairs have no effect: any number will do.
    std::optional<double> known = task.pole_pairs;
    if (!known && !free[kPolePairs]) known = 1.0;
    Solution s = best_of_two_gains(model, best_start(model, electrical_starts(part, known)), free, task);
    if (s.ok && free[kPolePairs]) p = pole_pairs_of(s, model);
    return s;
}

/// theta with p a whole number, and psi such that p psi stays.
Eigen::VectorXd with_whole(Eigen::VectorXd theta, double whole)
{
    theta[kPsi] *= theta[kPolePairs] / whole;
    theta[kPolePairs] = whole;
    return theta;
}

/// From the first look `s`, `p` to the fit of all rows. Pole pairs that stand out already are fixed, and only
/// confirmed: by one step of a fit with all parameters free.
void fit_all(Regression& model, std::vector<bool>& free, const SolveOptions& options, Solution& s, PolePairs& p)
{
    std::vector<bool> fixed = free;
    fixed[kPolePairs] = false;
    const bool sought = free[kPolePairs];
    const Solution look = s;
    if (sought && p.clear) {
        s = solve(model, with_whole(look.theta, p.whole), fixed, options);
        SolveOptions step = options;
        step.passes = step.iterations = 1;
        const PolePairs confirmed = pole_pairs_of(solve(model, s.theta, free, step), model);
        if (confirmed.clear && confirmed.whole == p.whole) {
            p = confirmed, free = fixed;
            return;
        }
    }
    s = solve(model, look.theta, free, options);
    if (!sought) return;
    p = pole_pairs_of(s, model);
    if (!p.clear) return;
    free = fixed;
    s = solve(model, with_whole(s.theta, p.whole), free, options);
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
    const double psi = theta[kPsi], p = theta[kPolePairs];
    const double variance = p * p * c.of(kPsi, kPsi) + psi * psi * c.of(kPolePairs, kPolePairs) +
                            2.0 * p * psi * c.of(kPsi, kPolePairs);
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
    std::vector<bool> free(kSize, true);
    free[kPolePairs] = !task.pole_pairs && turns(task.logs);
    PolePairs p;
    Solution s = first_look(task, pieces, free, p);
    if (!s.ok)
        throw std::invalid_argument(
            path + ": a sampling period spans many time constants of the windings; is this log steady?");
    SolveOptions options;
    options.tick = task.tick;
    if (rows_of(pieces) > kHuge) options.tolerance = 1e-7;
    WithoutEffects all = dynamic_model(task, pieces);
    ColumnNoise column_noise(task.logs);
    options.added = [&](const Eigen::VectorXd& theta, const Eigen::VectorXd& variance) {
        const NoiseSizes sizes = column_noise.sizes(theta.head(kGainD), theta.tail(2), 1.0, variance);
        if (!sizes.any()) return Eigen::MatrixXd();
        return column_noise.added(sizes, [&](const RowNoise* noise) {
            WithoutEffects model = dynamic_model(task, pieces, noise);
            model.prepare(theta);
            std::vector<BlockSum> sums;
            Eigen::MatrixXd scores(theta.size() + 1, 2);
            if (!model.sweep(theta, sums)) return Eigen::MatrixXd();
            for (int c : {0, 1}) scores.col(c) = total_of(sums, static_cast<std::size_t>(c)).col(theta.size());
            return scores;
        });
    };
    fit_all(all, free, options, s, p);
    all.prepare(s.theta);
    Covariance covariance = assess_excited(s, all, typical_of(all, s.theta));
    const HiddenLoss loss = hidden_loss(pieces, s.theta[kPolePairs], {s.theta.head(4), s.theta.tail(2), {}}, s.sigma);
    add_hidden(task, pieces, s.theta, s, static_cast<double>(all.rows()), false, loss, covariance);

    Result result;
    Task rest = task;
    report_residual(task.logs, plain_model(s.theta), result);
    const double product = s.theta[kPsi] * s.theta[kPolePairs];
    if (free[kPolePairs] || !covariance.robust || !publish_averaged(task, pieces, all, s, result)) {
        report_pole_pairs(rest, p, product, product_sd(s.theta, covariance), result);
        publish(rest, all.names(), covariance, result);
        note_robust(covariance, result);
    } else {
        report_pole_pairs(rest, p, product, 0.0, result);
    }
    if (const double turn = largest_turn_rad(pieces, s.theta[kPolePairs]); turn > kCoarse_rad)
        result.notes.push_back("the rotor turns by up to " + figure(turn) +
                               " rad in a sampling period; a voltage held that long is " +
                               "hardly meant: average it and call the log steady, or sample faster");
    if (loss.probable > kLikely && 3.0 * loss.loss_sd[kR] > kTelling * std::abs(s.theta[kR]))
        result.notes.push_back("an inverter whose legs lose voltage with the sign of their current would explain more, "
                               "and R hangs on it, as its deviation says: `dqwatch trace` tells");
    if (loss.filtered > kLikely && 3.0 * loss.filter_sd[kLq] > kTelling * std::abs(s.theta[kLq]))
        result.notes.push_back("currents filtered by a time constant of about " + figure(1e6 * loss.filter_s) +
                               " us would explain more, and R and L hang on it, as their deviations say: `dqwatch "
                               "trace` tells");
    result.notes.push_back("correction gain of the currents: d " + figure(s.theta[kGainD]) + ", q " +
                           figure(s.theta[kGainQ]));
    return result;
}

std::optional<PlainLook> plain_look(const std::vector<Log>& logs, double pole_pairs)
{
    const std::vector<Piece> pieces = pieces_of(logs, kLeastPiece);
    if (rows_of(pieces) < kLeastRows) return {};
    const Task task{logs, {}, pole_pairs, {}, {}};
    std::vector<bool> free(kSize, true);
    free[kPolePairs] = false;
    PolePairs p;
    const Solution s = first_look(task, pieces, free, p);
    // Where the voltage foretells nothing, a prediction ends as no machine.
    if (!s.ok || !(s.theta.head(3).minCoeff() > 0.0)) return {};
    const HiddenLoss hidden = hidden_loss(pieces, pole_pairs, {s.theta.head(4), s.theta.tail(2), {}}, s.sigma);
    const std::vector<Piece> part = spread_sample(pieces, kFirstRows, kFirstWindow);
    WithoutEffects model = dynamic_model(task, part);
    model.prepare(s.theta);
    Covariance covariance = assess_excited(s, model, typical_of(model, s.theta));
    HiddenLoss none = hidden;
    none.loss_sd.setZero(), none.filter_sd.setZero();
    add_hidden(task, part, s.theta, s, static_cast<double>(model.rows()), false, none, covariance);
    PlainLook look{s.theta.head(4), Eigen::Vector4d::Constant(HUGE_VAL), hidden, false};
    for (const int j : {kR, kLd, kLq, kPsi}) {
        const Assessment& a = covariance.each[static_cast<std::size_t>(j)];
        if (a.verdict != Verdict::determined) continue;
        look.sd[j] = std::hypot(a.sd, hidden.loss_sd[j], hidden.filter_sd[j]);
        const bool inductance = j == kLd || j == kLq;
        look.filtered = look.filtered || (inductance && hidden.filtered > kLikely && hidden.filter_sd[j] > a.sd);
    }
    return look;
}

}  // namespace dqw
