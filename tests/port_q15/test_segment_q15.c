// Segments in whole numbers beside those in float: what they say, bands, openings, moves, ends.
#include "dqw_segment_q15.h"

#include "dqw_q15.h"
#include "dqw_segment.h"
#include "driven_segment.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

#define ONE_Q28 268435456.0

typedef struct pair {
    dqw_segment f;
    dqw_segment_q15 q;
    dqw_segment_q15_known known;
    dqw_segment_known f_known;
    float f_move[WEIGHTS];
    int32_t q_move[WEIGHTS];
} pair;

static int32_t q28(double x) { return dqw_q31_sat(llrint(x * ONE_Q28)); }

static void begin(pair *p, const double band[], double model, double wide)
{
    float band_pu[WEIGHTS];
    for (int k = 0; k < WEIGHTS; k++) {
        p->known.least_q28[k] = q28(band[k]);
        p->known.model_q28[k] = q28(model * band[k]);
        p->known.wide_q28[k] = q28(wide);
        band_pu[k] = (float)band[k];
        p->f_known.least_pu[k] = (float)band[k];
        p->f_known.model_pu[k] = (float)(model * band[k]);
        p->f_known.wide_pu[k] = (float)wide;
    }
    dqw_segment_init(&p->f, band_pu);
    dqw_segment_init_q15(&p->q, p->known.least_q28);
}

static void show(pair *p, driven *d, int blocks, const double delta[])
{
    for (int n = 0; n < blocks; n++) {
        double x[2][WEIGHTS];
        drive(d, x);
        for (int axis = 0; axis < 2; axis++) {
            float f_x[WEIGHTS];
            int32_t q_x[WEIGHTS];
            double e = d->noise * random_normal(&d->r);
            for (int k = 0; k < WEIGHTS; k++) {
                f_x[k] = (float)x[axis][k];
                q_x[k] = q28(x[axis][k]);
                e += delta[k] * x[axis][k];
            }
            dqw_segment_row(&p->f, f_x, (float)e);
            dqw_segment_row_q15(&p->q, q_x, q28(e));
        }
    }
}

static void end(pair *p, double noise, int *f, int *q)
{
    const double variance = noise * noise / 1.5;
    *f = dqw_segment_end(&p->f, (float)variance, &p->f_known, p->f_move);
    *q = dqw_segment_end_q15(&p->q, llrint(ldexp(variance, 56)), &p->known, p->q_move);
}

// Random machines and drives, weights that scatter, and one that steps: segment after segment.
static void test_both_say_the_same(void)
{
    double worst_band = 0;
    double worst_sum = 0;
    double worst_move = 0;
    double worst_free = 0;
    int openings = 0;
    int unlike = 0;
    int began_before[2] = {0};
    int began_unlike = 0;
    int segments = 0;
    const int cases = scaled(300);
    for (int n = 0; n < cases; n++) {
        driven d = drive_of(5000 + (uint64_t)n);
        static pair p;
        const double wide = 0.3;
        begin(&p, d.band, n % 3 == 0 ? 0 : 3, wide);
        double truth[WEIGHTS] = {0};
        const int k_step = (int)(random_bits(&d.r) % WEIGHTS);
        // In every seventh it is one that is never found changed.
        const bool never = n % 7 == 3;
        if (never) p.known.wide_q28[k_step] = 0, p.f_known.wide_pu[k_step] = 0;
        for (int m = 0; m < 12; m++) {
            double delta[WEIGHTS];
            if (m == 6) truth[k_step] += (n % 2 ? 1 : -1) * d.band[k_step] * random_uniform(&d.r, 2, 40);
            for (int k = 0; k < WEIGHTS; k++) delta[k] = truth[k] + d.band[k] * random_normal(&d.r);
            show(&p, &d, (int)(150 * exp(random_uniform(&d.r, 0, 3))), delta);
            int f;
            int q;
            p.f.urgent = p.q.urgent = n % 4 == 1;
            end(&p, d.noise, &f, &q);
            segments++;
            CASE("case %d, segment %d: weight %d, %d", n, m, f, q);
            openings += f >= 0 || q >= 0;
            if (never) HOLDS(f != k_step && q != k_step);
            for (int k = 0; k < WEIGHTS; k++) {
                const double band = (double)p.f.band_pu[k];
                worst_band = fmax(worst_band, fabs(p.q.band_q28[k] / ONE_Q28 / band - 1));
            }
            if (f != q) {
                // What hangs on the last place of a sum; from here on they are of other opinions.
                unlike++;
                break;
            }
            // Whether the change began with this segment.
            if (f >= 0) {
                began_before[p.f.agreed]++;
                began_unlike += p.f.agreed != p.q.agreed;
            }
            for (int k = 0; f < 0 && k < WEIGHTS; k++) {
                worst_sum = fmax(worst_sum, fabs(p.q.up_q11[k] / 2048.0 - p.f.up_q11[k] / 2048.0));
                worst_sum = fmax(worst_sum, fabs(p.q.down_q11[k] / 2048.0 - p.f.down_q11[k] / 2048.0));
            }
            for (int k = 0; f >= 0 && k < WEIGHTS; k++) {
                const double f_move = (double)p.f_move[k];
                const double off = fabs(p.q_move[k] / 16777216.0 - f_move);
                if (k == f) worst_free = fmax(worst_free, off / fmax(fabs(f_move), d.band[k]));
                // Of a step by 40 bands the last places of the sums leave this in the others: 0.09.
                worst_move = fmax(worst_move, off / fmax(fabs(f_move), d.band[k]));
                truth[k] -= f_move;
            }
        }
    }
    CASE("%d openings, %d unlike, of %d segments", openings, unlike, segments);
    if (getenv("DQW_TEST_VALUES") != NULL) printf("%s\n", test_case);
    HOLDS(openings * 3 > cases);
    HOLDS(unlike * 50 <= openings);
    CASE("began with it %d, before %d; unlike %d", began_before[0], began_before[1], began_unlike);
    HOLDS(began_before[0] > 0 && began_before[1] > 0 && began_unlike * 50 <= openings);
    BETWEEN(1e-6, worst_band, 0.03);
    BETWEEN(1e-4, worst_sum, 0.1);
    BETWEEN(1e-6, worst_free, 0.03);
    BETWEEN(1e-6, worst_move, 0.12);
}

