// The tracker: one neuron for both axes of a machine whose pole pairs are known. Its weights are R, L_d, L_q, the flux, and what
// the inverter and the encoder add. It follows parameters that change, and knows how sure it is.
#ifndef DQW_TRACKER_H
#define DQW_TRACKER_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_gain.h"
#include "dqw_gate.h"
#include "dqw_model.h"
#include "dqw_noise.h"
#include "dqw_status.h"
#include "dqw_window.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Weights of the joint neuron. Bit i of a mask stands for weight i.
enum dqw_tracker_weight {
    DQW_TRACK_R = 0,
    DQW_TRACK_LD,
    DQW_TRACK_LQ,
    DQW_TRACK_PSI,
    DQW_TRACK_DEAD_TIME,  ///< V that the inverter takes from each phase
    DQW_TRACK_PSI_Q,      ///< flux linkage of the magnet that shows on the other axis: psi times the angle by which the encoder is off
    DQW_TRACK_WEIGHTS
};

/// Weights whose blocks' likeness is followed.
#define DQW_TRACK_SCORES 4

/// Signals of a tracker's block: the model's, then the dead time's input on d and q.
#define DQW_TRACK_SIGNALS (DQW_BLOCK_SIGNALS + 2)

/// All zero is refused. Constant: it may stay in flash.
typedef struct dqw_tracker_config {
    float dt_s;          ///< PWM period, > 0
    float v_base_V;      ///< rated voltage, current and mechanical speed: they scale. A sample beyond ten of them is saturated. > 0
    float i_base_A;      ///< > 0
    float w_base_rad_s;  ///< > 0
    float R_ohm;         ///< nominal values to start from, > 0. Never a prior
    float Ld_H;
    float Lq_H;
    float psi_Wb;
    uint16_t pole_pairs;      ///< > 0
    uint16_t half_window;     ///< pairs in half a block, 1 .. 10000; 0: 20
    float v_limit_V;          ///< samples beyond are saturated, and not learned; 0: ten bases
    float i_limit_A;          ///< the same
    float excitation_pu;      ///< an input whose power stays below this part of its base, squared, teaches nothing; 0: 0.01
    float dead_time_width_A;  ///< current at which the inverter's loss is three quarters of its full size; 0: no dead time is learned
    float drift_per_sqrt_s;   ///< how far a parameter may wander, as part of itself, in 1 s; 0: it is constant, and nothing is forgotten
    uint32_t stale_limit;     ///< equal samples in a row before a sensor counts as stuck; 0: never
    bool angle;               ///< cosine and sine are given: dead time and encoder offset need it
    bool noise_on_inputs;     ///< take the noise of currents and speed out of what is learned, (E60)
} dqw_tracker_config;

typedef struct dqw_tracker {
    const dqw_tracker_config *config;
    dqw_gate gate;
    dqw_window window;
    dqw_noise noise;
    // The joint neuron: its weights, per unit, and the gain that replaces its step size.
    float w_pu[DQW_TRACK_WEIGHTS];
    dqw_gain gain;
    float e_pu[2];                          ///< the last block's error before the correction, d and q
    float error_pu2[2];                     ///< mean squared residual, d and q
    float score2[DQW_TRACK_SCORES];         ///< R, L_d, L_q, flux: what a block teaches, squared,
    float score_lag[DQW_TRACK_SCORES];      ///< its likeness with the next one's,
    float score_last[DQW_TRACK_SCORES];     ///< and the last one's
    uint32_t halves;                        ///< halves of a window since init: the time,
    uint32_t at;                            ///< and when the last block was looked at
    float step_A_per_V[2];                  ///< what a volt moves the currents in one period, d and q: the interrupt's copy of dt/L
    int16_t excess_q10[DQW_TRACK_WEIGHTS];  ///< power of both axes' inputs above what teaches, over that; -1 .. 7
    uint16_t blocks;                        ///< learned, up to 65535
    uint8_t missed;                         ///< lost because the background came too late, up to 255
    uint8_t restarts;                       ///< times that the weights left all bounds, and learning began again, up to 255
    uint8_t learned;                        ///< weights of which anything was ever learned
    bool pending, last_good;
    // The last sample, and dead time's input there.
    float v_d_V, v_q_V, i_d_A, i_q_A, w_m_rad_s;
    float dead_d, dead_q, dead_slope_inv_A;
    float slow_d_A, slow_q_A, follow;  ///< currents as dead time's input takes them, and how fast they follow
    // Handed to the background: a block of pairs' sums and steps, and the angle's cosine and sine at its middle and at the end of the
    // last half, both 0 where it is not known.
    float block[DQW_TRACK_SIGNALS];
    float block_cosine, block_sine, half_cosine, half_sine;
} dqw_tracker;

