// What the plain model may lack: dead time, saturation, heat ... Each effect is a few more inputs of the axes'
// Learners, with weights that have a physical meaning. Which ones, and their shapes, is domain knowledge: from the data
// sheet, or from a trace.
#ifndef DQW_EFFECT_H
#define DQW_EFFECT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "dqw_effect_kind.h"
#include "dqw_model.h"
#include "dqw_parts.h"
#include "dqw_sample.h"
#include "dqw_size.h"
#include "dqw_status.h"
#include "dqw_window.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Weights of the whole list, all electrical or all mechanical.
///
/// Returns  the sum, <= DQW_EFFECT_WEIGHTS; or why no estimator takes the list: DQW_ERR_EFFECT_LIST without one,
///          DQW_ERR_EFFECT_NAME for an unknown or misplaced name, DQW_ERR_EFFECT_SHAPE for a shape or a start that is
///          not finite or has no meaning (a width of zero), DQW_ERR_EFFECT_TWICE for a second winding or magnet,
///          DQW_ERR_EFFECT_ROOM for more weights than that
int dqw_effect_check(const dqw_effect_config *list, int count, bool mechanical);

/// Of weights that belong to one effect, those that mean something: the deviation is below a quarter of the largest.
///
/// Returns  bit i: weight i is known
uint32_t dqw_effect_known(const float weights[], const float sd[], int n);

/// Torque of one unit of each weight: at speed w_m_rad_s and shaft angle theta_m_rad, x[weights of the effect] written.
///
/// Source   (E54) in docs/EQUATIONS.md
/// Context  ISR safe; no state
void dqw_effect_torque(const dqw_effect_config *config, float w_m_rad_s, float theta_m_rad, float x[]);

#if DQW_EFFECT_WEIGHTS > 0

/// Make the inputs of a list of electrical effects. A count of 0 costs nothing later on.
///
/// Source   (E50) in docs/EQUATIONS.md
/// Returns  DQW_OK; or as dqw_effect_check; DQW_ERR_DT, _V_BASE, _I_BASE, _W_BASE where a base is no positive number;
///          DQW_ERR_EFFECT_POLE_PAIRS without pole pairs: w_e is in most inputs. Then *e is untouched
/// Context  at start; the list stays in use as long as the object
#define dqw_effect_init DQW_SIZED(dqw_effect_init)
enum dqw_status dqw_effect_init(dqw_effect *e, const dqw_effect_config *list, int count, const dqw_effect_base *base);

/// What the interrupt has to gather of each entry of a list that is no longer than its weights, and one: the last step
/// of init.
void dqw_effect_plan(dqw_effect *e);

/// Weights of an effect in this list: those of its name, but none of a dead time that is someone else's.
static inline int dqw_effect_weights_of(const dqw_effect *e, enum dqw_effect_name name)
{
    return name == DQW_EFFECT_DEAD_TIME && e->base.dead_time_apart ? 0 : dqw_effect_weights(name);
}

/// What one unit of the weights of list entry `index` brings at the machine's bases, V: the base of their inputs is the
/// inverse.
float dqw_effect_input_base(const dqw_effect *e, int index);

/// True where every temperature that the effects need is a number. An angle is whoever's who has one to see to.
/// Cost     up to two comparisons
bool dqw_effect_finite(const dqw_effect *e, const dqw_sample *s);

/// Heating by the currents of a sample. Every sample heats, also one that may not be learned.
///
/// Source   (E55) in docs/EQUATIONS.md
/// Range    any float
/// Cost     3 flops, nothing without a heating state
/// Context  ISR safe; one writer per object
static inline void dqw_effect_heat(dqw_effect *e, float i_d_A, float i_q_A)
{
    if (e->heating != 0) e->square_A2 += i_d_A * i_d_A + i_q_A * i_q_A;
}

/// The heating states go on by what dqw_effect_heat() has gathered in so many periods: at the end of each half of a
/// window, of settled rows at each.
///
/// Source   (E55) in docs/EQUATIONS.md, one step of Euler's
/// Range    any; what is not finite heats nothing, more than ten bases on average as much as ten. The longest time
///          constant is 2^46 of these steps
/// Cost     nothing without a heating state; else 12 flops and a division, for each
/// Context  ISR safe; one writer per object
void dqw_effect_warm(dqw_effect *e, uint32_t periods);

/// The two ways of dqw_effect_gather: a pair, and one that cannot be.
bool dqw_effect_gather_pair(dqw_effect *e, const dqw_sample *before, const dqw_sample *s, dqw_window_cell cell[]);
bool dqw_effect_begin(dqw_effect *e, const dqw_sample *last, const dqw_sample *s);

/// Take the next sample: gather what the inputs of the pair that it ends are made of.
///
/// Source   (E50) to (E53) in docs/EQUATIONS.md; see dqw_effect_inputs
/// Shape    cell[2 * weights] of a window, added to where the result is true; `last` NULL after a gap or a sample that
///          was refused
/// Range    s finite. Powers of currents are in A: up to 1e5 A
/// Returns  true where there is a pair, for which the window's other signals may be added; an effect with
///          DQW_NEEDS_LAST needs the row before it as well
/// Cost     up to 40 instructions a weight on a Cortex-M4F: the table in docs/cost.md; no division, no function of the
///          C library
/// Context  ISR safe; one writer per object
static inline bool dqw_effect_gather(dqw_effect *e, const dqw_sample *last, const dqw_sample *s, dqw_window_cell cell[])
{
    return last != NULL && e->has_sample ? dqw_effect_gather_pair(e, last, s, cell) : dqw_effect_begin(e, last, s);
}

/// Inputs of a block, from the means of what was gathered: of weight i d[i] that of cell 2i, q[i] that of cell 2i + 1.
/// Trapezoid of f, slope of g, w_e J g.
///
/// Source   (E50) to (E53) in docs/EQUATIONS.md: of one pair exact; of a block where temperatures, and for
///          those with DQW_NEEDS_LAST the speed, change little in it
/// Shape    d[weights], q[weights] read and written; *b the same block's other means, in SI
/// Cost     about 20 flops a weight, some divisions
/// Context  background; reads of *e what init has set
void dqw_effect_inputs(const dqw_effect *e, const dqw_block *b, float d[], float q[]);

/// The same for one pair alone: its inputs.
///
/// Source   (E50) to (E53) in docs/EQUATIONS.md
/// Shape    d[weights], q[weights] written where the result is true
/// Returns  as dqw_effect_gather
bool dqw_effect_pair(dqw_effect *e, const dqw_sample *last, const dqw_sample *s, float d[], float q[]);

/// A settled row: no slope; `delay` in units of dt_s, to first order.
/// Source   (E50) in docs/EQUATIONS.md with d/dt = 0
void dqw_effect_static(dqw_effect *e, const dqw_sample *s, float d[], float q[]);

/// Dead time by its own law, where it has a weight in the list: its inputs of a pair, or of a settled row (`last`
/// NULL), which the calls above leave 0.
///
/// Source   (E51) in docs/EQUATIONS.md
/// Cost     6 tanhf
#define dqw_effect_dead_time DQW_SIZED(dqw_effect_dead_time)
void dqw_effect_dead_time(const dqw_effect *e, const dqw_sample *last, const dqw_sample *s, float d[], float q[]);

/// Time has jumped: the next sample ends no pair. Heat stays.
void dqw_effect_gap(dqw_effect *e);

#endif

#ifdef __cplusplus
}
#endif
#endif
