// May this be learned? Integers and booleans only, so that float and fixed point decide alike.
#ifndef DQW_GATE_H
#define DQW_GATE_H

#include <stdbool.h>
#include <stdint.h>

#include "dqw_state.h"
#include "dqw_status.h"

#ifdef __cplusplus
extern "C" {
#endif

/// Rows that only measure the noise, where it is taken out of the inputs: its variance is then known to an eighth.
#define DQW_NOISE_ROWS 400u

/// What is known of one sample.
typedef struct dqw_gate_sample {
    bool finite;     ///< every channel is a number
    bool saturated;  ///< a channel is at its limit, or the inverter could not give the voltage
    bool repeated;   ///< every current and the speed equal the last sample's to the bit, while something should move
} dqw_gate_sample;

/// Open the gate. stale_limit: repeats in a row before a sensor counts as stuck; 0: never.
/// Source   (E19) in docs/EQUATIONS.md
void dqw_gate_init(dqw_gate *g, uint32_t stale_limit);

/// May this sample be learned? Counts it.
///
/// Source   (E19) in docs/EQUATIONS.md
/// Returns  0 if it may; else the DQW_EVENT_* that says why not. NaN first, then saturation, then stale
/// Cost     a few comparisons
/// Context  ISR safe; one writer per object
uint32_t dqw_gate_check(dqw_gate *g, dqw_gate_sample s);

#ifdef __cplusplus
}
#endif
#endif
