// What the tracker says was learned.
#include "dqw_q15.h"
#include "dqw_tracker_q15.h"
#include "dqw_tracker_rows_q15.h"

// A smaller residual is the sampling's own, and rounding: 1e-8.
#define VARIANCE_FLOOR_Q56 720575940
#define LAG_MAX_Q20 1027604
#define LAG_MIN_Q20 (-419430)
#define ONE_Q20 1048576

enum { N = DQW_TRACK_Q15_WEIGHTS };

int32_t dqw_tracker_value_q15(const dqw_tracker_q15 *t, enum dqw_tracker_weight_q15 weight)
{
    return (unsigned)weight < N ? t->w_q24[weight] : INT32_MAX;
}

uint32_t dqw_tracker_unit_q15(const dqw_tracker_q15_config *config, enum dqw_tracker_weight_q15 weight)
{
    switch (weight) {
    case DQW_TRACK_R_Q15: return config->R_uohm;
    case DQW_TRACK_LD_Q15: return config->Ld_nH;
    case DQW_TRACK_LQ_Q15: return config->Lq_nH;
    case DQW_TRACK_PSI_Q15:
    case DQW_TRACK_PSI_Q_Q15: return config->psi_nWb;
    case DQW_TRACK_DEAD_TIME_Q15: return config->scale.v_full_mV * 100u / DQW_TRACK_Q15_DEAD_PARTS * 10u;
    default: return 0;
    }
}

int64_t dqw_tracker_variance_q56(const dqw_tracker_q15 *t, int axis)
{
    return t->error_q56[axis] > VARIANCE_FLOOR_Q56 ? t->error_q56[axis] : VARIANCE_FLOOR_Q56;
}

int64_t dqw_tracker_common_variance_q56(const dqw_tracker_q15 *t)
{
    return dqw_q_floor64(dqw_tracker_variance_q56(t, 0) + dqw_tracker_variance_q56(t, 1), 1);
}

// Blocks overlap by half, so that next ones are alike, or unlike, in what they teach a weight: that widens or narrows its deviation. Dead
// time goes with the current as R does, the flux on the other axis with the speed as the flux. (E61)
static int64_t inflation_q20(const dqw_tracker_q15 *t, int i)
{
    const int like = i == DQW_TRACK_DEAD_TIME_Q15 ? DQW_TRACK_R_Q15 : i == DQW_TRACK_PSI_Q_Q15 ? DQW_TRACK_PSI_Q15 : i;
    if (t->score2_q68[like] <= 0) return ONE_Q20;
    const int64_t r_q20 = dqw_q_quotient64(t->score_lag_q68[like], t->score2_q68[like], 20);
    return ONE_Q20 + 2 * (r_q20 < LAG_MIN_Q20 ? LAG_MIN_Q20 : r_q20 > LAG_MAX_Q20 ? LAG_MAX_Q20 : r_q20);
}

int32_t dqw_tracker_sd_q15(const dqw_tracker_q15 *t, enum dqw_tracker_weight_q15 weight)
{
    if ((unsigned)weight >= N) return INT32_MAX;
    const int i = (int)weight;
    if (((uint32_t)t->learned >> i & 1u) == 0 || t->blocks < 2u * N) return INT32_MAX;
    const int64_t v_q56 = dqw_q_product64(dqw_q_product64(t->cov_q40[i], dqw_tracker_common_variance_q56(t), -40), inflation_q20(t, i), -20);
    // The root of 2^62 at most, Q28
    return dqw_q_floor32((int32_t)dqw_q_root64((uint64_t)v_q56 >> 2), 3);
}

uint32_t dqw_tracker_residual_q28(const dqw_tracker_q15 *t)
{
    return dqw_q_root64((uint64_t)(t->error_q56[0] + t->error_q56[1]));
}
