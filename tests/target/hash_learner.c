// The Learner over the drive's signals: the plain neuron at step sizes from slow to more than one, and the whole one
// with and without what it offers; the error and every weight after every step.
#include "dqw_learner_q15.h"
#include "target/hash.h"
#include "target/stimulus_q15.h"

#define INPUTS 4

static void inputs_of(const stimulus *s, int16_t x_q15[INPUTS])
{
    x_q15[0] = s->i_q_q15;
    x_q15[1] = s->i_d_q15;
    x_q15[2] = stimulus_product(s->w_m_q15, s->i_d_q15);
    x_q15[3] = s->w_m_q15;
}

static void plain(hash *h, uint16_t step_size_q15, int inputs)
{
    static stimulus s;
    int32_t w_q31[INPUTS] = {0};
    int16_t x_q15[INPUTS];
    stimulus_start(&s);
    for (int k = 0; k < 3000; k++) {
        stimulus_next(&s);
        inputs_of(&s, x_q15);
        hash_put(h, dqw_learner_step_pu_q15(w_q31, x_q15, inputs, s.v_q_q15, step_size_q15));
        for (int i = 0; i < inputs; i++) hash_put(h, w_q31[i]);
    }
}

static void whole(hash *h, const dqw_learner_config_q15 *config)
{
    static stimulus s;
    static dqw_learner_q15 l;
    int16_t x_q15[INPUTS];
    stimulus_start(&s);
    hash_put(h, dqw_learner_init_q15(&l, config));
    for (int k = 0; k < 3000; k++) {
        stimulus_next(&s);
        inputs_of(&s, x_q15);
        hash_put(h, dqw_learner_learn_q15(&l, x_q15, s.v_q_q15));
        hash_put(h, dqw_learner_forward_q15(&l, x_q15));
        for (int i = 0; i < l.inputs; i++) hash_put(h, dqw_learner_weight_q15(&l, i));
        hash_put(h, l.w_o_q31);
        hash_put(h, l.learned);
    }
}

hash hash_learner(void)
{
    hash h = HASH_EMPTY;
    plain(&h, 16384, 4);
    plain(&h, 33, 4);
    plain(&h, 60000, 3);
    for (int how = 0; how < 4; how++) {
        const dqw_learner_config_q15 config = {.inputs = INPUTS - how / 3,
                                               .step_size_q15 = 16384,
                                               .noisy_inputs = how % 2 != 0,
                                               .indicator = how / 2 != 0};
        whole(&h, &config);
    }
    return h;
}
