#include "dqw_model_q15.h"

// An angle of one radian, Q28.
#define RADIAN_Q28 268435456

int64_t dqw_scale_turn_q28(const dqw_scale *scale, uint32_t pole_pairs)
{
    // mrad/s times ns are 1e-12 rad; with pole pairs below 2^70, in eight bits less
    const int64_t turns = dqw_q_product64((int64_t)scale->w_full_mrad_s * scale->dt_ns, pole_pairs, -8);
    return dqw_q_quotient64(turns, 1000000000000, 36);
}

dqw_block_q15 dqw_model_block_q15(const int32_t sums[], uint16_t weight)
{
    // One over the weight is good to 1e-5, and the same for target and inputs: weights do not see it.
    const int32_t part_q30 = (int32_t)(1073741824u / weight);
    int32_t mean_q28[DQW_BLOCK_Q15_SIGNALS];
    static const uint8_t less[DQW_BLOCK_Q15_SIGNALS] = {17, 17, 18, 18, 17, 17, 19, 19, 18};
    for (int i = 0; i < DQW_BLOCK_Q15_SIGNALS; i++) mean_q28[i] = dqw_q31_sat(dqw_q_round64((int64_t)sums[i] * part_q30, less[i]));
    const dqw_block_q15 b = {mean_q28[0], mean_q28[1], mean_q28[2], mean_q28[3], mean_q28[4], mean_q28[5], mean_q28[6], mean_q28[7], mean_q28[8]};
    return b;
}

static int64_t size(int64_t x)
{
    return x < 0 ? -x : x;
}

void dqw_model_correct_q15(dqw_block_q15 *b, const dqw_machine_q15 *known)
{
    const int64_t R = known->R_q40;
    const int64_t Ld = known->L_q40[0];
    const int64_t Lq = known->L_q40[1];
    const int64_t turn_q28 = dqw_q_product64(known->turn_q28, b->w_m, -28);
    if (R <= 0 || R >= Ld || R >= Lq || size(turn_q28) >= RADIAN_Q28) return;

    // How much the step of the current changes from the start of a period to its end, on average over the block: a twelfth of that.
    const int64_t v_q = b->v_q + dqw_q_product64(Lq, b->di_q, -40);
    const int64_t v_d = b->v_d + dqw_q_product64(Ld, b->di_d, -40);
    const int64_t jump_d = dqw_q_product64(turn_q28, v_q, -28) - dqw_q_product64(R, b->di_d, -40);
    const int64_t jump_q = -dqw_q_product64(turn_q28, v_d, -28) - dqw_q_product64(R, b->di_q, -40);
    const int64_t fix_d = dqw_q_quotient64(jump_d, 12 * Ld, 40);
    const int64_t fix_q = dqw_q_quotient64(jump_q, 12 * Lq, 40);
    if (10 * (size(fix_d) + size(fix_q)) >= size(b->i_d) + size(b->i_q) + size(b->di_d) + size(b->di_q)) return;
    b->i_d = dqw_q31_sat(b->i_d - fix_d);
    b->i_q = dqw_q31_sat(b->i_q - fix_q);
    b->wi_d = dqw_q31_sat(b->wi_d - dqw_q_product64(b->w_m, fix_d, -28));
    b->wi_q = dqw_q31_sat(b->wi_q - dqw_q_product64(b->w_m, fix_q, -28));
}
