#include "ref/trace/flux_map.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "ref/effect/flux_table.hpp"
#include "ref/effect/range.hpp"
#include "ref/log/symmetric.hpp"
#include "ref/model/coherent.hpp"
#include "ref/trace/shapes.hpp"

namespace dqw {
namespace {

constexpr int kPasses = 12;            ///< as a fit of the search has
constexpr std::size_t kPlaces = 2000;  ///< currents at which laws are compared: more say the same

bool is_polynomial(Law law) { return bends(law) && !is_map(law); }
Law map_of(Law law) { return law == Law::saturation || law == Law::own_map ? Law::own_map : Law::cross_map; }
Law polynomial_of(Law law) { return map_of(law) == Law::own_map ? Law::saturation : Law::cross_saturation; }

std::vector<Vector2> places_of(const std::vector<Log>& logs)
{
    std::size_t rows = 0;
    for (const Log& log : logs) rows += log.rows();
    const std::size_t step = std::max<std::size_t>(rows / kPlaces, 1);
    std::vector<Vector2> out;
    for (const Log& log : logs)
        for (std::size_t k = 0; k < log.rows(); k += step) out.push_back({at_row(log.i_d_A, k), at_row(log.i_q_A, k)});
    return out;
}

/// Columns: the flux of one unit of each weight, d above q.
Eigen::MatrixXd flux_columns(const Input& input, const std::vector<Vector2>& places)
{
    const auto n = static_cast<Eigen::Index>(places.size());
    Eigen::MatrixXd out(2 * n, weights_of(input.law));
    Vector2 f[kMostWeights], g[kMostWeights];
    Moment m;
    for (Eigen::Index k = 0; k < n; ++k) {
        m.i_d = places[static_cast<std::size_t>(k)].d, m.i_q = places[static_cast<std::size_t>(k)].q;
        evaluate(input, m, f, g);
        for (Eigen::Index j = 0; j < out.cols(); ++j) out(k, j) = g[j].d, out(n + k, j) = g[j].q;
    }
    return out;
}

/// What takes weights of `from` to those of `to` that leave least of the flux at the places.
Eigen::MatrixXd taking(const Input& from, const Input& to, const std::vector<Vector2>& places)
{
    const Eigen::MatrixXd a = flux_columns(to, places), b = flux_columns(from, places);
    const Eigen::VectorXd size = a.colwise().norm().cwiseMax(1e-300).cwiseInverse();
    return size.asDiagonal() * pseudo_inverse(a * size.asDiagonal()) * b;
}

Term taken(const Term& from, const Input& to, const Eigen::MatrixXd& by)
{
    Term term{to, {}};
    const Eigen::Map<const Eigen::VectorXd> weights(from.weights.data(), by.cols());
    Eigen::Map<Eigen::VectorXd>(term.weights.data(), by.rows()) = by * weights;
    return term;
}

/// Whether the blocks held out, each by itself, speak against `b`: the few that lie beyond the rows seen, where a map
/// says nothing yet, would outweigh all others in the sum.
bool worse(const Model& model, const Refined& a, const Refined& b)
{
    constexpr double kClearlyT = 2.0;  // one of 44 that are alike is told so
    return better(model, a.left, b.left).t < -kClearlyT;
}

/// By how many deviations the stretches held out gain by `map`, whose terms go on after those of `without`: each
/// stretch by what the map changes in its predictions, (E142). A bend shows in few, where currents and speed are large.
double stretches_gain(const Model& model, const Refined& without, const Refined& map)
{
    const auto& blocks = model.plan().blocks;
    const Eigen::VectorXd from = without.point.values();
    Eigen::VectorXd step = -map.point.values();
    step.head(from.size()) += from;
    const std::size_t channels = map.left.of.size();
    std::vector<double> noise(channels, 0.0), gain, change;
    double rows = 0.0;
    for (std::size_t k = 0; k < blocks.size(); ++k)
        if (blocks[k].heldout) {
            rows += map.left.rows[k];
            for (std::size_t c = 0; c < channels; ++c) noise[c] += map.left.of[c][k];
        }
    for (std::size_t k = 0; k < blocks.size(); ++k) {
        if (!blocks[k].heldout) continue;
        if (k == 0 || !blocks[k - 1].heldout || gain.empty()) gain.push_back(0.0), change.push_back(0.0);
        for (std::size_t c = 0; c < channels; ++c) {
            const double one = std::max(noise[c] / rows, 1e-300);
            const auto& j = map.sums[k].gram[c];
            gain.back() += 0.5 * (without.left.of[c][k] - map.left.of[c][k]) / one;
            change.back() += step.dot(j.topLeftCorner(step.size(), step.size()) * step) / one;
        }
    }
    double all = 0.0, changed = 0.0, square = 0.0;
    for (std::size_t s = 0; s < gain.size(); ++s) all += gain[s], changed += change[s];
    for (std::size_t s = 0; s < gain.size(); ++s) square += std::pow(gain[s] - all / changed * change[s], 2);
    const double n = static_cast<double>(gain.size());
    return n > 2.0 && square > 0.0 ? all / std::sqrt(square * n / (n - 1.0)) : 0.0;
}

/// Whether the rows held out confirm a map without a name: too weak to better the reported residual, it may still be
/// told. What is no effect's name asks for less than one: ten nats, which chance has once in 20000, and by stretches.
bool told(const Model& model, const Refined& without, const Refined& map)
{
    constexpr double kClearlyT = 3.0;  // ten stretches exceed it in one of 130 cases
    if (!without.ok || !map.ok || map.point.columns() < without.point.columns()) return false;
    return better(model, without.left, map.left).nats > kLeastNats && stretches_gain(model, without, map) > kClearlyT;
}

/// Each map as stiff as its weights are small, by how many of them the log tells. (E142)
Refined as_smooth_as_told(const Model& model, Refined best)
{
    constexpr int kRounds = 4;
    constexpr double kLeastTold = 0.5, kSettled = 1.2;
    for (int round = 0; round < kRounds && best.ok; ++round) {
        const Eigen::MatrixXd c = spreads_of(model, best).white;
        Point next = best.point;
        Eigen::Index j = next.base.size() + next.gain.size();
        double most = 1.0;
        for (Term& t : next.terms) {
            const Eigen::Index n = weights_of(t.input.law);
            if (is_map(t.input.law)) {
                double& stiffness = t.input.shape[3];
                double told = 0.0, square = 0.0;
                for (Eigen::Index k = j; k < j + n; ++k) {
                    const double w = t.weights[static_cast<std::size_t>(k - j)];
                    told += std::max(1.0 - stiffness * c(k, k), 0.0), square += w * w;
                }
                const double old = stiffness;
                stiffness = std::max(told, kLeastTold) / std::max(square, 1e-300);
                most = std::max({most, stiffness / old, old / stiffness});
            }
            j += n + free_shapes_of(t.input);
        }
        if (most < kSettled) break;
        Refined r = refine(model, next, kPasses);
        if (!r.ok || r.left.heldout < best.left.heldout) break;
        best = std::move(r);
    }
    return best;
}

/// Each polynomial as the map that comes closest to it.
Point at_map(const TraceSetup& setup, Point at)
{
    const std::vector<Vector2> places = places_of(*setup.logs);
    for (Term& t : at.terms)
        if (is_polynomial(t.input.law)) {
            const Input map = map_input(setup, map_of(t.input.law));
            t = taken(t, map, taking(t.input, map, places));
        }
    return at;
}

}  // namespace

namespace {

struct Box {
    double low_A, high_A, most_q_A;
};

/// An axis that hardly moves has cells too, of which its noise says nothing.
Box box_of(const TraceSetup& setup, const Range& d, const Range& q)
{
    constexpr double kLeastPart = 0.1;
    const double least = kLeastPart * setup.i_base_A, span = std::max(d.most, 0.0) - std::min(d.least, 0.0);
    return {span > least ? std::min(d.least, 0.0) : -least, span > least ? std::max(d.most, 0.0) : least,
            std::max(q.size(), least)};
}

/// Without the rarest currents of a moving log, which would make cells wide where all others are.
Range usual_range(const TraceSetup& setup, std::vector<double> Log::*column)
{
    constexpr double kRare = 0.005;
    if (setup.regime != Regime::dynamic) return range_of(*setup.logs, column);
    std::vector<double> all;
    for (const Log& log : *setup.logs) all.insert(all.end(), (log.*column).begin(), (log.*column).end());
    if (all.empty()) return range_of(*setup.logs, column);
    const auto at = [&all](double part) {
        const auto k = all.begin() + static_cast<std::ptrdiff_t>(part * static_cast<double>(all.size() - 1));
        std::nth_element(all.begin(), k, all.end());
        return *k;
    };
    Range out;
    out.add(at(kRare)), out.add(at(1.0 - kRare));
    return out;
}

}  // namespace

Input map_input(const TraceSetup& setup, Law law)
{
    const Range d = usual_range(setup, &Log::i_d_A), q = usual_range(setup, &Log::i_q_A);
    const Box box = box_of(setup, d, q);
    const double flux = setup.i_base_A * 0.5 *
                        (std::abs(setup.starts.front().base[1]) + std::abs(setup.starts.front().base[2]));
    // A cell may bend a tenth of the currents' flux, one axis the other by a hundredth for each of its thirty.
    const double each = std::max(law == Law::own_map ? 0.02 * flux : 0.002 * flux, 1e-12);
    return {law, {box.low_A, box.high_A, box.most_q_A, 1.0 / (each * each)}};
}

namespace {

bool any(const Point& at, bool (*is)(Law))
{
    return std::any_of(at.terms.begin(), at.terms.end(), [&](const Term& t) { return is(t.input.law); });
}

Point without_bends(Point at)
{
    at.terms.erase(std::remove_if(at.terms.begin(), at.terms.end(), [](const Term& t) { return bends(t.input.law); }),
                   at.terms.end());
    return at;
}

/// Both maps, those that are missing as nothing.
Point with_both(const TraceSetup& setup, Point at)
{
    for (const Law law : {Law::own_map, Law::cross_map})
        if (std::none_of(at.terms.begin(), at.terms.end(), [&](const Term& t) { return t.input.law == law; }))
            at.terms.push_back({map_input(setup, law), {}});
    return at;
}

}  // namespace

Refined with_map(const TraceSetup& setup, const Model& model, const Point& at)
{
    // One that begins as nothing has far to go.
    constexpr int kMorePasses = 3 * kPasses;
    Refined best = refine(model, with_both(setup, at_map(setup, at)), kMorePasses);
    if (any(at, is_polynomial)) {
        // A polynomial that is far from the iron leads astray: the map then begins as nothing.
        std::vector<BlockSum> sums;
        const bool astray = !best.ok || (model.pass(at, {}, sums) && best.left.heldout < left_of(model, sums).heldout);
        const Refined plain = astray ? refine(model, without_bends(at), kPasses) : Refined();
        if (plain.ok) {
            Refined other = refine(model, with_both(setup, plain.point), kMorePasses);
            if (other.ok && (!best.ok || other.left.seen > best.left.seen)) best = std::move(other);
        }
    }
    return as_smooth_as_told(model, best);
}

Term polynomial_of(const TraceSetup& setup, const Term& map, std::vector<double>* sd)
{
    const Input to{polynomial_of(map.input.law), {setup.i_base_A}};
    const Eigen::MatrixXd by = taking(map.input, to, places_of(*setup.logs));
    if (sd != nullptr) {
        std::vector<double> out;
        for (Eigen::Index i = 0; i < by.rows(); ++i) {
            double square = 0.0;
            for (Eigen::Index j = 0; j < by.cols(); ++j)
                square += std::pow(by(i, j) * (*sd)[static_cast<std::size_t>(j)], 2);
            out.push_back(std::sqrt(square));
        }
        *sd = out;
    }
    return taken(map, to, by);
}

namespace {

constexpr int kGrid = 20;  ///< steps of an axis

/// Zero among them.
std::vector<double> axis_of(double least_A, double most_A)
{
    const int below = std::clamp(static_cast<int>(std::lround(-least_A / (most_A - least_A) * kGrid)),
                                 least_A < 0.0 ? 1 : 0, most_A > 0.0 ? kGrid - 1 : kGrid);
    const double step = std::max(below > 0 ? -least_A / below : 0.0, below < kGrid ? most_A / (kGrid - below) : 0.0);
    std::vector<double> out;
    for (int k = -below; k <= kGrid - below; ++k) out.push_back(k * step);
    return out;
}

/// Three means of rows within a step of the node.
void mark_rows(const TraceSetup& setup, double step_d_A, double step_q_A, FluxMap& map)
{
    constexpr std::size_t kRows = 10, kLeast = 3;
    std::vector<std::size_t> count(map.nodes.size(), 0);
    for (const Log& log : *setup.logs)
        for (std::size_t k = 0; k + kRows <= log.rows(); k += kRows) {
            double d = 0.0, q = 0.0;
            for (std::size_t r = k; r < k + kRows; ++r) d += at_row(log.i_d_A, r), q += at_row(log.i_q_A, r);
            d /= kRows, q /= kRows;
            for (std::size_t n = 0; n < map.i_d_A.size(); ++n)
                for (std::size_t m = 0; m < map.i_q_A.size(); ++m)
                    if (std::hypot((d - map.i_d_A[n]) / step_d_A, (q - map.i_q_A[m]) / step_q_A) <= 1.0)
                        ++count[n * map.i_q_A.size() + m];
        }
    for (std::size_t n = 0; n < count.size(); ++n) map.nodes[n].seen = count[n] >= kLeast;
}

/// Settled points, which have no noise to speak of: one on each side of the node, on both axes, no further than a
/// quarter of the grid.
void mark_points(const TraceSetup& setup, double step_d_A, double step_q_A, FluxMap& map)
{
    constexpr double kFar = kGrid / 4;
    std::vector<unsigned> sides(map.nodes.size(), 0);
    for (const Log& log : *setup.logs)
        for (std::size_t k = 0; k < log.rows(); ++k)
            for (std::size_t n = 0; n < map.i_d_A.size(); ++n)
                for (std::size_t m = 0; m < map.i_q_A.size(); ++m) {
                    const double d = (at_row(log.i_d_A, k) - map.i_d_A[n]) / step_d_A,
                                 q = (at_row(log.i_q_A, k) - map.i_q_A[m]) / step_q_A;
                    if (std::abs(d) > kFar || std::abs(q) > kFar) continue;
                    const unsigned low = q <= 1.0 ? 1U : 0U, high = q >= -1.0 ? 2U : 0U;
                    sides[n * map.i_q_A.size() + m] |= (d <= 1.0 ? low | high : 0U) |
                                                       (d >= -1.0 ? (low | high) << 2 : 0U);
                }
    for (std::size_t n = 0; n < sides.size(); ++n) map.nodes[n].seen = sides[n] == 15U;
}

void mark_seen(const TraceSetup& setup, FluxMap& map)
{
    const double step_d_A = map.i_d_A[1] - map.i_d_A[0], step_q_A = map.i_q_A[1] - map.i_q_A[0];
    (setup.regime == Regime::dynamic ? mark_rows : mark_points)(setup, step_d_A, step_q_A, map);
}

/// What a map's deviations are made of: empty, none.
struct Deviations {
    Spreads spread;
    Eigen::MatrixXd hidden;

