// The log as a vendor's tool writes it, against the drive's own rows of the same run.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dqw_sim.h"
#include "sim_log.h"
#include "unity.h"

enum { PERIOD = 8 };  // of the drive's rows

static dqw_sim_scenario s;
static dqw_sim_row *drive, *rows, *other;
static size_t drive_count;

// .6 s of 0.1 ms at 1250 Hz: 749 polls. Noise on every row, so that no two means are alike.
void setUp(void)
{
    drive = rows = other = NULL;
    s = *dqw_sim_scenario_find("servo_ideal");
    s.duration_s = .6, s.noise = (dqw_sim_noise){.i = 0.05, .v = 0.05, .w = 0.02, .temp = 0.02, .torque = 0.05};
    s.machine.winding_heat_J_K = s.machine.magnet_heat_J_K = 50;
    drive = simulate(&s);
    drive_count = count;
    s.polled.rate_Hz = 1e4 / PERIOD;
}
void tearDown(void) { free(drive), free(rows), free(other); }

// Four deviations of a binomial count, both ways.
static void expect_share(double share, size_t found, size_t of)
{
    const double n = (double)of;
    TEST_ASSERT_DOUBLE_WITHIN(4 * sqrt(n * share * (1 - share)), n * share, (double)found);
}

static size_t instant_of(const dqw_sim_row *row)
{
    const size_t k = (size_t)floor(row->t_s / s.drive.dt_s + 0.5);
    TEST_ASSERT_TRUE(k >= PERIOD && k < drive_count);
    TEST_ASSERT_EQUAL_DOUBLE(drive[k].t_s, row->t_s);
    return k;
}

static double mean_of(size_t column, size_t instant)
{
    long double sum = 0;
    for (size_t k = 1; k <= PERIOD; ++k) sum += ((const double *)(const void *)&drive[instant - k])[column];
    return (double)(sum / PERIOD);
}

static void expect_instant(const dqw_sim_row *at, const dqw_sim_row *row)
{
    TEST_ASSERT_EQUAL_DOUBLE(at->w_m_rad_s, row->w_m_rad_s);
    TEST_ASSERT_EQUAL_DOUBLE(at->theta_e_rad, row->theta_e_rad);
    TEST_ASSERT_EQUAL_DOUBLE(at->theta_m_rad, row->theta_m_rad);
    TEST_ASSERT_EQUAL_DOUBLE(at->temp_winding_C, row->temp_winding_C);
    TEST_ASSERT_EQUAL_DOUBLE(at->temp_magnet_C, row->temp_magnet_C);
    TEST_ASSERT_EQUAL_DOUBLE(at->torque_Nm, row->torque_Nm);
}

static bool same_means(const dqw_sim_row *a, const dqw_sim_row *b)
{
    return memcmp(&a->v_d_V, &b->v_d_V, 4 * sizeof(double)) == 0;
}

static bool is_zero(const dqw_sim_row *row)
{
    return row->v_d_V == 0 && row->v_q_V == 0 && row->i_d_A == 0 && row->i_q_A == 0 && row->v_dc_V == 0;
}

// A row that is lost takes its own interval with it: the next one's means begin at the lost poll.
static void test_means_are_of_the_interval_before_the_instant_also_behind_a_lost_row(void)
{
    s.polled.lost_fraction = 0.1;
    rows = simulate(&s);
    const size_t polls = (drive_count - 1) / PERIOD;
    TEST_ASSERT_EQUAL_size_t(749, polls);
    expect_share(0.1, polls - count, polls);
    size_t behind_a_gap = 0;
    for (size_t k = 0; k < count; ++k) {
        const size_t at = instant_of(&rows[k]);
        TEST_ASSERT_EQUAL_size_t(0, at % PERIOD);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, mean_of(1, at), rows[k].v_d_V);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, mean_of(2, at), rows[k].v_q_V);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, mean_of(3, at), rows[k].i_d_A);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, mean_of(4, at), rows[k].i_q_A);
        TEST_ASSERT_EQUAL_DOUBLE(s.drive.v_dc_V, rows[k].v_dc_V);
        expect_instant(&drive[at], &rows[k]);
        behind_a_gap += k > 0 && at != instant_of(&rows[k - 1]) + PERIOD;
    }
    // Losses are drawn one by one: runs of n lost rows leave fewer gaps than rows lost, by a tenth.
    expect_share(0.9, behind_a_gap, polls - count);
}

