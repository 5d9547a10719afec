// The arithmetic itself, on operands of every size.
#include "dqw_q15.h"
#include "target/hash.h"
#include "target/stimulus.h"

hash hash_q15(void)
{
    static stimulus s;
    hash h = HASH_EMPTY;
    stimulus_start(&s);
    for (int k = 0; k < 5000; k++) {
        const int64_t a = stimulus_any(&s);
        const int64_t b = stimulus_any(&s);
        const int32_t a32 = dqw_q31_sat(a);
        const int32_t b32 = dqw_q31_sat(b);
        const int n = (int)(stimulus_bits(&s) % 126u) - 63;
        const unsigned shift = 1u + stimulus_bits(&s) % 29u;
        hash_put(&h, dqw_q_round32(a32 / 2, shift));
        hash_put(&h, dqw_q_round64(a / 2, 2u * shift));
        hash_put(&h, dqw_q30_mul(a32, dqw_q15_sat(b32)));
        hash_put(&h, dqw_q31_mul(dqw_q28_sat(a32), dqw_q15_sat(b32)));
        hash_put(&h, dqw_q15_top(a32));
        hash_put(&h, dqw_q_bits64(a));
        hash_put(&h, dqw_q_scale64(a, n));
        hash_put(&h, dqw_q_product64(a, b, n));
        hash_put(&h, dqw_q_quotient64(a, b, n));
        hash_put(&h, dqw_q_root64((uint64_t)a));
    }
    return h;
}
