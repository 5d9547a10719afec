// The mechanical axis in whole numbers: J, B, Coulomb friction and further effects of the shaft from torque and speed, with the same neuron.
#ifndef DQW_MECHANICAL_Q15_H
#define DQW_MECHANICAL_Q15_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_axis_q15.h"
#include "dqw_gate.h"
#include "dqw_scale.h"
#include "dqw_size.h"
#include "dqw_torque_q15.h"
#include "dqw_window_q15.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Full scales of the shaft, from nameplate values: what no signal reaches, the nearer the better.
typedef struct dqw_mechanical_scale {
    uint32_t torque_full_uNm;  ///< 1 .. DQW_MECHANICAL_SCALE_MAX
    uint32_t w_full_mrad_s;    ///< 1 .. DQW_SCALE_MAX
    uint32_t dt_ns;            ///< sampling period, 1 .. 10^9
} dqw_mechanical_scale;

/// 4 kNm.
#define DQW_MECHANICAL_SCALE_MAX 4000000000u

/// May these be full scales?
///
/// Returns  DQW_OK; DQW_ERR_NULL, or DQW_ERR_RANGE where a value is outside the range that stands beside it
/// Context  at start
enum dqw_status dqw_mechanical_scale_check(const dqw_mechanical_scale *scale);

/// All zero is refused. Constant: it may stay in flash.
typedef struct dqw_mechanical_q15_config {
    dqw_mechanical_scale scale;
    uint32_t J_gmm2, B_nNms_rad;    ///< nominal values to start from, 10^-9 kg m^2 and Nms/rad; 0: start from zero. Never a prior
    uint32_t standstill_urad_s;     ///< with coulomb: no friction direction up to this speed
    uint32_t coulomb_width_urad_s;  ///< with coulomb: the direction is tanh(w / width), w_full / 8192 .. 16 w_full; 0: its sign
    uint16_t excitation_q15;        ///< a block's input below this part of its base teaches nothing; 0: 66 (0.002)
    uint8_t half_window;            ///< pairs in half a block, 1 .. 100; 0: 25. A fast loop gives means of the torque, and every n-th speed
    uint8_t read_blocks;            ///< blocks between two readings; 0: 4. More cost less, and follow the first blocks later
    bool coulomb;                   ///< learn a friction torque against the motion as well
#if DQW_EFFECT_WEIGHTS > 0
    const dqw_torque_q15_config *effects;  ///< effects of the shaft to learn as well; read at start alone
    uint8_t effect_count;                  ///< their weights together <= DQW_EFFECT_WEIGHTS
#endif
} dqw_mechanical_q15_config;

/// What is read, in this order; then the effects' weights, in the order of the configuration.
enum dqw_friction_q15_name { DQW_J_Q15 = 0, DQW_B_Q15, DQW_COULOMB_Q15, DQW_FRICTION_Q15_PLAIN };
#define DQW_FRICTION_Q15_VALUES (3 + DQW_EFFECT_WEIGHTS)

/// What the weights say: per unit of the full scales, J of torque dt / w, B of torque / w, all others of the torque.
typedef struct dqw_friction_q15 {
    int64_t value_q40[DQW_FRICTION_Q15_VALUES];
    int64_t sd_q40[DQW_FRICTION_Q15_VALUES];  ///< INT64_MAX: not known
    uint32_t known;                           ///< bit i: value i means something
} dqw_friction_q15;

/// Signals of a pair: torque, step of the speed, speed, direction; then the effects' inputs.
#define DQW_MECHANICAL_Q15_SIGNALS (4 + DQW_EFFECT_WEIGHTS)

typedef struct dqw_mechanical_q15 {
    const dqw_mechanical_q15_config *config;
    dqw_gate gate;
    dqw_window_q15 window;
    dqw_axis_q15 axis;
    dqw_friction_q15 friction;  ///< as read last: after 1, 2, 4, 8 blocks, and as configured
    uint32_t coulomb_rate_q16;  ///< of a soft direction; 0: its sign
    int32_t standstill_q15;
    uint32_t events;  ///< all event bits since init
    int32_t direction_last_q15;
    int16_t torque_last_q15, w_last_q15;
    bool has_last;
    // Handed to the background.
    bool pending;
    uint16_t weight, missed;  ///< of the block that waits; blocks lost because the background came too late, up to 65535
    int32_t sums[DQW_MECHANICAL_Q15_SIGNALS];
#if DQW_EFFECT_WEIGHTS > 0
    dqw_torque_q15 effect[DQW_EFFECT_WEIGHTS];
    int32_t x_last_q15[DQW_EFFECT_WEIGHTS];  ///< the effects' inputs at the last sample
    uint8_t effect_count, weights;
#endif
} dqw_mechanical_q15;

/// Make a mechanical axis for J dw/dt + B w + T_c sign(w) = T.
///
/// Source   (E23), (E70), (E76) in docs/EQUATIONS.md
/// Returns  DQW_OK; DQW_ERR_NULL, DQW_ERR_SIZE or DQW_ERR_RANGE, and then *m is untouched
/// Context  at start; the configuration stays in use as long as the object
enum dqw_status dqw_mechanical_init_q15(dqw_mechanical_q15 *m, const dqw_mechanical_q15_config *config);

/// One sample. `saturated`: the caller knows it to be beyond a limit, or not to be one.
///
/// Source   (E15), (E23), (E54) in docs/EQUATIONS.md
/// Format   torque_q15 at the shaft, of torque_full, as applied from this sample to the next; w_m_q15 of w_full at this sample; the shaft's
///          angle, 65536 a turn, which cogging alone reads
/// Range    any; beyond full scale (-32768, -32767, 32767) it is counted as saturated and not learned
/// Returns  DQW_EVENT_* bits of this step; DQW_EVENT_LEARNED: a block waits for dqw_mechanical_background_q15
/// Cost     2 additions a signal; dqw_torque_at_q15 for each effect, dqw_soft_sign_q15 for a soft direction. No loop depends on data
/// Context  ISR safe; one writer per object
uint32_t dqw_mechanical_step_q15(dqw_mechanical_q15 *m, int16_t torque_q15, int16_t w_m_q15, uint16_t theta_m_turn, bool saturated);

/// Time has jumped: the next sample does not follow the last one.
/// Context  as dqw_mechanical_step_q15
void dqw_mechanical_gap_q15(dqw_mechanical_q15 *m);

/// Learn the block that waits, if there is one; read after every so many. Must come before the next: every half_window periods.
///
/// Source   (E17), (E23), (E70) in docs/EQUATIONS.md
/// Returns  DQW_EVENT_* bits: DQW_EVENT_LEARNED where it was learned
/// Context  background; dqw_mechanical_step_q15 may interrupt it
uint32_t dqw_mechanical_background_q15(dqw_mechanical_q15 *m);

/// Read all that was learned until now into m->friction.
///
/// Source   (E20), (E23) in docs/EQUATIONS.md
/// Range    J, B and the Coulomb torque are known where the deviation is below a quarter of the value and the value is positive; an effect's
///          weight, where it is below a quarter of the effect's largest
/// Cost     dqw_normal_solve_q15, and two square roots a weight
/// Context  background; dqw_mechanical_step_q15 may interrupt it
void dqw_mechanical_read_q15(dqw_mechanical_q15 *m);

#ifdef __cplusplus
}
#endif
#endif
