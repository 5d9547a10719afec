#include "ref/model/electrical.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <optional>
#include <utility>

#include "ref/log/hands.hpp"
#include "ref/log/residual.hpp"
#include "ref/log/wanted.hpp"
#include "ref/model/gather.hpp"
#include "ref/model/hold.hpp"
#include "ref/model/inputs.hpp"

namespace dqw {
namespace {

constexpr double kLargestRateDt = 15.0;  ///< (R/L + w_e) dt beyond which a log says nothing about L
/// Of the implicit end of a period (Newton), and what is left over the currents that ends them.
constexpr int kIterations = 4;
constexpr double kEnded = 1e-9;
/// Over the currents, a step that is well above rounding.
constexpr double kTelling = 1e-6;

Held held_from(const Row& row)
{
    Held held;
    held.fill({row.v_d_V, row.v_q_V});
    return held;
}

Matrix2 matrix(const double m[4]) { return {m[0], m[1], m[2], m[3]}; }

double size_of(const Vector2& x) { return std::abs(x.d) + std::abs(x.q); }

/// Whether its f and g lie on a plane over the currents.
bool is_straight(const Input& input)
{
    return !bends(input.law) && !is_dead_time(input.law) && input.law != Law::clipped_current &&
           (input.law != Law::turn_short || input.shape[0] == kTurningAlone);
}

/// What terms take, and its slopes by the currents.
struct Taken {
    Vector2 f, g;
    double f_slope[4] = {}, g_slope[4] = {};

    Vector2 flux(double dt) const { return 0.5 * f + (1.0 / dt) * g; }
    Matrix2 slope(double dt) const { return 0.5 * matrix(f_slope) + (1.0 / dt) * matrix(g_slope); }
};

/// A short draws from the winding itself; what is told at another instant runs on its way.
bool asks_for_bend(const Input& input)
{
    const bool edges = is_dead_time(input.law) && input.loss == LossLaw::edges;
    return input.law == Law::turn_short || input.law == Law::pulses || edges || tells_other_currents(input);
}

bool asks_for_next(const Input& input) { return input.law == Law::sample_shift || input.law == Law::pulsed_shift; }

}  // namespace

ElectricalModel::ElectricalModel(const std::vector<Log>& logs, const std::vector<TraceColumns>& columns,
                                 double pole_pairs, Plan plan, bool rotor_held, const RowNoise* noise)
    : logs_(logs), columns_(columns), pole_pairs_(pole_pairs), plan_(std::move(plan)), rotor_held_(rotor_held),
      noise_(noise)
{
    if (noise_ == nullptr) report_pieces_ = pieces_of(logs_, 2);
    double time_s = 0.0, periods = 0.0;
    RowReader rows(noise_);
    for (const Piece& piece : plan_.pieces) {
        for (std::size_t k = piece.begin; k < piece.end; ++k) {
            ask_at(k);
            w_max_rad_s_ = std::max(w_max_rad_s_, std::abs(rows.speed_at(*piece.log, k)));
            if (k + 1 < piece.end) dt_max_s_ = std::max(dt_max_s_, piece.period_s(k));
        }
        time_s += piece.log->t_s[piece.end - 1] - piece.log->t_s[piece.begin];
        periods += static_cast<double>(piece.rows() - 1);
    }
    if (periods > 0.0) dt_mean_s_ = time_s / periods;
}

const std::vector<std::string>& ElectricalModel::base_names() const
{
    static const std::vector<std::string> names{"R_ohm", "Ld_H", "Lq_H", "psi_Wb"};
    return names;
}

GainSchedule ElectricalModel::schedule(const Point& at, int axis) const
{
    return {at.gain[axis], at.base[kR] / at.base[kLd + axis] * dt_mean_s_};
}

Vector2 ElectricalModel::begun(const Row& row, double turn_rad) const
{
    const Vector2 mean{row.v_d_V, row.v_q_V};
    if (rotor_held_) return mean;
    const double h = 0.5 * turn_rad, s = std::abs(h) > 1e-4 ? std::sin(h) / h : 1.0 - h * h / 6.0;
    return turn(std::cos(h) / s, std::sin(h) / s) * mean;
}

void ElectricalModel::weigh_starts(const Point& at, bool count)
{
    for (int axis : {0, 1}) weights_[axis] = StartWeights(schedule(at, axis), count);
}

/// A point's machine and effects over one period.
struct ElectricalModel::Plant {
    const ElectricalModel& model;
    const Point& at;
    const double R, Ld, Lq, psi, pole_pairs;
    bool bends_iron = false;        ///< any term
    bool asks_bend = false;         ///< for how it does
    const Input* pulses = nullptr;  ///< of the legs, about what their mean voltage runs
    bool asks_next = false;         ///< for the voltage that begins at a row
    bool asks_before = false;       ///< for the currents of the row before a period
    bool asks_told = false;         ///< for what sensors tell more than flows, where any do
    bool asks_legs = false;         ///< for what dead times take of the voltage, where there are any
    bool asks_lost = false;         ///< for what of the voltage does not reach the machine, where any is
    double lag_s = 0.0;             ///< of the currents' filter
    bool later = false;             ///< currents are told under the voltage that begins at their row
    Angle ahead;                    ///< what the angle is of the rotor
    double ahead_s = 0.0;           ///< the same, of a later instant
    int past = kFewPast;            ///< periods whose voltages count
    bool drives = false;            ///< a dead time below nothing drives currents on where they cross zero
    double skin = 0.0;  ///< a resistance that grows with the speed is stiff where it is large: part of the response

