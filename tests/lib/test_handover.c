// Samples interrupt the background of estimator and monitor after any one of its instructions: what is learned is what
// would be learned had they come behind it, to the bit.
// Plain only: single steps of the processor, and what they run others run under the sanitizers.
#include "preempt.h"
// The above comes first: it asks for the names of the registers.
#include "dqw.h"
#include "dqw_sim.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

enum { ROWS = 40000, HALF = 10 };
static dqw_sim_row rows[ROWS];

static void make_log(void)
{
    if (rows[1].t_s > 0) return;
    dqw_sim_scenario s = *dqw_sim_scenario_find("fault_phase_connection");
    s.method = DQW_SIM_RK4;
    TEST_ASSERT_TRUE(dqw_sim_rows(&s) <= ROWS);
    TEST_ASSERT_EQUAL_INT(DQW_SIM_OK, dqw_sim_run(&s, rows, dqw_sim_rows(&s), NULL, NULL, NULL));
}

static dqw_sample sample(int k)
{
    const dqw_sim_row *r = &rows[k];
    return dqw_sample_from_dq((float)r->v_d_V, (float)r->v_q_V, (float)r->i_d_A, (float)r->i_q_A, (float)r->w_m_rad_s,
                              (float)r->theta_e_rad);
}

static dqw_monitor_config config_of(void)
{
    const dqw_sim_machine m = dqw_sim_scenario_find("fault_phase_connection")->machine;
    const dqw_nameplate plate = {1e-4f, 320.0f, 12.0f, 320.0f, (uint16_t)m.pole_pairs};
    dqw_monitor_config c = dqw_monitor_config_default(&plate);
    c.estimator.half_window = HALF;
    c.estimator.R_ohm = (float)m.R_ohm;
    c.estimator.Ld_H = (float)m.Ld_H;
    c.estimator.Lq_H = (float)m.Lq_H;
    c.estimator.psi_Wb = (float)m.psi_Wb;
    c.J_kgm2 = (float)m.J_kgm2;
    return c;
}

static dqw_monitor held;
static int at_row;
static int samples;  // that come in one interrupt

static void interrupt(void)
{
    for (int k = 0; k < samples; k++) {
        const dqw_sample s = sample(at_row + k);
        (void)dqw_monitor_sample(&held, &s, false);
    }
}
static void background(void) { (void)dqw_monitor_background(&held); }

// A monitor just before the background takes the half that ends at about this row.
static void begin(dqw_monitor *m, const dqw_monitor_config *c, int until)
{
    memset(m, 0, sizeof *m);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_monitor_init(m, c));
    at_row = 0;
    while (at_row < until || !m->estimator.window.over.pending) {
        (void)dqw_monitor_background(m);
        const dqw_sample s = sample(at_row);
        (void)dqw_monitor_sample(m, &s, false);
        at_row++;
    }
}

static dqw_monitor expected;
static bool equal(void) { return memcmp(&held, &expected, sizeof held) == 0; }

// Stage 2, the blocks around it, and in service: looks, an event being named, healthy values taken anew.
static void test_samples_may_interrupt_the_background_anywhere(void)
{
#if PREEMPT_HERE
    make_log();
    const dqw_monitor_config c = config_of();
    static dqw_monitor start;
    // Every instruction where it may take a minute; else one in so many.
    const long stride = getenv("DQW_FULL") != NULL ? 1 : 41;
    static const int until[] = {HALF, 600, 1000, 8000, 16000, 20000, 24500, 30000};
    long places = 0;
    for (unsigned k = 0; k < sizeof until / sizeof until[0]; k++) {
        begin(&start, &c, until[k]);
        // What a slow background sees come: less than half a window.
        for (samples = 1; samples < HALF; samples += HALF - 2) {
            CASE("row %d, %d samples", at_row, samples);
            memcpy(&held, &start, sizeof held);
            background(), interrupt();
            memcpy(&expected, &held, sizeof held);
            memcpy(&held, &start, sizeof held);
            const long instructions = preempt_everywhere(stride, &held, sizeof held, background, interrupt, equal);
            places += instructions / stride;
            HOLDS(instructions > 100);
        }
    }
    TEST_ASSERT_TRUE(places > 100);
    if (stride == 1) printf("%ld places\n", places);
#else
    TEST_IGNORE_MESSAGE("no single step here");
#endif
}

// A background that takes longer than half a window loses the next half, says so, and nothing else.
static void test_a_background_that_takes_too_long_loses_halves_alone(void)
{
    make_log();
    const dqw_monitor_config c = config_of();
    dqw_monitor m;
    begin(&m, &c, 12000);
    const uint32_t number = m.estimator.handed.number;
    samples = HALF;
    memcpy(&held, &m, sizeof held);
    interrupt();
    TEST_ASSERT_EQUAL_UINT8(m.estimator.missed + 1, held.estimator.missed);
    TEST_ASSERT_EQUAL_UINT32(number, held.estimator.handed.number);
    (void)dqw_monitor_background(&m);
    (void)dqw_monitor_background(&held);
    TEST_ASSERT_EQUAL_MEMORY(m.estimator.w_pu, held.estimator.w_pu, sizeof m.estimator.w_pu);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_samples_may_interrupt_the_background_anywhere);
    RUN_TEST(test_a_background_that_takes_too_long_loses_halves_alone);
    return UNITY_END();
}
