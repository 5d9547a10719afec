// The Random Learner: a fair reservoir, epochs without repetition, seeds, convergence.
#include "dqw_estimator_random.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

enum { CAPACITY = 50 };
static dqw_random_sample memory[CAPACITY];

static dqw_random_config config_of(uint32_t seed)
{
    dqw_random_config c = {
        .reservoir = memory, .capacity = CAPACITY, .draws = CAPACITY, .seed = seed, .tolerance = 0.01f};
    return c;
}

static void begin_learner(dqw_learner *l, float step)
{
    dqw_learner_config c = {.inputs = 1, .step_size = step, .y_base = 1.0f, .indicator = true};
    c.x_base[0] = 1.0f;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_init(l, &c));
}

static void test_init_refuses_and_leaves_the_object_alone(void)
{
    dqw_random r;
    dqw_random_config c = config_of(1);
    TEST_ASSERT_EQUAL_INT(DQW_ERR_NULL, dqw_random_init(NULL, &c));
    REFUSED(r, DQW_ERR_NULL, dqw_random_init(&r, NULL));
    c.reservoir = NULL;
    REFUSED(r, DQW_ERR_NULL, dqw_random_init(&r, &c));
    static const uint32_t sizes[][2] = {{0, 1}, {1, 1}, {50, 0}, {50, 51}, {2, 3}, {50, UINT32_MAX}};
    for (unsigned k = 0; k < sizeof sizes / sizeof sizes[0]; k++) {
        c = config_of(1);
        c.capacity = sizes[k][0];
        c.draws = sizes[k][1];
        REFUSED(r, DQW_ERR_SIZE, dqw_random_init(&r, &c));
    }
    static const uint32_t least[][2] = {{2, 1}, {2, 2}, {50, 50}, {UINT32_MAX, 1}};
    for (int k = 0; k < 4; k++) {
        c = config_of(1);
        c.capacity = least[k][0];
        c.draws = least[k][1];
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_random_init(&r, &c));
    }
    const float bad[] = {0.0f, -0.01f, NAN, INFINITY};
    for (int k = 0; k < 4; k++) {
        c = config_of(1);
        c.tolerance = bad[k];
        REFUSED(r, DQW_ERR_RANGE, dqw_random_init(&r, &c));
    }
}

// Marsaglia's xorshift32 by its published triple and start: 13, 17, 5 from 2463534242.
static void test_the_generator_is_the_published_one(void)
{
    static const uint32_t published[] = {723471715u, 2497366906u, 2064144800u, 2008045182u, 3532304609u};
    dqw_draw d;
    TEST_ASSERT_TRUE(dqw_draw_init(&d, 2, 1, 2463534242u));
    for (int k = 0; k < 5; k++) {
        const uint32_t high = dqw_draw_below(&d, 65536);
        TEST_ASSERT_EQUAL_UINT32(published[k], d.state);
        TEST_ASSERT_EQUAL_UINT32(published[k] >> 16, high);
    }
}

// Of 301 samples each must be kept with probability 50 / 301, whatever its place.
static void test_reservoir_is_a_fair_sample(void)
{
    const int runs = 6000;
    static int kept[301];
    memset(kept, 0, sizeof kept);
    test_random seeds = {1};
    for (int run = 0; run < runs; run++) {
        dqw_random r;
        const dqw_random_config c = config_of((uint32_t)random_bits(&seeds));
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_random_init(&r, &c));
        for (int k = 0; k < 301; k++) {
            const float x = (float)k;
            dqw_random_put(&r, &x, 1, 2.0f * x);
        }
        TEST_ASSERT_EQUAL_UINT32(CAPACITY, r.draw.held);
        TEST_ASSERT_EQUAL_UINT32(301, r.draw.seen);
        for (int k = 0; k < CAPACITY; k++) {
            TEST_ASSERT_EQUAL_FLOAT(2.0f * memory[k].x[0], memory[k].target);
            kept[(int)memory[k].x[0]]++;
        }
    }
    const double p = 50.0 / 301;
    double chi2 = 0.0;
    for (int k = 0; k < 301; k++) {
        const double off = kept[k] - runs * p;
        chi2 += off * off / (runs * p * (1 - p));
    }
    // Expected 301 (the sum being fixed takes one away, the exact count's smaller variance gives it back), deviation
    // 24.5.
    BETWEEN(225, chi2, 380);  // 296
    // The first 50 have no advantage.
    double early = 0.0;
    for (int k = 0; k < 50; k++) early += kept[k];
    BETWEEN(0.98, early / (50 * runs * p), 1.02);
}

