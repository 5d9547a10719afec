// For the monitor's own files: its channels.
#ifndef DQW_MONITOR_CHANNEL_H
#define DQW_MONITOR_CHANNEL_H

#include "dqw_monitor.h"
#include "dqw_watch.h"
#include "dqw_witness.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Slack on rates and rises of temperature.
#define DQW_MONITOR_SLACK 1.3f

/// As configured, or usual; and a channel's band in its own unit.
#define dqw_monitor_band DQW_SIZED(dqw_monitor_band)
float dqw_monitor_band(const dqw_monitor *m, int channel);
float dqw_monitor_band_of(const dqw_monitor *m, int channel);
float dqw_monitor_alpha(const dqw_monitor *m);
float dqw_monitor_beta(const dqw_monitor *m);

/// What heat may have made of R or the flux since its healthy value last followed, in its own unit.
float dqw_monitor_heat_since(const dqw_monitor *m, int channel);

/// The winding's rise above cold, K, where its resistance is this.
float dqw_monitor_rise_K(const dqw_monitor *m, float R_ohm);

/// Is the value of R known to its band? What its change is sure of is no temperature.
bool dqw_monitor_knows_heat(const dqw_monitor *m);

/// A channel's value, its change from the healthy one, and its deviation.
typedef struct dqw_monitor_channel_value {
    float now, change, sd;
} dqw_monitor_channel_value;

/// Of temperature and residual the change is the value.
#define dqw_monitor_read_channel DQW_SIZED(dqw_monitor_read_channel)
void dqw_monitor_read_channel(const dqw_monitor *m, int channel, dqw_monitor_channel_value *r);

/// Size of a ripple's weight, of the witness or healthy.
float dqw_monitor_ripple(const float re[], const float im[], int channel);

/// The change of a channel that counts: its band, or five deviations of the change, in its own unit.
/// Source   (E63) in docs/EQUATIONS.md
float dqw_monitor_surely(const dqw_monitor *m, int channel, float deviation);

/// The healthy value as far from the present one as `keep` says: 0 takes it over.
void dqw_monitor_move_healthy(dqw_monitor *m, int channel, float keep);

#ifdef __cplusplus
}
#endif
#endif
