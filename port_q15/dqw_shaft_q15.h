// The shaft in whole numbers: J, B, Coulomb friction and further effects from torque and speed, all by one neuron.
#ifndef DQW_SHAFT_Q15_H
#define DQW_SHAFT_Q15_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_gate.h"
#include "dqw_normal_q15.h"
#include "dqw_reading_q15.h"
#include "dqw_scale.h"
#include "dqw_shaft_parameter.h"
#include "dqw_size.h"
#include "dqw_torque_q15.h"
#include "dqw_window_q15.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Full scales of the shaft: what no signal reaches, the nearer the better.
typedef struct dqw_shaft_scale {
    uint32_t torque_full_uNm;  ///< 1 .. DQW_SHAFT_TORQUE_MAX
    uint32_t w_full_mrad_s;    ///< 1 .. DQW_SCALE_MAX
    uint32_t dt_ns;            ///< sampling period, 1 .. 10^9
} dqw_shaft_scale;

/// 4 kNm.
#define DQW_SHAFT_TORQUE_MAX 4000000000u

/// All zero is refused. Constant: it may stay in flash.
typedef struct dqw_shaft_q15_config {
    dqw_shaft_scale scale;  ///< full scales and sampling period
    /// nominal values to start from, 10^-9 kg m^2 and Nms/rad; 0: start from zero. Never a prior
    uint32_t J_gmm2, B_nNms_rad;
    uint32_t standstill_urad_s;  ///< with coulomb: no friction direction up to this speed
    /// with coulomb: the direction is tanh(w / width), w_full / 8192 .. 16 w_full; 0: its sign
    uint32_t coulomb_width_urad_s;
    /// a block's input below this part of its base teaches nothing, up to 32766; 0: 66 (0.002)
    uint16_t excitation_q15;
    /// pairs in half a block, 1 .. 100; 0: 25. A fast loop gives means of the torque, and every n-th speed
    uint8_t half_window;
    /// blocks between two solutions, which is when readings move; 0: 4. More cost less, and follow later
    uint8_t solve_blocks;
    bool coulomb;  ///< learn a friction torque against the motion as well
#if DQW_EFFECT_WEIGHTS > 0
    const dqw_torque_q15_config *effects;  ///< effects of the shaft to learn as well; read at the start alone
    uint8_t effect_count;                  ///< their weights together <= DQW_EFFECT_WEIGHTS
#endif
} dqw_shaft_q15_config;

/// What is written on the machine.
typedef struct dqw_shaft_q15_nameplate {
    uint32_t dt_ns;       ///< sampling period
    uint32_t torque_uNm;  ///< rated torque
    uint32_t w_m_mrad_s;  ///< rated mechanical speed
} dqw_shaft_q15_nameplate;

/// Signals of a pair: torque, step of the speed, sums of two speeds and directions; then the effects' inputs, sums of
/// two.
#define DQW_SHAFT_Q15_SIGNALS (4 + DQW_EFFECT_WEIGHTS)

/// Most inputs of the neuron: J, B, Coulomb friction where it is asked for, then the effects' weights.
#define DQW_SHAFT_Q15_INPUTS (DQW_SHAFT_PARAMETERS + DQW_EFFECT_WEIGHTS)

/// A shaft's learner, in whole numbers.
typedef struct dqw_shaft_q15 {
    // Set at the start.
    const dqw_shaft_q15_config *config;
    uint32_t coulomb_rate_q16;  ///< of a soft direction; 0: its sign
    int32_t standstill_q15;
    uint8_t inputs, weights;  ///< of the neuron; how many of them are effects'
#if DQW_EFFECT_WEIGHTS > 0
    uint8_t effect_count;
    dqw_torque_q15 effect[DQW_EFFECT_WEIGHTS];
#endif
    // The interrupt's.
    dqw_gate gate;  ///< but for its blocks, learned and incomplete, which the background counts
    dqw_window_q15 window;
    int32_t direction_last_q15;
    int16_t torque_last_q15, w_last_q15;
#if DQW_EFFECT_WEIGHTS > 0
    int32_t x_last_q15[DQW_EFFECT_WEIGHTS];  ///< the effects' inputs at the last sample
#endif
    uint32_t missed;  ///< halves lost because the background came too late
    bool has_last;
    // The background's: the half before, the neuron, and what it leaves unexplained.
    dqw_window_q15_rise rise;
    dqw_normal_q15 normal;
    int64_t w_q40[DQW_SHAFT_Q15_INPUTS];  ///< as solved last, per unit of the full scales; J: of a step in half a block
    int64_t sd_q40[DQW_SHAFT_Q15_INPUTS];  ///< deviations; INT64_MAX: nothing was learned
    int64_t start_q40[DQW_SHAFT_Q15_INPUTS];
    int64_t error_q56, lag_q56, target_q56;  ///< means: squared residual, product of two in a row, squared target
    int32_t error_last_q28;
    uint32_t excited;  ///< of the last block, bit i: input i was large enough to teach its weight
} dqw_shaft_q15;

