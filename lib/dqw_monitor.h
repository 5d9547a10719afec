// The condition monitor: the paper's Fig. 1 complete. Learns the healthy machine, then watches every parameter, says when one has
// changed, and which fault that is.
#ifndef DQW_MONITOR_H
#define DQW_MONITOR_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_fault.h"
#include "dqw_random.h"
#include "dqw_stage.h"
#include "dqw_tracker.h"
#include "dqw_watch.h"
#include "dqw_witness.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Memory that stage 2 borrows: free for other use once dqw_monitor_stage() says DQW_STAGE_ORDINAL or later. A firmware that lends none
/// carries no code for it.
typedef struct dqw_monitor_random {
    bool (*learn)(struct dqw_monitor_random *lent, const dqw_tracker *t);
    dqw_random random;
    dqw_learner coarse;
    dqw_random_sample reservoir[50];
} dqw_monitor_random;

/// Make stage 2's memory ready to be lent: 50 rows, as the paper's 50 samples.
///
/// Source   section 4.2 of the paper; (E8) in docs/EQUATIONS.md
/// Context  before dqw_monitor_init and dqw_monitor_define
void dqw_monitor_random_init(dqw_monitor_random *lent);

/// All zero is refused. Constant: it may stay in flash. 0 takes the value in brackets.
typedef struct dqw_monitor_config {
    dqw_tracker_config tracker;  ///< nominal values. Give it a drift_per_sqrt_s, 0.01 is a good start, or it follows nothing
    /// A change by less is healthy. Of R, L_d, L_q, flux [0.04, 0.06, 0.06, 0.012] as part of the healthy value; dead time [0.005] as part of
    /// the voltage base; angle [0.02] rad; offset [0.01] as part of the current base; resistance and reactance of one phase against the others
    /// [0.03, 0.03]; shorted turns' conductance times R [0.003]; friction [0.05] as part of the torque at the current base; winding above
    /// cold [110] K; residual against the healthy one [3]
    float band[DQW_WATCH_CHANNELS];
    float alpha_per_K;       ///< of the winding's resistance [0.0039]
    float beta_per_K;        ///< of the magnet's flux, as a positive fall [0.001]
    float heating_K_s;       ///< the fastest healthy heating or cooling [1]
    float J_kgm2;            ///< inertia; 0: friction is not watched
    uint32_t threshold_ppm;  ///< residual over the voltage base that stage 3 must reach [50000: 5 %]
    bool commissioned;       ///< the tracker's nominal values were measured on this machine, cold: temperatures count from them
} dqw_monitor_config;

/// One event.
typedef struct dqw_monitor_event {
    uint32_t half;   ///< halves of a window since init: times half_window * dt_s it is the time
    uint32_t since;  ///< the same, when the change began to show: in looks of 16 learned blocks, 255 at most; later than true where blocks were lost
    enum dqw_monitor_channel parameter;
    float value, sd;  ///< of the parameter, SI
    dqw_fault_verdict fault;
} dqw_monitor_event;

typedef struct dqw_monitor {
    dqw_tracker tracker;  ///< its configuration is the first part of the monitor's
    dqw_witness witness;
    dqw_stage stage;
    dqw_monitor_random *lent;
    float healthy[DQW_TRACK_WEIGHTS];  ///< SI; R and flux follow the temperature
    float healthy_re[DQW_WITNESS_INPUTS], healthy_im[DQW_WITNESS_INPUTS];
    float cold_R_ohm, cold_psi_Wb, hottest_K;  ///< where they may follow from, and the winding's highest rise, slowly forgotten
    float residual_pu2, healthy_residual_pu2;
    // Friction: mean over reversals, its variance, the healthy one; the mean torque being gathered, and that before it.
    float friction_Nm, spread_Nm2, healthy_friction_Nm, w_before_rad_s, gathered_Nm, before_Nm;
    dqw_watch watch;
} dqw_monitor;

/// Make a monitor. `lent` from dqw_monitor_random_init, or NULL: the nominal values then stand for stage 2's result.
///
/// Source   Fig. 1; (E21), (E60) to (E65) in docs/EQUATIONS.md
/// Returns  DQW_OK; DQW_ERR_NULL, DQW_ERR_SIZE or DQW_ERR_RANGE, and then *m is untouched
/// Context  at start; the configuration stays in use as long as the object, `lent` through stage 2
enum dqw_status dqw_monitor_init(dqw_monitor *m, const dqw_monitor_config *config, dqw_monitor_random *lent);

/// One PWM period.
///
/// Returns  DQW_EVENT_* bits; DQW_EVENT_LEARNED: a block waits for dqw_monitor_background
/// Cost     docs/firmware.md; no loop depends on data
/// Context  ISR safe; one writer per object
uint32_t dqw_monitor_sample(dqw_monitor *m, const dqw_sample *s, bool saturated);

/// The slow part: learn the block that waits, watch, name.
///
/// Source   (E60) to (E65) in docs/EQUATIONS.md
/// Returns  true where there is an event; *event is written then
/// Cost     docs/firmware.md. Must run at least every half_window periods
/// Context  background; dqw_monitor_sample may interrupt it
bool dqw_monitor_background(dqw_monitor *m, dqw_monitor_event *event);

/// The configuration in use.
const dqw_monitor_config *dqw_monitor_config_of(const dqw_monitor *m);

/// Where Fig. 1 is; and stage 1 again after a way back: with what the domain knowledge had lacked, all learned anew.
/// Context  background; hold the interrupt back during dqw_monitor_define
enum dqw_stage_name dqw_monitor_stage(const dqw_monitor *m);
enum dqw_status dqw_monitor_define(dqw_monitor *m, const dqw_monitor_config *config, dqw_monitor_random *lent);

#ifdef __cplusplus
}
#endif
#endif
