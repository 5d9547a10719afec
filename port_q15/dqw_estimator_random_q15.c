#include "dqw_estimator_random_q15.h"

#define CAPACITY 50u
// Normalised by the inputs alone: with the constant input among them, signals far below full scale would move nothing.
#define STEP_Q15 16384
// Noisy rows move the weights by this much even when there is nothing left to learn: 0.1.
#define TOLERANCE_Q15 3277
// A Learner's weights stop at 1: a sixteenth of the voltage is explained, by up to sixteen units of each parameter.
#define INPUT_SHIFT 13u
#define TARGET_SHIFT 17u

static int16_t q15_of(int32_t x_q28, unsigned shift)
{
    return dqw_q15_sat((int32_t)dqw_q_round64(x_q28, shift));
}

// A row; the second axis' ends an epoch too. What has no room here starts where it was.
static bool learn(dqw_estimator_random_q15 *lent, const int32_t x_q28[], int32_t y_q28, int32_t w_q24[])
{
    int16_t x_q15[DQW_LEARNER_INPUTS_Q15];
    for (int i = 0; i < DQW_LEARNER_INPUTS_Q15; i++) x_q15[i] = q15_of(x_q28[i], INPUT_SHIFT);
    dqw_random_put_q15(&lent->random, x_q15, DQW_LEARNER_INPUTS_Q15, q15_of(y_q28, TARGET_SHIFT));
    if (w_q24 == NULL) return false;
    const bool done = dqw_random_epoch_q15(&lent->random, &lent->coarse);
    // What never moved was not seen.
    for (int i = 0; i < DQW_LEARNER_INPUTS_Q15 && done; i++)
        if (lent->coarse.w_q31[i] != 0)
            w_q24[i] = dqw_q_floor32(lent->coarse.w_q31[i], 7u - (TARGET_SHIFT - INPUT_SHIFT));
    return done;
}

void dqw_estimator_random_init_q15(dqw_estimator_random_q15 *lent)
{
    const dqw_learner_config_q15 coarse = {.inputs = DQW_LEARNER_INPUTS_Q15, .step_size_q15 = STEP_Q15};
    const dqw_random_config_q15 random = {.reservoir = lent->reservoir,
                                          .capacity = CAPACITY,
                                          .draws = CAPACITY,
                                          .seed = 1,
                                          .tolerance_q15 = TOLERANCE_Q15};
    (void)dqw_learner_init_q15(&lent->coarse, &coarse);
    (void)dqw_random_init_q15(&lent->random, &random);
    lent->learn = learn;
}
