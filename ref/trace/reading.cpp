#include "ref/trace/reading.hpp"

#include <algorithm>
#include <cmath>
#include <complex>

#include "ref/fit/explain.hpp"
#include "ref/log/symmetric.hpp"

namespace dqw {
namespace {

using Complex = std::complex<double>;

constexpr std::size_t kStretches = 20;  ///< as the search holds rows out: t of so many is within a tenth of a normal's
constexpr std::size_t kLeastBlocks = 3 * kStretches;  ///< of two in a stretch one may be empty
/// Of the residual. A sign turned or a column exchanged leaves a part: what the other axis has. Rows apart hide where
/// signals are slow; noise that both readings share keeps the part near 1.
constexpr double kFarLess = 0.5, kClearly = 0.8;
constexpr double kSure =
    4.0;  ///< of t: with twenty stretches one of 3000 by chance, and ten readings of rows are tried
constexpr double kWrong = 0.05;  ///< of the voltage: a model that leaves less is no model of turned columns

/// What the block residual is made of, d + j q, averaged over a block: voltage, current, its slope, w i, w.
struct Block {
    Complex v, i, slope, turning;
    double w = 0.0;
};
using Blocks = std::vector<Block>;

/// Rows apart, and a frame turned by so much of a period. Voltages of `v_rows` rows before; currents of `i_rows` rows
/// after, in whose frame they stand; or from before a filter by which a row lacks `late` times what it adds to the row
/// before, as that row has it or, with `stator`, as it is seen from this row's frame.
struct Rows {
    int v_rows = 0, i_rows = 0;
    double v_turn = 0.0;
    const char* how = "";
    double late = 0.0;
    bool stator = false;
};

const Rows kRows[] = {
    {1, 0, 0.0, "with each voltage taken from the row before"},
    {-1, 0, 0.0, "with each voltage taken from the row after"},
    {2, 0, 0.0, "with each voltage taken from two rows before"},
    {-2, 0, 0.0, "with each voltage taken from two rows after"},
    {3, 0, 0.0, "with each voltage taken from three rows before"},
    {-3, 0, 0.0, "with each voltage taken from three rows after"},
    {0, 1, 0.0, "with currents that were sampled one row before the one that they stand in"},
    {0, -1, 0.0, "with currents that were sampled one row after the one that they stand in"},
    {0, 0, 0.5, "with voltages that were turned by the angle at the end of their period, not in its middle"},
    {0, 0, -0.5, "with voltages that were turned by the angle at the start of their period, not in its middle"},
};

/// Of a filter's mean delay, in rows: of one between two of them less is left than rows apart leave.
constexpr double kLate[] = {0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 5.7, 8.0};

constexpr std::size_t kReach = 3;  ///< rows beyond a block that a reading looks at

Block block_of(const TraceSetup& setup, const Piece& piece, std::size_t begin, std::size_t end, const Rows& by)
{
    const Log& log = *piece.log;
    const bool moves = setup.regime == Regime::dynamic;
    const auto at = [](std::size_t k, int rows) { return static_cast<std::size_t>(static_cast<long>(k) + rows); };
    const auto current = [&](std::size_t k) {
        const std::size_t r = at(k, by.i_rows);
        const Complex i(log.i_d_A[r], log.i_q_A[r]);
        if (by.late > 0.0) {
            const Complex before(log.i_d_A[k - 1], log.i_q_A[k - 1]);
            const double w_e = 0.5 * setup.pole_pairs * (log.w_m_rad_s[k - 1] + log.w_m_rad_s[k]);
            return i + by.late * (i - (by.stator ? before * std::polar(1.0, -w_e * log.dt_s) : before));
        }
        if (by.i_rows == 0) return i;
        const double turned = setup.pole_pairs * 0.5 * (log.w_m_rad_s[k] + log.w_m_rad_s[r]) * by.i_rows * log.dt_s;
        return i * std::polar(1.0, turned);
    };
    Block b;
    double time_s = 0.0;
    for (std::size_t k = begin; k < end; ++k) {
        const double dt = moves ? piece.period_s(k) : 1.0;
        const std::size_t next = moves ? k + 1 : k, r = at(k, -by.v_rows);
        const double w = 0.5 * setup.pole_pairs * (log.w_m_rad_s[k] + log.w_m_rad_s[next]);
        const Complex i = 0.5 * (current(k) + current(next)), v(log.v_d_V[r], log.v_q_V[r]);
        b.v += (by.v_turn == 0.0 ? v : v * std::polar(1.0, by.v_turn * w * dt)) * dt;
        b.i += i * dt, b.turning += w * i * dt, b.w += w * dt, time_s += dt;
    }
    if (moves) b.slope = (current(end) - current(begin)) / time_s;
    b.v /= time_s, b.i /= time_s, b.turning /= time_s, b.w /= time_s;
    return b;
}

Blocks blocks_of(const TraceSetup& setup, const Rows& by)
{
    Blocks out;
    const std::size_t reach = setup.regime == Regime::dynamic ? kReach : 0;
    for (const Piece& piece : setup.search().plan().pieces) {
        const std::size_t n = block_rows(*piece.log);
        for (std::size_t k = piece.begin + reach; k + n + reach < piece.end; k += n)
            out.push_back(block_of(setup, piece, k, k + n, by));
    }
    return out;
}

/// The currents of `a`, and `times` what they are off by in `b`.
Blocks beyond(const Blocks& a, const Blocks& b, double times)
{
    Blocks out = a;
    for (std::size_t k = 0; k < out.size(); ++k) {
        Block& to = out[k];
        to.i += times * (b[k].i - a[k].i), to.slope += times * (b[k].slope - a[k].slope);
        to.turning += times * (b[k].turning - a[k].turning);
    }
    return out;
}

/// Signs and exchanges of columns.
struct Columns {
    bool exchange_v = false, exchange_i = false;
    int v_d = 1, v_q = 1, i_d = 1, i_q = 1, w = 1;

