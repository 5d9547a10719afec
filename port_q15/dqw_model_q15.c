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
    for (int i = 0; i < DQW_BLOCK_Q15_SIGNALS; i++)
        mean_q28[i] = dqw_q31_sat(dqw_q_scale64((int64_t)sums[i] * part_q30, -less[i]));
    const dqw_block_q15 b = {mean_q28[0], mean_q28[1], mean_q28[2], mean_q28[3], mean_q28[4],
                             mean_q28[5], mean_q28[6], mean_q28[7], mean_q28[8]};
    return b;
}

// To a number whose negative is one too.
static void less(int32_t *x_q28, int64_t by_q28)
{
    *x_q28 = (int32_t)dqw_q_within64(*x_q28 - by_q28, INT32_MAX);
}

void dqw_model_correct_q15(dqw_block_q15 *b, const dqw_machine_q15 *known)
{
    const int64_t turn_q28 = dqw_q_times64(known->turn_q28, b->w_m, -28);
    if (known->R_q40 <= 0 || dqw_q_size64(turn_q28) >= RADIAN_Q28) return;

    // [MOD.1] how much the current bends in a period, on average over the block, and a twelfth of it
    const int32_t v_q28[] = {b->v_d, b->v_q};
    const int32_t di_q28[] = {b->di_d, b->di_q};
    int64_t fix_q28[2];
    for (int axis = 0; axis < 2; axis++) {
        const int other = 1 - axis;
        const int64_t L = known->L_q40[axis];
        if (known->R_q40 >= L) return;
        const int64_t turned = dqw_q_product64(
            turn_q28, v_q28[other] + dqw_q_times64(known->L_q40[other], di_q28[other], -40), -28);
        const int64_t jump = (axis == 0 ? turned : -turned) - dqw_q_times64(known->R_q40, di_q28[axis], -40);
        fix_q28[axis] = dqw_q_quotient64(jump, 12 * L, 40);
    }
    // [MOD.2] that much the trapezoid's means are too large
    less(&b->i_d, fix_q28[0]);
    less(&b->i_q, fix_q28[1]);
    less(&b->wi_d, dqw_q_times64(fix_q28[0], b->w_m, -28));
    less(&b->wi_q, dqw_q_times64(fix_q28[1], b->w_m, -28));
}
