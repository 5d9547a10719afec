// What the parts count and decide with, of which the objects of both arithmetics are made: for their place and size.
// What the parts do is in the headers of their names. Integers and booleans only.
#ifndef DQW_STATE_H
#define DQW_STATE_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_fault_name.h"
#include "dqw_size.h"

#ifdef __cplusplus
extern "C" {
#endif

/// What became of every sample and block. Counters stop at their maximum instead of starting again.
typedef struct dqw_gate {
    uint32_t accepted, nonfinite, saturated, stale;  ///< samples
    uint32_t blocks, incomplete;                     ///< blocks learned from; blocks dropped
    uint32_t repeats, stale_limit;
} dqw_gate;

/// Which half of a window is whose.
typedef struct dqw_handover {
    uint8_t now;    ///< which part is being gathered; the other one is free, or handed over
    bool pending;   ///< the other one is handed over: the background's until it clears this
    bool follows;   ///< what is being gathered follows what was handed over last
    bool followed;  ///< what is handed over follows what was handed over before
} dqw_handover;

enum dqw_stage_name {
    DQW_STAGE_DOMAIN = 0,  ///< 1: domain knowledge: which Learners, with which inputs. Waits for dqw_stage_define()
    DQW_STAGE_RANDOM,      ///< 2: random learning: coarse weights from a reservoir
    DQW_STAGE_ORDINAL,     ///< 3: ordinal learning: fine weights from consecutive samples
    DQW_STAGE_IN_SERVICE,  ///< threshold met: fit for diagnosis
};

/// Why the machine went back to stage 1.
enum dqw_stage_back {
    DQW_BACK_NONE = 0,       ///< it never did
    DQW_BACK_NOT_CONVERGED,  ///< the Random Learners did not settle within their limit of blocks
    DQW_BACK_THRESHOLD,      ///< ordinal learning is done, but the residual is above the threshold
    DQW_BACK_LEFT_BAND,      ///< the residual rose above the threshold while in service
};

typedef struct dqw_stage {
    uint32_t threshold_ppm;  ///< of residual over voltage, RMS
    uint32_t blocks;         ///< blocks spent in this stage
    uint32_t residual_ppm;   ///< at the last way back
    uint16_t times_back;     ///< up to 65535
    enum dqw_stage_name name;
    enum dqw_stage_back back;
} dqw_stage;

/// What the witness has a weight for.
enum dqw_witness_input {
    DQW_WITNESS_OFFSET = 0,  ///< once a turn: R times a constant current error. A
    DQW_WITNESS_RESISTANCE,  ///< twice a turn, with the current: a third of one phase's extra resistance. Ohm
    DQW_WITNESS_REACTANCE,   ///< twice a turn, with current and speed: L times a third of one sensor's extra gain. H
    /// twice a turn, with the flux' voltage: a third of a shorted turn's conductance across one phase. S
    DQW_WITNESS_SHORT,
    DQW_WITNESS_INPUTS
};

/// Blocks over which the witness remembers.
#define DQW_WITNESS_MEMORY 300u
/// Blocks of which the witness takes the inputs' power alone: the first come while the weights, and with them its
/// inputs, are next to nothing, and a step by that would make a ripple of what is not learned yet.
#define DQW_WITNESS_FIRST 32u

typedef struct dqw_change {
    uint8_t sum_q5;  ///< how long and how far beyond, in bands times steps, 0 .. limit
    uint8_t above;   ///< steps since the sum was last 0, up to 255: since when
} dqw_change;

/// What is watched.
enum dqw_monitor_channel {
    DQW_WATCH_R = 0,  // the estimator's first weights, in the order of enum dqw_parameter
    DQW_WATCH_LD,
    DQW_WATCH_LQ,
    DQW_WATCH_PSI,
    DQW_WATCH_DEAD_TIME,
    DQW_WATCH_ANGLE,
#if DQW_MAP_WEIGHTS > 0
    DQW_WATCH_MAP_D,  // a flux map's weights
    DQW_WATCH_MAP_Q,
#endif
    DQW_WATCH_OFFSET,  // then the witness'
    DQW_WATCH_RESISTANCE,
    DQW_WATCH_REACTANCE,
    DQW_WATCH_SHORT,
    DQW_WATCH_FRICTION,
    DQW_WATCH_TEMPERATURE,
    DQW_WATCH_RESIDUAL,
    DQW_WATCH_CHANNELS
};

typedef struct dqw_watch {
    uint32_t learned_at;   ///< when the last block was learned, in halves of a window
    uint16_t followed[2];  ///< when healthy R and flux last followed, in 256 halves
    uint16_t alarms;       ///< channels of the event that is being named
    dqw_change change[DQW_WATCH_CHANNELS];
    uint8_t looks[DQW_WATCH_TEMPERATURE];  ///< that each healthy value is the mean of, up to 255
    /// since the last look; looks to come until an event is named, or the rest after it or a pause is over
    uint8_t blocks, wait;
    uint8_t reversals;  ///< of the direction, that friction is a mean over
    int8_t gathered;    ///< blocks of a stretch in one direction, with its sign
    int8_t before;      ///< direction of the stretch before it
    bool resting, too_hot, back;
    uint8_t extended;  ///< times that the name was waited for
} dqw_watch;

#ifdef __cplusplus
}
#endif
#endif
