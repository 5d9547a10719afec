// How far each weight moves per unit of error when all that was learned before is weighed in: the recursive least
// squares gain, kept as factors U D U' so that single precision cannot make it negative.
#ifndef DQW_GAIN_H
#define DQW_GAIN_H

#include <stdint.h>

#include "dqw_parts.h"
#include "dqw_status.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Where element i, j of U is, i < j.
#define DQW_GAIN_U(i, j) ((j) * ((j)-1) / 2 + (i))

/// Make a gain that knows nothing: every weight has variance p0.
///
/// Source   (E17) in docs/EQUATIONS.md
/// Units    p0: squared per-unit weight per squared per-unit residual, > 0; 1e6 forgets the start after a few samples
/// Returns  DQW_OK; DQW_ERR_NULL, DQW_ERR_SIZE or DQW_ERR_RANGE, and then *g is untouched
#define dqw_gain_init DQW_SIZED(dqw_gain_init)
enum dqw_status dqw_gain_init(dqw_gain *g, int inputs, float p0);

/// Take one sample into account and give the gain for it.
///
/// Source   Bierman's update of (E17) in docs/EQUATIONS.md
/// Shape    x_pu[inputs] read only; k_pu[inputs] written: the weights' correction per unit of error
/// Range    finite x_pu, |x_pu| < 1e9; an input of zero leaves its weight's variance alone
/// Cost     1.5 n^2 + 5 n flops, n divisions; no loop depends on data
/// Context  ISR safe; one writer per object
#define dqw_gain_step DQW_SIZED(dqw_gain_step)
void dqw_gain_step(dqw_gain *g, const float x_pu[], float k_pu[]);

/// What a gradient moves the weights by: P z.
///
/// Source   (E17), (E60) in docs/EQUATIONS.md
/// Shape    z[inputs] read only; out[inputs] written, may not be z
/// Cost     2 n^2 flops
/// Context  ISR safe; reads *g only
void dqw_gain_apply(const dqw_gain *g, const float z[], float out[]);

/// The weight of input i may have changed: its variance grows by q.
///
/// Source   Agee and Turner's update of U D U'; (E105) in docs/EQUATIONS.md
/// Units    q: squared per-unit weight per squared per-unit residual, >= 0
/// Range    i in 0 .. inputs-1
/// Cost     about 2 i^2 + 6 i flops, i divisions
/// Context  ISR safe; one writer per object
void dqw_gain_grow(dqw_gain *g, int i, float q);

/// P + q a a'.
///
/// Source   Agee and Turner's update of U D U'; (E105) in docs/EQUATIONS.md
/// Shape    a[n], the rest of the vector is zero; it is changed
/// Units    q >= 0
/// Cost     about 2 n^2 + 6 n flops, n divisions
/// Context  background; one writer per object
void dqw_gain_grow_along(dqw_gain *g, float a[], int n, float q);

/// All that was learned counts for a quarter.
///
/// Source   (E194) in docs/EQUATIONS.md
/// Cost     n flops
/// Context  background; one writer per object
void dqw_gain_forget(dqw_gain *g);

/// Covariance of weights i and j per unit of residual variance, per unit.
///
/// Source   (E17) in docs/EQUATIONS.md
/// Range    i, j in 0 .. inputs-1
/// Cost     2 n flops
float dqw_gain_covariance(const dqw_gain *g, int i, int j);

#ifdef __cplusplus
}
#endif
#endif
