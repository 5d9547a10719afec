#include "dqw_learner_q15.h"

#include <stddef.h>

// Keeps the step finite when every input is zero: 1e-6, far below any signal squared that carries information.
#define NORM_FLOOR_Q30 1074

enum dqw_status dqw_learner_init_q15(dqw_learner_q15 *l, const dqw_learner_config_q15 *config)
{
    if (l == NULL || config == NULL) return DQW_ERR_NULL;
    if (config->inputs < 1 || config->inputs > DQW_LEARNER_INPUTS_Q15) return DQW_ERR_SIZE;
    if (config->step_size_q15 == 0) return DQW_ERR_RANGE;

    const dqw_learner_q15 zero = {0};
    *l = zero;
    l->inputs = (uint8_t)config->inputs;
    l->step_size_q15 = config->step_size_q15;
    l->noisy_inputs = config->noisy_inputs;
    l->indicator = config->indicator;
    return DQW_OK;
}

int32_t dqw_learner_forward_q15(const dqw_learner_q15 *l, const int16_t x_q15[])
{
    int32_t y_q28 = 0;  // |y_q28| <= 6 * 2^28
    for (int i = 0; i < l->inputs; i++) y_q28 += dqw_q_round32(dqw_q30_mul(l->w_q31[i], x_q15[i]), 2);
    return y_q28;
}

int32_t dqw_learner_learn_q15(dqw_learner_q15 *l, const int16_t x_q15[], int16_t target_q15)
{
    // [LMS.1] how large inputs and weights are
    int64_t norm_q30 = l->indicator ? (int64_t)1 << 30 : 0;
    uint32_t w_norm_q15 = 1u << 15;
    for (int i = 0; i < l->inputs; i++) {
        const int32_t w_q15 = dqw_q15_top(l->w_q31[i]);
        norm_q30 += (int64_t)x_q15[i] * x_q15[i];
        w_norm_q15 += (uint32_t)(w_q15 * w_q15) >> 15;  // <= 7 * 2^15
    }

    // [LMS.2] error before the correction
    const int32_t e_q28 = target_q15 * (1 << 13) - dqw_learner_forward_q15(l, x_q15);  // |e_q28| <= 7 * 2^28

    // [LMS.3] normalised step, the constant input counted in the norm; with noisy inputs down the gradient of
    // e^2 / (1 + |w|^2), normalised by the inputs' expected power: their own would weigh the noise in, and bias. A
    // sample so large that the step would more than mirror the error is normalised by itself after all
    if (l->noisy_inputs) {
        const int64_t expected_q30 = ((int64_t)l->inputs + (l->indicator ? 1 : 0)) << 30;
        const int64_t half_q30 = dqw_q_round64(norm_q30 * l->step_size_q15, 16);
        norm_q30 = half_q30 > expected_q30 ? half_q30 : expected_q30;
    }
    norm_q30 += NORM_FLOOR_Q30;
    // norm = d 2^(bits - 31), 1 <= d < 2
    const int bits = (int)dqw_q_bits64(norm_q30);
    const int64_t inverse_q16 = dqw_q16_inverse_by_steps((uint32_t)dqw_q_scale64(norm_q30, 16 - bits));
    const int64_t step_q31 = inverse_q16 * l->step_size_q15;
    const int64_t g_q31 = dqw_q_within64(dqw_q_round64(e_q28 * step_q31, 28),
                                         (int64_t)1 << 31);  // |e_q28 step_q31| <= 7 * 2^60
    const int64_t capped_q28 = dqw_q_within64(e_q28, (int64_t)1 << 28);
    const int64_t pull_q28 = l->noisy_inputs ? dqw_q_round64(capped_q28 * dqw_q16_inverse(w_norm_q15), 16) : 0;
    for (int i = 0; i < l->inputs; i++) {
        const int64_t z_q30 = (int64_t)x_q15[i] * (1 << 15) +
                              dqw_q_round64(pull_q28 * l->w_q31[i], 29);                  // |z_q30| <= 1.5 * 2^30
        l->w_q31[i] = dqw_q31_sat(l->w_q31[i] + dqw_q_scale64(g_q31 * z_q30, 1 - bits));  // |g z| <= 1.5 * 2^61
    }
    if (l->indicator) {
        const int64_t off_q28 = capped_q28 - dqw_q_round32(dqw_q_floor32(l->w_o_q31, 2), 1);  // |off_q28| <= 2^29
        l->w_o_q31 = dqw_q31_sat(l->w_o_q31 + dqw_q_scale64(off_q28 * step_q31, 3 - bits));   // |off step| <= 2^61
    }
    if (l->learned < UINT32_MAX) l->learned++;
    return e_q28;
}

int32_t dqw_learner_weight_q15(const dqw_learner_q15 *l, int i)
{
    return i < 0 || i >= l->inputs ? 0 : l->w_q31[i];
}

enum dqw_status dqw_learner_set_weight_q15(dqw_learner_q15 *l, int i, int32_t w_q31)
{
    if (l == NULL) return DQW_ERR_NULL;
    if (i < 0 || i >= l->inputs) return DQW_ERR_SIZE;
    l->w_q31[i] = w_q31;
    return DQW_OK;
}
