// The condition monitor in whole numbers: the paper's Fig. 1 complete. It measures here, and decides in dqw_watch and dqw_stage, as the
// monitor in float does.
#ifndef DQW_MONITOR_Q15_H
#define DQW_MONITOR_Q15_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_fault_q15.h"
#include "dqw_stage.h"
#include "dqw_estimator_q15.h"
#include "dqw_watch.h"
#include "dqw_witness_q15.h"

#ifdef __cplusplus
extern "C" {
#endif

/// All zero is refused. Constant: it may stay in flash. 0 takes the value in brackets.
typedef struct dqw_monitor_q15_config {
    dqw_estimator_q15_config estimator;  ///< pole pairs given. Give it drift_ppm, 10000 is a good start, or it follows nothing
    /// A change by less is healthy, in millionths. Of R, L_d, L_q, flux [40000, 60000, 60000, 12000] of the healthy value; dead time [5000] of the
    /// full voltage; angle [20000] rad; offset [10000] of the full current; resistance and reactance of one phase against the others
    /// [30000, 30000]; shorted turns' conductance times R [3000]; friction [50000] of the torque at the full current; winding above cold
    /// [110 K, as 110000000]; residual against the healthy one [3, as 3000000]
    uint32_t band_ppm[DQW_WATCH_CHANNELS];
    uint32_t alpha_ppm_per_K;     ///< of the winding's resistance, up to 10^6 [3900]
    uint32_t beta_ppm_per_K;      ///< of the magnet's flux, as a positive fall, up to 10^6 [1000]
    uint32_t heating_mK_s;        ///< the fastest healthy heating or cooling, up to 10^6 [1000]
    uint32_t J_nkgm2;             ///< inertia; 0: friction is not watched
    uint32_t residual_floor_ppm;  ///< a healthy residual counts as at least this part of the full voltage, up to 10^6 [2000]
    bool commissioned;            ///< the estimator's nominal values were measured on this machine, cold: temperatures count from them
} dqw_monitor_q15_config;

/// One event. value, sd: Q24 of dqw_estimator_unit_q15() for a parameter, of dqw_witness_input_q15 for one of the witness, of the
/// torque at the flux's unit and full current for friction, of the full voltage for the residual; Q16 K for the temperature.
typedef struct dqw_monitor_event_q15 {
    uint32_t half;   ///< halves of a window since init: times half_window * dt it is the time
    uint32_t since;  ///< the same, when the change began to show: in looks of 16 learned blocks, 255 at most; later than true where blocks were lost
    enum dqw_monitor_channel parameter;
    int32_t value, sd;
    dqw_fault_verdict_q15 fault;
} dqw_monitor_event_q15;

/// What it measures beside estimator and witness.
typedef struct dqw_monitor_measures_q15 {
    int32_t healthy_q24[DQW_PARAMETERS];  ///< R and flux follow the temperature
    int32_t healthy_re_q28[DQW_WITNESS_Q15_INPUTS], healthy_im_q28[DQW_WITNESS_Q15_INPUTS];
    int32_t cold_R_q24, cold_psi_q24, hottest_q16;  ///< where they may follow from, and the winding's highest rise, K, slowly forgotten
    int64_t healthy_residual_q54;                   ///< of the full voltage, squared
    // Friction, of the torque at the flux's unit and full current: mean over reversals, its variance, the healthy one; the mean torque being
    // gathered, and that before it.
    int64_t spread_q48;
    int32_t friction_q24, healthy_friction_q24, w_before_q28, gathered_q24, before_q24;
} dqw_monitor_measures_q15;

typedef struct dqw_monitor_q15 {
    dqw_estimator_q15 estimator;  ///< its configuration is the first part of the monitor's
    dqw_witness_q15 witness;
    dqw_monitor_measures_q15 is;
    dqw_watch watch;
} dqw_monitor_q15;

/// Make a monitor.
///
/// Source   Fig. 1; (E21), (E60) to (E65) in docs/EQUATIONS.md
/// Returns  DQW_OK; else which field was refused, and then *m is untouched
/// Context  at start; the configuration stays in use as long as the object
enum dqw_status dqw_monitor_init_q15(dqw_monitor_q15 *m, const dqw_monitor_q15_config *config);

/// One PWM period.
///
/// Returns  DQW_EVENT_* bits; DQW_EVENT_BLOCK: a block waits for dqw_monitor_background_q15
/// Cost     the table in README.md; no loop depends on data
/// Context  ISR safe; one writer per object
uint32_t dqw_monitor_sample_q15(dqw_monitor_q15 *m, const dqw_sample_q15 *s, bool saturated);

/// The slow part: learn the block that waits, watch, name.
///
/// Source   (E60) to (E65) in docs/EQUATIONS.md
/// Returns  true where there is an event; *event is written then
/// Cost     rows, dqw_normal_add_q15 twice, a solution every solve_blocks, the witness; a look every 16 blocks. Must run at least every half_window periods
/// Context  background; dqw_monitor_sample_q15 may interrupt it
bool dqw_monitor_background_q15(dqw_monitor_q15 *m, dqw_monitor_event_q15 *event);

/// The configuration in use.
const dqw_monitor_q15_config *dqw_monitor_config_of_q15(const dqw_monitor_q15 *m);

/// Where Fig. 1 is; and stage 1 again after a way back: with what the domain knowledge had lacked, all learned anew.
/// Context  background; hold the interrupt back during dqw_monitor_define_q15
enum dqw_stage_name dqw_monitor_stage_q15(const dqw_monitor_q15 *m);
enum dqw_status dqw_monitor_define_q15(dqw_monitor_q15 *m, const dqw_monitor_q15_config *config);

#ifdef __cplusplus
}
#endif
#endif
