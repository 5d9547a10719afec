// For the port's own files: a block on its way through the background, and what the joint neuron is.
#ifndef DQW_ESTIMATOR_BLOCK_Q15_H
#define DQW_ESTIMATOR_BLOCK_Q15_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_estimator_q15.h"
#include "dqw_q15.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Slots of the flux that the other axis' current makes, as long as the pole pairs are not known: p L_d on q, p L_q on
/// d.
enum { DQW_POLES_LD_Q15 = DQW_DEAD_TIME, DQW_POLES_LQ_Q15 = DQW_PSI_Q };

/// Pole pairs by which inputs are scaled while they are not known: a power of two, so that nothing is lost when they
/// are found.
#define DQW_POLES_Q15_BITS 3u
#define DQW_POLES_Q15_SCALE (1u << DQW_POLES_Q15_BITS)

/// A block: two halves that were handed over, joined.
typedef struct dqw_estimator_q15_block {
    int32_t sums[DQW_ESTIMATOR_Q15_SIGNALS];  ///< under the triangle
    int32_t v_step_q15[2];          ///< sum of the voltages of the second half less that of the first, d and q
    dqw_estimator_q15_handed with;  ///< as handed over with its second half; but the angle is that at its middle
    uint16_t weight;                ///< of the sums
    int sixfold;  ///< sign of the cosine of six times what the angle has turned by in two halves; 0: not known
    bool whole;   ///< none of its pairs was refused
} dqw_estimator_q15_block;

/// Units of the weights as parts of the full voltage at full scale of what they act on, and where the weights start.
typedef struct dqw_units_q15 {
    int64_t R_q40;      ///< at the full current
    int64_t L_q40[2];   ///< at a step by the full current in one period, d and q
    int64_t X_q40[2];   ///< at full current and speed
    int64_t psi_q40;    ///< at full speed
    int64_t width_q40;  ///< of dead time, in full currents; 0: no dead time is learned
    uint32_t si[4];     ///< the units themselves: uOhm, nH, nH, nWb
    int32_t w_q24[4];   ///< nominal values in them
} dqw_units_q15;

/// What is known of the noise of an axis' inputs: variances, in the order of dqw_parameter.h, then the covariance of
/// the speed's two inputs, and those of dead time's with R's.
enum {
    DQW_NOISE_Q15_SPEED = DQW_PARAMETERS,
    DQW_NOISE_Q15_DEAD_IN_R,
    DQW_NOISE_Q15_R_IN_DEAD,
    DQW_NOISE_Q15_COVARIANCES,
};

/// One block's rows.
typedef struct dqw_rows_q15 {
    dqw_units_q15 unit;                               ///< of the weights
    int32_t x_q28[2][DQW_ESTIMATOR_Q15_INPUTS];       ///< inputs of d and q
    int32_t y_q28[2];                                 ///< targets
    int32_t late_q28[2];                              ///< what a voltage one period late differs by; 0: not known
    int64_t noise_q56[2][DQW_NOISE_Q15_COVARIANCES];  ///< of the inputs
} dqw_rows_q15;

/// Units of a configuration, for so many pole pairs; 0: not known.
/// Returns  DQW_OK, or the field with which they do not fit
enum dqw_status dqw_units_of_q15(const dqw_estimator_q15_config *config, uint32_t pole_pairs, dqw_units_q15 *u);

/// Join the half that waits to a block, and let the interrupt hand over the next one.
///
/// Returns  false where none waits, or none is complete
/// Context  background; dqw_estimator_sample_q15 may interrupt it anywhere
#define dqw_estimator_take_q15 DQW_SIZED(dqw_estimator_take_q15)
bool dqw_estimator_take_q15(dqw_estimator_q15 *e, dqw_estimator_q15_block *b);

/// How late is the speed? From the angle's advance over a half, where it has one; and the block's speeds, as of then.
///
/// Source   (E107) in docs/EQUATIONS.md
/// Shape    advance_q30[2]: cosine and sine of the electrical angle's advance over the half, 0 and 0 where there is
///          none
/// Format   w_sum_q15: sum of the half's speeds, of two samples each, below 2^24; |advance| up to 1.11
/// Returns  false: the speed is late, and nobody knows by how much it changed; the block teaches what is not so
/// Cost     40 products of 32 by 32 bits, 3 divisions of 32
/// Context  background
#define dqw_estimator_keep_pace_q15 DQW_SIZED(dqw_estimator_keep_pace_q15)
bool dqw_estimator_keep_pace_q15(dqw_estimator_q15 *e, dqw_estimator_q15_block *b, const int64_t advance_q30[2],
                                 int32_t w_sum_q15);