/// Make a tracker.
///
/// Source   (E13) to (E17), (E60), (E61) in docs/EQUATIONS.md
/// Returns  DQW_OK; DQW_ERR_NULL, DQW_ERR_SIZE or DQW_ERR_RANGE, and then *t is untouched
/// Context  at start; the configuration stays in use as long as the object
enum dqw_status dqw_tracker_init(dqw_tracker *t, const dqw_tracker_config *config);

/// One PWM period.
///
/// Source   (E13), (E15), (E19), (E60) in docs/EQUATIONS.md
/// Units    SI; s->v_d_V, s->v_q_V as applied from this sample to the next
/// Range    any float; what cannot be learned is skipped and counted in t->gate
/// Returns  DQW_EVENT_* bits; DQW_EVENT_LEARNED: a block waits for dqw_tracker_learn
/// Cost     docs/firmware.md; no loop depends on data
/// Context  ISR safe; one writer per object
uint32_t dqw_tracker_sample(dqw_tracker *t, const dqw_sample *s, bool saturated);

/// Learn the block that waits, if there is one. Must come before the next: every half_window periods.
///
/// Source   (E16), (E17), (E60), (E61) in docs/EQUATIONS.md
/// Returns  true if a block was learned
/// Cost     docs/firmware.md
/// Context  background; dqw_tracker_sample may interrupt it
bool dqw_tracker_learn(dqw_tracker *t);

/// The same in three: does a block wait; learn it and go on holding it, for those who read it too; let the interrupt write the next one.
/// Context  background; dqw_tracker_sample may interrupt them
bool dqw_tracker_waits(const dqw_tracker *t);
bool dqw_tracker_learn_held(dqw_tracker *t);
void dqw_tracker_release(dqw_tracker *t);

/// Time has jumped: the next sample does not follow the last one. One call a gap; of its length a part of half a window is lost. Where single
/// samples are missing, rather pass one that is not a number for each.
///
/// Units    periods: PWM periods left out, 0 where nobody knows
/// Context  as dqw_tracker_sample
void dqw_tracker_gap(dqw_tracker *t, uint32_t periods);

/// For the tracker's own files: the start deviation of a weight, in nominal values, and of a block's residual, per unit: wide enough to be no
/// prior, and narrow enough that noise on a machine at rest moves nothing.
#define DQW_TRACK_START_SD 3.0f
#define DQW_TRACK_START_RESIDUAL_PU 0.01f

/// For the tracker's own files: forget what was learned, and a weight's start deviation per unit.
/// Source   (E61) in docs/EQUATIONS.md
void dqw_tracker_start(dqw_tracker *t);
float dqw_tracker_start_sd_pu(const dqw_tracker *t, int i);

/// The block that waits, or was learned last.
/// Source   (E13), (E15) in docs/EQUATIONS.md
/// Context  background
dqw_block dqw_tracker_block(const dqw_tracker *t);

/// The rows of the block that waits, or was learned last, as the joint neuron is shown them, per unit.
///
/// Source   (E13) in docs/EQUATIONS.md
/// Shape    x_d[DQW_TRACK_WEIGHTS], x_q[DQW_TRACK_WEIGHTS], y[2] written: inputs and targets of d and q
/// Context  background
void dqw_tracker_rows(const dqw_tracker *t, float x_d[], float x_q[], float y[]);

/// What one unit of a weight is, SI: weight per unit times this.
/// Source   (P15); (E7) in docs/EQUATIONS.md
float dqw_tracker_unit(const dqw_tracker_config *config, enum dqw_tracker_weight weight);

/// A parameter, SI, and its standard deviation; NaN and infinity for a weight that does not exist.
///
/// Source   (E20), (E61) in docs/EQUATIONS.md
/// Context  background, or wherever dqw_tracker_learn cannot come between
float dqw_tracker_value(const dqw_tracker *t, enum dqw_tracker_weight weight);
float dqw_tracker_sd(const dqw_tracker *t, enum dqw_tracker_weight weight);

/// Residual of both axes over the voltage base, RMS of about the last thousand blocks.
float dqw_tracker_residual_pu(const dqw_tracker *t);

#ifdef __cplusplus
}
#endif
#endif
