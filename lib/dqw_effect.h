// What the plain model may lack: dead time, saturation, heat ... Each effect is a few more inputs of the axes' Learners, with
// weights that have a physical meaning. Which ones, and their shapes, is domain knowledge: from the data sheet, or from a trace.
#ifndef DQW_EFFECT_H
#define DQW_EFFECT_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_effect_name.h"
#include "dqw_sample.h"
#include "dqw_size.h"
#include "dqw_status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define DQW_EFFECT_SHAPES 4
/// The highest flux harmonic.
#define DQW_EFFECT_ORDERS 100

typedef struct dqw_effect_config {
    enum dqw_effect_name effect;
    float shape[DQW_EFFECT_SHAPES];
    float start[DQW_EFFECT_STARTS];  ///< weights to start from, SI. Never a prior
} dqw_effect_config;

/// Weights of the whole list, all electrical or all mechanical.
///
/// Returns  the sum, <= DQW_EFFECT_WEIGHTS; DQW_ERR_NULL, DQW_ERR_SIZE or DQW_ERR_RANGE for a list that no estimator takes: an
///          unknown or misplaced name, a shape that is not finite or has no meaning (a width of zero), a second winding or magnet
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

/// What scales, and what is given of the machine.
typedef struct dqw_effect_base {
    float dt_s, v_V, i_A, w_m_rad_s;
    uint16_t pole_pairs;
} dqw_effect_base;

/// The configured effects of one machine, with the last sample's part of each input.
typedef struct dqw_effect {
    const dqw_effect_config *list;
    // Per weight: voltage f + w_e J g of the last sample, flux linkage g of it.
    float a_d[DQW_EFFECT_WEIGHTS], a_q[DQW_EFFECT_WEIGHTS];
    float g_d[DQW_EFFECT_WEIGHTS], g_q[DQW_EFFECT_WEIGHTS];
    float late_d_V, late_q_V;     ///< the last sample's voltage less that of the one before, as seen in its period
    float heat[2], heat_rest[2];  ///< winding, magnet: the state, and what rounding took from it
    dqw_effect_base base;
    uint8_t count, weights;
    bool needs_angle, needs_winding, needs_magnet, needs_last;
    bool has_sample;
} dqw_effect;

/// Make the inputs of a list of electrical effects. A count of 0 costs nothing later on.
///
/// Source   (E50) in docs/EQUATIONS.md
/// Returns  DQW_OK; or as dqw_effect_check; DQW_ERR_RANGE without pole pairs too: w_e is in most inputs. Then *e is untouched
/// Context  at start; the list stays in use as long as the object
enum dqw_status dqw_effect_init(dqw_effect *e, const dqw_effect_config *list, int count, const dqw_effect_base *base);

/// What one unit of the weights of list entry `index` brings at the machine's bases, V: the base of their inputs is the inverse.
float dqw_effect_input_base(const dqw_effect *e, int index);

/// True where every signal that the effects need, beyond voltages, currents and speed, is a number.
/// Cost     up to three comparisons
bool dqw_effect_finite(const dqw_effect *e, const dqw_sample *s);

/// One period of heating by the currents at its start. Every sample heats, also one that may not be learned.
///
/// Source   (E55) in docs/EQUATIONS.md
/// Range    any float; what is not finite heats nothing, more than ten bases as much as ten
/// Cost     nothing without a heating state; else 10 flops and a division for each
void dqw_effect_heat(dqw_effect *e, float i_d_A, float i_q_A);

/// Take the next sample; give the inputs of the pair that it ends: trapezoid of f, slope of g, w_e J g.
///
/// Source   (E50) to (E53) in docs/EQUATIONS.md
/// Shape    d[weights], q[weights] written where the result is true; `last` NULL after a gap or a sample that was refused
/// Range    s finite
/// Returns  true where there is a pair; `delay` and `iron_loss` need the row before it as well
/// Cost     11 flops a weight and the law: dead_time 3 tanhf, a harmonic of order n 6 n
/// Context  ISR safe; one writer per object
bool dqw_effect_pair(dqw_effect *e, const dqw_sample *last, const dqw_sample *s, float d[], float q[]);

/// A settled row: no slope; `delay` in units of dt_s, to first order.
/// Source   (E50) in docs/EQUATIONS.md with d/dt = 0
void dqw_effect_static(dqw_effect *e, const dqw_sample *s, float d[], float q[]);

/// Time has jumped: the next sample ends no pair. Heat stays.
void dqw_effect_gap(dqw_effect *e);

#endif

#ifdef __cplusplus
}
#endif
#endif
