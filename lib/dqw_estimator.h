// The estimator: one neuron for both axes of a machine. Its weights are R, L_d, L_q, the flux, what the inverter and
// the encoder add, and those of any list of effects. It follows parameters that change, and knows how sure it is. The
// interrupt gathers, the background learns.
#ifndef DQW_ESTIMATOR_H
#define DQW_ESTIMATOR_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_modulation_name.h"
#include "dqw_nameplate.h"
#include "dqw_parameter.h"
#include "dqw_parts.h"
#include "dqw_reading.h"
#include "dqw_sample.h"
#include "dqw_size.h"
#include "dqw_status.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Most inputs of the joint neuron: its own, then the effects'.
#define DQW_ESTIMATOR_INPUTS (DQW_PARAMETERS + DQW_EFFECT_WEIGHTS)

/// Weights whose blocks' autocorrelation is followed: R, L_d, L_q, flux, then the effects'.
#define DQW_ESTIMATOR_SCORES (4 + DQW_EFFECT_WEIGHTS)

/// Signals of a block: the model's, dead time's and a resting leg's input on d and q, then the effects' on d and on q.
#define DQW_PLAIN_SIGNALS 13
/// All of them.
#define DQW_ESTIMATOR_SIGNALS (DQW_PLAIN_SIGNALS + 2 * DQW_EFFECT_WEIGHTS)

struct dqw_estimator;

/// Memory that stage 2 borrows (dqw_random.h): free for other use once the stage is ordinal learning or later.
struct dqw_estimator_random;

/// All zero is refused. Constant: it may stay in flash. dqw_estimator_config_default() fills it from a nameplate.
typedef struct dqw_estimator_config {
    float dt_s;  ///< PWM period, > 0
    /// rated voltage, current and mechanical speed: they scale. A sample beyond ten of them is saturated. > 0
    float v_base_V;
    float i_base_A;        ///< > 0
    float w_base_rad_s;    ///< > 0
    float R_ohm;           ///< nominal values to start from; 0: not known. Never a prior
    float Ld_H;            ///< the same
    float Lq_H;            ///< the same
    float psi_Wb;          ///< the same; the magnet's flux linkage, peak
    uint16_t pole_pairs;   ///< 0: found from the motion, where there are no effects
    uint16_t half_window;  ///< pairs in half a block, 1 .. 10000; 0: 20
    float v_limit_V;       ///< samples beyond are saturated, and not learned; 0: ten bases
    float i_limit_A;       ///< the same
    float excitation_pu;  ///< an input whose power stays below this part of its base, squared, teaches nothing; 0: 0.01
    /// current at which the inverter's loss is three quarters of its full size; 0: no dead time is learned
    float dead_time_width_A;
    /// the angle that comes with a sample is that of so long before its currents; < 0: after. Two periods at most; 0
    /// beside effects
    float angle_late_s;
    /// by how much the voltage may be off where no residual shows it, as a vector; 0: no more than the residual shows
    float voltage_error_V;
    enum dqw_modulation modulation;  ///< which legs switch: dead time is theirs alone. Without dead time of no meaning
    uint32_t stale_limit;            ///< equal samples in a row before a sensor counts as stuck; 0: never
    uint32_t threshold_ppm;          ///< residual over the voltage base that stage 3 must reach; 0: 50000 (5 %)
    /// deviation of the scale in which the voltage is given, as of the link's converter; 0: exact. A tenth at most
    uint32_t voltage_scale_ppm;
    bool observed;  ///< the angle is an observer's, no encoder's: it may lean with load and speed, unseen
    bool angle;     ///< cosine and sine are given: dead time and some effects need them
    /// learn the flux that shows on the other axis where the angle is off; without effects the data are turned by it
    bool encoder_offset;
    bool follow;           ///< parameters may change: the memory is long until one does. Else nothing is forgotten
    bool noise_on_inputs;  ///< take the noise of currents and speed out of what is learned, (E60)
    bool settled;          ///< every sample is a settled point of its own: no slopes
    bool voltage_next;     ///< a sample's voltage acts one period later: from the next sample on
    /// it is a vector held in the stationary frame, given in the sample's: turned here to the middle of its period
    bool voltage_held;
    bool speed_electrical;  ///< w_m_rad_s of a sample is electrical speed
    /// stage 2's memory, made ready by dqw_estimator_random_init(); NULL: nominal values stand for its result
    struct dqw_estimator_random *random;
#if DQW_EFFECT_WEIGHTS > 0
    const dqw_effect_config *effects;  ///< electrical effects to learn as well; stays in use as long as the object
    uint8_t effect_count;              ///< their weights together <= DQW_EFFECT_WEIGHTS; dead time has its own
#endif
} dqw_estimator_config;

/// What goes with a half that the interrupt hands over.
typedef struct dqw_estimator_handed {
    float cosine, sine;         ///< of the electrical angle at its end; 0 and 0: not known
    dqw_noise_variances noise;  ///< of the sensors
    float dead_slope_inv_A;     ///< mean slope of dead time's input
    uint32_t number;            ///< of the half, since init
} dqw_estimator_handed;

