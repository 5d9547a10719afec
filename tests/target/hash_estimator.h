// One estimator for all trajectories that need one: the smallest board's data have room for no second.
#ifndef TARGET_HASH_ESTIMATOR_H
#define TARGET_HASH_ESTIMATOR_H

#include "dqw_estimator_q15.h"

extern dqw_estimator_q15 hash_estimator_q15;

#endif