    int turned() const { return (v_d < 0) + (v_q < 0) + (i_d < 0) + (i_q < 0) + (w < 0); }
    int changes() const { return turned() + exchange_v + exchange_i; }
    std::string how() const
    {
        std::vector<std::string> names;
        const std::pair<int, const char*> signs[] = {
            {v_d, "v_d"}, {v_q, "v_q"}, {i_d, "i_d"}, {i_q, "i_q"}, {w, "w_m"}};
        for (const auto& [sign, name] : signs)
            if (sign < 0) names.emplace_back(name);
        std::string text;
        for (std::size_t k = 0; k < names.size(); ++k)
            text += (k == 0 ? "" : k + 1 < names.size() ? ", " : " and ") + names[k];
        if (!names.empty()) text = (names.size() > 1 ? "the signs of " : "the sign of ") + text + " turned";
        if (exchange_v) text = "v_d and v_q exchanged" + (text.empty() ? "" : ", " + text);
        if (exchange_i) text = "i_d and i_q exchanged" + (text.empty() ? "" : ", " + text);
        return "with " + text;
    }
};

struct Fitted {
    bool sense = false;
    bool negative = false;                  ///< one is, beyond doubt
    double left = HUGE_VAL, voltage = 0.0;  ///< RMS
    double pole_pairs = 0.0;
    Eigen::VectorXd weights;
    std::vector<double> squares;  ///< of each stretch
};

/// The same model but for signs: what a sign of all currents does, it leaves the residual as it is.
bool mirrored(const Fitted& a, const Fitted& b)
{
    constexpr double kSame = 0.1;  // of a weight; rounding, and no other model comes near in all of them
    for (Eigen::Index j = 0; j < a.weights.size(); ++j)
        if (std::abs(std::abs(a.weights[j]) - std::abs(b.weights[j])) > kSame * std::abs(a.weights[j])) return false;
    return true;
}

/// Of each weight of unit columns, d above q: as wide as the scores of the stretches scatter; infinite where it is not
/// told.
Eigen::VectorXd deviations(const Eigen::MatrixXd& x, const Eigen::VectorXd& e)
{
    const Eigen::Index m = x.rows() / 2, n = static_cast<Eigen::Index>(kStretches);
    Eigen::MatrixXd scatter = Eigen::MatrixXd::Zero(x.cols(), x.cols());
    for (Eigen::Index s = 0; s < n; ++s) {
        Eigen::VectorXd score = Eigen::VectorXd::Zero(x.cols());
        for (Eigen::Index k = (s * m + n - 1) / n; k < ((s + 1) * m + n - 1) / n; ++k)
            score += x.row(k).transpose() * e(k) + x.row(m + k).transpose() * e(m + k);
        scatter += score * score.transpose();
    }
    const Eigen::MatrixXd square = x.transpose() * x, inverse = pseudo_inverse(square);
    // At one operating point two columns may be one: of weights that are told together alone, none is known.
    constexpr double kTold = 1.0 - 1e-6;
    const Eigen::VectorXd told = (inverse * square).diagonal();
    const Eigen::VectorXd sd = (inverse * scatter * inverse).diagonal().cwiseSqrt();
    return (told.array() < kTold).select(HUGE_VAL, sd);
}

/// R, L_d, L_q, psi; where the pole pairs are not known, what turns with the speed has weights of its own, p times
/// those.
Fitted fit(const TraceSetup& setup, const Blocks& blocks, const Columns& c)
{
    const auto m = static_cast<Eigen::Index>(blocks.size());
    const bool apart = !setup.pole_pairs_known && setup.regime == Regime::dynamic;
    Eigen::MatrixXd x = Eigen::MatrixXd::Zero(2 * m, apart ? 6 : 4);
    Eigen::VectorXd y(2 * m);
    const auto read = [](Complex z, bool exchange, int d, int q) {
        return exchange ? Complex(d * z.imag(), q * z.real()) : Complex(d * z.real(), q * z.imag());
    };
    for (Eigen::Index k = 0; k < m; ++k) {
        const Block& b = blocks[static_cast<std::size_t>(k)];
        const Complex v = read(b.v, c.exchange_v, c.v_d, c.v_q), i = read(b.i, c.exchange_i, c.i_d, c.i_q),
                      slope = read(b.slope, c.exchange_i, c.i_d, c.i_q),
                      turning = static_cast<double>(c.w) * read(b.turning, c.exchange_i, c.i_d, c.i_q);
        const Eigen::Index q = m + k;
        y(k) = v.real(), y(q) = v.imag();
        x(k, 0) = i.real(), x(q, 0) = i.imag(), x(k, 1) = slope.real(), x(q, 2) = slope.imag();
        x(q, apart ? 4 : 1) += turning.real(), x(k, apart ? 5 : 2) -= turning.imag(), x(q, 3) = c.w * b.w;
    }
    const Eigen::VectorXd size = x.colwise().norm().cwiseMax(1e-300);
    const Eigen::VectorXd found = least_squares(x * size.cwiseInverse().asDiagonal(), y).cwiseQuotient(size);
    const Eigen::VectorXd e = y - x * found;
    Fitted out;
    out.sense = found.minCoeff() > 0.0;
    out.negative =
        (found + kSure * deviations(x * size.cwiseInverse().asDiagonal(), e).cwiseQuotient(size)).minCoeff() < 0.0;
    out.weights = found;
    // Of both axes, each as its inductance tells it.
    if (apart) out.pole_pairs = (found[4] + found[5]) / (found[1] + found[2]);
    out.left = std::sqrt(e.squaredNorm() / static_cast<double>(2 * m));
    out.voltage = std::sqrt(y.squaredNorm() / static_cast<double>(2 * m));
    out.squares.assign(kStretches, 0.0);
    for (Eigen::Index k = 0; k < m; ++k)
        out.squares[static_cast<std::size_t>(k) * kStretches / static_cast<std::size_t>(m)] += e(k) * e(k) +
                                                                                               e(m + k) * e(m + k);
    return out;
}

double t_of(const Fitted& a, const Fitted& b)
{
    double mean = 0.0, square = 0.0;
    const auto gain = [&](std::size_t k) { return 0.5 * std::log(a.squares[k] / b.squares[k]); };
    const double n = static_cast<double>(kStretches);
    for (std::size_t k = 0; k < kStretches; ++k) mean += gain(k) / n;
    for (std::size_t k = 0; k < kStretches; ++k) square += std::pow(gain(k) - mean, 2) / (n - 1.0);
    return mean / std::sqrt(std::max(square, 1e-12) / n);
}

Reading reading_of(const Fitted& as_is, const Fitted& other, Reading::Kind kind, const std::string& how)
{
    return {kind, how, false, other.left / as_is.left, t_of(as_is, other), other.pole_pairs};
}

/// The log as it stands; no blocks where that is no matter of columns.
struct AsItStands {
    Blocks blocks;
    Fitted fit;
    bool wrong() const { return !fit.sense || fit.left > kWrong * fit.voltage; }
};

AsItStands as_it_stands(const TraceSetup& setup)
{
    AsItStands out;
    if (setup.regime != Regime::dynamic && setup.regime != Regime::steady) return out;
    out.blocks = blocks_of(setup, {});
    if (out.blocks.size() < kLeastBlocks) return {};
    out.fit = fit(setup, out.blocks, {});
    return out;
}

/// Signs and exchanges of columns.
std::optional<Reading> turned(const TraceSetup& setup, const AsItStands& is)
{
    const Fitted& as_is = is.fit;
    std::optional<Reading> best;
    int changes = 0;
    for (unsigned bits = 1; is.wrong() && bits < 128; ++bits) {
        const auto sign = [&](unsigned bit) { return (bits >> bit) & 1u ? -1 : 1; };
        const Columns c{(bits & 1u) != 0, (bits & 2u) != 0, sign(2), sign(3), sign(4), sign(5), sign(6)};
        const Fitted f = fit(setup, is.blocks, c);
        if (!f.sense) continue;
        const Reading r = reading_of(as_is, f, Reading::Kind::signs, c.how());
        // A phase order turned is v_q, i_q and w turned: of two that leave the same the one with fewer changes.
        constexpr double kSame = 1e-6;
        if (!(r.part < kFarLess && r.t > kSure) && !(as_is.negative && mirrored(as_is, f))) continue;
        const bool same = best && std::abs(r.part - best->part) < kSame;
        if (!best || (same ? c.changes() < changes : r.part < best->part)) best = r, changes = c.changes();
    }
    return best;
}

}  // namespace

bool is_misread(const TraceSetup& setup)
{
    const AsItStands is = as_it_stands(setup);
    if (is.blocks.empty() || !is.wrong()) return false;
    if (!setup.turns_apart.empty()) return true;
    const std::optional<Reading> reading = turned(setup, is);
    // What an effect makes of a log leaves more; of a sign of all currents nothing is left that was not.
    constexpr double kBeyondEffects = 0.2;
    return reading && (reading->part < kBeyondEffects || is.fit.negative);
}

std::optional<Reading> other_reading(const TraceSetup& setup)
{
    const AsItStands is = as_it_stands(setup);
    const Fitted& as_is = is.fit;
    if (is.blocks.empty() || !(as_is.left > 0.0)) return {};
    std::optional<Reading> best = turned(setup, is);
    // Signs first: rows apart say nothing of columns that are not what they are called.
    if (best || setup.regime != Regime::dynamic) return best;
    for (const Rows& by : kRows) {
        const Fitted f = fit(setup, blocks_of(setup, by), {});
        if (!f.sense) continue;
        Reading r = reading_of(as_is, f, Reading::Kind::rows, by.how);
        r.rows_before = by.v_rows, r.previous = by.v_rows == -1;
        if (r.part < kClearly && r.t > kSure && (!best || r.part < best->part)) best = r;
    }
    for (const bool stator : {false, true}) {
        const Blocks one = blocks_of(setup, {0, 0, 0.0, "", 1.0, stator});
        for (const double late : kLate) {
            const Fitted f = fit(setup, beyond(is.blocks, one, late), {});
            if (!f.sense) continue;
            const std::string how = "with the currents from before a filter of about " + figure(late) +
                                    (late == 1.0 ? " row" : " rows");
            Reading r = reading_of(as_is, f, Reading::Kind::filter, how);
            if (r.part < kFarLess && r.t > kSure && (!best || r.part < best->part)) best = r;
        }
    }
    return best;
}

}  // namespace dqw
