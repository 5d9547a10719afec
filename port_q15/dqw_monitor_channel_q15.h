// For the monitor's own files: its channels.
#ifndef DQW_MONITOR_CHANNEL_Q15_H
#define DQW_MONITOR_CHANNEL_Q15_H

#include "dqw_monitor_q15.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Slack on rates and rises of temperature.
#define DQW_MONITOR_SLACK_TENTHS 13

/// A channel's value, its change from the healthy one, and its deviation, INT32_MAX where it is not known: Q24 of its
/// unit; temperature Q16 K.
typedef struct dqw_monitor_channel_q15 {
    int32_t now, change, sd;
} dqw_monitor_channel_q15;

/// As configured, or usual.
static inline uint32_t dqw_monitor_or_else(uint32_t configured, uint32_t usual)
{
    return configured != 0 ? configured : usual;
}

/// A channel's band; and in the format of its reading.
#define dqw_monitor_band_q24 DQW_SIZED(dqw_monitor_band_q24)
int64_t dqw_monitor_band_q24(const dqw_monitor_q15 *m, int channel);
int32_t dqw_monitor_band_of_q15(const dqw_monitor_q15 *m, int channel);
int64_t dqw_monitor_alpha_ppm(const dqw_monitor_q15 *m);
int64_t dqw_monitor_beta_ppm(const dqw_monitor_q15 *m);

/// The winding's rise above cold, Q16 K, where its resistance is this.
int32_t dqw_monitor_rise_q16(const dqw_monitor_q15 *m, int32_t R_q24);

/// What heat may have made of R or the flux since its healthy value last followed, Q24.
int32_t dqw_monitor_heat_since_q24(const dqw_monitor_q15 *m, int channel);
/// Is the value of R known to its band? What its change is sure of is no temperature.
bool dqw_monitor_knows_heat_q15(const dqw_monitor_q15 *m);

/// Of temperature and residual the change is the value.
void dqw_monitor_read_channel_q15(const dqw_monitor_q15 *m, int channel, dqw_monitor_channel_q15 *r);

/// Size of a ripple's weight, of the witness or healthy.
int32_t dqw_monitor_ripple_q24(const int32_t re_q28[], const int32_t im_q28[], int channel);

/// The change of a channel that counts: its band, or five deviations of the change, in the format of its reading; for a
/// deviation that is known.
/// Source   (E63) in docs/EQUATIONS.md
int64_t dqw_monitor_surely_q15(const dqw_monitor_q15 *m, int channel, int32_t deviation);

/// The healthy value by one part in n nearer to the present one: 1 takes it over.
void dqw_monitor_move_healthy_q15(dqw_monitor_q15 *m, int channel, int n);

/// So much of a cold value, which is 1 and `more`; and what the magnet loses where the winding's rise is this, and half
/// a band.
int32_t dqw_monitor_of_cold_q24(int32_t cold_q24, int64_t more_q24);
int64_t dqw_monitor_flux_lost_q24(const dqw_monitor_q15 *m, int64_t rise_q16);

/// On entering service after a restore: healthy R and flux as far from what was stored as heat explains.
/// Source   (E94) in docs/EQUATIONS.md
void dqw_monitor_enter_as_stored_q15(dqw_monitor_q15 *m);

/// The residual's limit, Q24 of the full voltage.
int32_t dqw_monitor_residual_limit_q24(const dqw_monitor_q15 *m);

/// In the format of a reading.
int64_t dqw_monitor_q40_of(int channel, int32_t x);

#ifdef __cplusplus
}
#endif
#endif
