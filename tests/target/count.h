// Instructions that the target executes, exact for a single call.
#ifndef TARGET_COUNT_H
#define TARGET_COUNT_H

#include <stdint.h>

/// Make the counter ready, and end the program where it is not exact. The start-up code calls it before main.
void count_calibrate(void);

/// Begin to count.
void count_start(void);

/// Instructions since count_start(), up to 1.6e8; 0 where nothing stands between the two. A call between them counts
/// whole: its arguments' moves, `bl`, the body, the return. An instruction skipped by its condition counts as one, as
/// does `it`.
uint32_t count_stop(void);

#endif
