#include "app/learn/modulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>

#include "app/base/modulation.hpp"
#include "app/learn/signals.hpp"
#include "dqw_estimator_block.h"

namespace dqw {
namespace {

constexpr double kLongest_s = 10.0;
// The first blocks are about the start values; of so few nobody knows.
constexpr std::uint32_t kFirst = 200, kLeast = 1000;
// One that leads leaves at most this part of the power that all legs leave.
constexpr double kLeads = 0.6;

/// Mean squared residual; nothing where too little was learned.
std::optional<double> left_by(const Log& log, dqw_estimator_config config, dqw_modulation modulation,
                              const std::vector<TraceInput>& inputs)
{
    config.modulation = modulation;
    config.effects = nullptr;
    config.effect_count = 0;
    config.random = nullptr;
    dqw_estimator e;
    if (dqw_estimator_init(&e, &config) != DQW_OK) return std::nullopt;
    const SampleSource sample(log, config.pole_pairs, inputs);
    double sum = 0.0;
    std::uint32_t blocks = 0;
    const std::size_t rows = std::min(log.rows(), static_cast<std::size_t>(kLongest_s / log.dt_s));
    std::size_t segment = 0;
    for (std::size_t k = 0; k < rows; ++k) {
        if (segment < log.segments.size() && log.segments[segment] == k) {
            dqw_estimator_missing(&e, 0);
            ++segment;
        }
        const dqw_sample s = sample(k);
        (void)dqw_estimator_sample(&e, &s, false);
        if (!dqw_estimator_background(&e) || e.gate.blocks <= kFirst) continue;
        sum += static_cast<double>(e.e_pu[0]) * e.e_pu[0] + static_cast<double>(e.e_pu[1]) * e.e_pu[1];
        ++blocks;
    }
    if (blocks < kLeast) return std::nullopt;
    return sum / blocks;
}

}  // namespace

dqw_modulation modulation_of(const Log& log, const dqw_estimator_config& config, const std::vector<TraceInput>& inputs)
{
    const auto said = modulation_named(log.modulation);
    if (!said)
        for (const TraceInput& in : inputs)
            if (const auto found = modulation_named(in.modulation)) return *found;
    if (!config.angle || config.settled || !(config.dead_time_width_A > 0.0F) || config.pole_pairs == 0 ||
        !(log.dt_s > 0.0) || said == DQW_MODULATION_CENTRED)
        return said.value_or(DQW_MODULATION_CENTRED);
    const auto all = left_by(log, config, DQW_MODULATION_CENTRED, inputs);
    if (said) {
        // What switches conduct through, bipolar ones, they lose in a leg that rests as well.
        const auto left = left_by(log, config, *said, inputs);
        return all && left && *all < kLeads * *left ? DQW_MODULATION_CENTRED : *said;
    }
    dqw_modulation best = DQW_MODULATION_CENTRED;
    if (!all) return best;
    double least = kLeads * *all;
    for (const dqw_modulation m :
         {DQW_MODULATION_CLAMPED_LOW, DQW_MODULATION_CLAMPED_HIGH, DQW_MODULATION_CLAMPED_60}) {
        const auto left = left_by(log, config, m, inputs);
        if (!left || *left >= least) continue;
        least = *left;
        best = m;
    }
    return best;
}

std::string note_on_modulation(const Log& log, dqw_modulation taken)
{
    const auto said = modulation_named(log.modulation);
    if (said && *said != taken) return loses_at_rest_text(log.modulation);
    if (!said && taken != DQW_MODULATION_CENTRED)
        return fmt::format("modulation {}: found, it leaves the least residual", modulation_text(taken));
    return "";
}

}  // namespace dqw
