// The fixed-point Random Learner beside the float one: the same reservoir and the same draws, sample for sample;
// weights; convergence.
#include "dqw_random.h"
#include "dqw_random_q15.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

#define LSB (1.0 / 32768)
enum { CAPACITY = 50 };
static dqw_random_sample memory[CAPACITY];
static dqw_random_sample_q15 memory_q15[CAPACITY];

static int16_t q15(double x) { return (int16_t)lrint(fmax(-32767.0, fmin(32767.0, 32768 * x))); }

static void test_init_refuses_and_leaves_the_object_alone(void)
{
    dqw_random_q15 r;
    const dqw_random_config_q15 good = {
        .reservoir = memory_q15, .capacity = CAPACITY, .draws = CAPACITY, .seed = 1, .tolerance_q15 = 328};
    dqw_random_config_q15 c = good;
    TEST_ASSERT_EQUAL_INT(DQW_ERR_NULL, dqw_random_init_q15(NULL, &c));
    REFUSED(r, DQW_ERR_NULL, dqw_random_init_q15(&r, NULL));
    c.reservoir = NULL;
    REFUSED(r, DQW_ERR_NULL, dqw_random_init_q15(&r, &c));
    static const uint32_t sizes[][2] = {{0, 1}, {1, 1}, {50, 0}, {50, 51}, {2, 3}, {50, UINT32_MAX}};
    for (unsigned k = 0; k < sizeof sizes / sizeof sizes[0]; k++) {
        c = good;
        c.capacity = sizes[k][0];
        c.draws = sizes[k][1];
        REFUSED(r, DQW_ERR_SIZE, dqw_random_init_q15(&r, &c));
    }
    static const uint32_t least[][2] = {{2, 1}, {2, 2}, {50, 50}, {UINT32_MAX, 1}};
    for (int k = 0; k < 4; k++) {
        c = good;
        c.capacity = least[k][0];
        c.draws = least[k][1];
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_random_init_q15(&r, &c));
    }
    c = good;
    c.tolerance_q15 = 0;
    REFUSED(r, DQW_ERR_RANGE, dqw_random_init_q15(&r, &c));
}

// 301 samples, more while the epochs run. After every call both reservoirs hold the same samples in the same places.
static void compare(uint32_t seed, uint32_t draws, bool noisy)
{
    const dqw_random_config rc = {
        .reservoir = memory, .capacity = CAPACITY, .draws = draws, .seed = seed, .tolerance = 0.01f};
    const dqw_random_config_q15 rq = {
        .reservoir = memory_q15, .capacity = CAPACITY, .draws = draws, .seed = seed, .tolerance_q15 = 328};
    const dqw_learner_config lc = {.inputs = 2,
                                   .step_size = 0.5f,
                                   .x_base = {1.0f, 1.0f},
                                   .y_base = 1.0f,
                                   .indicator = true,
                                   .noisy_inputs = noisy};
    const dqw_learner_config_q15 lq = {.inputs = 2, .step_size_q15 = 16384, .indicator = true, .noisy_inputs = noisy};
    dqw_random f;
    dqw_random_q15 q;
    dqw_learner lf;
    dqw_learner_q15 l;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_random_init(&f, &rc));
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_random_init_q15(&q, &rq));
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_init(&lf, &lc));
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_init_q15(&l, &lq));
    memset(memory, 0, sizeof memory);
    memset(memory_q15, 0, sizeof memory_q15);
    test_random r = {seed};
    double apart = 0.0;
    uint32_t first[2] = {0};
    for (int k = 0; k < 4000; k++) {
        CASE("seed %u, %u draws, noisy %d, call %d", (unsigned)seed, (unsigned)draws, noisy, k);
        if (k < 301 || k % 50 == 0) {
            const int16_t x[2] = {q15(0.3 * random_normal(&r)), q15(0.2 * random_normal(&r))};
            const int16_t y = q15(0.7 * x[0] * LSB - 0.2 * x[1] * LSB);
            const float xf[2] = {(float)x[0] / 32768, (float)x[1] / 32768};
            dqw_random_put(&f, xf, 2, (float)y / 32768);
            dqw_random_put_q15(&q, x, 2, y);
        }
        if (k > 20) {
            const bool a = dqw_random_iterate(&f, &lf);
            const bool b = dqw_random_iterate_q15(&q, &l);
            if (a && first[0] == 0) first[0] = f.draw.epochs;
            if (b && first[1] == 0) first[1] = q.draw.epochs;
        }
        HOLDS(f.draw.state == q.draw.state && f.draw.held == q.draw.held && f.draw.seen == q.draw.seen &&
              f.draw.at == q.draw.at && f.draw.epochs == q.draw.epochs);
        for (int i = 0; i < CAPACITY; i++) {
            HOLDS(memory[i].target * 32768 == memory_q15[i].target_q15);
            for (int j = 0; j < 2; j++) HOLDS(memory[i].x[j] * 32768 == memory_q15[i].x_q15[j]);
        }
        for (int j = 0; j < 2; j++) apart = fmax(apart, fabs(l.w_q31[j] / 2147483648.0 - (double)lf.w_pu[j]) / LSB);
        apart = fmax(apart, fabs(l.w_o_q31 / 2147483648.0 - (double)lf.w_o) / LSB);
    }
    BETWEEN(0.1, apart, 2.0);
    // Where the float one settles the fixed-point one does; an epoch that moves the weights by just the tolerance may
    // tell them apart.
    HOLDS(first[0] > 0 && first[1] > 0);
    HOLDS(abs((int)first[0] - (int)first[1]) <= 1);
    HOLDS(l.learned == lf.learned);
}

