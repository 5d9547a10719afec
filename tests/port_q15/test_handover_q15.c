// Samples interrupt the background of estimator and monitor in whole numbers after any one of its instructions: what is
// learned is what would be learned had they come behind it, to the bit.
// Plain only: single steps of the processor, and what they run others run under the sanitizers.
#include "preempt.h"
// The above comes first: it asks for the names of the registers.
#include "dqw_monitor_q15.h"
#include "dqw_sim.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

enum { ROWS = 40000, HALF = 10 };
#define V_FULL 480.0
#define I_FULL 18.0
#define W_FULL 480.0
static dqw_sim_row rows[ROWS];

static void make_log(void)
{
    if (rows[1].t_s > 0) return;
    dqw_sim_scenario s = *dqw_sim_scenario_find("fault_phase_connection");
    s.method = DQW_SIM_RK4;
    TEST_ASSERT_TRUE(dqw_sim_rows(&s) <= ROWS);
    TEST_ASSERT_EQUAL_INT(DQW_SIM_OK, dqw_sim_run(&s, rows, dqw_sim_rows(&s), NULL, NULL, NULL));
}

static int16_t q15(double x, double full) { return (int16_t)lrint(fmax(-32768.0, fmin(32767.0, 32768 * x / full))); }

static dqw_sample_q15 sample(int k)
{
    const dqw_sim_row *r = &rows[k];
    return dqw_sample_from_dq_q15(q15(r->v_d_V, V_FULL), q15(r->v_q_V, V_FULL), q15(r->i_d_A, I_FULL),
                                  q15(r->i_q_A, I_FULL), q15(r->w_m_rad_s, W_FULL),
                                  (uint16_t)(lrint(r->theta_e_rad / (2 * PI) * 65536) & 65535));
}

static dqw_monitor_q15_config config_of(void)
{
    const dqw_sim_machine m = dqw_sim_scenario_find("fault_phase_connection")->machine;
    const dqw_nameplate_q15 plate = {100000, 320000, 12000, 320000, (uint16_t)m.pole_pairs};
    dqw_monitor_q15_config c = dqw_monitor_config_default_q15(&plate);
    c.estimator.half_window = HALF;
    c.estimator.R_uohm = (uint32_t)lrint(1e6 * m.R_ohm);
    c.estimator.Ld_nH = (uint32_t)lrint(1e9 * m.Ld_H);
    c.estimator.Lq_nH = (uint32_t)lrint(1e9 * m.Lq_H);
    c.estimator.psi_nWb = (uint32_t)lrint(1e9 * m.psi_Wb);
    c.J_nkgm2 = (uint32_t)lrint(1e9 * m.J_kgm2);
    return c;
}

static dqw_monitor_q15 held;
static int at_row;
static int samples;  // that come in one interrupt

static void interrupt(void)
{
    for (int k = 0; k < samples; k++) {
        const dqw_sample_q15 s = sample(at_row + k);
        (void)dqw_monitor_sample_q15(&held, &s, false);
    }
}
static void background(void) { (void)dqw_monitor_background_q15(&held); }

// A monitor just before the background takes the half that ends at about this row.
static void begin(dqw_monitor_q15 *m, const dqw_monitor_q15_config *c, int until)
{
    memset(m, 0, sizeof *m);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_monitor_init_q15(m, c));
    at_row = 0;
    while (at_row < until || !m->estimator.window.over.pending) {
        (void)dqw_monitor_background_q15(m);
        const dqw_sample_q15 s = sample(at_row);
        (void)dqw_monitor_sample_q15(m, &s, false);
        at_row++;
    }
}

static dqw_monitor_q15 expected;
static bool equal(void) { return memcmp(&held, &expected, sizeof held) == 0; }

// Stage 2, the blocks around it, and in service: looks, an event being named, healthy values taken anew.
static void test_samples_may_interrupt_the_background_anywhere(void)
{
#if PREEMPT_HERE
    make_log();
    const dqw_monitor_q15_config c = config_of();
    static dqw_monitor_q15 start;
    // Every instruction of every case where it may take minutes; else one in so many of a few: stopping at each takes
    // time already.
    const bool full = getenv("DQW_FULL") != NULL;
    const long stride = full ? 1 : 41;
    static const int until[] = {HALF, 600, 1000, 8000, 16000, 20000, 24500, 30000};
    long places = 0;
    for (unsigned k = 0; k < sizeof until / sizeof until[0]; k++) {
        if (!full && k % 3 != 1) continue;
        begin(&start, &c, until[k]);
        // What a slow background sees come: less than half a window.
        for (samples = full ? 1 : HALF - 1; samples < HALF; samples += HALF - 2) {
            CASE("row %d, %d samples, stage %d", at_row, samples, (int)dqw_monitor_stage_q15(&start));
            memcpy(&held, &start, sizeof held);
            background(), interrupt();
            memcpy(&expected, &held, sizeof held);
            memcpy(&held, &start, sizeof held);
            HOLDS(memcmp(&held, &expected, sizeof held) != 0);
            const long instructions = preempt_everywhere(stride, &held, sizeof held, background, interrupt, equal);
            CASE("row %d, %d samples, stage %d: %ld instructions", at_row, samples, (int)dqw_monitor_stage_q15(&start),
                 instructions);
            if (full) printf("%s\n", test_case);
            places += instructions / stride;
            HOLDS(instructions > 100);
        }
    }
    HOLDS(dqw_monitor_stage_q15(&start) == DQW_STAGE_IN_SERVICE);
    TEST_ASSERT_TRUE(places > 100);
    if (full) printf("%ld places\n", places);
#else
    TEST_IGNORE_MESSAGE("no single step here");
#endif
}

// A background that takes longer than half a window loses the next half, says so, and nothing else.
static void test_a_background_that_takes_too_long_loses_halves_alone(void)
{
    make_log();
    const dqw_monitor_q15_config c = config_of();
    static dqw_monitor_q15 m;
    begin(&m, &c, 12000);
    const uint32_t number = m.estimator.handed.number;
    samples = HALF;
    memcpy(&held, &m, sizeof held);
    interrupt();
    TEST_ASSERT_EQUAL_UINT8(m.estimator.missed + 1, held.estimator.missed);
    TEST_ASSERT_EQUAL_UINT32(number, held.estimator.handed.number);
    (void)dqw_monitor_background_q15(&m);
    (void)dqw_monitor_background_q15(&held);
    TEST_ASSERT_EQUAL_MEMORY(m.estimator.w_q24, held.estimator.w_q24, sizeof m.estimator.w_q24);
    // The next block does not follow: what accelerated meanwhile, nobody knows.
    HOLDS(held.watch.gathered != 0);
    const uint32_t before = held.estimator.number;
    while (held.estimator.elapsed < 2) {
        at_row += HALF;
        interrupt();
        (void)dqw_monitor_background_q15(&held);
        HOLDS(held.estimator.number < before + 4);
    }
    TEST_ASSERT_EQUAL_INT8(0, held.watch.gathered);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_samples_may_interrupt_the_background_anywhere);
    RUN_TEST(test_a_background_that_takes_too_long_loses_halves_alone);
    return UNITY_END();
}
