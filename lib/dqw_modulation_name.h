// How an inverter makes its voltage: which of its legs switch.
#ifndef DQW_MODULATION_NAME_H
#define DQW_MODULATION_NAME_H

/// How the inverter makes its voltage.
enum dqw_modulation {
    DQW_MODULATION_CENTRED = 0,   ///< all three legs switch in every period: sine, third harmonic, space vectors
    DQW_MODULATION_CLAMPED_LOW,   ///< the lowest phase rests on the negative rail
    DQW_MODULATION_CLAMPED_HIGH,  ///< the highest phase rests on the positive rail
    DQW_MODULATION_CLAMPED_60,    ///< the phase furthest from the middle rests, each on its rail for 60 degrees
    DQW_MODULATION_MASK,          ///< dqw_sample's resting says it
    DQW_MODULATION_UNKNOWN,       ///< one of the first four: found while the machine runs
    DQW_MODULATIONS
};

#endif