/// What the background hands back: taken over at a half's end.
typedef struct dqw_estimator_given {
    float step_A_per_V[2];  ///< what a volt moves the currents in one period, d and q: dt/L
    float lead;             ///< twice the periods by which dead time's input follows the currents late
    bool noise_anew;        ///< the noise was measured with a dt/L that is no longer believed
} dqw_estimator_given;

/// A motor's estimator.
typedef struct dqw_estimator {
    const dqw_estimator_config *config;

    // The interrupt's.
    dqw_gate gate;  ///< but for blocks and incomplete, which the background counts
    dqw_window window;
    dqw_noise noise;
    uint32_t v_limit_bits, i_limit_bits, w_limit_bits;  ///< limits of the samples, as dqw_size_bits() has them
    float dead_time_width_A;
    float v_d_V, v_q_V, i_d_A, i_q_A, w_m_rad_s;  ///< the last sample; its voltages are those that act from it on
    float command_d_V, command_q_V;               ///< with voltage_next: the last sample's voltage
    float cosine, sine;                           ///< its angle
    float dead_sign[3], dead_d, dead_q;           ///< signs of its phase currents, and dead time's input of them
    float dead_slope_inv_A;
    float slow_d_A, slow_q_A;     ///< currents as dead time's input takes them
    float step_A_per_V[2], lead;  ///< as given last
    float follow;                 ///< how fast dead time's input follows the currents, for that
    uint32_t halves;              ///< halves of a window since init: the time
    uint8_t missed;               ///< halves lost because the background came too late, up to 255
    bool has_last, last_good, commanded;
    uint8_t resting, command_resting;  ///< legs, while the last sample's voltages act
    uint8_t modulation;                ///< as configured, tried or found: the background writes it
#if DQW_EFFECT_WEIGHTS > 0
    dqw_effect effect;
#endif

    // Handed over with window.over.pending; and the other way round.
    dqw_estimator_handed handed;
    dqw_estimator_given given;
    bool given_ready;

    // The background's: the half before.
    dqw_window_rise rise;
    float rise_cosine, rise_sine, rise_v_V[2];
    float w_before_rad_s[3];  ///< mean speeds of the halves before
    /// what the angle is ahead of the speed, and the speed's change, times its change before; what is left, and that
    /// change, squared
    float lag_num, lag_den, lag_rest, lag_by;
    float turn_cosine, turn_sine;  ///< the data are turned by the angle that the encoder was found to be off
    // The joint neuron's weights, per unit, and the gain that replaces its step size.
    float w_pu[DQW_ESTIMATOR_INPUTS];
    dqw_gain gain;
    dqw_segment segment;
    /// halves when this segment and the one before began; when a weight was last found changed, and since when
    uint32_t began, began_before, opened_at, opened_since;
    uint8_t opened;           ///< times that a weight was found changed, up to 255
    float e_pu[2];            ///< the last block's error before the correction, d and q
    float error_pu2[2];       ///< mean squared residual, d and q
    float recent_pu2;         ///< of both, over about 64 blocks
    float e_before_pu[3][2];  ///< errors of the three blocks before the last one
    float lasting_pu2[3];     ///< their product with the last one's, two and three blocks apart; what turns
    float slow_sum_pu[2], slow_before_pu[2];     ///< errors of a stretch of blocks, and mean of the one before
    float slow_pu2;                              ///< product of neighbouring stretches' means
    float slow_x_pu[DQW_ESTIMATOR_INPUTS];       ///< sums of a stretch's inputs on one axis,
    float slow_alone_pu2[DQW_ESTIMATOR_INPUTS];  ///< and power of their means that no other one explains
    float alone_pu2[DQW_ESTIMATOR_INPUTS];       ///< power of each input that no other one explains
    float noisy_pu2[2];                          ///< what of it is the sensors' noise, of L_d and L_q
    float answered;                              ///< which part of noise in a slope the current loop answers
    float score2[DQW_ESTIMATOR_SCORES];          ///< what a block teaches a weight, squared,
    float score_lag[DQW_ESTIMATOR_SCORES];       ///< times the next one's,
    float score_last[DQW_ESTIMATOR_SCORES];      ///< and the last one's
    float late_w[DQW_ESTIMATOR_INPUTS];          ///< of the late voltage, what the inputs explain
    float late_pu2, late_error_pu2;              ///< power of the rest, and its product with the residual
    uint32_t number, elapsed;                  ///< of the half that ended the last block; halves since the block before
    uint32_t noise_rows;                       ///< that its noise was a mean of
    uint32_t learned;                          ///< weights of which anything was ever learned
    int16_t excess_q10[DQW_ESTIMATOR_INPUTS];  ///< power of both axes' inputs above what teaches, over that; -1 .. 7
    int16_t above_q10[2][2];                   ///< of L_d and L_q, each axis' power above its noise, over that
    uint16_t blocks;                           ///< learned, up to 65535
    uint16_t pole_pairs;                       ///< given or found; 0: not yet
    uint8_t restarts;  ///< times that the weights left all bounds, and learning began again, up to 255
    uint8_t inputs;
    uint8_t paced;               ///< whole halves behind each other, up to 3
    uint8_t slow_at, slow_axis;  ///< blocks of the stretch, and the axis whose inputs it sums
    uint8_t across;              ///< blocks for which flux has shown on the other axis
    uint8_t trial;               ///< which legs switch, from 1 on, 255 before the first; 0: that is known
    uint8_t leader;              ///< the one beside which the others are tried
    uint8_t mixed;               ///< blocks to come in which two of them meet
    dqw_lasting calm;            ///< what lasts, and the residual's variance, while nothing seems to change
    dqw_stage stage;
} dqw_estimator;

