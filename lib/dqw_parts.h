// What the parts measure with, of which the objects in float are made: for their place and size. What the parts do is
// in the headers of their names.
#ifndef DQW_PARTS_H
#define DQW_PARTS_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_effect_name.h"
#include "dqw_fault_name.h"
#include "dqw_size.h"
#include "dqw_state.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Variances; they may come out slightly negative, read them through dqw_noise_variance().
typedef struct dqw_noise_variances {
    float i_d_A2, i_q_A2, w_rad2_s2;
    float answer_A2;  ///< what a controller's voltage makes of i_d's noise, times it: 3 and more of what a period does
    uint32_t rows;    ///< that they are means of
} dqw_noise_variances;

/// How noisy the sensors are, from single rows.
typedef struct dqw_noise {
    dqw_noise_variances of;
    float e_d_A[3], e_q_A[3];  ///< the last rows' current steps less what the voltage made
    float made_d_A;            ///< what the voltage made of the last step of i_d
    float w_step_rad_s;
    uint8_t held;
} dqw_noise;

/// What of the residual lasts, per unit, squared: two and three blocks later, from one stretch to the next; all of it;
/// and what turns six times with the rotor.
typedef struct dqw_lasting {
    float fast_pu2, slow_pu2, all_pu2, turning_pu2;
} dqw_lasting;

/// What a segment of driving says of each weight (dqw_segment.h).
typedef struct dqw_segment {
    float a[DQW_FOLLOWED * (DQW_FOLLOWED + 1) / 2], b[DQW_FOLLOWED];  ///< sums of x x' and x e
    float band_pu[DQW_FOLLOWED];                           ///< how far a weight scatters between segments in health
    int16_t up_q11[DQW_FOLLOWED], down_q11[DQW_FOLLOWED];  ///< sums of what agrees
    uint16_t share_q15[DQW_FOLLOWED];                      ///< what the last segment knew of a weight, over its band
    float sum[2], square[2];                               ///< of the segment's speed and current,
    float mean[2], variance[2], run;                       ///< in the long run, and how long that is
    uint32_t blocks;
    uint16_t segments, since;  ///< in all; since a weight was found changed
    bool urgent;               ///< something shows already: this segment alone may tell what has changed
    bool agreed;               ///< the one that was last, seemed so in the segment before
} dqw_segment;

/// Most signals that a window gathers: a block's, dead time's and the resting leg's, and two of each weight of an
/// effect.
#define DQW_WINDOW_SIGNALS (13 + 2 * DQW_EFFECT_WEIGHTS)

/// One signal of a half.
typedef struct dqw_window_cell {
    float sum;   ///< of x
    float fall;  ///< sum of those sums, in which pair j weighs half + 1 - j
} dqw_window_cell;

/// A half that is being gathered, or was handed over.
typedef struct dqw_window_part {
    dqw_window_cell cell[DQW_WINDOW_SIGNALS];
    uint32_t fall_weight;
    uint16_t valid;  ///< pairs in it
} dqw_window_part;

/// The interrupt's side.
typedef struct dqw_window {
    dqw_window_part part[2];
    uint16_t half, at;  ///< pairs in a half; of them passed
    uint8_t signals;
    dqw_handover over;
} dqw_window;

/// The background's side: the half before, rising.
typedef struct dqw_window_rise {
    float rise[DQW_WINDOW_SIGNALS];  ///< weighted by j
    uint32_t weight;
    uint16_t valid;
    bool has;
} dqw_window_rise;

/// Covariance of the weights per unit of residual variance, P = U D U', U unit upper triangular.
typedef struct dqw_gain {
    float u[DQW_LEARNER_INPUTS * (DQW_LEARNER_INPUTS - 1) / 2];  ///< column by column above the diagonal
    float d[DQW_LEARNER_INPUTS];
    uint8_t inputs;
} dqw_gain;

/// Most numbers that an effect's shape has.
#define DQW_EFFECT_SHAPES 4
/// The highest flux harmonic.
#define DQW_EFFECT_ORDERS 100

/// An effect to learn.
typedef struct dqw_effect_config {
    enum dqw_effect_name effect;     ///< which
    float shape[DQW_EFFECT_SHAPES];  ///< what its law takes for given, as enum dqw_effect_name lists it
    float start[DQW_EFFECT_STARTS];  ///< weights to start from, SI. Never a prior
    const int16_t *map;              ///< a flux map's table, as dqw_effect_name.h has it; others: not read
} dqw_effect_config;

#if DQW_EFFECT_WEIGHTS > 0

/// What scales, and what is given of the machine.
typedef struct dqw_effect_base {
    float dt_s, v_V, i_A, w_m_rad_s;
    uint16_t pole_pairs;
    bool dead_time_apart;  ///< dead time in the list is someone else's weight: it has none here
} dqw_effect_base;

/// The configured effects of one machine. The interrupt's, but for what init has set.
typedef struct dqw_effect {
    const dqw_effect_config *list;
    float last[2 * DQW_EFFECT_WEIGHTS];  ///< what each weight keeps of the last sample
    float heat[2], heat_rest[2];         ///< winding, magnet: the state, and what rounding took from it
    float square_A2;                     ///< sum of squared currents since dqw_effect_warm()
    float heat_part[2], heat_unit[2];    ///< of the states: what is left of the way in a period; of A^2
    float poles, poles_4, step_Hz;       ///< pole pairs, a quarter of them, 1/dt
    float turn_4;                        ///< a quarter of pole pairs times dt
    dqw_effect_base base;
    uint8_t law[DQW_EFFECT_WEIGHTS + 2];  ///< of each list entry, by what the interrupt has to gather; 0: the end
    uint8_t count, weights;
    uint8_t heating;  ///< bit 0: the winding has a heating state; bit 1: the magnet
    bool needs_angle, needs_winding, needs_magnet, needs_last;
    bool has_sample;
} dqw_effect;

#endif

/// What the estimator leaves, against ripples once and twice a turn.
typedef struct dqw_witness {
    /// weights, SI; their angle is twice that of the phase (offset: the vector in the stator)
    float re[DQW_WITNESS_INPUTS], im[DQW_WITNESS_INPUTS];
    float power[DQW_WITNESS_INPUTS];  ///< mean squared input, SI: volts per unit of the weight
    float across;                     ///< mean product of resistance's input, turned by 90 degrees, and reactance's
    uint16_t blocks;                  ///< learned, up to the memory
} dqw_witness;

/// Which fault it is.
typedef struct dqw_fault_verdict {
    enum dqw_fault_name name;  ///< DQW_FAULT_UNKNOWN where no pattern fits
    float confidence;          ///< 0 .. 1: how much of what changed the pattern explains, against the next best one
    uint8_t phase;             ///< 0, 1, 2: a, b, c, where the fault has one
} dqw_fault_verdict;

#ifdef __cplusplus
}
#endif
#endif
