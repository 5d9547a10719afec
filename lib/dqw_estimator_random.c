#include "dqw_estimator_random.h"

#define CAPACITY 50u
#define STEP 0.5f
// Noisy rows move the weights by this much even when there is nothing left to learn.
#define TOLERANCE 0.1f

static bool learn(dqw_estimator_random *lent, const float x_d[], const float x_q[], const float y[], int inputs)
{
    lent->coarse.inputs = (uint8_t)inputs;
    dqw_random_put(&lent->random, x_d, inputs, y[0]);
    dqw_random_put(&lent->random, x_q, inputs, y[1]);
    return dqw_random_epoch(&lent->random, &lent->coarse);
}

void dqw_estimator_random_init(dqw_estimator_random *lent)
{
    // The rows are per unit already.
    dqw_learner_config coarse = {.inputs = DQW_LEARNER_INPUTS, .step_size = STEP, .y_base = 1.0f, .indicator = true};
    for (int i = 0; i < DQW_LEARNER_INPUTS; i++) coarse.x_base[i] = 1.0f;
    const dqw_random_config random = {
        .reservoir = lent->reservoir, .capacity = CAPACITY, .draws = CAPACITY, .seed = 1, .tolerance = TOLERANCE};
    (void)dqw_learner_init(&lent->coarse, &coarse);
    (void)dqw_random_init(&lent->random, &random);
    lent->learn = learn;
}
