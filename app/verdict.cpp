#include "verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "quantity.hpp"

namespace dqw {
namespace {

/// {name} stands for that parameter with its deviation and unit, {psi_d*} for the sum of all that begin so. Of several sentences
/// for one effect the first that finds its parameters is said.
struct Sentence {
    const char *effect, *text;
};

const Sentence sentences[] = {
    {"dead_time", "The inverter loses {voltage_V} per phase (dead time)"},
    {"saturation", "The iron saturates: {i_base_A} in one axis bends its flux by {psi_d*_Wb} in d, by {psi_q*_Wb} in q (saturation)"},
    {"cross_saturation", "Each axis saturates the other: {i_base_A} in q bends the flux of d by {psi_c1*_Wb} (cross saturation)"},
    {"winding_temperature", "The winding warms up: R grows by {alpha_per_K} (winding temperature)"},
    {"winding_temperature", "The winding warms up: R grows by {rise_percent} within the log (winding temperature)"},
    {"magnet_temperature", "The magnet warms up: ψ changes by {beta_per_K} (magnet temperature)"},
    {"magnet_temperature", "The magnet warms up: ψ falls by {fall_percent} within the log (magnet temperature)"},
    {"iron_loss", "The iron loses power like a resistance of {R_fe_ohm} across the induced voltage (iron loss)"},
    {"flux_harmonics", "The flux ripples six times a turn by {psi_6d_Wb} in d and {psi_6q_Wb} in q (flux harmonics)"},
    {"flux_harmonics", "The flux ripples twelve times a turn by {psi_12d_Wb} in d and {psi_12q_Wb} in q (flux harmonics)"},
    {"current_offset", "The current sensors are off by {i_alpha_A} in α and {i_beta_A} in β (current offset)"},
    {"current_gain_mismatch", "The phases' current sensors differ in gain by {gain} (current gain mismatch)"},
    {"angle_offset", "The angle is off by {angle_rad}, electrical (angle offset)"},
    {"delay", "The voltage comes {periods} periods late (delay)"},
    {"delay", "The voltage comes {delay_s} late (delay)"},
    {"skin_effect", "R grows with the square of the speed, by {k_s2_rad2} (skin effect)"},
    {"phase_resistance_imbalance", "The phases differ in resistance: a by {dR_a_ohm} and b by {dR_b_ohm} from c (phase resistance imbalance)"},
    {"voltage_offset", "A constant voltage is in the log: {v_d_V} in d, {v_q_V} in q (voltage offset)"},
    {"coulomb_friction", "Dry friction takes {torque_Nm} (Coulomb friction)"},
    {"direction_asymmetry", "Friction differs with the direction: {torque_Nm} more one way, less the other (direction asymmetry)"},
    {"stribeck_friction", "Friction rises by {torque_Nm} near standstill (Stribeck friction)"},
    {"cogging_torque", "The torque ripples by {torque_Nm}, {order} times a turn (cogging torque)"},
    {"load_torque", "A constant load takes {torque_Nm} (load torque)"},
};

std::string value_text(const std::string& name, const TraceEffect& effect)
{
    const std::size_t star = name.find('*');
    double sum = 0.0;
    bool any = false;
    for (const Estimate& e : effect.parameters) {
        if (e.name == name) return with_sd(quantity(name, e.value, e.given ? 0.0 : e.sd, 3, 1));
        if (star == std::string::npos || e.name.compare(0, star, name, 0, star) != 0) continue;
        sum += e.value, any = true;
    }
    return any ? with_sd(quantity(name, sum, 0.0, 3)) : "";
}

/// Fills {name} from the effect's parameters; nothing where one is missing.
std::string filled(std::string text, const TraceEffect& effect)
{
    for (std::size_t open = text.find('{'); open != std::string::npos; open = text.find('{', open)) {
        const std::size_t close = text.find('}', open);
        const std::string value = value_text(text.substr(open + 1, close - open - 1), effect);
        if (value.empty()) return "";
        text.replace(open, close - open + 1, value);
        open += value.size();
    }
    return text;
}

std::string in_unit(double value, const std::string& unit) { return number_like({"", "", unit}, "_" + unit, value, 2) + " " + unit; }

std::string joined(const std::vector<std::string>& items, const char* last)
{
    std::string out;
    for (std::size_t i = 0; i < items.size(); ++i) out += (i == 0 ? "" : i + 1 < items.size() ? ", " : last) + items[i];
    return out;
}

std::string without_them(const TraceResult& trace)
{
    double before = 0.0;
    const Estimate* wrong = most_wrong(trace, before);
    if (!wrong) return "";
    const Quantity like = quantity(wrong->name, std::fmax(std::fabs(before), std::fabs(wrong->value)), 0.0, 3);
    const auto text = [&](double value) { return with_sd({number_like(like, wrong->name, value, 3), "", like.unit}); };
    return fmt::format(" Without {}, {} reads {} instead of {}.", trace.effects.size() == 1 ? "it" : "them", symbol(wrong->name), text(before),
                       text(wrong->value));
}

std::string look_alikes(const TraceResult& trace)
{
    std::string out;
    for (const TraceEffect& e : trace.effects) {
        if (e.confusable_with.empty()) continue;
        std::vector<std::string> names;
        for (const std::string& name : e.confusable_with) names.push_back(spoken(name));
        out += fmt::format(" This log cannot tell it from {}.", joined(names, " or "));
        if (trace.effects.size() > 1) out.replace(out.rfind(" it "), 4, " " + spoken(e.name) + " ");
    }
    return out;
}

/// "1.53 V, 10 times the log's own noise".
std::string against_noise(double rms, const TraceResult& trace)
{
    const double ratio = rms / trace.noise_floor;
    if (!std::isfinite(ratio)) return in_unit(rms, trace.unit);
    return fmt::format("{}, {:.{}f} times the log's own noise", in_unit(rms, trace.unit), ratio, ratio < 9.95 ? 1 : 0);
}

}  // namespace

std::string spoken(const std::string& name)
{
    std::string out = name;
    std::replace(out.begin(), out.end(), '_', ' ');
    return out;
}

std::string symbol(const std::string& parameter)
{
    const std::pair<const char*, const char*> symbols[] = {{"R_ohm", "R"},      {"Ld_H", "L_d"}, {"Lq_H", "L_q"},    {"psi_Wb", "ψ"},
                                                           {"pole_pairs", "p"}, {"J_kgm2", "J"}, {"B_Nms_rad", "B"}, {"torque_constant_Nm_A", "K_t"}};
    for (const auto& [name, text] : symbols)
        if (parameter == name) return text;
    return parameter;
}

const Estimate* most_wrong(const TraceResult& trace, double& before)
{
    const Estimate* most = nullptr;
    double largest = 0.01;
    for (const Estimate& after : trace.after.parameters)
        for (const Estimate& b : trace.before.parameters) {
            if (b.name != after.name || after.given || b.given) continue;
            const double moved = std::fabs(b.value - after.value);
            const double part = moved / std::fabs(after.value);
            if (!(part > largest) || !(moved > 2 * after.sd)) continue;
            largest = part, most = &after, before = b.value;
        }
    return most;
}

std::string effect_sentence(const TraceEffect& effect)
{
    for (const Sentence& s : sentences) {
        if (effect.name != s.effect) continue;
        const std::string text = filled(s.text, effect);
        if (!text.empty()) return text + ".";
    }
    std::vector<std::string> values;
    for (const Estimate& e : effect.parameters) values.push_back(e.name + " = " + with_sd(quantity(e.name, e.value, e.given ? 0.0 : e.sd, 3)));
    return fmt::format("The log shows {}{}{}.", spoken(effect.name), values.empty() ? "" : ": ", joined(values, ", "));
}

std::string verdict_sentence(const TraceResult& trace)
{
    if (trace.verdict == "clean")
        return fmt::format("Nothing is missing: on rows that it never saw the plain model leaves {}, and the log's own noise is {}.",
                           in_unit(trace.before.heldout_rms, trace.unit), in_unit(trace.noise_floor, trace.unit));
    if (trace.effects.empty())
        return fmt::format("Something is missing that no effect of the catalogue explains: the plain model leaves {}.",
                           against_noise(trace.before.heldout_rms, trace));
    std::string out;
    for (const TraceEffect& e : trace.effects) out += (out.empty() ? "" : " ") + effect_sentence(e);
    return out + without_them(trace);
}

std::string verdict_remark(const TraceResult& trace)
{
    std::string out = look_alikes(trace);
    if (trace.verdict == "partly_explained") out += fmt::format(" A structured rest remains: {}.", against_noise(trace.after.heldout_rms, trace));
    std::string rest = trace.rest_signature;
    if (!rest.empty() && rest[0] >= 'a' && rest[0] <= 'z') rest[0] = static_cast<char>(rest[0] - 'a' + 'A');
    if (!rest.empty()) out += " " + rest + (rest.back() == '.' ? "" : ".");
    return out.empty() ? out : out.substr(1);
}

}  // namespace dqw
