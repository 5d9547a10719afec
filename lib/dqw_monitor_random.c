// Stage 2 of the monitor: a Random Learner on the tracker's rows.
#include "dqw_monitor.h"

#define CAPACITY 50u
#define STEP 0.5f
// Noisy rows move the weights by this much even when there is nothing left to learn.
#define TOLERANCE 0.1f

static bool learn(dqw_monitor_random *lent, const dqw_tracker *t)
{
    float x[2][DQW_TRACK_WEIGHTS];
    float y[2];
    dqw_tracker_rows(t, x[0], x[1], y);
    for (int axis = 0; axis < 2; axis++) dqw_random_put(&lent->random, x[axis], DQW_TRACK_WEIGHTS, y[axis]);
    return dqw_random_epoch(&lent->random, &lent->coarse);
}

void dqw_monitor_random_init(dqw_monitor_random *lent)
{
    // The rows are per unit already.
    const dqw_learner_config coarse = {.inputs = DQW_TRACK_WEIGHTS, .step_size = STEP, .x_base = {1, 1, 1, 1, 1, 1}, .y_base = 1.0f, .indicator = true};
    const dqw_random_config random = {.reservoir = lent->reservoir, .capacity = CAPACITY, .draws = CAPACITY, .seed = 1, .tolerance = TOLERANCE};
    (void)dqw_learner_init(&lent->coarse, &coarse);
    (void)dqw_random_init(&lent->random, &random);
    lent->learn = learn;
}
