// The witness: residuals made phase by phase in double are learned as the weights that made them; its deviation is what
// repeated runs scatter by; where it cannot see it refuses.
#include <complex.h>

#include "dqw_estimator_block.h"
#include "dqw_test.h"
#include "dqw_witness.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

#define DT_S 1.25e-4
#define R_OHM 0.5
#define L_H 1.2e-3
#define PSI_WB 0.02
#define V_BASE 14.0
enum { POLES = 4, HALF = 8 };

typedef double complex vector;

static dqw_estimator_config config_of(void)
{
    const dqw_estimator_config c = {.dt_s = (float)DT_S,
                                    .v_base_V = (float)V_BASE,
                                    .i_base_A = 6.0f,
                                    .w_base_rad_s = 110.0f,
                                    .R_ohm = (float)R_OHM,
                                    .Ld_H = (float)L_H,
                                    .Lq_H = (float)L_H,
                                    .psi_Wb = (float)PSI_WB,
                                    .pole_pairs = POLES,
                                    .half_window = HALF,
                                    .angle = true};
    return c;
}

// What the drive has that the model lacks. Everything of `phase`, which lies `phase` times 120 degrees from phase a.
typedef struct defect {
    vector offset_A;  ///< on the measured current, in the stator
    double extra_ohm, sensor_gain, short_S;
    int phase;
} defect;

// What the model leaves over at one instant, in the rotating frame, but for the mean, which the estimator takes for R,
// L and flux. Phase quantities x_n of a vector x are Re(x exp(-j a_n)), and a value y of one phase is the vector 2/3 y
// exp(j a_n).
static vector left_over(const defect *f, vector i, vector slope, double w_e, double theta)
{
    const vector a = cexp(I * f->phase * 2 * PI / 3);
    const vector turn = cexp(I * theta);
    // A current too much, x in the rotating frame, makes the model expect R x + L dx/dt + j w L x.
    vector v = -R_OHM * f->offset_A / turn;
    const vector stator = i * turn;
    const double i_n = creal(stator * conj(a));
    v += f->extra_ohm * (2.0 / 3 * i_n * a / turn - i / 3);
    // The sensor's own current, without its mean part of a third: its ripple's slope in time, by the chain rule.
    const vector ripple = f->sensor_gain * (2.0 / 3 * i_n * a / turn - i / 3);
    const double i_n_rate = creal((slope + I * w_e * i) * turn * conj(a));
    const vector rate = f->sensor_gain * (2.0 / 3 * (i_n_rate - I * w_e * i_n) * a / turn - slope / 3);
    v -= R_OHM * ripple + L_H * rate + I * w_e * L_H * ripple;
    // Turns shorted through a conductance carry what their phase's induced voltage drives, j w psi on q; its ripple
    // meets the winding.
    const double e_n = creal(I * w_e * PSI_WB * turn * conj(a));
    const vector shorted = -f->short_S * (2 * e_n * a / turn - I * w_e * PSI_WB);
    v += R_OHM * shorted - I * w_e * L_H * shorted;
    return v;
}

// One block as an estimator would take it: all means under the triangle, pair by pair, each pair over its own period.
static void hand_over(dqw_estimator *t, dqw_estimator_block *b, const defect *f, vector i, vector slope, double w_e,
                      double theta, double noise_V, test_random *r)
{
    vector mean = 0;
    const bool sound = f->offset_A == 0 && f->extra_ohm == 0 && f->sensor_gain == 0 && f->short_S == 0;
    for (int j = 1; j <= 2 * HALF && !sound; j++) {
        const double weight = (j <= HALF ? j : 2 * HALF + 1 - j) / (double)(HALF * (HALF + 1));
        const double time = (j - HALF - 0.5) * DT_S;
        mean += weight * left_over(f, i + slope * time, slope, w_e, theta + w_e * time);
    }
    memset(b, 0, sizeof *b);
    b->sum[2] = (float)(2 * creal(i));
    b->sum[3] = (float)(2 * cimag(i));
    b->sum[4] = (float)(creal(slope) * DT_S);
    b->sum[5] = (float)(cimag(slope) * DT_S);
    b->sum[6] = (float)(2 * w_e / POLES * creal(i));
    b->sum[7] = (float)(2 * w_e / POLES * cimag(i));
    b->sum[8] = (float)(2 * w_e / POLES);
    b->cosine = (float)cos(theta);
    b->sine = (float)sin(theta);
    t->e_pu[0] = (float)((creal(mean) + (noise_V > 0 ? noise_V * random_normal(r) : 0.0)) / V_BASE);
    t->e_pu[1] = (float)((cimag(mean) + (noise_V > 0 ? noise_V * random_normal(r) : 0.0)) / V_BASE);
}

