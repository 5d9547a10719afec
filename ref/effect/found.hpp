// An effect as it was found: for people, and for firmware.
#ifndef DQW_REF_EFFECT_FOUND_HPP
#define DQW_REF_EFFECT_FOUND_HPP

#include <cstdint>
#include <string>
#include <vector>

#include "ref/log/result.hpp"

namespace dqw {

struct TraceEffect {
    std::string name;
    /// named with their SI suffix, e.g. voltage_V, width_A; `given`: assumed, not fitted
    std::vector<Estimate> parameters;
    double heldout_rms_after = 0.0;  ///< with this effect and those before it
    std::vector<std::string> confusable_with;
    std::string separate;                   ///< which experiment would tell it from those; empty where there are none
    std::string modulation = {}, law = {};  ///< of a dead time: which legs switch, how its loss grows with the current
    std::string channel = {};               ///< of what, where an effect may be of several; else empty
    bool turned = false;                    ///< a late voltage that was turned along with the rotor
    double confidence = 0.0;                ///< probability that the machine has it, (E112)
};

/// One term that firmware's Learner must know to have the effects found: the input of the named effect of
/// lib/dqw_effect.h, its shape (widths, base currents, time constants) and its weights' starting values, both in the
/// order that the law states.
struct TraceInput {
    std::string effect;
    std::vector<double> shape = {};
    std::vector<double> weights = {};
    double reach = 1.0;                  ///< largest value of a heating state in the log; 1 for all others
    std::string modulation = {};         ///< of a dead time: which legs switch
    std::vector<std::int16_t> map = {};  ///< of a flux map: its table, as firmware has it
};

/// For people: all legs are taken to lose voltage, though the log says by its modulation that one rests.
inline std::string loses_at_rest_text(const std::string& said)
{
    return "modulation " + said +
           ", as the log says, and its leg that rests loses voltage like the others, as where bipolar switches "
           "conduct: "
           "all are taken to lose it, and firmware learns it with modulation centred";
}

}  // namespace dqw
#endif
