// The paper's Learners, for experiments: include this one header. A motor controller wants dqw.h.
#ifndef DQW_PAPER_H
#define DQW_PAPER_H

#include "dqw_learner.h"
#include "dqw_ordinal.h"
#include "dqw_random.h"
#include "dqw_tapped.h"

#endif
