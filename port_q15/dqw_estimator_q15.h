// The estimator in whole numbers: one neuron for both axes of a machine, its effects' inputs with it. Its weights are
// parts of a unit each, so that every input is a voltage and every weight about 1. The interrupt gathers, the
// background learns.
#ifndef DQW_ESTIMATOR_Q15_H
#define DQW_ESTIMATOR_Q15_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_effect_q15.h"
#include "dqw_gate.h"
#include "dqw_model_q15.h"
#include "dqw_modulation_name.h"
#include "dqw_nameplate_q15.h"
#include "dqw_noise_q15.h"
#include "dqw_normal_q15.h"
#include "dqw_parameter.h"
#include "dqw_reading_q15.h"
#include "dqw_scale.h"
#include "dqw_segment_q15.h"
#include "dqw_size.h"
#include "dqw_stage.h"
#include "dqw_status.h"
#include "dqw_window_q15.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Most inputs of the joint neuron: its own, in the order of dqw_parameter.h, then the effects'.
#define DQW_ESTIMATOR_Q15_INPUTS (DQW_PARAMETERS + DQW_EFFECT_WEIGHTS)

/// Weights whose blocks' autocorrelation is followed: R, L_d, L_q, flux, then the effects'.
#define DQW_ESTIMATOR_Q15_SCORES (4 + DQW_EFFECT_WEIGHTS)

/// Signals of a block: the model's, dead time's and a resting leg's input on d and q, then the effects' on d and on q.
#define DQW_PLAIN_Q15_SIGNALS (DQW_BLOCK_Q15_SIGNALS + 4)
/// All of them.
#define DQW_ESTIMATOR_Q15_SIGNALS (DQW_PLAIN_Q15_SIGNALS + 2 * DQW_EFFECT_WEIGHTS)

/// Of both of dead time's weights the unit is the full voltage over this.
#define DQW_DEAD_TIME_Q15_PARTS 30

/// Memory that stage 2 borrows (dqw_estimator_random_q15.h): free for other use once the stage is ordinal learning or
/// later.
struct dqw_estimator_random_q15;

/// All zero is refused. Constant: it may stay in flash. dqw_estimator_config_default_q15() fills it from a nameplate.
typedef struct dqw_estimator_q15_config {
    /// full scales: they are the bases too; pole_pairs 0: found from the motion, where there are no effects
    dqw_scale scale;
    uint32_t R_uohm, Ld_nH, Lq_nH, psi_nWb;  ///< nominal values to start from; 0: not known. Never a prior
    /// current at which the inverter's loss is three quarters of its full size; 0: no dead time is learned
    uint32_t dead_time_width_mA;
    /// the angle that comes with a sample is that of so long before its currents; < 0: after. Two periods at most; 0
    /// beside effects
    int32_t angle_late_ns;
    /// by how much the voltage may be off where no residual shows it, as a vector; 0: no more than the residual shows
    uint32_t voltage_error_mV;
    enum dqw_modulation modulation;  ///< which legs switch: dead time is theirs alone
    uint32_t stale_limit;            ///< equal samples in a row before a sensor counts as stuck; 0: never
    uint32_t threshold_ppm;          ///< residual over the full voltage that stage 3 must reach; 0: 50000 (5 %)
    /// deviation of the scale in which the voltage is given, as of the link's converter; 0: exact. A tenth at most
    uint32_t voltage_scale_ppm;
    /// an input whose power stays below this part of its full scale, squared, teaches nothing; 0: 328 (0.01)
    uint16_t excitation_q15;
    uint8_t half_window;   ///< pairs in half a block, 1 .. 100; 0: 20
    uint8_t solve_blocks;  ///< blocks between two solutions once 64 were learned; 0: 4. More cost less
    bool observed;         ///< the angle is an observer's, no encoder's: it may lean with load and speed, unseen
    bool angle;            ///< the electrical angle is given: dead time and some effects need it
    /// learn the flux that shows on the other axis where the angle is off; without effects the data are turned by it
    bool encoder_offset;
    bool follow;           ///< parameters may change: the memory is long until one does. Else nothing is forgotten
    bool noise_on_inputs;  ///< take the noise of currents and speed out of what is learned, (E60)
    bool settled;          ///< every sample is a settled point of its own: no slopes
    bool voltage_next;     ///< a sample's voltage acts one period later: from the next sample on
    /// it is a vector held in the stationary frame, given in the sample's: turned here to the middle of its period
    bool voltage_held;
    bool speed_electrical;  ///< w_m_q15 of a sample is electrical speed, and w_full_mrad_s its full scale
    /// stage 2's memory, made ready by dqw_estimator_random_init_q15(); NULL: nominal values stand for its result
    struct dqw_estimator_random_q15 *random;
#if DQW_EFFECT_WEIGHTS > 0
    const dqw_effect_q15_config *effects;  ///< electrical effects to learn as well; stays in use as long as the object
    uint8_t effect_count;                  ///< their weights together <= DQW_EFFECT_WEIGHTS; dead time has its own
#endif
} dqw_estimator_q15_config;

