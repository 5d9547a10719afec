// The paper's Learners in fixed point, for experiments: include this one header.
#ifndef DQW_PAPER_Q15_H
#define DQW_PAPER_Q15_H

#include "dqw_learner_q15.h"
#include "dqw_ordinal_q15.h"
#include "dqw_random_q15.h"

#endif