    Plant(const ElectricalModel& m, const Point& p, const std::vector<Input>* candidates = nullptr)
        : model(m), at(p), R(p.base[kR]), Ld(p.base[kLd]), Lq(p.base[kLq]), psi(p.base[kPsi]),
          pole_pairs(p.base.size() > kPolePairs ? p.base[kPolePairs] : m.pole_pairs_)
    {
        ahead = Angle(angle_offset_of(at));
        for (const Term& t : at.terms) {
            if (t.input.law == Law::skin_effect) skin += t.weights[0];
            if (filters_currents(t.input)) lag_s += t.weights[0];
            later = later || (shifts_currents(t.input) && t.weights[0] > 0.0);
            if (filters_currents(t.input) || (t.input.law == Law::iron_loss && t.input.shape[0] > 0.0)) past = kPast;
            if (shifts_angle(t.input)) ahead_s += t.weights[0];
            bends_iron = bends_iron || bends(t.input.law);
            asks_bend = asks_bend || asks_for_bend(t.input);
            drives = drives || (is_dead_time(t.input.law) && t.weights[0] < 0.0);
            if (t.input.law == Law::pulses) pulses = &t.input;
            asks_next = asks_next || asks_for_next(t.input);
            asks_before = asks_before || t.input.law == Law::dead_given_back;
            asks_lost = asks_lost || asks_for_lost(t.input), asks_told = asks_told || asks_what_flows(t.input);
            asks_legs = asks_legs || asks_for_lost_in_legs(t.input);
        }
        if (candidates != nullptr)
            for (const Input& c : *candidates) {
                asks_next = asks_next || asks_for_next(c), asks_before = asks_before || c.law == Law::dead_given_back;
                asks_lost = asks_lost || asks_for_lost(c), asks_told = asks_told || asks_what_flows(c);
                asks_legs = asks_legs || asks_for_lost_in_legs(c), asks_bend = asks_bend || asks_for_bend(c);
            }
        const auto loses = [](const Term& t) { return loses_voltage(t.input.law); };
        const auto tells = [](const Term& t) { return tells_other_currents(t.input); };
        asks_lost = asks_lost && std::any_of(at.terms.begin(), at.terms.end(), loses);
        asks_told = asks_told && std::any_of(at.terms.begin(), at.terms.end(), tells);
        const auto is_dead = [](const Term& t) { return loses_what_flows(t.input); };
        asks_legs = asks_legs && std::any_of(at.terms.begin(), at.terms.end(), is_dead);
    }

    double w_max() const { return std::abs(pole_pairs) * model.w_max_rad_s_; }

    bool in_domain() const
    {
        const double l_min = std::min(Ld, Lq), w = w_max();
        if (!at.values().allFinite() || !(l_min > 0.0)) return false;
        double R_most = std::abs(R);
        for (const Term& t : at.terms)
            if (t.input.law == Law::skin_effect) R_most += std::abs(t.weights[0]) * w * w;
        // A negative resistance grows by e^(-R dt / L) a row: fine for a step of the search, not for a whole log.
        return (R_most / l_min + w) * model.dt_max_s_ <= kLargestRateDt;
    }

    const TraceColumns& columns(const Piece& piece) const
    {
        return model.columns_[static_cast<std::size_t>(piece.log - model.logs_.data())];
    }

    /// `row`: the piece's k-th.
    Moment moment(const Piece& piece, std::size_t k, const Row& row, Vector2 i, Vector2 v_end, double dt) const
    {
        const TraceColumns& c = columns(piece);
        Moment m;
        m.i_d = i.d, m.i_q = i.q, m.w_e = pole_pairs * row.w_m_rad_s;
        m.cos_e = c.cos_e[k], m.sin_e = c.sin_e[k];
        if (!c.cos_m.empty()) m.cos_m = c.cos_m[k], m.sin_m = c.sin_m[k];
        if (!c.w_dot.empty()) m.w_dot = c.w_dot[k];
        if (!piece.log->v_dc_V.empty()) m.v_dc = piece.log->v_dc_V[k];
        if (asks_next) m.v_next = model.begun(row, m.w_e * dt);
        m.v_end_d = v_end.d, m.v_end_q = v_end.q, m.period_s = dt;
        m.R = R, m.Ld = Ld, m.Lq = Lq, m.psi = psi, m.lag_s = lag_s, m.later = later, m.pulses = pulses;
        put_state(at.terms, c, k, m);
        m.ahead = ahead_s == 0.0 ? ahead : Angle(ahead.rad + ahead_s * m.w_e);
        put_bend(m);
        if (asks_before) put_before(m, piece, k);
        return m;
    }

    /// Of the period that starts at row k. A piece's first has no row before.
    void put_before(Moment& m, const Piece& piece, std::size_t k) const
    {
        const std::size_t n = std::max(k, piece.begin + 1) - 1;
        const TraceColumns& c = columns(piece);
        const double i_d = piece.log->i_d_A[n], i_q = piece.log->i_q_A[n];
        m.before_alpha = c.cos_e[n] * i_d - c.sin_e[n] * i_q, m.before_beta = c.sin_e[n] * i_d + c.cos_e[n] * i_q;
    }

