#include "app/trace/verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "app/base/parameters.hpp"
#include "app/base/quantity.hpp"
#include "app/base/text.hpp"
#include "app/report/report.hpp"
#include "ref/effect/effect.hpp"

namespace dqw {
namespace {

std::string value_text(const std::string& name, const TraceEffect& effect)
{
    if (name == "channel") return effect.channel;
    for (const Estimate& e : effect.parameters)
        if (e.name == name) return with_sd(quantity(name, e.value, e.given ? 0.0 : e.sd, 3, 1));
    return "";
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

double value_of(const TraceEffect& effect, const char* name)
{
    for (const Estimate& e : effect.parameters)
        if (e.name == name) return e.value;
    return 0.0;
}

std::string flux_text(double flux_Wb) { return with_sd(quantity("_Wb", flux_Wb + 0.0, 0.0, 3)); }

/// "−20 A": a place on an axis needs no digits that say nothing.
std::string current_text(double i_A)
{
    Quantity q = quantity("_A", i_A, 0.0, 3);
    if (q.value.find('.') != std::string::npos)
        q.value.erase(std::min(q.value.find_last_not_of('0') + 1, q.value.size()));
    if (q.value.back() == '.') q.value.pop_back();
    return with_sd(q);
}

/// The row with an axis' largest current: beyond it a polynomial says nothing. None without blocks.
std::optional<std::size_t> largest_of(const std::vector<double>& current)
{
    std::optional<std::size_t> most;
    for (std::size_t k = 0; k < current.size(); ++k)
        if (std::isfinite(current[k]) && (!most || std::fabs(current[k]) > std::fabs(current[*most]))) most = k;
    return most;
}

/// What the polynomials of (E52) add to a flux at the largest current that the log has.
std::string flux_sentence(const TraceEffect& effect, const TraceBlocks& blocks)
{
    const double i_base_A = value_of(effect, "i_base_A");
    const auto weight = [&](const char* name) { return value_of(effect, name); };
    const auto d_row = largest_of(blocks.i_d_A), q_row = largest_of(blocks.i_q_A);
    if (!d_row || !q_row || !(i_base_A > 0.0)) return "";
    if (effect.name == "saturation") {
        const double x = blocks.i_d_A[*d_row] / i_base_A, y = blocks.i_q_A[*q_row] / i_base_A;
        const double d_Wb = x * x * (weight("psi_d2_Wb") + x * (weight("psi_d3_Wb") + x * weight("psi_d4_Wb")));
        const double q_Wb = y * y * y * (weight("psi_q3_Wb") + y * y * weight("psi_q5_Wb"));
        // Of an axis whose weights may all be nothing nothing is said, unless neither's are told apart.
        const auto told = [&](std::initializer_list<const char*> names) {
            return std::any_of(names.begin(), names.end(), [&](const char* name) {
                const Estimate* e = find_estimate(effect.parameters, name);
                return e != nullptr && std::fabs(e->value) > 2.0 * e->sd;
            });
        };
        const bool d = told({"psi_d2_Wb", "psi_d3_Wb", "psi_d4_Wb"}), q = told({"psi_q3_Wb", "psi_q5_Wb"});
        const std::string of_d = fmt::format("the flux of d by {} at i_d = {}", flux_text(d_Wb),
                                             current_text(blocks.i_d_A[*d_row])),
                          of_q = fmt::format("{} of q by {} at i_q = {}", d || !q ? "that" : "the flux",
                                             flux_text(q_Wb), current_text(blocks.i_q_A[*q_row]));
        return fmt::format("The iron saturates: it changes {} (saturation)", d == q ? of_d + ", " + of_q
                                                                             : d    ? of_d
                                                                                    : of_q);
    }
    if (effect.name != "cross_saturation" || *q_row >= blocks.i_d_A.size()) return "";
    const double x = blocks.i_d_A[*q_row] / i_base_A, y = blocks.i_q_A[*q_row] / i_base_A;
    const double d_Wb = y * y * (weight("psi_c12_Wb") + 2 * x * weight("psi_c22_Wb") + y * y * weight("psi_c14_Wb"));
    return fmt::format(
        "Each axis saturates the other: it changes the flux of d by {} at i_q = {} and i_d = {} (cross saturation)",
        flux_text(d_Wb), current_text(blocks.i_q_A[*q_row]), current_text(blocks.i_d_A[*q_row]));
}

std::string in_unit(double value, const std::string& unit)
{
    return number_like({"", "", unit}, "_" + unit, value, 2) + " " + unit;
}

/// A dead time below zero is given back, and more of it than is lost; where a leg rests, which.
std::string inverter_sentence(const TraceEffect& effect)
{
    if (effect.name != "dead_time" || effect.modulation.empty()) return "";
    std::string text;
    for (const Estimate& e : effect.parameters)
        if (e.name == "given_back_V")
            text = fmt::format("The inverter loses {} per phase, and its controller gives back {} (dead time)",
                               value_text("voltage_V", effect), value_text("given_back_V", effect));
        else if (e.name == "voltage_V" && e.value < 0.0)
            text = fmt::format("The controller gives back {} per phase more than its inverter loses: its own "
                               "compensation is too much (dead time)",
                               with_sd(quantity(e.name, -e.value, e.given ? 0.0 : e.sd, 3, 1)));
    if (text.empty())
        text = fmt::format("The inverter loses {} per phase (dead time)", value_text("voltage_V", effect));
    if (effect.modulation == "clamped_low") text += "; the lowest leg rests";
    if (effect.modulation == "clamped_high") text += "; the highest leg rests";
    if (effect.modulation == "clamped_60") text += "; the leg furthest from the middle rests";
    return text;
}

std::string joined(const std::vector<std::string>& items, const char* last)
{
    std::string out;
    for (std::size_t i = 0; i < items.size(); ++i) out += (i == 0 ? "" : i + 1 < items.size() ? ", " : last) + items[i];
    return out;
}

/// The base parameter that the effects moved most, as a part of its value; nullptr where none moved by a percent and
/// two deviations.
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

std::string without_them(const TraceResult& trace)
{
    double before = 0.0;
    const Estimate* wrong = most_wrong(trace, before);
    if (!wrong) return "";
    const Quantity like = quantity(wrong->name, std::fmax(std::fabs(before), std::fabs(wrong->value)), 0.0, 3);
    const auto text = [&](double value) { return with_sd({number_like(like, wrong->name, value, 3), "", like.unit}); };
    return fmt::format(" Without {}, {} reads {} instead of {}.", trace.effects.size() == 1 ? "it" : "them",
                       symbol(wrong->name), text(before), text(wrong->value));
}

std::string look_alikes(const TraceResult& trace)
{
    std::string out;
    for (const TraceEffect& e : trace.effects) {
        if (e.confusable_with.empty()) continue;
        out += fmt::format(" This log cannot tell it from {}.", look_alikes_of(e));
        if (trace.effects.size() > 1) out.replace(out.rfind(" it "), 4, " " + spoken(e.name) + " ");
    }
    return out;
}

struct Tried {
    std::set<std::string> yes, no;
};

Tried tried(const TraceResult& trace)
{
    Tried t;
    for (const TraceRejected& r : trace.rejected) (std::isfinite(r.heldout_rms) ? t.yes : t.no).insert(r.name);
    for (const TraceEffect& e : trace.effects) t.yes.insert(e.name);
    return t;
}

bool nothing_tried(const TraceResult& trace)
{
    const Tried t = tried(trace);
    return t.yes.empty() && !t.no.empty();
}

/// Where most of the catalogue was not tried, "nothing is missing" says little.
std::string untested(const TraceResult& trace)
{
    const Tried t = tried(trace);
    if (!trace.effects.empty() || t.yes.empty() || t.no.size() <= t.yes.size()) return "";
    return fmt::format(" {} of {} effects could not be tested on this log: the list says why.", t.no.size(),
                       t.no.size() + t.yes.size());
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

std::string look_alikes_of(const TraceEffect& effect)
{
    std::vector<std::string> names;
    for (const std::string& name : effect.confusable_with) names.push_back(spoken(name));
    return joined(names, " or ");
}

std::string effect_sentence(const TraceEffect& effect, const TraceBlocks& blocks)
{
    if (const std::string text = flux_sentence(effect, blocks); !text.empty()) return with_minus(text) + ".";
    if (const std::string text = inverter_sentence(effect); !text.empty()) return with_minus(text) + ".";
    if (const Effect* row = find_effect(effect.name))
        for (const char* sentence : row->sentences)
            if (const std::string text = filled(sentence, effect); !text.empty()) return with_minus(text) + ".";
    std::vector<std::string> values;
    for (const Estimate& e : effect.parameters)
        values.push_back(e.name + " = " + with_sd(quantity(e.name, e.value, e.given ? 0.0 : e.sd, 3)));
    return with_minus(
        fmt::format("The log shows {}{}{}.", spoken(effect.name), values.empty() ? "" : ": ", joined(values, ", ")));
}

std::string verdict_sentence(const TraceResult& trace)
{
    const bool blind = nothing_tried(trace);
    const char* const why = "no effect could be tested on this log, the list says why";
    if (trace.verdict == "clean")
        return fmt::format("{}: on rows that it never saw the plain model leaves {}, and the log's own noise is {}.",
                           blind ? fmt::format("What is missing is not known, {}", why) : "Nothing is missing",
                           in_unit(trace.before.heldout_rms, trace.unit), in_unit(trace.noise_floor, trace.unit));
    if (!trace.doubt.empty())
        return fmt::format("The plain model makes no sense of this log: {}{}", trace.doubt,
                           trace.doubt.back() == '?' ? "" : ".");
    if (trace.effects.empty())
        return fmt::format("Something is missing{}: the plain model leaves {}.",
                           blind ? fmt::format(", and {}", why) : " that no effect of the catalogue explains",
                           against_noise(trace.before.heldout_rms, trace));
    std::string out;
    for (const TraceEffect& e : trace.effects) out += (out.empty() ? "" : " ") + effect_sentence(e, trace.blocks);
    return out + with_minus(without_them(trace));
}

std::string verdict_line(const TraceResult& trace)
{
    const std::string doubtful = not_usable_text(trace.after.parameters);
    return verdict_sentence(trace) + (doubtful.empty() ? "" : " Parameters " + doubtful + ".");
}

std::string verdict_remark(const TraceResult& trace)
{
    std::string out = look_alikes(trace) + untested(trace);
    if (trace.verdict == "partly_explained")
        out += fmt::format(" A structured rest remains: {}.", against_noise(trace.after.heldout_rms, trace));
    if (!trace.partial.effects.empty() && trace.doubt.empty()) {
        out += " Best partial match:";
        for (const TraceEffect& e : trace.partial.effects) out += " " + effect_sentence(e, trace.blocks);
        out += fmt::format(" It explains {:.0f} % of what is above the noise, too little to name it; {}.",
                           100 * trace.partial.share, trace.partial.rest);
    }
    if (trace.beyond_hexagon > 0)
        out += fmt::format(" {} beyond the inverter's hexagon: held out, not fitted.",
                           counted(trace.beyond_hexagon, "row"));
    std::string rest = trace.doubt.empty() ? trace.rest_signature : "";
    if (!rest.empty() && rest[0] >= 'a' && rest[0] <= 'z') rest[0] = static_cast<char>(rest[0] - 'a' + 'A');
    if (!rest.empty()) out += " " + rest + (rest.back() == '.' ? "" : ".");
    return out.empty() ? out : with_minus(out.substr(1));
}

}  // namespace dqw
