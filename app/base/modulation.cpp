#include "app/base/modulation.hpp"

#include <array>

namespace dqw {
namespace {

constexpr std::array<std::string_view, DQW_MODULATION_MASK> kNames = {"centred", "clamped_low", "clamped_high",
                                                                      "clamped_60"};

}  // namespace

std::optional<dqw_modulation> modulation_named(std::string_view name)
{
    for (std::size_t k = 0; k < kNames.size(); ++k)
        if (kNames[k] == name) return static_cast<dqw_modulation>(k);
    return std::nullopt;
}

std::string modulation_text(dqw_modulation modulation)
{
    return std::string(modulation < DQW_MODULATION_MASK    ? kNames[modulation]
                       : modulation == DQW_MODULATION_MASK ? "mask"
                                                           : "unknown");
}

}  // namespace dqw
