// For the library's own files: a block on its way through the background, and what the joint neuron is.
#ifndef DQW_ESTIMATOR_BLOCK_H
#define DQW_ESTIMATOR_BLOCK_H

#include "dqw_effect.h"
#include "dqw_estimator.h"
#include "dqw_gain.h"
#include "dqw_gate.h"
#include "dqw_model.h"
#include "dqw_noise.h"
#include "dqw_stage.h"
#include "dqw_window.h"

#ifdef __cplusplus
extern "C" {
#endif

/// A block: two halves that were handed over, joined.
typedef struct dqw_estimator_block {
    float sum[DQW_ESTIMATOR_SIGNALS];  ///< means of sums and steps of the pairs, under the triangle
    float v_step_V[2];                 ///< sum of the voltages of the second half less that of the first, d and q
    float cosine, sine;                ///< of the electrical angle at its middle; 0 and 0: not known
    float dead_slope_inv_A;            ///< as handed over with its second half
    dqw_noise_variances noise;
    int sixfold;  ///< sign of the cosine of six times what the angle has turned by in two halves; 0: not known
    bool whole;   ///< none of its pairs was refused
} dqw_estimator_block;

/// Weights in the place of dead time's and the other flux' while the pole pairs are not known.
enum { DQW_POLES_LD = DQW_DEAD_TIME, DQW_POLES_LQ = DQW_PSI_Q };

/// A block's residual to begin with, per unit: wide enough to be no prior, and narrow enough that noise on a machine at
/// rest moves nothing.
#define DQW_ESTIMATOR_START_RESIDUAL_PU 0.01f

/// The first ones are about the start values.
#define DQW_LASTING_FROM 50
/// What the others took up of a change, in bands, while it was not known. (E105)
#define DQW_TOOK_BANDS 3.0f

/// The two axes.
enum { DQW_AXIS_D = 0, DQW_AXIS_Q = 1 };

/// The weight that the flux of the other axis' current has in an axis' row: its inductance, or one of its own while the
/// pole pairs are not known.
static inline int dqw_estimator_cross(const dqw_estimator *e, int axis)
{
    const bool seeks = e->pole_pairs == 0 && !e->config->settled;
    return (seeks ? (int)DQW_POLES_LQ : (int)DQW_LQ) - axis;
}

/// The weight of the magnet's flux in an axis' row.
static inline int dqw_estimator_flux(int axis)
{
    return axis == DQW_AXIS_Q ? DQW_PSI : DQW_PSI_Q;
}

/// Are these learned?
static inline bool dqw_estimator_has_flux_q(const dqw_estimator *e)
{
    return e->config->encoder_offset && dqw_estimator_cross(e, DQW_AXIS_D) == DQW_LQ;
}
static inline bool dqw_estimator_has_dead_time(const dqw_estimator *e)
{
    return e->dead_time_width_A > 0.0f && dqw_estimator_cross(e, DQW_AXIS_D) == DQW_LQ;
}
static inline bool dqw_estimator_has_constant(const dqw_estimator *e)
{
    return dqw_estimator_has_dead_time(e) && e->modulation != (uint8_t)DQW_MODULATION_CENTRED;
}

/// Are a flux map's weights the first of the effects'? They are followed as the machine's own.
static inline bool dqw_estimator_has_map(const dqw_estimator *e)
{
#if DQW_MAP_WEIGHTS > 0
    return e->config->effect_count > 0 && e->config->effects[0].effect == DQW_EFFECT_FLUX_MAP;
#else
    (void)e;
    return false;
#endif
}

/// Is it known what lasts while nothing seems to change? One segment's statistics are few.
static inline bool dqw_estimator_knows_calm(const dqw_estimator *e)
{
    return e->segment.segments >= 2;
}

/// Is it none of the machine's own weights, nor a map's?
static inline bool dqw_estimator_is_apart(const dqw_estimator *e, int weight)
{
    return DQW_MAP_WEIGHTS > 0 && weight >= DQW_PARAMETERS && !dqw_estimator_has_map(e);
}

/// An inductance behind an observer's angle: its own constant puts the frame where the machine's L_q cannot be told from
/// it, and a current that it leans by passes for i_d. (E106)
static inline bool dqw_estimator_observer_hides(const dqw_estimator *e, int weight)
{
    return e->config->observed && (weight == DQW_LD || weight == DQW_LQ);
}

/// A block's rows as the joint neuron is shown them, per unit; variances of the noise of their inputs; the covariance
/// of the speed's two inputs in a row, the other axis' inductance and the flux; and those of dead time's with R's.
/// (E60)
typedef struct dqw_estimator_rows {
    float x[2][DQW_ESTIMATOR_INPUTS];  ///< inputs of d and q
    float y[2];                        ///< targets
    float late[2];                     ///< by how much a voltage one period late would differ
    float var[2][DQW_PARAMETERS];
    float speed[2];
    float dead_in_R[2], R_in_dead[2];
} dqw_estimator_rows;

/// The rows of a block, with the end correction. Of settled ones no noise.
///
/// Source   (E13), (E16), (E60), (E90) in docs/EQUATIONS.md
/// Context  background
#define dqw_estimator_rows_of DQW_SIZED(dqw_estimator_rows_of)
void dqw_estimator_rows_of(const dqw_estimator *e, const dqw_estimator_block *b, dqw_estimator_rows *r);

/// Variance of an axis' residual, and of both, never below that of the sampling.
/// Source   (E61) in docs/EQUATIONS.md
#define dqw_estimator_variance DQW_SIZED(dqw_estimator_variance)
float dqw_estimator_variance(const dqw_estimator *e, int axis);
float dqw_estimator_common_variance(const dqw_estimator *e);

/// The same over both axes' mean: one over the square by which its rows weigh, 1/64 at least.
#define dqw_estimator_axis_part DQW_SIZED(dqw_estimator_axis_part)
float dqw_estimator_axis_part(const dqw_estimator *e, int axis);

/// How large a parameter is, per unit: how far it may jump, and what heat may move it by, are parts of that.
/// Source   (E105) in docs/EQUATIONS.md
float dqw_estimator_size_pu(const dqw_estimator *e, int i);

/// Is what a drive leaves that starts forgotten? Settled rows are all of one kind.
/// Source   (E194) in docs/EQUATIONS.md
static inline bool dqw_estimator_forgets(const dqw_estimator *e)
{
    return e->config->follow && !e->config->settled;
}

/// Part of a mean over the last thousand blocks that a block is: while it is young, later blocks count for more, for
/// the first ones are about the start values.
/// Source   (E61), (E194) in docs/EQUATIONS.md
float dqw_estimator_part(const dqw_estimator *e);

/// The sample with the voltage that acts from it on, as a mean in the rotating frame, and mechanical speed.
/// Context  interrupt
#define dqw_estimator_adapt DQW_SIZED(dqw_estimator_adapt)
void dqw_estimator_adapt(dqw_estimator *e, const dqw_sample *s, dqw_sample *x);

/// Is every channel a number?
bool dqw_sample_finite(const dqw_sample *came, const dqw_sample *s);

/// Join the half that waits to a block, and let the interrupt hand over the next one.
///
/// Returns  false where none waits, or none is complete
/// Context  background; dqw_estimator_sample may interrupt it anywhere
#define dqw_estimator_take DQW_SIZED(dqw_estimator_take)
bool dqw_estimator_take(dqw_estimator *e, dqw_estimator_block *b);

/// How late is the speed? From the angle's advance over a half, where it has one; and the block's speeds, as of then.
///
/// Source   (E107) in docs/EQUATIONS.md
/// Shape    advance[2]: cosine and sine of the electrical angle's advance over the half, 0 and 0 where there is none
/// Units    w_m_rad_s: mean speed over the half
/// Returns  false: the speed is late, and nobody knows by how much it changed; the block teaches what is not so
/// Context  background
#define dqw_estimator_keep_pace DQW_SIZED(dqw_estimator_keep_pace)
bool dqw_estimator_keep_pace(dqw_estimator *e, dqw_estimator_block *b, const float advance[2], float w_m_rad_s);

/// Turn a block that was taken into the magnet's frame, as far as that is known. Without effect where effects are
/// learned: their laws saw the currents as they came.
///
/// Source   (E102) in docs/EQUATIONS.md
/// Context  background
#define dqw_estimator_turn_block DQW_SIZED(dqw_estimator_turn_block)
void dqw_estimator_turn_block(const dqw_estimator *e, dqw_estimator_block *b);

/// Does flux show on the other axis, and stay? Then later blocks are turned by that angle, and what was learned is less
/// sure.
///
/// Source   (E102) in docs/EQUATIONS.md
/// Context  background
#define dqw_estimator_turn_on DQW_SIZED(dqw_estimator_turn_on)
void dqw_estimator_turn_on(dqw_estimator *e);

/// Sign of cos(12 a), where a half turns by the angle a: of what turns six times with the rotor, blocks two halves apart
/// have products of this sign. advance: cosine and sine of a, of any length; 0: both are 0.
///
/// Source   (E103) in docs/EQUATIONS.md
/// Context  background
#define dqw_estimator_sixfold DQW_SIZED(dqw_estimator_sixfold)
int dqw_estimator_sixfold(const float advance[2]);

/// What lasts of the residual after this block's rows, and what of each input no other one explains after one row:
/// k[] is its gain, `seen` the part of its error that was known of it. (E103)
#define dqw_estimator_keep_lasting DQW_SIZED(dqw_estimator_keep_lasting)
void dqw_estimator_keep_lasting(dqw_estimator *e, const dqw_estimator_rows *r, const float ratio[2], int sixfold);
#define dqw_estimator_keep_alone DQW_SIZED(dqw_estimator_keep_alone)
void dqw_estimator_keep_alone(dqw_estimator *e, const float k[], float seen);

/// The narrowest band of each weight: band_pu[DQW_FOLLOWED] is written.
#define dqw_estimator_least_bands DQW_SIZED(dqw_estimator_least_bands)
void dqw_estimator_least_bands(const dqw_estimator *e, float band_pu[]);

/// Show a segment one axis' row, before it is learned; and a block that was learned: where the segment ends, a weight
/// may be found changed.
///
/// Source   (E104), (E105) in docs/EQUATIONS.md
/// Context  background
#define dqw_estimator_show_segment DQW_SIZED(dqw_estimator_show_segment)
void dqw_estimator_show_segment(dqw_estimator *e, int axis, const dqw_estimator_rows *r, uint32_t mask, float ratio);
#define dqw_estimator_follow DQW_SIZED(dqw_estimator_follow)
void dqw_estimator_follow(dqw_estimator *e, const dqw_estimator_block *b);

/// One learned block on in its segment of driving.
/// Returns  true where that ends
/// Source   (E104) in docs/EQUATIONS.md
#define dqw_estimator_segment_ends DQW_SIZED(dqw_estimator_segment_ends)
bool dqw_estimator_segment_ends(dqw_estimator *e, const dqw_estimator_block *b);

/// e->trial before the first trial; and learned blocks until then, in which an angle that is off has shown. (E102)
#define DQW_ESTIMATOR_SEEKS 255u
#define DQW_ESTIMATOR_SEEKS_FROM 800u

/// Are the legs that switch still to be found?
static inline bool dqw_estimator_seeks_legs(const dqw_estimator *e)
{
    return e->trial != 0 && e->pole_pairs != 0;
}

/// A block is shown to the trial; nothing is learned. At the trial's end one more begins, or it is found.
///
/// Source   (E101) in docs/EQUATIONS.md
/// Context  background
#define dqw_estimator_try DQW_SIZED(dqw_estimator_try)
void dqw_estimator_try(dqw_estimator *e, const dqw_estimator_block *b, const dqw_estimator_rows *r,
                       const uint32_t mask[2]);

/// Learn a block that was taken.
///
/// Source   (E16), (E17), (E60), (E61) in docs/EQUATIONS.md
/// Returns  true if it was learned
/// Context  background
#define dqw_estimator_learn DQW_SIZED(dqw_estimator_learn)
bool dqw_estimator_learn(dqw_estimator *e, const dqw_estimator_block *b);

/// Means and slopes of a block.
/// Source   (E13), (E15) in docs/EQUATIONS.md
#define dqw_estimator_means DQW_SIZED(dqw_estimator_means)
dqw_block dqw_estimator_means(const dqw_estimator *e, const dqw_estimator_block *b);

/// Forget what was learned, and start from these weights per unit; NULL: from the nominal values.
/// Source   (E61) in docs/EQUATIONS.md
void dqw_estimator_start(dqw_estimator *e, const float start_pu[]);

/// What one unit of a weight is, SI: weight per unit times this.
/// Source   (P15); (E7) in docs/EQUATIONS.md
float dqw_estimator_unit(const dqw_estimator *e, int weight);

/// Start deviation of a weight, per unit.
/// Source   (E61) in docs/EQUATIONS.md
float dqw_estimator_start_sd_pu(const dqw_estimator *e, int weight);

/// Where R, L_d, L_q or the flux starts, per unit: the nominal value, or what is usual.
float dqw_estimator_nominal_pu(const dqw_estimator *e, int weight);

/// A weight, SI. The flux on the other axis is that of the angle as it came.
/// Source   (E61), (E102) in docs/EQUATIONS.md
float dqw_estimator_value(const dqw_estimator *e, int weight);

/// Its deviation as noise makes it, and that of a change, in which what hides behind an input stands both times;
/// DQW_UNKNOWN where nothing was learned of it.
/// Source   (E20), (E61), (E106) in docs/EQUATIONS.md
float dqw_estimator_noise_sd(const dqw_estimator *e, int weight);
float dqw_estimator_sd(const dqw_estimator *e, int weight);
/// The same, so many segments after a weight was found changed.
float dqw_estimator_sd_since(const dqw_estimator *e, int weight, uint16_t since);

/// The same of the value itself, with the error of the voltage that the configuration allows for.
/// Source   (E61), (E106) in docs/EQUATIONS.md
float dqw_estimator_sd_value(const dqw_estimator *e, int weight);

/// Part of such a mean that a stretch of so many blocks is.
float dqw_lasting_part(const dqw_estimator *e, float stretch);

/// Blocks of a stretch, over which what is fast is averaged away.
/// Source   (E103) in docs/EQUATIONS.md
int dqw_estimator_stretch(const dqw_estimator *e);

/// What of the residual lasts now.
/// Source   (E103) in docs/EQUATIONS.md
dqw_lasting dqw_estimator_lasting(const dqw_estimator *e);

/// What of a lasting error may stand in line with a weight's input, per unit: the value is no surer than a part of it.
/// Source   (E103) in docs/EQUATIONS.md
#define dqw_estimator_model_pu DQW_SIZED(dqw_estimator_model_pu)
float dqw_estimator_model_pu(const dqw_estimator *e, int weight, const dqw_lasting *l);

/// What of the residual's lasting part may stand in line with an input of the witness, per unit, squared.
/// Source   (E103) in docs/EQUATIONS.md
float dqw_estimator_witness_pu2(const dqw_estimator *e);

/// Residual of both axes over the voltage base, RMS of about the last thousand blocks, and of the last 64.
float dqw_estimator_residual_pu(const dqw_estimator *e);
float dqw_estimator_recent_pu(const dqw_estimator *e);

/// One learned block on in Fig. 1's stages.
/// Source   (E21) in docs/EQUATIONS.md
void dqw_estimator_stage_on(dqw_estimator *e, bool random_converged);

/// Do the motion's blocks tell the pole pairs? Then the joint neuron goes on with them.
/// Source   (E22), (E91) in docs/EQUATIONS.md
#define dqw_poles_find DQW_SIZED(dqw_poles_find)
void dqw_poles_find(dqw_estimator *e);
/// p as the cross weights tell it, before it is taken for an integer, and its deviation; DQW_UNKNOWN where they cannot.
void dqw_poles_evidence(const dqw_estimator *e, float *p, float *sd);

#ifdef __cplusplus
}
#endif
#endif