/// What is handed over with a half.
typedef struct dqw_estimator_q15_handed {
    int64_t answer_q30;                     ///< how the voltage answers the noise
    int64_t noise_q30[DQW_NOISE_Q15_SUMS];  ///< of the sensors, over
    uint32_t slope_q15;            ///< sum of the slopes of dead time's tanh, of 1 at no current, over the last rows
    uint32_t number;               ///< of the half, since init: the time
    uint16_t rows;                 ///< in the noise's sums
    uint16_t slopes;               ///< in their sum, up to 1024
    uint16_t follow_q15;           ///< how fast dead time's input follows the currents, 10923 .. 32768
    int16_t cosine_q15, sine_q15;  ///< of the electrical angle at its end; 0 and 0: not known
} dqw_estimator_q15_handed;

/// What the background gives back: taken over at a half's end.
typedef struct dqw_estimator_q15_given {
    int16_t step_q15[2];  ///< part of the full current that the full voltage moves in a period, d and q: dt/L
    uint16_t follow_q15;  ///< how fast dead time's input follows the currents, 10923 .. 32768,
    uint16_t lead_q12;    ///< and twice the periods by which it is late for that, up to 4
    bool noise_anew;      ///< the noise was measured with another dt/L
    bool ready;
} dqw_estimator_q15_given;

/// What of the residual lasts, and what of each input could make it a parameter's.
typedef struct dqw_residual_q15 {
    /// product of the last block's error with that two and three blocks before, what of it turns six times with the
    /// rotor, and of neighbouring stretches' means
    int32_t lasting_q38[3], slow_q38;
    uint32_t alone_q31[DQW_ESTIMATOR_Q15_INPUTS];       ///< power of each input that no other one explains
    uint32_t slow_alone_q31[DQW_ESTIMATOR_Q15_INPUTS];  ///< and of its means over a stretch
    uint32_t noisy_q35[2];                              ///< what of its power is the sensors' noise, of L_d and L_q
    uint32_t calm_q28[4];        ///< roots of what lasts, fast, slow, of all, turning, while nothing seems to change
    int16_t before_q17[3][2];    ///< errors of the three blocks before the last one
    int16_t slow_before_q18[2];  ///< mean of the stretch before
    /// sums of a stretch's errors and inputs, in halvings that keep them in their bits
    int16_t slow_sum[2], slow_x[2][DQW_ESTIMATOR_Q15_INPUTS];
    /// halves when this segment and the one before began; when a weight was last found changed, and since when
    uint32_t began, began_before, opened_at, opened_since;
    uint8_t opened;  ///< times that a weight was found changed, up to 255
    uint8_t slow_at;
} dqw_residual_q15;