static void test_no_sample_twice_within_an_epoch(void)
{
    static const uint32_t draws[] = {1, 7, 49, 50};
    for (int d = 0; d < 4; d++) {
        dqw_random r;
        dqw_random_config c = config_of(5);
        c.draws = draws[d];
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_random_init(&r, &c));
        for (int k = 0; k < CAPACITY; k++) {
            const float x = (float)(k + 1);
            dqw_random_put(&r, &x, 1, x);
        }
        int drawn[CAPACITY + 1] = {0};
        for (uint32_t epoch = 0; epoch < 2000; epoch++) {
            CASE("%u draws, epoch %u", (unsigned)draws[d], (unsigned)epoch);
            int seen[CAPACITY + 1] = {0};
            for (uint32_t k = 0; k < draws[d]; k++) {
                // What a neuron of step 1 without any other input was shown is its target at x = 1.
                dqw_learner l;
                begin_learner(&l, 1.0f);
                (void)dqw_random_iterate(&r, &l);
                const int which = (int)lround((double)l.w_o * (1.0 + r.reservoir[k].x[0] * r.reservoir[k].x[0]));
                HOLDS(which == (int)r.reservoir[k].x[0]);
                HOLDS(which >= 1 && which <= CAPACITY);
                seen[which]++;
                drawn[which]++;
            }
            TEST_ASSERT_EQUAL_UINT32(epoch + 1, r.draw.epochs);
            for (int k = 1; k <= CAPACITY; k++) HOLDS(seen[k] <= 1);
        }
        double chi2 = 0.0;
        const double expected = 2000.0 * draws[d] / CAPACITY;
        for (int k = 1; k <= CAPACITY; k++) chi2 += (drawn[k] - expected) * (drawn[k] - expected) / expected;
        if (draws[d] < CAPACITY)
            BETWEEN(0.0, chi2 / (1.0 - (double)draws[d] / CAPACITY), 95);  // 49 degrees of freedom; 40 to 60
    }
}

static void same_weights(const dqw_learner *a, const dqw_learner *b)
{
    TEST_ASSERT_EQUAL_MEMORY(a->w_pu, b->w_pu, sizeof a->w_pu);
    TEST_ASSERT_EQUAL_MEMORY(&a->w_o, &b->w_o, sizeof a->w_o);
    TEST_ASSERT_EQUAL_UINT32(a->learned, b->learned);
}

static dqw_learner trajectory(uint32_t seed, int iterations)
{
    dqw_random r;
    const dqw_random_config c = config_of(seed);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_random_init(&r, &c));
    test_random noise = {9};
    for (int k = 0; k < 301; k++) {
        const float x = (float)random_normal(&noise);
        dqw_random_put(&r, &x, 1, 0.7f * x + 0.1f * (float)random_normal(&noise));
    }
    dqw_learner l;
    begin_learner(&l, 0.5f);
    for (int k = 0; k < iterations; k++) (void)dqw_random_iterate(&r, &l);
    return l;
}

static void test_the_seed_alone_decides_the_trajectory(void)
{
    const dqw_learner a = trajectory(3, 77);
    const dqw_learner b = trajectory(3, 77);
    same_weights(&a, &b);
    const dqw_learner c = trajectory(4, 77);
    TEST_ASSERT_TRUE(a.w_pu[0] != c.w_pu[0]);
    const dqw_learner zero = trajectory(0, 77);
    const dqw_learner one = trajectory(1, 77);
    same_weights(&zero, &one);
}

