// Built together with all of lib/ under some compiler's floating-point flags: is what is not a number refused and
// counted, and what is learned?
// Prints `name value` lines for tests/test_fast_math.c. Not-numbers are made from bits that the compiler cannot see.
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "dqw_learner.h"
#include "dqw_monitor.h"
#include "dqw_number.h"
#include "dqw_ordinal.h"
#include "dqw_random.h"

static const volatile uint32_t bad_bits[] = {0x7fc00000u, 0xffc12345u, 0x7f800001u, 0x7f800000u, 0xff800000u};
enum { BAD = 5, WARM_ROWS = 60000, ROWS = 120000, EVERY = 997 };

static float of_bits(uint32_t bits)
{
    volatile uint32_t hidden = bits;
    const uint32_t seen = hidden;
    float x;
    memcpy(&x, &seen, sizeof x);
    return x;
}

// The object, in the only lines that know its fields.
static dqw_monitor object;
static dqw_monitor_config config;

static bool begin(void)
{
    const dqw_nameplate plate = {.dt_s = 5e-5f, .v_V = 14.0f, .i_A = 6.0f, .w_m_rad_s = 110.0f, .pole_pairs = 4};
    config = dqw_monitor_config_default(&plate);
    config.estimator.R_ohm = 0.65f;
    config.estimator.Ld_H = 0.7e-3f;
    config.estimator.Lq_H = 1.8e-3f;
    config.estimator.psi_Wb = 0.014f;
    config.estimator.angle = true;
    return dqw_monitor_init(&object, &config) == DQW_OK;
}
static bool told(void) { return dqw_monitor_background(&object); }
static uint32_t refused(void) { return object.estimator.gate.nonfinite; }
static void print_parameters(void)
{
    static const char *const names[] = {"R_ohm", "Ld_H", "Lq_H", "psi_Wb"};
    for (int i = 0; i < 4; i++)
        printf("%s %.9g\n", names[i], (double)dqw_monitor_read(&object, (enum dqw_monitor_channel)i).value);
}
static bool in_service(void) { return dqw_monitor_stage(&object) == DQW_STAGE_IN_SERVICE; }

// A healthy joint whose pairs hold exactly, R 0.5, L_d 1 mH, L_q 1.4 mH, flux 20 mWb, four pole pairs.
static dqw_sample healthy(long k)
{
    double i[2][2];
    double w[2];
    for (int n = 0; n < 2; n++) {
        const double t = (double)(k + n) * 5e-5;
        i[n][0] = 1.5 * sin(232.5 * t) + 1.2 * sin(1074.4 * t + 1);
        i[n][1] = 2.0 * sin(333.0 * t + 2) + 0.5 + sin(1438.8 * t);
        w[n] = 70 * sin(18.85 * t);
    }
    const double wd = 2 * (w[0] * i[0][0] + w[1] * i[1][0]);
    const double wq = 2 * (w[0] * i[0][1] + w[1] * i[1][1]);
    dqw_sample s = {
        .v_d_V = (float)(0.25 * (i[0][0] + i[1][0]) + 20.0 * (i[1][0] - i[0][0]) - 1.4e-3 * wq),
        .v_q_V = (float)(0.25 * (i[0][1] + i[1][1]) + 28.0 * (i[1][1] - i[0][1]) + 1e-3 * wd + 0.04 * (w[0] + w[1])),
        .i_d_A = (float)i[0][0],
        .i_q_A = (float)i[0][1],
        .w_m_rad_s = (float)w[0]};
    const double theta = 4 * 70 / 18.85 * (1 - cos(18.85 * (double)k * 5e-5));
    s.cosine = (float)cos(theta);
    s.sine = (float)sin(theta);
    return s;
}

enum { CHANNELS = 7 };
static float *channel_of(dqw_sample *s, int channel)
{
    float *const all[] = {&s->v_d_V, &s->v_q_V, &s->i_d_A, &s->i_q_A, &s->w_m_rad_s, &s->cosine, &s->sine};
    return all[channel];
}

static int through_the_object(void)
{
    if (!begin()) return 1;
    long wrong = 0;
    long made = 0;
    for (long k = 0; k < ROWS; k++) {
        dqw_sample s = healthy(k);
        const bool spoilt = k >= WARM_ROWS && k % EVERY == 0;
        if (spoilt) *channel_of(&s, (int)(made % CHANNELS)) = of_bits(bad_bits[made / CHANNELS % BAD]);
        made += spoilt;
        const uint32_t before = refused();
        const uint32_t event = dqw_monitor_sample(&object, &s, false);
        if (((event & DQW_EVENT_NONFINITE) != 0) != spoilt || refused() != before + (spoilt ? 1u : 0u)) wrong++;
        if (told()) wrong++;
    }
    printf("spoilt %ld\nspoilt_wrong %ld\nin_service %d\n", made, wrong, in_service());
    print_parameters();
    return 0;
}