    void put_lost(Moment& m) const
    {
        if (asks_lost) dqw::put_lost(at.terms, m);
    }

    /// Of row k, the currents at the end of a period; `m` has all else.
    void put_currents(const Piece& piece, std::size_t k, Moment& m, Vector2 i) const
    {
        m.i_d = i.d, m.i_q = i.q;
        put_bend(m);
        put_flowing(piece, k, m);
    }

    /// What the legs lose by currents, and what sensors tell more than those.
    void put_flowing(const Piece& piece, std::size_t k, Moment& m) const
    {
        if (asks_told) put_told(at.terms, columns(piece), k, m);
        if (!asks_legs) return;
        m.lost_in_legs = lost_in_legs(at.terms, m, false);
        if (asks_told) put_told(at.terms, columns(piece), k, m);
    }

    /// Of both ends of the period from row k.
    void put_meeting(const Piece& piece, std::size_t k, Moment& m0, Moment& m1) const
    {
        const auto stationary = [&m0](Vector2 x) { return Angle(0.0, m0.cos_e, m0.sin_e).on(x); };
        put_flowing(piece, k, m0);
        if (asks_legs) {
            m0.lost_at_edges = lost_in_legs(at.terms, m0, true);
            m1.lost_at_edges = Angle(0.0, m1.cos_e, m1.sin_e).back(stationary(m0.lost_at_edges));
            if (asks_told) put_told(at.terms, columns(piece), k, m0);
        }
        put_flowing(piece, k + 1, m1);
        const Vector2 at_start = stationary(m0.told_more);
        m1.past_more_alpha = at_start.d, m1.past_more_beta = at_start.q;
    }

    /// Along the rotor's axes, where a term asks for it.
    void put_bend(Moment& m) const
    {
        if (!bends_iron || !asks_bend) return;
        // Of the current that shorts the magnet, or of what flows: a difference of slopes bends by as little.
        constexpr double kPart = 1e-4;
        const Vector2 i = m.ahead.on({m.i_d - m.told_more.d, m.i_q - m.told_more.q});
        const auto in_rotor = [&m](double i_d, double i_q) {
            Moment there = m;
            there.ahead = Angle(), there.i_d = i_d, there.i_q = i_q, there.told_more = {};
            return there;
        };
        const auto slope = [&](const Moment& there) {
            std::array<double, 4> f{}, g{};
            for (const Term& t : at.terms)
                if (bends(t.input.law)) evaluate_slope(t.input, t.weights.data(), there, f.data(), g.data());
            return g;
        };
        const Moment there = in_rotor(i.d, i.q);
        const std::array<double, 4> here = slope(there);
        m.bend_dd_H = here[0], m.bend_dq_H = here[1], m.bend_qq_H = here[3];
        Vector2 f, flux;
        for (const Term& t : at.terms)
            if (bends(t.input.law)) evaluate_sum(t.input, t.weights.data(), there, f, flux);
        m.bent_Wb = {flux.d - here[0] * i.d - here[1] * i.q, flux.q - here[1] * i.d - here[3] * i.q};
        if (pulses == nullptr) return;
        const double step = kPart * std::max(std::abs(psi) / std::min(Ld, Lq), std::hypot(i.d, i.q));
        const std::array<double, 4> by_d = slope(in_rotor(i.d + step, i.q)), by_q = slope(in_rotor(i.d, i.q + step));
        for (const int n : {0, 1, 2}) {
            const std::size_t of[3] = {0, 1, 3};  // [dd dq qd qq]
            m.by_d_H_A[n] = step > 0.0 ? (by_d[of[n]] - here[of[n]]) / step : 0.0;
            m.by_q_H_A[n] = step > 0.0 ? (by_q[of[n]] - here[of[n]]) / step : 0.0;
        }
    }

    /// Calls visit(term, moment) for each.
    template <typename Visit> void each_term(const Piece& piece, std::size_t k, Moment& m, Visit&& visit) const
    {
        std::optional<Moment> winding;
        if (lag_s != 0.0 || later) put_beside_line(m, winding);
        for (const Term& t : at.terms) {
            m.state = state_at(columns(piece), t.input, k);
            visit(t, winding && (filters_currents(t.input) || shifts_currents(t.input)) ? *winding : m);
        }
    }

    void sum_terms(const Piece& piece, std::size_t k, Moment& m, Vector2& f, Vector2& g) const
    {
        each_term(piece, k, m,
                  [&](const Term& t, const Moment& of) { evaluate_sum(t.input, t.weights.data(), of, f, g); });
    }

    /// Without what the response holds already; straight terms apart.
    void sum_terms(const Piece& piece, std::size_t k, Moment& m, Taken& bent, Taken& straight) const
    {
        each_term(piece, k, m, [&](const Term& t, const Moment& of) {
            if (t.input.law == Law::skin_effect) return;
            Taken& to = is_straight(t.input) ? straight : bent;
            evaluate_with_slope(t.input, t.weights.data(), of, to.f, to.g, to.f_slope, to.g_slope);
        });
    }

