#include "dqw_segment_q15.h"

#include "dqw_normal_q15.h"
#include "dqw_q15.h"

enum { N = DQW_FOLLOWED, SUMS = N * (N + 1) / 2 };

// Page's sums, where a deviation must exceed 1 to count, and 7.2 tell a change: Siegmund's run length of 1e7 segments.
// (E105)
#define ALLOWANCE_Q11 2048
#define THRESHOLD_Q11 14746
// Where a channel shows a change already, one segment that is 4 off is enough.
#define THRESHOLD_URGENT_Q11 8192
#define DEVIATION_MOST_Q11 12288
// 15.
#define SUM_MOST_Q11 30720
// A band moves by a fiftieth at least, by more while it is young; upwards not while something seems to change: 4.
#define PARTS_MOST 50u
#define SEEMS_Q11 8192
#define SCATTER_MOST 9
// Segments until bands are known by their scatter alone, and until a change is believed.
#define YOUNG 20
#define FEW 3
// A segment that knows less of a weight than a fiftieth, over its band, says nothing of it.
#define SHARE_LEAST_Q30 21474836
#define ONE_Q28 268435456
#define ONE_Q30 1073741824u
#define ONE_Q32 ((int64_t)1 << 32)
// What a segment may say of one weight, over its band, squared: beyond, the band counts as narrower, or no pivot would
// tell it from the others.
#define KNOWN_BITS 22u

static void clear(dqw_segment_q15 *s)
{
    static const dqw_moments_q15 nothing = {0, 0};
    for (int k = 0; k < SUMS; k++) s->a[k] = 0;
    for (int k = 0; k < N; k++) s->b[k] = 0;
    for (int k = 0; k < 2; k++) s->now[k] = nothing;
    s->a_bits = s->b_bits = 1;
    s->blocks = 0;
}

void dqw_segment_init_q15(dqw_segment_q15 *s, const int32_t band_q28[])
{
    const dqw_segment_q15 zero = {.blocks = 0};
    *s = zero;
    clear(s);
    for (int k = 0; k < N; k++) s->band_q28[k] = band_q28[k];
}

static void disagree(dqw_segment_q15 *s)
{
    for (int k = 0; k < N; k++) s->up_q11[k] = s->down_q11[k] = 0;
}

void dqw_segment_restart_q15(dqw_segment_q15 *s)
{
    clear(s);
    disagree(s);
}

static unsigned bits_of(const int32_t x[], int count)
{
    uint32_t all = 0;
    for (int k = 0; k < count; k++) all |= x[k] < 0 ? ~(uint32_t)x[k] : (uint32_t)x[k];
    return 32u - dqw_q_clz32(all);
}

// Sums stay below 2^30, and so does what is added of a product of so many bits: the rows of a segment, 2^17 of them,
// take 2^49 at most.
static void make_room(int32_t sums[], int count, uint8_t *less, unsigned bits)
{
    while (bits_of(sums, count) > 30u || bits > *less + 29u) {
        for (int k = 0; k < count; k++) sums[k] = dqw_q_floor32(sums[k], 1) + (sums[k] & 1);
        ++*less;
    }
}

void dqw_segment_row_q15(dqw_segment_q15 *s, const int32_t x_q28[], int32_t error_q28)
{
    const unsigned bits = bits_of(x_q28, N);
    make_room(s->a, SUMS, &s->a_bits, 2u * bits);
    make_room(s->b, N, &s->b_bits, bits + bits_of(&error_q28, 1));
    int32_t *a = s->a;
    for (int j = 0; j < N; j++) {
        // Each product is 2^62 at most, and 2^29 of these sums.
        for (int i = 0; i <= j; i++) *a++ += (int32_t)dqw_q_round64((int64_t)x_q28[i] * x_q28[j], s->a_bits);
        s->b[j] += (int32_t)dqw_q_round64((int64_t)x_q28[j] * error_q28, s->b_bits);
    }
}

