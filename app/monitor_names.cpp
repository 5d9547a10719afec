#include "monitor_names.hpp"

#include <array>
#include <cctype>

namespace dqw {
namespace {

const std::array<MonitorChannel, DQW_WATCH_CHANNELS> channels = {{
    {"R_ohm", "R"},
    {"Ld_H", "L_d"},
    {"Lq_H", "L_q"},
    {"psi_Wb", "ψ"},
    {"dead_time_V", "dead time"},
    {"angle_rad", "encoder angle"},
    {"offset_A", "current offset"},
    {"phase_resistance_ohm", "one phase's extra resistance"},
    {"gain", "one current sensor's extra gain"},
    {"short_S", "shorted turns' conductance"},
    {"friction_Nm", "friction"},
    {"temperature_K", "winding above cold"},
    {"residual_V", "residual"},
}};

struct Fault {
    const char *name, *told;
    bool has_phase;
};

/// %: the phase.
const std::array<Fault, DQW_FAULT_NAMES> faults = {{
    {"none", "nothing has happened", false},
    {"over_temperature", "the winding is too hot", false},
    {"demagnetisation", "the magnets have lost flux", false},
    {"turn_short", "turns of phase % are shorted", true},
    {"phase_connection", "phase % has gained resistance", true},
    {"current_offset", "a current sensor reads a constant too much", false},
    {"current_gain", "the current sensor of phase % reads another gain", true},
    {"encoder_offset", "the encoder has turned against the rotor", false},
    {"bearing_wear", "friction has risen in both directions", false},
    {"inverter_fault", "the inverter loses another voltage than before", false},
    {"unknown", "something has changed that no fault of the table explains", false},
}};

struct Stage {
    const char *name, *spoken;
};
const std::array<Stage, 4> stages = {{
    {"domain knowledge", "stage 1, domain knowledge"},
    {"random learning", "stage 2, random learning: coarse values"},
    {"ordinal learning", "stage 3, ordinal learning: fine values"},
    {"in service", "in service"},
}};

/// Of an enumerator that this table does not have, the last entry.
template <class T, std::size_t n> const T& entry(const std::array<T, n>& table, int at)
{
    const auto place = static_cast<std::size_t>(at);
    return place < n ? table[place] : table.back();
}

}  // namespace

const MonitorChannel& channel_named(int channel) { return entry(channels, channel); }

const char* fault_named(dqw_fault_name fault) { return entry(faults, fault).name; }

const char* phase_of(const dqw_fault_verdict& fault)
{
    static const char* const phases[] = {"a", "b", "c"};
    return entry(faults, fault.name).has_phase && fault.phase < 3 ? phases[fault.phase] : "";
}

std::string fault_spoken(const dqw_fault_verdict& fault)
{
    std::string out = fault_named(fault.name);
    for (char& c : out)
        if (c == '_') c = ' ';
    const std::string phase = phase_of(fault);
    return phase.empty() ? out : out + ", phase " + phase;
}

std::string fault_told(const dqw_fault_verdict& fault)
{
    std::string out = entry(faults, fault.name).told;
    if (const std::size_t at = out.find('%'); at != std::string::npos) out.replace(at, 1, phase_of(fault));
    return out;
}

std::string capital(std::string text)
{
    if (!text.empty()) text[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(text[0])));
    return text;
}

const char* stage_named(dqw_stage_name stage) { return entry(stages, stage).name; }
const char* stage_spoken(dqw_stage_name stage) { return entry(stages, stage).spoken; }

}  // namespace dqw
