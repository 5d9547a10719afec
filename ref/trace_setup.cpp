#include "trace_setup.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "blocks.hpp"
#include "effect.hpp"
#include "fit.hpp"
#include "residual.hpp"
#include "trace_mechanical.hpp"
#include "trace_plan.hpp"
#include "trace_static.hpp"

namespace dqw {
namespace {

constexpr std::size_t kLeastPiece = 30;
constexpr double kLeastSpan_K = 0.5;  ///< of a temperature column, below which it tells nothing
constexpr std::size_t kLeastRows = 400, kLeastSettled = 8;
constexpr std::size_t kSearchRows = 45000, kSearchWindow = 3000;
constexpr std::size_t kStretches = 20, kFine = 10, kGuard = 60;
constexpr std::size_t kSettledStretches = 60, kSettledFine = 3;
constexpr std::size_t kFewRows = 400;  ///< settled rows: fewer are operating points, more are a record in time

double at_row(const std::vector<double>& column, std::size_t k) { return column.empty() ? 0.0 : column[k]; }

struct Range {
    double least = HUGE_VAL, most = -HUGE_VAL, square = 0.0, sum = 0.0, n = 0.0;
    void add(double x) { least = std::min(least, x), most = std::max(most, x), square += x * x, sum += x, n += 1.0; }
    double span() const { return n > 0.0 ? most - least : 0.0; }
    double size() const { return n > 0.0 ? std::max(std::abs(least), std::abs(most)) : 0.0; }
    double sd() const { return n > 0.0 ? std::sqrt(std::max(square / n - sum * sum / n / n, 0.0)) : 0.0; }
};

Range range_of(const std::vector<Log>& logs, std::vector<double> Log::*column)
{
    Range r;
    for (const Log& log : logs)
        for (double x : log.*column) r.add(x);
    return r;
}

bool everywhere(const std::vector<Log>& logs, std::vector<double> Log::*column)
{
    return std::all_of(logs.begin(), logs.end(), [&](const Log& log) { return !(log.*column).empty(); });
}

/// Settled points that follow one another at the same currents and speed are one operating point, held out as a whole.
Plan point_plan(const std::vector<Log>& logs, double i_base_A, double w_base)
{
    Plan plan;
    for (const Log& log : logs) plan.pieces.push_back({&log, 0, log.rows(), 0.0});
    for (const Piece& piece : plan.pieces) {
        const Log& log = *piece.log;
        bool heldout = false;
        for (std::size_t k = 0; k < log.rows();) {
            std::size_t end = k + 1;
            const auto same = [&](const std::vector<double>& column, double base) { return std::abs(at_row(column, end) - at_row(column, k)) <= 0.01 * base; };
            while (end < log.rows() && same(log.i_d_A, i_base_A) && same(log.i_q_A, i_base_A) && same(log.w_m_rad_s, w_base)) ++end;
            plan.blocks.push_back({&piece, k, end, heldout});
            heldout = !heldout;
            k = end;
        }
    }
    return plan;
}

std::vector<Piece> settled_pieces(const std::vector<Log>& logs)
{
    std::vector<Piece> pieces;
    for (const Log& log : logs) pieces.push_back({&log, 0, log.rows(), 0.0});
    return pieces;
}

/// A long piece in eight, so that they can be worked on side by side.
std::vector<Piece> cut(const std::vector<Piece>& pieces)
{
    constexpr std::size_t kLong = 100000, kParts = 8;
    std::vector<Piece> out;
    for (const Piece& piece : pieces) {
        const std::size_t parts = piece.rows() > kLong ? kParts : 1;
        for (std::size_t n = 0; n < parts; ++n) {
            Piece part = piece;
            part.begin = piece.begin + n * piece.rows() / parts;
            part.end = piece.begin + (n + 1) * piece.rows() / parts;
            out.push_back(part);
        }
    }
    return out;
}

class Catalogue {
public:
    Catalogue(TraceSetup& setup, const std::vector<std::string>& only) : setup_(setup), only_(only) {}

