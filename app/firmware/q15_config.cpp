#include "app/firmware/q15_config.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "app/base/effect_names.hpp"
#include "app/base/modulation.hpp"
#include "app/firmware/model_config.hpp"
#include "app/learn/parts.hpp"
#include "app/learn/q15.hpp"
#include "app/learn/signals.hpp"
#include "app/q15/effect_q15.hpp"

namespace dqw {
namespace {

struct Nominal {
    dqw_parameter id;
    const char* parameter;
    std::uint32_t dqw_estimator_q15_config::*field;
    const char *name, *symbol, *unit;
    double whole;  ///< the field's last place is 1/whole of the unit
};

constexpr Nominal nominals[] = {{DQW_R, "R_ohm", &dqw_estimator_q15_config::R_uohm, "R_uohm", "R", "ohm", 1e6},
                                {DQW_LD, "Ld_H", &dqw_estimator_q15_config::Ld_nH, "Ld_nH", "L_d", "H", 1e9},
                                {DQW_LQ, "Lq_H", &dqw_estimator_q15_config::Lq_nH, "Lq_nH", "L_q", "H", 1e9},
                                {DQW_PSI, "psi_Wb", &dqw_estimator_q15_config::psi_nWb, "psi_nWb", "psi", "Wb", 1e9}};

constexpr std::array kModulations = {"DQW_MODULATION_CENTRED",      "DQW_MODULATION_CLAMPED_LOW",
                                     "DQW_MODULATION_CLAMPED_HIGH", "DQW_MODULATION_CLAMPED_60",
                                     "DQW_MODULATION_MASK",         "DQW_MODULATION_UNKNOWN"};
static_assert(kModulations.size() == DQW_MODULATIONS, "one for each");

/// What was found in place of what the machine file says.
void take(const std::vector<Estimate>& found, dqw_estimator_q15_config& c)
{
    for (const Estimate& e : found) {
        if (!(e.value > 0.0) || !why_not_usable(e).empty()) continue;
        if (e.name == "pole_pairs") c.scale.pole_pairs = static_cast<std::uint16_t>(std::lround(e.value));
        for (const Nominal& n : nominals)
            if (e.name == n.parameter)
                c.*n.field = static_cast<std::uint32_t>(std::min(std::round(n.whole * e.value), 4e9));
    }
}

std::string formats(const dqw_estimator_q15_config& c)
{
    const double v = 1e-3 * c.scale.v_full_mV, i = 1e-3 * c.scale.i_full_mA, w = 1e-3 * c.scale.w_full_mrad_s;
    std::string out = "//\n// signal            format  full scale            last place\n";
    const auto signal = [&](const char* name, double full, const char* unit) {
        out += fmt::format("// {:<17} Q15     {:<21} {:.4g} {}\n", name, fmt::format("{:.6g} {}", full, unit),
                           full / 32768.0, unit);
    };
    signal("v_d_q15, v_q_q15", v, "V");
    signal("i_d_q15, i_q_q15", i, "A");
    signal("w_m_q15", w, "rad/s");
    signal("cosine_q15, sine_q15", 1.0, "");
    out += "//\n// parameter  value_q40: 1, last place\n";
    for (const Nominal& n : nominals) {
        const double unit = dqw_estimator_unit_q15(&c, n.id) / n.whole;
        out += fmt::format("// {:<10} {:.6g} {}, {:.4g} {}\n", n.symbol, unit, n.unit, unit * 0x1p-40, n.unit);
    }
    return out;
}

/// One initialiser of a dqw_effect_q15_config; what is 0 is left out.
std::string effect_row(const TraceInput& input, const dqw_effect_q15_config& c)
{
    std::string out = fmt::format("{{.effect = {}", enumerator_of(input.effect));
    const auto put = [&](const char* name, long long value, const char* format) {
        if (value != 0) out += fmt::format(", .{} = {}", name, fmt::format(fmt::runtime(format), value));
    };
    put("i_uA", c.i_uA, "{}u");
    put("R_uohm", c.R_uohm, "{}u");
    put("Ld_nH", c.Ld_nH, "{}u");
    put("Lq_nH", c.Lq_nH, "{}u");
    put("psi_nWb", c.psi_nWb, "{}u");
    put("cell_d_uA", c.cell_d_uA, "{}u");
    put("cell_q_uA", c.cell_q_uA, "{}u");
    if (c.map != nullptr) out += ", .map = dqw_q15_flux_map";
    put("tau_us", static_cast<long long>(c.tau_us), "UINT64_C({})");
    put("row_us", c.row_us, "{}u");
    put("T_0_cC", c.T_0_cC, "{}");
    put("order", c.order, "{}u");
    const auto* const start = c.start_q40;
    return out + fmt::format(", .start_q40 = {{INT64_C({})}}}}",
                             fmt::join(start, start + dqw_effect_weights(c.effect), "), INT64_C("));
}

/// Its rows, and the room that they need.
struct EffectRows {
    std::string text, maps;
    int weights = 0;
};
EffectRows effect_rows(const FullScales& full, const std::vector<TraceInput>& inputs, double delay_unit, double row_s)
{
    EffectRows rows;
    for (const TraceInput& in : inputs) {
        const auto config = effect_config_q15(in, full, in.effect == "delay" ? delay_unit : 1.0, row_s);
        rows.weights += dqw_effect_weights(config.effect);
        if (!in.map.empty()) rows.maps += map_table_text("dqw_q15_flux_map", in.map);
        rows.text += fmt::format("{}    {}", rows.text.empty() ? "" : ", \\\n", effect_row(in, config));
    }
    return rows;
}

/// What they ask of the build.
std::string room_text(const EffectRows& rows)
{
    return fmt::format("#if DQW_EFFECT_WEIGHTS < {0}\n#error \"build lib/ and port_q15/ with "
                       "-DDQW_EFFECT_WEIGHTS={0} or more\"\n#endif\n",
                       rows.weights);
}

/// The list of a firmware's effects.
std::string effects_text(const std::vector<Log>& logs, const dqw_estimator_q15_config& c,
                         const std::vector<TraceInput>& inputs)
{
    if (inputs.empty()) return {};
    const FullScales full = full_scales(c.scale);
    const EffectRows rows = effect_rows(full, inputs, c.settled ? full.dt_s : 1.0,
                                        c.settled ? static_cast<double>(period_of(logs.front(), inputs)) : 0.0);
    return "\n" + room_text(rows) + rows.maps +
           fmt::format("// What the plain model lacks. The sizes go with the full scales:\n"
                       "//     static const dqw_effect_q15_config effects[] = {{DQW_Q15_EFFECTS}};\n"
                       "//     static const dqw_estimator_q15_config config = {{DQW_Q15_ESTIMATOR, .effects = effects, "
                       ".effect_count = DQW_Q15_EFFECT_COUNT}};\n"
                       "#define DQW_Q15_EFFECT_COUNT {}\n#define DQW_Q15_EFFECTS \\\n{}\n",
                       inputs.size(), rows.text);
}

std::string scale_text(const char* name, const dqw_scale& s)
{
    return fmt::format("#define {} \\\n    {{.v_full_mV = {}u, .i_full_mA = {}u, .w_full_mrad_s = {}u, .dt_ns = {}u, "
                       ".pole_pairs = {}u}}\n\n",
                       name, s.v_full_mV, s.i_full_mA, s.w_full_mrad_s, s.dt_ns, s.pole_pairs);
}

/// One more field of an initialiser, unless it is 0.
void put(std::string& to, const char* name, std::uint32_t value)
{
    if (value != 0) to += fmt::format(", .{} = {}u", name, value);
}

std::string monitor_estimator(const dqw_estimator_q15_config& t, std::size_t effects)
{
    std::string out = ".scale = DQW_Q15_MONITOR_SCALE";
    for (const Nominal& n : nominals) put(out, n.name, t.*n.field);
    put(out, "dead_time_width_mA", t.dead_time_width_mA);
    if (t.angle_late_ns != 0) out += fmt::format(", .angle_late_ns = {}", t.angle_late_ns);
    put(out, "voltage_error_mV", t.voltage_error_mV);
    put(out, "voltage_scale_ppm", t.voltage_scale_ppm);
    if (t.modulation != DQW_MODULATION_CENTRED) out += fmt::format(", .modulation = {}", kModulations[t.modulation]);
    put(out, "stale_limit", t.stale_limit);
    put(out, "excitation_q15", t.excitation_q15);
    put(out, "half_window", t.half_window);
    put(out, "solve_blocks", t.solve_blocks);
    out += fmt::format(", .angle = {}, .encoder_offset = {}, .follow = {}, .noise_on_inputs = {}", t.angle,
                       t.encoder_offset, t.follow, t.noise_on_inputs);
    if (t.observed) out += ", .observed = true";
    if (t.voltage_next) out += ", .voltage_next = true";
    if (t.voltage_held) out += ", .voltage_held = true";
    if (t.speed_electrical) out += ", .speed_electrical = true";
    if (effects > 0) out += fmt::format(", .effects = monitor_effects, .effect_count = {}u", effects);
    put(out, "threshold_ppm", t.threshold_ppm);
    return out;
}

/// The bands: a build that has no room for a map's weights has no channels of theirs.
std::string bands_text(const dqw_monitor_q15_config& c)
{
    std::vector<std::uint32_t> all(std::begin(c.band_ppm), std::end(c.band_ppm)), plain;
    for (int i = 0; i < DQW_WATCH_CHANNELS; ++i)
        if (i != DQW_WATCH_MAP_D && i != DQW_WATCH_MAP_Q) plain.push_back(all[static_cast<std::size_t>(i)]);
    return fmt::format("#if DQW_MAP_WEIGHTS > 0\n#define DQW_Q15_MONITOR_BANDS {{{}u}}\n#else\n"
                       "#define DQW_Q15_MONITOR_BANDS {{{}u}}\n#endif\n\n",
                       fmt::join(all, "u, "), fmt::join(plain, "u, "));
}

/// All but its estimator.
std::string monitor_fields(const dqw_monitor_q15_config& c)
{
    std::string out = ".band_ppm = DQW_Q15_MONITOR_BANDS";
    put(out, "alpha_ppm_per_K", c.alpha_ppm_per_K);
    put(out, "beta_ppm_per_K", c.beta_ppm_per_K);
    put(out, "heating_mK_s", c.heating_mK_s);
    put(out, "J_nkgm2", c.J_nkgm2);
    put(out, "residual_floor_ppm", c.residual_floor_ppm);
    return out + (c.commissioned ? ", .commissioned = true" : "");
}

}  // namespace

std::string q15_config_text(const std::vector<Log>& logs, const std::vector<Estimate>& found,
                            const std::vector<TraceInput>& inputs)
{
    const Machine& machine = logs.front().machine;
    dqw_estimator_q15_config c = q15_config_of(logs, {}, machine.pole_pairs.value_or(0.0));
    take(found, c);
    std::string names;
    for (const Log& log : logs) names += (names.empty() ? " " : ", ") + harmless(log.path);
    std::string out = fmt::format(
        "// Full scales and nominal values for port_q15/, from{}: 1 % above the largest signals. What is beyond a full "
        "scale is\n"
        "// counted and not learned: raise one where the drive goes farther; the sizes below go with it.\n"
        "//     static const dqw_estimator_q15_config config = {{DQW_Q15_ESTIMATOR, .stale_limit = 10}};\n",
        names);
    out += formats(c);
    out += "#ifndef DQW_Q15_CONFIG_H\n#define DQW_Q15_CONFIG_H\n\n#include \"dqw_estimator_q15.h\"\n\n";
    out += scale_text("DQW_Q15_SCALE", c.scale);
    std::string values = ".scale = DQW_Q15_SCALE";
    for (const Nominal& n : nominals) values += fmt::format(", .{} = {}u", n.name, c.*n.field);
    if (c.half_window != 0) values += fmt::format(", .half_window = {}u", c.half_window);
    if (std::any_of(inputs.begin(), inputs.end(), [](const TraceInput& in) { return needs_angle(in.effect); }))
        values += ", .angle = true";
    for (const TraceInput& in : inputs)
        if (const auto named = modulation_named(in.modulation); named && *named != DQW_MODULATION_CENTRED)
            values += fmt::format(", .modulation = {}", kModulations[*named]);
    if (c.observed) values += ", .observed = true";
    out += fmt::format("// Initialisers; others may follow them. For the monitor rather take dqw_q15_monitor.h, which "
                       "`dqwatch monitor --arith q15` "
                       "writes.\n#define DQW_Q15_ESTIMATOR \\\n    {}{}\n",
                       values, c.settled ? ", .settled = true" : "");
    return out + effects_text(logs, c, inputs) + "\n#endif\n";
}

std::string q15_monitor_text(const dqw_monitor_q15_config& c, const std::string& log,
                             const std::vector<TraceInput>& inputs)
{
    const dqw_scale& scale = c.estimator.scale;
    const FullScales full = full_scales(scale);
    const EffectRows rows = effect_rows(full, inputs, 1.0, 0.0);
    std::string list, effects;
    if (!inputs.empty()) {
        list = "//     static const dqw_effect_q15_config monitor_effects[] = {DQW_Q15_MONITOR_EFFECTS};\n";
        effects = room_text(rows) + rows.maps + "#define DQW_Q15_MONITOR_EFFECTS \\\n" + rows.text + "\n\n";
    }
    return fmt::format("// With what `dqwatch monitor --arith q15` ran over {}. In firmware, with "
                       "DQW_EFFECT_WEIGHTS={} for all of "
                       "lib/ and port_q15/:\n"
                       "{}"
                       "//     static const dqw_monitor_q15_config config = {{DQW_Q15_MONITOR}};\n"
                       "// Samples are parts of {:.6g} V, {:.6g} A, {:.6g} rad/s: lround(32768 x / full scale); beyond "
                       "+-32766 one counts "
                       "as saturated; the angle 65536 a turn.\n"
                       "// Bands, threshold and floor that are parts of a full scale are those of the usual largest "
                       "signals, a third "
                       "less.\n"
                       "#ifndef DQW_Q15_MONITOR_H\n#define DQW_Q15_MONITOR_H\n\n#include \"dqw_monitor_q15.h\"\n\n",
                       harmless(log), rows.weights, list, full.v_V, full.i_A, full.w_rad_s) +
           effects + scale_text("DQW_Q15_MONITOR_SCALE", scale) + bands_text(c) +
           fmt::format("#define DQW_Q15_MONITOR \\\n    .estimator = {{{}}}, \\\n    {}\n\n#endif\n",
                       monitor_estimator(c.estimator, inputs.size()), monitor_fields(c));
}

}  // namespace dqw
