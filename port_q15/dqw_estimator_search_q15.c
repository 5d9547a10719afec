// Which legs switch, where nobody says it: one way leads, at first that all do, and each other one is tried beside it
// in turn, some blocks of one and some of the other, over a segment of driving. (E101)
#include "dqw_estimator_search_q15.h"

#include "dqw_estimator_block_q15.h"
#include "dqw_q15.h"

// A rival leads from then on that leaves at most 0.7 of what all legs leave, or 0.8 where that is 0.6 of what the next
// best leaves. Where none comes near, all legs switch.
#define LEADS_Q30 751619277
#define NEAR_Q30 858993459
#define ONE_Q30 1073741824
#define ROUNDS_LEAST 2
#define ROUNDS_MOST 4
// Two halves of a block, and two blocks of a half.
#define MIXED 2u
// Blocks of one, then of the other: shorter than an operating point, and not in step with the rotor.
#define RUN_LEAST 8u
#define RUN_MORE 7u
// Four rounds of them fit.
#define LEFT_MOST_Q40 ((int64_t)1 << 29)

// All legs, and three ways to let one rest: each but the one that leads.
enum { RIVALS = 3, N = DQW_PARAMETERS };

enum dqw_modulation dqw_estimator_modulation_q15(const dqw_estimator_q15 *e)
{
    return e->trial != 0 ? DQW_MODULATION_UNKNOWN : (enum dqw_modulation)e->modulation;
}

static void use(dqw_estimator_q15 *e, int modulation)
{
    *(volatile uint8_t *)&e->modulation = (uint8_t)modulation;
    e->mixed = MIXED;
    e->residual.slow_at = (uint8_t)(RUN_LEAST + e->number % RUN_MORE);
}

static int rival_of(const dqw_estimator_q15 *e)
{
    const int k = (e->trial - 1) % RIVALS;
    return k < e->leader ? k : k + 1;
}

// Nothing is learned meanwhile, so that there is room: the sums of the leader are the neuron's, those of the rival the
// segment's, the power of its errors the first score; blocks of both stand where segments began.
static void begin_trial(dqw_estimator_q15 *e)
{
    const dqw_normal_q15 nothing = {.inputs = e->normal.inputs, .c_q32 = 1};
    e->normal = nothing;
    e->score2_q68[0] = 1;
    e->residual.began = e->residual.began_before = 0;
    dqw_segment_restart_q15(&e->segment);
}

static void lead(dqw_estimator_q15 *e, int modulation)
{
    e->leader = (uint8_t)modulation;
    e->trial = 1;
    for (int m = 0; m <= RIVALS; m++) e->residual.alone_q31[m] = e->residual.slow_alone_q31[m] = 0;
    begin_trial(e);
    use(e, modulation);
}

static void begin(dqw_estimator_q15 *e)
{
    // Nothing is told of them meanwhile.
    e->learned = 0;
    // Their part is what is asked for.
    e->w_q24[DQW_DEAD_TIME] = e->w_q24[DQW_DEAD_CONSTANT] = 0;
    lead(e, DQW_MODULATION_CENTRED);
    e->mixed = 0;
}

static void show(dqw_estimator_q15 *e, const dqw_rows_q15 *r, const uint32_t mask[])
{
    const bool rival = e->modulation != e->leader;
    for (int axis = 0; axis < 2; axis++) {
        int32_t x_q28[DQW_NORMAL_INPUTS] = {0};
        const int32_t e_q28 = dqw_estimator_error_q28(e, axis, r);
        for (int i = 0; i < N; i++)
            if ((mask[axis] >> i & 1u) != 0) x_q28[i] = r->x_q28[axis][i];
        if (!rival) {
            dqw_normal_add_q15(&e->normal, x_q28, e_q28);
            continue;
        }
        dqw_segment_row_q15(&e->segment, x_q28, e_q28);
        e->score2_q68[0] += dqw_q_round64((int64_t)e_q28 * e_q28, 24);
    }
    if (rival)
        e->residual.began_before++;
    else
        e->residual.began++;
}

// The rival's sums, in the place and the form of the leader's.
static void take_rival(dqw_estimator_q15 *e)
{
    dqw_normal_q15 *n = &e->normal;
    const dqw_segment_q15 *s = &e->segment;
    for (int k = 0; k < N * (N + 1) / 2; k++) n->a_q32[k] = dqw_q_scale64(s->a[k], (int)s->a_bits - 24);
    for (int k = 0; k < N; k++) n->b_q32[k] = dqw_q_scale64(s->b[k], (int)s->b_bits - 24);
    n->c_q32 = e->score2_q68[0];
}