    bool wanted(Law law) const { return only_.empty() || std::find(only_.begin(), only_.end(), name_of(law)) != only_.end(); }
    void add(const Input& input)
    {
        if (wanted(input.law)) setup_.candidates.push_back({{input}});
    }
    void add(const Input& a, const Input& b)
    {
        if (wanted(a.law) && wanted(b.law)) setup_.candidates.push_back({{a, b}});
    }
    void cannot(Law law, const std::string& why)
    {
        if (wanted(law)) setup_.untestable.push_back({name_of(law), "not tested: " + why, std::nan("")});
    }
    /// Adds the input where `why` is empty.
    void add_unless(const Input& input, const std::string& why)
    {
        if (why.empty())
            add(input);
        else
            cannot(input.law, why);
    }

private:
    TraceSetup& setup_;
    const std::vector<std::string>& only_;
};

void temperature_candidates(const std::vector<Log>& logs, Catalogue& c, bool turns, bool moves)
{
    const bool winding = everywhere(logs, &Log::temp_winding_C) && range_of(logs, &Log::temp_winding_C).span() > kLeastSpan_K;
    const bool magnet = everywhere(logs, &Log::temp_magnet_C) && range_of(logs, &Log::temp_magnet_C).span() > kLeastSpan_K;
    const bool heats = everywhere(logs, &Log::t_s) && moves;
    const auto state = [](Law law, int heat) {
        Input in{law};
        in.heat = heat;
        return in;
    };
    constexpr int kTimes = static_cast<int>(sizeof kHeatTimes / sizeof *kHeatTimes);
    if (winding)
        c.add({Law::winding_temperature});
    else if (heats)
        for (int n = 1; n <= kTimes; ++n) c.add(state(Law::winding_temperature, n));
    else
        c.cannot(Law::winding_temperature, "no temperature that changes, and no time or no current for a heating state");
    if (!turns) {
        c.cannot(Law::magnet_temperature, "the machine does not turn");
        return;
    }
    if (magnet)
        c.add({Law::magnet_temperature});
    else if (winding)
        c.add(state(Law::magnet_temperature, -1));
    else if (heats)
        for (int n = 1; n <= kTimes; ++n) c.add(state(Law::magnet_temperature, n));
    else
        c.cannot(Law::magnet_temperature, "no temperature that changes, and no time or no current for a heating state");
    if (winding)
        c.add({Law::winding_temperature}, magnet ? Input{Law::magnet_temperature} : state(Law::magnet_temperature, -1));
    else if (heats)
        for (int n = 1; n <= kTimes; ++n)
            for (int m = n; m <= kTimes; ++m) c.add(state(Law::winding_temperature, n), state(Law::magnet_temperature, m));
}

/// Faults of the current sensors, tried beside the effects so that no effect is named for them.
void clipped_candidates(TraceSetup& setup, bool angle)
{
    double most = 0.0;
    for (std::size_t n = 0; n < setup.logs->size(); ++n) {
        const Log& log = (*setup.logs)[n];
        for (std::size_t k = 0; k < log.rows(); ++k) {
            const double alpha = setup.columns[n].cos_e[k] * log.i_d_A[k] - setup.columns[n].sin_e[k] * log.i_q_A[k];
            const double beta = setup.columns[n].sin_e[k] * log.i_d_A[k] + setup.columns[n].cos_e[k] * log.i_q_A[k];
            most = std::max({most, std::abs(alpha), 0.5 * std::abs(alpha) + 0.5 * std::sqrt(3.0) * std::abs(beta)});
        }
    }
    for (double part : {0.5, 0.7, 0.85})
        for (double start : angle ? std::vector<double>{0.0} : std::vector<double>{0.0, 0.26, 0.52, 0.79}) {
            Input in{Law::clipped_current, {part * most, start, 0, 0}};
            in.free_angle = !angle;
            setup.candidates.push_back({{in}});
        }
}

void electrical_candidates(TraceSetup& setup, Catalogue& c)
{
    const std::vector<Log>& logs = *setup.logs;
    const bool settled = setup.regime != Regime::dynamic;
    const double ib = setup.i_base_A;
    Range w, i_d, i_q;
    for (const Log& log : logs)
        for (std::size_t k = 0; k < log.rows(); ++k)
            w.add(setup.regime == Regime::standstill ? 0.0 : at_row(log.w_m_rad_s, k)), i_d.add(at_row(log.i_d_A, k)), i_q.add(at_row(log.i_q_A, k));
    const bool turns = w.size() > 0.0, angle = everywhere(logs, &Log::theta_e_rad) || everywhere(logs, &Log::theta_m_rad);
    const bool moves = std::max(i_d.sd(), i_q.sd()) > 1e-3 * ib;
    // An angle is swept where it covers a turn; an integrated one needs rows in time.
    double swept = 0.0;
    for (std::size_t n = 0; n < logs.size(); ++n) {
        if (!angle && settled) continue;
        const TraceColumns& columns = setup.columns[n];
        for (std::size_t k = 1; k < logs[n].rows(); ++k)
            swept += std::abs(
                std::remainder(std::atan2(columns.sin_e[k], columns.cos_e[k]) - std::atan2(columns.sin_e[k - 1], columns.cos_e[k - 1]), 2.0 * M_PI));
    }
    const std::string no_current = moves ? "" : "the currents do not change";
    const std::string one_point = moves || w.span() > 1e-3 * w.size() ? "" : "one operating point: neither the currents nor the speed change";
    const std::string no_turn = turns ? "" : "the machine does not turn";
    const std::string no_sweep = swept > 6.0 ? "" : angle ? "the angle hardly changes" : "no angle column, and none can be integrated";
    const auto first = [](const std::string& a, const std::string& b) { return a.empty() ? b : a; };

    std::string dead = no_current;
    if (dead.empty() && settled && !angle && turns) dead = "no angle column: the phases' currents are not known";
    if (dead.empty()) {
        for (double width : {0.005, 0.02, 0.08}) {
            if (angle) {
                c.add({Law::dead_time, {width * ib, 0, 0, 0}});
                continue;
            }
            for (double start : {0.0, 0.26, 0.52, 0.79}) {
                Input in{Law::dead_time, {width * ib, start, 0, 0}};
                in.free_angle = true;
                c.add(in);
            }
        }
    } else {
        c.cannot(Law::dead_time, dead);
    }
    const std::string no_flux = first(settled ? no_turn : "", no_current);
    c.add_unless({Law::saturation, {ib}}, no_flux);
    c.add_unless({Law::cross_saturation, {ib}}, no_flux);
    if (no_flux.empty()) c.add({Law::saturation, {ib}}, {Law::cross_saturation, {ib}});
    temperature_candidates(logs, c, turns, i_d.size() + i_q.size() > 0.0);
    c.add_unless({Law::iron_loss}, first(no_turn, no_current));
    if (no_sweep.empty() && setup.regime == Regime::dynamic && c.wanted(Law::clipped_current)) clipped_candidates(setup, angle);
    c.add_unless({Law::flux_harmonics, {6}}, first(no_turn, no_sweep));
    if (no_turn.empty() && no_sweep.empty()) c.add({Law::flux_harmonics, {6}}, {Law::flux_harmonics, {12}});
    c.add_unless({Law::current_offset}, no_sweep);
    c.add_unless({Law::current_gain_mismatch}, first(no_sweep, no_current));
    c.add_unless({Law::angle_offset}, first(no_turn, one_point));
    c.add_unless({Law::delay}, settled ? first(no_turn, one_point) : no_current);
    c.add_unless({Law::skin_effect}, first(no_turn, first(no_current, w.span() > 0.1 * w.size() ? "" : "one speed only")));
    c.add_unless({Law::phase_resistance_imbalance}, first(no_sweep, no_current));
    c.add_unless({Law::voltage_offset}, no_current);
}

void mechanical_candidates(TraceSetup& setup, Catalogue& c)
{
    const Range w = range_of(*setup.logs, &Log::w_m_rad_s);
    const double base = w.size();
    const std::string still = w.sd() > 1e-3 * base ? "" : "the speed does not change";
    const bool both_ways = w.least < -0.02 * base && w.most > 0.02 * base;
    // Each log may turn one way only, and they the other way.
    const std::string one_way = both_ways ? "" : "the machine turns one way only: it cannot be told from Coulomb friction";
    for (double part : {0.005, 0.03}) {
        c.add_unless({Law::coulomb_friction, {part * base}}, still);
        if (still.empty() && one_way.empty())
            c.add({Law::direction_asymmetry, {part * base}}), c.add({Law::coulomb_friction, {part * base}}, {Law::direction_asymmetry, {part * base}});
        if (still.empty())
            for (double fall : {0.03, 0.1, 0.3})
                c.add({Law::stribeck_friction, {part * base, fall * base}}),
                    c.add({Law::coulomb_friction, {part * base}}, {Law::stribeck_friction, {part * base, fall * base}});
    }
    if (!still.empty()) c.cannot(Law::stribeck_friction, still);
    if (!still.empty() || !one_way.empty()) c.cannot(Law::direction_asymmetry, still.empty() ? one_way : still);
    c.add_unless({Law::load_torque}, still);
    double turned = 0.0;
    for (const auto& angle : setup.angle)
        for (std::size_t k = 1; k < angle.size(); ++k) turned += std::abs(std::remainder(angle[k] - angle[k - 1], 2.0 * M_PI));
    if (turned > 6.0)
        for (int n = 1; n <= 48; ++n) c.add({Law::cogging_torque, {static_cast<double>(n)}});
    else
        c.cannot(Law::cogging_torque, "the shaft does not make a turn");
}

std::optional<double> stated_pole_pairs(const std::vector<Log>& logs)
{
    std::optional<double> p;
    for (const Log& log : logs) {
        if (!log.machine.pole_pairs) continue;
        if (p && *p != *log.machine.pole_pairs) throw std::invalid_argument(log.path + ": pole_pairs differs from the other logs': not one machine");
        p = log.machine.pole_pairs;
    }
    return p;
}

/// Electrical turns in a mechanical one, by the log's own angle; 0 where it does not say.
double pole_pairs_of_angles(const std::vector<Log>& logs)
{
    constexpr double kMost = 200.0, kMostStep_rad = 2.0, kLeastTurned_rad = 6.0, kNear = 0.05;
    double xy = 0.0, xx = 0.0, turned = 0.0;
    for (const Log& log : logs) {
        if (log.theta_e_rad.empty() || log.t_s.empty() || log.w_m_rad_s.empty()) return 0.0;
        for (const Piece& piece : pieces_of(log, 2))
            for (std::size_t k = piece.begin + 1; k < piece.end; ++k) {
                const double electrical = std::remainder(log.theta_e_rad[k] - log.theta_e_rad[k - 1], 2.0 * M_PI);
                const double shaft = 0.5 * (log.w_m_rad_s[k] + log.w_m_rad_s[k - 1]) * (log.t_s[k] - log.t_s[k - 1]);
                // A step near half a turn may be one the other way.
                if (std::abs(electrical) > kMostStep_rad) return 0.0;
                xy += electrical * shaft, xx += shaft * shaft, turned += std::abs(electrical);
            }
    }
    if (!(xx > 0.0) || turned < kLeastTurned_rad) return 0.0;
    const double p = xy / xx, whole = std::round(p);
    return whole >= 1.0 && whole <= kMost && std::abs(p - whole) < kNear * whole && std::abs(p - whole) < 0.3 ? whole : 0.0;
}

void find_pole_pairs(TraceSetup& setup)
{
    const std::vector<Log>& logs = *setup.logs;
    if (const auto p = stated_pole_pairs(logs)) {
        setup.pole_pairs = *p;
        return;
    }
    if (range_of(logs, &Log::w_m_rad_s).size() == 0.0 || setup.regime == Regime::standstill) {
        setup.pole_pairs_known = false;
        return;
    }
    if (const double turns = pole_pairs_of_angles(logs); turns > 0.0) {
        setup.pole_pairs = turns;
        setup.notes.push_back("pole pairs found: " + std::to_string(static_cast<int>(turns)) + ", from the electrical angle");
        return;
    }
    if (setup.regime == Regime::dynamic) {
        FitOptions options;
        options.parameters = {"pole_pairs"};
        for (const Estimate& e : fit(logs, options).parameters)
            if (e.name == "pole_pairs") {
                setup.pole_pairs = e.value;
                setup.notes.push_back("pole pairs found: " + std::to_string(static_cast<int>(e.value)));
                return;
            }
    }
    setup.pole_pairs_known = false;
    setup.notes.push_back("the pole pairs are not known: L and psi come out multiplied by them (say --pole-pairs)");
}

void electrical_setup(TraceSetup& setup)
{
    const std::vector<Log>& logs = *setup.logs;
    find_pole_pairs(setup);
    double begin = HUGE_VAL, end = -HUGE_VAL;
    setup.i_base_A = 0.0;
    for (const Log& log : logs) {
        for (std::size_t k = 0; k < log.rows(); ++k) setup.i_base_A = std::max(setup.i_base_A, std::hypot(at_row(log.i_d_A, k), at_row(log.i_q_A, k)));
        if (!log.t_s.empty()) begin = std::min(begin, log.t_s.front()), end = std::max(end, log.t_s.back());
    }
    if (!(setup.i_base_A > 0.0)) setup.i_base_A = 1.0;
    setup.span_s = std::max(end - begin, 0.0);
    if (!std::isfinite(setup.span_s)) setup.span_s = 0.0;
    for (const Log& log : logs) setup.columns.push_back(trace_columns(log, setup.pole_pairs, setup.i_base_A, setup.span_s));
    if (setup.regime != Regime::dynamic) {
        std::size_t rows = 0;
        for (const Log& log : logs) rows += log.rows();
        if (rows < kLeastSettled)
            throw std::invalid_argument(logs.front().path + ": " + std::to_string(rows) + " rows; a trace needs at least " + std::to_string(kLeastSettled) +
                                        " to hold some out");
        Plan plan = rows < kFewRows ? point_plan(logs, setup.i_base_A, range_of(logs, &Log::w_m_rad_s).size())
                                    : alternate_plan(settled_pieces(logs), kSettledStretches, kSettledFine, 0);
        if (plan.blocks.size() < kLeastSettled) plan = alternate_plan(settled_pieces(logs), kSettledStretches, kSettledFine, 0);
        setup.full = std::make_unique<TraceStatic>(logs, setup.columns, setup.pole_pairs, std::move(plan));
        Point start;
        start.base = Eigen::Vector4d(1.0, 1e-3, 1e-3, 0.0);
        setup.starts.push_back(start);
        return;
    }
    const std::vector<Piece> pieces = pieces_of(logs, kLeastPiece);
    if (rows_of(pieces) < kLeastRows)
        throw std::invalid_argument(logs.front().path + ": " + std::to_string(rows_of(pieces)) + " rows without a gap; a trace needs at least " +
                                    std::to_string(kLeastRows) + " to hold some out");
    setup.full = std::make_unique<TraceDynamic>(logs, setup.columns, setup.pole_pairs, alternate_plan(cut(pieces), kStretches, kFine, kGuard));
    const std::vector<Piece> windows = spread_sample(pieces, kSearchRows, kSearchWindow);
    if (rows_of(windows) < rows_of(pieces))
        setup.part = std::make_unique<TraceDynamic>(logs, setup.columns, setup.pole_pairs,
                                                    alternate_plan(windows, rows_of(windows) / kSearchWindow, kFine, 2 * kGuard));
    for (const ElectricalStart& s : electrical_starts(setup.part ? windows : pieces, setup.pole_pairs)) {
        Point start;
        start.base = Eigen::Vector4d(s.R_ohm, s.Ld_H, s.Lq_H, s.psi_Wb);
        start.gain = Eigen::Vector2d(0.1, 0.1);
        setup.starts.push_back(start);
    }
}

void mechanical_setup(TraceSetup& setup, bool averaged)
{
    const std::vector<Log>& logs = *setup.logs;
    double constant = 0.0;
    for (const Log& log : logs)
        if (log.machine.torque_constant_Nm_A) constant = *log.machine.torque_constant_Nm_A;
    std::string source, said;
    for (const Log& log : logs) {
        setup.torque.push_back(torque_of(log, constant, source));
        if (setup.torque.back().empty())
            throw std::invalid_argument(log.path + ": no torque: neither torque_Nm, nor i_q_A with a torque constant, nor torque_cmd_Nm");
        setup.angle.push_back(shaft_angle(log));
        if (source != said) setup.notes.push_back("torque is " + source);
        said = source;
    }
    const std::vector<Piece> pieces = pieces_of(logs, kLeastPiece);
    if (rows_of(pieces) < kLeastRows)
        throw std::invalid_argument(logs.front().path + ": " + std::to_string(rows_of(pieces)) + " rows without a gap; a trace needs at least " +
                                    std::to_string(kLeastRows) + " to hold some out");
    const std::size_t stretches = kStretches * logs.size();
    setup.full = std::make_unique<TraceMechanical>(logs, setup.torque, setup.angle, alternate_plan(pieces, stretches, averaged ? kFine / 2 : kFine, kGuard),
                                                   averaged);
    const std::vector<Piece> windows = spread_sample(pieces, 2 * kSearchRows, 2 * kSearchWindow);
    if (rows_of(windows) < rows_of(pieces))
        setup.part = std::make_unique<TraceMechanical>(logs, setup.torque, setup.angle,
                                                       alternate_plan(windows, rows_of(windows) / (2 * kSearchWindow), kFine, kGuard), averaged);
    std::vector<const std::vector<double>*> of_piece;
    for (const Piece& piece : pieces) of_piece.push_back(&setup.torque[static_cast<std::size_t>(piece.log - logs.data())]);
    for (const MechanicalStart& s : mechanical_starts(pieces, of_piece)) {
        Point start;
        start.base = Eigen::Vector2d(s.J_kgm2, s.B_Nms_rad);
        start.gain = Eigen::VectorXd::Constant(averaged ? 0 : 1, 0.1);
        setup.starts.push_back(start);
    }
}

void check(const std::vector<Log>& logs)
{
    if (logs.empty()) throw std::invalid_argument("no log to trace");
    const auto need = [](const Log& log, const std::vector<double>& column, const char* name) {
        if (column.empty() || column.size() != log.rows()) throw std::invalid_argument(log.path + ": this regime needs " + std::string(name) + " on every row");
    };
    for (const Log& log : logs) {
        if (log.regime != logs.front().regime) throw std::invalid_argument(log.path + ": its regime is not that of " + logs.front().path);
        if (log.regime == Regime::dynamic || log.regime == Regime::mechanical) need(log, log.t_s, "t_s");
        if (log.regime != Regime::standstill) need(log, log.w_m_rad_s, "w_m_rad_s");
        if (log.regime == Regime::dynamic || log.regime == Regime::steady)
            need(log, log.v_d_V, "v_d_V"), need(log, log.v_q_V, "v_q_V"), need(log, log.i_d_A, "i_d_A"), need(log, log.i_q_A, "i_q_A");
    }
}

}  // namespace

std::unique_ptr<TraceSetup> trace_setup(const std::vector<Log>& logs, const std::vector<std::string>& only, bool averaged)
{
    check(logs);
    for (const std::string& name : only)
        if (!find_effect(name)) throw std::invalid_argument("unknown effect " + name);
    auto setup = std::make_unique<TraceSetup>();
    setup->logs = &logs;
    setup->regime = logs.front().regime;
    const Range speeds = range_of(logs, &Log::w_m_rad_s);
    setup->speed_base_rad_s = speeds.size();
    setup->one_speed = setup->regime == Regime::steady && speeds.span() < 0.05 * speeds.size();
    Catalogue catalogue(*setup, only);
    if (setup->regime == Regime::mechanical) {
        mechanical_setup(*setup, averaged);
        mechanical_candidates(*setup, catalogue);
    } else {
        electrical_setup(*setup);
        electrical_candidates(*setup, catalogue);
    }
    return setup;
}

TraceInput input_of(const TraceSetup& setup, const Point& at, const Term& term)
{
    TraceInput in{name_of(term.input.law), {}, {}};
    in.weights.assign(term.weights.begin(), term.weights.begin() + weights_of(term.input.law));
    const auto& s = term.input.shape;
    switch (term.input.law) {
    case Law::dead_time:
    case Law::stribeck_friction: in.shape = {s[0], s[1]}; break;
    case Law::saturation:
    case Law::cross_saturation:
    case Law::flux_harmonics:
    case Law::coulomb_friction:
    case Law::direction_asymmetry:
    case Law::cogging_torque: in.shape = {s[0]}; break;
    case Law::winding_temperature:
    case Law::magnet_temperature:
        in.shape = {kReferenceTemperature_C, term.input.heat > 0 ? kHeatTimes[term.input.heat - 1] * setup.span_s : 0.0};
        // The heating state is 1 where this current flows for long.
        if (term.input.heat > 0) {
            in.shape.push_back(setup.i_base_A);
            in.reach = 0.0;
            for (const TraceColumns& c : setup.columns)
                for (double h : c.heat[static_cast<std::size_t>(term.input.heat - 1)]) in.reach = std::max(in.reach, h);
        }
        break;
    case Law::iron_loss:
    case Law::current_offset:
    case Law::current_gain_mismatch: in.shape = {at.base[0], at.base[1], at.base[2]}; break;
    case Law::angle_offset: in.shape = {at.base[1], at.base[2], at.base[3]}; break;
    case Law::delay:
        if (setup.regime != Regime::dynamic) in.shape = {1.0};
        break;
    default: break;
    }
    return in;
}

}  // namespace dqw
