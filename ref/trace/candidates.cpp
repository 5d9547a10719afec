#include "ref/trace/candidates.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>

#include "ref/effect/range.hpp"
#include "ref/log/symmetric.hpp"
#include "ref/trace/inverter_loss.hpp"

namespace dqw {
namespace {

/// Of a temperature column, below which it tells nothing: at 0.4 % a kelvin R changes by 0.2 % within it.
constexpr double kLeastSpan_K = 0.5;
/// Of the largest: a sensor's last digits, which tell nothing apart.
constexpr double kNoChange = 1e-3;
constexpr double kTurn_rad = 6.0;  ///< nearly: the row that would close it may be missing

/// Angles at the first row that are tried. Without an angle column the three phases look the same every sixth of a
/// turn; four starts over it, and the angle is fitted from there.
std::vector<double> start_angles(bool known)
{
    constexpr double kPart = M_PI / 12.0;
    return known ? std::vector<double>{0.0} : std::vector<double>{0.0, kPart, 2.0 * kPart, 3.0 * kPart};
}

class Catalogue {
public:
    Catalogue(TraceSetup& setup, const std::vector<std::string>& only) : setup_(setup), only_(only) {}

    bool wanted(Law law) const
    {
        return only_.empty() || std::find(only_.begin(), only_.end(), name_of(law)) != only_.end();
    }
    void add(const Input& input, double also_from = 0.0)
    {
        if (wanted(input.law)) setup_.candidates.push_back({{input}, also_from});
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

/// What a parabola with a corner at zero leaves of one axis' currents over the other's, of the largest current, where
/// it leaves less: of a line or the least current for a torque nothing, of an even grid 0.4.
double off_any_curve(const std::vector<Log>& logs, double i_base_A)
{
    std::vector<std::array<double, 2>> i;
    for (const Log& log : logs)
        for (std::size_t k = 0; k < log.rows(); ++k)
            i.push_back({at_row(log.i_d_A, k) / i_base_A, at_row(log.i_q_A, k) / i_base_A});
    double least = HUGE_VAL;
    for (std::size_t axis = 0; axis < 2; ++axis) {
        const auto n = static_cast<Eigen::Index>(i.size());
        Eigen::MatrixXd of(n, 4);
        Eigen::VectorXd y(n);
        for (Eigen::Index k = 0; k < n; ++k) {
            const auto& [d, q] = i[static_cast<std::size_t>(k)];
            const double x = axis == 0 ? q : d;
            of.row(k) << 1.0, x, std::abs(x), x * x;
            y[k] = axis == 0 ? d : q;
        }
        const Eigen::VectorXd rest = y - of * least_squares(of, y);
        least = std::min(least, std::sqrt(rest.squaredNorm() / static_cast<double>(std::max<Eigen::Index>(n, 1))));
    }
    return least;
}

double rms_voltage(const std::vector<Log>& logs)
{
    double square = 0.0, rows = 0.0;
    for (const Log& log : logs)
        for (std::size_t k = 0; k < log.rows(); ++k)
            square += std::pow(at_row(log.v_d_V, k), 2) + std::pow(at_row(log.v_q_V, k), 2), ++rows;
    return std::sqrt(square / std::max(rows, 1.0));
}

/// Settled rows without time, each warmed by its own current. (E170)
void own_heat_candidates(const TraceSetup& setup, Catalogue& c)
{
    // Of a grid's other axis: some of its rows off a curve are few to tell heat by.
    constexpr double kLeastArea = 0.1;
    if (!(off_any_curve(*setup.logs, setup.i_base_A) > kLeastArea)) {
        const char* const why = "no temperature that changes and no time, and the currents lie on one curve: heat "
                                "looks there like iron that bends";
        return c.cannot(Law::winding_temperature, why), c.cannot(Law::magnet_temperature, why);
    }
    const bool grid = std::all_of(setup.logs->begin(), setup.logs->end(),
                                  [&](const Log& log) { return !rows_across(log, setup.i_base_A).empty(); });
    for (const int first : {kOwnHeat, kOwnHeatAcross}) {
        const bool across = first != kOwnHeat;
        // Without a memory no order counts.
        for (int n = across ? 1 : 0; n < kOwnHeats && (grid || !across); ++n) {
            Input winding{Law::winding_temperature}, magnet{Law::magnet_temperature};
            winding.heat = magnet.heat = first + n;
            c.add(winding), c.add(magnet);
            // A magnet is the slower one; of both the best pair is within two steps of one that is tried.
            for (; magnet.heat < first + kOwnHeats; magnet.heat += 3) c.add(winding, magnet);
        }
    }
}

void temperature_candidates(const TraceSetup& setup, Catalogue& c, bool turns, bool moves)
{
    const std::vector<Log>& logs = *setup.logs;
    const bool winding = everywhere(logs, &Log::temp_winding_C) &&
                         range_of(logs, &Log::temp_winding_C).span() > kLeastSpan_K;
    const bool magnet = everywhere(logs, &Log::temp_magnet_C) &&
                        range_of(logs, &Log::temp_magnet_C).span() > kLeastSpan_K;
    const bool heats = everywhere(logs, &Log::t_s) && moves;
    const auto state = [](Law law, int heat) {
        Input in{law};
        in.heat = heat;
        return in;
    };
    // A thermometer that stays says that nothing warms.
    const bool bare = std::all_of(logs.begin(), logs.end(), [](const Log& log) {
        return log.t_s.empty() && log.temp_winding_C.empty() && log.temp_magnet_C.empty();
    });
    if (setup.regime == Regime::steady && bare && turns && moves) return own_heat_candidates(setup, c);
    if (winding)
        c.add({Law::winding_temperature});
    else if (heats)
        for (const int n : kSoughtHeats)
            c.add(state(Law::winding_temperature, n)), c.add(state(Law::winding_temperature, n + kHeatsOfAKind));
    else
        c.cannot(Law::winding_temperature,
                 "no temperature that changes, and no time or no current for a heating state");
    if (!turns) {
        c.cannot(Law::magnet_temperature, "the machine does not turn");
        return;
    }
    if (magnet)
        c.add({Law::magnet_temperature});
    else if (winding)
        c.add(state(Law::magnet_temperature, -1));
    else if (heats)
        for (const int n : kSoughtHeats)
            c.add(state(Law::magnet_temperature, n)), c.add(state(Law::magnet_temperature, n + kHeatsOfAKind));
    else
        c.cannot(Law::magnet_temperature, "no temperature that changes, and no time or no current for a heating state");
    if (winding)
        c.add({Law::winding_temperature}, magnet ? Input{Law::magnet_temperature} : state(Law::magnet_temperature, -1));
    else if (heats)
        for (const int n : kSoughtHeats)
            for (const int m : kSoughtHeats)
                if (m >= n) c.add(state(Law::winding_temperature, n), state(Law::magnet_temperature, m));
}

/// `averaged`: settled rows without an angle, each a mean over turns.
void dead_time_candidates(const std::vector<Log>& logs, double i_base_A, bool angle, bool averaged, bool pulses,
                          Catalogue& c)
{
    const std::string stated = stated_modulation(logs);
    const auto add = [&](Modulation m, double width, double start) {
        Input in = dead_time_input(m, width * i_base_A, start, !angle && !averaged);
        in.averaged = averaged;
        c.add(in);
    };
    // The width is fitted; a pass of refine() halves or doubles it, so each from 0.0025 to 0.16 is one pass away.
    for (double width : {0.005, 0.02, 0.08})
        for (double start : start_angles(angle || averaged)) add(modulation_named(stated), width, start);
    // Where about as much is given back as is lost, one loss finds neither. (E173)
    constexpr double kGivenBack = 0.03;
    for (const Modulation m : kModulations)
        if (angle && pulses && (stated.empty() || m == modulation_named(stated))) {
            Input in = dead_time_input(m, 0.005 * i_base_A, 0.0, false);
            in.law = Law::dead_given_back, in.loss = LossLaw::edges;
            in.shape[2] = link_to_fit_V(logs), in.shape[3] = kGivenBack * i_base_A;
            c.add(in);
        }
    // Without an angle a modulation is sought where a dead time was found.
    if (!angle || averaged) return;
    if (states_a_rest(logs)) add(Modulation::centred, 0.02, 0.0);
    if (!stated.empty()) return;
    for (const Modulation m : {Modulation::clamped_low, Modulation::clamped_high, Modulation::clamped_60})
        add(m, 0.02, 0.0);
}

/// Faults of the current sensors, tried beside the effects so that no effect is named for them. The limit is fitted:
/// each from 0.42 to 1 of the largest current is within a fifth of one that is tried.
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
        for (double start : start_angles(angle)) {
            Input in{Law::clipped_current, {part * most, start, 0, 0}};
            in.free_angle = !angle;
            setup.candidates.push_back({{in}});
        }
}

/// Currents that are told between the legs' pulses.
void pulsed_candidates(Law law, const std::vector<Log>& logs, bool angle, const std::string& why, Catalogue& c)
{
    if (!why.empty()) return;
    const double link_V = link_to_fit_V(logs);
    const std::string stated = stated_modulation(logs);
    // Of a shift: where the pulses turn, what they add falls on one side and grows on the other. (E168)
    const double middle_s = law == Law::pulsed_shift ? 0.5 * logs.front().dt_s : 0.0;
    for (const Modulation m : kModulations) {
        if (!stated.empty() && m != modulation_named(stated)) continue;
        c.add(pulsed_input(law, m, link_V, 0.0, !angle), middle_s);
        // Legs that rest at the upper rail look the same every third of a turn.
        const bool high = m == Modulation::clamped_high || m == Modulation::clamped_60;
        if (!angle && high) c.add(pulsed_input(law, m, link_V, M_PI / 3.0, true), middle_s);
    }
}

void shift_candidates(bool settled, bool speeds, const std::string& why, Catalogue& c)
{
    if (!why.empty()) return c.cannot(Law::sample_shift, why);
    const auto add = [&](Instant which) { c.add({Law::sample_shift, {static_cast<double>(which)}}); };
    add(Instant::currents_before);
    // Of settled rows a turned voltage is the same in both, and one in another frame is late.
    if (!settled) add(Instant::currents_after), add(Instant::voltage_turned);
    // At one speed they are an angle offset, and a delay.
    if (speeds) add(Instant::angle);
    if (speeds && !settled) add(Instant::voltage_frame);
}

void lag_candidates(bool settled, bool turns, const std::string& why, Catalogue& c)
{
    if (settled) return c.cannot(Law::sensor_lag, "settled rows: a filter only turns the currents, as a shift does");
    if (!why.empty()) return c.cannot(Law::sensor_lag, why);
    c.add({Law::sensor_lag, {static_cast<double>(Channel::currents)}});
    if (turns) c.add({Law::sensor_lag, {static_cast<double>(Channel::speed)}});
}

/// Of its largest, what a link must change by: a sensor's noise and a PWM period's ripple are less.
constexpr double kLeastLink = 0.02;

void link_candidates(const TraceSetup& setup, const std::string& why, Catalogue& c)
{
    const std::vector<Log>& logs = *setup.logs;
    if (!why.empty()) return c.cannot(Law::voltage_scale, why);
    double most_W = 0.0, least_W = 0.0;
    for (const Log& log : logs)
        for (std::size_t k = 0; k < log.rows(); ++k) {
            const double W = 1.5 * (at_row(log.v_d_V, k) * at_row(log.i_d_A, k) +
                                    at_row(log.v_q_V, k) * at_row(log.i_q_A, k));
            most_W = std::max(most_W, W), least_W = std::min(least_W, W);
        }
    const Range link = range_of(logs, &Log::v_dc_V);
    const bool column = everywhere(logs, &Log::v_dc_V) && link.least > 0.0;
    if (column && link.span() > kLeastLink * link.most)
        c.add({Law::voltage_scale, {static_cast<double>(Sag::by_its_column), link.most, 1.0 - link.least / link.most}});
    if (!(most_W - least_W > 0.0)) return;
    Input behind{Law::voltage_scale,
                 {static_cast<double>(Sag::behind_a_resistance), column ? link.most : 0.0, std::max(most_W, -least_W)}};
    c.add(behind);
    if (setup.regime != Regime::dynamic || !everywhere(logs, &Log::t_s)) return;
    for (const int n : kSoughtLinks) behind.heat = n, c.add(behind);
}

void shaft_candidates(Law law, double pole_pairs, const std::string& why, Catalogue& c)
{
    if (!why.empty()) return c.cannot(law, why);
    if (law == Law::magnet_asymmetry) return c.add({law, {1.0, 0.0, pole_pairs}});
    for (double order : {1.0, 2.0})
        for (double of_encoder : {0.0, 1.0}) c.add({law, {order, of_encoder, pole_pairs}});
}

void electrical_candidates(TraceSetup& setup, Catalogue& c)
{
    const std::vector<Log>& logs = *setup.logs;
    const bool settled = setup.regime != Regime::dynamic;
    const double ib = setup.i_base_A;
    Range w, i_d, i_q;
    for (const Log& log : logs)
        for (std::size_t k = 0; k < log.rows(); ++k)
            w.add(setup.regime == Regime::standstill ? 0.0 : at_row(log.w_m_rad_s, k)), i_d.add(at_row(log.i_d_A, k)),
                i_q.add(at_row(log.i_q_A, k));
    const bool turns = w.size() > 0.0,
               angle = everywhere(logs, &Log::theta_e_rad) || everywhere(logs, &Log::theta_m_rad);
    const bool moves = std::max(i_d.sd(), i_q.sd()) > kNoChange * ib;
    // An angle is swept where it covers a turn; an integrated one needs rows in time.
    double swept = 0.0;
    for (std::size_t n = 0; n < logs.size(); ++n) {
        if (!angle && settled) continue;
        const TraceColumns& columns = setup.columns[n];
        for (std::size_t k = 1; k < logs[n].rows(); ++k)
            swept += std::abs(std::remainder(std::atan2(columns.sin_e[k], columns.cos_e[k]) -
                                                 std::atan2(columns.sin_e[k - 1], columns.cos_e[k - 1]),
                                             2.0 * M_PI));
    }
    // Within it, what grows with the square of the speed differs from what grows with the speed by 0.1^2/8 of itself.
    constexpr double kLeastSpeeds = 0.1;
    double shaft_turned = 0.0;
    bool shaft = setup.pole_pairs_known && !settled;
    for (const TraceColumns& columns : setup.columns) {
        shaft = shaft && !columns.cos_m.empty();
        for (std::size_t k = 1; k < columns.cos_m.size(); ++k)
            shaft_turned += std::abs(std::remainder(std::atan2(columns.sin_m[k], columns.cos_m[k]) -
                                                        std::atan2(columns.sin_m[k - 1], columns.cos_m[k - 1]),
                                                    2.0 * M_PI));
    }
    const std::string shaft_why = settled                     ? "settled rows are means over turns of the shaft"
                                  : !shaft                    ? "the angle of the shaft is not known"
                                  : shaft_turned <= kTurn_rad ? "the shaft does not make a turn"
                                                              : "";
    const bool speeds = w.span() > kLeastSpeeds * w.size();
    const std::string unswept = swept > kTurn_rad ? ""
                                : angle           ? "the angle hardly changes"
                                                  : "no angle column, and none can be integrated";
    // At rest what phases do not share is a matrix between the axes, which one direction of current does not show.
    const bool both_axes = std::min(i_d.sd(), i_q.sd()) > kNoChange * ib;
    const std::pair<Asks, std::string> lacks[] = {
        {asks_turns, turns ? "" : "the machine does not turn"},
        {asks_sweep, unswept},
        {asks_axes, angle && !turns && both_axes ? "" : unswept},
        {asks_currents, moves ? "" : "the currents do not change"},
        {asks_points, moves || w.span() > kNoChange * w.size()
                          ? ""
                          : "one operating point: neither the currents nor the speed change"},
        {asks_shaft, shaft_why},
        {asks_speeds, speeds ? "" : "one speed only"},
    };
    /// The first that the log lacks of what an effect asks for.
    const auto lack = [&](Law law) {
        const AsksOf& asks = effect_of(law).asks;
        for (const auto& [what, why] : lacks)
            if (((settled ? asks.settled : asks.moving) & what) != 0 && !why.empty()) return why;
        return std::string();
    };
    for (const Effect& e : effects()) {
        const std::string why = lack(e.id);
        switch (e.id) {
        case Law::dead_time:
            if (why.empty())
                dead_time_candidates(logs, ib, angle, settled && !angle && turns, !settled, c);
            else
                c.cannot(e.id, why);
            break;
        case Law::winding_temperature: temperature_candidates(setup, c, turns, i_d.size() + i_q.size() > 0.0); break;
        case Law::magnet_temperature: break;
        case Law::flux_harmonics:
            if (swept > kTurn_rad && setup.regime == Regime::dynamic && c.wanted(Law::clipped_current))
                clipped_candidates(setup, angle);
            c.add_unless({e.id, {6}}, why);
            if (why.empty()) c.add({e.id, {6}}, {e.id, {12}});
            break;
        case Law::iron_loss:
            c.add_unless({e.id}, why);
            // Eddies follow a voltage that changes by rows within some tens of microseconds, a period or so: a start.
            if (why.empty() && !settled)
                for (const double periods : {kTurningAlone, 0.7, 2.0}) c.add({e.id, {periods}});
            if (why.empty() && settled)
                for (const double law : {kExcessLoss, kHysteresis}) c.add({e.id, {law, rms_voltage(logs)}});
            break;
        case Law::turn_short:
            c.add_unless({e.id}, why);
            if (why.empty() && !settled) c.add({e.id, {kTurningAlone}});
            break;
        case Law::sample_shift:
            shift_candidates(settled, speeds && turns, why, c);
            if (!settled) pulsed_candidates(Law::pulsed_shift, logs, angle, why, c);
            break;
        case Law::sensor_lag:
            lag_candidates(settled, turns, why, c);
            if (!settled) pulsed_candidates(Law::pulsed_lag, logs, angle, why, c);
            break;
        case Law::voltage_scale: link_candidates(setup, why, c); break;
        case Law::encoder_eccentricity:
        case Law::magnet_asymmetry: shaft_candidates(e.id, setup.pole_pairs, why, c); break;
        default:
            if (!e.mechanical()) c.add_unless({e.id, {e.shape == Shape::current_unit ? ib : 0.0}}, why);
        }
        if (e.id == Law::cross_saturation && why.empty()) c.add({Law::saturation, {ib}}, {e.id, {ib}});
    }
}

void mechanical_candidates(TraceSetup& setup, Catalogue& c)
{
    const Range w = range_of(*setup.logs, &Log::w_m_rad_s);
    const double base = w.size();
    const std::string still = w.sd() > kNoChange * base ? "" : "the speed does not change";
    // More than a sensor's offset or a swing about rest.
    constexpr double kMoves = 0.02;
    const bool both_ways = w.least < -kMoves * base && w.most > kMoves * base;
    // Each log may turn one way only, and they the other way.
    const std::string one_way = both_ways ? ""
                                          : "the machine turns one way only: it cannot be told from Coulomb friction";
    // Both are fitted, and a pass of refine() halves or doubles them: a width from 0.0025 to 0.06 is two passes from
    // one of these at most, a fall from 0.015 to 0.6 one pass.
    for (double part : {0.005, 0.03}) {
        if (still.empty()) c.add({Law::coulomb_friction, {part * base}});
        if (still.empty() && one_way.empty())
            c.add({Law::direction_asymmetry, {part * base}}),
                c.add({Law::coulomb_friction, {part * base}}, {Law::direction_asymmetry, {part * base}});
        if (still.empty())
            for (double fall : {0.03, 0.1, 0.3})
                c.add({Law::stribeck_friction, {part * base, fall * base}}),
                    c.add({Law::coulomb_friction, {part * base}}, {Law::stribeck_friction, {part * base, fall * base}});
    }
    if (!still.empty()) c.cannot(Law::coulomb_friction, still), c.cannot(Law::stribeck_friction, still);
    if (!still.empty() || !one_way.empty()) c.cannot(Law::direction_asymmetry, still.empty() ? one_way : still);
    c.add_unless({Law::load_torque}, still);
    // The least common multiple of slots and poles: 24 of 12 and 8, 48 of 48 and 8. The 60 of 12 and 10 is not sought.
    constexpr int kMostOrder = 48;
    double turned = 0.0;
    for (const auto& angle : setup.angle)
        for (std::size_t k = 1; k < angle.size(); ++k)
            turned += std::abs(std::remainder(angle[k] - angle[k - 1], 2.0 * M_PI));
    if (turned > kTurn_rad)
        for (int n = 1; n <= kMostOrder; ++n) c.add({Law::cogging_torque, {static_cast<double>(n)}});
    else
        c.cannot(Law::cogging_torque, "the shaft does not make a turn");
}

}  // namespace

void add_candidates(TraceSetup& setup, const std::vector<std::string>& only)
{
    Catalogue catalogue(setup, only);
    if (setup.regime == Regime::mechanical)
        mechanical_candidates(setup, catalogue);
    else
        electrical_candidates(setup, catalogue);
}

}  // namespace dqw
