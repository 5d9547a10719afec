// The shaft: J, B, Coulomb friction and further effects from torque and speed, all by one neuron.
#ifndef DQW_SHAFT_H
#define DQW_SHAFT_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_parts.h"
#include "dqw_reading.h"
#include "dqw_shaft_parameter.h"
#include "dqw_size.h"
#include "dqw_status.h"

#ifdef __cplusplus
extern "C" {
#endif

/// All zero is refused. Constant: it may stay in flash.
typedef struct dqw_shaft_config {
    float dt_s;  ///< sampling period, > 0
    /// rated torque and mechanical speed: they scale. A sample beyond ten of them is saturated. > 0
    float torque_base_Nm;
    float w_base_rad_s;         ///< > 0
    float J_kgm2;               ///< nominal values to start from; 0: start from zero. Never a prior
    float B_Nms_rad;            ///< the same
    uint16_t half_window;       ///< pairs in half a block, 1 .. 10000; 0: 25
    float excitation_pu;        ///< a block's input below this part of its base teaches nothing, >= 0; 0: 0.002
    bool coulomb;               ///< learn a friction torque against the motion as well
    float standstill_rad_s;     ///< with coulomb: no friction direction up to this speed, >= 0
    float coulomb_width_rad_s;  ///< with coulomb: the direction is tanh(w / width), >= 0; 0: its sign
#if DQW_EFFECT_WEIGHTS > 0
    const dqw_effect_config *effects;  ///< effects of the shaft to learn as well; stays in use as long as the object
    uint8_t effect_count;              ///< their weights together <= DQW_EFFECT_WEIGHTS
#endif
} dqw_shaft_config;

/// What is written on the machine.
typedef struct dqw_shaft_nameplate {
    float dt_s;       ///< sampling period
    float torque_Nm;  ///< rated torque
    float w_m_rad_s;  ///< rated mechanical speed
} dqw_shaft_nameplate;

/// Signals of a pair: torque, step of the speed, sums of two speeds and directions; then the effects' inputs, sums of
/// two.
#define DQW_SHAFT_SIGNALS (4 + DQW_EFFECT_WEIGHTS)

/// Most inputs of the neuron: J, B, Coulomb friction where it is asked for, then the effects' weights.
#define DQW_SHAFT_INPUTS (DQW_SHAFT_PARAMETERS + DQW_EFFECT_WEIGHTS)

/// A shaft's learner.
typedef struct dqw_shaft {
    // Set at the start.
    const dqw_shaft_config *config;
    float J_unit_kgm2, B_unit_Nms_rad;  ///< what one unit of a weight is; of all others the torque's base
    float slope_s_rad;                  ///< of a soft direction: 1 over its width
    uint8_t inputs, weights;            ///< of the neuron; how many of them are effects'
    bool needs_angle;
    // The interrupt's.
    dqw_gate gate;  ///< all but `blocks` and `incomplete`, which the background counts
    dqw_window window;
    float torque_last_Nm, w_last_rad_s, direction_last;
#if DQW_EFFECT_WEIGHTS > 0
    float x_last[DQW_EFFECT_WEIGHTS];  ///< the effects' inputs at the last sample
#endif
    uint32_t missed;  ///< halves lost because the background came too late
    bool has_last;
    // The background's: the half before, the neuron, and what it leaves unexplained.
    dqw_window_rise rise;
    float w_pu[DQW_SHAFT_INPUTS];
    dqw_gain gain;
    float error_pu2, lag_pu2, target_pu2;  ///< means: squared residual, product of two in a row, squared target
    float error_last_pu;
    uint32_t excited;  ///< of the last block, bit i: input i was large enough to teach its weight
    uint32_t skipped;  ///< blocks refused: not finite, or beyond 1e5 bases
} dqw_shaft;

/// A configuration from a nameplate: blocks of twice 25 ms (at least twice 10 samples), friction learned, its direction
/// soft below a hundredth of the rated speed. Nominal values and effects are absent.
///
/// Shape    nameplate: null gives all zero, and what is no number is passed on: dqw_shaft_init() refuses both
/// Context  at start
dqw_shaft_config dqw_shaft_config_default(const dqw_shaft_nameplate *nameplate);

/// Make a shaft for J dw/dt + B w + T_c sign(w) = T.
///
/// Source   (E23), (E54) in docs/EQUATIONS.md
/// Returns  DQW_OK; DQW_ERR_NULL, or the enumerator of the field that was refused, DQW_ERR_UNIT where bases and start
///          values go too far apart; then *s is untouched
/// Context  at start; the configuration stays in use as long as the object
#define dqw_shaft_init DQW_SIZED(dqw_shaft_init)
enum dqw_status dqw_shaft_init(dqw_shaft *s, const dqw_shaft_config *config);

/// Begin anew with another configuration: all that was learned is forgotten.
///
/// Returns  as dqw_shaft_init; where it is refused, the old one goes on
/// Context  background; hold the interrupt back meanwhile
enum dqw_status dqw_shaft_define(dqw_shaft *s, const dqw_shaft_config *config);

/// One sample: gathers, never learns.
///
/// Source   (E15), (E23), (E54) in docs/EQUATIONS.md
/// Units    torque_Nm at the shaft, as applied from this sample to the next; mechanical speed w_m_rad_s at this sample;
///          the shaft's angle, which cogging alone reads. `saturated`: the caller knows that the sample is beyond a
///          limit
/// Range    any float; a sample that is not finite, or beyond ten bases, is skipped and counted in s->gate
/// Returns  DQW_EVENT_* bits of this step; DQW_EVENT_BLOCK: a block waits for dqw_shaft_background
/// Cost     about 20 flops, 6 a signal more at a block's end; a tanhf for a soft direction; each effect:
///          dqw_effect_torque and 3 flops a weight
/// Context  ISR safe; one writer per object
#define dqw_shaft_sample DQW_SIZED(dqw_shaft_sample)
uint32_t dqw_shaft_sample(dqw_shaft *s, float torque_Nm, float w_m_rad_s, float theta_m_rad, bool saturated);

/// No sample came in these periods. 1: as a sample that is refused. 0, where nobody knows, or more: time has jumped,
/// the next sample does not follow the last one.
/// Context  as dqw_shaft_sample
void dqw_shaft_missing(dqw_shaft *s, uint32_t periods);

/// Learn the block that waits, if there is one. Must come before the next: every half_window periods.
///
/// Source   (E17), (E19), (E20) in docs/EQUATIONS.md
/// Returns  true if a block was learned
/// Cost     dqw_gain_step, about 10 flops a weight and 30 more
/// Context  background; dqw_shaft_sample and dqw_shaft_missing may interrupt it anywhere
#define dqw_shaft_background DQW_SIZED(dqw_shaft_background)
bool dqw_shaft_background(dqw_shaft *s);

/// J, B or the Coulomb torque.
///
/// Source   (E20), (E23) in docs/EQUATIONS.md
/// Returns  in SI; what is not configured, or does not exist, is 0 and not known
/// Context  background, or wherever dqw_shaft_background cannot come between
dqw_reading dqw_shaft_read(const dqw_shaft *s, enum dqw_shaft_parameter which);

#if DQW_EFFECT_WEIGHTS > 0
/// What was learned of the effect config->effects[index]: weights in Nm and their deviations, in the order of its law.
///
/// Source   (E20), (E54) in docs/EQUATIONS.md
/// Shape    weights[], sd[]: as many as dqw_effect_name.h lists, DQW_EFFECT_STARTS at most, written; DQW_UNKNOWN where
///          nothing was learned
/// Returns  bit i set where weight i is known: its deviation is below a quarter of the effect's largest; DQW_ERR_SIZE
///          for an index out of range
/// Context  as dqw_shaft_read
int dqw_shaft_read_effect(const dqw_shaft *s, int index, float weights[], float sd[]);
#endif

#ifdef __cplusplus
}
#endif
#endif
