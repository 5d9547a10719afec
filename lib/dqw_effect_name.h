// The effects' names, and which weights each has: integers alone, so that float and fixed point share them.
#ifndef DQW_EFFECT_NAME_H
#define DQW_EFFECT_NAME_H

#ifdef __cplusplus
extern "C" {
#endif

/// Most weights that one effect has.
#define DQW_EFFECT_STARTS 5

/// Most numbers of a flux map's table, of 2 bytes: 2 kB.
#define DQW_EFFECT_MAP_NUMBERS 1024
/// Where its nodes begin: before them stand the nodes of i_d, how many of them are below zero, the nodes of |i_q|. Of
/// each node d and q, row by row of i_d: parts of 2^15 of the largest flux.
#define DQW_EFFECT_MAP_HEAD 3

/// Weights in brackets, then the shape: what is assumed of the effect, not learned.
/// Source   (E51) to (E54) in docs/EQUATIONS.md
enum dqw_effect_name {
    DQW_EFFECT_NONE = 0,          ///< refused
    DQW_EFFECT_DEAD_TIME,         ///< [V]: width, A
    DQW_EFFECT_SATURATION,        ///< [d2 d3 d4 q3 q5, Wb]: current of the polynomial's unit, A
    DQW_EFFECT_CROSS_SATURATION,  ///< [c12 c22 c14, Wb]: the same
    /// [ohm per K]: T_0, C; time constant, s; current that heats by 1, A (0: the base)
    DQW_EFFECT_WINDING_TEMPERATURE,
    DQW_EFFECT_MAGNET_TEMPERATURE,          ///< [Wb per K]: the same. A time constant of 0: the sample's temperature
    DQW_EFFECT_IRON_LOSS,                   ///< [G, S]: R, L_d, L_q
    DQW_EFFECT_FLUX_HARMONICS,              ///< [cos d, sin d, cos q, sin q, Wb]: order
    DQW_EFFECT_CURRENT_OFFSET,              ///< [alpha, beta, A]: R, L_d, L_q
    DQW_EFFECT_CURRENT_GAIN_MISMATCH,       ///< [m_1, m_2]: R, L_d, L_q
    DQW_EFFECT_ANGLE_OFFSET,                ///< [rad]: L_d, L_q, psi
    DQW_EFFECT_DELAY,                       ///< [periods]
    DQW_EFFECT_SKIN_EFFECT,                 ///< [ohm s^2]
    DQW_EFFECT_PHASE_RESISTANCE_IMBALANCE,  ///< [a, b, ohm]
    DQW_EFFECT_VOLTAGE_OFFSET,              ///< [d, q, V]
    DQW_EFFECT_FLUX_MAP,                    ///< [d, q]: largest flux of its table, Wb; cells of i_d and of i_q, A
    DQW_EFFECT_COULOMB_FRICTION,            ///< [Nm]: width, rad/s. From here on for dqw_shaft
    DQW_EFFECT_DIRECTION_ASYMMETRY,         ///< [Nm]: width, rad/s
    DQW_EFFECT_STRIBECK_FRICTION,           ///< [Nm]: width, speed at which it has fallen to 1/e, rad/s
    DQW_EFFECT_COGGING_TORQUE,              ///< [cos, sin, Nm]: periods a revolution
    DQW_EFFECT_LOAD_TORQUE,                 ///< [Nm]
    DQW_EFFECT_NAMES
};

/// Its name as dqwatch writes it: "dead_time".
/// Returns  constant text; "?" for what is no enumerator
/// Context  ISR safe; no state
const char *dqw_effect_text(enum dqw_effect_name name);

#ifdef __cplusplus
}
#endif
#endif