// |x - m| <= 2^32
static int64_t nearer(int64_t m, int64_t x, uint32_t part_q30)
{
    return m + dqw_q_round64((x - m) * (int64_t)part_q30, 30);
}

// Squared deviations, from the mean before and from another one.
static void spread(dqw_moments_q15 *m, int64_t off_q30, int64_t other_q30, uint32_t part_q30)
{
    // Up to 2^31 each
    const int64_t square_q31 = dqw_q_floor64(off_q30 * other_q30, 29);
    m->variance_q31 = (uint32_t)nearer(m->variance_q31, square_q31 < UINT32_MAX ? square_q31 : UINT32_MAX, part_q30);
}

bool dqw_segment_block_q15(dqw_segment_q15 *s, int32_t w_q28, int32_t i_q28, uint32_t least, uint32_t most)
{
    const int32_t x_q28[2] = {w_q28, i_q28};
    if (s->run < UINT16_MAX) s->run++;
    if (s->blocks < UINT16_MAX) s->blocks++;
    const uint32_t part_q30 = ONE_Q30 / s->blocks;
    const uint32_t ever_q30 = ONE_Q30 / s->run;
    bool met = true;
    for (int k = 0; k < 2; k++) {
        const int64_t x_q30 = 4 * dqw_q_within64(x_q28[k], ONE_Q28);
        dqw_moments_q15 *ever = &s->ever[k];
        dqw_moments_q15 *now = &s->now[k];
        const int64_t off_q30 = x_q30 - ever->mean_q30;
        ever->mean_q30 = (int32_t)nearer(ever->mean_q30, x_q30, ever_q30);
        spread(ever, off_q30, off_q30, ever_q30);
        const int64_t here_q30 = x_q30 - now->mean_q30;
        now->mean_q30 = (int32_t)nearer(now->mean_q30, x_q30, part_q30);
        spread(now, here_q30, x_q30 - now->mean_q30, part_q30);
        // 0.15 of the long run's variance
        met = met && (uint64_t)now->variance_q31 * 20u >= (uint64_t)ever->variance_q31 * 3u;
    }
    return s->blocks >= most || s->blocks == UINT16_MAX || (s->blocks >= least && met);
}

// What a segment says of each weight, over its band, Q40; and how much of that it knows.
typedef struct verdict {
    int64_t u_q40[N];
    int32_t share_q30[N];
} verdict;

// The bands over the deviation of a row's error, Q16; narrower by halves[] where the segment knows a weight far better.
static void scale(const dqw_segment_q15 *s, const int32_t band_q28[], int64_t sd_q28, int64_t t_q16[], int halves[])
{
    for (int i = 0; i < N; i++) {
        t_q16[i] = dqw_q_quotient64(band_q28[i], sd_q28, 16);
        const int64_t by = dqw_q_product64(s->a[DQW_NORMAL_A(i, i)], t_q16[i], -8);
        const unsigned bits = dqw_q_bits64(dqw_q_product64(by, t_q16[i], (int)s->a_bits - 80));
        halves[i] = bits > KNOWN_BITS ? (int)(bits - KNOWN_BITS + 1u) / 2 : 0;
        t_q16[i] = dqw_q_scale64(t_q16[i], -halves[i]);
    }
}