    /// Behind a filter, or of another instant, without what the line's current has beside the winding's, where there is
    /// such a thing.
    void put_beside_line(const Moment& m, std::optional<Moment>& winding) const
    {
        for (const Term& t : at.terms) {
            if (t.input.law != Law::iron_loss && t.input.law != Law::turn_short) continue;
            if (!winding) winding = m;
            Vector2 f, g;
            evaluate_sum(t.input, t.weights.data(), *winding, f, g);
            winding->i_d += g.d / Ld, winding->i_q += g.q / Lq;
        }
    }

    /// The terms' mean voltage over the period from row k, from measured currents. `v_end`: the last voltage as seen at
    /// its start.
    Vector2 lost(const Piece& piece, std::size_t k, double dt, Vector2 v_end, const Hold& hold) const
    {
        const Row row = row_of(*piece.log, k), next = row_of(*piece.log, k + 1);
        Moment m0 = moment(piece, k, row, {row.i_d_A, row.i_q_A}, v_end, dt),
               m1 = moment(piece, k + 1, next, {next.i_d_A, next.i_q_A}, hold.end, dt);
        hold.pair(m0, m1);
        put_lost(m0), put_lost(m1);
        put_meeting(piece, k, m0, m1);
        Vector2 f0, g0, f1, g1;
        sum_terms(piece, k, m0, f0, g0);
        sum_terms(piece, k + 1, m1, f1, g1);
        return hold.sinc * (hold.to_start * (0.5 * f0 - (1.0 / dt) * g0) + hold.to_end * (0.5 * f1 + (1.0 / dt) * g1));
    }
};

/// What the pieces of one sweep share.
struct ElectricalModel::Pass {
    using Schedules = std::array<GainSchedule, 2>;

    const Plant plant;
    const std::vector<Input>* candidates;
    const Eigen::Index columns;
    const bool effects;  ///< any, on or tried
    const Rates rates;
    const std::vector<Schedules> schedules;  ///< of each gain that the sweep is at
    const Groups groups;                     ///< of candidates that do not meet; none: all do
    std::vector<ResponseTable> tables;

    Pass(const ElectricalModel& m, const Point& at, const std::vector<Input>* c, std::vector<Schedules> of,
         Groups apart = {})
        : plant(m, at, c), candidates(c), columns(columns_of(at, c)),
          effects(!at.terms.empty() || (c != nullptr && !c->empty())), rates{plant.R,    plant.Ld,      plant.Lq,
                                                                             plant.skin, m.rotor_held_, c != nullptr},
          schedules(std::move(of)), groups(std::move(apart))
    {
        // A table is worth it from as many rows as it has nodes.
        for (const Piece& piece : m.plan_.pieces)
            if (piece.dt_s > 0.0 && piece.rows() > ResponseTable::kNodes && table(piece) == nullptr)
                tables.emplace_back(rates, plant.w_max(), piece.dt_s);
    }

    const ResponseTable* table(const Piece& piece) const
    {
        for (const ResponseTable& t : tables)
            if (t.dt_s() == piece.dt_s) return &t;
        return nullptr;
    }
};

/// One period of a piece.
struct ElectricalModel::Period {
    const std::size_t k;  ///< its first row
    const Row row, next;  ///< at its ends
    const double dt, w_m, w_dt;
    const Vector2 v, v_end;  ///< its own voltage, and the last one as seen at its start
    const Responses r;

    Period(const Pass& pass, const Piece& piece, const ResponseTable* table, std::size_t at, const Row& first,
           const Row& last, Vector2 before)
        : k(at), row(first), next(last), dt(piece.period_s(at)), w_m(0.5 * (row.w_m_rad_s + next.w_m_rad_s)),
          w_dt(pass.plant.pole_pairs * w_m * dt), v{row.v_d_V, row.v_q_V}, v_end(before),
          r(table != nullptr ? table->at(w_dt) : pass.rates.at(w_dt, dt))
    {
    }
};

/// A sweep of one piece, at one gain.
struct ElectricalModel::Run {
    /// One column of the derivative: the flux that one unit of a weight takes at a period's start, and at its end.
    struct Lane {
        Vector2 start, end;
    };
    /// One period: the currents at its end, and its equation's slopes by the currents at its two ends.
    struct Step {
        Vector2 next;
        Matrix2 by_start, by_end;
    };

    const Pass& pass;
    const Pass::Schedules& schedule;
    const Run* const first;  ///< whose currents tell what candidates take; null: it is that
    const Plant& plant;
    const ElectricalModel& model;
    const Span& span;
    const Piece& piece;
    const std::size_t first_gain, first_input;
    Vector2 i;  ///< at a period's start
    std::vector<Lane> lanes;
    std::vector<Vector2> s;  ///< derivatives of the currents
    Vector2 last_taken;      ///< by the terms, of flux at the last period's end
    Matrix2 missed;  ///< of straight terms by the currents: slopes that evaluate_slope() leaves out, as last seen
    Units units;
    Gather gather;
    bool ok = true;  ///< it has numbers

    Run(const Pass& p, const Pass::Schedules& gains, const Span& of, Vector2 begin, std::vector<BlockSum>& sums,
        Fold fold, const Run* other)
        : pass(p), schedule(gains), first(other), plant(p.plant), model(plant.model), span(of), piece(*of.piece),
          first_gain(static_cast<std::size_t>(plant.at.base.size())), first_input(first_gain + 2), i(begin),
          lanes(static_cast<std::size_t>(p.columns)), s(lanes.size()), gather(model.plan_, of, 2, sums, fold, p.groups)
    {
    }