typedef struct drive {
    bool changing;  ///< currents that move within a block
    int way;        ///< of rotation: 1, -1; 0: to and fro
    double noise_V;
    bool fast;  ///< half a block turns by up to 1.1, and a ripple loses a third in it
} drive;

static dqw_witness learned(const defect *f, drive d, int blocks, uint64_t seed)
{
    const dqw_estimator_config c = config_of();
    dqw_estimator t;
    dqw_estimator_block b;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&t, &c));
    dqw_witness w;
    memset(&w, 0x5a, sizeof w);
    dqw_witness_init(&w);
    test_random r = {seed};
    double theta = 0.0;
    vector i = 0;
    double w_e = 0.0;
    for (int k = 0; k < blocks; k++) {
        if (k % 15 == 0) {
            w_e = (d.fast ? random_uniform(&r, 600, 1100) : random_uniform(&r, 80, 380)) * (d.way != 0 ? d.way
                                                                                            : random_bits(&r) % 2 ? 1
                                                                                                                  : -1);
            i = random_uniform(&r, -4, 4) + I * random_uniform(&r, -4, 4);
        }
        const vector slope = d.changing ? 400 * (random_normal(&r) + I * random_normal(&r)) : 0;
        theta = fmod(theta + w_e * HALF * DT_S, 2 * PI);
        hand_over(&t, &b, f, i, slope, w_e, theta, d.noise_V, &r);
        HOLDS(dqw_witness_learn(&w, &t, &b));
    }
    return w;
}

// The weights that a defect is to be learned as.
static void weights_of(const defect *f, vector out[DQW_WITNESS_INPUTS])
{
    const vector twice = cexp(2 * I * f->phase * 2 * PI / 3);
    out[DQW_WITNESS_OFFSET] = f->offset_A;
    out[DQW_WITNESS_RESISTANCE] = (f->extra_ohm - f->sensor_gain * R_OHM) / 3 * twice;
    out[DQW_WITNESS_REACTANCE] = f->sensor_gain * L_H / 3 * twice;
    out[DQW_WITNESS_SHORT] = f->short_S * twice;
}

static const defect DEFECTS[] = {
    {.offset_A = 0.2 + 0.1 * I},
    {.extra_ohm = 0.1, .phase = 1},
    {.sensor_gain = 0.1, .phase = 2},
    {.sensor_gain = -0.1, .phase = 0},
    {.short_S = 0.01, .phase = 1},
    {.offset_A = -0.1 * I, .extra_ohm = 0.1, .sensor_gain = 0.05, .short_S = 0.005, .phase = 2}};
enum { DEFECTS_N = sizeof DEFECTS / sizeof DEFECTS[0] };

static void test_residuals_are_learned_as_the_weights_that_made_them(void)
{
    const bool quick = scaled(10) == 1;
    double worst[2] = {0};
    // What a weight of this size is worth on the whole: volts of 3 A, 200 rad/s.
    const double unit[DQW_WITNESS_INPUTS] = {R_OHM, 3, 3 * 200, 200 * PSI_WB * R_OHM};
    for (int way = quick ? 0 : -1; way <= (quick ? 0 : 1); way++)
        for (int changing = 0; changing < 2; changing++)
            for (int n = 0; n < DEFECTS_N; n++) {
                const drive d = {.changing = changing == 1, .way = way};
                const dqw_witness w = learned(&DEFECTS[n], d,
                                              quick      ? 1500
                                              : way == 0 ? 6000
                                                         : 20000,
                                              (uint64_t)(n + 10 * changing + 100));
                vector expected[DQW_WITNESS_INPUTS];
                weights_of(&DEFECTS[n], expected);
                double size = 0.0;
                for (int k = 0; k < DQW_WITNESS_INPUTS; k++) size = fmax(size, cabs(expected[k]) * unit[k]);
                for (int k = 0; k < DQW_WITNESS_INPUTS; k++) {
                    CASE("defect %d, way %d, changing %d, input %d: %g%+gj for %g%+gj", n, way, changing, k,
                         (double)w.re[k], (double)w.im[k], creal(expected[k]), cimag(expected[k]));
                    const double off = cabs(w.re[k] + I * w.im[k] - expected[k]) * unit[k] / size;
                    BETWEEN(0.0, off, changing || quick ? 0.15 : 0.06);
                    worst[changing] = fmax(worst[changing], off);
                    HOLDS(fabs(dqw_witness_size(&w, (enum dqw_witness_input)k) - hypot(w.re[k], w.im[k])) <=
                          1e-6 * hypot(w.re[k], w.im[k]));
                }
            }
    test_case[0] = 0;
    BETWEEN(0.01, worst[0], 0.1);   // 0.040: what one direction alone tells slowly
    BETWEEN(0.01, worst[1], 0.15);  // 0.068
}

