// See vesc_stub.h.
#include "vesc_stub.h"