    void count(std::size_t k, Vector2 e)
    {
        if (!gather.counts(k)) return;
        const std::size_t n = k - piece.begin - 1;
        const double w_d = model.weights_[0].at(n), w_q = model.weights_[1].at(n);
        double *const d = gather.line(0), *const q = gather.line(1);
        for (std::size_t j = 0; j < s.size(); ++j) d[j] = -w_d * s[j].d, q[j] = -w_q * s[j].q;
        d[s.size()] = w_d * e.d, q[s.size()] = w_q * e.q;
        gather.next();
    }

    /// Solves L i + B taken(i) = x for the currents at the end, in which `taken` is half of what the terms take there.
    void end(std::size_t k, double dt, const Matrix2& P, Vector2 x, Moment& m1, Step& step)
    {
        Vector2 by, of_straight;
        step.next = {(x.d - last_taken.d) / plant.Ld, (x.q - last_taken.q) / plant.Lq};
        for (int n = 0; n < kIterations; ++n) {
            plant.put_currents(piece, k + 1, m1, step.next);
            Taken bent, straight;
            plant.sum_terms(piece, k + 1, m1, bent, straight);
            const Vector2 before = of_straight, last = by;
            of_straight = P * straight.flux(dt);
            const Matrix2 by_straight = P * straight.slope(dt);
            const Vector2 taken = P * bent.flux(dt) + of_straight;
            step.by_end = Matrix2{plant.Ld, 0.0, 0.0, plant.Lq} + P * bent.slope(dt) + by_straight;
            if (n > 0) miss(last, of_straight - before - by_straight * last, step.next);
            by = inverse(step.by_end + missed) *
                 Vector2{x.d - taken.d - plant.Ld * step.next.d, x.q - taken.q - plant.Lq * step.next.q};
            step.next = step.next + by;
            const double size = size_of(by), ended = kEnded * (size_of(step.next) + kEnded);
            // What is left after a step is to the step as that is to the one before, or less.
            if (size < ended || (n > 0 && size * size < ended * size_of(last))) break;
        }
        last_taken = {x.d - plant.Ld * step.next.d, x.q - plant.Lq * step.next.q};
    }

    /// A step changed what straight terms take by so much more than their slopes told: Broyden's update.
    void miss(Vector2 step, Vector2 more, Vector2 currents)
    {
        if (!(size_of(step) > kTelling * size_of(currents))) return;
        const Vector2 off = more - missed * step;
        const double k = 1.0 / (step.d * step.d + step.q * step.q);
        missed = missed + k * Matrix2{off.d * step.d, off.d * step.q, off.q * step.d, off.q * step.q};
    }

    /// The rest of a period with effects, and, where they are asked for, the derivatives by their weights.
    void with_effects(const Period& at, const Hold& hold, Vector2 x, Step& step)
    {
        const Matrix2 Bs = hold.sinc * at.r[0].B(), P = Bs * hold.to_end, Q = Bs * hold.to_start;
        const std::vector<Term>& terms = plant.at.terms;
        std::size_t told = first_input;  // the first column that the first run tells
        if (first == nullptr || !terms.empty()) {
            const std::size_t k = at.k;
            Moment m0 = plant.moment(piece, k, at.row, i, at.v_end, at.dt),
                   m1 = plant.moment(piece, k + 1, at.next, step.next, hold.end, at.dt);
            hold.pair(m0, m1);
            plant.put_lost(m0), plant.put_lost(m1);
            plant.put_meeting(piece, k, m0, m1);
            if (!terms.empty()) {
                Taken bent, straight;
                plant.sum_terms(piece, k, m0, bent, straight);
                step.by_start = step.by_start + (-1.0) * (Q * (bent.slope(-at.dt) + straight.slope(-at.dt)));
                end(k, at.dt, P, x - Q * (bent.flux(-at.dt) + straight.flux(-at.dt)), m1, step);
            }
            if (pass.candidates == nullptr) return;
            plant.put_currents(piece, k + 1, m1, step.next);
            static const std::vector<Input> none;
            const std::vector<Input>& candidates = first == nullptr ? *pass.candidates : none;
            const TraceColumns& c = plant.columns(piece);
            const double inv_dt = 1.0 / at.dt;
            put_inputs(terms, candidates, c, k, m0, units,
                       [&](Vector2 f, Vector2 g) { lanes[told++].start = inv_dt * g - 0.5 * f; });
            told = first_input;
            put_inputs(terms, candidates, c, k + 1, m1, units,
                       [&](Vector2 f, Vector2 g) { lanes[told++].end = inv_dt * g + 0.5 * f; });
        }
        const Matrix2 J = inverse(step.by_end), T = J * step.by_start, S = J * Q, E = J * P;
        for (std::size_t j = first_input; j < lanes.size(); ++j) {
            const Lane& l = j < told ? lanes[j] : first->lanes[j];
            s[j] = T * s[j] + S * l.start - E * l.end;
        }
    }

