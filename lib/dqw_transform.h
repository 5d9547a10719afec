// Clarke and Park transforms, amplitude invariant.
#ifndef DQW_TRANSFORM_H
#define DQW_TRANSFORM_H

#ifdef __cplusplus
extern "C" {
#endif

typedef struct dqw_abc {
    float a, b, c;
} dqw_abc;

typedef struct dqw_alphabeta {
    float alpha, beta;
} dqw_alphabeta;

typedef struct dqw_dq {
    float d, q;
} dqw_dq;

/// Three phases to two; the zero sequence is dropped.
///
/// Source   (P1), (P2); (E1) in docs/EQUATIONS.md
/// Units    any, the same in and out; amplitude invariant
/// Range    any float; non-finite in, non-finite out
/// Cost     5 flops
/// Context  ISR safe; no state
dqw_alphabeta dqw_clarke(dqw_abc x);

/// Two phases to three, without zero sequence: the inverse of dqw_clarke on balanced signals.
///
/// Source   (E1) in docs/EQUATIONS.md
/// Units    any, the same in and out
/// Cost     5 flops
/// Context  ISR safe; no state
dqw_abc dqw_clarke_inverse(dqw_alphabeta x);

/// Stationary to rotating frame: d along the angle whose cosine and sine are given.
///
/// Source   the usual transform, in which (P6), (P7) hold; (E2) in docs/EQUATIONS.md
/// Units    any, the same in and out; cos_theta, sin_theta of the electrical angle
/// Cost     6 flops
/// Context  ISR safe; no state
dqw_dq dqw_park(dqw_alphabeta x, float cos_theta, float sin_theta);

/// Rotating to stationary frame: the inverse of dqw_park.
///
/// Source   (E2) in docs/EQUATIONS.md
/// Units    any, the same in and out
/// Cost     6 flops
/// Context  ISR safe; no state
dqw_alphabeta dqw_park_inverse(dqw_dq x, float cos_theta, float sin_theta);

/// The transform as (P4), (P5) print it: the angle counted the other way round, so it is dqw_park at minus theta.
///
/// Source   (P4), (P5); (E3) in docs/EQUATIONS.md
/// Units    any, the same in and out
/// Cost     6 flops
/// Context  ISR safe; no state
dqw_dq dqw_park_paper(dqw_alphabeta x, float cos_theta, float sin_theta);

/// Cosine and sine of an angle in one go, with a bounded number of instructions.
///
/// Source   Taylor to x^8 within an eighth of a turn
/// Units    rad
/// Range    |theta_rad| <= 1e5; the error is below 1e-6 plus what single precision has lost of the angle. Non-finite: 1
///          and 0
/// Cost     25 flops; no loop
/// Context  ISR safe; no state
void dqw_cosine_sine(float theta_rad, float *cosine, float *sine);

#ifdef __cplusplus
}
#endif
#endif
