// What a drive leaves that starts, in both arithmetics: in the deviations where it is kept, in nothing where it is
// forgotten, and when that is. (E194)
#include "dqw_gain.h"
#include "twin_estimator.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

// The first 49 ms of a frame that is off.
static dqw_sample starting(long k, double off_rad, test_random *r)
{
    const dqw_sample s = moving(k, TRUTH[0], 0.01, r);
    if (k >= 980) return s;
    const double c = cos(off_rad);
    const double n = sin(off_rad);
    dqw_sample turned = s;
    turned.v_d_V = (float)(c * (double)s.v_d_V - n * (double)s.v_q_V);
    turned.v_q_V = (float)(n * (double)s.v_d_V + c * (double)s.v_q_V);
    turned.i_d_A = (float)(c * (double)s.i_d_A - n * (double)s.i_q_A);
    turned.i_q_A = (float)(n * (double)s.i_d_A + c * (double)s.i_q_A);
    return turned;
}

static void run(pair *p, long rows, double off_rad, uint64_t seed)
{
    begin(p);
    test_random r = {seed};
    for (long k = 0; k < rows; k++) {
        const dqw_sample s = starting(k, off_rad, &r);
        (void)step(p, &s);
    }
}

// Who forgets nothing knows it: by that error over its deviation, R the worst.
static void test_a_start_that_is_kept_stands_in_the_deviation(void)
{
    const int runs = quick() ? 8 : 30;
    double z2[2] = {0};
    double worst = 0.0;
    for (int n = 0; n < runs; n++) {
        pair p;
        configure(&p, 0.0, 0.0);
        run(&p, 16000, 0.3, 900 + (uint64_t)n);
        const double z[2] = {(f_value(&p, 0) - TRUTH[0]) / f_sd(&p, 0), (q_value(&p, 0) - TRUTH[0]) / q_sd(&p, 0)};
        for (int q = 0; q < 2; q++) {
            z2[q] += z[q] * z[q] / runs;
            worst = fmax(worst, fabs(z[q]));
        }
    }
    CASE("R: %g and %g deviations rms, %g at worst", sqrt(z2[0]), sqrt(z2[1]), worst);
    if (getenv("DQW_TEST_VALUES") != NULL) printf("%s\n", test_case);
    for (int q = 0; q < 2; q++) BETWEEN(0.4, sqrt(z2[q]), 2.0);  // 1.56, 1.52; 2.8 and 4.5 by means that forget it
    HOLDS(worst < 4.0);
}

// Where it is forgotten the residual's variance is soon what it is without such a start: by that what noise makes of
// the lasting part is told from the rest.
static void test_a_start_that_is_forgotten_is_no_noise(void)
{
    double f_pu2[2];
    double q_pu2[2];
    for (int bad = 0; bad < 2; bad++) {
        pair p;
        configure(&p, 0.0, 0.0);
        p.fc.follow = p.qc.follow = true;
        run(&p, 30000, bad ? 1.0 : 0.0, 77);
        f_pu2[bad] = (double)dqw_estimator_common_variance(&p.f);
        q_pu2[bad] = (double)dqw_estimator_common_variance_q56(&p.q);
    }
    CASE("variance %g and %g times", f_pu2[1] / f_pu2[0], q_pu2[1] / q_pu2[0]);
    if (getenv("DQW_TEST_VALUES") != NULL) printf("%s\n", test_case);
    BETWEEN(0.8, f_pu2[1] / f_pu2[0], 1.3);
    BETWEEN(0.8, q_pu2[1] / q_pu2[0], 1.3);
}

// Four times the covariance at the 50th, 100th, 200th and 400th block alone, in both at once, whether or not weights
// are solved there: with start values that are far off the count of blocks begins anew at the 50th.
static void test_it_is_forgotten_at_four_blocks(void)
{
    for (int far = 0; far < 2; far++) {
        pair p;
        configure(&p, far ? 0.45 : 0.0, 0.0);
        p.fc.follow = p.qc.follow = true;
        begin(&p);
        test_random r = {5};
        double f_before = INFINITY;
        double q_before = INFINITY;
        uint16_t blocks = 0;
        int times = 0;
        for (long k = 0; k < 14000; k++) {
            const dqw_sample s = moving(k, TRUTH[0], 0.01, &r);
            if (!step(&p, &s)) continue;
            const double f_cov = (double)dqw_gain_covariance(&p.f.gain, DQW_R, DQW_R);
            const double q_cov = (double)p.q.cov_q40[DQW_R];
            const bool on = p.f.blocks == blocks + 1 && blocks > 10;
            blocks = p.f.blocks;
            CASE("far %d, block %d: %g, %g", far, blocks, f_cov / f_before, q_cov / q_before);
            const bool forgets = blocks == 50 || blocks == 100 || blocks == 200 || blocks == 400;
            if (on && forgets) {
                times++;
                BETWEEN(3.0, f_cov / f_before, 4.0);
                BETWEEN(3.0, q_cov / q_before, 4.01);
            } else if (on) {
                HOLDS(f_cov < 1.001 * f_before);
                // Solved every fourth block it follows late.
                HOLDS(q_cov < 1.1 * q_before);
            }
            f_before = f_cov;
            q_before = q_cov;
        }
        CASE("far %d: forgotten %d times", far, times);
        HOLDS(times == 4);
    }
}