    /// Derivatives by the base parameters and the gains.
    void base_slopes(const Period& at, const Step& step)
    {
        const double Ld = plant.Ld, Lq = plant.Lq, dt = at.dt, R_dt = pass.rates.resistance(at.w_dt / dt) * dt;
        const Responses& r = at.r;
        const Vector2 v = at.v, x{Ld * i.d, Lq * i.q}, by_a = r[1](x, v, plant.psi), by_b = r[2](x, v, plant.psi);
        const Matrix2 J = inverse(step.by_end), T = J * step.by_start, A = r[0].A();
        const auto put = [&](std::size_t j, Vector2 flux) { s[j] = T * s[j] + J * flux; };
        put(kR, (dt / Ld) * by_a + (dt / Lq) * by_b);
        put(kLd, A * Vector2{i.d, 0.0} - Vector2{step.next.d, 0.0} - (R_dt / (Ld * Ld)) * by_a);
        put(kLq, A * Vector2{0.0, i.q} - Vector2{0.0, step.next.q} - (R_dt / (Lq * Lq)) * by_b);
        put(kPsi, r[0].C());
        if (first_gain > kPolePairs) put(kPolePairs, at.w_m * dt * r[3](x, v, plant.psi));
        for (std::size_t j : {first_gain, first_gain + 1}) s[j] = T * s[j];
    }

    /// Of an error that the last gain left, how much the next may leave, (E183): less than all where a dead time below
    /// nothing makes errors of the currents grow.
    double left_of(const Step& step, const Matrix2& A) const
    {
        if (!plant.drives) return 1.0;
        // Below 1 they grow; at an end that has no one solution, without bound.
        const double shrink = determinant(step.by_end) * determinant(A) / determinant(step.by_start);
        return shrink < 1.0 ? std::max(shrink, 0.0) * std::max(shrink, 0.0) : 1.0;
    }

    /// Corrects the currents by the error e of row k, and their derivatives.
    Vector2 corrected(std::size_t k, Vector2 predicted, Vector2 e, double left)
    {
        const std::size_t n = k - span.begin - 1;
        const double k_d = 1.0 - left * (1.0 - schedule[0].gain(n)), k_q = 1.0 - left * (1.0 - schedule[1].gain(n));
        for (Vector2& by : s) by.d *= 1.0 - k_d, by.q *= 1.0 - k_q;
        if (!s.empty()) {
            s[first_gain].d += left * schedule[0].slope(n) * e.d;
            s[first_gain + 1].q += left * schedule[1].slope(n) * e.q;
        }
        return {predicted.d + k_d * e.d, predicted.q + k_q * e.q};
    }

    /// `hold`: null without effects.
    void go_on(const Period& at, const Hold* hold)
    {
        const Vector2 x = at.r[0](Vector2{plant.Ld * i.d, plant.Lq * i.q}, at.v, plant.psi);
        Step step{{x.d / plant.Ld, x.q / plant.Lq},
                  at.r[0].A() * Matrix2{plant.Ld, 0.0, 0.0, plant.Lq},
                  {plant.Ld, 0.0, 0.0, plant.Lq}};
        if (hold != nullptr) with_effects(at, *hold, x, step);
        ok = std::isfinite(step.next.d) && std::isfinite(step.next.q);
        if (!ok) return;
        if (!lanes.empty()) base_slopes(at, step);
        const Vector2 e = Vector2{at.next.i_d_A, at.next.i_q_A} - step.next;
        count(at.k + 1, e);
        i = corrected(at.k + 1, step.next, e, left_of(step, at.r[0].A()));
    }
};

/// Runs through one span at each of a pass' gains; `sums[n]`, `ok[n]`: of the n-th. None goes on where the first is lost.
void ElectricalModel::run_through(const Pass& pass, const Span& span, RowReader& rows, Fold fold,
                                  const std::vector<std::vector<BlockSum>*>& sums, std::vector<char>& ok) const
{
    const Piece& piece = *span.piece;
    Row row = rows.at(*piece.log, span.begin);
    std::vector<Run> runs;
    runs.reserve(pass.schedules.size());
    for (std::size_t n = 0; n < pass.schedules.size(); ++n)
        runs.emplace_back(pass, pass.schedules[n], span, Vector2{row.i_d_A, row.i_q_A}, *sums[n], fold,
                          n > 0 ? &runs.front() : nullptr);
    const ResponseTable* const table = pass.table(piece);
    Held held = held_from(row);
    std::optional<Hold> hold;
    for (std::size_t k = span.begin; k + 1 < span.end && runs.front().ok; ++k) {
        ask_at(k);
        const Period at(pass, piece, table, k, row, rows.at(*piece.log, k + 1), held[0]);
        if (pass.effects) hold.emplace(0.5 * at.w_dt, at.v, held, rotor_held_, pass.plant.past);
        for (Run& run : runs)
            if (run.ok) run.go_on(at, hold ? &*hold : nullptr);
        row = at.next;
    }
    for (std::size_t n = 0; n < runs.size(); ++n) {
        runs[n].gather.flush();
        ok[n] = runs[n].ok && runs.front().ok;
    }
}

/// Works out blocks of the reported residual at several points.
struct ElectricalModel::Reporter {
    /// The rows of one block, of which blocks that follow one another need nothing more.
    struct Span {
        const Piece* piece;
        std::size_t begin, rows;
    };

    const ElectricalModel& model;
    std::vector<PlainModel> plains;
    std::vector<Plant> plants;
    bool effects = false;  ///< any, at any point: then all have the model's pole pairs, and so the same voltages
    int past = kFewPast;   ///< as many as any of them asks for