/// Turn a block that was taken into the magnet's frame, as far as that is known. Without effect where effects are
/// learned: their laws saw the currents as they came.
///
/// Source   (E102) in docs/EQUATIONS.md
/// Format   |sums| < h (h + 1) 2^17: turned they still fit
/// Cost     30 products of 32 by 32 bits; 16 more and 10 divisions of 32 where the angle is late
/// Context  background
#define dqw_estimator_turn_block_q15 DQW_SIZED(dqw_estimator_turn_block_q15)
void dqw_estimator_turn_block_q15(const dqw_estimator_q15 *e, dqw_estimator_q15_block *b);

/// Does flux show on the other axis, and stay? Then later blocks are turned by that angle, and what was learned is less
/// sure. Only where the weights were just solved: the sums go on around the turned ones.
///
/// Source   (E102) in docs/EQUATIONS.md
/// Context  background
#define dqw_estimator_turn_on_q15 DQW_SIZED(dqw_estimator_turn_on_q15)
void dqw_estimator_turn_on_q15(dqw_estimator_q15 *e, const dqw_units_q15 *u, bool solved);

/// A weight in its unit, the flux on the other axis as that of the angle as it came.
/// Source   (E20), (E102) in docs/EQUATIONS.md
#define dqw_estimator_value_q24 DQW_SIZED(dqw_estimator_value_q24)
int32_t dqw_estimator_value_q24(const dqw_estimator_q15 *e, int weight);

/// A block is shown to the trial which legs switch; nothing is learned. At the trial's end one more begins, or it is
/// found.
///
/// Source   (E101) in docs/EQUATIONS.md
/// Cost     as dqw_estimator_show_q15; at the trial's end dqw_normal_solve_q15 twice
/// Context  background
#define dqw_estimator_try_q15 DQW_SIZED(dqw_estimator_try_q15)
void dqw_estimator_try_q15(dqw_estimator_q15 *e, const dqw_estimator_q15_block *b, const dqw_rows_q15 *r,
                           const uint32_t mask[]);

/// One learned block on in its segment of driving.
/// Source   (E104) in docs/EQUATIONS.md
/// Returns  true where that ends
bool dqw_estimator_segment_ends_q15(dqw_estimator_q15 *e, const dqw_estimator_q15_block *b);

/// Learn a block that was taken.
///
/// Source   (E16), (E17), (E60), (E61), (E70), (E71) in docs/EQUATIONS.md
/// Returns  true if it was learned
/// Context  background
#define dqw_estimator_learn_q15 DQW_SIZED(dqw_estimator_learn_q15)
bool dqw_estimator_learn_q15(dqw_estimator_q15 *e, const dqw_estimator_q15_block *b);

/// Means of a block.
/// Source   (E13), (E15) in docs/EQUATIONS.md
#define dqw_estimator_means_q15 DQW_SIZED(dqw_estimator_means_q15)
dqw_block_q15 dqw_estimator_means_q15(const dqw_estimator_q15_block *b);

/// The same as rows, with the end correction.
///
/// Source   (E13), (E16), (E60) in docs/EQUATIONS.md
/// Cost     about 100 products of 64 bits
#define dqw_estimator_rows_of_q15 DQW_SIZED(dqw_estimator_rows_of_q15)
void dqw_estimator_rows_of_q15(const dqw_estimator_q15 *e, const dqw_estimator_q15_block *b, dqw_rows_q15 *r);

/// Largest input of a weight's unit, as part of the full voltage: by it a weight is in bases. Of an effect, its usual
/// input.
int64_t dqw_estimator_whole_q40(const dqw_estimator_q15 *e, const dqw_units_q15 *u, int weight);

/// Are the pole pairs still to be found? Then the flux of the other axis' current has a slot of its own.
static inline bool dqw_estimator_seeks_q15(const dqw_estimator_q15 *e)
{
    return e->pole_pairs == 0 && !e->config->settled;
}

/// Slot of the flux of the other axis' current in a row of this axis.
static inline int dqw_estimator_cross_q15(const dqw_estimator_q15 *e, int axis)
{
    return (dqw_estimator_seeks_q15(e) ? (int)DQW_POLES_LQ_Q15 : (int)DQW_LQ) - axis;
}

/// e->trial before the first one; and learned blocks until then, in which an angle that is off has shown. (E102)
#define DQW_ESTIMATOR_SEEKS_Q15 255u
#define DQW_ESTIMATOR_SEEKS_FROM_Q15 800u