// Pole pairs that are still sought are told by all rows.
static void test_nothing_is_forgotten_while_pole_pairs_are_sought(void)
{
    pair p;
    configure(&p, 0.0, 0.0);
    p.fc.follow = p.qc.follow = true;
    p.fc.pole_pairs = p.qc.scale.pole_pairs = 0;
    begin(&p);
    test_random r = {6};
    double before[2] = {INFINITY, INFINITY};
    int seen = 0;
    for (long k = 0; k < 3000; k++) {
        const dqw_sample s = moving(k, TRUTH[0], 0.01, &r);
        if (!step(&p, &s)) continue;
        const double cov[2] = {(double)dqw_gain_covariance(&p.f.gain, DQW_R, DQW_R), (double)p.q.cov_q40[DQW_R]};
        CASE("block %d, %d pole pairs: %g, %g", p.f.blocks, p.f.pole_pairs, cov[0] / before[0], cov[1] / before[1]);
        for (int q = 0; q < 2; q++) {
            if ((q == 0 ? p.f.pole_pairs : p.q.pole_pairs) == 0 && p.f.blocks > 10) {
                HOLDS(cov[q] < 1.1 * before[q]);
                seen += (q == 0 ? p.f.blocks : p.q.blocks) == 50;
            }
            before[q] = cov[q];
        }
    }
    HOLDS(seen >= 1);
}

// Rows that are settled have no start: with `follow` or without, what is learned and how well are the same.
static void test_settled_rows_have_no_start(void)
{
    pair p[2];
    for (int follow = 0; follow < 2; follow++) {
        configure(&p[follow], 0.0, 0.0);
        p[follow].fc.settled = p[follow].qc.settled = true;
        p[follow].fc.noise_on_inputs = p[follow].qc.noise_on_inputs = false;
        p[follow].fc.voltage_error_V = 0.1f;
        p[follow].qc.voltage_error_mV = 100;
        p[follow].fc.follow = p[follow].qc.follow = follow != 0;
        begin(&p[follow]);
        test_random r = {8};
        for (int k = 0; k < 900; k++) {
            const double i_d = random_uniform(&r, -3.0, 3.0);
            const double i_q = random_uniform(&r, -3.0, 3.0);
            const double w = random_uniform(&r, 0.0, 60.0);
            const dqw_sample s = {
                .v_d_V = (float)(TRUTH[0] * i_d - 4 * w * TRUTH[2] * i_q + 0.01 * random_normal(&r)),
                .v_q_V = (float)(TRUTH[0] * i_q + 4 * w * (TRUTH[1] * i_d + TRUTH[3]) + 0.01 * random_normal(&r)),
                .i_d_A = (float)i_d,
                .i_q_A = (float)i_q,
                .w_m_rad_s = (float)w};
            (void)step(&p[follow], &s);
        }
    }
    for (int i = 0; i < 4; i++) {
        CASE("%s: %g, %g and %g, %g", NAME[i], f_value(&p[0], i), f_sd(&p[0], i), q_value(&p[0], i), q_sd(&p[0], i));
        BETWEEN(0.98, f_value(&p[0], i) / TRUTH[i], 1.02);
        BETWEEN(0.98, q_value(&p[0], i) / TRUTH[i], 1.02);
        HOLDS(f_value(&p[0], i) == f_value(&p[1], i) && f_sd(&p[0], i) == f_sd(&p[1], i));
        HOLDS(q_value(&p[0], i) == q_value(&p[1], i) && q_sd(&p[0], i) == q_sd(&p[1], i));
        HOLDS(dqw_estimator_sd_value(&p[0].f, i) == dqw_estimator_sd_value(&p[1].f, i));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_start_that_is_kept_stands_in_the_deviation);
    RUN_TEST(test_a_start_that_is_forgotten_is_no_noise);
    RUN_TEST(test_it_is_forgotten_at_four_blocks);
    RUN_TEST(test_nothing_is_forgotten_while_pole_pairs_are_sought);
    RUN_TEST(test_settled_rows_have_no_start);
    return UNITY_END();
}
