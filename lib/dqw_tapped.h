// The paper's experiment: the axis of Fig. 3 inside a simulation, where each Random Learner has a target of its own
// (a signal tapped behind the machine's own gain). A real drive has no such taps: see dqw_estimator.h.
#ifndef DQW_TAPPED_H
#define DQW_TAPPED_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_learner.h"
#include "dqw_random.h"
#include "dqw_status.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Random Learners of an axis: v, w i of the other axis, and on the q-axis w.
enum dqw_tap { DQW_TAP_V = 0, DQW_TAP_CROSS, DQW_TAP_FLUX };
/// Most Random Learners of an axis.
#define DQW_TAPS 3

/// What a tapped axis is told at the start.
typedef struct dqw_tapped_config {
    int taps;                                ///< 2 on the d-axis, 3 on the q-axis
    float x_base[DQW_TAPS];                  ///< V, A rad/s, rad/s. (P15)
    float y_base[DQW_TAPS];                  ///< A/s
    float step_size;                         ///< of the first epoch; from then on it falls as one over the iterations
    dqw_random_sample *reservoir[DQW_TAPS];  ///< the caller's memory, `capacity` samples each
    uint32_t capacity, draws, seed;          ///< as in dqw_random_config
    float tolerance;                         ///< as in dqw_random_config
} dqw_tapped_config;

/// The Random Learners of an axis.
typedef struct dqw_tapped {
    dqw_learner learner[DQW_TAPS];
    dqw_random random[DQW_TAPS];
    float step_size;
    uint32_t iterations, draws;
    uint8_t taps;
} dqw_tapped;

/// Make a tapped axis. Inputs and targets are taken to be equally noisy, per unit of their bases.
///
/// Source   Fig. 3, (P12); (E6), (E24) in docs/EQUATIONS.md
/// Returns  DQW_OK; DQW_ERR_NULL, DQW_ERR_SIZE or DQW_ERR_RANGE, and then *t is untouched
#define dqw_tapped_init DQW_SIZED(dqw_tapped_init)
enum dqw_status dqw_tapped_init(dqw_tapped *t, const dqw_tapped_config *config);

/// Remember one sample: x[taps] inputs, y_A_s[taps] the tapped slopes of current.
void dqw_tapped_put(dqw_tapped *t, const float x[], const float y_A_s[]);

/// One iteration of every Random Learner.
///
/// Source   (P13), (P14); (E6), (E24) in docs/EQUATIONS.md
/// Returns  true once all have converged
/// Cost     taps x dqw_random_iterate
/// Context  background
bool dqw_tapped_iterate(dqw_tapped *t);

/// L of the axis, H: one over the weight of v.  p of the axis, with the saliency in it: the weight of w i.
/// psi p / L of the q-axis: the weight of w.  Source (P6), (P7); (E24) in docs/EQUATIONS.md
float dqw_tapped_L_H(const dqw_tapped *t);
float dqw_tapped_pole_pairs(const dqw_tapped *t);
float dqw_tapped_flux_weight(const dqw_tapped *t);

#ifdef __cplusplus
}
#endif
#endif
