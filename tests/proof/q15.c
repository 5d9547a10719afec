// Every value that the arithmetic and the plain learner's step may be given, for Frama-C's Eva: see prove.sh.
#include <__fc_builtin.h>

#include <stdint.h>

// Used where the learner calls it, since an interval that holds its bounds does not see through its shift; gains()
// shows it on both sides of them.
/*@ ensures -0x10000000 <= \result < 0x10000000; */
static inline int32_t dqw_q28_sat(int32_t x);

#include "dqw_learner_q15.h"

static int32_t any32(void) { return Frama_C_interval(INT32_MIN, INT32_MAX); }
static int64_t any64(void) { return Frama_C_long_long_interval(INT64_MIN, INT64_MAX); }
static uint16_t any_unsigned16(void) { return (uint16_t)Frama_C_unsigned_int_interval(0, 65535); }
static int16_t any16(void) { return (int16_t)Frama_C_interval(INT16_MIN, INT16_MAX); }

static void shifts(void)
{
    (void)dqw_q_signed32(Frama_C_unsigned_int_interval(0, UINT32_MAX));
    (void)dqw_q_floor32(any32(), Frama_C_unsigned_int_interval(0, 31));
    (void)dqw_q_floor64(any64(), Frama_C_unsigned_int_interval(0, 63));
    for (unsigned n = 1; n <= 30; n++) (void)dqw_q_round32(Frama_C_interval(INT32_MIN, INT32_MAX - (1 << (n - 1))), n);
    for (unsigned n = 1; n <= 62; n++)
        (void)dqw_q_round64(Frama_C_long_long_interval(INT64_MIN, INT64_MAX - ((int64_t)1 << (n - 1))), n);
    (void)dqw_q_clz32(Frama_C_unsigned_int_interval(0, UINT32_MAX));
    (void)dqw_q_bits64(any64());
}

// By a positive power of two: numbers of as many bits, so that the bits and what they leave room for are seen together.
static void scaled_up(int64_t low, int64_t high, int bits)
{
    const int64_t x = Frama_C_long_long_interval(low, high);
    if (bits < 63) (void)dqw_q_scale64(x, Frama_C_interval(0, 62 - bits));
    (void)dqw_q_scale64(x, Frama_C_interval(63 - bits, 200));
}

static void scalings(void)
{
    for (int n = -70; n < 0; n++) (void)dqw_q_scale64(any64(), n);
    scaled_up(-1, -1, 0);
    scaled_up(0, 0, 0);
    for (int bits = 1; bits <= 63; bits++) {
        const int64_t least = (int64_t)((uint64_t)1 << (bits - 1));
        scaled_up(least, least + (least - 1), bits);
        scaled_up(-least - (least - 1) - 1, -least - 1, bits);
    }
}

static void gain(int32_t low, int32_t high)
{
    const int32_t g_q29 = dqw_q28_sat(Frama_C_interval(low, high));
    //@ assert -0x10000000 <= g_q29 < 0x10000000;
    (void)g_q29;
}

static void gains(void)
{
    gain(INT32_MIN, -(1 << 28) - 1);
    gain(-(1 << 28), (1 << 28) - 1);
    gain(1 << 28, INT32_MAX);
}

static void sums_and_products(void)
{
    (void)dqw_q15_sat(any32());
    (void)dqw_q31_sat(any64());
    (void)dqw_q31_add(any32(), any32());
    (void)dqw_q15_top(any32());
    (void)dqw_q30_mul(any32(), any16());
    (void)dqw_q31_mul(Frama_C_interval(-(1 << 28), (1 << 28) - 1), any16());
    (void)dqw_q31_mul_by_halves(Frama_C_interval(-(1 << 28), (1 << 28) - 1), any16());
    // Its twin without a division takes two of Newton's steps, which intervals do not follow: test_q15 tries each of
    // its 196 609 numbers.
    (void)dqw_q16_inverse(Frama_C_unsigned_int_interval(1u << 15, 7u << 15));
}

static void learner(void)
{
    for (int n = 1; n <= DQW_LEARNER_INPUTS_Q15; n++) {
        int32_t w_q31[DQW_LEARNER_INPUTS_Q15];
        int16_t x_q15[DQW_LEARNER_INPUTS_Q15];
        for (int i = 0; i < n; i++) w_q31[i] = any32(), x_q15[i] = any16();
        (void)dqw_learner_step_pu_q15(w_q31, x_q15, n, any16(), any_unsigned16());
    }
}

int main(void)
{
    shifts();
    scalings();
    gains();
    sums_and_products();
    learner();
    return 0;
}
