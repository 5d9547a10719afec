// Samples interrupt the background of the estimator in whole numbers after any one of its instructions: what is learned
// is what would be learned had they come behind it, to the bit.
// Plain only: single steps of the processor, and what they run others run under the sanitizers.
#include "preempt.h"
// The above comes first: it asks for the names of the registers.
#include "dqw_estimator_block_q15.h"
#include "dqw_estimator_q15.h"
#include "dqw_test.h"
#include "target/stimulus.c"  // NOLINT(bugprone-suspicious-include): the drive of the target's tests
#include "target/stimulus_q15.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

enum { ROWS = 9000, HALF = 10 };
static dqw_sample_q15 rows[ROWS];

static const dqw_estimator_q15_config given = {.scale = STIMULUS_SCALE,
                                               .half_window = HALF,
                                               .dead_time_width_mA = 200,
                                               .stale_limit = 10,
                                               .angle = true,
                                               .encoder_offset = true,
                                               .follow = true,
                                               .noise_on_inputs = true};

static dqw_estimator_q15 held, expected;
static int at_row;
static int samples;  // that come in one interrupt

static void interrupt(void)
{
    for (int k = 0; k < samples; k++) (void)dqw_estimator_sample_q15(&held, &rows[at_row + k], false);
}
static void background(void) { (void)dqw_estimator_background_q15(&held); }
static bool equal(void) { return memcmp(&held, &expected, sizeof held) == 0; }

// An estimator just before the background takes the half that ends at about this row.
static void begin(dqw_estimator_q15 *e, const dqw_estimator_q15_config *c, int until)
{
    memset(e, 0, sizeof *e);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init_q15(e, c));
    at_row = 0;
    while (at_row < until || !e->window.over.pending) {
        (void)dqw_estimator_background_q15(e);
        (void)dqw_estimator_sample_q15(e, &rows[at_row++], false);
    }
}

static void make_rows(void)
{
    stimulus s;
    stimulus_start(&s);
    for (int k = 0; k < ROWS; k++) {
        stimulus_next(&s);
        rows[k] = stimulus_sample(&s);
    }
}

// Blocks of stage 2 and its end, noise begun anew, weights solved and not solved; with the pole pairs given, and sought
// and found.
static void test_samples_may_interrupt_the_background_anywhere(void)
{
#if PREEMPT_HERE
    make_rows();
    static dqw_estimator_q15 start;
    // Every instruction where it may take a minute; else one in so many, and what ends nearly half a window: stopping
    // at each takes time already.
    const bool full = getenv("DQW_FULL") != NULL;
    const long stride = full ? 1 : 211;
    static const int until[] = {2 * HALF, 600, 1500, 8000};
    long places = 0;
    int learned = 0;
    for (int way = 0; way < 2; way++)
        for (unsigned k = 0; k < sizeof until / sizeof until[0]; k++) {
            dqw_estimator_q15_config c = given;
            if (way == 1) c.scale.pole_pairs = 0;
            begin(&start, &c, until[k]);
            // What a slow background sees come: less than half a window.
            for (samples = full ? 1 : HALF - 1; samples < HALF; samples += HALF - 2) {
                CASE("way %d, row %d, %d samples", way, at_row, samples);
                memcpy(&held, &start, sizeof held);
                background(), interrupt();
                memcpy(&expected, &held, sizeof held);
                learned += expected.blocks > start.blocks;
                memcpy(&held, &start, sizeof held);
                const long instructions = preempt_everywhere(stride, &held, sizeof held, background, interrupt, equal);
                places += instructions / stride;
                HOLDS(instructions > 100);
            }
        }
    TEST_ASSERT_TRUE(places > 30 && learned > 3);
    if (full) printf("%ld places\n", places);
#else
    TEST_IGNORE_MESSAGE("no single step here");
#endif
}

// What may come of a whole half: behind the background, between taking the block and learning it, before both.
static dqw_estimator_q15 after[4];
static bool one_of_them(void)
{
    background();
    for (int n = 0; n < 4; n++)
        if (memcmp(&after[n], &held, sizeof held) == 0) return true;
    return false;
}