// Of I + T^1/2 G T^1/2 / variance, where the bands are what is known before the segment; at least I, so that no pivot
// vanishes. (E104)
static void solve(const dqw_segment_q15 *s, const int32_t band_q28[], int64_t variance_q56, verdict *v)
{
    const int64_t sd_q28 = (int64_t)dqw_q_root64((uint64_t)variance_q56) + 1;
    int64_t t_q16[N];
    int halves[N];
    scale(s, band_q28, sd_q28, t_q16, halves);
    dqw_normal_q15 m = {.inputs = N};
    unsigned bits = 0;
    for (int i = 0; i < N; i++) {
        // 2^30 by 2^32 by 2^-8 at most
        for (int j = 0; j <= i; j++)
            m.a_q32[DQW_NORMAL_A(j, i)] = dqw_q_product64(dqw_q_product64(s->a[DQW_NORMAL_A(j, i)], t_q16[i], -8),
                                                          t_q16[j], (int)s->a_bits - 48);
        m.a_q32[DQW_NORMAL_A(i, i)] += ONE_Q32;
        m.b_q32[i] = dqw_q_quotient64(dqw_q_product64(s->b[i], t_q16[i], -8), sd_q28, (int)s->b_bits - 4);
        if (dqw_q_bits64(m.b_q32[i]) > bits) bits = dqw_q_bits64(m.b_q32[i]);
    }
    // What is explained is below b' b: in 59 bits.
    const int less = bits > 44u ? (int)bits - 44 : 0;
    m.c_q32 = 16;
    for (int i = 0; i < N; i++) {
        m.b_q32[i] = dqw_q_scale64(m.b_q32[i], -less);
        m.c_q32 += dqw_q_product64(m.b_q32[i], m.b_q32[i], -32);
    }
    dqw_solution_q15 w;
    dqw_normal_solve_q15(&m, dqw_normal_nought_q40, &w);
    for (int i = 0; i < N; i++) {
        const int64_t own_q30 = dqw_q_scale64(w.cov_q40[i], -10 - 2 * halves[i]);
        v->u_q40[i] = dqw_q_scale64(w.w_q40[i], less - halves[i]);
        v->share_q30[i] = own_q30 < ONE_Q30 ? (int32_t)(ONE_Q30 - own_q30) : 0;
    }
}

static int16_t agreed(int32_t sum_q11, int32_t more_q11)
{
    const int32_t all_q11 = sum_q11 + more_q11 - ALLOWANCE_Q11;
    return (int16_t)(all_q11 < 0 ? 0 : all_q11 < SUM_MOST_Q11 ? all_q11 : SUM_MOST_Q11);
}

static int32_t larger(int32_t a, int32_t b)
{
    return a > b ? a : b;
}

// Of a weight, in deviations of a segment's, Q20: of unit variance in health.
static int64_t z_of_q20(int64_t u_q40, int32_t share_q30)
{
    const int64_t known_q30 = dqw_q_root64((uint64_t)share_q30 << 30);
    return dqw_q_within64(dqw_q_quotient64(u_q40, known_q30, 10), ONE_Q30);
}

// What this segment shows of a band's square, Q56.
static int64_t seen_q56(int32_t used_q28, int64_t u_q40, int32_t share_q30)
{
    const int64_t share_q28 = dqw_q_floor64(share_q30, 2);
    const int64_t u2_q28 = dqw_q_product64(u_q40, u_q40, -52);
    const int64_t most_q28 = SCATTER_MOST * share_q28;
    const int64_t by_q28 = ONE_Q28 - share_q28 + (u2_q28 < most_q28 ? u2_q28 : most_q28);
    return dqw_q_product64((int64_t)used_q28 * used_q28, by_q28, -28);
}

// How much of a mean a segment is; and 1 over 1 and its root: a band that is known from few is itself unsure.
static uint32_t part_of_q30(const dqw_segment_q15 *s)
{
    return ONE_Q30 / (s->segments < PARTS_MOST ? s->segments : PARTS_MOST);
}

int32_t dqw_segment_sees_q15(const dqw_segment_q15 *s, int weight)
{
    const uint32_t share_q15 = s->share_q15[weight];
    if (s->segments == 0 || share_q15 <= SHARE_LEAST_Q30 >> 15) return INT32_MAX;
    // 1 and half of 7.2, 4.6
    const int64_t each_q30 = ((int64_t)ONE_Q30 + dqw_q_root64((uint64_t)part_of_q30(s) << 30)) / 5 * 23;
    // The first widens the band by up to 1 + 8 parts, over which the second is less. (E178)
    const int64_t wider_q30 = dqw_q_root64((ONE_Q30 + 8 * (uint64_t)part_of_q30(s)) << 30);
    const int64_t more_q30 = dqw_q_quotient64(2 * wider_q30, ONE_Q30 + wider_q30, 30);
    const int64_t band_q28 = dqw_q_product64(s->band_q28[weight], dqw_q_product64(each_q30, more_q30, -30), -30);
    return dqw_q31_sat(dqw_q_quotient64(band_q28, dqw_q_root64((uint64_t)share_q15 << 45), 30));
}

