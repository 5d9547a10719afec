#include "ref/trace/trace.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <stdexcept>

#include "ref/effect/effect.hpp"
#include "ref/effect/pulses.hpp"
#include "ref/effect/range.hpp"
#include "ref/fit/explain.hpp"
#include "ref/log/symmetric.hpp"
#include "ref/model/open_circuit.hpp"
#include "ref/trace/behind_filter.hpp"
#include "ref/trace/clue.hpp"
#include "ref/trace/column_noise.hpp"
#include "ref/trace/confidence.hpp"
#include "ref/trace/flux_map.hpp"
#include "ref/trace/inverter_loss.hpp"
#include "ref/trace/noise.hpp"
#include "ref/trace/pole_pairs.hpp"
#include "ref/trace/reading.hpp"
#include "ref/trace/predicts.hpp"
#include "ref/trace/rest.hpp"
#include "ref/trace/result.hpp"
#include "ref/trace/rules.hpp"
#include "ref/trace/sampled_instant.hpp"
#include "ref/trace/sense.hpp"
#include "ref/trace/setup.hpp"
#include "ref/trace/state.hpp"

namespace dqw {
namespace {

// Halved or doubled: (E48).
/// Part of an axis' voltage (torque): where all are below, the residual is the sampling's own.
constexpr double kExact = 5e-4;
constexpr std::size_t kLeastBlocks = 3;  ///< of two there is no scatter
/// In a period, w T: below, it does not matter in whose frame a voltage is held. A vector held in the other's is
/// shorter by (w T)^2/24, 3e-4: less than kExact.
constexpr double kLeastTurn_rad = 0.08;
constexpr int kPasses = 12;        ///< from where a part of the rows has it
constexpr std::size_t kRare = 50;  ///< one row of so many is an extreme

bool is_bent(const Point& at)
{
    return std::any_of(at.terms.begin(), at.terms.end(), [](const Term& t) { return bends(t.input.law); });
}

using Blocks = std::vector<ReportBlock>;

/// Reported RMS of each axis that is the sampling's own: of its own voltage, and where the machine turns, of what a
/// vector that no row says how it stands within the period may lie off in either: `pulsed`.
std::vector<double> exact_of(const TraceSetup& setup, const Blocks& blocks, int channels, bool pulsed)
{
    std::vector<double> out(static_cast<std::size_t>(channels), 0.0);
    if (blocks.empty()) return out;
    double own[2] = {}, all = 0.0, turned = 0.0;
    for (const ReportBlock& b : blocks) {
        double square = 0.0;
        for (int c = 0; c < channels; ++c)
            own[c] += b.measured[c] * b.measured[c], square += std::pow(b.measured[c], 2);
        const double turn = setup.pole_pairs * at_row(b.log->w_m_rad_s, b.begin) * b.log->dt_s;
        all += square, turned += square * std::pow(turn, 4);
    }
    const double n = static_cast<double>(blocks.size());
    const bool turns = pulsed && setup.regime == Regime::dynamic && channels == 2;
    const double vector = turns ? std::min(kExact * std::sqrt(all / n), std::sqrt(turned / n) / 24.0) : 0.0;
    for (int c = 0; c < channels; ++c)
        out[static_cast<std::size_t>(c)] = std::max(kExact * std::sqrt(own[c] / n), vector);
    return out;
}

/// Rows that no fit saw.
std::vector<std::vector<char>> heldout_rows(const TraceSetup& setup)
{
    std::vector<std::vector<char>> held;
    for (const Log& log : *setup.logs) held.emplace_back(log.rows(), 0);
    for (const FineBlock& b : setup.full->plan().blocks)
        if (b.heldout)
            for (std::size_t k = b.begin; k < b.end; ++k)
                held[static_cast<std::size_t>(b.piece->log - setup.logs->data())][k] = 1;
    return held;
}

struct Judge {
    const TraceSetup& setup;
    std::vector<std::vector<char>> held;
    int channels;

    explicit Judge(const TraceSetup& s) : setup(s), held(heldout_rows(s)), channels(s.full->channels()) {}

    /// Whether no fit saw a block's two ends, or all did.
    bool is(const Log& log, std::size_t begin, std::size_t end, bool seen) const
    {
        const auto& h = held[static_cast<std::size_t>(&log - setup.logs->data())];
        return seen ? !h[begin] && !h[end - 1] : h[begin] && h[end - 1];
    }
    Blocks of(const Point& at, bool seen) const
    {
        return setup.full->report_some(
            at, [&](const Log& log, std::size_t begin, std::size_t end) { return is(log, begin, end, seen); });
    }
    double rms(const Point& at) const { return held_out(at).rms; }
    std::vector<double> each(const Point& at) const { return held_out(at).each; }
    /// RMS of all channels together, or, where it is beyond `most`, HUGE_VAL as soon as a part of the blocks says so.
    double rms_to(const Point& at, double most) const
    {
        constexpr std::size_t kParts = 8;
        constexpr double kRounding = 1.0 + 1e-9;
        const auto count = static_cast<double>(blocks_);
        Blocks all;
        double square = 0.0;
        if (known(at) != nullptr || !(count > 0.0)) return joint(each(at));
        for (const Log& log : *setup.logs)
            for (std::size_t part = 0; part < kParts; ++part) {
                const std::size_t first = part * log.rows() / kParts, last = (part + 1) * log.rows() / kParts;
                const Blocks some = setup.full->report_some(at, [&](const Log& l, std::size_t begin, std::size_t end) {
                    return &l == &log && begin >= first && begin < last && is(l, begin, end, false);
                });
                for (const ReportBlock& b : some)
                    for (int c = 0; c < channels; ++c) square += b.residual[c] * b.residual[c];
                if (std::sqrt(square / (channels * count)) > kRounding * most) return HUGE_VAL;
                all.insert(all.end(), some.begin(), some.end());
            }
        return joint(keep(at, all).each);
    }
    const Noise& noise(const Point& at) const
    {
        if (!noise_at_ || !(*noise_at_ == at)) noise_ = noise_of(setup, at), noise_at_ = at;
        return noise_;
    }

private:
    struct HeldOut {
        Point at;
        double rms = 0.0;
        std::vector<double> each;
    };
    /// The same points are asked for again while the search goes on.
    const HeldOut* known(const Point& at) const
    {
        const auto is_it = [&](const HeldOut& h) { return h.at == at; };
        const auto found = std::find_if(kept_.begin(), kept_.end(), is_it);
        return found != kept_.end() ? &*found : nullptr;
    }
    const HeldOut& held_out(const Point& at) const
    {
        const HeldOut* const out = known(at);
        return out != nullptr ? *out : keep(at, of(at, false));
    }
    const HeldOut& keep(const Point& at, const Blocks& blocks) const
    {
        constexpr std::size_t kKept = 32;
        blocks_ = blocks.size();
        HeldOut out{at, rms_of(blocks, channels), {}};
        for (const AxisResidual& a : axes_of(setup, blocks)) out.each.push_back(a.rms);
        if (kept_.size() == kKept) kept_.pop_front();
        kept_.push_back(std::move(out));
        return kept_.back();
    }

