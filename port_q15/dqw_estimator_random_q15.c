// Stage 2 of the monitor in whole numbers: a Random Learner on the tracker's rows.
#include "dqw_monitor_q15.h"
#include "dqw_tracker_rows_q15.h"

#define CAPACITY 50u
#define STEP_Q15 16384
// Noisy rows move the weights by this much even when there is nothing left to learn: 0.1.
#define TOLERANCE_Q15 3277
// Weights are parts of the nominal values, and a Learner's stop at 1: a quarter of the voltage is explained, by up to four times nominal.
#define INPUT_SHIFT 13u
#define TARGET_SHIFT 15u

static int16_t q15_of(int32_t x_q28, unsigned shift)
{
    return dqw_q15_sat((int32_t)dqw_q_round64(x_q28, shift));
}

static bool learn(dqw_monitor_random_q15 *lent, const dqw_tracker_q15 *t)
{
    // cppcheck-suppress uninitvar; every element is set
    dqw_tracker_rows_q15 r;
    dqw_tracker_rows_of_q15(t, &r);
    for (int axis = 0; axis < 2; axis++) {
        int16_t x_q15[DQW_TRACK_Q15_WEIGHTS];
        for (int i = 0; i < DQW_TRACK_Q15_WEIGHTS; i++) x_q15[i] = q15_of(r.x_q28[axis][i], INPUT_SHIFT);
        dqw_random_put_q15(&lent->random, x_q15, DQW_TRACK_Q15_WEIGHTS, q15_of(r.y_q28[axis], TARGET_SHIFT));
    }
    return dqw_random_epoch_q15(&lent->random, &lent->coarse);
}

void dqw_monitor_random_init_q15(dqw_monitor_random_q15 *lent)
{
    const dqw_learner_config_q15 coarse = {.inputs = DQW_TRACK_Q15_WEIGHTS, .step_size_q15 = STEP_Q15, .indicator = true};
    const dqw_random_config_q15 random = {.reservoir = lent->reservoir, .capacity = CAPACITY, .draws = CAPACITY, .seed = 1, .tolerance_q15 = TOLERANCE_Q15};
    (void)dqw_learner_init_q15(&lent->coarse, &coarse);
    (void)dqw_random_init_q15(&lent->random, &random);
    lent->learn = learn;
}
