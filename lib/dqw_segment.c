#include "dqw_segment.h"

#include <math.h>

#include "dqw_reading.h"

enum { N = DQW_FOLLOWED };

#define AT(i, j) ((j) * ((j) + 1) / 2 + (i))
// Blocks overlap by half: their errors' power counts for half as much again.
#define OVERLAP 1.5f
// Page's sums: what a deviation must exceed to count, and where they tell a change. Siegmund's run length of 1e7
// segments. (E105)
#define ALLOWANCE 1.0f
#define THRESHOLD 7.2f
// Where a channel shows a change already, one segment that is this far off is enough.
#define THRESHOLD_URGENT 4.0f
#define DEVIATION_MOST 6.0f
#define SUM_MOST 15.0f
#define Q11 2048.0f
// A band moves by this part at least, by more while it is young; upwards not while something seems to change.
#define PART_LEAST 0.02f
#define SEEMS 4.0f
#define SCATTER_MOST 9.0f
// Segments until bands are known by their scatter alone, and until a change is believed.
#define YOUNG 20.0f
#define FEW 3
// A segment that knows less of a weight than this, over its band, says nothing of it.
#define SHARE_LEAST 0.02f
// Of the long run's variance, that a segment must have met.
#define MET 0.15f
// Blocks of the long run.
#define LONG_RUN 65536.0f

static void clear(dqw_segment *s)
{
    for (int k = 0; k < AT(0, N); k++) s->a[k] = 0.0f;
    for (int k = 0; k < N; k++) s->b[k] = 0.0f;
    for (int k = 0; k < 2; k++) s->sum[k] = s->square[k] = 0.0f;
    s->blocks = 0;
}

void dqw_segment_init(dqw_segment *s, const float band_pu[])
{
    const dqw_segment zero = {.blocks = 0};
    *s = zero;
    for (int k = 0; k < N; k++) s->band_pu[k] = band_pu[k];
}

static void disagree(dqw_segment *s)
{
    for (int k = 0; k < N; k++) s->up_q11[k] = s->down_q11[k] = 0;
}

void dqw_segment_restart(dqw_segment *s)
{
    clear(s);
    disagree(s);
}

void dqw_segment_row(dqw_segment *s, const float x_pu[], float error_pu)
{
    float *a = s->a;
    for (int j = 0; j < N; j++) {
        for (int i = 0; i <= j; i++) *a++ += x_pu[i] * x_pu[j];
        s->b[j] += x_pu[j] * error_pu;
    }
}

bool dqw_segment_block(dqw_segment *s, float w_pu, float i_pu, uint32_t least, uint32_t most)
{
    const float now[2] = {w_pu, i_pu};
    if (s->run < LONG_RUN) s->run += 1.0f;
    s->blocks++;
    const float part = 1.0f / (float)s->blocks;
    bool met = true;
    for (int k = 0; k < 2; k++) {
        const float off = now[k] - s->mean[k];
        s->mean[k] += off / s->run;
        s->variance[k] += (off * off - s->variance[k]) / s->run;
        s->sum[k] += now[k];
        s->square[k] += now[k] * now[k];
        const float mean = s->sum[k] * part;
        met = met && s->square[k] * part - mean * mean >= MET * s->variance[k];
    }
    return s->blocks >= most || (s->blocks >= least && met);
}

// Cholesky's factor of I + T^1/2 G T^1/2 / variance: at least I.
static void factor(const dqw_segment *s, const float band_pu[], float variance, float l[])
{
    for (int i = 0; i < N; i++) {
        for (int j = 0; j <= i; j++) {
            float rest = s->a[AT(j, i)] * (band_pu[i] * band_pu[j] / variance) + (i == j ? 1.0f : 0.0f);
            for (int k = 0; k < j; k++) rest -= l[AT(k, i)] * l[AT(k, j)];
            if (j < i)
                l[AT(j, i)] = rest / l[AT(j, j)];
            else
                l[AT(i, i)] = rest > 1.0f ? sqrtf(rest) : 1.0f;
        }
    }
}

// What the segment says of each weight, over its band, where the bands are what is known before it; and of each, how
// much of that it knows: 0 nothing, 1 all. (E104)
static void solve(const dqw_segment *s, const float band_pu[], float variance, float u[], float share[])
{
    float l[AT(0, N)];
    factor(s, band_pu, variance, l);
    for (int i = 0; i < N; i++) {
        float rest = s->b[i] * (band_pu[i] / variance);
        // cppcheck-suppress uninitvar; those before i are set
        for (int k = 0; k < i; k++) rest -= l[AT(k, i)] * u[k];
        u[i] = rest / l[AT(i, i)];
    }
    for (int i = N - 1; i >= 0; i--) {
        for (int k = i + 1; k < N; k++) u[i] -= l[AT(i, k)] * u[k];
        u[i] /= l[AT(i, i)];
    }
    for (int i = 0; i < N; i++) {
        float z[N];
        float own = 0.0f;
        for (int k = i; k < N; k++) {
            float rest = k == i ? 1.0f : 0.0f;
            for (int m = i; m < k; m++) rest -= l[AT(m, k)] * z[m];
            z[k] = rest / l[AT(k, k)];
            own += z[k] * z[k];
        }
        share[i] = 1.0f - own;
    }
}

