// The estimator's interrupt part in float where the voltage acts a period later, and is held in the stationary frame.
#include <stdbool.h>

#define HELD true
#include "target/piece_estimator_float.c"
