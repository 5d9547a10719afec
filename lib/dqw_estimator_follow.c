// What lasts of the residual, and what follows when a weight has changed.
#include <math.h>

#include "dqw_estimator_block.h"
#include "dqw_segment.h"

// A segment takes so much of learned blocks at least and at most.
#define SEGMENT_LEAST_S 0.35f
#define SEGMENT_MOST_S 20.0f
// What lasts in health may rise by this part of itself in a segment; from nothing to what noise would hide, some per
// cent of the residual, in about as many segments as bands are young.
#define CALM_RISE 0.15f
#define CALM_LEAST (1.0f / 1024.0f)
// Bands to begin with, and the narrowest, as parts of the weight; the flux is known best. Dead time's are parts of the
// base.
#define LEAST_BAND 0.002f
#define LEAST_BAND_PSI 0.00035f
#define LEAST_BAND_DEAD_PU 0.0003f
// How far a weight may have jumped at once; what changed by more is found once more.
#define WIDE 0.3f
#define WIDE_PSI 0.1f
#define WIDE_DEAD_PU 0.03f
// What a weight may wander in a second without being found changed, as part of itself. A winding that warms by 1 K/s
// is four times faster, which segments that agree make up for.
#define WALK_R 1e-3f
#define WALK 3e-4f

enum { D = DQW_AXIS_D, Q = DQW_AXIS_Q, N = DQW_FOLLOWED };

// Of what a weight is now: how narrow its band may be, and how far it may jump.
static float part_of(const dqw_estimator *e, int i, float of_any, float of_flux, float dead_pu)
{
    const bool flux = i == DQW_PSI || i == DQW_PSI_Q;
    if (dqw_estimator_is_apart(e, i)) return 0.0f;
    if (i > DQW_PSI && !flux && i < DQW_PARAMETERS) return dead_pu;
    return (flux ? of_flux : of_any) * dqw_estimator_size_pu(e, i);
}

void dqw_estimator_least_bands(const dqw_estimator *e, float band_pu[])
{
    for (int i = 0; i < N; i++) band_pu[i] = part_of(e, i, LEAST_BAND, LEAST_BAND_PSI, LEAST_BAND_DEAD_PU);
}

void dqw_estimator_keep_alone(dqw_estimator *e, const float k[], float seen)
{
    if (!(seen < 1.0f) || e->blocks <= DQW_LASTING_FROM) return;
    const float more = 1.0f / (1.0f - seen);
    for (int i = 0; i < e->inputs; i++) {
        // The gain is P times the inputs, and P_ii was this before the row.
        const float px = k[i] * more;
        const float own = dqw_gain_covariance(&e->gain, i, i) + k[i] * px;
        const float alone = px / own;
        e->alone_pu2[i] += (alone * alone - e->alone_pu2[i]) * dqw_lasting_part(e, 1.0f);
    }
}

static void forget_neighbours(dqw_estimator *e)
{
    for (int axis = 0; axis < 2; axis++) {
        for (int k = 0; k < 3; k++) e->e_before_pu[k][axis] = 0.0f;
        e->slow_before_pu[axis] = 0.0f;
    }
    e->slow_at = 0;
}

// One stretch is complete: its means, and what the others leave of one axis'; of the other one's in the next.
static void end_stretch(dqw_estimator *e, float n)
{
    const float part = dqw_lasting_part(e, n);
    float slow = 0.0f;
    for (int axis = 0; axis < 2; axis++) {
        const float mean = e->slow_sum_pu[axis] / n;
        slow += 0.5f * mean * e->slow_before_pu[axis];
        e->slow_before_pu[axis] = mean;
    }
    e->slow_pu2 += (slow - e->slow_pu2) * part;

    float px[DQW_ESTIMATOR_INPUTS];
    dqw_gain_apply(&e->gain, e->slow_x_pu, px);
    for (int i = 0; i < e->inputs; i++) {
        const float alone = px[i] / (n * dqw_gain_covariance(&e->gain, i, i));
        e->slow_alone_pu2[i] += (alone * alone - e->slow_alone_pu2[i]) * part;
    }
    e->slow_axis = e->slow_axis == D ? Q : D;
}