// Rounded to whole rows: 8.33 rows are 8.
static void test_the_period_is_whole_rows(void)
{
    rows = simulate(&s);
    s.polled.rate_Hz = 1200;
    other = simulate(&s);
    TEST_ASSERT_EQUAL_size_t(749, count);
    TEST_ASSERT_EQUAL_MEMORY(rows, other, count * sizeof *rows);
    s.polled.rate_Hz = 2;
    TEST_ASSERT_EQUAL_size_t(1, dqw_sim_rows(&s));
    s.polled.rate_Hz = 5000;
    TEST_ASSERT_EQUAL_size_t(2999, dqw_sim_rows(&s));
}

// In rows that arrive: a lost one shifts nothing.
static void test_a_queue_begins_with_zero_rows_and_is_late_by_as_many(void)
{
    s.polled.lost_fraction = 0.1;
    rows = simulate(&s);
    const size_t before = count;
    s.polled.queue_rows = 6;
    other = simulate(&s);
    TEST_ASSERT_EQUAL_size_t(before, count);
    for (size_t k = 0; k < count; ++k) {
        TEST_ASSERT_EQUAL_DOUBLE(rows[k].t_s, other[k].t_s);
        expect_instant(&rows[k], &other[k]);
        TEST_ASSERT_EQUAL(k < 6, is_zero(&other[k]));
        if (k < 6) continue;
        TEST_ASSERT_TRUE(same_means(&rows[k - 6], &other[k]));
        TEST_ASSERT_EQUAL_DOUBLE(rows[k - 6].v_dc_V, other[k].v_dc_V);
    }
    free(other);
    s.polled.queue_rows = 1000000;
    other = simulate(&s);
    for (size_t k = 0; k < count; ++k) TEST_ASSERT_TRUE(is_zero(&other[k]));
}

static void test_repeated_rows_have_the_means_of_the_row_before(void)
{
    rows = simulate(&s);
    s.polled.repeated_fraction = 0.3;
    other = simulate(&s);
    size_t repeated = 0;
    for (size_t k = 0; k < count; ++k) {
        const bool again = k > 0 && same_means(&other[k], &other[k - 1]);
        repeated += again;
        TEST_ASSERT_TRUE(again != same_means(&other[k], &rows[k]));
        TEST_ASSERT_EQUAL_DOUBLE(rows[k].t_s, other[k].t_s);
        TEST_ASSERT_EQUAL_DOUBLE(rows[k].v_dc_V, other[k].v_dc_V);
        expect_instant(&rows[k], &other[k]);
    }
    expect_share(0.3, repeated, count - 1);
    // As many zero rows as the queue is long, and no more.
    free(other);
    s.polled.queue_rows = 6, s.polled.repeated_fraction = 0.9;
    for (s.noise.seed = 0; s.noise.seed < 5; ++s.noise.seed) {
        other = simulate(&s);
        for (size_t k = 0; k < 12; ++k) {
            TEST_ASSERT_EQUAL(k < 6, other[k].i_q_A == 0 && other[k].v_q_V == 0);
            TEST_ASSERT_EQUAL(k < 6, other[k].v_dc_V == 0);
        }
        free(other);
    }
    other = NULL;
}

