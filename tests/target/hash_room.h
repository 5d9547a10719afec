// Memory that the trajectories' largest objects take in turn: the smallest board's data have no room for all of them.
#ifndef TARGET_HASH_ROOM_H
#define TARGET_HASH_ROOM_H

#include "dqw_estimator_q15.h"
#include "dqw_monitor_q15.h"
#include "dqw_normal_q15.h"
#include "dqw_segment_q15.h"
#include "dqw_shaft_q15.h"

typedef union hash_room {
    dqw_estimator_q15 estimator;
    dqw_shaft_q15 shaft;
    dqw_monitor_q15 monitor;
    struct {
        dqw_normal_q15 sums;
        dqw_solution_q15 solution;
    } normal;
    dqw_segment_q15 segment;
} hash_room;

extern hash_room hash_shared;

#endif
