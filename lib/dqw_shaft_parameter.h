// What is learned of a shaft, in this order in both arithmetics. Integers alone.
#ifndef DQW_SHAFT_PARAMETER_H
#define DQW_SHAFT_PARAMETER_H

#ifdef __cplusplus
extern "C" {
#endif

/// Inertia, kg m^2; viscous friction, Nms/rad; Coulomb friction, Nm.
enum dqw_shaft_parameter { DQW_J = 0, DQW_B, DQW_COULOMB, DQW_SHAFT_PARAMETERS };

#ifdef __cplusplus
}
#endif
#endif
