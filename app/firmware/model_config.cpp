#include "app/firmware/model_config.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <iterator>

#include "app/base/effect_names.hpp"
#include "app/base/learnable.hpp"
#include "app/base/modulation.hpp"

namespace dqw {
namespace {

/// A float literal; what is no number becomes 0, which starts from nothing.
std::string literal(double x)
{
    const auto value = static_cast<float>(x);
    if (!std::isfinite(value)) return "0.0f";
    std::string text = fmt::format("{:.7g}", value);
    if (text.find_first_of(".e") == std::string::npos) text += ".0";
    return text + "f";
}

std::string macro_of(const std::string& parameter)
{
    std::string text = "DQW_MODEL_";
    for (const char c : parameter) text += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    return text;
}

std::string modulation_macro(dqw_modulation modulation)
{
    std::string text = "DQW_MODULATION_";
    for (const char c : modulation_text(modulation))
        text += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    return text;
}

/// Settled points alone: L, psi and what goes with the electrical speed are then multiplied by the pole pairs.
bool lacks_pole_pairs(const TraceResult& trace)
{
    const auto& all = trace.after.parameters;
    return trace.regime == Regime::steady &&
           std::none_of(all.begin(), all.end(), [](const Estimate& e) { return e.name == "pole_pairs"; });
}

std::string row_of(const TraceInput& input, Regime regime, bool scaled)
{
    dqw_effect_config c = effect_config(input);
    if (scaled) std::fill(std::begin(c.start), std::end(c.start), 0.0F);
    // A settled log's delay is in seconds; the learners want periods, which such a log does not have.
    if (c.effect == DQW_EFFECT_DELAY && regime != Regime::dynamic) c.start[0] = 0.0F;
    std::string shape, start;
    for (const float x : c.shape) shape += (shape.empty() ? "" : ", ") + literal(static_cast<double>(x));
    for (const float x : c.start) start += (start.empty() ? "" : ", ") + literal(static_cast<double>(x));
    return fmt::format("    {{{}, {{{}}}, {{{}}}, {}}},\n", enumerator_of(input.effect), shape, start,
                       input.map.empty() ? "0" : "dqw_model_flux_map");
}

struct Field {
    const char *parameter, *field;
};

std::string values_text(const TraceResult& trace, const std::vector<Field>& fields, std::string& assignments)
{
    std::string out;
    for (const Field& f : fields)
        for (const Estimate& e : trace.after.parameters) {
            if (lacks_pole_pairs(trace) && e.name != "R_ohm") continue;
            if (e.name != f.parameter || !(e.value > 0.0) || !why_not_usable(e).empty()) continue;
            const bool count = e.name == "pole_pairs";
            out += fmt::format("#define {} {}\n", macro_of(e.name),
                               count ? fmt::format("{:.0f}", e.value) : literal(e.value));
            assignments += fmt::format("    config->{} = {};\n", f.field, macro_of(e.name));
        }
    return out;
}

/// The list of effects, those last that a monitor has inputs of its own for.
struct EffectRows {
    std::string text, width;
    int count = 0, unwatched = 0, weights = 0;
    bool angle = false;
};

EffectRows effect_rows(const TraceResult& trace, std::string& assignments)
{
    EffectRows rows;
    std::string watched;
    for (const TraceInput& in : learnable(trace.inputs)) {
        const dqw_effect_config c = effect_config(in);
        if (c.effect == DQW_EFFECT_DEAD_TIME) {
            rows.width += fmt::format("// Dead time: the current at which the inverter's loss is three quarters of its "
                                      "full size. It needs the angle.\n"
                                      "#define DQW_MODEL_DEAD_TIME_WIDTH_A {}\n\n",
                                      literal(static_cast<double>(c.shape[0])));
            assignments += "    config->dead_time_width_A = DQW_MODEL_DEAD_TIME_WIDTH_A;\n";
            if (const auto named = modulation_named(in.modulation); named && *named != DQW_MODULATION_CENTRED)
                assignments += fmt::format("    config->modulation = {};\n", modulation_macro(*named));
            continue;
        }
        rows.count++;
        rows.weights += dqw_effect_weights(c.effect);
        rows.unwatched += monitor_watches(in.effect) ? 0 : 1;
        (monitor_watches(in.effect) ? watched : rows.text) += row_of(in, trace.regime, lacks_pole_pairs(trace));
        if (c.effect == DQW_EFFECT_ANGLE_OFFSET && !rows.angle) {
            assignments +=
                "    // One weight for the angle: that of the effect.\n    config->encoder_offset = false;\n";
            rows.angle = true;
        }
    }
    rows.text += watched;
    return rows;
}

std::string effects_text(const EffectRows& rows)
{
    return fmt::format(
        "#if DQW_EFFECT_WEIGHTS < {0}\n#error \"build lib/ with -DDQW_EFFECT_WEIGHTS={0} or more\"\n"
        "#endif\n\n// Effect, shape, weights to start from, a flux map's table.\nstatic const dqw_effect_config "
        "dqw_model_effects[DQW_MODEL_EFFECT_COUNT] = {{\n{1}}};\n\n",
        rows.weights, rows.text);
}

std::string maps_text(const std::vector<TraceInput>& inputs)
{
    for (const TraceInput& in : inputs)
        if (!in.map.empty()) return map_table_text("dqw_model_flux_map", in.map);
    return {};
}

std::string monitor_text(const EffectRows& rows)
{
    std::string out = "\n// A monitor has inputs of its own for the angle, the current sensors and unlike phases.\n"
                      "static inline void dqw_model_config_apply_monitor(dqw_monitor_config *config)\n{\n"
                      "    dqw_model_config_apply(&config->estimator);\n";
    if (rows.count > 0) out += "    config->estimator.effect_count = DQW_MODEL_MONITOR_EFFECT_COUNT;\n";
    if (rows.angle) out += "    config->estimator.encoder_offset = true;\n";
    return out + "}\n";
}

}  // namespace

std::string harmless(const std::string& path)
{
    std::string name = path.substr(path.find_last_of('/') + 1).substr(0, 80);
    for (char& c : name)
        if (!std::isalnum(static_cast<unsigned char>(c)) && std::string("._- ").find(c) == std::string::npos) c = '?';
    return name;
}

std::string map_table_text(const std::string& name, const std::vector<std::int16_t>& map)
{
    std::string out = fmt::format("// Nodes of i_d, of them below zero, nodes of |i_q|; of each node how far d and q "
                                  "bend, in parts of 2^15 of the "
                                  "largest:\n// {} bytes.\nstatic const int16_t {}[] = {{\n    {}, {}, {}",
                                  2 * map.size(), name, map[0], map[1], map[2]);
    constexpr std::size_t kRow = 16;
    for (std::size_t k = DQW_EFFECT_MAP_HEAD; k < map.size(); ++k)
        out += fmt::format("{}{}", (k - DQW_EFFECT_MAP_HEAD) % kRow == 0 ? ",\n    " : ", ", map[k]);
    return out + "};\n\n";
}

std::string model_config_text(const TraceResult& trace, const std::vector<std::string>& logs)
{
    const bool mechanical = trace.regime == Regime::mechanical;
    const std::vector<Field> electrical_fields = {
        {"pole_pairs", "pole_pairs"}, {"R_ohm", "R_ohm"}, {"Ld_H", "Ld_H"}, {"Lq_H", "Lq_H"}, {"psi_Wb", "psi_Wb"}};
    const std::vector<Field> mechanical_fields = {{"J_kgm2", "J_kgm2"}, {"B_Nms_rad", "B_Nms_rad"}};
    std::string sources;
    for (const std::string& log : logs) sources += (sources.empty() ? " " : ", ") + harmless(log);
    std::string assignments;
    const std::string values = values_text(trace, mechanical ? mechanical_fields : electrical_fields, assignments);
    const EffectRows rows = effect_rows(trace, assignments);

    std::string out = fmt::format(
        "// What `dqwatch trace` found in{}: the effects that the plain model lacks, for the learners.\n",
        sources.empty() ? " a log" : sources);
    const std::string init = mechanical ? "dqw_shaft" : "dqw_estimator";
    out += fmt::format("// Fill in a {0}_config as before, call dqw_model_config_apply(&config), then {0}_init(); on a "
                       "running one {0}_define().\n",
                       init);
    if (!mechanical)
        out += "// Of a monitor: dqw_model_config_apply_monitor(&config), dqw_monitor_init(), dqw_monitor_define(). "
               "Pole pairs must be given where there are "
               "effects.\n";
    out += "#ifndef DQW_MODEL_CONFIG_H\n#define DQW_MODEL_CONFIG_H\n\n#include \"dqw.h\"\n\n";
    if (!values.empty()) out += "// To start from, SI.\n" + values + "\n";
    out += rows.width;
    for (const std::string& note : notes_on_others(trace.inputs)) out += "// " + note + ".\n";
    out += fmt::format("#define DQW_MODEL_EFFECT_COUNT {}\n", rows.count);
    // What a monitor watches by inputs of its own is none of the effects that it learns.
    if (!mechanical) out += fmt::format("#define DQW_MODEL_MONITOR_EFFECT_COUNT {}\n", rows.unwatched);
    out += "\n";
    if (rows.count > 0) {
        out += maps_text(trace.inputs) + effects_text(rows);
        assignments += "    config->effects = dqw_model_effects;\n    config->effect_count = DQW_MODEL_EFFECT_COUNT;\n";
    }
    if (assignments.empty()) assignments = "    (void)config;\n";
    out += fmt::format("static inline void dqw_model_config_apply({}_config *config)\n{{\n{}}}\n", init, assignments);
    if (!mechanical) out += monitor_text(rows);
    return out + "\n#endif\n";
}

}  // namespace dqw