static float limited(float x, float most)
{
    return x > most ? most : x < -most ? -most : x;
}

// A band that is known from few segments is itself unsure.
static float part_of(const dqw_segment *s)
{
    const float first = 1.0f / (float)s->segments;
    return first > PART_LEAST ? first : PART_LEAST;
}

static int16_t agreed_q11(int16_t sum_q11, float more)
{
    const float all = (float)sum_q11 * (1.0f / Q11) + more - ALLOWANCE;
    // 6 at a time, and above 7.2 the sums begin anew, or stay where nothing is believed yet.
    return all > 0.0f ? (int16_t)((all < SUM_MOST ? all : SUM_MOST) * Q11) : (int16_t)0;
}

static int16_t larger(int16_t a, int16_t b)
{
    return a > b ? a : b;
}

float dqw_segment_agreed(const dqw_segment *s, int weight)
{
    return (float)larger(s->up_q11[weight], s->down_q11[weight]) * (1.0f / Q11);
}

float dqw_segment_sees(const dqw_segment *s, int weight)
{
    const float share = (float)s->share_q15[weight] * 0x1p-15f;
    if (s->segments == 0 || !(share > SHARE_LEAST)) return DQW_UNKNOWN;
    const float part = part_of(s);
    // The first widens the band, over which the second is less. (E178)
    const float wider = sqrtf(1.0f + part * (SCATTER_MOST - 1.0f));
    const float each = (ALLOWANCE + 0.5f * THRESHOLD) * (1.0f + sqrtf(part)) * 2.0f * wider / (1.0f + wider);
    return each * s->band_pu[weight] / sqrtf(share);
}

int dqw_segment_end(dqw_segment *s, float variance_pu2, const dqw_segment_known *known, float move_pu[])
{
    float u[N];
    float share[N];
    const float variance = OVERLAP * variance_pu2;
    // Until it is known by its scatter, a band is what the model's error may make of it.
    float used_pu[N];
    const float young = s->segments < YOUNG ? 1.0f - (float)s->segments / YOUNG : 0.0f;
    for (int k = 0; k < N; k++) {
        const float model = young * known->model_pu[k];
        used_pu[k] = s->band_pu[k] > model ? s->band_pu[k] : model;
    }
    solve(s, used_pu, variance, u, share);
    if (s->segments < UINT16_MAX) s->segments++;
    const float part = part_of(s);
    const float surer = 1.0f / (1.0f + sqrtf(part));
    const float threshold = s->urgent ? THRESHOLD_URGENT : THRESHOLD;
    int changed = -1;
    float most = 0.0f;
    for (int k = 0; k < N; k++) {
        s->share_q15[k] = share[k] > 0.0f ? (uint16_t)(share[k] * 0x1p15f) : 0u;
        if (!(share[k] > SHARE_LEAST)) continue;
        // [SEG.1] of unit variance in health
        const float z = u[k] / sqrtf(share[k]);
        const float sum = dqw_segment_agreed(s, k);
        // [SEG.2] the band, to the scatter
        const float z2 = z * z < SCATTER_MOST ? z * z : SCATTER_MOST;
        const float seen = used_pu[k] * used_pu[k] * (1.0f + share[k] * (z2 - 1.0f));
        const float band2 = s->band_pu[k] * s->band_pu[k];
        if (seen < band2 || sum <= SEEMS) s->band_pu[k] = sqrtf(band2 + part * (seen - band2));
        if (s->band_pu[k] < known->least_pu[k]) s->band_pu[k] = known->least_pu[k];
        // [SEG.3] what agrees
        const float d = limited(z * surer, DEVIATION_MOST);
        s->up_q11[k] = agreed_q11(s->up_q11[k], d);
        s->down_q11[k] = agreed_q11(s->down_q11[k], -d);
        const float now = dqw_segment_agreed(s, k);
        // Of those that agree, the one that explains most now.
        if (now > threshold && fabsf(z) > most && known->wide_pu[k] > 0.0f) {
            most = fabsf(z);
            changed = k;
            s->agreed = sum > ALLOWANCE;
        }
    }
    if (s->segments < FEW) changed = -1;
    if (changed >= 0) {
        // [SEG.4] by how much: this weight alone is free
        used_pu[changed] = known->wide_pu[changed];
        solve(s, used_pu, variance, u, share);
        for (int k = 0; k < N; k++) move_pu[k] = u[k] * used_pu[k];
        disagree(s);
    }
    clear(s);
    return changed;
}
