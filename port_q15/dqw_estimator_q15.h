// The terminal estimator in whole numbers: one step per PWM period from v_d, v_q, i_d, i_q and speed to R, L_d, L_q, p and flux.
#ifndef DQW_ESTIMATOR_Q15_H
#define DQW_ESTIMATOR_Q15_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_effect_q15.h"
#include "dqw_gate.h"
#include "dqw_model_q15.h"
#include "dqw_scale.h"
#include "dqw_stage.h"
#include "dqw_window_q15.h"

#ifdef __cplusplus
extern "C" {
#endif

/// All zero is refused. Constant: it may stay in flash.
typedef struct dqw_estimator_q15_config {
    dqw_scale scale;
    uint32_t R_uohm, Ld_nH, Lq_nH, psi_nWb;  ///< nominal values to start from; 0: start from zero. Never a prior
    uint32_t stale_limit;                    ///< equal samples in a row before a sensor counts as stuck; 0: never
    uint32_t threshold_ppm;                  ///< residual over voltage that stage 3 must reach; 0: 50000 (5 %)
    uint16_t excitation_q15;                 ///< a block's input below this part of its full scale teaches nothing; 0: 66 (0.002)
    uint8_t half_window;                     ///< pairs in half a block, 1 .. 100; 0: 20. Dynamic only
    uint8_t read_blocks;                     ///< blocks between two readings; 0: 4. More cost less, and follow the first blocks later
    bool settled;                            ///< every sample is a settled point of its own: steady and standstill logs
#if DQW_EFFECT_WEIGHTS > 0
    const dqw_effect_q15_config *effects;  ///< electrical effects to learn as well; stays in use as long as the object. They need the pole pairs
    uint8_t effect_count;                  ///< their weights together <= DQW_EFFECT_WEIGHTS
#endif
} dqw_estimator_q15_config;

typedef struct dqw_estimator_q15 {
    const dqw_estimator_q15_config *config;
    dqw_gate gate;
    dqw_window_q15 window;
    dqw_axis_q15 d, q;
    dqw_stage stage;
    dqw_parameters_q15 parameters;  ///< as read last: after 1, 2, 4, 8 blocks, and as configured
    dqw_sample_q15 last;
    int32_t slope_least_q28;  ///< currents' steps below it teach nothing
    uint32_t events;          ///< all event bits since init
    bool has_last, last_good;
    // Handed to the background.
    bool pending;
    uint16_t weight, missed;  ///< of the block that waits; blocks lost because the background came too late, up to 65535
    int32_t sums[DQW_BLOCK_Q15_SIGNALS + 2 * DQW_EFFECT_WEIGHTS];
#if DQW_EFFECT_WEIGHTS > 0
    dqw_effect_q15 effect;
#endif
} dqw_estimator_q15;

/// Make an estimator.
///
/// Source   Fig. 3 with terminal signals; (E13) to (E22), (E70) in docs/EQUATIONS.md
/// Returns  DQW_OK; DQW_ERR_NULL, DQW_ERR_SIZE or DQW_ERR_RANGE, and then *e is untouched
/// Context  at start; the configuration stays in use as long as the object
enum dqw_status dqw_estimator_init_q15(dqw_estimator_q15 *e, const dqw_estimator_q15_config *config);

/// One sample. `saturated`: the inverter could not give the voltage of this sample, or a sensor is at its limit.
///
/// Source   (E13) to (E18) in docs/EQUATIONS.md
/// Format   Q15 of the full scales; s->v_d_q15, s->v_q_q15 as applied from this sample to the next
/// Range    any; beyond full scale (-32768, -32767, 32767) it is counted as saturated and not learned
/// Returns  DQW_EVENT_* bits of this step; DQW_EVENT_LEARNED: a block waits for dqw_estimator_background_q15
/// Cost     the table in README.md; no loop depends on data
/// Context  ISR safe; one writer per object
uint32_t dqw_estimator_step_q15(dqw_estimator_q15 *e, const dqw_sample_q15 *s, bool saturated);

/// Time has jumped: the next sample does not follow the last one.
/// Context  as dqw_estimator_step_q15
void dqw_estimator_gap_q15(dqw_estimator_q15 *e);

/// Learn the block that waits, if there is one; read after every so many. Must come before the next: every half_window periods.
///
/// Source   (E16) to (E18), (E21), (E70) in docs/EQUATIONS.md
/// Returns  DQW_EVENT_* bits: DQW_EVENT_LEARNED where it was learned
/// Context  background; dqw_estimator_step_q15 may interrupt it
uint32_t dqw_estimator_background_q15(dqw_estimator_q15 *e);

/// Read all that was learned until now.
/// Context  background; dqw_estimator_step_q15 may interrupt it
void dqw_estimator_read_q15(dqw_estimator_q15 *e);

#if DQW_EFFECT_WEIGHTS > 0
/// What was read last of the effect config->effects[index]: weights and their deviations, in the order of its law.
///
/// Source   (E18), (E50), (E75) in docs/EQUATIONS.md: one joint system with R, L_d, L_q and psi
/// Format   Q40 of the units that dqw_effect_restored_q40 names; a deviation of INT64_MAX: not known
/// Shape    weights_q40[], sd_q40[]: dqw_effect_weights() of the name, written
/// Returns  bit i set where weight i is known, as dqw_effect_known_q15; DQW_ERR_SIZE for an index out of range
/// Context  background
int dqw_estimator_effect_q15(const dqw_estimator_q15 *e, int index, int64_t weights_q40[], int64_t sd_q40[]);
#endif

#ifdef __cplusplus
}
#endif
#endif
