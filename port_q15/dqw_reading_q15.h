// What is read of one parameter, in whole numbers.
#ifndef DQW_READING_Q15_H
#define DQW_READING_Q15_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/// Q40 of the unit that the object's header gives for the parameter: 64 bits, since no one unit suits a large and a
/// small machine.
typedef struct dqw_reading_q15 {
    int64_t value_q40;      ///< where nothing was learned yet, what it starts from
    int64_t sd_q40;         ///< standard deviation of the value; INT64_MAX: nothing was learned
    int64_t sd_change_q40;  ///< of its change against the healthy value
    bool usable;            ///< known, of the right sign, and three deviations are below a tenth of it
} dqw_reading_q15;

#ifdef __cplusplus
}
#endif
#endif