// A long segment of a machine without noise to speak of: sums fill their bits many times over.
static void test_a_long_and_quiet_segment(void)
{
    driven d = drive_of(3);
    d.noise = 1e-4;
    for (int k = 0; k < WEIGHTS; k++) d.whole[k] *= 4;
    static pair p;
    begin(&p, d.band, 0, 0.3);
    double delta[WEIGHTS];
    for (int k = 0; k < WEIGHTS; k++) delta[k] = d.band[k] * random_normal(&d.r);
    show(&p, &d, 60000, delta);
    HOLDS(p.q.a_bits > 30 && p.q.b_bits > 20);
    int f;
    int q;
    end(&p, d.noise, &f, &q);
    TEST_ASSERT_EQUAL_INT(f, q);
    for (int k = 0; k < WEIGHTS; k++) {
        const double z = delta[k] / d.band[k];
        CASE("weight %d, z %g", k, z);
        // In float the sums of 60000 blocks are no better than 1e-3.
        const double band = sqrt(fmin(9, z * z)) * d.band[k];
        BETWEEN(0.97, p.q.band_q28[k] / ONE_Q28 / fmax(d.band[k], band), 1.03);
    }
}

// What a weight may have jumped by is far beyond what the segment needs to tell it: nothing runs over.
static void test_a_jump_beyond_all_bands(void)
{
    for (int n = 0; n < 40; n++) {
        driven d = drive_of(40 + (uint64_t)n);
        d.noise = 1e-4;
        static pair p;
        begin(&p, d.band, 0, 7.9);
        double delta[WEIGHTS] = {0};
        const int k_step = n % 6;
        delta[k_step] = 1.5;
        int f = -1;
        int q = -1;
        for (int m = 0; m < 4 && f < 0; m++) {
            show(&p, &d, 3000, delta);
            end(&p, d.noise, &f, &q);
            // The bands of the first segments are no scatter.
            for (int k = 0; k < WEIGHTS; k++) {
                p.f.band_pu[k] = (float)d.band[k];
                p.q.band_q28[k] = q28(d.band[k]);
            }
        }
        CASE("machine %d: %d, %d of %d", n, f, q, k_step);
        TEST_ASSERT_EQUAL_INT(f, q);
        if (f != k_step) continue;
        BETWEEN(0.98, p.q_move[f] / 16777216.0 / 1.5, 1.02);
    }
}

static void test_both_end_alike(void)
{
    test_random r = {8};
    int ends = 0;
    int apart = 0;
    for (int n = 0; n < 20; n++) {
        static pair p;
        const double band[WEIGHTS] = {0};
        begin(&p, band, 0, 0);
        const double size[2] = {exp(random_uniform(&r, -3, 0)), exp(random_uniform(&r, -3, 0))};
        const double slow = exp(random_uniform(&r, -6, -1));
        double x[2] = {0};
        for (int k = 0; k < 20000; k++) {
            for (int c = 0; c < 2; c++)
                x[c] = fmax(-1, fmin(1, x[c] * (1 - slow) + sqrt(2 * slow) * size[c] / 3 * random_normal(&r)));
            const bool f = dqw_segment_block(&p.f, (float)x[0], (float)x[1], 350, 5000);
            const bool q = dqw_segment_block_q15(&p.q, q28(x[0]), q28(x[1]), 350, 5000);
            ends += f;
            apart += f != q;
            if (f || q) {
                int either;
                end(&p, 1, &either, &either);
            }
        }
    }
    CASE("%d ends, %d apart", ends, apart);
    HOLDS(ends > 200 && apart * 100 <= ends);
    // 65535 blocks at most.
    dqw_segment_q15 s;
    const int32_t band[WEIGHTS] = {0};
    dqw_segment_init_q15(&s, band);
    for (int k = 1; k <= 65535; k++)
        HOLDS(dqw_segment_block_q15(&s, k == 3 ? 1000 : 0, 0, 70000, 4000000) == (k == 65535));
}

