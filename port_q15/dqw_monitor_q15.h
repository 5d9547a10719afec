// The condition monitor in whole numbers: the paper's Fig. 1 complete. It measures here, and decides in dqw_watch and
// dqw_stage, as the monitor in float does.
#ifndef DQW_MONITOR_Q15_H
#define DQW_MONITOR_Q15_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_estimator_q15.h"
#include "dqw_fault_q15.h"
#include "dqw_nameplate_q15.h"
#include "dqw_reading_q15.h"
#include "dqw_stage.h"
#include "dqw_watch.h"
#include "dqw_why.h"
#include "dqw_witness_q15.h"

#ifdef __cplusplus
extern "C" {
#endif

/// All zero is refused. Constant: it may stay in flash. 0 takes the value in brackets. dqw_monitor_config_default_q15()
/// fills it from a nameplate.
typedef struct dqw_monitor_q15_config {
    /// pole pairs are needed. Let it follow, or it learns of no change
    dqw_estimator_q15_config estimator;
    /// A change by less is healthy, in millionths. Of R, L_d, L_q, flux [40000, 60000, 60000, 12000] and a flux map's
    /// weights [60000] of the healthy value; dead time [5000] of the full voltage; angle [20000] rad; offset [10000] of
    /// the full current; resistance and reactance of one phase against the others [30000, 30000]; shorted turns'
    /// conductance times R [3000]; friction [50000] of the torque at the full current; winding above cold [110 K, as
    /// 110000000]; residual against the healthy one [3, as 3000000]
    uint32_t band_ppm[DQW_WATCH_CHANNELS];
    uint32_t alpha_ppm_per_K;  ///< of the winding's resistance, up to 10^6 [3900]
    uint32_t beta_ppm_per_K;   ///< of the magnet's flux, as a positive fall, up to 10^6 [1000]
    /// the fastest heating or cooling, of an overload too, up to 10^6 [1000]: what of R is more than a band
    /// faster than 1.3 times it is no temperature
    uint32_t heating_mK_s;
    uint32_t J_nkgm2;  ///< inertia; 0: friction is not watched
    /// a healthy residual counts as at least this part of the full voltage, up to 10^6 [2000]
    uint32_t residual_floor_ppm;
    /// the estimator's nominal values were measured on this machine, cold: temperatures count from them
    bool commissioned;
} dqw_monitor_q15_config;

/// What has changed. Times in samples since init; values as dqw_monitor_read_q15() has them.
typedef struct dqw_monitor_change_q15 {
    uint64_t sample;  ///< when it was named
    /// when it began to show: in looks of 16 learned blocks, 255 at most; later than true where blocks were lost
    uint64_t since;
    enum dqw_monitor_channel parameter;  ///< the one furthest out of its band; need not be the fault's own
    int64_t value_q40, sd_q40;           ///< as dqw_monitor_read_q15() has them
    int64_t healthy_q40;                 ///< what it was before; of temperature and residual the limit
    dqw_fault_verdict_q15 fault;         ///< which, and how sure
} dqw_monitor_change_q15;

/// What was learned as healthy.
typedef struct dqw_monitor_healthy_q15 {
    int64_t residual_q54;                  ///< of the full voltage, squared
    int32_t weight_q24[DQW_WATCH_OFFSET];  ///< R and flux follow the temperature
    int32_t re_q28[DQW_WITNESS_INPUTS], im_q28[DQW_WITNESS_INPUTS];
    /// where they may follow from, and the winding's highest rise, K, slowly forgotten
    int32_t cold_R_q24, cold_psi_q24, hottest_q16;
    int32_t friction_q24;  ///< of the torque at the flux's unit and full current
} dqw_monitor_healthy_q15;

/// A motor's monitor, in whole numbers.
typedef struct dqw_monitor_q15 {
    const dqw_monitor_q15_config *config;
    uint32_t named_at;  ///< when a change was named last, in halves of a window
    dqw_monitor_healthy_q15 healthy;
    // Friction, in the same unit: its variance over reversals, their mean; the mean torque being gathered, and that
    // before it.
    int64_t spread_q48;
    int32_t friction_q24, w_before_q28, gathered_q24, before_q24;
    dqw_watch watch;
    // The change that was named last, as dqw_monitor_event_q15() tells it.
    int32_t named_value, named_sd, named_healthy;
    dqw_fault_verdict_q15 named_fault;
    uint16_t alarmed_segments;           ///< had ended when something began to show
    uint8_t named_channel, named_looks;  ///< looks since it began to show
    bool has_change;
    bool restored;  ///< healthy values came from a store
    dqw_witness_q15 witness;
    dqw_estimator_q15 estimator;  ///< last, so that what stands before it is in reach of short instructions
} dqw_monitor_q15;

/// A configuration for a machine of which no more than the nameplate is known; nominal values, bands and the like may
/// be set in it. Full scales are half as much again as rated; what counts as part of them is as in
/// dqw_monitor_config_default(), part of what is rated.
///
/// Source   (E80) in docs/EQUATIONS.md for half_window
/// Returns  a configuration that init takes, where the nameplate's values are positive, the pole pairs known, and its
///          speed turns less than 2/3 rad in a period, electrical; without a nameplate one that init refuses
/// Context  at start
dqw_monitor_q15_config dqw_monitor_config_default_q15(const dqw_nameplate_q15 *plate);

/// Make a monitor.
///
/// Source   Fig. 1; (E21), (E60) to (E65) in docs/EQUATIONS.md
/// Returns  DQW_OK; else which field was refused, and then *m is untouched
/// Context  at start; the configuration stays in use as long as the object
#define dqw_monitor_init_q15 DQW_SIZED(dqw_monitor_init_q15)
enum dqw_status dqw_monitor_init_q15(dqw_monitor_q15 *m, const dqw_monitor_q15_config *config);

/// Stage 1 again, after a way back: with what the domain knowledge had lacked, as a trace wrote it; all learned anew.
/// What was counted stays.
///
/// Source   Fig. 1; (E21) in docs/EQUATIONS.md
/// Returns  as dqw_monitor_init_q15; on an error the old monitor goes on
/// Context  background; hold the interrupt back
enum dqw_status dqw_monitor_define_q15(dqw_monitor_q15 *m, const dqw_monitor_q15_config *config);

/// One PWM period. `saturated`: the inverter could not give the voltage of this sample, or a sensor is at its limit.
///
/// Format   Q15 of the full scales
/// Range    any; what cannot be learned is skipped and counted in m->estimator.gate
/// Returns  DQW_EVENT_* bits; DQW_EVENT_BLOCK: a block waits for dqw_monitor_background_q15
/// Cost     docs/firmware.md; no loop depends on data
/// Context  interrupt; one writer per object
#define dqw_monitor_sample_q15 DQW_SIZED(dqw_monitor_sample_q15)
uint32_t dqw_monitor_sample_q15(dqw_monitor_q15 *m, const dqw_sample_q15 *s, bool saturated);

/// There is no sample in this period, or in these: as dqw_estimator_missing_q15.
/// Context  as dqw_monitor_sample_q15
void dqw_monitor_missing_q15(dqw_monitor_q15 *m, uint32_t periods);

/// The slow part: learn the block that waits, watch, name. Must run at least every half_window periods.
///
/// Source   (E60) to (E65) in docs/EQUATIONS.md
/// Returns  true where something has changed: dqw_monitor_event_q15() says what
/// Cost     rows, dqw_normal_add_q15 twice, a solution every solve_blocks, the witness; a look every 16 blocks
/// Context  background; dqw_monitor_sample_q15 may interrupt it anywhere
#define dqw_monitor_background_q15 DQW_SIZED(dqw_monitor_background_q15)
bool dqw_monitor_background_q15(dqw_monitor_q15 *m);

/// What has changed, once for each change: the last one, if nobody asked in time.
///
/// Returns  true where *change was written
/// Context  background
bool dqw_monitor_event_q15(dqw_monitor_q15 *m, dqw_monitor_change_q15 *change);

/// A channel's value as it is now, and how sure it is.
///
/// Source   (E20), (E61), (E62) in docs/EQUATIONS.md
/// Format   Q40 of dqw_estimator_unit_q15() for a parameter, of 1 for a flux map's weight, of dqw_witness_input_q15's
///          unit for one of the witness, of the torque at the flux's unit and full current for friction, of the full
///          voltage for the residual; Q40 K above cold for the temperature
/// Range    not usable, and sd INT64_MAX, where it is not known
/// Context  background
dqw_reading_q15 dqw_monitor_read_q15(const dqw_monitor_q15 *m, enum dqw_monitor_channel channel);

/// The smallest change of a channel that would be an event now, in the format of its reading: its band, or five
/// deviations, and a quarter more, within which it is a matter of chance.
///
/// Source   (E63) in docs/EQUATIONS.md
/// Returns  INT64_MAX where it is not watched now
/// Context  background
int64_t dqw_monitor_sensitivity_q15(const dqw_monitor_q15 *m, enum dqw_monitor_channel channel);

/// Why a channel is not watched now. One that is DQW_WHY_COARSE has a sensitivity, so large that no fault reaches it:
/// above 0.3 of healthy R, L_d, L_q, flux or a map's weight, of the others ten times their usual band.
///
/// Returns  DQW_WHY_IN_SERVICE where it is watched; as dqw_monitor_why_q15 where nothing is
/// Context  background
enum dqw_why dqw_monitor_unwatched_q15(const dqw_monitor_q15 *m, enum dqw_monitor_channel channel);

/// Where Fig. 1 is, and why it is not in service or watches nothing now.
/// Source   Fig. 1; (E21) in docs/EQUATIONS.md
/// Context  background
enum dqw_stage_name dqw_monitor_stage_q15(const dqw_monitor_q15 *m);
enum dqw_why dqw_monitor_why_q15(const dqw_monitor_q15 *m);

/// What was learned as healthy, to outlive a power cycle: a plain struct, for flash or a file of the same machine.
typedef struct dqw_monitor_stored_q15 {
    uint32_t version;  ///< of this struct
    uint32_t config;   ///< hash of the configuration
    dqw_monitor_healthy_q15 healthy;
    uint8_t looks[DQW_WATCH_TEMPERATURE];  ///< that each healthy value is the mean of
    uint8_t unused[8 - (DQW_WATCH_TEMPERATURE + 4) % 8];
    uint32_t check;  ///< sum over all that stands before it
} dqw_monitor_stored_q15;

/// Take what was learned as healthy.
///
/// Returns  false before the monitor was in service with healthy values that stand, and then *stored is untouched
/// Context  background
#define dqw_monitor_store_q15 DQW_SIZED(dqw_monitor_store_q15)
bool dqw_monitor_store_q15(const dqw_monitor_q15 *m, dqw_monitor_stored_q15 *stored);

/// Give it back, after init and before the first sample: on entering service the machine is compared with it, so that
/// what has changed meanwhile is an event. R and flux may differ by what heat explains.
///
/// Returns  DQW_OK; DQW_ERR_NULL, DQW_ERR_STORE_VERSION, DQW_ERR_STORE_DAMAGED, DQW_ERR_STORE_CONFIG where it was
///          written with other full scales, nominal values or effects: then *m is as it was
/// Context  at start
#define dqw_monitor_restore_q15 DQW_SIZED(dqw_monitor_restore_q15)
enum dqw_status dqw_monitor_restore_q15(dqw_monitor_q15 *m, const dqw_monitor_stored_q15 *stored);

#ifdef __cplusplus
}
#endif
#endif
