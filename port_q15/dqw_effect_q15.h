// What the plain model may lack, in whole numbers: each electrical effect is a few more inputs of the axes' neurons.
// Inputs are per unit of a base of their own, chosen at init so that none can exceed it; read-outs restore it.
#ifndef DQW_EFFECT_Q15_H
#define DQW_EFFECT_Q15_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_effect_kind.h"
#include "dqw_scale.h"
#include "dqw_size.h"
#include "dqw_status.h"

#ifdef __cplusplus
extern "C" {
#endif

#if DQW_EFFECT_WEIGHTS > 0

/// Numbers that a law needs for each of its inputs, at most.
#define DQW_EFFECT_Q15_PARTS 5

/// The highest flux harmonic.
#define DQW_EFFECT_Q15_ORDERS 100u

/// One effect and its shape; what its law does not name is not read. Constant: it may stay in flash.
typedef struct dqw_effect_q15_config {
    enum dqw_effect_name effect;
    /// dead time: width; polynomials: their unit; heating: the current that heats by 1, 0: the full one
    uint32_t i_uA;
    /// iron loss and sensors: R, L_d, L_q; angle offset: L_d, L_q, psi; flux map: psi, its table's largest flux
    uint32_t R_uohm, Ld_nH, Lq_nH, psi_nWb;
    uint32_t cell_d_uA, cell_q_uA;  ///< flux map: from node to node, a 127th of the full current or more
    const int16_t *map;             ///< the same: its table, as dqw_effect_name.h has it
    uint64_t tau_us;  ///< temperatures: time constant of a heating state, up to 10^12; 0: the sample's temperature
    uint32_t row_us;  ///< the same: time between two rows that are settled; 0: the sampling period
    int16_t T_0_cC;   ///< the same: temperature at which the effect is none, hundredths of a degree
    uint16_t order;   ///< flux harmonics: 1 .. DQW_EFFECT_Q15_ORDERS
    /// weights to start from, as dqw_estimator_effect_q15 reads them. Never a prior
    int64_t start_q40[DQW_EFFECT_STARTS];
} dqw_effect_q15_config;

/// The configured effects of one machine, with the last sample's part of each input.
typedef struct dqw_effect_q15 {
    const dqw_effect_q15_config *list;
    const dqw_scale *scale;
    // Per weight, in `fraction` fraction bits: voltage f + w_e J g of the last sample, |a| <= 2; flux linkage g of it,
    // |g| <= 1.
    int32_t a_d[DQW_EFFECT_WEIGHTS], a_q[DQW_EFFECT_WEIGHTS];
    int32_t g_d[DQW_EFFECT_WEIGHTS], g_q[DQW_EFFECT_WEIGHTS];
    int32_t part_q30[DQW_EFFECT_WEIGHTS + 1]
                    [DQW_EFFECT_Q15_PARTS];    ///< of each effect: what its law multiplies by, |.| <= 1
    int32_t base_q28[DQW_EFFECT_WEIGHTS + 1];  ///< of each effect: what a usual input is, per unit of its base
    uint8_t shift[DQW_EFFECT_WEIGHTS + 1];     ///< of each effect: fraction bits of a first part that may be any number
    int64_t heat_q60[2];                       ///< winding, magnet: the state, of the full current squared; 0 .. 2
    /// the last sample's voltage less that of the one before, as seen in its period; |.| <= 2.42
    int32_t late_d_q28, late_q_q28;
    int32_t turn_q30;  ///< electrical angle a period at full speed, rad; settled: 1
    uint8_t count, weights, fraction;
    bool settled, dead_time_apart, needs_angle, needs_winding, needs_magnet, needs_last;
    bool has_sample;
} dqw_effect_q15;

/// What scales an estimator's effects.
typedef struct dqw_effect_q15_base {
    const dqw_scale *scale;  ///< stays in use as long as the object; pole_pairs > 0
    bool settled;            ///< every sample is a settled point of its own
    bool dead_time_apart;    ///< dead time in the list is someone else's weight: it has none here
    uint8_t half_window;     ///< pairs in half a block, 1 .. 100: what is left of 31 bits is the inputs'
} dqw_effect_q15_base;

/// Make the inputs of a list of electrical effects. A count of 0 costs nothing later on.
///
/// Source   (E50), (E75) in docs/EQUATIONS.md
/// Range    a width of 2^-15 of the full current or more; a polynomial's unit, and the current that heats, within 1/64
///          and 16 of it; R T < 8 L for iron loss. The scale has been checked
/// Returns  DQW_OK; DQW_ERR_NULL; or why no estimator takes the list: DQW_ERR_EFFECT_LIST without one,
///          DQW_ERR_EFFECT_POLE_PAIRS without pole pairs, DQW_ERR_EFFECT_NAME for an unknown or mechanical effect,
///          DQW_ERR_EFFECT_SHAPE for a shape without a meaning, DQW_ERR_EFFECT_TWICE for a second winding or magnet,
///          DQW_ERR_EFFECT_ROOM for more than DQW_EFFECT_WEIGHTS. Then *e is untouched
/// Context  at start; the list stays in use as long as the object
#define dqw_effect_init_q15 DQW_SIZED(dqw_effect_init_q15)
enum dqw_status dqw_effect_init_q15(dqw_effect_q15 *e, const dqw_effect_q15_config *list, int count,
                                    const dqw_effect_q15_base *base);

/// Weights of an effect in this list: those of its name, but none of a dead time that is someone else's.
static inline int dqw_effect_weights_of_q15(const dqw_effect_q15 *e, enum dqw_effect_name name)
{
    return name == DQW_EFFECT_DEAD_TIME && e->dead_time_apart ? 0 : dqw_effect_weights(name);
}

/// Is every temperature that the effects need a number (not INT16_MIN); is one of them 327 K or more from T_0? An angle
/// is whoever's who has one to see to.
/// Cost     up to four comparisons an effect of temperature
bool dqw_effect_finite_q15(const dqw_effect_q15 *e, const dqw_sample_q15 *s);
bool dqw_effect_saturated_q15(const dqw_effect_q15 *e, const dqw_sample_q15 *s);

/// One period of heating by the currents at its start. Every sample heats, also one that may not be learned.
///
/// Source   (E55) in docs/EQUATIONS.md
/// Format   Q15 of the full current
/// Range    any; beyond full scale as much as full scale
/// Cost     nothing without a heating state; else a product of 32 by 32 bits for each
void dqw_effect_heat_q15(dqw_effect_q15 *e, int16_t i_d_q15, int16_t i_q_q15);

/// Take the next sample; give the inputs of the pair that it ends: twice the trapezoid of f, slope of g, w_e J g.
///
/// Source   (E50) to (E53), (E75) in docs/EQUATIONS.md
/// Format   `fraction` fraction bits of the inputs' bases, twice the value: |x| < 8
/// Shape    d[weights], q[weights] written where the result is true; `last` NULL after a gap or a sample that was
///          refused
/// Range    s admitted: |x_q15| <= 32766
/// Returns  true where there is a pair; one with DQW_NEEDS_LAST needs the row before it as well
/// Cost     2 products of 32 by 32 bits a weight, and the law: dead_time 25; no loop depends on data. Set
///          DQW_EFFECT_WEIGHTS to what is needed: the window turns over all that there is room for
/// Context  ISR safe; one writer per object
bool dqw_effect_pair_q15(dqw_effect_q15 *e, const dqw_sample_q15 *last, const dqw_sample_q15 *s, int32_t d[],
                         int32_t q[]);

/// A settled row: no slope; `delay` to first order.
///
/// Source   (E50) in docs/EQUATIONS.md with d/dt = 0; (E75)
/// Format   Q28 of the inputs' bases, twice the value: |x| <= 4
/// Context  ISR safe; one writer per object
void dqw_effect_static_q15(dqw_effect_q15 *e, const dqw_sample_q15 *s, int32_t d[], int32_t q[]);

/// Mean of an input, Q28 of its base: a window's sum, or a settled row's, over its weight. |mean| <= 4.
/// Range    weight >= 1, |sum| < 2^31
int32_t dqw_effect_mean_q15(const dqw_effect_q15 *e, int32_t sum, uint16_t weight);

/// Weight i of list entry `index`, per unit of its input's base, as plain units of V, A and the period make it, and the
/// other way round: volts of v_full, flux of v_full dt, ohm of v_full / i_full, A of i_full, S of i_full / v_full, ohm
/// s^2 of v_full dt^2 / i_full; per K, or per unit of a heating state; rad, periods and gains as they are.
///
/// Source   (E75) in docs/EQUATIONS.md
/// Format   Q40 in and out
/// Context  background
int64_t dqw_effect_restored_q40(const dqw_effect_q15 *e, int index, int i, int64_t w_q40);
int64_t dqw_effect_based_q40(const dqw_effect_q15 *e, int index, int i, int64_t weight_q40);

/// Of weights that belong to one effect, those that mean something: the deviation is below a quarter of the largest.
///
/// Format   Q40; INT64_MAX: not known
/// Returns  bit i: weight i is known
uint32_t dqw_effect_known_q15(const int64_t weights_q40[], const int64_t sd_q40[], int n);

/// Time has jumped: the next sample ends no pair. Heat stays.
void dqw_effect_gap_q15(dqw_effect_q15 *e);

#endif

#ifdef __cplusplus
}
#endif
#endif
