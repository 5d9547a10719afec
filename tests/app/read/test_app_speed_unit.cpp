// A speed in rpm is told by each kind of evidence, and a speed in rad/s never is.
// Plain only: long, and what it runs others run under the sanitizers.
#include <cmath>
#include <string>
#include <vector>

#include "app/read/speed_unit.hpp"
#include "command.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

static const double rpm = 30 / 3.14159265358979323846;
static const double turn = 2 * 3.14159265358979323846;

/// Columns of a probe, in rad/s; `evidence` multiplies the speed.
struct Columns {
    std::vector<double> values[dqw::column_count];
    dqw::Regime regime = dqw::Regime::dynamic;
    double dt_s = 0;

    bool looks_like_rpm(double factor, const dqw::Machine& machine, const char* names = "")
    {
        std::vector<double> w;
        for (const double x : values[dqw::col_w_m]) w.push_back(factor * x);
        dqw::SpeedProbe probe;
        for (std::size_t c = 0; c < dqw::column_count; ++c)
            if (!values[c].empty()) probe.column[c] = values[c].data();
        probe.column[dqw::col_w_m] = w.data();
        probe.rows = w.size();
        probe.median_dt_s = dt_s;
        probe.regime = regime;
        const auto evidence = dqw::evidence_of_rpm(probe, machine);
        if (evidence) TEST_ASSERT_TRUE_MESSAGE(evidence->find(names) != std::string::npos, evidence->c_str());
        return evidence.has_value();
    }
};

static Columns moving(double slowdown = 1)
{
    const command::Machine m;
    Columns c;
    c.dt_s = m.dt_s;
    double theta = 0;
    for (std::size_t k = 0; k < 4000; ++k) {
        auto r = m.row(k);
        r.w_m_rad_s /= slowdown;
        const double values[] = {static_cast<double>(k) * m.dt_s, r.v_d_V, r.v_q_V, r.i_d_A, r.i_q_A, r.w_m_rad_s};
        for (std::size_t i = 0; i < 6; ++i) c.values[i].push_back(values[i]);
        c.values[dqw::col_theta_m].push_back(std::fmod(theta, turn));
        c.values[dqw::col_theta_e].push_back(std::fmod(m.p * theta, turn));
        theta += r.w_m_rad_s * m.dt_s;
    }
    return c;
}

static Columns settled(bool torque)
{
    Columns c;
    c.regime = dqw::Regime::steady;
    for (int k = 0; k < 60; ++k) {
        const double w = 50 + 10 * (k % 6), d = -(k % 4), q = 2 + k % 5, p = 4, R = 0.5, Ld = 2e-3, Lq = 3e-3,
                     psi = 0.05;
        const double values[] = {0, R * d - p * w * Lq * q, R * q + p * w * (Ld * d + psi), d, q, w};
        for (std::size_t i = 1; i < 6; ++i) c.values[i].push_back(values[i]);
        if (torque) c.values[dqw::col_torque].push_back(1.5 * p * (psi + (Ld - Lq) * d) * q);
    }
    return c;
}

static dqw::Machine with(void (*fill)(dqw::Machine&))
{
    dqw::Machine machine;
    fill(machine);
    return machine;
}

static const dqw::Machine nothing, four = with([](dqw::Machine&m) { m.pole_pairs = 4; });

static void expect_told(Columns columns, const dqw::Machine& machine, const char* names)
{
    TEST_ASSERT_TRUE_MESSAGE(columns.looks_like_rpm(rpm, machine, names), names);
    TEST_ASSERT_FALSE_MESSAGE(columns.looks_like_rpm(1, machine), names);
}

static void by_the_rotor_angle(void)
{
    auto c = moving();
    c.values[dqw::col_theta_e].clear();
    expect_told(c, nothing, "theta_m_rad");
}

static void by_the_electrical_angle(void)
{
    auto c = moving();
    c.values[dqw::col_theta_m].clear();
    TEST_ASSERT_TRUE(c.looks_like_rpm(rpm, four, "theta_e_rad"));
    TEST_ASSERT_TRUE(c.looks_like_rpm(rpm, nothing, "theta_e_rad"));
    TEST_ASSERT_FALSE(c.looks_like_rpm(1, four));
    TEST_ASSERT_FALSE(c.looks_like_rpm(1, nothing));
}

