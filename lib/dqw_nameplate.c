#include "dqw_nameplate.h"
uint16_t dqw_nameplate_half_window(const dqw_nameplate *plate) { (void)plate; return 20; }
