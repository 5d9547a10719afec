// dqw_shaft_q15: the background. It learns what the interrupt handed over, solves, and reads.
#include <stddef.h>

#include "dqw_effect_q15.h"
#include "dqw_q15.h"
#include "dqw_shaft_q15.h"

#define EXCITATION_Q15 66
#define SOLVE_BLOCKS 4u
// Until so many blocks, solved after powers of two as well.
#define FIRST_SOLUTIONS 16u
// Blocks that only teach: start values are no residual.
#define FIRST_BLOCKS 8u
// Blocks over which the residual's statistics are means.
#define MEMORY 10000u
// A smaller residual is none; nor one below 2^-27 of the target's square, which the sums do not resolve.
#define VARIANCE_FLOOR_Q56 8
#define RESOLVED_BITS 27u
// Beyond this, autocorrelation says that the model is wrong, not that the data are few: 0.98.
#define LAG_MAX_Q20 1027604
#define ONE_Q20 1048576
#define NOT_LEARNED INT64_MAX
// A weight whose variance is above this was not learned, it fell by less than a hundred times: what it holds is its
// start value.
#define LEARNED_Q40 ((int64_t)10000 << 40)
// Three deviations below a tenth.
#define USABLE 30

enum { SIGNALS = DQW_SHAFT_Q15_SIGNALS, INPUTS = DQW_SHAFT_Q15_INPUTS };

static int32_t mean_of(int32_t sum, int32_t part_q30, unsigned less)
{
    return dqw_q31_sat(dqw_q_round64((int64_t)sum * part_q30, less));
}

static int32_t inputs_of(const dqw_shaft_q15 *s, const int32_t block[SIGNALS], uint16_t weight, int32_t x_q28[INPUTS])
{
    // One over the weight is good to 1e-5, and the same for target and inputs: weights do not see it.
    const int32_t part_q30 = (int32_t)(1073741824u / weight);
    // The step in half a block, so that it keeps its digits: |sum part half| < 2^(46 + 7).
    x_q28[DQW_J] = dqw_q31_sat(dqw_q_round64((int64_t)block[1] * part_q30 * s->window.half, 17));
    x_q28[DQW_B] = mean_of(block[2], part_q30, 18);
    // Behind the torque, and without the direction where it is not learned.
    const int behind = s->config->coulomb ? 1 : 2;
    for (int i = DQW_COULOMB; i < s->inputs; i++) x_q28[i] = mean_of(block[behind + i], part_q30, 18);
    return mean_of(block[0], part_q30, 17);
}

static void follow(int64_t *mean_q56, int64_t x_q56, uint32_t n)
{
    *mean_q56 += dqw_q_quotient64(x_q56 - *mean_q56, (int64_t)n, 0);
}

// Residual statistics of a block whose error was e before the weights were corrected.
static void judge(dqw_shaft_q15 *s, int32_t e_q28, int32_t y_q28)
{
    if (s->gate.blocks < UINT32_MAX) s->gate.blocks++;
    const uint32_t blocks = s->gate.blocks;
    follow(&s->target_q56, (int64_t)y_q28 * y_q28, blocks < MEMORY ? blocks : MEMORY);
    if (blocks <= FIRST_BLOCKS) return;
    const uint32_t since = blocks - FIRST_BLOCKS;
    const uint32_t n = since < MEMORY ? since : MEMORY;
    follow(&s->error_q56, (int64_t)e_q28 * e_q28, n);
    follow(&s->lag_q56, (int64_t)e_q28 * s->error_last_q28, n);
    s->error_last_q28 = e_q28;
}

static int64_t variance_q56(const dqw_shaft_q15 *s, const dqw_solution_q15 *solution)
{
    const int64_t freedom = (int64_t)s->gate.blocks - s->inputs;
    const int64_t floor_q56 = dqw_q_floor64(s->target_q56, RESOLVED_BITS) + VARIANCE_FLOOR_Q56;
    int64_t v_q56 = freedom < 1 ? (int64_t)1 << 56 : dqw_q_quotient64(solution->left_q32, freedom, 24);
    v_q56 = v_q56 > floor_q56 ? v_q56 : floor_q56;
    if (s->error_q56 <= VARIANCE_FLOOR_Q56 || s->lag_q56 <= 0) return v_q56;
    const int64_t ratio_q20 = dqw_q_quotient64(s->lag_q56, s->error_q56, 20);
    const int64_t r_q20 = ratio_q20 > LAG_MAX_Q20 ? LAG_MAX_Q20 : ratio_q20;
    return dqw_q_product64(v_q56, dqw_q_quotient64(ONE_Q20 + r_q20, ONE_Q20 - r_q20, 20), -20);
}