/// Are the legs that switch still to be found?
static inline bool dqw_estimator_seeks_legs_q15(const dqw_estimator_q15 *e)
{
    return e->trial != 0 && e->pole_pairs != 0;
}

/// What this configuration and what is known of the pole pairs leave to be learned.
static inline bool dqw_estimator_has_dead_time_q15(const dqw_estimator_q15 *e)
{
    return e->wide_q28 > 0 && !dqw_estimator_seeks_q15(e);
}
static inline bool dqw_estimator_has_constant_q15(const dqw_estimator_q15 *e)
{
    return dqw_estimator_has_dead_time_q15(e) && e->modulation != (uint8_t)DQW_MODULATION_CENTRED;
}
static inline bool dqw_estimator_has_psi_q_q15(const dqw_estimator_q15 *e)
{
    return e->config->encoder_offset && !dqw_estimator_seeks_q15(e);
}

/// An effect's weight is in units of so many halvings of its input; a parameter's of none.
static inline unsigned dqw_estimator_shift_q15(const dqw_estimator_q15 *e, int weight)
{
#if DQW_EFFECT_WEIGHTS > 0
    if (weight >= DQW_PARAMETERS) return e->shift[weight - DQW_PARAMETERS];
#endif
    (void)e;
    (void)weight;
    return 0;
}

/// Are a flux map's weights the first of the effects'? They are followed as the machine's own.
static inline bool dqw_estimator_has_map_q15(const dqw_estimator_q15 *e)
{
#if DQW_MAP_WEIGHTS > 0
    return e->effect.count > 0 && e->effect.list[0].effect == DQW_EFFECT_FLUX_MAP;
#else
    (void)e;
    return false;
#endif
}

/// Is it known what lasts while nothing seems to change? One segment's statistics are few.
static inline bool dqw_estimator_knows_calm_q15(const dqw_estimator_q15 *e)
{
    return e->segment.segments >= 2;
}

/// Is it none of the machine's own weights, nor a map's?
static inline bool dqw_estimator_is_apart_q15(const dqw_estimator_q15 *e, int weight)
{
    return DQW_MAP_WEIGHTS > 0 && weight >= DQW_PARAMETERS && !dqw_estimator_has_map_q15(e);
}

/// An inductance behind an observer's angle: its own constant puts the frame where the machine's L_q cannot be told from
/// it, and a current that it leans by passes for i_d. (E106)
static inline bool dqw_estimator_observer_hides_q15(const dqw_estimator_q15 *e, int weight)
{
    return e->config->observed && (weight == DQW_LD || weight == DQW_LQ);
}

/// Of a weight's input what it is of as many halvings as the weight is counted in, and back: by its power or two.
static inline int64_t dqw_estimator_counted_q15(const dqw_estimator_q15 *e, int weight, int64_t x, int power)
{
#if DQW_MAP_WEIGHTS > 0
    const int shift = (int)dqw_estimator_shift_q15(e, weight);
    return dqw_q_scale64(x, power * shift);
#else
    (void)e;
    (void)weight;
    (void)power;
    return x;
#endif
}

/// Inputs of the joint neuron: a constant where there is no room for effects.
static inline int dqw_estimator_inputs_q15(const dqw_estimator_q15 *e)
{
#if DQW_EFFECT_WEIGHTS > 0
    return e->inputs;
#else
    (void)e;
    return DQW_PARAMETERS;
#endif
}

/// Variance of a weight that starts, per unit of the residual's.
/// Source   (E61) in docs/EQUATIONS.md
int64_t dqw_estimator_start_cov_q40(const dqw_estimator_q15 *e, const dqw_units_q15 *u, int weight);

/// Forget what was learned, and start from these weights; NULL: from the nominal values.
/// Source   (E61) in docs/EQUATIONS.md
void dqw_estimator_start_q15(dqw_estimator_q15 *e, const int32_t start_q24[]);

/// What an axis' row leaves of its target, Q28, bounded.
int32_t dqw_estimator_error_q28(const dqw_estimator_q15 *e, int axis, const dqw_rows_q15 *r);

/// One axis' row to the sums, around the weights as solved last; weighed by how little of that axis is noise.
/// e->e_q28[axis] is its error.
///
/// Source   (E61), (E70), (E90) in docs/EQUATIONS.md
/// Format   weigh_q24 up to 8: one over the root of the axis' part of the variance
/// Context  background
#define dqw_estimator_show_q15 DQW_SIZED(dqw_estimator_show_q15)
void dqw_estimator_show_q15(dqw_estimator_q15 *e, int axis, const dqw_rows_q15 *r, uint32_t mask, int64_t weigh_q24);

