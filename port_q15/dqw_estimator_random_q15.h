// Memory that stage 2 borrows: a Random Learner on the rows of an estimator's blocks. A firmware that lends none
// carries no code for it.
#ifndef DQW_ESTIMATOR_RANDOM_Q15_H
#define DQW_ESTIMATOR_RANDOM_Q15_H

#include "dqw_estimator_q15.h"
#include "dqw_random_q15.h"

#ifdef __cplusplus
extern "C" {
#endif

/// 50 rows, as the paper's 50 samples.
typedef struct dqw_estimator_random_q15 {
    bool (*learn)(struct dqw_estimator_random_q15 *lent, const int32_t x_q28[], int32_t y_q28, int32_t w_q24[]);
    dqw_random_q15 random;
    dqw_learner_q15 coarse;
    dqw_random_sample_q15 reservoir[50];
} dqw_estimator_random_q15;

/// Make the memory ready to be lent, in an estimator's or a monitor's configuration.
///
/// Source   section 4.2 of the paper; (E8) in docs/EQUATIONS.md
/// Context  before init and before define; free for other use once the stage is ordinal learning or later
#define dqw_estimator_random_init_q15 DQW_SIZED(dqw_estimator_random_init_q15)
void dqw_estimator_random_init_q15(dqw_estimator_random_q15 *lent);

#ifdef __cplusplus
}
#endif
#endif
