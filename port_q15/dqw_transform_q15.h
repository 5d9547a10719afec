// Clarke and Park transforms in fixed point, amplitude invariant.
#ifndef DQW_TRANSFORM_Q15_H
#define DQW_TRANSFORM_Q15_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct dqw_abc_q15 {
    int16_t a, b, c;
} dqw_abc_q15;

typedef struct dqw_alphabeta_q15 {
    int16_t alpha, beta;
} dqw_alphabeta_q15;

typedef struct dqw_dq_q15 {
    int16_t d, q;
} dqw_dq_q15;

/// Three phases to two; the zero sequence is dropped.
///
/// Source   (P1), (P2); (E1) in docs/EQUATIONS.md
/// Format   Q15, the same full scale in and out; amplitude invariant
/// Range    any; wrong by 0.6 of a last place for balanced phases, by 1.1 for any; what does not fit stops at the full
///          scale
/// Cost     4 products of 16 by 16 bits
/// Context  ISR safe; no state
dqw_alphabeta_q15 dqw_clarke_q15(dqw_abc_q15 x);

/// Two phases to three, without zero sequence: the inverse of dqw_clarke_q15 on balanced signals.
///
/// Source   (E1) in docs/EQUATIONS.md
/// Format   Q15, the same full scale in and out
/// Range    any; wrong by 0.6 of a last place; what does not fit stops at the full scale
/// Cost     1 product of 16 by 16 bits
/// Context  ISR safe; no state
dqw_abc_q15 dqw_clarke_inverse_q15(dqw_alphabeta_q15 x);

/// Stationary to rotating frame: d along the angle whose cosine and sine are given.
///
/// Source   the usual transform, in which (P6), (P7) hold; (E2) in docs/EQUATIONS.md
/// Format   Q15, the same full scale in and out; cos_q15, sin_q15 of the electrical angle
/// Range    any; rounded once; what does not fit stops at the full scale
/// Cost     4 products of 16 by 16 bits
/// Context  ISR safe; no state
dqw_dq_q15 dqw_park_q15(dqw_alphabeta_q15 x, int16_t cos_q15, int16_t sin_q15);

/// Rotating to stationary frame: the inverse of dqw_park_q15.
///
/// Source   (E2) in docs/EQUATIONS.md
/// Format   Q15, the same full scale in and out
/// Range    as dqw_park_q15
/// Cost     4 products of 16 by 16 bits
/// Context  ISR safe; no state
dqw_alphabeta_q15 dqw_park_inverse_q15(dqw_dq_q15 x, int16_t cos_q15, int16_t sin_q15);

/// The transform as (P4), (P5) print it: the angle counted the other way round, so it is dqw_park_q15 at minus the
/// angle.
///
/// Source   (P4), (P5); (E3) in docs/EQUATIONS.md
/// Format   Q15, the same full scale in and out
/// Range    as dqw_park_q15
/// Cost     4 products of 16 by 16 bits
/// Context  ISR safe; no state
dqw_dq_q15 dqw_park_paper_q15(dqw_alphabeta_q15 x, int16_t cos_q15, int16_t sin_q15);

/// Cosine and sine of an angle in one go, with a bounded number of instructions.
///
/// Source   Taylor to x^8 within an eighth of a turn
/// Format   65536 a turn; Q15, 1 as 32767
/// Range    any; wrong by less than one in the last place
/// Cost     9 products of 32 bits; no loop
/// Context  ISR safe; no state
void dqw_cosine_sine_q15(uint16_t theta_turn, int16_t *cos_q15, int16_t *sin_q15);

#ifdef __cplusplus
}
#endif
#endif
