// A current loop answers its sensors' noise, and nothing else moves i_d: what noise takes from L_d is then the loop's
// answer as much as the machine's, and the deviations of L_d and of the flux say so (E188). Both arithmetics.
#include "bench/either_monitor.h"
#include "bench/joint.h"
#include "dqw_test.h"

void setUp(void) { test_case[0] = 0; }
void tearDown(void) {}

static dqw_sim_scenario answering(double bandwidth_rad_s)
{
    dqw_sim_scenario s = *dqw_sim_scenario_find("servo_ideal");
    s.seed = 60525;
    s.duration_s = 6;
    s.rtol = 1e-6;
    s.sensing.noise_A = 0.1;
    s.drive.current_bandwidth_rad_s = bandwidth_rad_s;
    s.profile.v_d_V.binary = s.profile.v_q_V.binary = 0;
    s.profile.i_d_A = (dqw_sim_signal){.value = -1};
    return s;
}

static void test_an_answered_noise_is_in_the_deviation(void)
{
    static const double bandwidths_rad_s[] = {1500, 3000};
    for (int n = 0; n < 2; n++) {
        const dqw_sim_scenario s = answering(bandwidths_rad_s[n]);
        const joint_log log = joint_run(&s);
        dqw_monitor_config c = {.estimator = servo_in_service(&s, 0)};
        for (int q15 = 0; q15 < 2; q15++) {
            static either_monitor m;
            TEST_ASSERT_EQUAL_INT(DQW_OK, either_init(&m, &c, q15 == 1));
            for (size_t k = 0; k < log.count; k++) {
                const dqw_sample x = joint_sample(&log.row[k]);
                dqw_monitor_change e;
                (void)either_step(&m, &c, &x, &e);
            }
            const double truth[] = {s.machine.Ld_H, s.machine.Lq_H, s.machine.psi_Wb};
            static const enum dqw_parameter which[] = {DQW_LD, DQW_LQ, DQW_PSI};
            for (int k = 0; k < 3; k++) {
                const dqw_reading r = either_read(&m, which[k]);
                const double off = (double)r.value / truth[k] - 1;
                CASE("q15 %d, %g rad/s, parameter %d: off by %.4f, deviation %.4f", q15, bandwidths_rad_s[n],
                     (int)which[k], off, (double)r.sd / truth[k]);
                if (getenv("DQW_TEST_VALUES") != NULL) printf("%s\n", test_case);
                HOLDS(fabs(off) < 3 * (double)r.sd / truth[k] || fabs(off) < 0.001);
            }
            // What i_q's steps teach is not wider for it.
            HOLDS((double)either_read(&m, DQW_LQ).sd < 0.002 * s.machine.Lq_H);
            HOLDS((double)either_read(&m, DQW_LD).sd < 0.3 * s.machine.Ld_H);
            HOLDS(either_read(&m, DQW_LD).usable == (n == 0));
        }
        free(log.row);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_an_answered_noise_is_in_the_deviation);
    return UNITY_END();
}
