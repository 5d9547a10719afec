// Full scales: what the fixed-point numbers stand for. A signal is x_q15 * full / 32768.
#ifndef DQW_SCALE_H
#define DQW_SCALE_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_size.h"
#include "dqw_status.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Terminal signals of one row, as dqw_sample. Of voltages, currents and speed -32768, -32767 and 32767 count as beyond the full scale.
typedef struct dqw_sample_q15 {
    int16_t v_d_q15, v_q_q15;  ///< of v_full
    int16_t i_d_q15, i_q_q15;  ///< of i_full
    int16_t w_m_q15;           ///< of w_full
    uint16_t theta_e_turn;     ///< electrical angle, 65536 a turn
#if DQW_EFFECT_WEIGHTS > 0
    int16_t temp_winding_cC, temp_magnet_cC;  ///< hundredths of a degree; INT16_MIN: no number. Read only where an effect needs it
#endif
} dqw_sample_q15;

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

/// Is a sample beyond the full scale?
static inline bool dqw_scale_beyond(int16_t x_q15)
{
    return x_q15 > DQW_SCALE_MOST_Q15 || x_q15 < -DQW_SCALE_MOST_Q15;
}

/// Parameters per unit of the full scales: R in v/i, L in v dt/i, flux in v dt. Q40, bounded to 62 bits.
int64_t dqw_scale_R_q40(const dqw_scale *scale, uint32_t R_uohm);
int64_t dqw_scale_L_q40(const dqw_scale *scale, uint32_t L_nH);
int64_t dqw_scale_psi_q40(const dqw_scale *scale, uint32_t psi_nWb);

/// May these be full scales?
///
/// Returns  DQW_OK; DQW_ERR_NULL, or DQW_ERR_RANGE where a value is outside the range that stands beside it
/// Context  at start
enum dqw_status dqw_scale_check(const dqw_scale *scale);

#ifdef __cplusplus
}
#endif
#endif
