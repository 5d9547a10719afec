// What a read-out of one parameter says.
#ifndef DQW_READING_H
#define DQW_READING_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/// A standard deviation that is not known: finite, so that comparisons hold where a compiler assumes that there is no
/// infinity. What is known is `sd < DQW_UNKNOWN`.
#define DQW_UNKNOWN 3.4e38f

/// A value, and how sure it is.
typedef struct dqw_reading {
    float value;      ///< SI
    float sd;         ///< standard deviation of the value; DQW_UNKNOWN where nothing was learned
    float sd_change;  ///< that of its change against the healthy value
    bool usable;      ///< known, of the right sign, and three deviations are below a tenth of the value
} dqw_reading;

#ifdef __cplusplus
}
#endif
#endif
