// What init functions return, and the event bits that steps set.
#ifndef DQW_STATUS_H
#define DQW_STATUS_H

/// Result of an init function. On a negative value the object is as it was before the call.
enum dqw_status {
    DQW_OK = 0,
    DQW_ERR_NULL = -1,   ///< a pointer that must be there is null
    DQW_ERR_SIZE = -2,   ///< a count is zero or above its compile-time limit
    DQW_ERR_RANGE = -3,  ///< a number is non-finite or outside its documented range
};

/// Event bits: what happened in one step. A step never fails; it holds its last good values, sets a bit and counts.
enum dqw_event {
    DQW_EVENT_LEARNED = 1 << 0,     ///< a block was learned
    DQW_EVENT_NONFINITE = 1 << 1,   ///< NaN or infinity among the samples: skipped
    DQW_EVENT_SATURATED = 1 << 2,   ///< beyond the range of the sensor, or the caller said so: skipped
    DQW_EVENT_STALE = 1 << 3,       ///< the same sample again and again: skipped
    DQW_EVENT_UNEXCITED = 1 << 4,   ///< a block that could teach at least one parameter nothing
    DQW_EVENT_INCOMPLETE = 1 << 5,  ///< a block dropped because too many of its samples were skipped
};

#endif