static void test_epoch_is_that_many_iterations(void)
{
    dqw_random a;
    const dqw_random_config c = config_of(3);
    dqw_learner l;
    dqw_learner m;
    for (int kind = 0; kind < 2; kind++) {
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_random_init(&a, &c));
        for (int k = 0; k < CAPACITY; k++) {
            const float x = (float)(k - 20);
            dqw_random_put(&a, &x, 1, x + 1);
        }
        if (kind == 0) {
            begin_learner(&l, 0.5f);
            for (int k = 0; k < 10; k++) (void)dqw_random_iterate(&a, &l);
            (void)dqw_random_epoch(&a, &l);
        } else {
            begin_learner(&m, 0.5f);
            for (int k = 0; k < CAPACITY; k++) (void)dqw_random_iterate(&a, &m);
        }
        TEST_ASSERT_EQUAL_UINT32(1, a.draw.epochs);
        TEST_ASSERT_EQUAL_UINT32(0, a.draw.at);
    }
    same_weights(&l, &m);
}

static void test_converged_once_nothing_moves(void)
{
    dqw_random r;
    const dqw_random_config c = config_of(3);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_random_init(&r, &c));
    dqw_learner l;
    begin_learner(&l, 0.5f);
    // Nothing held: nothing happens.
    TEST_ASSERT_FALSE(dqw_random_epoch(&r, &l));
    TEST_ASSERT_FALSE(dqw_random_iterate(&r, &l));
    TEST_ASSERT_EQUAL_UINT32(0, r.draw.epochs);
    test_random noise = {10};
    for (int k = 0; k < CAPACITY; k++) {
        const float x = (float)random_normal(&noise);
        dqw_random_put(&r, &x, 1, 0.7f * x);
    }
    TEST_ASSERT_FALSE(dqw_random_epoch(&r, &l));
    int epochs = 1;
    while (!dqw_random_epoch(&r, &l) && epochs < 100) epochs++;
    BETWEEN(1, epochs, 5);
    BETWEEN(0.69, dqw_learner_weight(&l, 0), 0.71);
    // It stays converged, whatever comes.
    l.w_pu[0] = 100.0f;
    TEST_ASSERT_TRUE(dqw_random_iterate(&r, &l));
}

// What moves is measured by the largest weight, however small that is.
static void test_small_weights_converge_no_sooner(void)
{
    static int epochs[2];
    for (int small = 0; small < 2; small++) {
        dqw_random r;
        const dqw_random_config c = config_of(3);
        TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_random_init(&r, &c));
        dqw_learner l;
        begin_learner(&l, 0.1f);
        test_random noise = {10};
        for (int k = 0; k < CAPACITY; k++) {
            const float x = (float)random_normal(&noise);
            dqw_random_put(&r, &x, 1, (small ? 0.5f / 1024.0f : 0.5f) * x);
        }
        for (epochs[small] = 1; epochs[small] < 100 && !dqw_random_epoch(&r, &l);) epochs[small]++;
    }
    TEST_ASSERT_EQUAL_INT(epochs[0], epochs[1]);
    BETWEEN(2, epochs[0], 20);
}

static void test_noise_above_the_tolerance_keeps_it_from_converging(void)
{
    dqw_random r;
    const dqw_random_config c = config_of(3);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_random_init(&r, &c));
    dqw_learner l;
    begin_learner(&l, 0.5f);
    test_random noise = {11};
    for (int k = 0; k < CAPACITY; k++) {
        const float x = (float)random_normal(&noise);
        dqw_random_put(&r, &x, 1, 0.1f * x + (float)random_normal(&noise));
    }
    for (int k = 0; k < 20; k++) TEST_ASSERT_FALSE(dqw_random_epoch(&r, &l));
}

// Fewer held than drawn: every sample is shown once, and so few say nothing about convergence.
static void test_more_draws_than_samples_held(void)
{
    dqw_random r;
    const dqw_random_config c = config_of(3);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_random_init(&r, &c));
    dqw_learner l;
    begin_learner(&l, 0.5f);
    for (int k = 0; k < 10; k++) {
        const float x = k % 2 ? 1.0f : -1.0f;
        dqw_random_put(&r, &x, 1, 0.7f * x);
    }
    for (int k = 0; k < 50; k++) {
        TEST_ASSERT_FALSE(dqw_random_epoch(&r, &l));
        TEST_ASSERT_EQUAL_UINT32(10u * (unsigned)(k + 1), l.learned);
    }
    BETWEEN(0.699, dqw_learner_weight(&l, 0), 0.701);
}