// What a block averages away of a ripple is known, and given back.
static void test_ripples_that_a_block_all_but_averages_away_keep_their_size(void)
{
    const defect defects[] = {
        {.offset_A = 0.2 + 0.1 * I}, {.extra_ohm = 0.1, .phase = 1}, {.short_S = 0.01, .phase = 1}};
    static const enum dqw_witness_input at[] = {DQW_WITNESS_OFFSET, DQW_WITNESS_RESISTANCE, DQW_WITNESS_SHORT};
    for (int n = 0; n < 3; n++) {
        const drive d = {.fast = true};
        const dqw_witness w = learned(&defects[n], d, 5000, 9);
        vector expected[DQW_WITNESS_INPUTS];
        weights_of(&defects[n], expected);
        const double off = cabs(w.re[at[n]] + I * w.im[at[n]] - expected[at[n]]) / cabs(expected[at[n]]);
        CASE("defect %d", n);
        BETWEEN(0.0, off, 0.06);  // 0.007, 0.027, 0.031
    }
}

static void test_deviation_is_what_repeated_runs_scatter_by(void)
{
    static const double noises[] = {0.02, 0.3};
    const int runs = scaled(120);
    const dqw_estimator_config c = config_of();
    for (int n = 0; n < 2; n++) {
        const defect none = {.phase = 0};
        const drive d = {.noise_V = noises[n]};
        double square[DQW_WITNESS_INPUTS] = {0};
        double told[DQW_WITNESS_INPUTS] = {0};
        dqw_estimator t;
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&t, &c));
        t.error_pu2[0] = t.error_pu2[1] = (float)(noises[n] / V_BASE * (noises[n] / V_BASE));
        for (int run = 0; run < runs; run++) {
            const dqw_witness w = learned(&none, d, 1000, (uint64_t)(1000 * n + run));
            for (int k = 0; k < DQW_WITNESS_INPUTS; k++) {
                square[k] += ((double)w.re[k] * (double)w.re[k] + (double)w.im[k] * (double)w.im[k]) / 2 / runs;
                told[k] += (double)dqw_witness_sd(&w, &t, (enum dqw_witness_input)k) / runs;
            }
        }
        for (int k = 0; k < DQW_WITNESS_INPUTS; k++) {
            CASE("noise %g V, input %d", noises[n], k);
            const double ratio = sqrt(square[k]) / told[k];
            BETWEEN(runs == 120 ? 0.8 : 0.6, ratio, runs == 120 ? 1.25 : 1.6);
        }
    }
}

// Where strong currents turn the shaft round, within a turn of a ripple, a voltage that stands still in the magnet's
// frame is none: what it makes of one stays below the five deviations of a band.
static void test_turning_round_makes_no_ripple(void)
{
    enum { ROUND = 30, APART = 400, ROUNDS = 60 };
    const dqw_estimator_config c = config_of();
    dqw_estimator t;
    dqw_estimator_block b;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&t, &c));
    dqw_witness w;
    dqw_witness_init(&w);
    const defect none = {.phase = 0};
    test_random r = {31};
    double theta = 0.0;
    double error2 = 0.0;
    double z2[DQW_WITNESS_INPUTS] = {0};
    for (int k = 0; k < ROUNDS * APART; k++) {
        const int at = k % APART;
        const double way = k / APART % 2 == 0 ? 1 : -1;
        const bool strong = at < ROUND;
        // From one direction to the other, 200 rad/s: what is too slow is not learned.
        const double w_e = way * (strong ? -200 + 400.0 * at / ROUND : 200);
        const vector i = strong ? 6 * I * way : 0.4 * (random_normal(&r) + I * random_normal(&r));
        theta = fmod(theta + w_e * HALF * DT_S, 2 * PI);
        hand_over(&t, &b, &none, i, 0, w_e, theta, 0.03, &r);
        if (at < 8) t.e_pu[1] += (float)(0.1 * way / V_BASE);
        error2 += (double)(t.e_pu[0] * t.e_pu[0] + t.e_pu[1] * t.e_pu[1]);
        t.error_pu2[0] = t.error_pu2[1] = (float)(error2 / (k + 1) / 2);
        (void)dqw_witness_learn(&w, &t, &b);
        for (int n = 0; n < DQW_WITNESS_INPUTS && at == ROUND && k > 2 * APART; n++) {
            const double sd = (double)dqw_witness_sd(&w, &t, (enum dqw_witness_input)n);
            z2[n] += pow((double)dqw_witness_size(&w, (enum dqw_witness_input)n) / sd, 2) / 2 / (ROUNDS - 3);
        }
    }
    // Where a strong block taught ten times what one of mean power does: 4.8 and 1.8.
    BETWEEN(1.5, sqrt(z2[DQW_WITNESS_RESISTANCE]), 3.2);  // 2.71
    BETWEEN(0.7, sqrt(z2[DQW_WITNESS_REACTANCE]), 1.3);   // 1.03
}