static void test_the_same_draws(void)
{
    static const uint32_t seeds[] = {0, 1, 2, 77, 0x80000000u, UINT32_MAX};
    static const uint32_t draws[] = {1, 7, 49, 50};
    for (int s = 0; s < 6; s++)
        for (int d = 1; d < 4; d++) compare(seeds[s], draws[d], (s & 1) != 0);
}

static void test_epochs_and_counters(void)
{
    const dqw_random_config_q15 rq = {
        .reservoir = memory_q15, .capacity = CAPACITY, .draws = CAPACITY, .seed = 3, .tolerance_q15 = 328};
    const dqw_learner_config_q15 lq = {.inputs = 1, .step_size_q15 = 16384, .indicator = true};
    dqw_random_q15 q;
    dqw_learner_q15 l;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_random_init_q15(&q, &rq));
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_init_q15(&l, &lq));
    TEST_ASSERT_FALSE(dqw_random_epoch_q15(&q, &l));
    TEST_ASSERT_FALSE(dqw_random_iterate_q15(&q, &l));
    TEST_ASSERT_EQUAL_UINT32(0, q.draw.epochs);
    // Fewer held than drawn: every sample is shown once, and so few say nothing about convergence.
    for (int k = 0; k < 10; k++) {
        const int16_t x = k % 2 ? 20000 : -20000;
        dqw_random_put_q15(&q, &x, 1, k % 2 ? 10000 : -10000);
    }
    for (uint32_t k = 1; k <= 50; k++) {
        TEST_ASSERT_FALSE(dqw_random_epoch_q15(&q, &l));
        TEST_ASSERT_EQUAL_UINT32(10 * k, l.learned);
    }
    BETWEEN(0.499, l.w_q31[0] / 2147483648.0, 0.501);
    for (int k = 0; k < 3000; k++) {
        const int16_t x = (int16_t)(k * 7 % 20000);
        dqw_random_put_q15(&q, &x, 1, x / 2);
    }
    int epochs = 0;
    while (!dqw_random_epoch_q15(&q, &l) && epochs < 20) epochs++;
    BETWEEN(0, epochs, 5);
    // It stays converged, whatever comes.
    l.w_q31[0] = INT32_MAX;
    TEST_ASSERT_TRUE(dqw_random_iterate_q15(&q, &l));
    (void)dqw_random_epoch_q15(&q, &l);
    q.draw.seen = q.draw.epochs = UINT32_MAX;
    const int16_t x = 1;
    dqw_random_put_q15(&q, &x, 1, x);
    (void)dqw_random_epoch_q15(&q, &l);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, q.draw.seen);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, q.draw.epochs);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_and_leaves_the_object_alone);
    RUN_TEST(test_the_same_draws);
    RUN_TEST(test_epochs_and_counters);
    return UNITY_END();
}