// A whole half comes after any one instruction: as before the background where it had not taken its block, whose
// successor is lost; else behind it, with what it gave back adopted at once or a half later.
static void test_a_half_may_end_in_the_background_anywhere(void)
{
#if PREEMPT_HERE
    make_rows();
    static dqw_estimator_q15 start;
    static const int until[] = {8000, 1100};
    for (unsigned k = 0; k < sizeof until / sizeof until[0]; k++) {
        begin(&start, &given, until[k]);
        samples = HALF;
        // What was given back waits because the half that would have taken it was lost.
        for (int row = until[k]; k == 1 && !start.given.ready; row += HALF) {
            dqw_estimator_q15_block slow;
            begin(&held, &given, row);
            (void)dqw_estimator_take_q15(&held, &slow);
            interrupt();
            (void)dqw_estimator_learn_q15(&held, &slow);
            interrupt();
            memcpy(&start, &held, sizeof held);
            HOLDS(start.window.over.pending && start.missed == 1);
        }
        CASE("row %d", at_row);
        memcpy(&held, &start, sizeof held);
        background(), interrupt(), background();
        memcpy(&after[0], &held, sizeof held);
        memcpy(&held, &start, sizeof held);
        dqw_estimator_q15_block block;
        HOLDS(dqw_estimator_take_q15(&held, &block));
        interrupt();
        const bool judged = held.stage.name != DQW_STAGE_RANDOM;
        if (dqw_estimator_learn_q15(&held, &block) && judged) dqw_estimator_stage_on_q15(&held, true);
        background();
        memcpy(&after[1], &held, sizeof held);
        memcpy(&held, &start, sizeof held);
        interrupt(), background(), background();
        memcpy(&after[2], &held, sizeof held);
        // While what is given back is written anew.
        memcpy(&held, &start, sizeof held);
        HOLDS(dqw_estimator_take_q15(&held, &block));
        const bool waits = held.given.ready;
        held.given.ready = false;
        interrupt();
        held.given.ready = waits;
        const bool stage = held.stage.name != DQW_STAGE_RANDOM;
        if (dqw_estimator_learn_q15(&held, &block) && stage) dqw_estimator_stage_on_q15(&held, true);
        background();
        memcpy(&after[3], &held, sizeof held);
        memcpy(&held, &start, sizeof held);
        everywhere.first = 2000;
        const long stride = getenv("DQW_FULL") != NULL ? 1 : 1009;
        const long count = preempt_everywhere(stride, &held, sizeof held, background, interrupt, one_of_them);
        HOLDS(count > 5000);
        everywhere.first = 0;
        everywhere.last = count - 4000;
        memcpy(&held, &start, sizeof held);
        // AddressSanitizer counts a few others once it has been interrupted: Clang's 140 of 151 810.
        HOLDS(preempt_everywhere(stride, &held, sizeof held, background, interrupt, one_of_them) >
              count - 100 - count / 1000);
        everywhere.last = 0;
    }
#else
    TEST_IGNORE_MESSAGE("no single step here");
#endif
}

// A background that takes longer than half a window loses the next half, says so, and nothing else.
static void test_a_background_that_takes_too_long_loses_halves_alone(void)
{
    make_rows();
    dqw_estimator_q15 e;
    begin(&e, &given, 3000);
    const uint32_t number = e.handed.number;
    samples = HALF;
    memcpy(&held, &e, sizeof held);
    interrupt();
    TEST_ASSERT_EQUAL_UINT8(e.missed + 1, held.missed);
    TEST_ASSERT_EQUAL_UINT32(number, held.handed.number);
    (void)dqw_estimator_background_q15(&e);
    (void)dqw_estimator_background_q15(&held);
    TEST_ASSERT_EQUAL_MEMORY(e.w_q24, held.w_q24, sizeof e.w_q24);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_samples_may_interrupt_the_background_anywhere);
    RUN_TEST(test_a_half_may_end_in_the_background_anywhere);
    RUN_TEST(test_a_background_that_takes_too_long_loses_halves_alone);
    return UNITY_END();
}
