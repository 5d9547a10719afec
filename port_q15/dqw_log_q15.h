// Natural exponential and logarithm in integers, for a background.
#ifndef DQW_LOG_Q15_H
#define DQW_LOG_Q15_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// 1 - exp(-x): that, because where x is small it keeps its digits.
///
/// Format   Q40 in and out
/// Range    x >= 0; wrong by less than 2^-26 of itself
/// Cost     14 products and 13 quotients of 64 bits, and a loop of up to 40 turns
int64_t dqw_one_less_exp_q40(int64_t x_q40);

/// -ln(x)
///
/// Format   Q31 in, Q40 out
/// Range    0 < x < 1; wrong by less than 2^-26 of itself. 0 for x <= 0
/// Cost     12 products and a quotient of 64 bits
int64_t dqw_minus_log_q40(int32_t x_q31);

#ifdef __cplusplus
}
#endif
#endif
