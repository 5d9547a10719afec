// The condition monitor: the paper's Fig. 1 complete. Learns the healthy machine, then watches every parameter, says
// when one has changed, and which fault that is.
#ifndef DQW_MONITOR_H
#define DQW_MONITOR_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_estimator.h"
#include "dqw_nameplate.h"
#include "dqw_parts.h"
#include "dqw_reading.h"
#include "dqw_why.h"

#ifdef __cplusplus
extern "C" {
#endif

/// All zero is refused. Constant: it may stay in flash. 0 takes the value in brackets. dqw_monitor_config_default()
/// fills it from a nameplate.
typedef struct dqw_monitor_config {
    /// pole pairs are needed. Let it follow, or it learns of no change
    dqw_estimator_config estimator;
    /// A change by less is healthy. Of R, L_d, L_q, flux [0.04, 0.06, 0.06, 0.012] and a flux map's weights [0.06] as
    /// part of the healthy value; dead time [0.005] as part of the voltage base; angle [0.02] rad; offset [0.01] as part
    /// of the current base; resistance and reactance of one phase against the others [0.03, 0.03]; shorted turns'
    /// conductance times R [0.003]; friction [0.05] as part of the torque at the current base; winding above cold [110]
    /// K; residual against the healthy one [3]
    float band[DQW_WATCH_CHANNELS];
    float alpha_per_K;  ///< of the winding's resistance [0.0039]
    float beta_per_K;   ///< of the magnet's flux, as a positive fall [0.001]
    /// the fastest heating or cooling [1], of an overload too: what of R is more than a band faster than 1.3 times it is
    /// no temperature
    float heating_K_s;
    float J_kgm2;  ///< inertia; 0: friction is not watched
    /// the estimator's nominal values were measured on this machine, cold: temperatures count from them
    bool commissioned;
} dqw_monitor_config;

/// What has changed. Times in samples since init.
typedef struct dqw_monitor_change {
    uint64_t sample;  ///< when it was named
    /// when it began to show: in looks of 16 learned blocks, 255 at most; later than true where blocks were lost
    uint64_t since;
    enum dqw_monitor_channel parameter;  ///< the one furthest out of its band; need not be the fault's own
    float value, sd;                     ///< SI
    float healthy;                       ///< what it was before; of temperature and residual the limit
    dqw_fault_verdict fault;             ///< which, and how sure
} dqw_monitor_change;

/// What was learned as healthy.
typedef struct dqw_monitor_healthy {
    float weight[DQW_WATCH_OFFSET];  ///< SI; R and flux follow the temperature
    float re[DQW_WITNESS_INPUTS], im[DQW_WITNESS_INPUTS];
    /// where they may follow from, and the winding's highest rise, slowly forgotten
    float cold_R_ohm, cold_psi_Wb, hottest_K;
    float residual_pu2, friction_Nm;
} dqw_monitor_healthy;

/// A motor's monitor.
typedef struct dqw_monitor {
    const dqw_monitor_config *config;
    dqw_monitor_healthy healthy;
    // Friction: mean over reversals, its variance; the mean torque being gathered, and that before it.
    float friction_Nm, spread_Nm2, w_before_rad_s, gathered_Nm, before_Nm;
    dqw_watch watch;
    // The change that was named last, as dqw_monitor_event() tells it; times in halves of a window.
    uint32_t named_at, named_since;
    float named_value, named_sd, named_healthy;
    dqw_fault_verdict named_fault;
    uint16_t alarmed_segments;  ///< had ended when something began to show
    uint8_t named_channel;
    bool has_change;
    void (*enter_as_stored)(
        struct dqw_monitor *m);  ///< healthy values came from a store, which a firmware without one carries no code for
    dqw_witness witness;
    dqw_estimator estimator;  ///< last, so that what stands before it is in reach of short instructions
} dqw_monitor;

/// A configuration for a machine of which no more than the nameplate is known; nominal values, bands and the like may
/// be set in it.
///
/// Source   (E80) in docs/EQUATIONS.md for half_window
/// Returns  a configuration that init takes, where the nameplate's values are positive and the pole pairs known
/// Context  at start
dqw_monitor_config dqw_monitor_config_default(const dqw_nameplate *plate);

/// Make a monitor.
///
/// Source   Fig. 1; (E21), (E60) to (E65) in docs/EQUATIONS.md
/// Returns  DQW_OK; else which field was refused, and then *m is untouched
/// Context  at start; the configuration stays in use as long as the object
#define dqw_monitor_init DQW_SIZED(dqw_monitor_init)
enum dqw_status dqw_monitor_init(dqw_monitor *m, const dqw_monitor_config *config);

/// Stage 1 again, after a way back: with what the domain knowledge had lacked, as a trace wrote it; all learned anew.
/// What was counted stays.
///
/// Source   Fig. 1; (E21) in docs/EQUATIONS.md
/// Returns  as dqw_monitor_init; on an error the old monitor goes on
/// Context  background; hold the interrupt back
enum dqw_status dqw_monitor_define(dqw_monitor *m, const dqw_monitor_config *config);

/// One PWM period. `saturated`: the inverter could not give the voltage of this sample, or a sensor is at its limit.
///
/// Units    SI
/// Range    any float; what cannot be learned is skipped and counted in m->estimator.gate
/// Returns  DQW_EVENT_* bits; DQW_EVENT_BLOCK: a block waits for dqw_monitor_background
/// Cost     docs/firmware.md; no loop depends on data
/// Context  interrupt; one writer per object
#define dqw_monitor_sample DQW_SIZED(dqw_monitor_sample)
uint32_t dqw_monitor_sample(dqw_monitor *m, const dqw_sample *s, bool saturated);

/// There is no sample in this period, or in these: as dqw_estimator_missing.
/// Context  as dqw_monitor_sample
void dqw_monitor_missing(dqw_monitor *m, uint32_t periods);

/// The slow part: learn the block that waits, watch, name. Must run at least every half_window periods.
///
/// Source   (E60) to (E65) in docs/EQUATIONS.md
/// Returns  true where something has changed: dqw_monitor_event() says what
/// Cost     docs/firmware.md
/// Context  background; dqw_monitor_sample may interrupt it anywhere
#define dqw_monitor_background DQW_SIZED(dqw_monitor_background)
bool dqw_monitor_background(dqw_monitor *m);

/// What has changed, once for each change: the last one, if nobody asked in time.
///
/// Returns  true where *change was written
/// Context  background
bool dqw_monitor_event(dqw_monitor *m, dqw_monitor_change *change);

/// A channel's value as it is now, and how sure it is.
///
/// Source   (E20), (E61), (E62) in docs/EQUATIONS.md
/// Units    SI; angle in Wb of flux on the other axis; temperature in K above cold; residual in V
/// Range    not usable, and sd DQW_UNKNOWN, where it is not known
/// Context  background
dqw_reading dqw_monitor_read(const dqw_monitor *m, enum dqw_monitor_channel channel);

/// The smallest change of a channel that would be an event now, in its unit, in 95 of 100 and within a few seconds: its
/// band, or five deviations, a quarter more, what heat may have made of it, and what segments of driving tell.
///
/// Source   (E63), (E178) in docs/EQUATIONS.md
/// Returns  DQW_UNKNOWN where it is not watched now
/// Context  background
float dqw_monitor_sensitivity(const dqw_monitor *m, enum dqw_monitor_channel channel);

/// Why a channel is not watched now. One that is DQW_WHY_COARSE has a sensitivity, so large that no fault reaches it:
/// above 0.3 of healthy R, L_d, L_q, flux or a map's weight, of the others ten times their usual band.
///
/// Returns  DQW_WHY_IN_SERVICE where it is watched; as dqw_monitor_why where nothing is
/// Context  background
enum dqw_why dqw_monitor_unwatched(const dqw_monitor *m, enum dqw_monitor_channel channel);

/// Where Fig. 1 is, and why it is not in service or watches nothing now.
/// Source   Fig. 1; (E21) in docs/EQUATIONS.md
/// Context  background
enum dqw_stage_name dqw_monitor_stage(const dqw_monitor *m);
enum dqw_why dqw_monitor_why(const dqw_monitor *m);

/// What was learned as healthy, to outlive a power cycle: a plain struct, for flash or a file of the same machine.
typedef struct dqw_monitor_stored {
    uint32_t version;  ///< of this struct
    uint32_t config;   ///< hash of the configuration
    dqw_monitor_healthy healthy;
    uint8_t looks[DQW_WATCH_TEMPERATURE];  ///< that each healthy value is the mean of
    uint8_t unused[4 - DQW_WATCH_TEMPERATURE % 4];
    uint32_t check;  ///< sum over all that stands before it
} dqw_monitor_stored;

/// Take what was learned as healthy.
///
/// Returns  false before the monitor was in service with healthy values that stand, and then *stored is untouched
/// Context  background
#define dqw_monitor_store DQW_SIZED(dqw_monitor_store)
bool dqw_monitor_store(const dqw_monitor *m, dqw_monitor_stored *stored);

/// Give it back, after init and before the first sample: on entering service the machine is compared with it, so that
/// what has changed meanwhile is an event. R and flux may differ by what heat explains.
///
/// Returns  DQW_OK; DQW_ERR_NULL, DQW_ERR_STORE_VERSION, DQW_ERR_STORE_DAMAGED, DQW_ERR_STORE_CONFIG where it was
///          written with other bases, nominal values or effects: then *m is as it was
/// Context  at start
#define dqw_monitor_restore DQW_SIZED(dqw_monitor_restore)
enum dqw_status dqw_monitor_restore(dqw_monitor *m, const dqw_monitor_stored *stored);

#ifdef __cplusplus
}
#endif
#endif
