// What a read-out of one parameter says.
#ifndef DQW_READING_Q15_H
#define DQW_READING_Q15_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct dqw_reading_q15 {
    int32_t value_q24;      ///< of the unit that stands beside the call
    int32_t sd_q24;         ///< standard deviation of the value; INT32_MAX where nothing was learned
    int32_t sd_change_q24;  ///< that of its change against the healthy value
    bool usable;            ///< known, of the right sign, and three deviations are below a tenth of the value
} dqw_reading_q15;

#ifdef __cplusplus
}
#endif
#endif