// What all weights together leave, a block.
static uint32_t left_q40(const dqw_estimator_q15 *e, uint32_t blocks)
{
    dqw_solution_q15 s;
    dqw_normal_solve_q15(&e->normal, dqw_normal_nought_q40, &s);
    const int64_t left = dqw_q_quotient64(s.left_q32, blocks, 8);
    return (uint32_t)(left < LEFT_MOST_Q40 ? left : LEFT_MOST_Q40);
}

// What a rival left over what the leader left beside it.
static int64_t ratio_q30(const dqw_estimator_q15 *e, int modulation)
{
    return dqw_q_quotient64(e->residual.slow_alone_q31[modulation], e->residual.alone_q31[modulation], 30);
}

// A round is over: which one it is, DQW_MODULATION_UNKNOWN where that is open.
static int judge(dqw_estimator_q15 *e)
{
    const int rounds = e->trial / RIVALS;
    int best = -1;
    int64_t least_q30 = INT64_MAX / 8;
    int64_t next_q30 = INT64_MAX / 8;
    for (int m = DQW_MODULATION_CLAMPED_LOW; m <= RIVALS; m++) {
        if (m == e->leader) continue;
        const int64_t ratio = ratio_q30(e, m);
        if (ratio < least_q30) {
            next_q30 = least_q30;
            least_q30 = ratio;
            best = m;
        } else if (ratio < next_q30) {
            next_q30 = ratio;
        }
    }
    if (e->leader == (uint8_t)DQW_MODULATION_CENTRED) {
        if (rounds < ROUNDS_LEAST) return DQW_MODULATION_UNKNOWN;
        if (least_q30 >= NEAR_Q30) return DQW_MODULATION_CENTRED;
        if (least_q30 <= LEADS_Q30 || 5 * least_q30 <= 3 * next_q30) {
            lead(e, best);
            return DQW_MODULATION_UNKNOWN;
        }
        return rounds < ROUNDS_MOST ? DQW_MODULATION_UNKNOWN : DQW_MODULATION_CENTRED;
    }
    // It leads once more: against all legs clearly, against the others at all.
    const bool clear = 4 * ratio_q30(e, DQW_MODULATION_CENTRED) >= (int64_t)5 * ONE_Q30;
    if (clear && least_q30 > ONE_Q30) return e->leader;
    if (rounds < ROUNDS_LEAST) return DQW_MODULATION_UNKNOWN;
    if (!clear) return DQW_MODULATION_CENTRED;
    if (least_q30 < NEAR_Q30) return best;
    return rounds < ROUNDS_MOST ? DQW_MODULATION_UNKNOWN : e->leader;
}

void dqw_estimator_try_q15(dqw_estimator_q15 *e, const dqw_estimator_q15_block *b, const dqw_rows_q15 *r,
                           const uint32_t mask[])
{
    if (e->trial == DQW_ESTIMATOR_SEEKS_Q15) begin(e);
    // [SEA.1] sums of both in turn over a segment, around weights that stay as they are
    dqw_residual_q15 *k = &e->residual;
    show(e, r, mask);
    const bool turn = --k->slow_at == 0;
    if (!dqw_estimator_segment_ends_q15(e, b) || k->began == 0 || k->began_before == 0) {
        if (turn) use(e, e->modulation != e->leader ? e->leader : rival_of(e));
        return;
    }
    // [SEA.2] what they leave; after a round, is it found
    const int m = rival_of(e);
    k->alone_q31[m] += left_q40(e, k->began);
    take_rival(e);
    k->slow_alone_q31[m] += left_q40(e, k->began_before);
    const int trial = e->trial;
    const int found = trial % RIVALS == 0 ? judge(e) : (int)DQW_MODULATION_UNKNOWN;
    if (found == DQW_MODULATION_UNKNOWN) {
        if (e->trial != trial) return;
        e->trial++;
        begin_trial(e);
        use(e, rival_of(e));
        return;
    }
    // [SEA.3] learning begins anew
    use(e, found);
    e->trial = 0;
    dqw_estimator_start_q15(e, e->w_q24);
}
