#include "app/learn/parts.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "ref/effect/effect.hpp"

namespace dqw {

std::size_t all_rows(const std::vector<Log>& logs)
{
    std::size_t n = 0;
    for (const Log& log : logs) n += log.rows();
    return n;
}

std::uint16_t half_window(double span_s, double dt_s, int least)
{
    return static_cast<std::uint16_t>(std::lround(std::clamp(span_s / dt_s, static_cast<double>(least), 10000.0)));
}

LearnOptions options_of_run(const LearnOptions& options, int n, bool& heard)
{
    LearnOptions now = options;
    // Two runs are enough for most logs.
    if (options.progress)
        now.progress = [&options, n](double part) { options.progress(std::min(0.5 * (n + part), 1.0)); };
    if (heard) now.block = {};
    if (options.block && !heard)
        now.block = [&options, &heard](double t_s, const std::array<double, 4>& value) {
            heard = true;
            options.block(t_s, value);
        };
    return now;
}

LearnOptions quiet(LearnOptions options)
{
    options.progress = {};
    options.block = {};
    return options;
}

float nominal(const Machine& machine, const Machine& start, std::optional<double> Machine::*value)
{
    return static_cast<float>((machine.*value).value_or((start.*value).value_or(0.0)));
}

void note_gate(const dqw_gate& gate, std::uint32_t heldout, Result& result)
{
    const std::uint32_t saturated = gate.saturated - std::min(heldout, gate.saturated);
    if (gate.nonfinite + saturated + gate.stale > 0)
        result.notes.push_back(fmt::format("skipped {} samples: {} not finite, {} saturated, {} stale",
                                           gate.nonfinite + saturated + gate.stale, gate.nonfinite, saturated,
                                           gate.stale));
    if (gate.incomplete > 0 && heldout == 0)
        result.notes.push_back(
            fmt::format("dropped {} blocks with over a quarter of their samples skipped", gate.incomplete));
}

std::vector<dqw_effect_config> lists_of(const std::vector<TraceInput>& inputs)
{
    std::vector<dqw_effect_config> list;
    for (const TraceInput& in : inputs) list.push_back(effect_config(in));
    return list;
}

void check_room(const std::vector<TraceInput>& inputs)
{
    int weights = 0;
    for (const TraceInput& in : inputs) {
        const dqw_effect_name name = effect_config(in).effect;
        // Every estimator has a weight for dead time.
        weights += name == DQW_EFFECT_DEAD_TIME ? 0 : dqw_effect_weights(name);
    }
    if (weights > DQW_EFFECT_WEIGHTS)
        throw std::invalid_argument(
            fmt::format("these effects have {} weights together; the learners have room for {} (DQW_EFFECT_WEIGHTS)",
                        weights, DQW_EFFECT_WEIGHTS));
}

void put_effects(const std::vector<InputRead>& read, Learned& learned)
{
    std::vector<std::string> done;
    for (const InputRead& first : read) {
        learned.inputs.push_back(first.input);
        const std::string& name = first.input.effect;
        if (std::find(done.begin(), done.end(), name) != done.end()) continue;
        done.push_back(name);
        std::vector<TraceInput> inputs;
        std::vector<std::vector<double>> sd;
        bool known = false;
        for (const InputRead& r : read) {
            if (r.input.effect != name) continue;
            inputs.push_back(r.input);
            sd.push_back(r.sd);
            known = known || r.known != 0;
        }
        TraceEffect effect;
        effect.name = name;
        effect.parameters = physical(inputs, sd, std::vector<double>(inputs.size(), 0.0), learned.model);
        if (known) {
            learned.effects.push_back(effect);
            continue;
        }
        std::string why =
            "none of its weights is four deviations from nothing, or it cannot be told from another parameter:";
        for (const Estimate& e : effect.parameters)
            if (!e.given)
                why += std::isfinite(e.sd) ? fmt::format(" {} {:.3g} with a deviation of {:.3g}", e.name, e.value, e.sd)
                                           : " " + e.name + " unknown";
        const Effect* catalogue = find_effect(name);
        learned.result.not_identifiable.push_back({name, why, catalogue != nullptr ? catalogue->separate : ""});
    }
}

}  // namespace dqw