// Root of a variance, per unit, and a covariance. Both are scaled to where the root has 30 bits.
static int64_t root_q40(int64_t variance, int64_t cov_q40)
{
    if (variance <= 0 || cov_q40 <= 0) return 0;
    // An even number of bits, from Q96.
    const int less = ((int)dqw_q_bits64(variance) + (int)dqw_q_bits64(cov_q40) - 60) / 2;
    const uint32_t root = dqw_q_root64((uint64_t)dqw_q_product64(variance, cov_q40, -2 * less));
    return dqw_q_scale64(root, less - 8);
}

static void solve(dqw_shaft_q15 *s)
{
    dqw_solution_q15 solution;
    dqw_normal_solve_q15(&s->normal, s->start_q40, &solution);
    const int64_t variance = variance_q56(s, &solution);
    for (int i = 0; i < s->inputs; i++) {
        s->w_q40[i] = solution.w_q40[i];
        s->sd_q40[i] = solution.cov_q40[i] < LEARNED_Q40 ? root_q40(variance, solution.cov_q40[i]) : NOT_LEARNED;
    }
}

static bool learn(dqw_shaft_q15 *s, const int32_t block[SIGNALS], uint16_t weight)
{
    // [SHAFT.3] the block's inputs, and which of them can teach their weight
    int32_t x_q28[INPUTS] = {0};
    const int32_t y_q28 = inputs_of(s, block, weight, x_q28);
    const dqw_shaft_q15_config *c = s->config;
    const int32_t least_q28 = (c->excitation_q15 != 0 ? c->excitation_q15 : EXCITATION_Q15) * 8192;
    int32_t taught_q28[INPUTS] = {0};
    int64_t e_q28 = y_q28;
    int64_t rest_q28 = y_q28;
    uint32_t excited = 0;
    for (int i = 0; i < s->inputs; i++) {
        const int64_t part_q28 = dqw_q_product64(s->w_q40[i], x_q28[i], -40);
        e_q28 -= part_q28;
        if (x_q28[i] < least_q28 && x_q28[i] > -least_q28) {
            rest_q28 -= part_q28;  // predicts, and does not learn
            continue;
        }
        taught_q28[i] = x_q28[i];
        excited |= 1u << i;
    }
    s->excited = excited;
    if (excited == 0) return false;

    // [SHAFT.4] correct the weights of one neuron by all that was learned
    dqw_normal_add_q15(&s->normal, taught_q28, dqw_q31_sat(rest_q28));
    judge(s, dqw_q31_sat(e_q28), y_q28);
    const uint32_t blocks = s->gate.blocks;
    const uint32_t every = c->solve_blocks != 0 ? c->solve_blocks : SOLVE_BLOCKS;
    if (blocks % every == 0 || (blocks < FIRST_SOLUTIONS && (blocks & (blocks - 1u)) == 0)) solve(s);
    return true;
}

bool dqw_shaft_background_q15(dqw_shaft_q15 *s)
{
    if (!dqw_handover_waits(&s->window.over)) return false;
    int32_t block[SIGNALS];
    int32_t sum[2];
    uint16_t weight;
    const uint32_t event = dqw_window_join_q15(&s->window, &s->rise, block, &weight, sum);
    dqw_handover_release(&s->window.over);
    if (event == DQW_EVENT_INCOMPLETE && s->gate.incomplete < UINT32_MAX) s->gate.incomplete++;
    return event == DQW_EVENT_BLOCK && learn(s, block, weight);
}

dqw_reading_q15 dqw_shaft_read_q15(const dqw_shaft_q15 *s, enum dqw_shaft_parameter which)
{
    dqw_reading_q15 r = {0, NOT_LEARNED, NOT_LEARNED, false};
    const int i = (int)which;
    if (i < 0 || i > DQW_COULOMB || (i == DQW_COULOMB && !s->config->coulomb)) return r;
    // The weight of a step in half a block is J of one period over as many periods.
    const int64_t times = i == DQW_J ? s->window.half : 1;
    r.value_q40 = dqw_q_product64(s->w_q40[i], times, 0);
    if (s->sd_q40[i] == NOT_LEARNED) return r;
    r.sd_q40 = r.sd_change_q40 = dqw_q_product64(s->sd_q40[i], times, 0);
    r.usable = dqw_q_product64(r.sd_q40, USABLE, 0) < r.value_q40;
    return r;
}

#if DQW_EFFECT_WEIGHTS > 0
int dqw_shaft_read_effect_q15(const dqw_shaft_q15 *s, int index, int64_t weights_q40[], int64_t sd_q40[])
{
    if (index < 0 || index >= s->effect_count) return DQW_ERR_SIZE;
    int first = s->inputs - s->weights;
    for (int k = 0; k < index; k++) first += dqw_effect_weights((enum dqw_effect_name)s->effect[k].effect);
    const int n = dqw_effect_weights((enum dqw_effect_name)s->effect[index].effect);
    for (int i = 0; i < n; i++) {
        weights_q40[i] = s->w_q40[first + i];
        sd_q40[i] = s->sd_q40[first + i];
    }
    return (int)dqw_effect_known_q15(weights_q40, sd_q40, n);
}
#endif
