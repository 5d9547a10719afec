// Effects of the shaft in whole numbers: the torque that one unit of each weight brings at a speed and a shaft angle.
#ifndef DQW_TORQUE_Q15_H
#define DQW_TORQUE_Q15_H

#include <stdint.h>

#include "dqw_effect_name.h"
#include "dqw_status.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Most weights of one effect.
#define DQW_TORQUE_Q15_WEIGHTS 2

/// An effect of the shaft. All zero is refused.
typedef struct dqw_torque_q15_config {
    enum dqw_effect_name effect;  ///< DQW_EFFECT_COULOMB_FRICTION or one behind it
    uint32_t width_urad_s;        ///< frictions: of tanh, from w_full / 8192 to 16 w_full
    uint32_t fall_urad_s;         ///< stribeck_friction: speed at which it has fallen to 1/e, in the same range
    uint16_t periods;             ///< cogging_torque: in a revolution, 1 .. 1000
    int32_t start_uNm[DQW_TORQUE_Q15_WEIGHTS];  ///< weights to start from. Never a prior
} dqw_torque_q15_config;

/// One effect made ready for a full scale of the speed.
typedef struct dqw_torque_q15 {
    uint32_t rate_q16;  ///< 2 w_full / (ln 2 width): |tanh| is of 2^-(rate |w|). < 2^31
    uint32_t fall_q15;  ///< w_full / (sqrt(ln 2) fall): the fall is 2^-(fall w)^2. < 2^29
    uint16_t periods;
    uint8_t effect;
} dqw_torque_q15;

/// Rate of a soft sign of this width.
///
/// Source   (E54) in docs/EQUATIONS.md
/// Format   Q16, for a speed in Q15 of w_full
/// Returns  0 for a width outside w_full / 8192 .. 16 w_full, and for a w_full beyond DQW_SCALE_MAX
/// Context  at start
uint32_t dqw_soft_rate_q15(uint32_t width_urad_s, uint32_t w_full_mrad_s);

/// tanh(w / width)
///
/// Source   (E54), (E76) in docs/EQUATIONS.md
/// Format   Q15, 1 is 32768
/// Range    rate_q16 from dqw_soft_rate_q15, any w; wrong by two last places at most
/// Cost     7 products of 32 by 16 bits, one inverse; no loop
/// Context  ISR safe; no state
int32_t dqw_soft_sign_q15(uint32_t rate_q16, int16_t w_q15);

/// Make an effect ready.
///
/// Source   (E54) in docs/EQUATIONS.md
/// Returns  DQW_OK; DQW_ERR_NULL, or DQW_ERR_RANGE for a name that is not of the shaft or a shape outside its range,
///          and then *t is untouched
/// Context  at start
enum dqw_status dqw_torque_init_q15(dqw_torque_q15 *t, const dqw_torque_q15_config *config, uint32_t w_full_mrad_s);

/// Torque of one unit of each weight: at speed w_m_q15 and shaft angle theta_m_turn, x_q15[weights of the effect]
/// written.
///
/// Source   (E54), (E76) in docs/EQUATIONS.md
/// Format   Q15 of w_full, 65536 a turn; x in Q15, 1 is 32768
/// Range    any; |x| <= 1, wrong by three last places at most
/// Cost     dqw_soft_sign_q15, and for stribeck_friction 7 products more; dqw_cosine_sine_q15 for cogging_torque
/// Context  ISR safe; reads *t only
void dqw_torque_at_q15(const dqw_torque_q15 *t, int16_t w_m_q15, uint16_t theta_m_turn, int32_t x_q15[]);

#ifdef __cplusplus
}
#endif
#endif