// 749 draws: their deviation is known to 2.6 %. Four of its own.
static void expect_white(double sd, const double *draws)
{
    double mean = 0, square = 0, next = 0;
    const double n = (double)count;
    for (size_t k = 0; k < count; ++k) {
        mean += draws[k] / n, square += draws[k] * draws[k] / n;
        if (k > 0) next += draws[k] * draws[k - 1] / n;
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.105 * sd, sd, sqrt(square));
    TEST_ASSERT_DOUBLE_WITHIN(4 * sd / sqrt(n), 0, mean);
    TEST_ASSERT_DOUBLE_WITHIN(4 / sqrt(n), 0, next / square);
}

static void test_stamps_and_speed_have_the_stated_noise_and_nothing_else_has(void)
{
    static double late[749], off[749];
    rows = simulate(&s);
    TEST_ASSERT_EQUAL_size_t(749, count);
    // A tenth of the period: no two change places.
    s.polled.jitter_s = 8e-5, s.polled.speed_noise_rad_s = 0.4;
    other = simulate(&s);
    double together = 0;
    for (size_t k = 0; k < count; ++k) {
        late[k] = other[k].t_s - rows[k].t_s, off[k] = other[k].w_m_rad_s - rows[k].w_m_rad_s;
        together += late[k] * off[k] / (8e-5 * 0.4 * (double)count);
        other[k].t_s = rows[k].t_s, other[k].w_m_rad_s = rows[k].w_m_rad_s;
    }
    TEST_ASSERT_EQUAL_MEMORY(rows, other, count * sizeof *rows);
    expect_white(8e-5, late);
    expect_white(0.4, off);
    TEST_ASSERT_DOUBLE_WITHIN(4 / sqrt((double)count), 0, together);
}

static void test_stamps_never_run_backwards(void)
{
    s.polled.jitter_s = 1 / s.polled.rate_Hz;
    rows = simulate(&s);
    size_t held = 0;
    for (size_t k = 1; k < count; ++k) {
        TEST_ASSERT_TRUE(rows[k].t_s > rows[k - 1].t_s);
        held += rows[k].t_s < rows[k - 1].t_s + 2e-6;
    }
    TEST_ASSERT_TRUE(held > count / 10);
}

static void expect_on_grid(double raw, double x, double step)
{
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0, x / step - floor(x / step + 0.5));
    TEST_ASSERT_DOUBLE_WITHIN(0.5 * step * (1 + 1e-9), raw, x);
}

static void test_values_go_in_steps_of_the_wire(void)
{
    rows = simulate(&s);
    s.polled.step_i_A = 0.01, s.polled.step_v_V = 0.02, s.polled.step_erpm = 10, s.polled.step_v_dc_V = 3;
    other = simulate(&s);
    const double erpm = 10 * 6.283185307179586 / 60 / s.machine.pole_pairs;
    for (size_t k = 0; k < count; ++k) {
        expect_on_grid(rows[k].i_d_A, other[k].i_d_A, 0.01);
        expect_on_grid(rows[k].i_q_A, other[k].i_q_A, 0.01);
        expect_on_grid(rows[k].v_d_V, other[k].v_d_V, 0.02);
        expect_on_grid(rows[k].v_q_V, other[k].v_q_V, 0.02);
        expect_on_grid(rows[k].w_m_rad_s, other[k].w_m_rad_s, erpm);
        TEST_ASSERT_EQUAL_DOUBLE(321, other[k].v_dc_V);
        TEST_ASSERT_EQUAL_DOUBLE(rows[k].torque_Nm, other[k].torque_Nm);
    }
}

// Draws go by both seeds, and leave those of the sensors alone.
static void test_the_same_scenario_gives_the_same_rows(void)
{
    s.noise = (dqw_sim_noise){.seed = 0};
    s.polled.lost_fraction = 0.1, s.polled.jitter_s = 1e-4;
    rows = simulate(&s);
    const size_t before = count;
    other = simulate(&s);
    TEST_ASSERT_EQUAL_size_t(before, count);
    TEST_ASSERT_EQUAL_MEMORY(rows, other, count * sizeof *rows);
    free(other);
    s.noise.seed = 1;
    other = simulate(&s);
    TEST_ASSERT_TRUE(fabs(other[0].t_s - rows[0].t_s) > 1e-7);
    free(other);
    s.noise.seed = 0, s.seed += 1;
    other = simulate(&s);
    TEST_ASSERT_TRUE(fabs(other[0].t_s - rows[0].t_s) > 1e-7);
}