// dqw_number.h against the fields of the format, which no flag touches.
static void numbers(void)
{
    uint32_t state = 2463534242u;
    long wrong = 0;
    for (long k = 0; k < 400000; k++) {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        // Every fourth of the largest exponent or the smallest.
        const uint32_t bits = k % 4 != 0 ? state : (state & 0x807fffffu) | (k % 8 != 0 ? 0x7f800000u : 0u);
        const uint32_t exponent = bits >> 23 & 255u;
        const bool nothing = (bits & 0x7fffffffu) == 0;
        const bool finite = exponent != 255u;
        const bool negative = bits >> 31 != 0;
        const float x = of_bits(bits);
        wrong += dqw_is_finite(x) != finite;
        wrong += dqw_is_positive(x) != (finite && !negative && !nothing);
        wrong += dqw_is_zero_or_positive(x) != (finite && (!negative || nothing));
        wrong += dqw_within(x, 2.0f) != (exponent < 128u || (exponent == 128u && (bits & 0x7fffffu) == 0));
    }
    const float sum = of_bits(0x7f7fffffu) + of_bits(0x7f7fffffu);
    wrong += dqw_is_finite(sum) || dqw_within(sum, 3e38f) || dqw_is_finite(0.0f * of_bits(0x7f800000u) + sum) ||
             dqw_is_finite(dqw_number_nan());
    printf("numbers_wrong %ld\n", wrong);
}

// The paper's Learners: a sample that is no number is skipped and counted, the weights stay.
static void learners(void)
{
    long wrong = 0;
    dqw_learner_config c = {.inputs = 2, .step_size = 0.5f, .y_base = 1.0f, .noisy_inputs = true, .indicator = true};
    c.x_base[0] = c.x_base[1] = 1.0f;
    dqw_learner l;
    if (dqw_learner_init(&l, &c) != DQW_OK) wrong++;
    static dqw_random_sample held[10];
    dqw_random r;
    if (dqw_random_init(&r, &(dqw_random_config){.reservoir = held, .capacity = 10, .draws = 10, .tolerance = 1e-3f}) !=
        DQW_OK)
        wrong++;
    dqw_ordinal o;
    if (dqw_ordinal_init(
            &o, &(dqw_ordinal_config){.dt_s = 5e-5f, .x_base = 14.0f, .y_base = 6.0f, .R_ohm = 0.5f, .L_H = 1e-3f}) !=
        DQW_OK)
        wrong++;
    float plain[2] = {0.5f, -0.25f};
    uint32_t skipped = 0;
    for (int at = 0; at < 3; at++)
        for (int b = 0; b < BAD; b++) {
            float x[] = {1.0f, 0.5f, 0.25f};
            x[at] = of_bits(bad_bits[b]);
            const dqw_learner before = l;
            wrong += dqw_learner_learn(&l, x, x[2]) != 0.0f;
            skipped++;
            wrong += l.skipped != skipped || memcmp(before.w_pu, l.w_pu, sizeof l.w_pu) != 0;
            dqw_random_put(&r, x, 2, x[2]);
            wrong += r.draw.held != 0 || r.draw.seen != 0;
            (void)dqw_learner_step_pu(plain, x, 2, x[2], 0.5f);
            wrong += plain[0] != 0.5f || plain[1] != -0.25f;
            if (at == 2) continue;
            const uint32_t passed = o.skipped;
            dqw_ordinal_step(&o, x[0], x[1]);
            wrong += o.skipped != passed + 1u;
        }
    for (int b = 0; b < BAD; b++) {
        const float x = of_bits(bad_bits[b]);
        dqw_gain g;
        wrong += dqw_gain_init(&g, 2, x) != DQW_ERR_RANGE;
        c.y_base = x;
        wrong += dqw_learner_init(&l, &c) != DQW_ERR_RANGE;
        c.y_base = 1.0f;
        wrong += dqw_learner_set_weight(&l, 0, x) != DQW_ERR_RANGE;
    }
    wrong += dqw_is_finite(dqw_learner_weight(&l, 7));
    printf("learners_wrong %ld\n", wrong);
}

int main(void)
{
    numbers();
    learners();
    return through_the_object();
}