/// Noise of the inputs turns the gradient by C w: put back, b += C w. Not where it is much of what was learned, there
/// it could run away.
///
/// Source   (E60), (E70) in docs/EQUATIONS.md: (A^-1)(b + C w) is w + P C w
/// Format   by_q24[2]: the weighing of d and q, squared
/// Context  background
void dqw_estimator_take_noise_out_q15(dqw_estimator_q15 *e, const dqw_rows_q15 *r, const int64_t by_q24[],
                                      const uint32_t mask[]);

/// Weights that explain all that was shown; the sums go on around them.
///
/// Source   (E70) in docs/EQUATIONS.md
/// Context  background
#define dqw_estimator_solve_q15 DQW_SIZED(dqw_estimator_solve_q15)
void dqw_estimator_solve_q15(dqw_estimator_q15 *e);

/// Do the blocks tell the pole pairs? Then the joint neuron goes on with them. Of weights that were just solved, with
/// the block learned last.
///
/// Source   (E22), (E91) in docs/EQUATIONS.md
/// Context  background
#define dqw_poles_find_q15 DQW_SIZED(dqw_poles_find_q15)
void dqw_poles_find_q15(dqw_estimator_q15 *e, const dqw_estimator_q15_block *b);

/// Variance of an axis' residual, and of both, never below that of the sampling, Q56.
/// Source   (E61) in docs/EQUATIONS.md
#define dqw_estimator_variance_q56 DQW_SIZED(dqw_estimator_variance_q56)
int64_t dqw_estimator_variance_q56(const dqw_estimator_q15 *e, int axis);
int64_t dqw_estimator_common_variance_q56(const dqw_estimator_q15 *e);

/// How much wider a weight's deviation is for the autocorrelation of what blocks teach it, squared, Q20.
/// Source   (E20), (E61) in docs/EQUATIONS.md
int64_t dqw_estimator_inflation_q20(const dqw_estimator_q15 *e, int weight);

/// Standard deviation of a weight as noise makes it, and that of a change, in which what hides behind an input stands
/// both times; in its unit, INT32_MAX where nothing was learned.
/// Source   (E20), (E61), (E106) in docs/EQUATIONS.md
int32_t dqw_estimator_noise_sd_q24(const dqw_estimator_q15 *e, int weight);
int32_t dqw_estimator_sd_q24(const dqw_estimator_q15 *e, int weight);
/// The same, so many segments after a weight was found changed.
int32_t dqw_estimator_sd_since_q24(const dqw_estimator_q15 *e, int weight, uint16_t since);

/// What of the residual lasts, squared: two and three blocks later, from one stretch to the next; and all of it.
typedef struct dqw_lasting_q15 {
    int64_t fast_q56, slow_q56, all_q56, turning_q56;
} dqw_lasting_q15;

/// What of it lasts now, and what while nothing seems to change.
/// Source   (E103) in docs/EQUATIONS.md
dqw_lasting_q15 dqw_estimator_lasting_q15(const dqw_estimator_q15 *e);
dqw_lasting_q15 dqw_estimator_calm_q15(const dqw_estimator_q15 *e);

/// What of a lasting error may stand in line with a weight's input, in weights of a whole input: the value is no surer
/// than a part of it; INT32_MAX: nobody knows.
/// Source   (E103) in docs/EQUATIONS.md
int32_t dqw_estimator_model_q28(const dqw_estimator_q15 *e, int weight, const dqw_lasting_q15 *l);

/// What of the residual's lasting part may stand in line with an input of the witness, squared.
/// Source   (E103) in docs/EQUATIONS.md
int64_t dqw_estimator_witness_q56(const dqw_estimator_q15 *e);

/// Part of a mean over the last so many blocks that a stretch is: while it is young, later ones count for more, for the
/// first ones are about the start values; by far where a start is forgotten.
/// Source   (E194) in docs/EQUATIONS.md
/// Range    blocks >= stretch 1 .. 200
int32_t dqw_mean_part_q30(const dqw_estimator_q15 *e, uint32_t blocks, uint32_t stretch, uint32_t memory);

/// The same of what lasts.
/// Source   (E103) in docs/EQUATIONS.md
int32_t dqw_lasting_part_q30(const dqw_estimator_q15 *e, uint32_t stretch);