/// A motor's estimator, in whole numbers.
typedef struct dqw_estimator_q15 {
    const dqw_estimator_q15_config *config;

    // The interrupt's. In this order nothing is lost to alignment, and small cores reach what each sample needs.
    dqw_sample_q15 last;  ///< its voltages are those that act from it on
    bool has_last, last_good, commanded;
    uint8_t command_resting;               ///< with voltage_next: the last sample's legs,
    int16_t command_d_q15, command_q_q15;  ///< and voltage
    int16_t dead_sign_q15[3];              ///< signs of the last sample's phase currents,
    uint16_t slopes;                       ///< in their sum
    int32_t dead_d_q15, dead_q_q15;        ///< and dead time's input of them; |D| <= 4/3
    int32_t slow_d_q28, slow_q_q28;        ///< currents as dead time's input takes them,
    int32_t wide_q28, per_wide;            ///< 3.6 widths, and 2^47 over that; 0: no dead time
    uint32_t slope_q15;                    ///< sum of the slopes of dead time's tanh
    int16_t step_q15[2];                   ///< as given last
    int32_t turn_q28;                      ///< electrical angle a period at full speed, rad
    uint32_t halves;                       ///< since init: the time
    dqw_gate gate;                         ///< but for its blocks, learned and incomplete, which the background counts
    dqw_noise_q15 noise;
    dqw_window_q15 window;
    uint16_t follow_q15;  ///< as given last
    uint16_t lead_q12;    ///< as given last
    uint8_t missed;       ///< halves lost because the background came too late, up to 255
    uint8_t modulation;   ///< as configured, tried or found: the background writes it
    // Handed over beside the window's part, while window.over.pending: the background's.
    dqw_estimator_q15_handed handed;
#if DQW_EFFECT_WEIGHTS > 0
    dqw_scale scale;  ///< with the pole pairs of the speed that is given
    dqw_effect_q15 effect;
#endif

    // Given back: the background's until it is ready, then the interrupt's until it clears that.
    dqw_estimator_q15_given given;

    // The background's: the angle at the end of the half before, and further down that half,
    int16_t rise_cosine_q15, rise_sine_q15;
    uint16_t blocks;  ///< learned, up to 65535
    // what was shown since the weights were solved, with the late voltage behind the inputs, what was learned of them,
    dqw_normal_q15 normal;
    int64_t cov_q40[DQW_ESTIMATOR_Q15_INPUTS];         ///< P_ii, per unit of the residual's variance
    int64_t error_q56[2];                              ///< mean squared residual, d and q
    int64_t recent_q54;                                ///< of both, over about 64 blocks
    int64_t score2_q68[DQW_ESTIMATOR_Q15_SCORES];      ///< what a block teaches a weight, squared,
    int64_t score_lag_q68[DQW_ESTIMATOR_Q15_SCORES];   ///< times the next one's,
    int32_t score_last_q34[DQW_ESTIMATOR_Q15_SCORES];  ///< and the last one's
    dqw_window_q15_rise rise;
    int32_t rise_v_q15[2];                   ///< sums of its voltages
    int32_t turn_cosine_q30, turn_sine_q30;  ///< data are turned by the angle that the encoder was found to be off
    int32_t w_before_q15[3];                 ///< sums of the speeds of the halves before
    /// what the angle is ahead of the speed, and the speed's change, times its change before; what is left, and that
    /// change, squared
    int32_t lag_num, lag_den, lag_rest, lag_by;
    int32_t w_q24[DQW_ESTIMATOR_Q15_INPUTS];  ///< the joint neuron's weights as solved last. |w| < 2^30
    int32_t e_q28[2];                         ///< the last block's error before the correction, d and q
    uint32_t number, elapsed;                 ///< of the last block; halves between it and the one before
    uint32_t learned;                         ///< weights of which anything was ever learned
    /// power of both axes' inputs above what teaches, over that; -1 .. 7
    int16_t excess_q10[DQW_ESTIMATOR_Q15_INPUTS];
    uint16_t answered_q15;    ///< which part of noise in a slope the current loop answers, up to 32768
    int16_t above_q10[2][2];  ///< of L_d and L_q, each axis' power above its noise, over that
    uint16_t pole_pairs;      ///< given or found; 0: not yet
    uint8_t restarts;         ///< times that the weights left all bounds, and learning began again, up to 255
    uint8_t across;           ///< blocks for which flux has shown on the other axis
    uint8_t trial;            ///< which legs switch, from 1 on, 255 before the first; 0: that is known
    uint8_t leader;           ///< the one beside which the others are tried
    uint8_t mixed;            ///< blocks to come in which two modulations meet
    uint8_t lag_halvings;     ///< of the lag's four, which are Q56 without
    uint8_t paced;            ///< whole halves behind each other, up to 3
    dqw_stage stage;
    dqw_residual_q15 residual;
    dqw_segment_q15 segment;
#if DQW_EFFECT_WEIGHTS > 0
    uint8_t inputs;
    uint8_t shift[DQW_EFFECT_WEIGHTS];  ///< an effect's weight is in units of so many halvings of its input
#endif
} dqw_estimator_q15;

/// A configuration for a machine of which no more than the nameplate is known; nominal values, an angle and the like
/// may be set in it. Full scales are half as much again as rated: what a fault makes of a signal still fits.
///
/// Source   (E80) in docs/EQUATIONS.md for half_window
/// Returns  a configuration that init takes, where the nameplate's values are positive and its speed turns less than
///          2/3 rad in a period, electrical; without a nameplate one that init refuses
/// Context  at start
dqw_estimator_q15_config dqw_estimator_config_default_q15(const dqw_nameplate_q15 *plate);