int dqw_segment_end_q15(dqw_segment_q15 *s, int64_t variance_q56, const dqw_segment_q15_known *known,
                        int32_t move_q24[])
{
    verdict v;
    // Blocks overlap by half: their errors' power counts for half as much again.
    const int64_t variance = dqw_q_product64(variance_q56, 3, -1);
    // Until it is known by its scatter, a band is what the model's error may make of it.
    int32_t used_q28[N];
    const int young = s->segments < YOUNG ? YOUNG - s->segments : 0;
    for (int k = 0; k < N; k++) {
        const int32_t model_q28 = known->model_q28[k] / YOUNG * young;
        used_q28[k] = larger(s->band_q28[k], model_q28);
    }
    solve(s, used_q28, variance, &v);
    if (s->segments < UINT16_MAX) s->segments++;
    const uint32_t part_q30 = part_of_q30(s);
    const int32_t surer_q15 = dqw_q_quotient32(1, (int64_t)ONE_Q30 + dqw_q_root64((uint64_t)part_q30 << 30), 45);
    for (int k = 0; k < N; k++) s->share_q15[k] = (uint16_t)(v.share_q30[k] >> 15);
    const int32_t threshold = s->urgent ? THRESHOLD_URGENT_Q11 : THRESHOLD_Q11;
    int changed = -1;
    int64_t most = 0;
    for (int k = 0; k < N; k++) {
        if (v.share_q30[k] <= SHARE_LEAST_Q30) continue;
        // [SEG.1] of unit variance in health
        const int64_t z_q20 = z_of_q20(v.u_q40[k], v.share_q30[k]);
        const int32_t d = (int32_t)dqw_q_within64(dqw_q_round64(z_q20 * surer_q15, 24), DEVIATION_MOST_Q11);
        const int32_t sum = larger(s->up_q11[k], s->down_q11[k]);
        // [SEG.2] the band, to the scatter
        const int64_t seen = seen_q56(used_q28[k], v.u_q40[k], v.share_q30[k]);
        const int64_t band2 = (int64_t)s->band_q28[k] * s->band_q28[k];
        if (seen < band2 || sum <= SEEMS_Q11) {
            const int64_t to = band2 + dqw_q_product64(seen - band2, part_q30, -30);
            s->band_q28[k] = dqw_q31_sat(dqw_q_root64((uint64_t)(to > 0 ? to : 0)));
        }
        s->band_q28[k] = larger(s->band_q28[k], known->least_q28[k]);
        // [SEG.3] what agrees
        s->up_q11[k] = agreed(s->up_q11[k], d);
        s->down_q11[k] = agreed(s->down_q11[k], -d);
        const int32_t now = larger(s->up_q11[k], s->down_q11[k]);
        // Of those that agree, the one that explains most now.
        if (now > threshold && dqw_q_size64(z_q20) > most && known->wide_q28[k] > 0) {
            most = dqw_q_size64(z_q20);
            changed = k;
            s->agreed = sum > ALLOWANCE_Q11;
        }
    }
    if (s->segments < FEW) changed = -1;
    if (changed >= 0) {
        // [SEG.4] by how much: this weight alone is free
        used_q28[changed] = known->wide_q28[changed];
        solve(s, used_q28, variance, &v);
        for (int k = 0; k < N; k++) move_q24[k] = dqw_q31_sat(dqw_q_product64(v.u_q40[k], used_q28[k], -44));
        disagree(s);
    }
    clear(s);
    return changed;
}
