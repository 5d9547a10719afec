// Which legs switch, where nobody says it: one way leads, at first that all do, and each other one is tried beside it
// in turn, some blocks of one and some of the other, over a segment of driving. (E101)
#include "dqw_estimator_search.h"

#include "dqw_estimator_block.h"
#include "dqw_segment.h"

// A rival leads from then on that leaves at most this part of what all legs leave, or less clearly less where it is far
// below the next best. Where none comes near, all legs switch.
#define LEADS 0.7f
#define NEAR 0.8f
#define FAR 0.6f
#define ROUNDS_LEAST 2
#define ROUNDS_MOST 4
// Two halves of a block, and two blocks of a half.
#define MIXED 2u
// Blocks of one, then of the other: shorter than an operating point, and not in step with the rotor.
#define RUN_LEAST 8u
#define RUN_MORE 7u
// What a weight is known by beside the sums: they are good to that part of themselves.
#define RIDGE 1e-5f

// All legs, and three ways to let one rest: each but the one that leads.
enum { RIVALS = 3, N = DQW_PARAMETERS };

// What a least squares' sum leaves, and what it is made of; of single rows.
typedef struct {
    float a[N * (N + 1) / 2], b[N];
} sums;

static float *at(sums *s, int i, int j)
{
    return &s->a[i < j ? j * (j + 1) / 2 + i : i * (i + 1) / 2 + j];
}

// What all weights together explain.
static float explained(sums *s)
{
    float power = 0.0f;
    for (int k = 0; k < N; k++) {
        const float own = *at(s, k, k) * (1.0f + RIDGE) + RIDGE;
        const float part = s->b[k] / own;
        power += part * s->b[k];
        for (int j = k + 1; j < N; j++) {
            const float by = *at(s, k, j) / own;
            s->b[j] -= by * s->b[k];
            for (int i = k + 1; i <= j; i++) *at(s, i, j) -= by * *at(s, k, i);
        }
    }
    return power;
}

enum dqw_modulation dqw_estimator_modulation(const dqw_estimator *e)
{
    return e->trial != 0 ? DQW_MODULATION_UNKNOWN : (enum dqw_modulation)e->modulation;
}

static void use(dqw_estimator *e, int modulation)
{
    *(volatile uint8_t *)&e->modulation = (uint8_t)modulation;
    e->mixed = MIXED;
    e->slow_at = (uint8_t)(RUN_LEAST + e->number % RUN_MORE);
}

static int rival_of(const dqw_estimator *e)
{
    const int k = (e->trial - 1) % RIVALS;
    return k < e->leader ? k : k + 1;
}

// Nothing is learned meanwhile, so that there is room: the sums of the rival are the segment's; those of the leader
// stand where the gain and the late voltage's weights are.
static void begin_trial(dqw_estimator *e)
{
    dqw_segment *s = &e->segment;
    for (int k = 0; k < N * (N + 1) / 2; k++) s->a[k] = 0.0f;
    for (int k = 0; k < N * (N - 1) / 2; k++) e->gain.u[k] = 0.0f;
    for (int k = 0; k < N; k++) s->b[k] = e->gain.d[k] = e->late_w[k] = 0.0f;
    for (int k = 0; k < 2; k++) s->sum[k] = s->square[k] = e->slow_before_pu[k] = e->slow_sum_pu[k] = 0.0f;
    s->blocks = 0;
}

static void lead(dqw_estimator *e, int modulation)
{
    e->leader = (uint8_t)modulation;
    e->trial = 1;
    for (int m = 0; m <= RIVALS; m++) e->alone_pu2[m] = e->slow_alone_pu2[m] = 0.0f;
    begin_trial(e);
    use(e, modulation);
}

static void begin(dqw_estimator *e)
{
    // Nothing is told of them meanwhile.
    e->learned = 0;
    e->late_pu2 = 0.0f;
    // Their part is what is asked for.
    e->w_pu[DQW_DEAD_TIME] = e->w_pu[DQW_DEAD_CONSTANT] = 0.0f;
    lead(e, DQW_MODULATION_CENTRED);
    e->mixed = 0;
}

static void show_leader(dqw_estimator *e, const float x[], float error)
{
    float *u = e->gain.u;
    for (int j = 0; j < N; j++) {
        for (int i = 0; i < j; i++) *u++ += x[i] * x[j];
        e->gain.d[j] += x[j] * x[j];
        e->late_w[j] += x[j] * error;
    }
}

