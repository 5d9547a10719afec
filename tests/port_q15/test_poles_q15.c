// Pole pairs in whole numbers against least squares in double: what it costs to hold both cross weights at p
// inductances, when that tells p, and what is known afterwards. (E91)
#include "dqw_estimator_block_q15.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

enum { N = DQW_PARAMETERS, BEFORE = 6, AFTER = 4 };
#define Q20 1048576.0
#define Q24 16777216.0
#define Q32 4294967296.0
#define Q40 1099511627776.0
#define Q56 72057594037927936.0

static dqw_estimator_q15_config config;
static dqw_estimator_q15 e;
static const dqw_estimator_q15_block nothing;

static void start(bool noise_on_inputs)
{
    config = (dqw_estimator_q15_config){.scale = {40000, 12000, 40000, 100000, 0},
                                        .R_uohm = 400000,
                                        .Ld_nH = 1100000,
                                        .Lq_nH = 1700000,
                                        .psi_nWb = 15000000,
                                        .half_window = 20,
                                        .dead_time_width_mA = 300,
                                        .angle = true,
                                        .noise_on_inputs = noise_on_inputs};
    memset(&e, 0, sizeof e);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(&e, &config));
    e.blocks = 200;
    e.learned = 0x3fu;
}

typedef struct sums {
    double w[BEFORE], a[BEFORE][BEFORE];
} sums;

// What rows teach of a machine with so many pole pairs, each input of another size; cross weights are eighths.
static sums taught(test_random *r, double pole_pairs, double noise, double ease)
{
    double truth[BEFORE];
    double size[BEFORE];
    for (int i = 0; i < AFTER; i++) truth[i] = random_uniform(r, 0.7, 1.4);
    for (int k = 0; k < 2; k++) truth[DQW_POLES_LD_Q15 + k] = pole_pairs / 8 * truth[DQW_LD + k];
    for (int i = 0; i < BEFORE; i++) size[i] = pow(10, random_uniform(r, -ease, 0));
    test_ls s;
    ls_begin(&s, BEFORE, 0);
    for (int n = 0; n < 300; n++) {
        double x[BEFORE];
        double y = noise * random_normal(r);
        for (int i = 0; i < BEFORE; i++) x[i] = size[i] * random_uniform(r, -1, 1), y += x[i] * truth[i];
        ls_add(&s, x, y);
    }
    double cov[LS_MAX][LS_MAX];
    sums out;
    e.error_q56[0] = e.error_q56[1] = llrint(noise * noise * Q56);
    (void)ls_solve(&s, out.w, cov);
    for (int i = 0; i < BEFORE; i++) {
        e.w_q24[i] = (int32_t)lrint(out.w[i] * Q24);
        e.cov_q40[i] = llrint(cov[i][i] * Q40);
        out.w[i] = e.w_q24[i] / Q24;
        for (int j = 0; j <= i; j++) {
            e.normal.a_q32[DQW_NORMAL_A(j, i)] = llrint(s.a[i][j] * Q32);
            out.a[i][j] = out.a[j][i] = (double)e.normal.a_q32[DQW_NORMAL_A(j, i)] / Q32;
        }
    }
    return out;
}

typedef struct folded {
    double cost, w[AFTER], a[AFTER][AFTER], cov[LS_MAX][LS_MAX];
} folded;