    Reporter(const ElectricalModel& m, const std::vector<Point>& at) : model(m)
    {
        for (const Point& point : at) {
            PlainModel plain;
            plain.pole_pairs = m.pole_pairs_;
            plain.rotor_held = m.rotor_held_;
            plain.R_ohm = point.base[kR], plain.Ld_H = point.base[kLd], plain.Lq_H = point.base[kLq];
            plain.psi_Wb = point.base[kPsi];
            plains.push_back(plain);
            plants.emplace_back(m, point);
            effects = effects || !point.terms.empty(), past = std::max(past, plants.back().past);
        }
    }

    Hold hold_of(const Piece& piece, std::size_t k, Held& held) const
    {
        const Row row = row_of(*piece.log, k), next = row_of(*piece.log, k + 1);
        const double h = 0.5 * model.pole_pairs_ * 0.5 * (row.w_m_rad_s + next.w_m_rad_s) * piece.period_s(k);
        return Hold(h, {row.v_d_V, row.v_q_V}, held, model.rotor_held_, past);
    }

    /// The last voltages as seen at row k; before a piece's first, that. None is kept for more than kPast periods.
    Held held_at(const Piece& piece, std::size_t k) const
    {
        std::size_t r = k - std::min<std::size_t>(k - piece.begin, kPast);
        Held held = held_from(row_of(*piece.log, r));
        for (; r < k; ++r) hold_of(piece, r, held);
        return held;
    }

    /// A block at each point.
    void put_blocks(const Span& span, Held& held, ReportBlock* out) const
    {
        const Piece& piece = *span.piece;
        const Log& log = *piece.log;
        const std::size_t k = span.begin, n = span.rows, points = plants.size();
        const double time_s = span_s(piece, k, n);
        std::fill(out, out + points, ReportBlock{&log, k, k + n, {}, {}});
        for (std::size_t r = k; r < k + n; ++r) {
            const double dt = piece.period_s(r);
            for (std::size_t p = 0; p < points; ++p) {
                add_period(log, plains[p], r, dt, out[p].residual[0], out[p].residual[1]);
                out[p].measured[0] += log.v_d_V[r] * dt, out[p].measured[1] += log.v_q_V[r] * dt;
            }
            if (!effects) continue;
            const Vector2 v_end = held[0];
            const Hold hold = hold_of(piece, r, held);
            for (std::size_t p = 0; p < points; ++p) {
                if (plants[p].at.terms.empty()) continue;
                const Vector2 lost = plants[p].lost(piece, r, dt, v_end, hold);
                out[p].residual[0] -= lost.d * dt, out[p].residual[1] -= lost.q * dt;
            }
        }
        for (std::size_t p = 0; p < points; ++p) {
            double* const e = out[p].residual;
            e[0] = (e[0] - plains[p].Ld_H * (log.i_d_A[k + n] - log.i_d_A[k])) / time_s;
            e[1] = (e[1] - plains[p].Lq_H * (log.i_q_A[k + n] - log.i_q_A[k])) / time_s;
            out[p].measured[0] /= time_s, out[p].measured[1] /= time_s;
        }
    }