static void test_it_refuses_where_it_cannot_see(void)
{
    const dqw_estimator_config c = config_of();
    const defect f = {.extra_ohm = 0.1};
    dqw_estimator t;
    dqw_estimator_block b;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&t, &c));
    // Half a block turns by w_e HALF DT_S: not below 0.08 rad, not above 1.2.
    for (int way = -1; way <= 1; way += 2)
        for (double turn = 0.0; turn < 3.0; turn += 0.0101) {
            CASE("half a block turns by %g", way * turn);
            dqw_witness w;
            dqw_witness_init(&w);
            const dqw_witness before = w;
            hand_over(&t, &b, &f, 2 + 3 * I, 0, way * turn / (HALF * DT_S), 1.0, 0.0, NULL);
            const bool sees = turn > 0.08 && turn < 1.2;
            HOLDS(dqw_witness_learn(&w, &t, &b) == sees);
            HOLDS((memcmp(&before, &w, sizeof w) != 0) == sees);
        }
    // Without an angle, at the block's middle or ever; without a number.
    static const float bad[] = {NAN, INFINITY, -INFINITY};
    for (int k = 0; k < 12; k++) {
        CASE("case %d", k);
        dqw_witness w;
        dqw_witness_init(&w);
        const dqw_witness before = w;
        hand_over(&t, &b, &f, 2 + 3 * I, 0, 200, 1.0, 0.0, NULL);
        const dqw_estimator good = t;
        const dqw_estimator_block good_block = b;
        if (k < 3)
            b.cosine = bad[k];
        else if (k < 6)
            t.e_pu[k % 2] = bad[k % 3];
        else if (k < 9)
            b.sum[8] = bad[k % 3];
        else if (k < 11)
            b.sum[2 + k % 2] = NAN;
        else
            b.cosine = b.sine = 0.0f;
        HOLDS(!dqw_witness_learn(&w, &t, &b));
        HOLDS(memcmp(&before, &w, sizeof w) == 0);
        t = good;
        b = good_block;
        HOLDS(dqw_witness_learn(&w, &t, &b));
    }
}

// The power of its inputs is a mean: the same block once more leaves it as it is.
static void test_power_is_a_mean(void)
{
    const defect f = {.extra_ohm = 0.1};
    const dqw_estimator_config c = config_of();
    dqw_estimator t;
    dqw_estimator_block b;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&t, &c));
    hand_over(&t, &b, &f, 2 + 3 * I, 0, 200, 1.0, 0.0, NULL);
    dqw_witness w;
    dqw_witness_init(&w);
    HOLDS(dqw_witness_learn(&w, &t, &b));
    const dqw_witness first = w;
    for (int n = 0; n < 40; n++) HOLDS(dqw_witness_learn(&w, &t, &b));
    for (int k = 0; k < DQW_WITNESS_INPUTS; k++) BETWEEN(0.9999, (double)(w.power[k] / first.power[k]), 1.0001);
}