/// A configuration for a machine of which no more than the nameplate is known; nominal values, an angle and the like
/// may be set in it.
///
/// Source   (E80) in docs/EQUATIONS.md for half_window
/// Returns  a configuration that init takes, where the nameplate's values are positive
/// Context  at start
dqw_estimator_config dqw_estimator_config_default(const dqw_nameplate *plate);

/// Make an estimator.
///
/// Source   (E13) to (E17), (E50), (E60), (E61) in docs/EQUATIONS.md
/// Returns  DQW_OK; else which field was refused, and then *e is untouched
/// Context  at start; the configuration stays in use as long as the object
#define dqw_estimator_init DQW_SIZED(dqw_estimator_init)
enum dqw_status dqw_estimator_init(dqw_estimator *e, const dqw_estimator_config *config);

/// Stage 1 again: with another configuration, as a trace wrote it, all that was learned forgotten. What was counted
/// stays.
///
/// Source   Fig. 1; (E21) in docs/EQUATIONS.md
/// Returns  as dqw_estimator_init; on an error the old estimator goes on
/// Context  background; hold the interrupt back
enum dqw_status dqw_estimator_define(dqw_estimator *e, const dqw_estimator_config *config);

/// One PWM period. `saturated`: the inverter could not give the voltage of this sample, or a sensor is at its limit.
///
/// Source   (E13), (E15), (E19), (E60) in docs/EQUATIONS.md
/// Units    SI
/// Range    any float; what cannot be learned is skipped and counted in e->gate
/// Returns  DQW_EVENT_* bits; DQW_EVENT_BLOCK: a block waits for dqw_estimator_background
/// Cost     docs/firmware.md; no loop depends on data
/// Context  interrupt; one writer per object
#define dqw_estimator_sample DQW_SIZED(dqw_estimator_sample)
uint32_t dqw_estimator_sample(dqw_estimator *e, const dqw_sample *s, bool saturated);

/// There is no sample in this period, or in these.
///
/// Units    periods: PWM periods without one. 1: it counts as a refused sample. Else time has jumped, 0 where nobody
///          knows how far; of a jump's length a part of half a window is lost
/// Context  as dqw_estimator_sample
void dqw_estimator_missing(dqw_estimator *e, uint32_t periods);

/// Learn the block that waits, if there is one. Must come before the next one is full: within half_window periods.
///
/// Source   (E16), (E17), (E60), (E61) in docs/EQUATIONS.md
/// Returns  true if a block was learned
/// Cost     docs/firmware.md
/// Context  background; dqw_estimator_sample may interrupt it anywhere
bool dqw_estimator_background(dqw_estimator *e);

/// What was learned of a parameter.
///
/// Source   (E20), (E61), (E184) in docs/EQUATIONS.md
/// Units    SI
/// Range    not usable, and sd DQW_UNKNOWN, before anything was learned and for a parameter that does not exist
/// Context  background
#define dqw_estimator_read DQW_SIZED(dqw_estimator_read)
dqw_reading dqw_estimator_read(const dqw_estimator *e, enum dqw_parameter parameter);

#if DQW_EFFECT_WEIGHTS > 0
/// What was learned of the effect config->effects[index]: SI weights and their deviations, in the order of its law.
///
/// Source   (E50) in docs/EQUATIONS.md
/// Shape    weights[], sd[]: as many as dqw_effect_name.h lists, DQW_EFFECT_STARTS at most, written
/// Returns  bit i set where weight i is known: its deviation is below a quarter of the largest; DQW_ERR_SIZE for an
///          index out of range
/// Context  background
int dqw_estimator_read_effect(const dqw_estimator *e, int index, float weights[], float sd[]);
#endif

/// Pole pairs: given, or as the motion tells them; 0: not known yet.
/// Source   (E22) in docs/EQUATIONS.md
/// Context  background
uint16_t dqw_estimator_pole_pairs(const dqw_estimator *e);

/// When the voltage of a sample acts, as the motion shows it; the configuration says it with voltage_next.
///
/// Source   (E90) in docs/EQUATIONS.md
/// Returns  DQW_VOLTAGE_NOT_KNOWN where it does not show: neither w_e dt above about 0.05 nor steps of the voltage
/// Context  background
enum dqw_voltage_acts dqw_estimator_voltage_acts(const dqw_estimator *e);

#ifdef __cplusplus
}
#endif
#endif
