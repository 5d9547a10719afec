// The mechanical axis: J, B, Coulomb friction and further effects of the shaft from torque and speed, with the same neuron.
#ifndef DQW_MECHANICAL_H
#define DQW_MECHANICAL_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_axis.h"
#include "dqw_effect.h"
#include "dqw_gate.h"
#include "dqw_window.h"

#ifdef __cplusplus
extern "C" {
#endif

/// All zero is refused.
typedef struct dqw_mechanical_config {
    float dt_s;            ///< sampling period, > 0
    float torque_base_Nm;  ///< rated torque and mechanical speed: they scale. A sample beyond ten of them is saturated. > 0
    float w_base_rad_s;
    float J_kgm2;  ///< nominal values to start from; 0: start from zero. Never a prior
    float B_Nms_rad;
    uint16_t half_window;       ///< pairs in half a block, 1 .. 10000; 0: 25
    float excitation_pu;        ///< a block input below this part of its base teaches nothing; 0: 0.002
    bool coulomb;               ///< learn a friction torque against the motion as well
    float standstill_rad_s;     ///< with coulomb: no friction direction below this speed, >= 0
    float coulomb_width_rad_s;  ///< with coulomb: the direction is tanh(w / width); 0: its sign
#if DQW_EFFECT_WEIGHTS > 0
    const dqw_effect_config *effects;  ///< effects of the shaft to learn as well; stays in use as long as the object
    uint8_t effect_count;              ///< their weights together <= DQW_EFFECT_WEIGHTS
#endif
} dqw_mechanical_config;

typedef struct dqw_mechanical {
    dqw_gate gate;
    dqw_window window;
    dqw_axis axis;
    float dt_s, excitation_pu, standstill_rad_s, torque_limit_Nm, w_limit_rad_s;
    float coulomb_width_rad_s;
    float torque_last_Nm, w_last_rad_s;
    bool coulomb, has_last;
#if DQW_EFFECT_WEIGHTS > 0
    const dqw_effect_config *effects;
    float x_last[DQW_EFFECT_WEIGHTS];  ///< the effects' inputs at the last sample
    uint8_t effect_count, weights;
    bool needs_angle;
#endif
} dqw_mechanical;

/// What the weights say. A parameter whose `known` is false has no meaning.
typedef struct dqw_friction {
    float J_kgm2, B_Nms_rad, coulomb_Nm;
    float J_sd_kgm2, B_sd_Nms_rad, coulomb_sd_Nm;
    bool J_known, B_known, coulomb_known;
} dqw_friction;

/// Make a mechanical axis for J dw/dt + B w + T_c sign(w) = T.
///
/// Source   (E23) in docs/EQUATIONS.md
/// Returns  DQW_OK; DQW_ERR_NULL, DQW_ERR_SIZE or DQW_ERR_RANGE, and then *m is untouched
enum dqw_status dqw_mechanical_init(dqw_mechanical *m, const dqw_mechanical_config *config);

/// One sample.
///
/// Source   (E15), (E23) in docs/EQUATIONS.md
/// Units    torque_Nm at the shaft, as applied from this sample to the next; mechanical speed w_m_rad_s at this sample
/// Range    any float; a sample that is not finite, or beyond ten bases, is skipped and counted
/// Returns  DQW_EVENT_* bits of this step
/// Cost     about 25 flops; at a block's end about 100 more. Each effect: dqw_effect_torque and 6 flops a weight
/// Context  ISR safe; one writer per object
uint32_t dqw_mechanical_step(dqw_mechanical *m, float torque_Nm, float w_m_rad_s);

/// The same with the shaft's angle, which cogging needs: without it, or where it is not a number, its samples are skipped.
/// Context  as dqw_mechanical_step
uint32_t dqw_mechanical_step_at(dqw_mechanical *m, float torque_Nm, float w_m_rad_s, float theta_m_rad);

/// Time has jumped: the next sample does not follow the last one.
void dqw_mechanical_gap(dqw_mechanical *m);

/// J, B and the Coulomb torque, with their deviations.
///
/// Source   (E20), (E23) in docs/EQUATIONS.md
/// Range    known where the deviation is below a quarter of the value and the value is positive
dqw_friction dqw_mechanical_read(const dqw_mechanical *m);

#if DQW_EFFECT_WEIGHTS > 0
/// What was learned of the effect config.effects[index]: weights in Nm and their deviations, in the order of its law.
///
/// Source   (E20), (E54) in docs/EQUATIONS.md
/// Shape    weights[], sd[]: dqw_effect_weights() of the name, written
/// Returns  bit i set where weight i is known, as dqw_effect_known; DQW_ERR_SIZE for an index out of range
int dqw_mechanical_effect(const dqw_mechanical *m, int index, float weights[], float sd[]);
#endif

#ifdef __cplusplus
}
#endif
#endif