void dqw_estimator_keep_lasting(dqw_estimator *e, const dqw_estimator_rows *r, const float ratio[2], int sixfold)
{
    if (e->elapsed != 1) forget_neighbours(e);
    if (e->slow_at == 0) {
        e->slow_sum_pu[D] = e->slow_sum_pu[Q] = 0.0f;
        for (int i = 0; i < e->inputs; i++) e->slow_x_pu[i] = 0.0f;
    }
    // [FOL.1] what of the residual is still there two and three blocks later, where blocks overlap no more
    float product[3] = {0.0f, 0.0f, 0.0f};
    for (int axis = 0; axis < 2; axis++) {
        const float now = e->e_pu[axis] / sqrtf(ratio[axis]);
        for (int k = 0; k < 2; k++) product[k] += 0.5f * now * e->e_before_pu[k + 1][axis];
        for (int k = 2; k > 0; k--) e->e_before_pu[k][axis] = e->e_before_pu[k - 1][axis];
        e->e_before_pu[0][axis] = now;
        e->slow_sum_pu[axis] += now;
    }
    const float weigh = 1.0f / sqrtf(ratio[e->slow_axis]);
    for (int i = 0; i < e->inputs; i++) e->slow_x_pu[i] += r->x[e->slow_axis][i] * weigh;
    if (e->blocks <= DQW_LASTING_FROM) {
        e->slow_at = 0;
        return;
    }
    const float part = dqw_lasting_part(e, 1.0f);
    // What goes with the sign, whatever lasts anyway.
    product[2] = (float)sixfold * (product[0] - e->lasting_pu2[0]);
    for (int k = 0; k < 3; k++) e->lasting_pu2[k] += (product[k] - e->lasting_pu2[k]) * part;
    // [FOL.2] and from one stretch to the next
    const int n = dqw_estimator_stretch(e);
    if (++e->slow_at < n) return;
    end_stretch(e, (float)n);
    e->slow_at = 0;
}

void dqw_estimator_show_segment(dqw_estimator *e, int axis, const dqw_estimator_rows *r, uint32_t mask, float ratio)
{
    const float weigh = 1.0f / sqrtf(ratio);
    float x[N];
    float error = r->y[axis];
    for (int i = 0; i < e->inputs; i++) error -= e->w_pu[i] * r->x[axis][i];
    const int followed = dqw_estimator_has_map(e) ? N : DQW_PARAMETERS;
    for (int i = 0; i < N; i++) x[i] = i < followed && (mask >> i & 1u) != 0 ? r->x[axis][i] * weigh : 0.0f;
    dqw_segment_row(&e->segment, x, error * weigh);
}

// Down at once, up slowly.
static float calmer(float calm, float now, float all, bool first)
{
    const float most = calm + CALM_RISE * (calm + CALM_LEAST * all);
    return first || now < most ? now : most;
}

// What has changed must not seem to be what the model always lacked.
static void keep_calm(dqw_estimator *e)
{
    const dqw_lasting now = dqw_estimator_lasting(e);
    const bool first = !dqw_estimator_knows_calm(e);
    dqw_lasting *calm = &e->calm;
    calm->fast_pu2 = calmer(calm->fast_pu2, now.fast_pu2, calm->all_pu2, first);
    calm->slow_pu2 = calmer(calm->slow_pu2, now.slow_pu2, calm->all_pu2, first);
    calm->turning_pu2 = calmer(calm->turning_pu2, now.turning_pu2, calm->all_pu2, first);
    calm->all_pu2 = calmer(calm->all_pu2, now.all_pu2, 0.0f, first);
}