    /// Of each row of `by`, derivatives by the columns.
    Eigen::VectorXd of(const Eigen::MatrixXd& by) const
    {
        if (hidden.size() == 0) return Eigen::VectorXd::Zero(by.rows());
        const auto square = [&](const Eigen::MatrixXd& c) -> Eigen::ArrayXd {
            return (by * c).cwiseProduct(by).rowwise().sum().cwiseMax(0.0).array();
        };
        return (square(spread.white).max(square(spread.scatter)) + square(hidden)).sqrt();
    }
};

/// Fluxes with their deviations at the nodes of a grid.
std::vector<FluxNode> nodes_of(const Refined& r, const Deviations& of, const FluxMap& grid)
{
    const Point& at = r.point;
    std::vector<FluxNode> nodes;
    Moment m;
    m.ahead = Angle(angle_offset_of(at));
    m.R = at.base[0], m.Ld = at.base[1], m.Lq = at.base[2], m.psi = at.base[3];
    for (const double i_d : grid.i_d_A)
        for (const double i_q : grid.i_q_A) {
            FluxNode node;
            m.i_d = i_d, m.i_q = i_q;
            Vector2 f, g{m.psi + m.Ld * i_d, m.Lq * i_q};
            double by_f[4] = {}, by_g[4] = {};
            Eigen::MatrixXd by = Eigen::MatrixXd::Zero(4, at.columns());
            by(0, 1) = i_d, by(1, 2) = i_q, by(0, 3) = 1.0, by(2, 1) = by(3, 2) = 1.0;
            Eigen::Index j = at.base.size() + at.gain.size();
            for (const Term& t : at.terms) {
                // An angle that is off turns the log's axes: the map is as the controller sees it.
                if (bends(t.input.law) || t.input.law == Law::angle_offset) {
                    evaluate_sum(t.input, t.weights.data(), m, f, g);
                    evaluate_slope(t.input, t.weights.data(), m, by_f, by_g);
                    Vector2 each_f[kMostWeights], each_g[kMostWeights];
                    evaluate(t.input, m, each_f, each_g, t.weights.data());
                    for (int w = 0; w < weights_of(t.input.law); ++w) {
                        double unit[kMostWeights] = {}, f_slope[4] = {}, g_slope[4] = {};
                        unit[w] = 1.0;
                        evaluate_slope(t.input, unit, m, f_slope, g_slope);
                        by(0, j + w) = each_g[w].d, by(1, j + w) = each_g[w].q;
                        by(2, j + w) = g_slope[0], by(3, j + w) = g_slope[3];
                    }
                }
                j += weights_of(t.input.law) + free_shapes_of(t.input);
            }
            node.psi_d_Wb = g.d, node.psi_q_Wb = g.q;
            const Eigen::Vector4d sd = of.of(by);
            node.sd_d_Wb = sd[0], node.sd_q_Wb = sd[1], node.sd_dd_H = sd[2], node.sd_qq_H = sd[3];
            node.L_dd_H = m.Ld + by_g[0], node.L_dq_H = by_g[1], node.L_qq_H = m.Lq + by_g[3];
            nodes.push_back(node);
        }
    return nodes;
}

/// What takes the weights of a map to those of one with other cells: of those that leave hardly any of the flux at the
/// places the likely ones. Cells that the rows hardly reach would else cancel each other with weights that no iron has.
Eigen::MatrixXd taking_likely(const Term& from, const Input& to, const std::vector<Vector2>& places)
{
    constexpr double kHardly = 3e-3;  // of the map's flux: ten times what stays unknown of iron
    const Eigen::MatrixXd a = flux_columns(to, places), b = flux_columns(from.input, places);
    const Eigen::Map<const Eigen::VectorXd> weights(from.weights.data(), b.cols());
    const double hardly_Wb2 = kHardly * kHardly * (b * weights).squaredNorm() / static_cast<double>(b.rows());
    const Eigen::MatrixXd likely = to.shape[3] * hardly_Wb2 * Eigen::MatrixXd::Identity(a.cols(), a.cols());
    return (a.transpose() * a + likely).ldlt().solve(a.transpose() * b);
}

/// The same point with other cells: what they make of the flux is what cells cannot bend. (E143)
Point with_wider_cells(const TraceSetup& setup, Point at)
{
    constexpr double kWider = 1.3;
    const std::vector<Vector2> places = places_of(*setup.logs);
    for (Term& t : at.terms)
        if (is_map(t.input.law)) {
            Input wider = t.input;
            for (std::size_t k = 0; k < 3; ++k) wider.shape[k] *= kWider;
            wider.shape[3] /= kWider * kWider;  // the same bend of the flux takes weights as much larger
            t = taken(t, wider, taking_likely(t, wider, places));
        }
    return at;
}

/// A start for rows that no fit saw, where a map may be far off: predictions that stay close to what is measured.
Point held_close(Point at)
{
    constexpr double kClose = 0.3;
    at.gain = at.gain.cwiseMax(kClose);
    return at;
}

/// Whether the rows tell L_d, L_q and psi apart. Beside a map a cell may stand in for one of them, and flux is flux.
bool tells_plain(const Model& model, const Refined& r)
{
    constexpr double kLeastEigenvalue = 1e-9;  // of unit columns: what rounding of 10^6 rows leaves
    double rows = 0.0;
    Eigen::VectorXd variance;
    const Eigen::MatrixXd flux = seen_information(model, r, variance, rows).block<3, 3>(1, 1);
    if (!(flux.diagonal().minCoeff() > 0.0)) return false;
    const Eigen::Vector3d size = flux.diagonal().cwiseSqrt().cwiseInverse();
    return Symmetric(size.asDiagonal() * flux * size.asDiagonal()).eigenvalues().minCoeff() > kLeastEigenvalue;
}

/// What the model's own error may hide behind R, L_d, L_q and psi, (E111), together as the log tells them: a map has
/// freedom enough to stand in line with anything.
Eigen::MatrixXd hidden_in_plain(const TraceSetup& setup, const Model& model, const Refined& r)
{
    const Eigen::Index n = r.point.columns(), plain = r.point.base.size();
    Eigen::MatrixXd out = Eigen::MatrixXd::Zero(n, n);
    if (setup.regime != Regime::dynamic) return out;
    double rows = 0.0;
    Eigen::VectorXd variance;
    Eigen::MatrixXd information = seen_information(model, r, variance, rows);
    const Eigen::Index others = n - plain;
    information.bottomRows(others).setZero(), information.rightCols(others).setZero();
    const Eigen::VectorXd each = coherent_deviations(model, r.point, information,
                                                     lasting_volt(*setup.logs, r.point, variance, rows));
    const Eigen::MatrixXd shape = information.topLeftCorner(plain, plain).inverse();
    const Eigen::VectorXd by = each.head(plain).cwiseQuotient(shape.diagonal().cwiseMax(1e-300).cwiseSqrt());
    if (by.allFinite()) out.topLeftCorner(plain, plain) = by.asDiagonal() * shape * by.asDiagonal();
    return out;
}

void add_square(double by, double& sd) { sd = std::hypot(sd, by); }

/// What another law makes of the same rows, into the deviations.
void add_distance(const Refined& other, FluxMap& map)
{
    const std::vector<FluxNode> nodes = nodes_of(other, {}, map);
    for (std::size_t k = 0; k < nodes.size(); ++k) {
        FluxNode& to = map.nodes[k];
        add_square(nodes[k].psi_d_Wb - to.psi_d_Wb, to.sd_d_Wb);
        add_square(nodes[k].psi_q_Wb - to.psi_q_Wb, to.sd_q_Wb);
        add_square(nodes[k].L_dd_H - to.L_dd_H, to.sd_dd_H);
        add_square(nodes[k].L_qq_H - to.L_qq_H, to.sd_qq_H);
    }
}

}  // namespace

bool saw_one_current(const std::vector<double>& i_d_A, const std::vector<double>& i_q_A, Vector2& one)
{
    constexpr double kPart = 0.1, kWithin = 0.9;
    const std::size_t n = std::min(i_d_A.size(), i_q_A.size());
    if (n == 0) return false;
    const auto middle = [n](std::vector<double> of) {
        const auto half = of.begin() + static_cast<std::ptrdiff_t>(n / 2);
        std::nth_element(of.begin(), half, of.end());
        return *half;
    };
    one = {middle(i_d_A), middle(i_q_A)};
    double most_A = 0.0;
    for (std::size_t k = 0; k < n; ++k) most_A = std::max(most_A, std::hypot(i_d_A[k], i_q_A[k]));
    std::size_t near = 0;
    for (std::size_t k = 0; k < n; ++k)
        near += std::hypot(i_d_A[k] - one.d, i_q_A[k] - one.q) <= kPart * most_A ? 1 : 0;
    return static_cast<double>(near) >= kWithin * static_cast<double>(n);
}

namespace {

bool stays_at_one(const TraceSetup& setup)
{
    std::vector<double> i_d_A, i_q_A;
    for (const Vector2& at : places_of(*setup.logs)) i_d_A.push_back(at.d), i_q_A.push_back(at.q);
    Vector2 one;
    return saw_one_current(i_d_A, i_q_A, one);
}

}  // namespace

Refined map_beside(const TraceSetup& setup, const Point& at)
{
    const bool asked = setup.regime != Regime::mechanical && setup.regime != Regime::standstill &&
                       any(at, is_polynomial) && !(setup.regime == Regime::dynamic && stays_at_one(setup));
    return asked ? with_map(setup, setup.search(), at) : Refined();
}

Eigen::VectorXd spread_over_iron(const TraceSetup& setup, const Refined& best, const Refined& map)
{
    Eigen::VectorXd spread = Eigen::VectorXd::Zero(best.point.columns());
    const auto& terms = best.point.terms;
    Refined here = best, other = map;
    if (std::any_of(terms.begin(), terms.end(), [](const Term& t) { return is_map(t.input.law); }))
        other = refine(*setup.full, with_wider_cells(setup, best.point), kPasses);
    else if (map.ok)
        here = refine(setup.search(), best.point, kPasses);
    const Eigen::Index n = best.point.base.size();
    if (here.ok && other.ok && (!map.ok || !worse(setup.search(), here, map)))
        spread.head(n) = (other.point.base - here.point.base).cwiseAbs();
    return spread;
}

FluxMap flux_map_of(const TraceSetup& setup, const Refined& best, const Refined& beside_polynomial, bool unnamed)
{
    FluxMap map;
    if (setup.regime == Regime::mechanical || setup.regime == Regime::standstill) return map;
    if (setup.regime == Regime::dynamic && stays_at_one(setup)) return map;
    const bool named = any(best.point, bends);
    if (!named && !unnamed) return map;
    const Replanned all(*setup.full, all_seen(*setup.full));
    // Names say which of the bends alone is told; iron has all of them, as stiff as the log has it.
    Refined now = beside_polynomial.ok ? beside_polynomial : with_map(setup, setup.search(), best.point), other;
    if (!named && !told(setup.search(), refine(setup.search(), best.point, kPasses), now)) return map;
    Point beside;
    if (any(best.point, is_polynomial)) {
        Refined polynomial = refine(setup.search(), best.point, kPasses);
        if (polynomial.ok && now.ok && polynomial.left.heldout > now.left.heldout)
            beside = with_both(setup, at_map(setup, polynomial.point));
        if (polynomial.ok && (!now.ok || worse(setup.search(), polynomial, now)))
            other = std::move(now), now = std::move(polynomial);
    }
    Refined r = refine(all, held_close(now.ok ? now.point : best.point), 2 * kPasses);
    if (beside.columns() > 0) {
        // A map that is far off in few stretches may not find back to them; a polynomial goes on smoothly.
        Refined second = refine(all, held_close(beside), 2 * kPasses);
        if (second.ok && (!r.ok || second.left.seen > r.left.seen)) r = std::move(second);
    }
    r = as_smooth_as_told(all, std::move(r));
    if (!r.ok) return map;
    const Deviations deviations{spreads_of(all, r), hidden_in_plain(setup, all, r)};
    if (!tells_plain(all, r)) return map;
    const Box box = box_of(setup, range_of(*setup.logs, &Log::i_d_A), range_of(*setup.logs, &Log::i_q_A));
    map.i_d_A = axis_of(box.low_A, box.high_A), map.i_q_A = axis_of(-box.most_q_A, box.most_q_A);
    map.nodes = nodes_of(r, deviations, map);
    if (!other.ok) other.point = with_wider_cells(setup, r.point);
    other = refine(all, held_close(other.point), 2 * kPasses);
    if (other.ok) add_distance(other, map);
    if (!std::all_of(map.nodes.begin(), map.nodes.end(),
                     [](const FluxNode& n) { return std::isfinite(n.psi_d_Wb + n.psi_q_Wb + n.sd_d_Wb + n.sd_q_Wb); }))
        return {};
    mark_seen(setup, map);
    // What neither noise nor other cells show of measured iron, of its largest flux.
    constexpr double kLeastPart = 3e-4;
    double most_Wb = 0.0;
    for (const FluxNode& n : map.nodes) most_Wb = std::max(most_Wb, n.seen ? std::hypot(n.psi_d_Wb, n.psi_q_Wb) : 0.0);
    for (FluxNode& n : map.nodes)
        add_square(kLeastPart * most_Wb, n.sd_d_Wb), add_square(kLeastPart * most_Wb, n.sd_q_Wb);
    make_monotone(map);
    return map;
}

namespace {

/// From node `at` outward the flux goes on by `least_Wb` at least; what that changes is not known by as much.
void rise(double& psi_Wb, double& sd_Wb, double inner_Wb, double side, double least_Wb)
{
    const double bound = inner_Wb + side * least_Wb;
    if (side * (psi_Wb - bound) >= 0.0) return;
    add_square(psi_Wb - bound, sd_Wb);
    psi_Wb = bound;
}

/// Steps of an axis from zero current outward, both ways: call(node, the node before it, side).
template <class Call> void outward(const std::vector<double>& axis, Call&& call)
{
    const auto zero = static_cast<std::size_t>(
        std::min_element(axis.begin(), axis.end(), [](double a, double b) { return std::abs(a) < std::abs(b); }) -
        axis.begin());
    for (std::size_t k = zero; k-- > 0;) call(k, k + 1, -1.0);
    for (std::size_t k = zero + 1; k < axis.size(); ++k) call(k, k - 1, 1.0);
}

}  // namespace

void make_monotone(FluxMap& map)
{
    constexpr double kLeastPart = 0.05;  // of the inductance at rest, as sense has it
    const FluxNode zero = between(map, 0.0, 0.0);
    const auto node = [&](std::size_t d, std::size_t q) -> FluxNode& { return map.nodes[d * map.i_q_A.size() + q]; };
    outward(map.i_d_A, [&](std::size_t d, std::size_t inner, double side) {
        const double least_Wb = kLeastPart * zero.L_dd_H * std::abs(map.i_d_A[d] - map.i_d_A[inner]);
        for (std::size_t q = 0; q < map.i_q_A.size(); ++q)
            rise(node(d, q).psi_d_Wb, node(d, q).sd_d_Wb, node(inner, q).psi_d_Wb, side, least_Wb);
    });
    outward(map.i_q_A, [&](std::size_t q, std::size_t inner, double side) {
        const double least_Wb = kLeastPart * zero.L_qq_H * std::abs(map.i_q_A[q] - map.i_q_A[inner]);
        for (std::size_t d = 0; d < map.i_d_A.size(); ++d)
            rise(node(d, q).psi_q_Wb, node(d, q).sd_q_Wb, node(d, inner).psi_q_Wb, side, least_Wb);
    });
}

void put_table(const Point& at, const FluxMap& map, std::vector<TraceInput>& inputs)
{
    if (std::none_of(at.terms.begin(), at.terms.end(), [](const Term& t) { return is_map(t.input.law); })) return;
    const auto of_map = [](const TraceInput& in) {
        return in.effect == name_of(Law::saturation) || in.effect == name_of(Law::cross_saturation);
    };
    inputs.erase(std::remove_if(inputs.begin(), inputs.end(), of_map), inputs.end());
    inputs.insert(inputs.begin(), flux_table(map, range_of(map)));
}

}  // namespace dqw