static void show(dqw_estimator *e, const dqw_estimator_rows *r, const uint32_t mask[2])
{
    const bool rival = e->modulation != e->leader;
    for (int axis = 0; axis < 2; axis++) {
        float x[DQW_FOLLOWED];
        float error = r->y[axis];
        for (int i = 0; i < e->inputs; i++) error -= e->w_pu[i] * r->x[axis][i];
        for (int i = 0; i < DQW_FOLLOWED; i++) x[i] = i < N && (mask[axis] >> i & 1u) != 0 ? r->x[axis][i] : 0.0f;
        if (rival)
            dqw_segment_row(&e->segment, x, error);
        else
            show_leader(e, x, error);
        e->slow_before_pu[rival ? 1 : 0] += error * error;
    }
    e->slow_sum_pu[rival ? 1 : 0] += 1.0f;
}

// What both have left, a block.
static void end_trial(dqw_estimator *e)
{
    sums leader;
    sums rival;
    const float *u = e->gain.u;
    for (int j = 0; j < N; j++) {
        for (int i = 0; i < j; i++) *at(&leader, i, j) = *u++;
        *at(&leader, j, j) = e->gain.d[j];
        leader.b[j] = e->late_w[j];
        rival.b[j] = e->segment.b[j];
    }
    for (int k = 0; k < N * (N + 1) / 2; k++) rival.a[k] = e->segment.a[k];
    const int m = rival_of(e);
    e->alone_pu2[m] += (e->slow_before_pu[0] - explained(&leader)) / e->slow_sum_pu[0];
    e->slow_alone_pu2[m] += (e->slow_before_pu[1] - explained(&rival)) / e->slow_sum_pu[1];
}

// What a rival left over what the leader left beside it.
static float ratio_of(const dqw_estimator *e, int modulation)
{
    return e->slow_alone_pu2[modulation] / e->alone_pu2[modulation];
}

// A round is over: which one it is, DQW_MODULATION_UNKNOWN where that is open.
static int judge(dqw_estimator *e)
{
    const int rounds = e->trial / RIVALS;
    int best = -1;
    float least = 1e30f;
    float next = 1e30f;
    for (int m = DQW_MODULATION_CLAMPED_LOW; m <= RIVALS; m++) {
        if (m == e->leader) continue;
        const float ratio = ratio_of(e, m);
        if (ratio < least) {
            next = least;
            least = ratio;
            best = m;
        } else if (ratio < next) {
            next = ratio;
        }
    }
    if (e->leader == (uint8_t)DQW_MODULATION_CENTRED) {
        if (rounds < ROUNDS_LEAST) return DQW_MODULATION_UNKNOWN;
        if (!(least < NEAR)) return DQW_MODULATION_CENTRED;
        if (least <= LEADS || least <= FAR * next) {
            lead(e, best);
            return DQW_MODULATION_UNKNOWN;
        }
        return rounds < ROUNDS_MOST ? DQW_MODULATION_UNKNOWN : DQW_MODULATION_CENTRED;
    }
    // It leads once more: against all legs clearly, against the others at all.
    const bool clear = NEAR * ratio_of(e, DQW_MODULATION_CENTRED) >= 1.0f;
    if (clear && least > 1.0f) return e->leader;
    if (rounds < ROUNDS_LEAST) return DQW_MODULATION_UNKNOWN;
    if (!clear) return DQW_MODULATION_CENTRED;
    if (least < NEAR) return best;
    return rounds < ROUNDS_MOST ? DQW_MODULATION_UNKNOWN : e->leader;
}

void dqw_estimator_try(dqw_estimator *e, const dqw_estimator_block *b, const dqw_estimator_rows *r,
                       const uint32_t mask[2])
{
    if (e->trial == DQW_ESTIMATOR_SEEKS) begin(e);
    // [SEA.1] sums of both in turn over a segment, around weights that stay as they are
    show(e, r, mask);
    const bool turn = --e->slow_at == 0;
    const bool both = e->slow_sum_pu[0] > 0.0f && e->slow_sum_pu[1] > 0.0f;
    if (!dqw_estimator_segment_ends(e, b) || !both) {
        if (turn) use(e, e->modulation != e->leader ? e->leader : rival_of(e));
        return;
    }
    // [SEA.2] what they leave; after a round, is it found
    end_trial(e);
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
    float w[DQW_ESTIMATOR_INPUTS];
    for (int i = 0; i < e->inputs; i++) w[i] = e->w_pu[i];
    dqw_estimator_start(e, w);
}