// What the weight may wander in a segment, what one says of it, and so what part it is to be moved by: as sure as that,
// and no surer.
static void stay_awake(dqw_estimator *e, int i, float seconds, float rows, float variance)
{
    const float alone = e->alone_pu2[i];
    const bool wanders = i <= DQW_PSI || i == DQW_PSI_Q || (i >= DQW_PARAMETERS && !dqw_estimator_is_apart(e, i));
    if (!wanders || !(alone > 0.0f) || (e->learned >> i & 1u) == 0) return;
    const dqw_segment *s = &e->segment;
    // The more, the more segments agree.
    const float agrees = 1.0f + dqw_segment_agreed(s, i);
    const float walk = (i == DQW_R ? WALK_R : WALK) * dqw_estimator_size_pu(e, i) * agrees;
    const float q = walk * walk * seconds;
    const float scatter = s->band_pu[i] * s->band_pu[i] + variance / (rows * alone);
    const float p = 0.5f * (q + sqrtf(q * q + 4.0f * q * scatter));
    const float want = p / (scatter * rows * alone);
    const float has = dqw_gain_covariance(&e->gain, i, i);
    if (has < want) dqw_gain_grow(&e->gain, i, want - has);
}

// A weight has changed: all move as the segment says, and its past weighs little from now on.
static void open(dqw_estimator *e, int changed, const float wide_pu[], const float move_pu[])
{
    const dqw_lasting *calm = &e->calm;
    e->segment.since = 1;
    for (int k = 0; k < 2; k++) e->lasting_pu2[k] = calm->fast_pu2;
    e->lasting_pu2[2] = calm->turning_pu2;
    e->slow_pu2 = calm->slow_pu2;
    for (int axis = 0; axis < 2; axis++)
        if (e->error_pu2[axis] > calm->all_pu2) e->error_pu2[axis] = calm->all_pu2;
    if (e->opened < UINT8_MAX) e->opened++;
    e->opened_at = e->number;
    e->opened_since = e->segment.agreed ? e->began_before : e->began;
    const int followed = dqw_estimator_has_map(e) ? N : DQW_PARAMETERS;
    for (int i = 0; i < followed; i++) {
        e->w_pu[i] += move_pu[i];
        // The others took up a part of it while it was not known.
        const float took = i == changed ? wide_pu[i] : DQW_TOOK_BANDS * e->segment.band_pu[i];
        dqw_gain_grow(&e->gain, i, took * took / calm->all_pu2);
    }
}

bool dqw_estimator_segment_ends(dqw_estimator *e, const dqw_estimator_block *b)
{
    const dqw_block m = dqw_estimator_means(e, b);
    const float rate = 1.0f / ((float)e->window.half * e->config->dt_s);
    return dqw_segment_block(&e->segment, m.w_m_rad_s / e->config->w_base_rad_s, m.i_q_A / e->config->i_base_A,
                             (uint32_t)(SEGMENT_LEAST_S * rate), (uint32_t)(SEGMENT_MOST_S * rate));
}

void dqw_estimator_follow(dqw_estimator *e, const dqw_estimator_block *b)
{
    dqw_segment *s = &e->segment;
    if (s->blocks == 0) {
        e->began_before = e->began;
        e->began = e->number;
    }
    if (!dqw_estimator_segment_ends(e, b)) return;
    const float rows = 2.0f * (float)s->blocks;
    const float seconds = (float)s->blocks * ((float)e->window.half * e->config->dt_s);
    // [FOL.3] what lasts while nothing seems to change
    keep_calm(e);
    // [FOL.4] what the segment says, of bands that are no narrower than this and may be as wide as that
    dqw_segment_known known;
    float move_pu[N];
    dqw_estimator_least_bands(e, known.least_pu);
    for (int i = 0; i < N; i++) {
        const float hidden = dqw_estimator_is_apart(e, i) ? 0.0f : dqw_estimator_model_pu(e, i, &e->calm);
        const float wide = part_of(e, i, WIDE, WIDE_PSI, WIDE_DEAD_PU);
        known.wide_pu[i] = dqw_estimator_observer_hides(e, i) ? 0.0f : wide;
        known.model_pu[i] = hidden < wide ? hidden : wide;
    }
    // [FOL.5] who is moved by how much later on; and what has changed now
    const int changed = dqw_segment_end(s, e->calm.all_pu2, &known, move_pu);
    for (int i = 0; i < N; i++) stay_awake(e, i, seconds, rows, e->calm.all_pu2);
    if (s->since < UINT16_MAX) s->since++;
    if (changed >= 0) open(e, changed, known.wide_pu, move_pu);
}