// The least of (F t - w)' A (F t - w), in which F holds both cross weights at p/8 inductances.
static folded fold(const sums *s, double p)
{
    double f[BEFORE][AFTER] = {{0}};
    for (int i = 0; i < AFTER; i++) f[i][i] = 1;
    f[DQW_PSI][DQW_PSI] = p / 8;
    f[DQW_POLES_LD_Q15][DQW_LD] = f[DQW_POLES_LQ_Q15][DQW_LQ] = p / 8;
    // Around the inductances as they are, and the flux as it is.
    double t[AFTER];
    for (int i = 0; i < AFTER; i++) t[i] = s->w[i];
    t[DQW_PSI] /= p / 8;
    double off[BEFORE];
    for (int i = 0; i < BEFORE; i++) {
        off[i] = -s->w[i];
        for (int k = 0; k < AFTER; k++) off[i] += f[i][k] * t[k];
    }
    test_ls n;
    ls_begin(&n, AFTER, 0);
    for (int i = 0; i < BEFORE; i++)
        for (int j = 0; j < BEFORE; j++) {
            n.yy += off[i] * s->a[i][j] * off[j];
            for (int k = 0; k < AFTER; k++) {
                n.b[k] -= f[i][k] * s->a[i][j] * off[j];
                for (int m = 0; m < AFTER; m++) n.a[k][m] += f[i][k] * s->a[i][j] * f[j][m];
            }
        }
    folded out;
    out.cost = ls_solve(&n, out.w, out.cov);
    for (int k = 0; k < AFTER; k++) {
        out.w[k] += t[k];
        for (int m = 0; m < AFTER; m++) out.a[k][m] = n.a[k][m];
    }
    return out;
}

// The integer that is left, by at most three parabolas from the ratio of the weights that are known better; 0: none.
// near says where whole numbers could go either way.
static int told(const sums *s, int *parabolas, bool *near)
{
    const int k = e.cov_q40[DQW_POLES_LQ_Q15] < e.cov_q40[DQW_POLES_LD_Q15] ? 1 : 0;
    const double ratio = 8 * s->w[DQW_POLES_LD_Q15 + k] / s->w[DQW_LD + k];
    double p = round(ratio);
    *near = fabs(fabs(ratio - p) - 0.5) < 1e-5;
    for (*parabolas = 1; *parabolas <= 3; ++*parabolas) {
        if (p < 1 || p > 99) return 0;
        const double here = fold(s, p).cost;
        const double less = p > 1 ? fold(s, p - 1).cost : fold(s, 1e-6).cost;
        const double more = fold(s, p + 1).cost;
        const double bend = (less + more) / 2 - here;
        const double off = (less - more) / (4 * bend);
        *near = *near || fabs(fabs(off) - 0.5) < 1e-3 || bend < 1e-6 * here;
        if (bend <= 0) return 0;
        if (fabs(off) > 0.5) {
            *near = *near || fabs(fabs(off - round(off)) - 0.5) < 1e-3;
            p += round(off);
            continue;
        }
        const double variance = (double)dqw_estimator_common_variance_q56(&e) / Q56 *
                                (double)dqw_estimator_inflation_q20(&e, DQW_LD + k) / Q20;
        const double apart = (1 - fabs(off)) * sqrt(bend / variance);
        *near = *near || fabs(fabs(off) - 0.25) < 1e-3 || fabs(apart - 6) < 0.01;
        const double turn = 40 * p * 1e-4;
        return fabs(off) < 0.25 && apart > 6 && turn < 1 ? (int)p : 0;
    }
    return 0;
}

static void alike(double expected, double value, double room, const char *what)
{
    test_between(expected - room, value, expected + room, what, __LINE__);
}

