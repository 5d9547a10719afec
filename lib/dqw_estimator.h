// The terminal estimator: one step per PWM period from v_d, v_q, i_d, i_q and speed to R, L_d, L_q, p and flux.
#ifndef DQW_ESTIMATOR_H
#define DQW_ESTIMATOR_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_effect.h"
#include "dqw_gate.h"
#include "dqw_model.h"
#include "dqw_random.h"
#include "dqw_stage.h"
#include "dqw_window.h"

#ifdef __cplusplus
extern "C" {
#endif

enum dqw_regime {
    DQW_REGIME_DYNAMIC = 0,  ///< samples at a fixed period, currents move
    DQW_REGIME_STATIC,       ///< every sample is a settled point of its own: steady and standstill logs
};

/// All zero is refused.
typedef struct dqw_estimator_config {
    enum dqw_regime regime;
    float dt_s;      ///< sampling period, > 0; in the static regime any positive number, but that from row to row where something heats
    float v_base_V;  ///< rated voltage, current and mechanical speed: they scale. A sample beyond ten of them is saturated. > 0
    float i_base_A;
    float w_base_rad_s;
    float R_ohm;  ///< nominal values to start from; 0: start from zero. Never a prior
    float Ld_H;
    float Lq_H;
    float psi_Wb;
    uint16_t pole_pairs;   ///< 0: find it from the cross weights, but not where there are effects
    uint16_t half_window;  ///< pairs in half a block, 1 .. 10000; 0: 20. Dynamic regime only
    float v_limit_V;       ///< samples beyond are saturated, and not learned; 0: ten bases
    float i_limit_A;
    float excitation_pu;             ///< a block input below this part of its base teaches nothing; 0: 0.002
    uint32_t stale_limit;            ///< equal samples in a row before a sensor counts as stuck; 0: never
    uint32_t threshold_ppm;          ///< residual over voltage that stage 3 must reach; 0: 50000 (5 %)
    dqw_random_sample *reservoir_d;  ///< the caller's memory for stage 2, `reservoir` samples each
    dqw_random_sample *reservoir_q;
    uint32_t reservoir;  ///< samples in each, >= 2; the paper: 50
    uint32_t seed;
#if DQW_EFFECT_WEIGHTS > 0
    const dqw_effect_config *effects;  ///< electrical effects to learn as well; stays in use as long as the object
    uint8_t effect_count;              ///< their weights together <= DQW_EFFECT_WEIGHTS
#endif
} dqw_estimator_config;

typedef struct dqw_estimator {
    dqw_gate gate;
    uint32_t excited[DQW_GATE_INPUTS];  ///< blocks in which input i could teach its weight: d's, q's, the effects'
    dqw_window window;
    dqw_axis d, q;
    dqw_random random_d, random_q;
    dqw_learner coarse_d, coarse_q;  ///< stage 2's neurons
    dqw_stage stage;
    dqw_parameters parameters;  ///< as read after the last block
    dqw_sample last;
    float dt_s, v_limit_V, i_limit_A, w_limit_rad_s, excitation_pu;
    uint32_t events;  ///< all event bits since init
    uint16_t pole_pairs;
    enum dqw_regime regime;
    bool has_last, last_good;
#if DQW_EFFECT_WEIGHTS > 0
    dqw_effect effect;
#endif
} dqw_estimator;

/// Make an estimator.
///
/// Source   Fig. 3 with terminal signals; (E13) to (E22) in docs/EQUATIONS.md
/// Returns  DQW_OK; DQW_ERR_NULL, DQW_ERR_SIZE or DQW_ERR_RANGE, and then *e is untouched
/// Context  at start; the reservoirs stay in use as long as the object
enum dqw_status dqw_estimator_init(dqw_estimator *e, const dqw_estimator_config *config);

/// Stage 1 again, after a way back (e->stage.back): other bases, other effects, all that was learned forgotten. What was counted,
/// in e->gate, e->events and the stage's times_back, stays.
///
/// Source   Fig. 1; (E21) in docs/EQUATIONS.md
/// Returns  as dqw_estimator_init; on an error the old estimator goes on
/// Context  as dqw_estimator_background
enum dqw_status dqw_estimator_define(dqw_estimator *e, const dqw_estimator_config *config);

/// One sample. `saturated`: the inverter could not give the voltage of this sample, or a sensor is at its limit.
///
/// Source   (E13) to (E18) in docs/EQUATIONS.md
/// Units    SI; s->v_d_V, s->v_q_V as applied from this sample to the next
/// Range    any float; what cannot be learned is skipped and counted in e->gate
/// Returns  DQW_EVENT_* bits of this step
/// Cost     about 70 flops; at a block's end (every half_window samples) about 1200 more. Effects: dqw_effect_pair, 6 flops a
///          weight, and at a block's end dqw_model_read and dqw_gain_step with as many inputs more
/// Context  ISR safe; one writer per object
uint32_t dqw_estimator_step(dqw_estimator *e, const dqw_sample *s, bool saturated);

/// Time has jumped: the next sample does not follow the last one.
/// Context  as dqw_estimator_step
void dqw_estimator_gap(dqw_estimator *e);

/// Stage 2's epochs: show the Random Learners what the reservoirs hold. Does nothing in other stages.
///
/// Source   section 4.2 of the paper; (E8) in docs/EQUATIONS.md
/// Returns  true once both have converged
/// Cost     two epochs of `reservoir` draws
/// Context  background; must not be interrupted by dqw_estimator_step on the same object
bool dqw_estimator_background(dqw_estimator *e);

#if DQW_EFFECT_WEIGHTS > 0
/// What was learned of the effect config.effects[index]: SI weights and their deviations, in the order of its law.
///
/// Source   (E18), (E50) in docs/EQUATIONS.md: one joint system with R, L_d, L_q and psi
/// Shape    weights[], sd[]: dqw_effect_weights() of the name, written
/// Returns  bit i set where weight i is known, as dqw_effect_known; DQW_ERR_SIZE for an index out of range
int dqw_estimator_effect(const dqw_estimator *e, int index, float weights[], float sd[]);
#endif

/// Residual of both axes over their voltage, RMS, for one machine on both axes; 0 before the first block.
float dqw_estimator_relative_residual(const dqw_estimator *e);

#ifdef __cplusplus
}
#endif
#endif
