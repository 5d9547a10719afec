// What a dynamic log cannot tell must be said, not printed as a number.
// Plain only: long, and what it runs others run under the sanitizers.
#include <cstdio>

#include "ref/fit/fit.hpp"
#include "ref/machine.hpp"
#include "unity.h"

extern "C" void setUp(void) {}
extern "C" void tearDown(void) {}

using machine::missing;
using machine::Plant;
using machine::Run;
using machine::value;

namespace {

void listed(const dqw::Result& result, const char* name)
{
    TEST_ASSERT_NOT_NULL_MESSAGE(missing(result, name), name);
    TEST_ASSERT_FALSE_MESSAGE(machine::has(result, name), name);
    TEST_ASSERT_FALSE(missing(result, name)->why.empty());
    TEST_ASSERT_FALSE(missing(result, name)->excitation.empty());
}

/// Constant currents at a constant speed, and the voltages that hold them.
dqw::Log settled(const Plant& m, double i_d, double i_q, double w_m, std::size_t rows)
{
    dqw::Log log;
    log.path = "settled.csv";
    log.dt_s = 1e-4;
    const double w = m.p * w_m;
    for (std::size_t k = 0; k < rows; ++k) {
        log.t_s.push_back(1e-4 * static_cast<double>(k));
        log.i_d_A.push_back(i_d), log.i_q_A.push_back(i_q), log.w_m_rad_s.push_back(w_m);
        log.v_d_V.push_back(m.R_ohm * i_d - w * m.Lq_H * i_q);
        log.v_q_V.push_back(m.R_ohm * i_q + w * (m.Ld_H * i_d + m.psi_Wb));
    }
    return log;
}

void a_log_of_zeros(void)
{
    dqw::Log log = settled({}, 0, 0, 0, 2000);
    for (double p : {0.0, 4.0}) {
        if (p > 0.0) log.machine.pole_pairs = p;
        const dqw::Result result = dqw::fit({log});
        for (const char* name : {"R_ohm", "Ld_H", "Lq_H", "psi_Wb"}) listed(result, name);
        TEST_ASSERT_EQUAL_size_t(p > 0.0 ? 1 : 0, result.parameters.size());
    }
}

/// Open terminals: no current, and all of the voltage induced.
void no_current(void)
{
    dqw::Log log = settled({}, 0, 0, 100, 2000);
    log.machine.pole_pairs = 4;
    const dqw::Result result = dqw::fit({log});
    for (const char* name : {"R_ohm", "Ld_H", "Lq_H"}) listed(result, name);
}

/// Constant currents at a constant speed: two voltages cannot tell four parameters, with noise or without.
void settled_at_one_point(void)
{
    for (unsigned seed = 0; seed < 6u; ++seed) {
        dqw::Log log = settled({}, -2, 5, 20, 5000);
        std::mt19937_64 random(seed);
        std::normal_distribution<double> draw(0.0, 0.05);
        if (seed > 0)
            for (std::size_t k = 0; k < log.rows(); ++k) log.i_d_A[k] += draw(random), log.i_q_A[k] += draw(random);
        log.machine.pole_pairs = 4;
        const dqw::Result result = dqw::fit({log});
        for (const char* name : {"R_ohm", "Ld_H", "Lq_H", "psi_Wb"}) listed(result, name);
    }
}

/// Locked rotor with voltage steps: R and both L, and no flux linkage.
void standstill_dynamics(void)
{
    Run run;
    run.rows = 5000, run.speed_rad_s = [](double) { return 0.0; };
    dqw::Log log = machine::simulate({}, run);
    for (double p : {0.0, 4.0}) {
        if (p > 0.0) log.machine.pole_pairs = p;
        const dqw::Result result = dqw::fit({log});
        TEST_ASSERT_DOUBLE_WITHIN(1e-5, 0.5, value(result, "R_ohm"));
        TEST_ASSERT_DOUBLE_WITHIN(1e-8, 1.0e-3, value(result, "Ld_H"));
        TEST_ASSERT_DOUBLE_WITHIN(1e-8, 1.4e-3, value(result, "Lq_H"));
        listed(result, "psi_Wb");
        TEST_ASSERT_TRUE(missing(result, "psi_Wb")->why.find("w_m is 0 rad/s") != std::string::npos);
    }
}

/// i_d held at zero by the voltage, noise on both sensors: L_d does nothing, the rest is as well determined as ever.
void no_d_current(void)
{
    const Plant m;
    // L_q di_q/dt = v_q - R i_q - w psi, and v_d = -w L_q i_q keeps i_d at zero: exact at rest, nearly so when slow.
    dqw::Log log;
    log.path = "no_d.csv";
    log.dt_s = 1e-4;
    std::mt19937_64 random(3);
    std::normal_distribution<double> noise(0.0, 0.05);
    std::uniform_real_distribution<double> draw(-3.0, 3.0);
    double i_q = 0.0, add = 0.0;
    for (std::size_t k = 0; k < 10000; ++k) {
        const double t = 1e-4 * static_cast<double>(k), w_m = 10 + 5 * std::sin(6 * t), w = m.p * w_m;
        if (k % 50 == 0) add = draw(random);
        const double decay = std::exp(-m.R_ohm / m.Lq_H * 1e-4), next = i_q * decay + (1 - decay) / m.R_ohm * add;
        log.t_s.push_back(t), log.w_m_rad_s.push_back(w_m);
        log.i_d_A.push_back(noise(random)), log.i_q_A.push_back(i_q + noise(random));
        log.v_d_V.push_back(-w * m.Lq_H * 0.5 * (i_q + next)), log.v_q_V.push_back(add + w * m.psi_Wb);
        i_q = next;
    }
    log.machine.pole_pairs = 4;
    const dqw::Result result = dqw::fit({log});
    listed(result, "Ld_H");
    TEST_ASSERT_DOUBLE_WITHIN(0.01, 0.5, value(result, "R_ohm"));
    TEST_ASSERT_DOUBLE_WITHIN(0.03e-3, 1.4e-3, value(result, "Lq_H"));
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.02, value(result, "psi_Wb"));
}

/// Slow turning and much noise: p psi is known, p is not, and then neither is psi.
void pole_pairs_in_doubt(void)
{
    Run run;
    run.rows = 3000, run.substeps = 10;
    run.speed_rad_s = [](double t) { return 1 + 0.5 * std::sin(9 * t); };
    dqw::Log log = machine::simulate({}, run);
    machine::add_noise(log.i_d_A, 0.2, 1);
    machine::add_noise(log.i_q_A, 0.2, 2);
    const dqw::Result result = dqw::fit({log});
    listed(result, "pole_pairs");
    listed(result, "psi_Wb");
    TEST_ASSERT_DOUBLE_WITHIN(4 * machine::sd(result, "R_ohm"), 0.5, value(result, "R_ohm"));
    TEST_ASSERT_DOUBLE_WITHIN(4 * machine::sd(result, "Ld_H"), 1e-3, value(result, "Ld_H"));
    log.machine.pole_pairs = 4;
    const dqw::Result given = dqw::fit({log});
    TEST_ASSERT_TRUE(given.not_identifiable.empty());
}

}  // namespace

int main()
{
    UNITY_BEGIN();
    RUN_TEST(a_log_of_zeros);
    RUN_TEST(no_current);
    RUN_TEST(settled_at_one_point);
    RUN_TEST(standstill_dynamics);
    RUN_TEST(no_d_current);
    RUN_TEST(pole_pairs_in_doubt);
    return UNITY_END();
}
