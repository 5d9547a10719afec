// The transforms over all angles and values of every size, full scale among them.
#include "dqw_transform_q15.h"
#include "target/hash.h"
#include "target/stimulus.h"

static void put2(hash *h, int16_t a, int16_t b)
{
    hash_put(h, a);
    hash_put(h, b);
}

// One in eight is at an end of the range.
static int16_t value(stimulus *s)
{
    const uint32_t bits = stimulus_bits(s);
    if (bits % 8u == 0) return bits / 8u % 2u == 0 ? INT16_MAX : INT16_MIN;
    return (int16_t)((int32_t)(bits >> 16) - 32768);
}

hash hash_transform(void)
{
    static stimulus s;
    hash h = HASH_EMPTY;
    stimulus_start(&s);
    for (uint32_t turn = 0; turn < 65536; turn += 13) {
        int16_t c;
        int16_t sn;
        dqw_cosine_sine_q15((uint16_t)turn, &c, &sn);
        put2(&h, c, sn);
        dqw_abc_q15 x;
        x.a = value(&s);
        x.b = value(&s);
        x.c = value(&s);
        const dqw_alphabeta_q15 y = dqw_clarke_q15(x);
        const dqw_dq_q15 r = dqw_park_q15(y, c, sn);
        const dqw_dq_q15 paper = dqw_park_paper_q15(y, c, sn);
        const dqw_alphabeta_q15 back = dqw_park_inverse_q15(r, c, sn);
        const dqw_abc_q15 phases = dqw_clarke_inverse_q15(back);
        put2(&h, y.alpha, y.beta);
        put2(&h, r.d, r.q);
        put2(&h, paper.d, paper.q);
        put2(&h, back.alpha, back.beta);
        put2(&h, phases.a, phases.b);
        hash_put(&h, phases.c);
    }
    return h;
}
