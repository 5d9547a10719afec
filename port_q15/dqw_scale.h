// Full scales: what the fixed-point numbers stand for. A signal is x_q15 * full / 32768.
#ifndef DQW_SCALE_H
#define DQW_SCALE_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_sample_q15.h"
#include "dqw_size.h"
#include "dqw_status.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Full scales, from nameplate values: what no signal reaches, the nearer the better.
typedef struct dqw_scale {
    uint32_t v_full_mV;      ///< 1 .. DQW_SCALE_MAX
    uint32_t i_full_mA;      ///< 1 .. DQW_SCALE_MAX
    uint32_t w_full_mrad_s;  ///< mechanical speed, 1 .. DQW_SCALE_MAX
    uint32_t dt_ns;          ///< sampling period, 1 .. 10^9
    uint16_t pole_pairs;     ///< 0: not known
} dqw_scale;

/// 10 kV, 10 kA, 10^4 rad/s.
#define DQW_SCALE_MAX 10000000u

/// The largest sample within the full scale.
#define DQW_SCALE_MOST_Q15 32766

/// Are these the cosine and sine of one angle, within what a sensor's amplitude leaves open?
static inline bool dqw_scale_is_direction(int16_t cosine_q15, int16_t sine_q15)
{
    // 0.9 and 1.1 in Q30
    const uint32_t square = (uint32_t)(cosine_q15 * cosine_q15) + (uint32_t)(sine_q15 * sine_q15);
    return square > 966367642u && square < 1181116006u;
}

/// Is a sample beyond the full scale?
static inline bool dqw_scale_beyond(int16_t x_q15)
{
    return (uint32_t)(x_q15 + DQW_SCALE_MOST_Q15) > 2u * DQW_SCALE_MOST_Q15;
}

/// Parameters per unit of the full scales: R in v/i, L in v dt/i, flux in v dt. Q40, bounded to 62 bits.
int64_t dqw_scale_R_q40(const dqw_scale *scale, uint32_t R_uohm);
int64_t dqw_scale_L_q40(const dqw_scale *scale, uint32_t L_nH);
int64_t dqw_scale_psi_q40(const dqw_scale *scale, uint32_t psi_nWb);

/// May these be full scales?
///
/// Returns  DQW_OK; DQW_ERR_NULL, or the field whose value is outside the range that stands beside it
/// Context  at start
enum dqw_status dqw_scale_check(const dqw_scale *scale);

#ifdef __cplusplus
}
#endif
#endif
