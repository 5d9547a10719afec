#include "ref/trace/setup.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "ref/effect/effect.hpp"
#include "ref/effect/range.hpp"
#include "ref/fit/explain.hpp"
#include "ref/fit/fit.hpp"
#include "ref/log/residual.hpp"
#include "ref/log/turns.hpp"
#include "ref/model/blocks.hpp"
#include "ref/model/hat.hpp"
#include "ref/model/mechanical.hpp"
#include "ref/model/open_circuit.hpp"
#include "ref/model/plan.hpp"
#include "ref/model/settled.hpp"
#include "ref/trace/candidates.hpp"
#include "ref/trace/flux_map.hpp"
#include "ref/trace/hexagon.hpp"

namespace dqw {
namespace {

// How a log is divided; halved or doubled: (E48).
/// Stretches, in turn seen and held out, and the fine blocks of one: a hundred that are held out give t of (E45) within
/// a tenth. Of a stretch the guard leaves five reported blocks of 20 rows at least.
constexpr std::size_t kStretches = 20, kFewestStretches = 4, kLeastStretch = 150, kFine = 10, kGuard = 60;
/// Rows without a gap: fewer hardly hold a reported block.
constexpr std::size_t kLeastPiece = 30;
/// Rows, a hundred in each of the fewest stretches; settled points, four seen and four held out.
constexpr std::size_t kLeastRows = 400, kLeastSettled = 8;
/// A search looks at this many rows of a longer log, in eight windows: more cost time. Not varied.
constexpr std::size_t kSearchRows = 24000, kSearchWindow = 3000;
/// Halves of hats in a stretch, and of three hats in a fine block.
constexpr std::size_t kHatsInStretch = 8, kHatsInBlock = 4;
constexpr std::size_t kSettledStretches = 60, kSettledFine = 3;
constexpr std::size_t kFewRows = 400;  ///< settled rows: fewer are operating points, more are a record in time
constexpr double kSamePoint = 0.01;    ///< of the largest: sensors' noise within one operating point
constexpr double kOneSpeed = 0.05;     ///< of the largest: within it no effect differs by more than a tenth
constexpr double kStartGain = 0.1;     ///< of which refine() reaches each from 0.004 to 1 in two passes

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
            const auto same = [&](const std::vector<double>& column, double base) {
                return std::abs(at_row(column, end) - at_row(column, k)) <= kSamePoint * base;
            };
            while (end < log.rows() && same(log.i_d_A, i_base_A) && same(log.i_q_A, i_base_A) &&
                   same(log.w_m_rad_s, w_base))
                ++end;
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
    constexpr std::size_t kLong = 100000, kParts = 8;  // a shorter one is done within a second; cores at hand
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

std::optional<double> stated_pole_pairs(const std::vector<Log>& logs)
{
    std::optional<double> p;
    for (const Log& log : logs) {
        if (!log.machine.pole_pairs) continue;
        if (p && *p != *log.machine.pole_pairs)
            throw std::invalid_argument(log.path + ": pole_pairs differs from the other logs': not one machine");
        p = log.machine.pole_pairs;
    }
    return p;
}

void find_pole_pairs(TraceSetup& setup, double assumed)
{
    const std::vector<Log>& logs = *setup.logs;
    if (const auto p = stated_pole_pairs(logs)) {
        constexpr double kNear = 0.05;  // of a wrong unit it is 2 pi or 9.55; 20 pole pairs for 21 pass
        setup.pole_pairs = *p;
        const double turns = turns_of_angles(logs);
        if (turns != 0.0 && std::abs(turns / *p - 1.0) > kNear)
            setup.turns_apart = "theta_e_rad turns " + figure(turns) +
                                " times as far as the shaft by w_m_rad_s, and the pole pairs are " + figure(*p) +
                                ": check the speed's unit and sign";
        if (!setup.turns_apart.empty()) setup.notes.push_back(setup.turns_apart);
        return;
    }
    if (assumed > 0.0) {
        setup.pole_pairs = assumed;
        return;
    }
    if (range_of(logs, &Log::w_m_rad_s).size() == 0.0 || setup.regime == Regime::standstill) {
        setup.pole_pairs_known = false;
        return;
    }
    if (const double turns = pole_pairs_of_angles(logs); turns > 0.0) {
        setup.pole_pairs = turns;
        setup.notes.push_back("pole pairs found: " + std::to_string(static_cast<int>(turns)) +
                              ", from the electrical angle");
        return;
    }
    if (setup.regime == Regime::dynamic) {
        FitOptions options;
        options.parameters = {"pole_pairs"};
        const Result plain = fit(logs, options);
        setup.real_pole_pairs = plain.real_pole_pairs;
        for (const Estimate& e : plain.parameters)
            if (e.name == "pole_pairs") {
                setup.pole_pairs = e.value;
                setup.notes.push_back("pole pairs found: " + std::to_string(static_cast<int>(e.value)));
                return;
            }
    }
    setup.pole_pairs_known = false;
    setup.notes.push_back("the pole pairs are not known: psi and a delay come out multiplied by them, and L wherever "
                          "the machine turns (say "
                          "--pole-pairs)");
}

/// As many stretches as are long enough to hold blocks of the reported residual.
std::size_t stretches_of(const std::vector<Piece>& pieces, std::size_t most)
{
    return std::clamp(rows_of(pieces) / kLeastStretch, kFewestStretches, most);
}

/// Pieces without the rows beyond the inverter's hexagon, where enough remain.
void hold_out_overmodulated(TraceSetup& setup, std::vector<Piece>& pieces)
{
    const std::vector<Log>& logs = *setup.logs;
    std::vector<std::vector<char>> marks;
    std::size_t beyond = 0;
    for (std::size_t n = 0; n < logs.size(); ++n) {
        marks.push_back(beyond_hexagon(logs[n], setup.columns[n], setup.pole_pairs));
        beyond += static_cast<std::size_t>(std::count(marks.back().begin(), marks.back().end(), 1));
    }
    if (beyond == 0) return;
    std::vector<Piece> inside = without_marked(pieces, logs, marks, kLeastPiece);
    const std::string said = std::to_string(beyond) + " rows ask for a voltage beyond the inverter's hexagon (v_dc_V)";
    // Half of a log that is cut to pieces says little of the other half.
    if (rows_of(inside) < std::max(kLeastRows, rows_of(pieces) / 2)) {
        setup.notes.push_back(said + ", too many to do without them: check v_dc_V");
        return;
    }
    pieces = std::move(inside), setup.beyond_hexagon = beyond;
    setup.notes.push_back(said + ": held out, neither fitted nor judged");
}

/// Some rows are seen, and some are held out: not so where guards leave nothing of a log's pieces.
void ask_for_both(const TraceSetup& setup)
{
    for (const Model* model : {setup.full.get(), setup.part.get()}) {
        if (model == nullptr) continue;
        const std::vector<FineBlock>& blocks = model->plan().blocks;
        const auto held = std::count_if(blocks.begin(), blocks.end(), [](const FineBlock& b) { return b.heldout; });
        if (held == 0 || held == static_cast<std::ptrdiff_t>(blocks.size()))
            throw std::invalid_argument(setup.logs->front().path +
                                        ": pieces without a gap are too short to hold some out");
    }
}

void electrical_setup(TraceSetup& setup, bool rotor_held, double pole_pairs)
{
    const std::vector<Log>& logs = *setup.logs;
    setup.rotor_held = rotor_held;
    find_pole_pairs(setup, pole_pairs);
    double begin = HUGE_VAL, end = -HUGE_VAL;
    setup.i_base_A = 0.0;
    for (const Log& log : logs) {
        for (std::size_t k = 0; k < log.rows(); ++k)
            setup.i_base_A = std::max(setup.i_base_A, std::hypot(at_row(log.i_d_A, k), at_row(log.i_q_A, k)));
        if (!log.t_s.empty()) begin = std::min(begin, log.t_s.front()), end = std::max(end, log.t_s.back());
    }
    if (!(setup.i_base_A > 0.0)) setup.i_base_A = 1.0;
    setup.span_s = std::max(end - begin, 0.0);
    if (!std::isfinite(setup.span_s)) setup.span_s = 0.0;
    for (const Log& log : logs)
        setup.columns.push_back(trace_columns(log, setup.pole_pairs_known ? setup.pole_pairs : 0.0, setup.i_base_A,
                                              setup.span_s, logs.front().dt_s));
    if (setup.regime != Regime::dynamic) {
        std::size_t rows = 0;
        for (const Log& log : logs) rows += log.rows();
        if (rows < kLeastSettled)
            throw std::invalid_argument(logs.front().path + ": " + std::to_string(rows) +
                                        " rows; a trace needs at least " + std::to_string(kLeastSettled) +
                                        " to hold some out");
        Plan plan = rows < kFewRows ? point_plan(logs, setup.i_base_A, range_of(logs, &Log::w_m_rad_s).size())
                                    : alternate_plan(settled_pieces(logs), kSettledStretches, kSettledFine, 0);
        if (plan.blocks.size() < kLeastSettled)
            plan = alternate_plan(settled_pieces(logs), kSettledStretches, kSettledFine, 0);
        setup.full = std::make_unique<SettledModel>(logs, setup.columns, setup.pole_pairs, std::move(plan));
        Point start;
        // The errors are linear in them: a start matters as far as a pass hardly more than doubles L.
        start.base = Eigen::Vector4d(1.0, 1e-3, 1e-3, 0.0);
        setup.starts.push_back(start);
        return;
    }
    std::vector<Piece> pieces = pieces_of(logs, kLeastPiece);
    hold_out_overmodulated(setup, pieces);
    if (rows_of(pieces) < kLeastRows)
        throw std::invalid_argument(logs.front().path + ": " + std::to_string(rows_of(pieces)) +
                                    " rows in even pieces of " + std::to_string(kLeastPiece) +
                                    " and more; a trace needs at least " + std::to_string(kLeastRows) +
                                    " to hold some out");
    setup.full = std::make_unique<ElectricalModel>(
        logs, setup.columns, setup.pole_pairs,
        alternate_plan(cut(pieces), stretches_of(pieces, kStretches), kFine, kGuard), rotor_held);
    const std::vector<Piece> windows = spread_sample(pieces, kSearchRows, kSearchWindow);
    if (rows_of(windows) < rows_of(pieces))
        setup.part = std::make_unique<ElectricalModel>(
            logs, setup.columns, setup.pole_pairs,
            alternate_plan(windows, rows_of(windows) / kSearchWindow, kFine, 2 * kGuard), rotor_held);
    ask_for_both(setup);
    setup.column_noise = std::make_unique<ColumnNoise>(logs, setup.search().plan().pieces);
    for (const ElectricalStart& s : electrical_starts(setup.part ? windows : pieces, setup.pole_pairs)) {
        Point start;
        start.base = Eigen::Vector4d(s.R_ohm, s.Ld_H, s.Lq_H, s.psi_Wb);
        start.gain = Eigen::Vector2d(kStartGain, kStartGain);
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
            throw std::invalid_argument(
                log.path + ": no torque: neither torque_Nm, nor i_q_A with a torque constant, nor torque_cmd_Nm");
        setup.angle.push_back(shaft_angle(log));
        if (source != said) setup.notes.push_back("torque is " + source);
        said = source;
    }
    const std::vector<Piece> pieces = pieces_of(logs, kLeastPiece);
    if (rows_of(pieces) < kLeastRows)
        throw std::invalid_argument(logs.front().path + ": " + std::to_string(rows_of(pieces)) +
                                    " rows in even pieces of " + std::to_string(kLeastPiece) +
                                    " and more; a trace needs at least " + std::to_string(kLeastRows) +
                                    " to hold some out");
    std::size_t stretches = stretches_of(pieces, kStretches * logs.size()), fine = kFine;
    double half_s = 0.0;
    if (averaged) {
        const double rows = static_cast<double>(rows_of(pieces)), dt_s = logs.front().dt_s;
        const HatChoice hat = choose_hat(pieces, rows * dt_s / static_cast<double>(kHatsInStretch * kFewestStretches));
        half_s = hat.half_s, setup.hat_noise_part = hat.noise_part;
        const std::size_t half = hat_rows(logs.front(), half_s), most = rows_of(pieces) / (kHatsInStretch * half);
        stretches = std::clamp(most, std::min(kFewestStretches, stretches), stretches);
        fine = std::clamp(rows_of(pieces) / stretches / (kHatsInBlock * half), std::size_t{1}, kFine / 2);
    }
    setup.full = std::make_unique<MechanicalModel>(logs, setup.torque, setup.angle,
                                                   alternate_plan(pieces, stretches, fine, kGuard), half_s);
    const std::vector<Piece> windows = spread_sample(pieces, 2 * kSearchRows, 2 * kSearchWindow);
    const bool holds_hats = half_s == 0.0 || kHatsInStretch * hat_rows(logs.front(), half_s) < 2 * kSearchWindow;
    if (rows_of(windows) < rows_of(pieces) && holds_hats)
        setup.part = std::make_unique<MechanicalModel>(
            logs, setup.torque, setup.angle,
            alternate_plan(windows, rows_of(windows) / (2 * kSearchWindow), fine, kGuard), half_s);
    ask_for_both(setup);
    std::vector<const std::vector<double>*> of_piece;
    for (const Piece& piece : pieces)
        of_piece.push_back(&setup.torque[static_cast<std::size_t>(piece.log - logs.data())]);
    for (const MechanicalStart& s : mechanical_starts(pieces, of_piece)) {
        Point start;
        start.base = Eigen::Vector2d(s.J_kgm2, s.B_Nms_rad);
        start.gain = Eigen::VectorXd::Constant(averaged ? 0 : 1, kStartGain);
        setup.starts.push_back(start);
    }
}

/// Time constant of a heating state; 0: a thermometer; NaN: settled rows do not tell it.
double heat_time_s(const TraceSetup& setup, int heat)
{
    if (heat >= kOwnHeat) return std::nan("");
    return heat > 0 ? kHeatTimes[(heat - 1) % kHeatsOfAKind] * setup.span_s : 0.0;
}

void check(const std::vector<Log>& logs)
{
    if (logs.empty()) throw std::invalid_argument("no log to trace");
    const auto need = [](const Log& log, const std::vector<double>& column, const char* name) {
        if (column.empty() || column.size() != log.rows())
            throw std::invalid_argument(log.path + ": this regime needs " + std::string(name) + " on every row");
    };
    for (const Log& log : logs) {
        if (is_short_circuit(log))
            throw std::invalid_argument(log.path + ": a short circuit, of whose current the size alone is known: fit "
                                                   "takes it, beside an open circuit");
        if (log.regime != logs.front().regime)
            throw std::invalid_argument(log.path + ": its regime is not that of " + logs.front().path);
        if (log.regime == Regime::dynamic || log.regime == Regime::mechanical) need(log, log.t_s, "t_s");
        if (log.regime != Regime::standstill) need(log, log.w_m_rad_s, "w_m_rad_s");
        if (log.regime == Regime::dynamic || log.regime == Regime::steady)
            need(log, log.v_d_V, "v_d_V"), need(log, log.v_q_V, "v_q_V"), need(log, log.i_d_A, "i_d_A"),
                need(log, log.i_q_A, "i_q_A");
    }
}

}  // namespace

std::unique_ptr<TraceSetup> trace_setup(const std::vector<Log>& logs, const std::vector<std::string>& only,
                                        Variant variant, double pole_pairs)
{
    check(logs);
    for (const std::string& name : only)
        if (!find_effect(name)) throw std::invalid_argument("unknown effect " + name);
    auto setup = std::make_unique<TraceSetup>();
    setup->logs = &logs;
    setup->regime = logs.front().regime;
    const Range speeds = range_of(logs, &Log::w_m_rad_s);
    setup->speed_base_rad_s = speeds.size();
    setup->one_speed = setup->regime == Regime::steady && speeds.span() < kOneSpeed * speeds.size();
    if (setup->regime == Regime::mechanical)
        mechanical_setup(*setup, variant == Variant::averaged);
    else
        electrical_setup(*setup, variant == Variant::rotor_held, pole_pairs);
    add_candidates(*setup, only);
    return setup;
}

TraceInput input_of(const TraceSetup& setup, const Point& at, const Term& term)
{
    TraceInput in{name_of(term.input.law), {}, {}};
    in.weights.assign(term.weights.begin(), term.weights.begin() + weights_of(term.input.law));
    const auto& s = term.input.shape;
    switch (effect_of(term.input.law).shape) {
    case Shape::current_width:
    case Shape::speed_widths: in.shape = {s[0], s[1]}; break;
    case Shape::two_widths: in.shape = {s[0], s[1], s[2], s[3]}; break;
    case Shape::current_unit:
    case Shape::order:
    case Shape::speed_width:
    case Shape::periods_a_turn: in.shape = {s[0]}; break;
    case Shape::heat:
        in.shape = {kReferenceTemperature_C, heat_time_s(setup, term.input.heat)};
        // The heating state is 1 where this current flows for long; of one that time drives there is none.
        if (term.input.heat > 0) {
            in.shape.push_back(by_time(term.input) ? std::nan("") : setup.i_base_A);
            in.reach = 0.0;
            for (std::size_t n = 0; n < setup.columns.size(); ++n)
                for (std::size_t k = 0; k < (*setup.logs)[n].rows(); ++k)
                    in.reach = std::max(in.reach, state_at(setup.columns[n], term.input, k));
        }
        break;
    case Shape::instant:
    case Shape::channel: in.shape = {s[0], at.base[0], at.base[1], at.base[2], at.base[3]}; break;
    case Shape::pulses:
        in.shape = {static_cast<double>(Instant::currents_after), at.base[0], at.base[1], at.base[2], at.base[3]};
        if (term.input.law == Law::pulsed_lag) in.shape[0] = static_cast<double>(Channel::currents);
        break;
    case Shape::link:
    case Shape::shaft_order:
        in.shape = {s[0], s[1], s[2]};
        if (term.input.law == Law::voltage_scale && term.input.heat > 0)
            in.shape.push_back(kLinkTimes[term.input.heat - 1] * setup.logs->front().dt_s);
        break;
    case Shape::R_L: in.shape = {at.base[0], at.base[1], at.base[2]}; break;
    case Shape::L_psi: in.shape = {at.base[1], at.base[2], at.base[3]}; break;
    case Shape::current_cells: return input_of(setup, at, polynomial_of(setup, term));
    case Shape::seconds:
        if (setup.regime != Regime::dynamic) in.shape = {1.0};
        break;
    default: break;
    }
    return in;
}

}  // namespace dqw
