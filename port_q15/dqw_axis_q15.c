#include "dqw_axis_q15.h"

#include <stddef.h>

#include "dqw_q15.h"

#define RECENT 50u
// A smaller residual is none; nor one below 2^-27 of the target's square, which the sums do not resolve.
#define VARIANCE_FLOOR_Q56 8
#define RESOLVED_BITS 27u
// Beyond this, likeness of neighbours says that the model is wrong, not that the data are few: 0.98.
#define LAG_MAX_Q20 1027604
#define ONE_Q20 1048576

enum dqw_status dqw_axis_init_q15(dqw_axis_q15 *a, int inputs, const int64_t start_q40[])
{
    if (a == NULL || start_q40 == NULL) return DQW_ERR_NULL;
    if (inputs < 1 || inputs > DQW_NORMAL_INPUTS) return DQW_ERR_SIZE;
    int64_t prior_q32[DQW_NORMAL_INPUTS];
    for (int i = 0; i < inputs; i++) prior_q32[i] = DQW_AXIS_Q15_PRIOR_Q32;
    dqw_axis_q15 n = {.blocks = 0};
    const enum dqw_status status = dqw_normal_init_q15(&n.normal, inputs, prior_q32, start_q40);
    if (status != DQW_OK) return status;
    for (int i = 0; i < inputs; i++) n.w_q40[i] = n.start_q40[i] = start_q40[i];
    *a = n;
    return DQW_OK;
}

static void mean(int64_t *m_q56, int64_t x_q56, uint32_t n)
{
    *m_q56 += dqw_q_quotient64(x_q56 - *m_q56, (int64_t)n, 0);
}

int32_t dqw_axis_learn_q15(dqw_axis_q15 *a, const int32_t x_q28[], int32_t target_q28, uint32_t excited)
{
    const int n = a->normal.inputs;
    int32_t x[DQW_NORMAL_INPUTS] = {0};
    // [AXIS.1] the shared error
    int64_t e_q28 = target_q28;
    int64_t y_q28 = target_q28;
    for (int i = 0; i < n; i++) {
        const int64_t part_q28 = dqw_q_product64(a->w_q40[i], x_q28[i], -40);
        e_q28 -= part_q28;
        if ((excited >> i & 1u) != 0)
            x[i] = x_q28[i];
        else
            y_q28 -= part_q28;  // predicts, and does not learn
    }
    const int32_t e = dqw_q31_sat(e_q28);

    // [AXIS.2] correct the weights by all that was learned
    dqw_normal_add_q15(&a->normal, x, dqw_q31_sat(y_q28));

    // [AXIS.3] residual statistics
    if (a->blocks < UINT32_MAX) a->blocks++;
    mean(&a->target_q56, (int64_t)target_q28 * target_q28, a->blocks < DQW_AXIS_Q15_MEMORY ? a->blocks : DQW_AXIS_Q15_MEMORY);
    // Start values are no residual: the first blocks only teach.
    if (a->blocks <= DQW_AXIS_Q15_FIRST) return e;
    const uint32_t since = a->blocks - DQW_AXIS_Q15_FIRST;
    const uint32_t memory = since < DQW_AXIS_Q15_MEMORY ? since : DQW_AXIS_Q15_MEMORY;
    mean(&a->error_q56, (int64_t)e * e, memory);
    mean(&a->lag_q56, (int64_t)e * a->error_last_q28, memory);
    mean(&a->recent_q56, (int64_t)e * e, memory < RECENT ? memory : RECENT);
    a->error_last_q28 = e;
    return e;
}

void dqw_axis_solve_q15(dqw_axis_q15 *a, dqw_solution_q15 *out)
{
    dqw_normal_solve_q15(&a->normal, a->start_q40, out);
    for (int i = 0; i < a->normal.inputs; i++) a->w_q40[i] = out->w_q40[i];
}

int64_t dqw_axis_variance_q56(const dqw_axis_q15 *a, const dqw_solution_q15 *s)
{
    const int64_t freedom = (int64_t)a->blocks - a->normal.inputs;
    if (freedom < 1) return (int64_t)1 << 56;
    const int64_t v_q56 = dqw_q_quotient64(s->left_q32, freedom, 24);
    const int64_t floor_q56 = dqw_q_floor64(a->target_q56, RESOLVED_BITS) + VARIANCE_FLOOR_Q56;
    return v_q56 > floor_q56 ? v_q56 : floor_q56;
}

int64_t dqw_axis_inflation_q20(const dqw_axis_q15 *a)
{
    if (a->error_q56 <= VARIANCE_FLOOR_Q56 || a->lag_q56 <= 0) return ONE_Q20;
    const int64_t ratio_q20 = dqw_q_quotient64(a->lag_q56, a->error_q56, 20);
    const int64_t r_q20 = ratio_q20 > LAG_MAX_Q20 ? LAG_MAX_Q20 : ratio_q20;
    return dqw_q_quotient64(ONE_Q20 + r_q20, ONE_Q20 - r_q20, 20);
}