/// Make an estimator.
///
/// Source   (E13) to (E17), (E50), (E60), (E61), (E70), (E71) in docs/EQUATIONS.md
/// Returns  DQW_OK; else which field was refused, and then *e is untouched
/// Context  at start; the configuration stays in use as long as the object
#define dqw_estimator_init_q15 DQW_SIZED(dqw_estimator_init_q15)
enum dqw_status dqw_estimator_init_q15(dqw_estimator_q15 *e, const dqw_estimator_q15_config *config);

/// Stage 1 again: with another configuration, as a trace wrote it, all that was learned forgotten. What was counted
/// stays.
///
/// Source   Fig. 1; (E21) in docs/EQUATIONS.md
/// Returns  as dqw_estimator_init_q15; on an error the old estimator goes on
/// Context  background; hold the interrupt back
enum dqw_status dqw_estimator_define_q15(dqw_estimator_q15 *e, const dqw_estimator_q15_config *config);

/// One PWM period. `saturated`: the inverter could not give the voltage of this sample, or a sensor is at its limit.
///
/// Source   (E13), (E15), (E19), (E60) in docs/EQUATIONS.md
/// Format   Q15 of the full scales
/// Range    any; beyond full scale (-32768, -32767, 32767) it is counted as saturated and not learned
/// Returns  DQW_EVENT_* bits; DQW_EVENT_BLOCK: a block waits for dqw_estimator_background_q15
/// Cost     the table in docs/cost.md; no loop depends on data
/// Context  interrupt; one writer per object
#define dqw_estimator_sample_q15 DQW_SIZED(dqw_estimator_sample_q15)
uint32_t dqw_estimator_sample_q15(dqw_estimator_q15 *e, const dqw_sample_q15 *s, bool saturated);

/// There is no sample in this period, or in these.
///
/// Format   periods: PWM periods without one. 1: it counts as a refused sample. Else time has jumped, 0 where nobody
///          knows how far; of a jump's length a part of half a window is lost
/// Context  as dqw_estimator_sample_q15
void dqw_estimator_missing_q15(dqw_estimator_q15 *e, uint32_t periods);

/// Learn the block that waits, if there is one. Must come before the next half is full: every half_window periods.
///
/// Source   (E16), (E17), (E60), (E61), (E70), (E71) in docs/EQUATIONS.md
/// Returns  true if a block was learned
/// Context  background; dqw_estimator_sample_q15 may interrupt it anywhere
bool dqw_estimator_background_q15(dqw_estimator_q15 *e);

/// What 1 of a parameter is: uOhm, nH, nH, nWb, uV, nWb, uV; 0 for one that does not exist.
uint32_t dqw_estimator_unit_q15(const dqw_estimator_q15_config *config, enum dqw_parameter parameter);

/// What was learned of a parameter, in dqw_estimator_unit_q15().
///
/// Source   (E20), (E61), (E184) in docs/EQUATIONS.md
/// Range    not usable, and sd INT64_MAX, before anything was learned and for a parameter that does not exist
/// Context  background
#define dqw_estimator_read_q15 DQW_SIZED(dqw_estimator_read_q15)
dqw_reading_q15 dqw_estimator_read_q15(const dqw_estimator_q15 *e, enum dqw_parameter parameter);

#if DQW_EFFECT_WEIGHTS > 0
/// What was learned of the effect config->effects[index]: weights and their deviations, in the order of its law.
///
/// Source   (E50), (E75) in docs/EQUATIONS.md
/// Format   Q40 of the units that dqw_effect_restored_q40 names; a deviation of INT64_MAX: not known
/// Shape    weights_q40[], sd_q40[]: as many as dqw_effect_name.h lists, DQW_EFFECT_STARTS at most, written
/// Returns  bit i set where weight i is known: its deviation is below a quarter of the largest; DQW_ERR_SIZE for an
///          index out of range
/// Context  background
int dqw_estimator_read_effect_q15(const dqw_estimator_q15 *e, int index, int64_t weights_q40[], int64_t sd_q40[]);
#endif

/// Pole pairs: given, or as the motion tells them; 0: not known yet.
/// Source   (E22) in docs/EQUATIONS.md
/// Context  background
uint16_t dqw_estimator_pole_pairs_q15(const dqw_estimator_q15 *e);

/// When the voltage of a sample acts, as the motion shows it; the configuration says it with voltage_next.
///
/// Source   (E90) in docs/EQUATIONS.md
/// Returns  DQW_VOLTAGE_NOT_KNOWN where it does not show: neither w_e dt above about 0.05 nor steps of the voltage
/// Context  background
enum dqw_voltage_acts dqw_estimator_voltage_acts_q15(const dqw_estimator_q15 *e);

#ifdef __cplusplus
}
#endif
#endif
