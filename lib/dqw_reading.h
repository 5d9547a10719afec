// What is read of one parameter.
#ifndef DQW_READING_H
#define DQW_READING_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct dqw_reading {
    float value;      ///< SI; where nothing was learned yet, what it starts from
    float sd;         ///< standard deviation of the value; DQW_UNKNOWN: nothing was learned
    float sd_change;  ///< of its change against the healthy value
    bool usable;      ///< known, of the right sign, and three deviations are below a tenth of it
} dqw_reading;

#ifdef __cplusplus
}
#endif
#endif
