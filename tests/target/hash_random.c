// The Random Learner: samples offered, then epochs, in turn; the reservoir, the draw and the neuron after each.
#include "dqw_random_q15.h"
#include "target/hash.h"
#include "target/stimulus.h"

#define INPUTS 3
#define CAPACITY 20

static void put(hash *h, const dqw_random_q15 *r, const dqw_learner_q15 *l)
{
    for (uint32_t k = 0; k < r->draw.held; k++) {
        for (int i = 0; i < INPUTS; i++) hash_put(h, r->reservoir[k].x_q15[i]);
        hash_put(h, r->reservoir[k].target_q15);
    }
    hash_put(h, r->draw.held);
    hash_put(h, r->draw.seen);
    hash_put(h, r->draw.state);
    hash_put(h, r->draw.at);
    hash_put(h, r->draw.epochs);
    hash_put(h, r->converged);
    for (int i = 0; i <= INPUTS; i++) hash_put(h, r->before_q31[i]);
    for (int i = 0; i < INPUTS; i++) hash_put(h, l->w_q31[i]);
    hash_put(h, l->w_o_q31);
}

hash hash_random(void)
{
    static stimulus s;
    static dqw_random_sample_q15 reservoir[CAPACITY];
    static dqw_random_q15 r;
    static dqw_learner_q15 l;
    static const dqw_random_config_q15 config = {
        .reservoir = reservoir, .capacity = CAPACITY, .draws = 7, .seed = 11, .tolerance_q15 = 33};
    static const dqw_learner_config_q15 neuron = {.inputs = INPUTS, .step_size_q15 = 16384, .indicator = true};
    hash h = HASH_EMPTY;
    stimulus_start(&s);
    hash_put(&h, dqw_random_init_q15(&r, &config));
    hash_put(&h, dqw_learner_init_q15(&l, &neuron));
    for (int k = 0; k < 1000; k++) {
        stimulus_next(&s);
        const int16_t x_q15[INPUTS] = {s.i_d_q15, s.i_q_q15, s.w_m_q15};
        dqw_random_put_q15(&r, x_q15, INPUTS, s.v_d_q15);
        if (k % 4 == 0) hash_put(&h, dqw_random_iterate_q15(&r, &l));
        if (k % 50 == 49) hash_put(&h, dqw_random_epoch_q15(&r, &l));
        if (k % 4 == 0) put(&h, &r, &l);
    }
    return h;
}