    mutable std::deque<HeldOut> kept_;
    mutable std::size_t blocks_ = 0;  ///< held out, of any point
    mutable std::optional<Point> noise_at_;
    mutable Noise noise_;
};

/// The plain model that leaves the least reported residual on the rows seen: the residual is linear in the parameters,
/// but for a trace, so two steps of least squares do. Where the model lacks something, prediction and least residual
/// differ.
Point least_residual(const Judge& judge, Point at)
{
    constexpr int kRounds = 2, kLeastEach = 4;  // of values for each parameter
    // Of a parameter: its difference is exact to 1e-3 where bent, to 1e-10 by rounding.
    constexpr double kStep = 1e-3, kLeastStep = 1e-9;
    for (int round = 0; round < kRounds; ++round) {
        const Blocks here = judge.of(at, true);
        const Eigen::Index n = at.base.size(), m = static_cast<Eigen::Index>(here.size()) * judge.channels;
        if (m < kLeastEach * n) return at;
        Eigen::MatrixXd x(m, n);
        Eigen::VectorXd y(m);
        const auto fill = [&](const Blocks& blocks, auto&& column) {
            for (std::size_t k = 0; k < blocks.size(); ++k)
                for (int c = 0; c < judge.channels; ++c)
                    column(static_cast<Eigen::Index>(k) * judge.channels + c) = blocks[k].residual[c];
        };
        fill(here, y);
        for (Eigen::Index j = 0; j < n; ++j) {
            Point moved = at;
            const double step = std::max(std::abs(at.base[j]) * kStep, kLeastStep);
            moved.base[j] += step;
            fill(judge.of(moved, true), x.col(j));
            x.col(j) = (x.col(j) - y) / step;
        }
        const Eigen::VectorXd size = x.colwise().norm().cwiseMax(1e-300);
        const Eigen::VectorXd delta = -least_squares(x * size.cwiseInverse().asDiagonal(), y).cwiseQuotient(size);
        Point next = at;
        next.base += delta;
        if (!next.base.allFinite()) return at;
        at = next;
    }
    return at;
}

/// What an effect has to better: the held-out RMS of the plain model, or of the one of least residual where that is
/// clearly less on the rows seen. Its parameters are no estimate: noise on the slopes of the currents makes L small.
double least_of(const Judge& judge, const Point& plain)
{
    const Point least = least_residual(judge, plain);
    // Chance alone takes n/(2 m) of the RMS of m values where n parameters are fitted to it: 3 % of 67 for four.
    constexpr double kLess = 0.97;
    const bool less = rms_of(judge.of(least, true), judge.channels) <
                      kLess * rms_of(judge.of(plain, true), judge.channels);
    return judge.rms(less ? least : plain);
}

TraceFit fit_of(const TraceSetup& setup, const Judge& judge, const Point& at, const Eigen::VectorXd& sd)
{
    const Blocks blocks = judge.of(at, false);
    return {base_parameters(setup, at, sd), rms_of(blocks, judge.channels), axes_of(setup, blocks)};
}

void fill_blocks(const TraceSetup& setup, const Judge& judge, const Point& before, const Point& after,
                 TraceResult& result)
{
    const Blocks a = setup.full->report(before, 0), b = setup.full->report(after, 0);
    TraceBlocks& out = result.blocks;
    for (int c = 0; c < judge.channels; ++c)
        out.axes.push_back({setup.regime == Regime::mechanical ? "torque" : c == 0 ? "d" : "q", {}, {}, {}});
    for (std::size_t k = 0; k < a.size(); ++k) {
        const Log& log = *a[k].log;
        const std::size_t row = (a[k].begin + a[k].end) / 2, n = static_cast<std::size_t>(&log - setup.logs->data());
        const auto put = [&](std::vector<double>& to, const std::vector<double>& from) {
            if (!from.empty()) to.push_back(from[row]);
        };
        put(out.t_s, log.t_s), put(out.i_d_A, log.i_d_A), put(out.i_q_A, log.i_q_A), put(out.w_m_rad_s, log.w_m_rad_s),
            put(out.temp_C, log.temp_winding_C);
        if (setup.regime == Regime::dynamic || !log.theta_e_rad.empty()) {
            const double angle = std::atan2(setup.columns[n].sin_e[row], setup.columns[n].cos_e[row]);
            out.theta_e_rad.push_back(angle < 0.0 ? angle + 2.0 * M_PI : angle);
        }
        out.heldout.push_back(judge.is(log, a[k].begin, a[k].end, false) ? 1 : 0);
        for (int c = 0; c < judge.channels; ++c) {
            TraceAxisBlocks& axis = out.axes[static_cast<std::size_t>(c)];
            axis.measured.push_back(a[k].measured[c]), axis.residual_before.push_back(a[k].residual[c]),
                axis.residual_after.push_back(b[k].residual[c]);
        }
    }
    out.spectra = spectra(setup, a, b);
}

void say_inverter(const Point& at, TraceEffect& effect)
{
    for (const Term& t : at.terms)
        if (is_dead_time(t.input.law) && effect.name == name_of(t.input.law))
            effect.modulation = name_of(t.input.modulation), effect.law = name_of(t.input.loss);
}

/// A leg that rests, and loses as much as those that switch.
void say_rest(const TraceSetup& setup, const Point& at, std::vector<std::string>& notes)
{
    for (const Term& t : at.terms)
        if (is_dead_time(t.input.law) && t.input.modulation == Modulation::centred && states_a_rest(*setup.logs))
            notes.push_back("dead time: " + loses_at_rest_text(stated_modulation(*setup.logs)));
}

/// What is a whole row late is the voltage interval's, where that is said the other way round.
void say_row_late(const TraceEffect& e, const std::vector<Log>& logs, std::vector<std::string>& notes)
{
    constexpr double kPart = 0.1;  // of a period: no sensing is as late by chance
    const bool previous = logs.front().previous;
    if (e.name != "sample_shift" || e.channel != (previous ? "voltage" : "currents")) return;
    const double dt_s = logs.front().dt_s;
    for (const Estimate& p : e.parameters)
        if (p.name == "shift_s" && std::abs(p.value - dt_s) < kPart * dt_s)
            notes.push_back(e.channel + " a row late: where a row's voltage acts " +
                            (previous ? "from its stamp on, voltage_interval = \"next\""
                                      : "until its stamp, voltage_interval = \"previous\"") +
                            " under [log] of the machine file says so");
}

/// What of settled points' effects is in no parameter: by which law iron loses, in which order rows warmed.
void say_settled(const TraceSetup& setup, const Point& at, std::vector<std::string>& notes)
{
    for (const Term& t : at.terms) {
        const double law = t.input.law == Law::iron_loss && setup.regime == Regime::steady ? t.input.shape[0] : 0.0;
        if (law < 0.0)
            notes.push_back("iron loss: goes with " +
                            std::string(law == kHysteresis ? "the induced voltage, as hysteresis does"
                                                           : "the 1.5th power of the induced voltage") +
                            "; R_fe is that at " + figure(t.input.shape[1]) + " V");
        if (t.input.heat >= kOwnHeatAcross) {
            notes.emplace_back("own heat: follows the grid's rows across the order in which the file has them");
            break;
        }
    }
}

/// Firmware learns what a dead time takes whichever way the current flows by a weight of its own.
TraceInput firmware_input(const TraceSetup& setup, const Point& at, const Term& term)
{
    TraceInput in = input_of(setup, at, term);
    if (is_dead_time(term.input.law)) in.modulation = name_of(term.input.modulation), in.weights.resize(1);
    return in;
}

/// The best of the log's own starting points.
Point best_start(const TraceSetup& setup)
{
    const Model& model = setup.search();
    Point best = setup.starts.front();
    double most = -HUGE_VAL;
    for (const Point& start : setup.starts) {
        std::vector<BlockSum> sums;
        if (!model.pass(start, {}, sums)) continue;
        const double seen = left_of(model, sums).seen;
        if (seen > most) best = start, most = seen;
    }
    return best;
}

ShortedTurns shorted_turns_of(const std::vector<TraceEffect>& found)
{
    ShortedTurns out;
    for (const TraceEffect& e : found) {
        if (e.name != name_of(Law::turn_short)) continue;
        for (const Estimate& p : e.parameters)
            if (p.name == "R_short_ohm")
                out.conductance_S = 1.0 / p.value, out.sd_S = p.sd / (p.value * p.value);
            else if (p.name == "axis_rad")
                out.axis_rad = p.value;
    }
    return out;
}

/// Where the log cannot tell saturation, or it is not asked for, it tells no map.
bool tells_bends(const TraceSetup& setup)
{
    return std::any_of(setup.candidates.begin(), setup.candidates.end(),
                       [](const Candidate& c) { return c.inputs.front().law == Law::saturation; });
}

/// How the legs may pulse, where pulses bend the currents by enough to be part of what the point leaves. (E169)
std::vector<Input> pulses_of(const TraceSetup& setup, const Judge& judge, const Point& at)
{
    const std::vector<Log>& logs = *setup.logs;
    constexpr double kPart = 0.3;  // of the residual: a part that adds 5 % to it, which an effect must take
    const bool angle = everywhere(logs, &Log::theta_e_rad) || everywhere(logs, &Log::theta_m_rad);
    if (setup.regime != Regime::dynamic) return {};
    double square = 0.0, rows = 0.0, dt_s = 0.0;
    for (const Log& log : logs)
        for (std::size_t k = 0; k < log.rows(); ++k) {
            const double v = std::hypot(log.v_d_V[k], log.v_q_V[k]);
            square += v * v, ++rows, dt_s = std::max(dt_s, log.dt_s);
        }
    const double rate = at.base[0] / std::min(at.base[1], at.base[2]) * dt_s;
    // What eddies hold of a pulse of half a period more than of its mean, which R takes. (E181)
    double held = 0.0;
    for (const Term& t : at.terms)
        if (const double n = t.input.shape[0]; t.input.law == Law::iron_loss && n > 0.0)
            held += 2.0 / n * FilteredPulse(n, 1.0).beyond_mean(0.5) * at.base[0] * t.weights[0];
    const std::vector<double> each = judge.each(at);
    // Of iron that bends the currents' swings do more.
    const double most_V = std::max(rate * rate / 24.0, std::abs(held)) * std::sqrt(square / rows);
    if (!is_bent(at) && most_V < kPart * std::hypot(each[0], each[1])) return {};
    // The angle is fitted as well. Without one the phases look the same every third of a turn; half a turn on they do so
    // with high for low, but for their pulses, which stay in the middle.
    const double link_V = link_to_fit_V(logs);
    const std::vector<double> starts = angle ? std::vector<double>{0.0}
                                             : std::vector<double>{0.0, M_PI / 6.0, M_PI / 3.0, M_PI / 2.0};
    const std::string stated = stated_modulation(logs);
    std::vector<Input> out;
    for (const Modulation m : kModulations)
        for (const double start : starts)
            if (stated.empty() || m == modulation_named(stated))
                out.push_back(pulsed_input(Law::pulses, m, link_V, start, !angle));
    return out;
}

SelectOptions select_options(const TraceSetup& setup, const Judge& judge, const Blocks& held,
                             const TraceOptions& options, int& ticks)
{
    SelectOptions o;
    o.veto = [&setup](const Point& p) { return sense_of(setup, p); };
    o.settle = [&setup](Refined r) {
        const Model& model = setup.search();
        return settle_instant(setup, model, settle_loss(setup, model, settle_state(model, std::move(r))));
    };
    if (tells_bends(setup))
        o.mapped = [&setup, &judge](const Point& p) {
            // What a polynomial leaves of its iron at the rows' scale stands in the floor: the rows held out decide.
            const bool open = is_bent(p) || judge.rms(p) > kStructured * judge.noise(p).of_rows();
            return open ? with_map(setup, setup.search(), p) : Refined();
        };
    if (setup.regime == Regime::dynamic) {
        o.may_be_sampling = may_be_sampling;
        o.to_law_noise = [&setup](const Refined& r) { return nats_to_law_noise(setup, r); };
    }
    o.completes = [&judge](const Point& few, const Point& more) {
        return completes(judge.rms(few), judge.rms(more), judge.noise(more).floor);
    };
    o.pulses = [&setup, &judge](const Point& p) { return pulses_of(setup, judge, p); };
    o.reported_rms = [&judge](const Point& p) { return judge.each(p); };
    o.reported_rms_to = [&judge](const Point& p, double most) { return judge.rms_to(p, most); };
    if (held.size() < kLeastBlocks)
        throw std::invalid_argument(setup.logs->front().path + ": too few rows to hold some out: " +
                                    std::to_string(held.size()) + " blocks of the residual");
    o.own = exact_of(setup, held, judge.channels, false);
    o.one_speed = setup.one_speed;
    if (options.progress)
        o.tick = [&options, &ticks] {
            // Of how many is not known: half of it after twenty.
            ++ticks;
            options.progress(0.95 * ticks / (ticks + 20.0));
        };
    return o;
}

std::string percent_of(double share) { return std::to_string(static_cast<int>(std::lround(100.0 * share))) + " %"; }

/// Why an effect that alone leaves `left` was not taken.
std::string why_not(const std::string& name, double left, const Selection& s, const TraceResult& result)
{
    for (const TraceEffect& e : result.effects)
        if (std::find(e.confusable_with.begin(), e.confusable_with.end(), name) != e.confusable_with.end())
            return "cannot be told from " + e.name + " here";
    for (const auto& [vetoed, reason] : s.vetoed)
        if (vetoed == name) return reason;
    const double before = result.before.heldout_rms, share = share_of(before, left, result.noise_floor);
    const auto is_it = [&name](const auto& x) { return x.name == name; };
    if (std::any_of(result.partial.effects.begin(), result.partial.effects.end(), is_it))
        return "the best partial match, but it explains too little: " + percent_of(result.partial.share) +
               " of what is above the noise";
    if (result.effects.empty() && !(before > kStructured * result.noise_floor))
        return "what the plain model leaves is noise: nothing to explain";
    if (!(left < before)) return "alone it leaves more of the rows held out than the plain model does";
    // What is told below is chance.
    constexpr double kLeastShare = 0.05;
    if (!(share > kLeastShare)) return "alone it explains less than 5 % of what is above the noise";
    const std::string alone = "alone it explains " + percent_of(share) + " of what is above the noise";
    if (!result.effects.empty())
        return alone + "; with " + result.effects.front().name + " in the model it is not needed";
    for (const auto& [fitted, over] : s.fitted)
        if (fitted == name) {
            if (over.nats < kLeastNats) return alone + ", but once fitted the rows held out do not confirm it";
            return alone + ", by a t of " + figure(over.t) + " on the rows held out: not enough to name it";
        }
    return alone + "; others explain more";
}

void reject(const TraceSetup& setup, const Judge& judge, const Selection& s, TraceResult& result)
{
    for (const auto& alone : s.alone) {
        const std::string& name = alone.first;
        const auto is_it = [&name](const auto& x) { return x.name == name; };
        if (std::any_of(result.effects.begin(), result.effects.end(), is_it)) continue;
        const double left = judge.rms(alone.second);
        result.rejected.push_back({name, why_not(name, left, s, result), left});
    }
    for (const TraceRejected& r : setup.untestable) result.rejected.push_back(r);
}

/// What was found and is not named.
TracePartial partial_of(const TraceSetup& setup, const Judge& judge, const Selection& s, const Finding& finding)
{
    TracePartial partial;
    const double share = share_of(finding.before, finding.after, finding.floor);
    if (s.found.empty() || finding.fault || finding.before_exact || !(share > 0.0)) return partial;
    const Eigen::VectorXd sd = deviations(*setup.full, s.best);
    partial.share = share, partial.heldout_rms = finding.after;
    partial.rest = clue_of(correlates(setup, judge.of(s.best.point, false), finding.floor), setup.regime);
    for (const Found& f : s.found) {
        TraceEffect e;
        e.name = f.name, e.heldout_rms_after = finding.after;
        e.parameters = effect_parameters(setup, s.best.point, sd, f.name);
        say_inverter(s.best.point, e);
        partial.effects.push_back(e);
    }
    return partial;
}

/// What a dead time that is not named may hide in the machine's parameters.
Eigen::VectorXd hidden_loss_of(const TraceSetup& setup, const Selection& s)
{
    for (const auto& [name, point] : s.alone)
        if (s.found.empty() && name == name_of(Law::dead_time)) return hidden_loss(setup, s.plain.point, point);
    return Eigen::VectorXd::Zero(s.plain.point.columns());
}

/// A search and its judge; `judge` refers to `setup`.
struct Search {
    std::unique_ptr<TraceSetup> setup;
    std::unique_ptr<Judge> judge;
    Selection selection;
    std::vector<double> exact, own;  ///< reported RMS of each axis that is the sampling's, with and without its pulses
    double rms = HUGE_VAL;
};

std::unique_ptr<TraceSetup> setup_of(const std::vector<Log>& logs, const TraceOptions& options, Variant variant)
{
    return trace_setup(logs, options.effects, variant, options.pole_pairs);
}

Search search(const std::vector<Log>& logs, const TraceOptions& options, std::unique_ptr<TraceSetup> setup, int& ticks)
{
    Search out;
    out.setup = std::move(setup);
    out.judge = std::make_unique<Judge>(*out.setup);
    const Blocks held = out.judge->of(out.setup->starts.front(), false);
    const SelectOptions by = select_options(*out.setup, *out.judge, held, options, ticks);
    out.exact = exact_of(*out.setup, held, out.judge->channels, true), out.own = by.own;
    Selection& s = out.selection = select(out.setup->search(), best_start(*out.setup), out.setup->candidates, by);
    if (!s.plain.ok)
        throw std::invalid_argument(
            logs.front().path + ": a sampling period spans many time constants of the machine; is this log steady?");
    // Each exchange leaves less than the one before: an end beyond those that any log had.
    constexpr int kMostExchanges = 4;
    for (int n = 0; look_alikes(out.setup->search(), out.setup->candidates, by, n < kMostExchanges, s); ++n) {}
    if (out.setup->part) {
        s.plain = refine(*out.setup->full, s.plain.point, kPasses);
        s.best = s.found.empty() ? s.plain : refine(*out.setup->full, s.best.point, kPasses);
    }
    out.rms = out.judge->rms(s.best.point);
    return out;
}

/// The effect's largest weight in its deviations. Of a polynomial's weights, each of which another may stand in for,
/// none says anything: as if all were known; of a dead time the part that asks which way the current flows counts alone.
double in_deviations(const Point& at, const Eigen::VectorXd& sd, const std::string& name)
{
    double most = 0.0;
    Eigen::Index j = at.base.size() + at.gain.size();
    for (const Term& t : at.terms) {
        const int weights = is_dead_time(t.input.law) ? 1 : weights_of(t.input.law);
        const bool polynomial = effect_of(t.input.law).shape == Shape::current_unit || is_map(t.input.law);
        for (int w = 0; w < weights && name == name_of(t.input.law); ++w)
            most = std::max(most, polynomial ? HUGE_VAL : std::abs(t.weights[static_cast<std::size_t>(w)]) / sd[j + w]);
        j += weights_of(t.input.law) + free_shapes_of(t.input);
    }
    return most;
}

/// Leaves an effect out; `less`: the point without it, fitted again.
void leave_out(Selection& s, std::size_t k, const Refined& less, const std::string& reason)
{
    s.best = less, s.vetoed.push_back({s.found[k].name, reason});
    s.after.erase(s.after.begin() + static_cast<std::ptrdiff_t>(k));
    s.found.erase(s.found.begin() + static_cast<std::ptrdiff_t>(k));
}

/// Names whose value may as well be nothing go: the held-out rows may confirm what no parameter of theirs carries. One
/// stays that stands out as its rows scatter, and is wide only by what the model's own error may hide, where it takes
/// most itself or all that the others leave.
void drop_unknown(const TraceSetup& setup, const Judge& judge, Selection& s)
{
    constexpr double kStands = 2.0;  // one of 22 that are nothing does by chance, and what the search took is more
    std::vector<std::string> kept;
    while (!s.found.empty()) {
        const Eigen::VectorXd sd = whole_deviations(setup, *setup.full, s.best);
        const auto unknown = std::find_if(s.found.begin(), s.found.end(), [&](const Found& f) {
            return std::find(kept.begin(), kept.end(), f.name) == kept.end() &&
                   !(in_deviations(s.best.point, sd, f.name) > kStands);
        });
        if (unknown == s.found.end()) return;
        const Refined less = refine(*setup.full, without(s.best.point, unknown->name), kPasses);
        if (!less.ok) return;
        Finding is;
        is.before = judge.rms(s.plain.point), is.after = judge.rms(s.best.point);
        is.floor = judge.noise(s.best.point).floor;
        const double left = judge.rms(less.point);
        if (in_deviations(s.best.point, deviations(*setup.full, s.best), unknown->name) > kStands &&
            (carries_most(is, left, in_deviations(s.best.point, sd, unknown->name)) || carries_all(is, left)))
            kept.push_back(unknown->name);
        else
            leave_out(s, static_cast<std::size_t>(unknown - s.found.begin()), less,
                      "fitted, its parameters are not told from nothing");
    }
}

/// Of several effects those go, the least first, that take less than what stays without a name where all of them are
/// in.
void drop_small(const TraceSetup& setup, const Judge& judge, const std::vector<double>& exact, Selection& s)
{
    Finding is;
    is.after = judge.rms(s.best.point), is.floor = judge.noise(s.best.point).floor;
    is.after_exact = below(judge.each(s.best.point), exact);
    while (s.found.size() > 1 && is_structured({is, true, false})) {
        std::size_t least = 0;
        double left = HUGE_VAL;
        const double now = judge.rms(s.best.point);
        Refined rest;
        for (std::size_t k = 0; k < s.found.size(); ++k) {
            const Refined less = refine(*setup.full, without(s.best.point, s.found[k].name), kPasses);
            const double rms = less.ok ? judge.rms(less.point) : HUGE_VAL;
            if (rms < left) least = k, left = rms, rest = less;
        }
        if (!rest.ok || carries(is, now, left)) return;
        leave_out(s, least, rest, "it takes less than what stays without a name");
    }
}

/// Effects go that the log does not tell from others, and without which what is left is noise.
void drop_idle(const TraceSetup& setup, const Judge& judge, Selection& s)
{
    // Fewer weights take up less of the noise.
    const double floor = judge.noise(s.best.point).of_rows();
    for (std::size_t k = s.found.size(); k-- > 0;) {
        if (s.found[k].confusable_with.empty()) continue;
        const Refined less = refine(*setup.full, without(s.best.point, s.found[k].name), kPasses);
        if (less.ok && is_idle(judge.rms(less.point), floor, s.found[k].confusable_with.size()))
            leave_out(s, k, less, "what stays without it is noise, and it is not told apart");
    }
}

/// The best point, or the plain one where nothing is found, with the noise of the logged columns taken off. Where that is
/// as much as names an effect, the search has fitted noise: those go, the least first, without which no axis then leaves
/// more than a part more. (E110)
Refined without_noise(const TraceSetup& setup, const Judge& judge, Selection& s)
{
    constexpr double kLeastPart = 0.05;  // as an effect must take to be named, (E45)
    if (s.found.empty()) return s.plain;
    Refined best = without_column_noise(setup, *setup.full, s.best);
    while (!s.found.empty() && judge.rms(best.point) < (1.0 - kLeastPart) * judge.rms(s.best.point)) {
        const std::vector<double> with = judge.each(best.point);
        std::size_t least = 0;
        double left = HUGE_VAL;
        Refined rest, off;
        for (std::size_t k = 0; k < s.found.size(); ++k) {
            Refined less = refine(*setup.full, without(s.best.point, s.found[k].name), kPasses);
            if (!less.ok) continue;
            Refined less_off = without_column_noise(setup, *setup.full, less);
            const std::vector<double> each = judge.each(less_off.point);
            bool needed = false;
            for (std::size_t c = 0; c < with.size(); ++c) needed = needed || !(with[c] >= (1.0 - kLeastPart) * each[c]);
            const double rms = judge.rms(less_off.point);
            if (!needed && rms < left) least = k, left = rms, rest = std::move(less), off = std::move(less_off);
        }
        if (!rest.ok) break;
        leave_out(s, least, rest, "what it takes is the noise of the logged columns");
        best = std::move(off);
    }
    return s.found.empty() ? s.plain : best;
}

/// Largest electrical angle within a period, rare extremes apart.
double widest_turn(const TraceSetup& setup)
{
    std::vector<double> turn;
    for (const Log& log : *setup.logs)
        for (double w : log.w_m_rad_s) turn.push_back(std::abs(setup.pole_pairs * w * log.dt_s));
    const auto high = turn.begin() + static_cast<std::ptrdiff_t>(turn.size() - 1 - turn.size() / kRare);
    std::nth_element(turn.begin(), high, turn.end());
    return *high;
}

/// Whether all that was found, fitted in the other frame, predicts clearly worse there: so does any part of it.
bool is_worse(const TraceSetup& there, const Search& found)
{
    const Refined& here = found.selection.best;
    const Refined r = refine(*there.full, here.point, kPasses);
    return r.ok && better(*there.full, r.left, here.left).t >= kClearlyT;
}

Search search(const std::vector<Log>& logs, const TraceOptions& options)
{
    int ticks = 0;
    Search found = search(logs, options, setup_of(logs, options, Variant::usual), ticks);
    if (found.setup->regime == Regime::mechanical) {
        Search other = search(logs, options, setup_of(logs, options, Variant::averaged), ticks);
        return predicts_means(*other.setup, other.selection.best, found.selection.best.point) ? std::move(found)
                                                                                              : std::move(other);
    }
    if (found.setup->regime != Regime::dynamic || widest_turn(*found.setup) < kLeastTurn_rad) return found;
    // What a voltage that turns otherwise looks like, or what is not told from that.
    const auto is_like_it = [](const std::string& name) {
        const Effect* effect = find_effect(name);
        return effect != nullptr && (effect->is & is_like_turning_v) != 0;
    };
    const auto& named = found.selection.found;
    const bool alike = std::any_of(named.begin(), named.end(), [&](const Found& f) {
        return is_like_it(f.name) || std::any_of(f.confusable_with.begin(), f.confusable_with.end(), is_like_it);
    });
    const bool is_noise = found.rms < kStructured * found.judge->noise(found.selection.best.point).floor;
    if (!alike && (is_noise || below(found.judge->each(found.selection.best.point), found.exact))) return found;
    std::unique_ptr<TraceSetup> rotor_held = setup_of(logs, options, Variant::rotor_held);
    if (is_worse(*rotor_held, found)) return found;
    Search other = search(logs, options, std::move(rotor_held), ticks);
    const auto law_noise = [](const Search& s) { return nats_to_law_noise(*s.setup, s.selection.best); };
    const std::size_t here = found.selection.found.size(), there = other.selection.found.size();
    const Better over = better(*found.setup->full, found.selection.best.left, other.selection.best.left);
    double t = beside_law_noise(over, law_noise(other) - law_noise(found)).t;
    // Where the usual frame leaves noise by as few effects, an estimate of the laws' noise is no reason for another.
    if (is_noise && there >= here) t = std::min(t, over.t);
    if (!turns_with_rotor(t, here, there, is_noise)) return found;
    other.setup->notes.push_back(
        "the voltage fits best as held in the rotor's frame within a period, not in the stator's");
    return other;
}

std::string doubt_of(const Reading& r)
{
    constexpr double kAsMuch = 0.9;  // nothing but signs is then better
    std::string text = r.part > kAsMuch ? r.how + " all parameters come out positive"
                                        : r.how + " the plain model leaves " + figure(100.0 * r.part) +
                                              " % of what it leaves as it stands";
    if (r.pole_pairs > 0.0) text += ", and the pole pairs come out at " + figure(r.pole_pairs);
    if (r.previous) return text + ": is voltage_interval = \"previous\" missing in the TOML?";
    if (r.kind == Reading::Kind::filter) return text + ": are the currents filtered?";
    return text + ": are " + (r.kind == Reading::Kind::signs ? "signs and columns" : "rows and frame") +
           " those of the log format?";
}

/// By how much columns of `then` are others, of those of `at`: of the base alone where that has other terms.
Eigen::VectorXd moved_at(const Eigen::VectorXd& moved, const Point& then, const Point& at)
{
    Eigen::VectorXd out = Eigen::VectorXd::Zero(at.columns());
    const auto alike = [](const Term& a, const Term& b) { return a.input.law == b.input.law; };
    const bool same = moved.size() == at.columns() &&
                      std::equal(then.terms.begin(), then.terms.end(), at.terms.begin(), at.terms.end(), alike);
    const Eigen::Index n = std::min(same ? at.columns() : at.base.size(), moved.size());
    out.head(n) = moved.head(n);
    return out;
}

/// Of logs as they stand.
Traced traced(const std::vector<Log>& logs, const TraceOptions& options)
{
    const Search found = search(logs, options);
    const std::unique_ptr<TraceSetup>& setup = found.setup;
    const Judge& judge = *found.judge;
    Selection s = found.selection;
    s.plain = without_column_noise(*setup, *setup->full, s.plain);
    drop_unknown(*setup, judge, s);
    drop_small(*setup, judge, found.exact, s);
    drop_idle(*setup, judge, s);
    s.best = without_noise(*setup, judge, s);

    TraceResult result;
    result.regime = setup->regime;
    result.unit = setup->regime == Regime::mechanical ? "Nm" : "V";
    result.notes = setup->notes, result.real_pole_pairs = setup->real_pole_pairs;
    result.beyond_hexagon = setup->beyond_hexagon;
    for (const Log& log : logs) result.rows += log.rows();
    for (const auto& held : judge.held) result.heldout_row.insert(result.heldout_row.end(), held.begin(), held.end());
    result.heldout_rows = static_cast<std::size_t>(std::count(result.heldout_row.begin(), result.heldout_row.end(), 1));

    const Point& plain = s.plain.point;
    const double before = least_of(judge, plain);
    Noise noise = judge.noise(s.best.point);
    const double after = judge.rms(s.best.point);
    // What was found within the pulses' error is none of theirs.
    const bool was_exact = below(judge.each(plain), s.found.empty() ? found.exact : found.own);
    const std::string fault = !s.fault.empty() || was_exact ? s.fault : record_fault(logs);
    const Finding finding{before,        after, noise.floor, was_exact, below(judge.each(s.best.point), found.exact),
                          !fault.empty()};
    const std::optional<Reading> reading = was_exact ? std::nullopt : other_reading(*setup);
    const bool shifted = std::any_of(s.found.begin(), s.found.end(),
                                     [](const Found& f) { return f.name == "sample_shift" || f.name == "delay"; });
    const bool read = reading && reads_better(finding, reading->part * before,
                                              against_reading(s.found.size(), shifted, reading->rows_before));
    const bool explained = explains(finding);
    std::vector<Found> read_otherwise;
    if (!explained || read) {
        if (explained) read_otherwise = s.found;
        if (!explained) result.partial = partial_of(*setup, judge, s, finding);
        s.found.clear(), s.after.clear();
        s.best = s.plain;
        noise = judge.noise(s.best.point);
    }
    const double floor = result.noise_floor = noise.floor;
    Eigen::VectorXd hidden = hidden_loss_of(*setup, s);
    const Eigen::Index base = plain.base.size();
    const bool in_order = fault.empty() && !was_exact;
    const Point& chosen = found.selection.best.point;
    const Eigen::VectorXd unproven = in_order ? moved_at(found.selection.unproven, chosen, s.best.point)
                                              : Eigen::VectorXd::Zero(s.best.point.columns());
    if (s.found.empty() && in_order && !(before > kStructured * floor)) {
        hidden.head(base) = hidden.head(base).cwiseMax(unproven.head(base));
        // What the rows held out confirm, and is not named where the plain model leaves noise. (E186)
        if (!found.selection.found.empty())
            hidden.head(base) = hidden.head(base).cwiseMax((found.selection.best.point.base - plain.base).cwiseAbs());
    }
    const Eigen::VectorXd plain_sd =
        (whole_deviations(*setup, *setup->full, s.plain).array().square() + hidden.array().square()).sqrt();
    const Refined iron = map_beside(*setup, s.best.point);
    Eigen::VectorXd spread = spread_over_laws(*setup, s.best) + spread_over_iron(*setup, s.best, iron) +
                             spread_over_states(*setup, s.best);
    // (E171)
    for (const Found& f : s.found)
        if (f.moved.size() > 0) spread += moved_at(f.moved, chosen, s.best.point);
    // (E198)
    if (!s.found.empty()) spread = (spread.array().square() + unproven.array().square()).sqrt();
    const Eigen::VectorXd whole = whole_deviations(*setup, *setup->full, s.best),
                          sd = (whole.array().square() + spread.array().square()).sqrt();
    result.before = fit_of(*setup, judge, plain, plain_sd);
    result.after = s.found.empty() ? result.before : fit_of(*setup, judge, s.best.point, sd);
    const Point& last = s.found.empty() ? plain : s.best.point;
    for (std::size_t k = 0; k < s.found.size(); ++k) {
        TraceEffect e;
        e.name = s.found[k].name;
        say_inverter(s.best.point, e);
        e.parameters = effect_parameters(*setup, s.best.point, sd, e.name);
        put_channel(*setup, s.best.point, e);
        e.heldout_rms_after = k + 1 == s.found.size() ? result.after.heldout_rms : judge.rms(s.after[k]);
        e.confusable_with = s.found[k].confusable_with;
        e.confidence = confidence_of(s.found[k], part_of_rest(before, result.after.heldout_rms, floor));
        if (!e.confusable_with.empty()) e.separate = find_effect(e.name)->separate;
        say_row_late(e, logs, result.notes);
        result.effects.push_back(e);
    }
    if (!s.found.empty() && is_beside_magnet(s.best.point))
        result.notes.emplace_back("no thermometer is on the magnet: temp_winding_C stood for it. A magnet that warms "
                                  "by less than the sensor has a larger coefficient, by as much");
    if (!s.found.empty()) say_settled(*setup, s.best.point, result.notes), say_rest(*setup, s.best.point, result.notes);
    if (!s.found.empty()) {
        const Point learned = as_firmware_learns(*setup, s.best);
        for (const Term& t : learned.terms)
            if (t.input.law != Law::pulses) result.inputs.push_back(firmware_input(*setup, learned, t));
    }
    // Where nothing is left over: a map has freedom enough to take some of what has no name.
    result.map = flux_map_of(*setup, s.best, iron,
                             setup->regime == Regime::dynamic && fault.empty() && tells_bends(*setup) &&
                                 !(result.after.heldout_rms > kStructured * floor));
    result.map.shorted = shorted_turns_of(result.effects);
    if (!result.map.empty()) put_table(s.best.point, result.map, result.inputs);
    reject(*setup, judge, s, result);
    for (TraceRejected& r : result.rejected)
        if (std::any_of(read_otherwise.begin(), read_otherwise.end(),
                        [&r](const Found& f) { return f.name == r.name; }))
            r.why = "it explains the log as it stands, but another reading of its columns does without it";
    result.structure = correlates(*setup, judge.of(plain, false), floor);
    result.rest = correlates(*setup, judge.of(last, false), floor);
    const bool taken_back = s.found.empty() && !was_exact && !(found.selection.found.empty() && s.vetoed.empty());
    const Finding rest{before,        result.after.heldout_rms, floor, was_exact, below(judge.each(last), found.exact),
                       !fault.empty()};
    const bool structured = is_structured({rest, !s.found.empty(), taken_back});
    result.doubt = result.effects.empty() ? doubt_of(*setup, plain, result.before, !structured) : "";
    if (structured) result.rest_signature = fault.empty() ? clue_of(result.rest, result.regime) : fault;
    if (result.effects.empty() && fault.empty()) {
        // An angle that turns otherwise says more than what its speed makes of the axes.
        if (reading && setup->turns_apart.empty()) result.doubt = doubt_of(*reading);
        if (result.doubt.empty() && !rest.after_exact) result.doubt = doubt_of(noise, rest.after);
    }
    if (!result.doubt.empty()) result.rest_signature = fault.empty() ? result.doubt : fault + "; " + result.doubt;
    result.verdict = verdict_of(!result.effects.empty(), structured, !result.doubt.empty());
    fill_blocks(*setup, judge, plain, last, result);
    if (options.progress) options.progress(1.0);
    return {std::move(result), found.selection.plain, found.selection.best, setup->full->base_names(),
            setup->pole_pairs_known ? setup->pole_pairs : 0.0};
}

}  // namespace

TraceResult trace(const std::vector<Log>& logs, const TraceOptions& options)
{
    if (logs.front().regime == Regime::mechanical) return traced(logs, options).result;
    const std::unique_ptr<TraceSetup> plain = setup_of(logs, without_effects(options), Variant::usual);
    if (is_misread(*plain)) {
        // Of columns that are turned by a right angle or two, an encoder may be as well.
        TraceResult result = traced(logs, with_effect(options, Law::angle_offset)).result;
        result.notes.emplace_back("no effect but an angle's offset is tried on columns that others would explain");
        return result;
    }
    const bool at_fault = !record_fault(logs).empty();
    // No name stands in a record that is at fault; what a loss may hide in R does.
    TraceResult result = at_fault ? traced(logs, with_effect(options, Law::dead_time)).result
                                  : trace_behind_filter(logs, options, traced, *plain);
    if (at_fault)
        result.notes.emplace_back("no effect is named in a record that is at fault, and none but a dead time tried");
    return result.real_pole_pairs > 0.0 ? under_whole_pole_pairs(logs, options, std::move(result)) : result;
}

}  // namespace dqw