// What is known now, what starts now, and what is forgotten.
static void went_on(const sums *s, int p)
{
    const folded f = fold(s, p);
    for (int i = 0; i < AFTER; i++) {
        alike(f.w[i], e.w_q24[i] / Q24, 2e-5 * (1 + fabs(f.w[i])), "weight");
        alike(f.cov[i][i], (double)e.cov_q40[i] / Q40, 1e-3 * f.cov[i][i] + 1e-9, "variance");
        for (int j = 0; j <= i; j++) {
            const double room = 1e-5 * sqrt(f.a[i][i] * f.a[j][j]) + 1e-8;
            alike(f.a[i][j], (double)e.normal.a_q32[DQW_NORMAL_A(j, i)] / Q32, room, "sum");
        }
    }
    dqw_units_q15 u;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_units_of_q15(&config, (uint32_t)p, &u));
    for (int i = AFTER; i < N; i++) {
        const double start = (double)dqw_estimator_start_cov_q40(&e, &u, i) / Q40;
        alike(start, (double)e.cov_q40[i] / Q40, 1e-6 * start, "variance at its start");
        alike(1 / start, (double)e.normal.a_q32[DQW_NORMAL_A(i, i)] / Q32, 1e-3 / start + 1e-9, "sum at its start");
        for (int j = 0; j < i; j++) HOLDS(e.normal.a_q32[DQW_NORMAL_A(j, i)] == 0);
        HOLDS(e.excess_q10[i] == 0);
    }
    for (int i = 0; i < N; i++) HOLDS(e.normal.b_q32[i] == 0);
    // Of the late voltage, which only watches, a last place.
    for (int i = 0; i <= N; i++) BETWEEN(i == N ? 1 : 0, (double)e.normal.a_q32[DQW_NORMAL_A(i, N)], i == N ? 4 : 0);
    HOLDS(e.normal.c_q32 == 0 && e.learned == 0xfu);
    alike(40.0 * p * 1e-4, e.turn_q28 / 268435456.0, 1e-6, "turn");
}

// The weights as they are known now; all else begins anew. (E91)
static void began_anew(const sums *s, int p)
{
    const folded f = fold(s, p);
    dqw_units_q15 u;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_units_of_q15(&config, (uint32_t)p, &u));
    for (int i = 0; i < N; i++) {
        const double w = i < AFTER ? f.w[i] : 0;
        alike(w, e.w_q24[i] / Q24, 2e-5 * (1 + fabs(w)), "weight at the start");
        HOLDS(e.cov_q40[i] == dqw_estimator_start_cov_q40(&e, &u, i) && e.normal.b_q32[i] == 0);
    }
    HOLDS(e.learned == 0 && e.blocks == 0 && e.across == 0);
}

static void test_which_integer_is_left(void)
{
    test_random r = {740};
    int none = 0;
    int found[4] = {0};
    int against = 0;
    for (int n = 0; n < scaled(12000); n++) {
        start(true);
        // Without a width nothing but the machine's own is learned from then on.
        const bool more = n % 7 == 6;
        if (!more) config.dead_time_width_mA = 0, e.wide_q28 = 0;
        const double pole_pairs = n % 5 != 0 ? (double)(1 + random_bits(&r) % 30) : random_uniform(&r, 1, 30);
        const sums s = taught(&r, pole_pairs, pow(10, random_uniform(&r, -4, -1)), n % 2 ? 0.5 : 2);
        // The start may be of the axis that tells less.
        const int64_t cov_q40 = e.cov_q40[DQW_POLES_LD_Q15];
        if (n % 3 == 0) e.cov_q40[DQW_POLES_LD_Q15] = e.cov_q40[DQW_POLES_LQ_Q15];
        if (n % 3 == 0) e.cov_q40[DQW_POLES_LQ_Q15] = cov_q40;
        for (int i = DQW_DEAD_TIME; i < N; i++) e.excess_q10[i] = 77;
        for (int i = 0; i <= N; i++) e.normal.a_q32[DQW_NORMAL_A(i, N)] = 1000;
        e.across = 9;
        for (int i = 0; i < N; i++) e.normal.b_q32[i] = 99;
        e.normal.c_q32 = 1000;
        int parabolas;
        bool near;
        const int expected = told(&s, &parabolas, &near);
        dqw_poles_find_q15(&e, &nothing);
        CASE("case %d of %g pole pairs, %d parabolas", n, pole_pairs, parabolas);
        if (near) continue;
        TEST_ASSERT_EQUAL_INT_MESSAGE(expected, e.pole_pairs, test_case);
        if (expected == 0) {
            none++;
            continue;
        }
        found[parabolas]++;
        if (fabs(pole_pairs - expected) > 0.25) against++;
        (more ? began_anew : went_on)(&s, expected);
    }
    CASE("%d, %d, %d, %d, %d", none, found[1], found[2], found[3], against);
    HOLDS(none > scaled(900) && found[1] > scaled(900) && found[2] > 3 && found[3] >= scaled(3) / 2);
}