/// A configuration from a nameplate: full scales of three times the torque and one and a half times the speed; blocks
/// of twice 25 ms (twice 10 to
/// 100 samples), friction learned, its direction soft below a hundredth of the rated speed. Nominal values and effects
/// are absent.
///
/// Shape    nameplate: null gives all zero, and what no full scale may be is passed on: dqw_shaft_init_q15() refuses
///          both
/// Context  at start
dqw_shaft_q15_config dqw_shaft_config_default_q15(const dqw_shaft_q15_nameplate *nameplate);

/// Make a shaft for J dw/dt + B w + T_c sign(w) = T.
///
/// Source   (E23), (E54), (E70), (E76) in docs/EQUATIONS.md
/// Returns  DQW_OK; DQW_ERR_NULL, or the enumerator of the field that was refused, DQW_ERR_UNIT where full scales and
///          start values go too far apart; then *s is untouched
/// Context  at start; the configuration stays in use as long as the object
#define dqw_shaft_init_q15 DQW_SIZED(dqw_shaft_init_q15)
enum dqw_status dqw_shaft_init_q15(dqw_shaft_q15 *s, const dqw_shaft_q15_config *config);

/// Begin anew with another configuration: all that was learned is forgotten.
///
/// Returns  as dqw_shaft_init_q15; where it is refused, the old one goes on
/// Context  background; hold the interrupt back meanwhile
enum dqw_status dqw_shaft_define_q15(dqw_shaft_q15 *s, const dqw_shaft_q15_config *config);

/// One sample: gathers, never learns.
///
/// Source   (E15), (E23), (E54) in docs/EQUATIONS.md
/// Format   torque_q15 at the shaft, of torque_full, as applied from this sample to the next; w_m_q15 of w_full at this
///          sample; the shaft's angle, 65536 a turn, which cogging alone reads. `saturated`: the caller knows it to be
///          beyond a limit, or not to be one
/// Range    any; beyond full scale (-32768, -32767, 32767) it is counted as saturated and not learned
/// Returns  DQW_EVENT_* bits of this step; DQW_EVENT_BLOCK: a block waits for dqw_shaft_background_q15
/// Cost     2 additions a signal; dqw_torque_at_q15 for each effect, dqw_soft_sign_q15 for a soft direction. No loop
///          depends on data
/// Context  ISR safe; one writer per object
#define dqw_shaft_sample_q15 DQW_SIZED(dqw_shaft_sample_q15)
uint32_t dqw_shaft_sample_q15(dqw_shaft_q15 *s, int16_t torque_q15, int16_t w_m_q15, uint16_t theta_m_turn,
                              bool saturated);

/// No sample came in these periods. 1: as a sample that is refused. 0, where nobody knows, or more: time has jumped,
/// the next sample does not follow the last one.
/// Context  as dqw_shaft_sample_q15
void dqw_shaft_missing_q15(dqw_shaft_q15 *s, uint32_t periods);

/// Learn the block that waits, if there is one; solve after every so many. Must come before the next: every half_window
/// periods.
///
/// Source   (E17), (E19), (E20), (E70) in docs/EQUATIONS.md
/// Returns  true if a block was learned
/// Cost     (n + 2)^2 / 2 products of 64 bits for n inputs; a solution: dqw_normal_solve_q15 and a square root a weight
/// Context  background; dqw_shaft_sample_q15 and dqw_shaft_missing_q15 may interrupt it anywhere
#define dqw_shaft_background_q15 DQW_SIZED(dqw_shaft_background_q15)
bool dqw_shaft_background_q15(dqw_shaft_q15 *s);

/// J, B or the Coulomb torque, as solved last.
///
/// Source   (E20), (E23) in docs/EQUATIONS.md
/// Units    J: torque_full dt / w_full, B: torque_full / w_full, the Coulomb torque: torque_full
/// Returns  what is not configured, or does not exist, is 0 and not known
/// Context  background, or wherever dqw_shaft_background_q15 cannot come between
dqw_reading_q15 dqw_shaft_read_q15(const dqw_shaft_q15 *s, enum dqw_shaft_parameter which);

#if DQW_EFFECT_WEIGHTS > 0
/// What was learned of the effect config->effects[index], in the order of its law.
///
/// Source   (E20), (E54) in docs/EQUATIONS.md
/// Units    torque_full
/// Shape    weights_q40[], sd_q40[]: as many as dqw_effect_name.h lists, DQW_EFFECT_STARTS at most, written; INT64_MAX
///          where nothing was learned
/// Returns  bit i set where weight i is known: its deviation is below a quarter of the effect's largest; DQW_ERR_SIZE
///          for an index out of range
/// Context  as dqw_shaft_read_q15
int dqw_shaft_read_effect_q15(const dqw_shaft_q15 *s, int index, int64_t weights_q40[], int64_t sd_q40[]);
#endif

#ifdef __cplusplus
}
#endif
#endif