static void not_by_an_angle_sampled_too_rarely(void)
{
    // 628.3 rad/s and 10 ms: one turn a row, and 6.2832 becomes 0 or any small drift.
    Columns c;
    c.dt_s = 0.01;
    for (int k = 0; k < 1000; ++k) {
        c.values[dqw::col_t].push_back(0.01 * k);
        c.values[dqw::col_w_m].push_back(628.3 + 70);
        c.values[dqw::col_theta_m].push_back(std::fmod(698.3 * 0.01 * k, turn));
    }
    c.regime = dqw::Regime::mechanical;
    TEST_ASSERT_FALSE(c.looks_like_rpm(1, nothing));
}

static void by_power(void)
{
    auto c = settled(true);
    TEST_ASSERT_TRUE(c.looks_like_rpm(rpm, nothing, "power"));
    TEST_ASSERT_FALSE(c.looks_like_rpm(1, nothing));
}

static void by_nominal_flux_torque_constant_or_inductance(void)
{
    const dqw::Machine machines[] = {
        with([](dqw::Machine& m) { m.pole_pairs = 4, m.psi_Wb = 0.05 * 1.3; }),
        with([](dqw::Machine& m) { m.pole_pairs = 4, m.psi_Wb = 0.05 * 0.7; }),
        with([](dqw::Machine& m) { m.torque_constant_Nm_A = 0.3; }),
        with([](dqw::Machine& m) { m.pole_pairs = 4, m.Lq_H = 3e-3; }),
    };
    for (const auto& machine : machines) {
        auto c = settled(false);
        TEST_ASSERT_TRUE(c.looks_like_rpm(rpm, machine, "machine file"));
        TEST_ASSERT_FALSE(c.looks_like_rpm(1, machine));
    }
}

static void by_pole_pairs_in_a_dynamic_log(void)
{
    auto c = moving();
    c.values[dqw::col_theta_m].clear();
    c.values[dqw::col_theta_e].clear();
    for (const auto& machine : {four, nothing}) {
        TEST_ASSERT_TRUE(c.looks_like_rpm(rpm, machine, "pole pairs"));
        TEST_ASSERT_FALSE(c.looks_like_rpm(1, machine));
    }
}

static void by_inertia(void)
{
    Columns c;
    c.regime = dqw::Regime::mechanical;
    c.dt_s = 1e-3;
    const double J = 1e-4, B = 2e-5;
    double w = 0;
    for (int k = 0; k < 4000; ++k) {
        const double torque = k / 500 % 2 ? 0.01 : 0.002;
        c.values[dqw::col_t].push_back(1e-3 * k);
        c.values[dqw::col_w_m].push_back(w);
        c.values[dqw::col_torque].push_back(torque);
        w += 1e-3 * (torque - B * w) / J;
    }
    const auto machine = with([](dqw::Machine& m) { m.J_kgm2 = 1.2e-4; });
    TEST_ASSERT_TRUE(c.looks_like_rpm(rpm, machine, "J comes out"));
    TEST_ASSERT_FALSE(c.looks_like_rpm(1, machine));
    TEST_ASSERT_FALSE(c.looks_like_rpm(1, nothing));
}

static void by_size_where_nothing_else_tells(void)
{
    auto c = settled(false);
    TEST_ASSERT_FALSE(c.looks_like_rpm(rpm, nothing));
    TEST_ASSERT_TRUE(c.looks_like_rpm(3 * rpm, nothing, "rpm"));
    // A machine file that agrees with a fast speed outweighs its size.
    for (auto& v : c.values[dqw::col_w_m]) v *= 30;
    for (int col : {dqw::col_v_d, dqw::col_v_q})
        for (std::size_t k = 0; k < 60; ++k)
            c.values[col][k] += 29 * (c.values[col][k] -
                                      0.5 * c.values[col == dqw::col_v_d ? dqw::col_i_d : dqw::col_i_q][k]);
    TEST_ASSERT_FALSE(c.looks_like_rpm(1, with([](dqw::Machine& m) { m.pole_pairs = 4, m.psi_Wb = 0.05; })));
    TEST_ASSERT_TRUE(c.looks_like_rpm(1, nothing, "reaches"));
}

static void never_at_standstill(void)
{
    auto c = settled(false);
    c.regime = dqw::Regime::standstill;
    TEST_ASSERT_FALSE(c.looks_like_rpm(100 * rpm, nothing));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(by_the_rotor_angle);
    RUN_TEST(by_the_electrical_angle);
    RUN_TEST(not_by_an_angle_sampled_too_rarely);
    RUN_TEST(by_power);
    RUN_TEST(by_nominal_flux_torque_constant_or_inductance);
    RUN_TEST(by_pole_pairs_in_a_dynamic_log);
    RUN_TEST(by_inertia);
    RUN_TEST(by_size_where_nothing_else_tells);
    RUN_TEST(never_at_standstill);
    return UNITY_END();
}