    /// spans[first] to spans[last - 1], each at all points: to out[n * points] and on.
    void work(const std::vector<Span>& spans, std::size_t first, std::size_t last, std::vector<ReportBlock>& out) const
    {
        Held held{};
        for (std::size_t n = first; n < last; ++n) {
            const Span& span = spans[n];
            ask_at(span.begin, span.rows);
            const bool follows = n > first && spans[n - 1].piece == span.piece &&
                                 spans[n - 1].begin + spans[n - 1].rows == span.begin;
            if (effects && !follows) held = held_at(*span.piece, span.begin);
            put_blocks(span, held, &out[n * plants.size()]);
        }
    }
};

std::vector<ReportBlock> ElectricalModel::report(const Point& at, std::size_t rows) const
{
    std::vector<ReportBlock> out;
    report_blocks({at}, rows, {}, [&](const std::vector<ReportBlock>& blocks) { out.push_back(blocks.front()); });
    return out;
}

std::vector<ReportBlock> ElectricalModel::report_some(const Point& at, const WantedBlock& wanted) const
{
    std::vector<ReportBlock> out;
    report_blocks({at}, 0, wanted, [&](const std::vector<ReportBlock>& blocks) { out.push_back(blocks.front()); });
    return out;
}

void ElectricalModel::report_each(const std::vector<Point>& at, std::size_t rows,
                                  const std::function<void(const std::vector<ReportBlock>&)>& visit) const
{
    report_blocks(at, rows, {}, visit);
}

void ElectricalModel::report_blocks(const std::vector<Point>& at, std::size_t rows, const WantedBlock& wanted,
                                    const std::function<void(const std::vector<ReportBlock>&)>& visit) const
{
    // Rows worked out before any is visited, and of them at a time: a thread's start is little beside the latter.
    constexpr std::size_t kBatchRows = 16384, kPartRows = 4096;
    const Reporter reporter(*this, at);
    std::vector<Reporter::Span> spans;
    std::vector<ReportBlock> out, blocks(at.size());
    const auto flush = [&] {
        if (spans.empty()) return;
        const std::size_t part = std::max<std::size_t>(kPartRows / spans.front().rows, 1);
        out.resize(spans.size() * at.size());
        side_by_side((spans.size() + part - 1) / part, [&](std::size_t k) {
            reporter.work(spans, k * part, std::min((k + 1) * part, spans.size()), out);
        });
        for (std::size_t k = 0; k < spans.size(); ++k) {
            const auto first = out.begin() + static_cast<std::ptrdiff_t>(k * at.size());
            std::copy(first, first + static_cast<std::ptrdiff_t>(at.size()), blocks.begin());
            visit(blocks);
        }
        spans.clear();
    };
    for (const Piece& piece : report_pieces_) {
        const Log& log = *piece.log;
        const std::size_t n = rows > 0 ? rows : block_rows(log);
        for (std::size_t k = piece.begin; k + n < piece.end; k += n) {
            if (wanted && !wanted(log, k, k + n)) continue;
            spans.push_back({&piece, k, n});
            if (spans.size() * n >= kBatchRows) flush();
        }
    }
    flush();
}

bool ElectricalModel::sweep(const Point& at, const std::vector<Input>* candidates, std::vector<BlockSum>& sums) const
{
    return work(at, candidates, spans_of(plan_), sums);
}

bool ElectricalModel::sweep_some(const Point& at, const std::vector<Input>* candidates, bool heldout,
                                 std::vector<BlockSum>& sums) const
{
    // A voltage of kPast periods ago may be late.
    const std::size_t lead = kPast + std::max(schedule(at, 0).forgets_in(), schedule(at, 1).forgets_in());
    return work(at, candidates, spans_of(plan_, heldout, lead), sums);
}

bool ElectricalModel::work(const Point& at, const std::vector<Input>* candidates, const std::vector<Span>& spans,
                           std::vector<BlockSum>& sums) const
{
    sums = empty_sums(plan_.blocks.size(), 2, columns_of(at, candidates));
    if (!Plant(*this, at).in_domain()) return false;
    const Pass pass(*this, at, candidates, {{schedule(at, 0), schedule(at, 1)}});
    // Blocks are of one span alone: these are worked on side by side, and the sums do not depend on how.
    std::atomic<bool> ok{true};
    side_by_side(
        spans.size(), [&] { return RowReader(noise_); },
        [&](std::size_t n, RowReader& rows) {
            std::vector<char> its{1};
            run_through(pass, spans[n], rows, Fold::none, {&sums}, its);
            if (!its.front()) ok = false;
        });
    for (BlockSum& s : sums)
        for (auto& g : s.gram) g.triangularView<Eigen::StrictlyUpper>() = g.transpose();
    return ok;
}

std::vector<std::vector<BlockSum>> ElectricalModel::sweep_gains(const std::vector<Point>& at,
                                                                const std::vector<std::vector<Input>>& candidates,
                                                                bool whole) const
{
    const Point& first = at.front();
    std::vector<std::vector<BlockSum>> out(at.size());
    if (!Plant(*this, first).in_domain()) return out;
    std::vector<Pass::Schedules> schedules;
    std::size_t forgets = 0;
    for (const Point& point : at) {
        schedules.push_back({schedule(point, 0), schedule(point, 1)});
        for (const GainSchedule& s : schedules.back()) forgets = std::max(forgets, s.forgets_in());
    }
    const std::vector<Span> spans = whole ? spans_of(plan_) : spans_of(plan_, false, kPast + forgets);
    std::vector<Input> inputs;
    Groups groups{first.columns()};
    for (const std::vector<Input>& group : candidates) {
        inputs.insert(inputs.end(), group.begin(), group.end());
        groups.push_back(columns_of(first, &inputs));
    }
    const Pass pass(*this, first, &inputs, std::move(schedules), std::move(groups));
    // A log in many pieces has many spans: each part of them has sums of its own, so that these do not depend on how
    // many hands there are.
    constexpr std::size_t kMostParts = 16;
    const std::size_t parts = std::min(spans.size(), kMostParts);
    std::vector<std::vector<std::vector<BlockSum>>> sums(parts);
    std::vector<std::vector<char>> ok(parts, std::vector<char>(at.size(), 1));
    side_by_side(
        parts, [&] { return RowReader(noise_); },
        [&](std::size_t part, RowReader& rows) {
            sums[part].assign(at.size(), empty_sums(2, 2, pass.columns));
            std::vector<std::vector<BlockSum>*> of;
            for (std::vector<BlockSum>& s : sums[part]) of.push_back(&s);
            for (std::size_t n = part * spans.size() / parts; n < (part + 1) * spans.size() / parts; ++n) {
                std::vector<char> its(at.size(), 1);
                run_through(pass, spans[n], rows, Fold::kinds, of, its);
                for (std::size_t p = 0; p < at.size(); ++p) ok[part][p] = ok[part][p] && its[p];
            }
        });
    for (std::size_t p = 0; p < at.size(); ++p) {
        const bool all = std::all_of(ok.begin(), ok.end(), [p](const std::vector<char>& of) { return of[p] != 0; });
        if (!all || parts == 0) continue;
        out[p] = std::move(sums.front()[p]);
        for (std::size_t part = 1; part < parts; ++part)
            for (std::size_t kind : {0, 1}) add_to(out[p][kind], sums[part][p][kind]);
        for (BlockSum& s : out[p])
            for (auto& g : s.gram) g.triangularView<Eigen::StrictlyUpper>() = g.transpose();
    }
    return out;
}

}  // namespace dqw