// Any rows, any bands, any variance: the checkers find nothing, and bands are as they must be.
static void test_any_bits(void)
{
    test_random r = {9};
    const int cases = scaled(3000);
    for (int n = 0; n < cases; n++) {
        dqw_segment_q15 s;
        dqw_segment_q15_known known;
        int32_t *const fields[] = {known.least_q28, known.model_q28, known.wide_q28};
        for (int f = 0; f < 3; f++)
            for (int k = 0; k < WEIGHTS; k++)
                fields[f][k] = (int32_t)((uint32_t)random_bits(&r) >> (1 + random_bits(&r) % 31));
        dqw_segment_init_q15(&s, known.least_q28);
        for (int m = 0; m < 6; m++) {
            const unsigned less = (unsigned)(random_bits(&r) % 31);
            const int rows = (int)(random_bits(&r) % 300);
            for (int k = 0; k < rows; k++) {
                int32_t x[WEIGHTS];
                for (int i = 0; i < WEIGHTS; i++) x[i] = dqw_q_floor32(dqw_q_signed32((uint32_t)random_bits(&r)), less);
                if (k % 50 == 7) x[k % WEIGHTS] = INT32_MIN;
                dqw_segment_row_q15(&s, x, dqw_q_signed32((uint32_t)random_bits(&r)));
                (void)dqw_segment_block_q15(&s, dqw_q_signed32((uint32_t)random_bits(&r)),
                                            dqw_q_signed32((uint32_t)random_bits(&r)), 100, 200);
            }
            int32_t move[WEIGHTS];
            const int64_t variance = 1 + (int64_t)(random_bits(&r) >> (3 + random_bits(&r) % 60));
            const int changed = dqw_segment_end_q15(&s, variance, &known, move);
            HOLDS(changed >= -1 && changed < WEIGHTS);
            for (int k = 0; k < WEIGHTS; k++) {
                HOLDS(s.band_q28[k] >= 0 && s.up_q11[k] >= 0 && s.down_q11[k] >= 0);
                HOLDS(s.up_q11[k] <= 32767 && s.down_q11[k] <= 32767);
            }
        }
        dqw_segment_restart_q15(&s);
        for (int k = 0; k < WEIGHTS; k++) HOLDS(s.up_q11[k] == 0 && s.down_q11[k] == 0 && s.b[k] == 0);
    }
}

static void test_segments_are_counted_as_far_as_there_is_room(void)
{
    dqw_segment_q15 s;
    dqw_segment_q15_known known;
    for (int k = 0; k < WEIGHTS; k++) known.least_q28[k] = known.model_q28[k] = known.wide_q28[k] = 100000;
    dqw_segment_init_q15(&s, known.least_q28);
    s.segments = UINT16_MAX - 1;
    for (int n = 0; n < 3; n++) {
        int32_t move[WEIGHTS];
        HOLDS(dqw_segment_end_q15(&s, (int64_t)1 << 40, &known, move) == -1 && s.segments == UINT16_MAX);
    }
}

// Of a signal that is a quarter of full scale either way, half of the time each: mean 0, variance 1/16, or nothing.
static void test_moments_are_of_full_scale(void)
{
    dqw_segment_q15 s;
    const int32_t band_q28[WEIGHTS] = {0};
    dqw_segment_init_q15(&s, band_q28);
    const int32_t quarter_q28 = 1 << 26;
    for (int n = 0; n < 4000; n++)
        HOLDS(!dqw_segment_block_q15(&s, n & 1 ? quarter_q28 : -quarter_q28, quarter_q28, 5000, 6000));
    for (int ever = 0; ever < 2; ever++) {
        const dqw_moments_q15 *m = ever ? s.ever : s.now;
        BETWEEN(-1e-3, ldexp(m[0].mean_q30, -30), 1e-3);
        BETWEEN(0.0624, ldexp(m[0].variance_q31, -31), 0.0628);
        BETWEEN(0.2499, ldexp(m[1].mean_q30, -30), 0.2501);
        BETWEEN(0, ldexp(m[1].variance_q31, -31), 1e-3);
    }
}

static void test_its_state_is_small(void) { HOLDS(sizeof(dqw_segment_q15) <= (DQW_MAP_WEIGHTS > 0 ? 352 : 260)); }

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_both_say_the_same);
    RUN_TEST(test_a_long_and_quiet_segment);
    RUN_TEST(test_a_jump_beyond_all_bands);
    RUN_TEST(test_both_end_alike);
    RUN_TEST(test_any_bits);
    RUN_TEST(test_segments_are_counted_as_far_as_there_is_room);
    RUN_TEST(test_moments_are_of_full_scale);
    RUN_TEST(test_its_state_is_small);
    return UNITY_END();
}