static void expect_refused(const char *field)
{
    dqw_sim_report report;
    const dqw_sim_polled healthy = {.rate_Hz = 1e4 / PERIOD};
    rows = calloc(drive_count, sizeof *rows);
    TEST_ASSERT_EQUAL_INT_MESSAGE(DQW_SIM_ERR_SCENARIO, dqw_sim_run(&s, rows, drive_count, &report, NULL, NULL), field);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(report.message, field), report.message);
    TEST_ASSERT_EQUAL_size_t(0, dqw_sim_rows(&s));
    free(rows), rows = NULL;
    s.polled = healthy, s.drive.log_every = 0;
    TEST_ASSERT_EQUAL_size_t(749, dqw_sim_rows(&s));
}

static void test_what_cannot_be_polled_is_refused_by_name(void)
{
    s.polled.rate_Hz = -1, expect_refused("polled.rate_Hz");
    s.polled.rate_Hz = NAN, expect_refused("polled.rate_Hz");
    s.polled.rate_Hz = 5001, expect_refused("polled.rate_Hz");
    s.polled.rate_Hz = 0.5, expect_refused("polled.rate_Hz");
    s.polled.rate_Hz = 1 / 0.6, expect_refused("polled.rate_Hz");
    s.polled.rate_Hz = 1e-300, expect_refused("polled.rate_Hz");
    s.polled.queue_rows = -1, expect_refused("polled.queue_rows");
    s.polled.jitter_s = -1e-3, expect_refused("polled.jitter_s");
    s.polled.lost_fraction = 1, expect_refused("polled.lost_fraction");
    s.polled.lost_fraction = -0.1, expect_refused("polled.lost_fraction");
    s.polled.repeated_fraction = 1, expect_refused("polled.repeated_fraction");
    s.polled.speed_noise_rad_s = -1, expect_refused("polled.speed_noise_rad_s");
    s.polled.step_i_A = -0.01, expect_refused("polled.step_i_A");
    s.polled.step_v_V = -0.01, expect_refused("polled.step_v_V");
    s.polled.step_erpm = -1, expect_refused("polled.step_erpm");
    s.polled.step_v_dc_V = -0.1, expect_refused("polled.step_v_dc_V");
    s.drive.log_every = 2, expect_refused("drive.log_every");
    s.polled.rate_Hz = 10, s.polled.lost_fraction = 0.999999, expect_refused("all are lost");
    // Of room for one row too few nothing is written.
    dqw_sim_row none = {.t_s = -1};
    TEST_ASSERT_EQUAL_INT(DQW_SIM_ERR_CAPACITY, dqw_sim_run(&s, &none, 748, NULL, NULL, NULL));
    TEST_ASSERT_EQUAL_DOUBLE(-1, none.t_s);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_means_are_of_the_interval_before_the_instant_also_behind_a_lost_row);
    RUN_TEST(test_the_period_is_whole_rows);
    RUN_TEST(test_a_queue_begins_with_zero_rows_and_is_late_by_as_many);
    RUN_TEST(test_repeated_rows_have_the_means_of_the_row_before);
    RUN_TEST(test_stamps_and_speed_have_the_stated_noise_and_nothing_else_has);
    RUN_TEST(test_stamps_never_run_backwards);
    RUN_TEST(test_values_go_in_steps_of_the_wire);
    RUN_TEST(test_the_same_scenario_gives_the_same_rows);
    RUN_TEST(test_what_cannot_be_polled_is_refused_by_name);
    return UNITY_END();
}
