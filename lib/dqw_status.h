// What init functions return, and the event bits that steps set.
#ifndef DQW_STATUS_H
#define DQW_STATUS_H

/// Result of an init function. On a negative value the object is as it was before the call. dqw_status_text() says it
/// in words: which field of the configuration, and what it may be.
enum dqw_status {
    DQW_OK = 0,
    DQW_ERR_NULL = -1,   ///< a pointer that must be there is null
    DQW_ERR_SIZE = -2,   ///< a count is zero or above its compile-time limit
    DQW_ERR_RANGE = -3,  ///< a number is non-finite or outside its documented range
    // The field that was refused.
    DQW_ERR_DT = -10,
    DQW_ERR_V_BASE = -11,
    DQW_ERR_I_BASE = -12,
    DQW_ERR_W_BASE = -13,
    DQW_ERR_TORQUE_BASE = -14,
    DQW_ERR_R = -15,
    DQW_ERR_LD = -16,
    DQW_ERR_LQ = -17,
    DQW_ERR_PSI = -18,
    DQW_ERR_J = -19,
    DQW_ERR_B = -20,
    DQW_ERR_POLE_PAIRS = -21,
    DQW_ERR_HALF_WINDOW = -22,
    DQW_ERR_V_LIMIT = -23,
    DQW_ERR_I_LIMIT = -24,
    DQW_ERR_EXCITATION = -25,
    DQW_ERR_DEAD_TIME_WIDTH = -26,
    DQW_ERR_VOLTAGE_ERROR = -27,
    DQW_ERR_COULOMB_WIDTH = -28,
    DQW_ERR_STANDSTILL = -29,
    DQW_ERR_UNIT = -30,  ///< bases and nominal values together: what they make of a weight does not fit the arithmetic
    DQW_ERR_RANDOM = -31,
    DQW_ERR_TURN = -32,  ///< full speed, pole pairs and period together
    DQW_ERR_SETTLED = -33,
    DQW_ERR_MODULATION = -34,
    DQW_ERR_ANGLE_LATE = -35,
    DQW_ERR_VOLTAGE_SCALE = -36,
    DQW_ERR_EFFECT_LIST = -40,
    DQW_ERR_EFFECT_NAME = -41,
    DQW_ERR_EFFECT_SHAPE = -42,
    DQW_ERR_EFFECT_TWICE = -43,
    DQW_ERR_EFFECT_ROOM = -44,
    DQW_ERR_EFFECT_POLE_PAIRS = -45,
    DQW_ERR_EFFECT_ANGLE = -46,
    DQW_ERR_BAND = -50,
    DQW_ERR_ALPHA = -51,
    DQW_ERR_BETA = -52,
    DQW_ERR_HEATING = -53,
    DQW_ERR_RESIDUAL_FLOOR = -55,
    DQW_ERR_STORE_VERSION = -60,
    DQW_ERR_STORE_DAMAGED = -61,
    DQW_ERR_STORE_CONFIG = -62,
};

/// Event bits: what happened in one step. A step never fails; it holds its last good values, sets a bit and counts.
enum dqw_event {
    DQW_EVENT_BLOCK = 1 << 0,       ///< a block waits for the background
    DQW_EVENT_NONFINITE = 1 << 1,   ///< NaN or infinity among the samples: skipped
    DQW_EVENT_SATURATED = 1 << 2,   ///< beyond the range of the sensor, or the caller said so: skipped
    DQW_EVENT_STALE = 1 << 3,       ///< the same sample again and again: skipped
    DQW_EVENT_INCOMPLETE = 1 << 5,  ///< a block dropped because too many of its samples were skipped
    DQW_EVENT_MISSED = 1 << 6,      ///< a block lost because the background had not taken the one before it
};

#endif
