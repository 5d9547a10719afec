// A drive's signals as a fixed-point port sees them, the same on every machine: integers only. Currents and speed walk
// between levels that a generator draws, the voltages are those of a machine (E13) plus noise; every so often come what
// no good sample brings: full scale on one channel, all zero, a limited voltage, bits without sense.
#ifndef TARGET_STIMULUS_H
#define TARGET_STIMULUS_H

#include <stdbool.h>
#include <stdint.h>

/// Full scales: volts, amperes, mechanical radians a second, and the machine of examples/foc_config.h in them.
#define STIMULUS_V 28
#define STIMULUS_I 12
#define STIMULUS_W 220
#define STIMULUS_DT_NS 50000
#define STIMULUS_PAIRS 4

typedef struct stimulus {
    int16_t v_d_q15, v_q_q15, i_d_q15, i_q_q15, w_m_q15;
    uint16_t theta_e_turn;
    bool limited;
    uint32_t n, seed, theta;                        // the rest is the walk's own
    int32_t to_d, to_q, to_w, d_q23, q_q23, w_q23;  // levels in Q15
} stimulus;

/// The same from every start.
void stimulus_start(stimulus *s);

/// The next sample.
void stimulus_next(stimulus *s);

/// 32 bits of the generator: xorshift.
uint32_t stimulus_bits(stimulus *s);

/// 64 bits whose size is as even over the powers of two as over the signs.
int64_t stimulus_any(stimulus *s);

#endif
