#include "app/monitor/setup.hpp"
#include "dqw_effect_kind.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "app/base/columns.hpp"
#include "app/base/effect_names.hpp"
#include "app/base/input_error.hpp"
#include "app/base/learnable.hpp"
#include "app/base/modulation.hpp"
#include "app/base/parameters.hpp"
#include "app/base/text.hpp"
#include "app/learn/modulation.hpp"
#include "app/learn/parts.hpp"
#include "app/learn/signals.hpp"
#include "app/read/voltage_fit.hpp"
#include "ref/log/piece.hpp"
#include "ref/trace/named.hpp"

namespace dqw {
namespace {

// Half a block: 1 ms, 20 rows at least.
constexpr double kHalfWindow_s = 1e-3;
constexpr int kLeastHalfWindow = 20, kLeastOfFast = 10;
// Electrical angle of half a block above which the witness sees no ripple, with some room.
constexpr double kHalfAngle_rad = 1.1;
constexpr double kDeadTimeWidth = 0.02;  // of the current base
// A base is what this part of the rows stays below: a glitch scales nothing, and is refused as one.
constexpr double kUsual = 0.999;
constexpr std::uint32_t kStale = 10;  // equal rows in a row
constexpr double kAlpha_per_K = 0.0039;
// What stands for a machine that nobody has described.
constexpr double kFirst_s = 2.0;
constexpr std::size_t kFirstRows = 5000;

/// The log's first seconds.
Log beginning(const Log& log)
{
    const auto wanted = static_cast<std::size_t>(std::min(std::ceil(kFirst_s / log.dt_s), 1e9));
    const std::size_t rows = std::min(std::max(wanted, kFirstRows), log.rows() / 2);
    Log first = copies_of({{&log, 0, rows, log.dt_s}}).front();
    first.segments.clear();
    for (const std::size_t s : log.segments)
        if (s < rows) first.segments.push_back(s);
    return first;
}

/// A nominal value's place in the configuration.
struct Nominal {
    dqw_parameter id;
    float dqw_estimator_config::*place;
    const Parameter& parameter() const { return kParameters[id]; }
};
constexpr Nominal nominals[] = {
    {DQW_R, &dqw_estimator_config::R_ohm},
    {DQW_LD, &dqw_estimator_config::Ld_H},
    {DQW_LQ, &dqw_estimator_config::Lq_H},
    {DQW_PSI, &dqw_estimator_config::psi_Wb},
};

bool usable(double x) { return static_cast<float>(x) > 0.0F && std::isfinite(static_cast<float>(x)); }

/// A machine's order of magnitude, from its largest signals.
double rough(const Nominal& n, const dqw_estimator_config& c)
{
    const auto v = static_cast<double>(c.v_base_V), i = static_cast<double>(c.i_base_A),
               w_e = c.pole_pairs * static_cast<double>(c.w_base_rad_s);
    if (n.id == DQW_R) return 0.1 * v / i;
    return n.id == DQW_PSI ? 0.5 * v / w_e : 0.1 * v / (i * w_e);
}

/// Where learning starts: whatever is said, and of the rest what the estimator makes of the log's first seconds.
void start_values(const Log& log, const Machine& start, const std::vector<TraceInput>& effects, MonitorSetup& setup)
{
    std::vector<const Nominal*> missing;
    for (const Nominal& n : nominals) {
        setup.config.estimator.*(n.place) = nominal(log.machine, start, n.parameter().nominal);
        if (!usable(static_cast<double>(setup.config.estimator.*(n.place)))) missing.push_back(&n);
    }
    if (missing.empty()) return;
    const Log first = beginning(log);
    LearnOptions options;
    options.inputs = effects;
    if (setup.config.estimator.angle) options.inputs.push_back({"dead_time", {}, {}});
    options.start.pole_pairs = setup.config.estimator.pole_pairs;
    const Learned learned = learn_all({first}, options);
    std::vector<std::string> from_log, guessed;
    for (const Nominal* n : missing) {
        const Parameter& p = n->parameter();
        const double value = learned.model.*(p.model);
        const bool good = find_estimate(learned.result.parameters, p.name) && usable(value);
        (good ? from_log : guessed).emplace_back(p.name);
        setup.config.estimator.*(n->place) = static_cast<float>(good ? value : rough(*n, setup.config.estimator));
    }
    const double span_s = static_cast<double>(first.rows()) * log.dt_s;
    if (!from_log.empty())
        setup.notes.push_back(
            fmt::format("{} not said: learning starts from the log's first {:.3g} s", list(from_log), span_s));
    if (!guessed.empty())
        setup.notes.push_back(
            fmt::format("{} not said, and the first {:.3g} s do not tell: learning starts from the size of the signals",
                        list(guessed), span_s));
}

/// By how much a width anywhere within an octave to either side moves R, as the blocks of so many rows leave it open.
double moved_by_octaves(const Learned& half, const Learned& here, const Learned& twice)
{
    constexpr double kOfAnOctave = 0.58;  // an even spread of two
    const auto R_of = [](const Learned& l) { return find_estimate(l.result.parameters, "R_ohm"); };
    const Estimate* const at = R_of(here);
    double most_ohm = 0.0;
    for (const Learned* const side : {&half, &twice})
        if (const Estimate* const R = R_of(*side); at != nullptr && R != nullptr)
            most_ohm = std::max(most_ohm, std::abs(R->value - at->value));
    return kOfAnOctave * most_ohm;
}

/// What a fit whose law has a width and a shape of its own makes of R, and does not know of it.
double off_a_fit(const std::vector<Log>& logs, const Learned& here, double pole_pairs)
{
    const Estimate* const R = find_estimate(here.result.parameters, "R_ohm");
    const std::optional<NamedLook> fit = look_at_named(logs, {"dead_time"}, pole_pairs);
    if (R == nullptr || !fit) return 0.0;
    const double off = std::hypot(fit->value[0] - R->value, fit->sd[0]);
    return std::isfinite(off) ? off : std::abs(R->value);
}

/// Dead time's width, where nobody says it: of the usual one and those an octave and more apart the one that leaves
/// least of the log's first seconds; the usual one where that is hardly less. What the next ones make of R, and where
/// edges are slow what a fit does, is a voltage that no residual shows.
void set_width(const Log& log, MonitorSetup& setup)
{
    constexpr double kHardly = 0.97;
    dqw_estimator_config& c = setup.config.estimator;
    const Log first = beginning(log);
    const auto with = [&](const std::vector<double>& shape) {
        LearnOptions options;
        options.inputs = {{"dead_time", shape, {}}};
        options.start.pole_pairs = c.pole_pairs;
        return learn_all({first}, options);
    };
    try {
        double width_A = static_cast<double>(c.dead_time_width_A);
        const Learned free = with({});
        Learned here = with({width_A});
        if (free.inputs.empty() || free.inputs.front().shape.empty()) return;
        double off_ohm = 0.0;
        if (free.result.residual_rms < kHardly * here.result.residual_rms) {
            width_A = free.inputs.front().shape[0], here = with({width_A});
            c.dead_time_width_A = static_cast<float>(width_A);
            setup.notes.push_back(
                fmt::format("dead_time: a width of {:.3g} A, of those an octave apart, leaves least of the "
                            "log's first {:.3g} s",
                            width_A, static_cast<double>(first.rows()) * log.dt_s));
            off_ohm = off_a_fit({first}, here, c.pole_pairs);
        }
        if (told_loss_V(here) == 0.0 && !(off_ohm > 0.0)) return;
        const double moved_ohm = std::hypot(off_ohm,
                                            moved_by_octaves(with({0.5 * width_A}), here, with({2.0 * width_A})));
        const double i_A = std::hypot(rms(first.i_d_A.data(), first.rows()), rms(first.i_q_A.data(), first.rows()));
        c.voltage_error_V = static_cast<float>(std::hypot(log.voltage_error_V, moved_ohm * i_A));
    } catch (const std::invalid_argument&) {
        // Too few rows to learn from tell no width.
    }
}

bool has_thermometer(const TraceInput& in, const Log& log)
{
    const bool heats = in.effect == "winding_temperature" || in.effect == "magnet_temperature";
    if (!heats || heats_by_current(in) || in.shape.size() < 2) return true;
    return !log.temp_winding_C.empty() || (in.effect == "magnet_temperature" && !log.temp_magnet_C.empty());
}

/// Why the estimator cannot have an effect over this log; empty: it can.
std::string why_not(const TraceInput& in, const Log& log, bool angle)
{
    if (dqw_effect_is_mechanical(effect_config(in).effect))
        return "the monitor watches the machine, and of the shaft its friction";
    if (needs_angle(in.effect) && !angle) return "it needs theta_e_rad or theta_m_rad";
    return has_thermometer(in, log) ? "" : "it needs a temperature";
}

/// An effect is watched by an input that the monitor has, or the estimator learns it, or a note says why not.
std::vector<TraceInput> effects_to_learn(const std::vector<TraceInput>& inputs, const Log& log, MonitorSetup& setup)
{
    dqw_estimator_config& c = setup.config.estimator;
    std::vector<TraceInput> learned;
    for (const TraceInput& in : inputs) {
        if (c.angle && in.effect == "dead_time" && !in.shape.empty() && usable(in.shape[0]))
            c.dead_time_width_A = static_cast<float>(in.shape[0]);
        if (monitor_watches(in.effect)) continue;
        const std::string never = not_learned(in), why = never.empty() ? why_not(in, log, c.angle) : never;
        if (why.empty())
            learned.push_back(in);
        else
            setup.notes.push_back(fmt::format("not used: {}; {}", in.effect, why));
        // A settled log's delay is in seconds.
        if (why.empty() && in.effect == "delay" && !in.shape.empty()) {
            for (double& w : learned.back().weights) w /= log.dt_s;
            learned.back().shape.clear();
        }
    }
    return learned;
}

/// The size that all but a few rows of two channels stay below; the largest where that is nothing.
float usual_largest(const std::vector<Log>& logs, std::vector<double> Log::*a, std::vector<double> Log::*b)
{
    std::vector<double> sizes;
    for (const Log& log : logs)
        for (std::size_t k = 0; k < log.rows(); ++k)
            sizes.push_back(std::max(std::fabs((log.*a)[k]), std::fabs((log.*b)[k])));
    if (sizes.empty()) return largest(logs, a, b);
    const auto at = static_cast<std::ptrdiff_t>(kUsual * static_cast<double>(sizes.size() - 1));
    std::nth_element(sizes.begin(), sizes.begin() + at, sizes.end());
    const double usual = sizes[static_cast<std::size_t>(at)];
    return usable(usual) ? static_cast<float>(usual) : largest(logs, a, b);
}

/// Short enough for the witness at the largest speed.
std::uint16_t half_window_of(const Log& log, const dqw_estimator_config& c)
{
    const double w_e = c.pole_pairs * static_cast<double>(c.w_base_rad_s);
    const std::uint16_t usual = half_window(kHalfWindow_s, log.dt_s, kLeastHalfWindow);
    if (!c.angle || w_e * usual * log.dt_s <= kHalfAngle_rad) return usual;
    return std::min(usual, half_window(kHalfAngle_rad / w_e, log.dt_s, kLeastOfFast));
}

void check(const Log& log, const Machine& start)
{
    if (log.regime != Regime::dynamic)
        throw InputError(log.path, 1,
                         fmt::format("a {} log; expected a dynamic one, with t_s, voltages, currents and speed",
                                     name_of(log.regime)));
    if (!log.machine.pole_pairs && !start.pole_pairs)
        throw InputError(log.path, 1,
                         "the pole pairs are not known; expected --pole-pairs N, or pole_pairs in the machine file");
}

}  // namespace

MonitorSetup monitor_setup(const std::vector<Log>& logs, const LearnConfig& asked)
{
    const Log& log = logs.front();
    check(log, asked.start);
    MonitorSetup setup;
    dqw_estimator_config& c = setup.config.estimator;
    c.dt_s = static_cast<float>(log.dt_s);
    const Machine& plate = log.machine;
    const auto rated = [](const std::optional<double>& said, float found) {
        return said ? static_cast<float>(*said) : found;
    };
    c.v_base_V = rated(plate.v_rated_V, usual_largest(logs, &Log::v_d_V, &Log::v_q_V));
    c.i_base_A = rated(plate.i_rated_A, usual_largest(logs, &Log::i_d_A, &Log::i_q_A));
    c.w_base_rad_s = rated(plate.w_max_rad_s, usual_largest(logs, &Log::w_m_rad_s, &Log::w_m_rad_s));
    c.pole_pairs = static_cast<std::uint16_t>(log.machine.pole_pairs ? *log.machine.pole_pairs
                                                                     : *asked.start.pole_pairs);
    c.angle = !log.theta_e_rad.empty() || !log.theta_m_rad.empty();
    c.encoder_offset = c.angle;
    c.noise_on_inputs = true;
    c.follow = true;
    c.observed = log.observed;
    c.voltage_error_V = static_cast<float>(log.voltage_error_V);
    c.voltage_scale_ppm = static_cast<std::uint32_t>(std::lround(1e6 * log.voltage_scale));
    c.stale_limit = kStale;
    c.half_window = half_window_of(log, c);
    if (c.angle)
        c.dead_time_width_A = static_cast<float>(kDeadTimeWidth) * c.i_base_A;
    else
        setup.notes.emplace_back(
            "no theta_e_rad or theta_m_rad: dead time, unlike phases, current sensors and the encoder are not watched");
    LearnConfig with_map = asked;
    add_flux_map(with_map, logs);
    const std::vector<TraceInput> effects = effects_to_learn(with_map.inputs, log, setup);
    check_room(effects);
    setup.config.alpha_per_K = static_cast<float>(kAlpha_per_K);
    setup.config.J_kgm2 = nominal(log.machine, asked.start, &Machine::J_kgm2);
    if (!(setup.config.J_kgm2 > 0.0F)) setup.notes.emplace_back("friction is not watched: no J_kgm2");
    start_values(log, asked.start, effects, setup);
    const bool said = std::any_of(asked.inputs.begin(), asked.inputs.end(),
                                  [](const TraceInput& in) { return in.effect == "dead_time" && !in.shape.empty(); });
    if (c.angle && !said && effects.empty()) set_width(log, setup);
    setup.speed_lag_s = log.speed_lag_s;
    PlainModel machine;
    for (const Nominal& n : nominals) machine.*(n.parameter().model) = static_cast<double>(c.*(n.place));
    machine.pole_pairs = c.pole_pairs;
    setup.inputs = completed(effects, logs, machine);
    std::vector<TraceInput> shown = setup.inputs;
    if (c.angle) shown.push_back({"dead_time", {}, {}});
    c.modulation = modulation_of(log, c, shown);
    if (const std::string note = note_on_modulation(log, c.modulation); !note.empty()) setup.notes.push_back(note);
    std::vector<std::string> names;
    for (const TraceInput& in : effects) names.push_back(in.effect);
    if (!names.empty()) setup.notes.push_back("learned as well: " + list(names));
    return setup;
}

}  // namespace dqw
