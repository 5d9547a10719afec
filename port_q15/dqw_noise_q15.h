// How noisy the sensors are, from single rows, in whole numbers: exact sums, that forget once they are long.
#ifndef DQW_NOISE_Q15_H
#define DQW_NOISE_Q15_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Rows that the sums remember: 2^13, as the float twin.
#define DQW_NOISE_Q15_SHIFT 13
#define DQW_NOISE_Q15_MEMORY (1u << DQW_NOISE_Q15_SHIFT)

/// Where a sum stands: currents d and q, speed; behind them, how the voltage answers the noise of i_d, of some of the
/// rows.
enum {
    DQW_NOISE_ID_Q15 = 0,
    DQW_NOISE_IQ_Q15,
    DQW_NOISE_W_Q15,
    DQW_NOISE_Q15_SUMS,
    DQW_NOISE_ANSWER_Q15 = DQW_NOISE_Q15_SUMS
};

typedef struct dqw_noise_q15 {
    /// over the memory: -2 var(i), -2 var(i), 6 var(w) times the rows, and the answer. |sum| < 2^49
    int64_t sum_q30[DQW_NOISE_Q15_SUMS + 1];
    int32_t made_q15;     ///< what the voltage made of the last step of i_d. |made| < 2^16
    int32_t e_q15[2][3];  ///< d and q: the last rows' current steps less what the voltage made. |e| < 2^17
    int32_t w_step_q15;   ///< |step| < 2^16
    uint16_t rows;        ///< in the sums, up to the memory
    uint8_t held;
    uint8_t turn;  ///< which sum forgets next
} dqw_noise_q15;

/// Forget everything.
void dqw_noise_init_q15(dqw_noise_q15 *n);

/// Time has jumped: the next row does not follow the last one. Variances stay.
void dqw_noise_gap_q15(dqw_noise_q15 *n);

/// One consecutive pair: the step of each current less T/L times its voltage, and the step of the speed; and T/L times
/// the voltage on d, which may answer the noise: row `at` of a half looks at that where it is 2, 6, 10 …
///
/// Source   (E60) in docs/EQUATIONS.md: E (e_k - e_k-3)(e_k-1 - e_k-2) = -2 var(i), whatever is slow, and whatever the
///          voltage's noise; (E189) for the answer
/// Format   Q15 of the full scales
/// Range    |e| < 2^17, |w_step| and |made| < 2^16
/// Cost     4 products of 32 by 32 bits
/// Context  ISR safe; one writer per object
void dqw_noise_step_q15(dqw_noise_q15 *n, int32_t e_d_q15, int32_t e_q_q15, int32_t w_step_q15, int32_t made_d_q15,
                        uint32_t at);

/// Rows of a half of so many pairs that look for an answer.
static inline uint32_t dqw_noise_looks_q15(uint32_t half)
{
    return (half + 1u) >> 2;
}

/// A variance from such a sum over `rows` rows: never negative. `parts`: -2 for a current's, 6 for the speed's.
///
/// Format   Q36 of the full scale squared, below 2^42
/// Range    0 without rows
int64_t dqw_noise_variance_q36(int64_t sum_q30, uint16_t rows, int parts);

#ifdef __cplusplus
}
#endif
#endif
