// What is learned of a machine: the joint neuron's own weights, in this order in both arithmetics. Integers alone.
#ifndef DQW_PARAMETER_H
#define DQW_PARAMETER_H

#ifdef __cplusplus
extern "C" {
#endif

/// Weights of the joint neuron. Bit i of a mask stands for weight i; effects' weights follow, in the order of their
/// list.
enum dqw_parameter {
    DQW_R = 0,
    DQW_LD,
    DQW_LQ,
    DQW_PSI,
    DQW_DEAD_TIME,  ///< V that the inverter takes from each phase
    /// flux linkage of the magnet that shows on the other axis: psi times the angle by which the encoder is off
    DQW_PSI_Q,
    /// V that the inverter takes from a switching phase whichever way its current flows: shows only where a leg rests
    DQW_DEAD_CONSTANT,
    DQW_PARAMETERS
};

/// When a voltage acts that comes with a sample.
enum dqw_voltage_acts {
    DQW_VOLTAGE_NOT_KNOWN = 0,  ///< this motion does not tell
    DQW_VOLTAGE_NOW,            ///< from this sample to the next
    DQW_VOLTAGE_NEXT,           ///< one period later
};

#ifdef __cplusplus
}
#endif
#endif
