// Torque against motion: each law against its closed form, or against Runge-Kutta on one-sided friction.
#include <math.h>
#include <stdlib.h>

#include "dqw_sim.h"
#include "unity.h"

static dqw_sim_row *rows;
static size_t count;

void setUp(void) { rows = NULL; }
void tearDown(void) { free(rows); }

// A free rotor whose magnet is next to nothing, so that currents drive it nowhere.
static dqw_sim_scenario rotor(double speed_rad_s, double load_Nm)
{
    dqw_sim_scenario s = *dqw_sim_scenario_find("servo_ideal");
    s.profile = (dqw_sim_profile){
        .control = DQW_SIM_CONTROL_CURRENT, .speed_start_rad_s = speed_rad_s, .load_Nm = {.value = load_Nm}};
    s.drive.hold = DQW_SIM_HOLD_DQ;
    s.machine.psi_Wb = 1e-6, s.machine.coulomb_width_rad_s = 0.5;
    s.duration_s = 0.3, s.rtol = 1e-10;
    return s;
}

static void simulate(const dqw_sim_scenario *s)
{
    dqw_sim_report report;
    count = dqw_sim_rows(s);
    rows = calloc(count ? count : 1, sizeof *rows);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, dqw_sim_run(s, rows, count, &report, NULL, NULL), report.message);
}

// Friction with its own value each way, and its peak near rest.
static double slope(double w, double load)
{
    const double forth = 0.2 + 0.05, back = 0.2 - 0.05, peak = 0.15 * exp(-w * w / 36);
    const double dry = (w > 0 ? forth + peak : back + peak) * (1 - 2 / (exp(2 * w / 0.5) + 1));
    return (-1e-3 * w - dry - load) / 2e-3;
}

static void test_dry_friction_by_direction_and_near_rest(void)
{
    dqw_sim_scenario s = rotor(30, 0.5);
    s.machine.coulomb_Nm = 0.2;
    s.nonideal.friction_asymmetry_Nm.value = 0.05;
    s.nonideal.stribeck_Nm.value = 0.15, s.nonideal.stribeck_width_rad_s = 6;
    simulate(&s);
    double w = 30;
    for (size_t k = 0; k < count; ++k) {
        TEST_ASSERT_DOUBLE_WITHIN(2e-4, w, rows[k].w_m_rad_s);
        for (int n = 0; n < 20; ++n) {
            const double h = 5e-6, k1 = slope(w, 0.5), k2 = slope(w + 0.5 * h * k1, 0.5),
                         k3 = slope(w + 0.5 * h * k2, 0.5), k4 = slope(w + h * k3, 0.5);
            w += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
        }
    }
    TEST_ASSERT_TRUE(rows[0].w_m_rad_s == 30 && rows[count - 1].w_m_rad_s < -10);
}

// No friction, no load: kinetic energy and the cogging's potential, (T / n)(cos phase - cos(n theta + phase)), trade
// places.
static void test_cogging_has_a_potential(void)
{
    dqw_sim_scenario s = rotor(8, 0);
    s.machine.B_Nms_rad = 0;
    s.nonideal.cogging_Nm.value = 0.1, s.nonideal.cogging_order = 12, s.nonideal.cogging_phase_rad = 0.7;
    simulate(&s);
    double slow = 99, fast = 0;
    for (size_t k = 0; k < count; ++k) {
        const double work = 0.1 / 12 * (cos(0.7) - cos(12 * rows[k].theta_m_rad + 0.7));
        TEST_ASSERT_DOUBLE_WITHIN(1e-5, sqrt(64 + 2 * work / 2e-3), rows[k].w_m_rad_s);
        slow = fmin(slow, rows[k].w_m_rad_s), fast = fmax(fast, rows[k].w_m_rad_s);
    }
    TEST_ASSERT_TRUE(fast - slow > 0.5);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_dry_friction_by_direction_and_near_rest);
    RUN_TEST(test_cogging_has_a_potential);
    return UNITY_END();
}
