// A rotor that is held, currents noisier than dead time's step is wide: no mean over angles stands for the one angle
// that it has, and what dead time's input lags must not be taken for an inductance. Both arithmetics.
#include "bench/either_monitor.h"
#include "bench/joint.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

#define WIDTH_A 0.15
#define NOISE_A 0.2

// The servo under a load that changes, injected voltages small; sensor noise of its own is added below.
static dqw_sim_scenario held(void)
{
    dqw_sim_scenario s = *dqw_sim_scenario_find("servo_ideal");
    s.noise = (dqw_sim_noise){.seed = 0};
    s.duration_s = 10;
    s.rtol = 1e-6;
    s.nonideal.dead_time_V.value = 4;
    s.nonideal.dead_time_width_A = WIDTH_A;
    s.machine.coulomb_Nm = 0.1;
    s.machine.coulomb_width_rad_s = 1;
    s.profile.load_Nm = (dqw_sim_signal){.value = 0.6, .random = 1.5, .random_hold_s = 0.2};
    s.profile.speed_rad_s = (dqw_sim_signal){.value = 0};
    s.profile.i_d_A.random = 0;
    s.profile.v_d_V.binary = s.profile.v_q_V.binary = 2;
    return s;
}

static void test_an_inductance_at_one_angle(void)
{
    const dqw_sim_scenario s = held();
    const joint_log log = joint_run(&s);
    dqw_monitor_config c = {.estimator = servo_in_service(&s, WIDTH_A)};
    for (int q15 = 0; q15 < 2; q15++) {
        static either_monitor m;
        TEST_ASSERT_EQUAL_INT(DQW_OK, either_init(&m, &c, q15 == 1));
        test_random r = {77};
        int events = 0;
        for (size_t k = 0; k < log.count; k++) {
            dqw_sample x = joint_sample(&log.row[k]);
            x.i_d_A += (float)(NOISE_A / 2 * random_normal(&r));
            x.i_q_A += (float)(NOISE_A * random_normal(&r));
            x.v_d_V += (float)(0.5 * random_normal(&r));
            x.v_q_V += (float)(2.5 * random_normal(&r));
            x.w_m_rad_s += (float)(5 * random_normal(&r));
            dqw_monitor_change e;
            if (either_step(&m, &c, &x, &e)) events++;
        }
        const dqw_reading L = either_read(&m, DQW_LQ);
        const double off = (double)L.value / s.machine.Lq_H - 1;
        CASE("q15 %d: L_q off by %.4f, deviation %.4f", q15, off, (double)L.sd / s.machine.Lq_H);
        if (getenv("DQW_TEST_VALUES") != NULL) printf("%s\n", test_case);
        HOLDS(events == 0);
        BETWEEN(-0.02, off, 0.02);  // +0.022 without the lead
        BETWEEN(0.002, (double)L.sd / s.machine.Lq_H, 0.03);
    }
    free(log.row);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_an_inductance_at_one_angle);
    return UNITY_END();
}