// At one speed a phase's resistance and a sensor's gain make the same ripple: its sum is known, reactance's share is not;
// the further the speed spreads, the better. (E177)
static void test_what_a_speed_that_stays_tells(void)
{
    static const double spreads[] = {0.0, 0.01, 0.3};
    const dqw_estimator_config c = config_of();
    for (int way = -1; way <= 1; way += 2)
        for (int k = 0; k < 3; k++) {
            const defect f = {.extra_ohm = 0.3, .phase = 1};
            dqw_estimator t;
            dqw_estimator_block b;
            TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&t, &c));
            t.error_pu2[0] = t.error_pu2[1] = 1e-6f;
            dqw_witness w;
            dqw_witness_init(&w);
            double theta = 0.0;
            for (int n = 0; n < 1500; n++) {
                const double w_e = way * 300 * (n % 2 ? 1 + spreads[k] : 1 - spreads[k]);
                theta = fmod(theta + w_e * HALF * DT_S, 2 * PI);
                hand_over(&t, &b, &f, n % 4 < 2 ? 3 * I : -3 * I, 0, w_e, theta, 0.0, NULL);
                HOLDS(dqw_witness_learn(&w, &t, &b));
            }
            CASE("way %d, spread %g", way, spreads[k]);
            const double mean = (double)dqw_witness_speed(&w);
            BETWEEN(k == 2 ? 0.98 : 0.997, mean / (way * 300), 1.003);  // a block leaves less of what turns faster
            const vector ripple = w.re[1] + I * w.im[1] + I * mean * (w.re[2] + I * w.im[2]);
            BETWEEN(-3e-3, cabs(ripple - 0.1 * cexp(4 * I * PI / 3)), 3e-3);
            if (k == 0) BETWEEN(0.4, cabs(w.re[1] + I * w.im[1]) / 0.1, 0.6);
            // Of two speeds w (1 +- s): w^2 s^2 of the current's power.
            const double power = (double)w.power[1] * pow(300 * spreads[k], 2);
            const double sd = V_BASE * sqrt(5e-7 / 300 / power);
            const double got = (double)dqw_witness_sd(&w, &t, DQW_WITNESS_REACTANCE);
            if (k == 2) BETWEEN(0.95, got / sd, 1.05);
            if (k == 1) BETWEEN(0.8, got / sd, 1.2);
            if (k == 0) HOLDS(got > 20 * V_BASE * sqrt(5e-7 / 300 / (double)w.power[2]));
        }
}

static void test_it_knows_no_deviation_before_its_memory_is_full(void)
{
    const defect f = {.extra_ohm = 0.1};
    const dqw_estimator_config c = config_of();
    dqw_estimator t;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&t, &c));
    t.error_pu2[0] = t.error_pu2[1] = 1e-6f;
    const drive d = {.changing = false};
    for (int k = 0; k < DQW_WITNESS_INPUTS; k++) {
        const dqw_witness early = learned(&f, d, (int)DQW_WITNESS_MEMORY - 1, 5);
        const dqw_witness full = learned(&f, d, (int)DQW_WITNESS_MEMORY, 5);
        HOLDS(dqw_witness_sd(&early, &t, (enum dqw_witness_input)k) == DQW_UNKNOWN);
        HOLDS(dqw_witness_sd(&full, &t, (enum dqw_witness_input)k) < DQW_UNKNOWN &&
              dqw_witness_sd(&full, &t, (enum dqw_witness_input)k) > 0.0f);
    }
    dqw_witness none;
    dqw_witness_init(&none);
    HOLDS(dqw_witness_size(&none, DQW_WITNESS_OFFSET) == 0.0f &&
          dqw_witness_sd(&none, &t, DQW_WITNESS_OFFSET) == DQW_UNKNOWN);
}

// A machine whose flux is not learned yet: next to no input, and an error of volts.
static void test_the_first_blocks_make_no_ripple(void)
{
    const dqw_estimator_config c = config_of();
    dqw_estimator t;
    dqw_estimator_block b;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&t, &c));
    dqw_witness w;
    dqw_witness_init(&w);
    test_random r = {763};
    const defect none = {0};
    const float psi = t.w_pu[DQW_PSI];
    for (unsigned k = 0; k < 100; k++) {
        CASE("block %u", k);
        const bool first = k < DQW_WITNESS_FIRST - 1;
        const double small = k < 8 ? 1e-3 : 1;
        t.w_pu[DQW_PSI] = psi * (float)small;
        hand_over(&t, &b, &none, small * (2 + I), 0, 300, 0.4 * k, 0.02, &r);
        if (k < 8) t.e_pu[0] = t.e_pu[1] = 0.1f;
        HOLDS(dqw_witness_learn(&w, &t, &b));
        for (int n = 0; n < DQW_WITNESS_INPUTS; n++) {
            const double volts = (double)dqw_witness_size(&w, (enum dqw_witness_input)n) * sqrt((double)w.power[n]);
            HOLDS(first ? volts == 0 : volts < 0.02);
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_residuals_are_learned_as_the_weights_that_made_them);
    RUN_TEST(test_ripples_that_a_block_all_but_averages_away_keep_their_size);
    RUN_TEST(test_deviation_is_what_repeated_runs_scatter_by);
    RUN_TEST(test_turning_round_makes_no_ripple);
    RUN_TEST(test_it_refuses_where_it_cannot_see);
    RUN_TEST(test_the_first_blocks_make_no_ripple);
    RUN_TEST(test_power_is_a_mean);
    RUN_TEST(test_what_a_speed_that_stays_tells);
    RUN_TEST(test_it_knows_no_deviation_before_its_memory_is_full);
    return UNITY_END();
}
