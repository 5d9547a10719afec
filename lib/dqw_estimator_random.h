// Memory that stage 2 borrows: a Random Learner on the rows of an estimator's blocks. A firmware that lends none
// carries no code for it.
#ifndef DQW_ESTIMATOR_RANDOM_H
#define DQW_ESTIMATOR_RANDOM_H

#include "dqw_estimator.h"
#include "dqw_random.h"

#ifdef __cplusplus
extern "C" {
#endif

/// 50 rows, as the paper's 50 samples.
typedef struct dqw_estimator_random {
    bool (*learn)(struct dqw_estimator_random *lent, const float x_d[], const float x_q[], const float y[], int inputs);
    dqw_random random;
    dqw_learner coarse;
    dqw_random_sample reservoir[50];
} dqw_estimator_random;

/// Make the memory ready to be lent, in an estimator's or a monitor's configuration.
///
/// Source   section 4.2 of the paper; (E8) in docs/EQUATIONS.md
/// Context  before init and before define; free for other use once the stage is ordinal learning or later
#define dqw_estimator_random_init DQW_SIZED(dqw_estimator_random_init)
void dqw_estimator_random_init(dqw_estimator_random *lent);

#ifdef __cplusplus
}
#endif
#endif