// Where nobody takes the noise of the currents' slopes out, its part of what taught an inductance, times p, may be a
// quarter at most; on either axis.
static void test_a_slope_that_noise_has_shrunk(void)
{
    for (int n = 0; n < 20; n++)
        for (int axis = 0; axis < 2; axis++)
            for (int much = 0; much < 2; much++) {
                test_random r = {(uint64_t)(741 + n)};
                start(false);
                e.blocks = (uint16_t)(100 + 37 * n);
                const int p = 1 + n;
                const sums s = taught(&r, p, 1e-3, 0.5);
                int parabolas;
                bool near;
                TEST_ASSERT_EQUAL_INT(p, told(&s, &parabolas, &near));
                dqw_estimator_q15_block b;
                memset(&b, 0, sizeof b);
                b.weight = 420, b.with.rows = 5000, b.with.follow_q15 = 32767;
                b.with.noise_q30[axis] = -((int64_t)1 << 34);
                dqw_rows_q15 rows;
                dqw_estimator_rows_of_q15(&e, &b, &rows);
                const int i = DQW_LD + axis;
                const double one = (double)rows.noise_q56[axis][i] / Q56 * (double)e.cov_q40[i] / Q40 * e.blocks * p;
                b.with.noise_q30[axis] = -llrint(ldexp((much ? 0.26 : 0.24) / one, 34));
                CASE("%d pole pairs, axis %d, much %d", p, axis, much);
                dqw_poles_find_q15(&e, &b);
                HOLDS(e.pole_pairs == (much ? 0 : p));
            }
}

// Both weights of the axis that tells more must be known, and the sums have room.
static void test_what_it_takes(void)
{
    for (int n = 0; n < 20; n++)
        for (int way = 0; way < 5; way++) {
            test_random r = {(uint64_t)(770 + n)};
            start(true);
            sums s = taught(&r, 1 + n, 1e-3, 0.5);
            const int own = e.cov_q40[DQW_POLES_LQ_Q15] < e.cov_q40[DQW_POLES_LD_Q15] ? DQW_LQ : DQW_LD;
            const int cross = own + DQW_POLES_LD_Q15 - DQW_LD;
            if (way == 1) e.learned &= ~(1u << own);
            if (way == 2) e.learned &= ~(1u << cross);
            // The largest of 50 bits, or of one more.
            int64_t largest = 0;
            for (int i = 0; i < BEFORE; i++)
                if (e.normal.a_q32[DQW_NORMAL_A(i, i)] > largest) largest = e.normal.a_q32[DQW_NORMAL_A(i, i)];
            int bits = 0;
            while (largest >> bits != 0) bits++;
            const int64_t by = way < 3 ? 1 : (int64_t)1 << (47 + way - bits);
            for (int k = 0; k < DQW_NORMAL_A(0, BEFORE); k++) e.normal.a_q32[k] *= by;
            for (int i = 0; i < BEFORE; i++)
                for (int j = 0; j < BEFORE; j++) s.a[i][j] *= (double)by;
            int parabolas;
            bool near;
            TEST_ASSERT_EQUAL_INT(1 + n, told(&s, &parabolas, &near));
            dqw_poles_find_q15(&e, &nothing);
            CASE("%d pole pairs, way %d", 1 + n, way);
            HOLDS(e.pole_pairs == (way == 0 || way == 3 ? 1 + n : 0));
        }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_which_integer_is_left);
    RUN_TEST(test_what_it_takes);
    RUN_TEST(test_a_slope_that_noise_has_shrunk);
    return UNITY_END();
}
