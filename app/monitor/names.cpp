#include "app/monitor/names.hpp"

#include <cctype>
#include <cstring>

#include "dqw_text.h"

namespace dqw {
namespace {

const char* title_of(int channel)
{
    switch (static_cast<dqw_monitor_channel>(channel)) {
    case DQW_WATCH_R: return "R";
    case DQW_WATCH_LD: return "L_d";
    case DQW_WATCH_LQ: return "L_q";
    case DQW_WATCH_PSI: return "ψ";
    case DQW_WATCH_DEAD_TIME: return "dead time";
    case DQW_WATCH_ANGLE: return "encoder angle";
    case DQW_WATCH_MAP_D: return "flux map on d";
    case DQW_WATCH_MAP_Q: return "flux map on q";
    case DQW_WATCH_OFFSET: return "current offset";
    case DQW_WATCH_RESISTANCE: return "one phase's extra resistance";
    case DQW_WATCH_REACTANCE: return "one current sensor's extra gain";
    case DQW_WATCH_SHORT: return "shorted turns' conductance";
    case DQW_WATCH_FRICTION: return "friction";
    case DQW_WATCH_TEMPERATURE: return "winding above cold";
    case DQW_WATCH_RESIDUAL:
    case DQW_WATCH_CHANNELS: break;
    }
    return "residual";
}

/// %: the phase.
const char* told_of(dqw_fault_name fault)
{
    switch (fault) {
    case DQW_FAULT_NONE: return "nothing has happened";
    case DQW_FAULT_OVER_TEMPERATURE: return "the winding is too hot";
    case DQW_FAULT_DEMAGNETISATION: return "the magnets have lost flux";
    case DQW_FAULT_TURN_SHORT: return "turns of phase % are shorted";
    case DQW_FAULT_PHASE_CONNECTION: return "phase % has gained resistance";
    case DQW_FAULT_CURRENT_OFFSET: return "a current sensor reads a constant too much";
    case DQW_FAULT_CURRENT_GAIN: return "the current sensor of phase % reads another gain";
    case DQW_FAULT_ENCODER_OFFSET: return "the encoder has turned against the rotor";
    case DQW_FAULT_BEARING_WEAR: return "friction has risen in both directions";
    case DQW_FAULT_INVERTER_FAULT: return "the inverter loses more voltage than before";
    case DQW_FAULT_RESISTANCE_RISE: return "all phases have gained resistance, faster than heat could make it";
    case DQW_FAULT_VOLTAGE_SCALE: return "the voltage is measured with another gain: R, L and flux have changed alike";
    case DQW_FAULT_UNKNOWN:
    case DQW_FAULT_NAMES: break;
    }
    return "something has changed that no fault of the table explains";
}

}  // namespace

MonitorChannel channel_named(int channel)
{
    // What lib/ has as a flux and as an inductance the command divides: by the flux, and by the mean inductance.
    const char* const name = channel == DQW_WATCH_ANGLE ? "angle_rad"
                             : channel == DQW_WATCH_REACTANCE
                                 ? "gain"
                                 : dqw_parameter_text(static_cast<dqw_monitor_channel>(channel));
    return {name, title_of(channel)};
}

const char* phase_of(const dqw_fault_verdict& fault)
{
    static const char* const phases[] = {"a", "b", "c"};
    const bool has_phase = std::strchr(told_of(fault.name), '%') != nullptr;
    return has_phase && fault.phase < 3 ? phases[fault.phase] : "";
}

std::string fault_spoken(const dqw_fault_verdict& fault)
{
    std::string out = dqw_fault_text(fault.name);
    for (char& c : out)
        if (c == '_') c = ' ';
    const std::string phase = phase_of(fault);
    return phase.empty() ? out : out + ", phase " + phase;
}

std::string fault_told(const dqw_fault_verdict& fault)
{
    std::string out = told_of(fault.name);
    if (const std::size_t at = out.find('%'); at != std::string::npos) out.replace(at, 1, phase_of(fault));
    return out;
}

std::string capital(std::string text)
{
    if (!text.empty()) text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
    return text;
}

const char* stage_spoken(dqw_stage_name stage)
{
    switch (stage) {
    case DQW_STAGE_DOMAIN: return "stage 1, domain knowledge";
    case DQW_STAGE_RANDOM: return "stage 2, random learning: coarse values";
    case DQW_STAGE_ORDINAL: return "stage 3, ordinal learning: fine values";
    case DQW_STAGE_IN_SERVICE: break;
    }
    return dqw_stage_text(DQW_STAGE_IN_SERVICE);
}

}  // namespace dqw