// A neuron that was shown nothing it could learn has not converged.
static void test_samples_that_are_no_numbers_do_not_count_as_convergence(void)
{
    dqw_random r;
    const dqw_random_config c = config_of(3);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_random_init(&r, &c));
    dqw_learner l;
    begin_learner(&l, 0.5f);
    for (int k = 0; k < CAPACITY; k++) {
        const float x = NAN;
        dqw_random_put(&r, &x, 1, 1.0f);
    }
    for (int k = 0; k < 3; k++) TEST_ASSERT_FALSE(dqw_random_epoch(&r, &l));
}

static void test_counters_stop_at_their_maximum(void)
{
    dqw_random r;
    const dqw_random_config c = config_of(3);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_random_init(&r, &c));
    const float x = 1.0f;
    for (int k = 0; k < CAPACITY; k++) dqw_random_put(&r, &x, 1, x);
    r.draw.seen = UINT32_MAX - 1;
    for (int k = 0; k < 3; k++) dqw_random_put(&r, &x, 1, x);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, r.draw.seen);
    dqw_learner l;
    begin_learner(&l, 0.5f);
    r.draw.epochs = UINT32_MAX;
    (void)dqw_random_epoch(&r, &l);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, r.draw.epochs);
}

// As many inputs as there is room for: the exact weights of exact rows, and nothing beyond is touched.
static void test_every_input(void)
{
    enum { N = DQW_LEARNER_INPUTS };
    dqw_learner_config c = {.inputs = N, .step_size = 0.5f, .y_base = 1.0f, .indicator = true};
    for (int i = 0; i < N; i++) c.x_base[i] = 1.0f;
    dqw_learner l;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_learner_init(&l, &c));
    dqw_random r;
    dqw_random_config config = config_of(3);
    config.tolerance = 1e-4f;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_random_init(&r, &config));
    test_random noise = {12};
    for (int n = 0; n < CAPACITY; n++) {
        float x[N];
        float y = 0.0f;
        for (int i = 0; i < N; i++) {
            x[i] = (float)random_uniform(&noise, -1, 1);
            y += x[i] * (float)(0.1 * (i + 1));
        }
        dqw_random_put(&r, x, N, y);
    }
    int epochs = 0;
    while (!dqw_random_epoch(&r, &l) && epochs < 1000) epochs++;
    HOLDS(epochs < 1000);
    for (int i = 0; i < N; i++) BETWEEN(0.08 * (i + 1), (double)l.w_pu[i], 0.12 * (i + 1));
}

// What stage 2 is lent has rows that are per unit already, whatever was there.
static void test_what_stage_two_is_lent(void)
{
    static dqw_estimator_random lent;
    memset(&lent, 0x5a, sizeof lent);
    dqw_estimator_random_init(&lent);
    const float x_d[3] = {1.0f, 0.5f, -0.25f};
    const float x_q[3] = {-0.5f, 1.0f, 0.75f};
    const float y[2] = {0.3f, 0.6f};
    bool converged = false;
    for (int k = 0; k < 2000; k++) converged = lent.learn(&lent, x_d, x_q, y, 3);
    HOLDS(converged);
    for (int n = 0; n < 2; n++) {
        double left = (double)y[n];
        for (int i = 0; i < 3; i++) left -= (double)(lent.coarse.w_pu[i] * (n ? x_q : x_d)[i]);
        BETWEEN(-0.02, left, 0.02);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_and_leaves_the_object_alone);
    RUN_TEST(test_the_generator_is_the_published_one);
    RUN_TEST(test_reservoir_is_a_fair_sample);
    RUN_TEST(test_no_sample_twice_within_an_epoch);
    RUN_TEST(test_the_seed_alone_decides_the_trajectory);
    RUN_TEST(test_epoch_is_that_many_iterations);
    RUN_TEST(test_converged_once_nothing_moves);
    RUN_TEST(test_small_weights_converge_no_sooner);
    RUN_TEST(test_noise_above_the_tolerance_keeps_it_from_converging);
    RUN_TEST(test_more_draws_than_samples_held);
    RUN_TEST(test_samples_that_are_no_numbers_do_not_count_as_convergence);
    RUN_TEST(test_counters_stop_at_their_maximum);
    RUN_TEST(test_every_input);
    RUN_TEST(test_what_stage_two_is_lent);
    return UNITY_END();
}
