#include "ref/trace/column_noise.hpp"

#include <cmath>

#include "ref/model/coherent.hpp"
#include "ref/model/column_noise.hpp"
#include "ref/model/lasting.hpp"
#include "ref/model/open_circuit.hpp"
#include "ref/model/warming.hpp"

namespace dqw {
namespace {

/// Scores of the rows seen, each channel a column, e'e below.
Eigen::MatrixXd seen_scores(const Model& model, const Point& at, double& rows)
{
    std::vector<BlockSum> sums;
    const std::vector<Input> none;
    if (!model.sweep_some(at, &none, false, sums)) return {};
    const Eigen::Index last = at.columns();
    Eigen::MatrixXd scores = Eigen::MatrixXd::Zero(last + 1, model.channels());
    rows = 0.0;
    for (std::size_t b = 0; b < sums.size(); ++b) {
        if (model.plan().blocks[b].heldout) continue;
        rows += sums[b].rows;
        for (Eigen::Index c = 0; c < scores.cols(); ++c)
            scores.col(c) += sums[b].gram[static_cast<std::size_t>(c)].col(last);
    }
    return scores;
}

/// Mean square of each channel's errors on the rows seen; empty where there are none.
Eigen::VectorXd seen_squares(const Model& model, const Point& at)
{
    std::vector<BlockSum> sums;
    if (!model.sweep_some(at, nullptr, false, sums)) return {};
    Eigen::VectorXd square = Eigen::VectorXd::Zero(model.channels());
    double rows = 0.0;
    for (std::size_t b = 0; b < sums.size(); ++b) {
        if (model.plan().blocks[b].heldout) continue;
        rows += sums[b].rows;
        for (Eigen::Index c = 0; c < square.size(); ++c) square[c] += sums[b].gram[static_cast<std::size_t>(c)](0, 0);
    }
    return rows > 0.0 ? Eigen::VectorXd(square / rows) : Eigen::VectorXd();
}

/// (E191), of the rows seen.
Eigen::VectorXd warming_of(const Model& model, const Refined& refined)
{
    const Point& at = refined.point;
    Eigen::VectorXd friction = Eigen::VectorXd::Zero(at.columns());
    friction[1] = at.base[1];
    Eigen::Index column = at.base.size() + at.gain.size();
    for (const Term& t : at.terms) {
        for (int w = 0; w < weights_of(t.input.law); ++w) friction[column + w] = t.weights[static_cast<std::size_t>(w)];
        column += weights_of(t.input.law) + free_shapes_of(t.input);
    }
    std::vector<TimedSum> sums;
    double square = 0.0, rows = 0.0;
    for (std::size_t b = 0; b < refined.sums.size(); ++b) {
        const FineBlock& fine = model.plan().blocks[b];
        if (fine.heldout) continue;
        const Eigen::MatrixXd& gram = refined.sums[b].gram[0];
        sums.push_back({when_in(*fine.piece->log, (fine.begin + fine.end) / 2), gram});
        square += gram(gram.rows() - 1, gram.rows() - 1), rows += refined.sums[b].rows;
    }
    return warming_deviations(sums, friction, rows > 0.0 ? square / rows : 0.0);
}

}  // namespace

Refined without_column_noise(const TraceSetup& setup, const Model& model, const Refined& refined)
{
    if (setup.regime != Regime::dynamic || !refined.ok) return refined;
    ColumnNoise& noise = *setup.column_noise;
    // Of a long log a part says it: what its draw scatters by is little beside what the noise adds.
    const Plan& plan = setup.part ? setup.part->plan() : model.plan();
    return take_off_noise(model, refined, [&](const Point& at, const Eigen::VectorXd& variance, double rows) {
        const NoiseSizes sizes = noise.sizes(at.base, at.gain, setup.pole_pairs, variance);
        if (!sizes.any()) return Eigen::MatrixXd();
        double of_part = 0.0;
        Eigen::MatrixXd added = noise.added(sizes, [&](const RowNoise* noisy) {
            const ElectricalModel moved(*setup.logs, setup.columns, setup.pole_pairs, plan, setup.rotor_held, noisy);
            return seen_scores(moved, at, of_part);
        });
        return of_part > 0.0 ? Eigen::MatrixXd(rows / of_part * added) : added;
    });
}

double nats_to_law_noise(const TraceSetup& setup, const Refined& refined)
{
    if (setup.regime != Regime::dynamic || !refined.ok || refined.point.terms.empty()) return 0.0;
    const Model& model = setup.search();
    ColumnNoise& noise = *setup.column_noise;
    Eigen::VectorXd variance;
    double rows = 0.0;
    seen_information(model, refined, variance, rows);
    const NoiseSizes sizes = noise.sizes(refined.point.base, refined.point.gain, setup.pole_pairs, variance);
    if (!sizes.any()) return 0.0;
    Point bare = refined.point;
    bare.terms.clear();
    const auto squares = [&](const Point& at, const RowNoise* noisy) {
        const ElectricalModel moved(*setup.logs, setup.columns, setup.pole_pairs, model.plan(), setup.rotor_held,
                                    noisy);
        return seen_squares(moved, at);
    };
    // Empty, which is no vector, where a moved log cannot be predicted.
    const Eigen::MatrixXd with = noise.second(sizes, [&](const RowNoise*n) { return squares(refined.point, n); }),
                          without = noise.second(sizes, [&](const RowNoise*n) { return squares(bare, n); });
    if (with.size() != variance.size() || without.size() != variance.size()) return 0.0;
    // Of the innovations: more is no small change of them; of the sizes, as in ColumnNoise::added().
    constexpr double kMost = 0.5, kMostSize = 2.0;
    double held = 0.0;
    for (std::size_t k = 0; k < refined.left.rows.size(); ++k)
        if (model.plan().blocks[k].heldout) held += refined.left.rows[k];
    double nats = 0.0;
    for (Eigen::Index c = 0; c < variance.size(); ++c) {
        const double size = without(c, 0) > 0.0
                                ? std::clamp(sizes.share[c] * variance[c] / without(c, 0), 1.0 / kMostSize, kMostSize)
                                : 1.0;
        nats -= 0.5 * held *
                std::log(1.0 - std::clamp(size * (with(c, 0) - without(c, 0)) / variance[c], -kMost, kMost));
    }
    return nats;
}

Eigen::VectorXd whole_deviations(const TraceSetup& setup, const Model& model, const Refined& refined)
{
    Eigen::VectorXd sd = deviations(model, refined);
    if (is_open_circuit(*setup.logs))
        return (sd.array().square() + open_circuit_deviations(model, refined.point).array().square()).sqrt();
    if (setup.regime == Regime::mechanical) {
        Eigen::VectorXd wide = (sd.array().square() + warming_of(model, refined).array().square()).sqrt();
        const Eigen::Vector2d lasting = lasting_deviations(setup.full->report(refined.point, 0));
        for (Eigen::Index j = 0; j < lasting.size(); ++j) wide[j] = std::hypot(wide[j], lasting[j]);
        if (model.gains() == 0) wide[0] = std::hypot(wide[0], setup.hat_noise_part * refined.point.base[0]);
        return wide;
    }
    if (setup.regime != Regime::dynamic) return sd;
    double rows = 0.0;
    Eigen::VectorXd variance;
    const Eigen::MatrixXd information = seen_information(model, refined, variance, rows);
    const Eigen::VectorXd hidden = coherent_deviations(model, refined.point, information,
                                                       lasting_volt(*setup.logs, refined.point, variance, rows));
    for (Eigen::Index j = 0; j < sd.size(); ++j) sd[j] = std::hypot(sd[j], hidden[j]);
    return sd;
}

}  // namespace dqw