/// The first blocks are about the start values: behind so many.
#define DQW_LASTING_FROM_Q15 50u
/// What the others took up of a change, in bands, while it was not known. (E105)
#define DQW_TOOK_BANDS_Q15 3

/// Blocks of a stretch, over which what is fast is averaged away.
/// Source   (E103) in docs/EQUATIONS.md
uint32_t dqw_estimator_stretch_q15(const dqw_estimator_q15 *e);

/// Is what a drive leaves that starts forgotten? Settled rows are all of one kind.
/// Source   (E194) in docs/EQUATIONS.md
static inline bool dqw_estimator_forgets_q15(const dqw_estimator_q15 *e)
{
    return e->config->follow && !e->config->settled;
}

/// Are changes followed by segments now?
static inline bool dqw_estimator_follows_q15(const dqw_estimator_q15 *e)
{
    return dqw_estimator_forgets_q15(e) && e->pole_pairs != 0 && e->stage.name != DQW_STAGE_RANDOM &&
           !dqw_estimator_seeks_legs_q15(e);
}

/// Nothing is known of what lasts, nor of how weights scatter.
/// Source   (E104) in docs/EQUATIONS.md
void dqw_estimator_follow_start_q15(dqw_estimator_q15 *e);

/// Sign of cos(12 a), where a half turns by the angle a: of what turns six times with the rotor, blocks two halves apart
/// have products of this sign. advance: cosine and sine of a, Q30, as long as a sensor makes them; 0: both are 0.
///
/// Source   (E103) in docs/EQUATIONS.md
/// Context  background
#define dqw_estimator_sixfold_q15 DQW_SIZED(dqw_estimator_sixfold_q15)
int dqw_estimator_sixfold_q15(const int64_t advance_q30[2]);

/// What of the residual is still there two and three blocks later, where blocks overlap no more; and from one stretch
/// to the next. Of a block that was shown. `busy`: its weights are to be solved as well; then a stretch may end later.
///
/// Source   (E103) in docs/EQUATIONS.md
/// Context  background
#define dqw_estimator_keep_lasting_q15 DQW_SIZED(dqw_estimator_keep_lasting_q15)
void dqw_estimator_keep_lasting_q15(dqw_estimator_q15 *e, const dqw_rows_q15 *r, const int64_t weigh_q24[], int sixfold,
                                    bool busy);

/// The inputs as the others leave them: by what so many rows added to the inverse of each weight's variance, which was
/// before_q40[].
///
/// Source   (E103) in docs/EQUATIONS.md
/// Context  background
void dqw_estimator_keep_alone_q15(dqw_estimator_q15 *e, const int64_t before_q40[], uint32_t rows);

/// By how much a weight changes where the late voltage is one of the inputs.
///
/// Source   (E90) in docs/EQUATIONS.md
/// Context  background
#define dqw_estimator_beside_late_q24 DQW_SIZED(dqw_estimator_beside_late_q24)
int64_t dqw_estimator_beside_late_q24(const dqw_estimator_q15 *e, int weight);

/// What of an inductance's power is noise: of each row, as (E60) takes it out. (E188)
#define dqw_estimator_keep_noisy_q15 DQW_SIZED(dqw_estimator_keep_noisy_q15)
void dqw_estimator_keep_noisy_q15(dqw_estimator_q15 *e, int L, int64_t noisy_q48);

/// One learned block on in its segment. Where that ends: who has changed is opened; who may have wandered is no surer
/// than that.
///
/// Source   (E103), (E104), (E105) in docs/EQUATIONS.md
/// Context  background
void dqw_estimator_follow_q15(dqw_estimator_q15 *e, const dqw_estimator_q15_block *b);

/// Residual of both axes over the full voltage: RMS of about the last thousand blocks, Q28, and of the last 64, Q27 and
/// in millionths.
uint32_t dqw_estimator_residual_q28(const dqw_estimator_q15 *e);
uint32_t dqw_estimator_recent_q27(const dqw_estimator_q15 *e);
uint32_t dqw_estimator_recent_ppm_q15(const dqw_estimator_q15 *e);

/// One block on in Fig. 1's stages.
/// Source   (E21) in docs/EQUATIONS.md
void dqw_estimator_stage_on_q15(dqw_estimator_q15 *e, bool random_converged);

/// How large a parameter is: how far it may jump, and what heat may move it by, are parts of that.
///
/// Source   (E105) in docs/EQUATIONS.md
/// Format   Q24, with the halvings of its input
int64_t dqw_estimator_size_q24(const dqw_estimator_q15 *e, int i);

#ifdef __cplusplus
}
#endif
#endif
