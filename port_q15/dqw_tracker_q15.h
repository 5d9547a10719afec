// The tracker in whole numbers: one neuron for both axes of a machine whose pole pairs are known. Its weights are parts of the nominal
// values, so that every input is a voltage and every weight about 1.
#ifndef DQW_TRACKER_Q15_H
#define DQW_TRACKER_Q15_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_gate.h"
#include "dqw_model_q15.h"
#include "dqw_noise_q15.h"
#include "dqw_normal_q15.h"
#include "dqw_scale.h"
#include "dqw_status.h"
#include "dqw_window_q15.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Weights of the joint neuron, in the order of dqw_tracker.h. Bit i of a mask stands for weight i.
enum dqw_tracker_weight_q15 {
    DQW_TRACK_R_Q15 = 0,
    DQW_TRACK_LD_Q15,
    DQW_TRACK_LQ_Q15,
    DQW_TRACK_PSI_Q15,
    DQW_TRACK_DEAD_TIME_Q15,  ///< what the inverter takes from each phase, in parts of v_full / 30
    DQW_TRACK_PSI_Q_Q15,      ///< flux linkage of the magnet on the other axis, in parts of the nominal flux
    DQW_TRACK_Q15_WEIGHTS
};

/// Weights whose blocks' likeness is followed.
#define DQW_TRACK_Q15_SCORES 4

/// Signals of a tracker's block: the model's, then the dead time's input on d and q.
#define DQW_TRACK_Q15_SIGNALS (DQW_BLOCK_Q15_SIGNALS + 2)

/// Dead time's unit is the full voltage over this.
#define DQW_TRACK_Q15_DEAD_PARTS 30

/// All zero is refused. Constant: it may stay in flash.
typedef struct dqw_tracker_q15_config {
    dqw_scale scale;                         ///< full scales: they are the bases too; pole_pairs > 0
    uint32_t R_uohm, Ld_nH, Lq_nH, psi_nWb;  ///< nominal values to start from, > 0. Never a prior
    uint32_t dead_time_width_mA;             ///< current at which the inverter's loss is three quarters of its full size; 0: no dead time is learned
    uint32_t drift_ppm;                      ///< how far a parameter may wander in 1 s, in millionths of itself, up to 10^6; 0: nothing is forgotten
    uint32_t stale_limit;                    ///< equal samples in a row before a sensor counts as stuck; 0: never
    uint16_t excitation_q15;                 ///< an input whose power stays below this part of its full scale, squared, teaches nothing; 0: 328 (0.01)
    uint8_t half_window;                     ///< pairs in half a block, 1 .. 100; 0: 20
    uint8_t solve_blocks;                    ///< blocks between two solutions once 64 were learned; 0: 4. More cost less
    bool angle;                              ///< cosine and sine are given: dead time and encoder offset need it
    bool noise_on_inputs;                    ///< take the noise of currents and speed out of what is learned, (E60)
} dqw_tracker_q15_config;

typedef struct dqw_tracker_q15 {
    const dqw_tracker_q15_config *config;
    dqw_gate gate;
    dqw_window_q15 window;
    dqw_noise_q15 noise;
    // The joint neuron: weights as solved last, what was learned of them, and what was shown since.
    int32_t w_q24[DQW_TRACK_Q15_WEIGHTS];  ///< |w| < 2^30
    dqw_normal_q15 normal;
    int64_t cov_q40[DQW_TRACK_Q15_WEIGHTS];        ///< P_ii, per unit of the residual's variance
    int64_t error_q56[2];                          ///< mean squared residual, d and q
    int64_t score2_q68[DQW_TRACK_Q15_SCORES];      ///< R, L_d, L_q, flux: what a block teaches, squared,
    int64_t score_lag_q68[DQW_TRACK_Q15_SCORES];   ///< its likeness with the next one's,
    int32_t score_last_q34[DQW_TRACK_Q15_SCORES];  ///< and the last one's
    int32_t e_q28[2];                              ///< the last block's error before the correction, d and q
    uint32_t halves;                               ///< halves of a window since init: the time,
    uint32_t at;                                   ///< when the last block was looked at,
    uint32_t drifted, span;                        ///< when the last turn of drift began, and how long the one before took
    int16_t excess_q10[DQW_TRACK_Q15_WEIGHTS];     ///< power of both axes' inputs above what teaches, over that; -1 .. 7
    int16_t step_q15[2];                           ///< part of the full current that the full voltage moves in a period, d and q: the interrupt's copy
    uint16_t blocks;                               ///< learned, up to 65535
    uint8_t missed;                                ///< lost because the background came too late, up to 255
    uint8_t restarts;                              ///< times that the weights left all bounds, and learning began again, up to 255
    uint8_t learned;                               ///< weights of which anything was ever learned
    uint8_t turn;                                  ///< weight whose variance grows next
    bool pending, has_last, last_good;
    // The last sample, and dead time's input there.
    dqw_sample_q15 last;
    int32_t dead_d_q15, dead_q_q15;  ///< |D| <= 4/3
    int32_t slow_d_q28, slow_q_q28;  ///< currents as dead time's input takes them,
    int32_t width3_q28, per_width3;  ///< three widths, and 2^47 over that
    uint32_t slope_q15;              ///< sum of the tanh's slopes, of 1 at no current, over the last rows
    uint16_t slopes, follow_q15;     ///< up to 1024; how fast the currents follow, 1 .. 32768
    // Handed to the background.
    int32_t block[DQW_TRACK_Q15_SIGNALS];
    dqw_noise_means_q15 means;
    uint16_t weight;
    int16_t block_cosine_q15, block_sine_q15, half_cosine_q15, half_sine_q15;
} dqw_tracker_q15;

/// Make a tracker.
///
/// Source   (E13) to (E17), (E60), (E61), (E70), (E71) in docs/EQUATIONS.md
/// Returns  DQW_OK; DQW_ERR_NULL, DQW_ERR_SIZE or DQW_ERR_RANGE, and then *t is untouched
/// Context  at start; the configuration stays in use as long as the object
enum dqw_status dqw_tracker_init_q15(dqw_tracker_q15 *t, const dqw_tracker_q15_config *config);

/// One PWM period.
///
/// Source   (E13), (E15), (E19), (E60) in docs/EQUATIONS.md
/// Format   Q15 of the full scales; s->v_d_q15, s->v_q_q15 as applied from this sample to the next
/// Range    any; beyond full scale (-32768, -32767, 32767) it is counted as saturated and not learned
/// Returns  DQW_EVENT_* bits; DQW_EVENT_LEARNED: a block waits for dqw_tracker_learn_q15
/// Cost     the table in README.md; no loop depends on data
/// Context  ISR safe; one writer per object
uint32_t dqw_tracker_sample_q15(dqw_tracker_q15 *t, const dqw_sample_q15 *s, bool saturated);

/// Learn the block that waits, if there is one. Must come before the next: every half_window periods.
///
/// Source   (E16), (E17), (E60), (E61), (E70), (E71) in docs/EQUATIONS.md
/// Returns  true if a block was learned
/// Context  background; dqw_tracker_sample_q15 may interrupt it
bool dqw_tracker_learn_q15(dqw_tracker_q15 *t);

/// The same in three: does a block wait; learn it and go on holding it, for those who read it too; let the interrupt write the next one.
/// Context  background; dqw_tracker_sample_q15 may interrupt them
bool dqw_tracker_waits_q15(const dqw_tracker_q15 *t);
bool dqw_tracker_learn_held_q15(dqw_tracker_q15 *t);
void dqw_tracker_release_q15(dqw_tracker_q15 *t);

/// Time has jumped: the next sample does not follow the last one. One call a gap; of its length a part of half a window is lost.
///
/// Format   periods: PWM periods left out, 0 where nobody knows
/// Context  as dqw_tracker_sample_q15
void dqw_tracker_gap_q15(dqw_tracker_q15 *t, uint32_t periods);

/// What 1 of a weight is: uOhm, nH, nH, nWb, uV, nWb; 0 for a weight that does not exist.
uint32_t dqw_tracker_unit_q15(const dqw_tracker_q15_config *config, enum dqw_tracker_weight_q15 weight);

/// A parameter, and its standard deviation, in dqw_tracker_unit_q15(); INT32_MAX for what is not known.
///
/// Source   (E20), (E61) in docs/EQUATIONS.md
/// Format   Q24
/// Context  background, or wherever dqw_tracker_learn_q15 cannot come between
int32_t dqw_tracker_value_q15(const dqw_tracker_q15 *t, enum dqw_tracker_weight_q15 weight);
int32_t dqw_tracker_sd_q15(const dqw_tracker_q15 *t, enum dqw_tracker_weight_q15 weight);

/// Residual of both axes over the full voltage, RMS of about the last thousand blocks, Q28.
uint32_t dqw_tracker_residual_q28(const dqw_tracker_q15 *t);

/// Means of the block that waits, or was learned last.
/// Source   (E13), (E15) in docs/EQUATIONS.md
/// Context  background
dqw_block_q15 dqw_tracker_block_q15(const dqw_tracker_q15 *t);

/// For the tracker's own files: forget what was learned.
void dqw_tracker_start_q15(dqw_tracker_q15 *t);

#ifdef __cplusplus
}
#endif
#endif
