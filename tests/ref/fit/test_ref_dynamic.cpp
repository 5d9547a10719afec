// The dynamic fit on logs without noise, against an independent integrator.
// Plain only: long, and what it runs others run under the sanitizers.
#include <chrono>
#include <cstdio>
#include <stdexcept>

#include "ref/fit/fit.hpp"
#include "ref/machine.hpp"
#include "unity.h"

extern "C" void setUp(void) {}
extern "C" void tearDown(void) {}

using machine::Plant;
using machine::Run;
using machine::sd;
using machine::value;

namespace {

const char* const kNames[] = {"R_ohm", "Ld_H", "Lq_H", "psi_Wb"};

/// Largest relative error of the four parameters.
double worst_error(const dqw::Result& result, const Plant& m)
{
    const double truth[] = {m.R_ohm, m.Ld_H, m.Lq_H, m.psi_Wb};
    double worst = 0.0;
    for (int j = 0; j < 4; ++j) {
        const double error = std::abs(value(result, kNames[j]) / truth[j] - 1.0);
        worst = error <= worst ? worst : error;
    }
    return worst;
}

void check(const Plant& m, Run run, double bound)
{
    dqw::Log log = machine::simulate(m, run);
    const dqw::Result free = dqw::fit({log});
    TEST_ASSERT_EQUAL_DOUBLE(m.p, value(free, "pole_pairs"));
    TEST_ASSERT_TRUE(sd(free, "pole_pairs") > 0.0);
    TEST_ASSERT_TRUE(worst_error(free, m) < bound);
    log.machine.pole_pairs = m.p;
    const dqw::Result given = dqw::fit({log});
    TEST_ASSERT_TRUE(worst_error(given, m) < bound);
    TEST_ASSERT_EQUAL_DOUBLE(m.p, value(given, "pole_pairs"));
    TEST_ASSERT_TRUE(given.not_identifiable.empty());
    TEST_ASSERT_EQUAL_size_t(run.rows, given.rows);
    std::printf("noise-free, p %g: worst error %.2e\n", m.p, worst_error(given, m));
}

Run robot_run()
{
    Run run;
    run.v_d_V = run.v_q_V = 1.0;
    run.speed_rad_s = [](double t) { return 60 + 60 * std::sin(5 * t) + 20 * std::sin(31 * t); };
    return run;
}

void standard_machine(void) { check({}, {}, 2e-5); }

/// w_e dt up to 0.29, R dt / L up to 0.2.
void robot_joint(void) { check({0.1, 50e-6, 70e-6, 0.004, 21}, robot_run(), 2e-5); }

void isotropic_machine_both_ways(void)
{
    Run run;
    run.speed_rad_s = [](double t) { return 90 * std::sin(4 * t); };
    check({0.37, 0.326e-3, 0.326e-3, 0.02, 4}, run, 2e-5);
}

void nominal_values_do_not_matter(void)
{
    Run run;
    run.rows = 5000, run.substeps = 10;
    dqw::Log log = machine::simulate({}, run);
    machine::add_noise(log.i_d_A, 0.05, 3);
    machine::add_noise(log.i_q_A, 0.05, 4);
    log.machine.pole_pairs = 4;
    const dqw::Result bare = dqw::fit({log});
    for (double factor : {0.7, 1.3}) {
        log.machine.R_ohm = 0.5 * factor, log.machine.Ld_H = 1.0e-3 / factor, log.machine.Lq_H = 1.4e-3 * factor;
        log.machine.psi_Wb = 0.02 / factor;
        const dqw::Result result = dqw::fit({log});
        for (const char* name : kNames) {
            TEST_ASSERT_DOUBLE_WITHIN(1e-9 * value(bare, name), value(bare, name), value(result, name));
            TEST_ASSERT_DOUBLE_WITHIN(1e-6 * sd(bare, name), sd(bare, name), sd(result, name));
        }
    }
}

void gaps_restart_the_simulation(void)
{
    Run run;
    run.rows = 8000, run.substeps = 20;
    const Plant m;
    const dqw::Log whole = machine::simulate(m, run);
    dqw::Log log = whole;
    const auto cut = [](std::vector<double>& x) { x.erase(x.begin() + 2000, x.begin() + 3500); };
    for (auto* column : {&log.t_s, &log.v_d_V, &log.v_q_V, &log.i_d_A, &log.i_q_A, &log.w_m_rad_s}) cut(*column);
    log.segments = {0, 2000};
    log.machine.pole_pairs = 4;
    const dqw::Result result = dqw::fit({log});
    TEST_ASSERT_TRUE(worst_error(result, m) < 2e-5);
    bool noted = false;
    for (const std::string& note : result.notes) noted = noted || note.find("gap") != std::string::npos;
    TEST_ASSERT_TRUE(noted);
}

void periods_may_differ(void)
{
    const Plant m;
    Run slow, fast, uneven;
    slow.rows = fast.rows = uneven.rows = 4000;
    fast.dt_s = 0.5e-4, fast.seed = 2;
    uneven.uneven = 0.4;
    slow.substeps = fast.substeps = uneven.substeps = 20;
    dqw::Log printed = machine::simulate(m, slow);
    for (double& t : printed.t_s) t = std::round(t * 1e5 + 0.3) * 1e-5 + 1e-6 * std::sin(1e6 * t);
    for (const auto& logs : {std::vector<dqw::Log>{machine::simulate(m, slow), machine::simulate(m, fast)},
                             std::vector<dqw::Log>{machine::simulate(m, uneven)}, std::vector<dqw::Log>{printed}}) {
        std::vector<dqw::Log> known = logs;
        for (dqw::Log& log : known) log.machine.pole_pairs = m.p;
        const double error = worst_error(dqw::fit(known), m);
        std::printf("periods: worst error %.2e\n", error);
        TEST_ASSERT_TRUE(error < 2e-5);
    }
}

void two_logs_beat_each(void)
{
    const Plant m;
    std::vector<dqw::Log> logs;
    for (unsigned seed : {1u, 2u}) {
        Run run;
        run.rows = 8000, run.seed = seed, run.substeps = 10;
        logs.push_back(machine::simulate(m, run));
        machine::add_noise(logs.back().i_d_A, 0.05, 10 + seed);
        machine::add_noise(logs.back().i_q_A, 0.05, 20 + seed);
        logs.back().machine.pole_pairs = 4;
    }
    const dqw::Result both = dqw::fit(logs), first = dqw::fit({logs[0]}), second = dqw::fit({logs[1]});
    TEST_ASSERT_EQUAL_size_t(16000, both.rows);
    for (const char* name : kNames) {
        const double alone = std::min(sd(first, name), sd(second, name));
        // What an inverter may hide in R hangs on chance.
        TEST_ASSERT_TRUE(sd(both, name) < (std::string(name) == "R_ohm" ? 1.3 : 0.85) * alone);
        TEST_ASSERT_TRUE(sd(both, name) > 0.55 * alone);
    }
}

/// Stretches too short to simulate are left out, and counted.
void short_stretches_are_counted(void)
{
    Run run;
    run.rows = 500, run.substeps = 2;
    dqw::Log log = machine::simulate({}, run);
    log.machine.pole_pairs = 4;
    log.segments = {0, 300, 307};
    const dqw::Result result = dqw::fit({log});
    bool noted = false;
    for (const std::string& note : result.notes) noted = noted || note.find("7 rows left out") == 0;
    TEST_ASSERT_TRUE(noted);
}

/// A missing effect must come out as residual, with wide standard deviations, and not make the fit worse than need be.
void missing_dead_time(void)
{
    Plant m;
    m.dead_time_V = 1.0;
    Run run;
    run.substeps = 10;
    dqw::Log log = machine::simulate(m, run);
    log.machine.pole_pairs = 4;
    const dqw::Result result = dqw::fit({log});
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 1.28, value(result, "R_ohm"));
    TEST_ASSERT_DOUBLE_WITHIN(0.1e-3, 0.97e-3, value(result, "Ld_H"));
    TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.42, result.residual_rms);
    TEST_ASSERT_TRUE(sd(result, "R_ohm") > 0.01);
}

/// Every tenth row of a log, its currents behind a filter of the stator's, with the angle.
dqw::Log filtered(const Plant& m, const Run& fine, double time_constant_s)
{
    constexpr std::size_t kEvery = 10;
    const dqw::Log all = machine::simulate(m, fine);
    dqw::Log log;
    log.path = all.path, log.dt_s = kEvery * all.dt_s, log.machine.pole_pairs = m.p;
    machine::Complex seen, last;
    double theta = 0.0, v_d_V = 0.0, v_q_V = 0.0;
    const double h = all.dt_s, part = time_constant_s > 0.0 ? std::exp(-h / time_constant_s) : 0.0;
    for (std::size_t k = 0; k < all.rows(); ++k) {
        const machine::Complex now = machine::Complex(all.i_d_A[k], all.i_q_A[k]) * machine::turned(theta);
        // Exact where the current goes straight from one to the next.
        const double ramp = time_constant_s / h * (1.0 - part);
        seen = k == 0 || part == 0.0 ? now : part * seen + (ramp - part) * last + (1.0 - ramp) * now;
        last = now;
        if (k % kEvery == 0) {
            const machine::Complex i = seen * machine::turned(-theta);
            log.t_s.push_back(all.t_s[k]), log.i_d_A.push_back(i.real()), log.i_q_A.push_back(i.imag());
            log.w_m_rad_s.push_back(all.w_m_rad_s[k]), log.theta_e_rad.push_back(std::remainder(theta, 2 * M_PI));
            v_d_V = v_q_V = 0.0;
        }
        v_d_V += all.v_d_V[k] / kEvery, v_q_V += all.v_q_V[k] / kEvery;
        if (k % kEvery == kEvery - 1) log.v_d_V.push_back(v_d_V), log.v_q_V.push_back(v_q_V);
        const double t = all.t_s[k];
        theta += m.p * h / 6.0 * (fine.speed_rad_s(t) + 4.0 * fine.speed_rad_s(t + 0.5 * h) + fine.speed_rad_s(t + h));
    }
    return log;
}

/// A filter makes L of what is R times its time constant, and looks like a fit that holds: it is in the deviations.
void filtered_currents(void)
{
    const Plant m{0.5, 0.25e-3, 0.35e-3, 0.02, 4};
    Run fine;
    fine.dt_s = 1e-5, fine.rows = 200000, fine.hold = 370, fine.substeps = 6;
    for (double time_constant_s : {0.0, 2e-5, 1e-4}) {
        dqw::Log log = filtered(m, fine, time_constant_s);
        machine::add_noise(log.i_d_A, 0.003, 3), machine::add_noise(log.i_q_A, 0.003, 4);
        const dqw::Result result = dqw::fit({log});
        const double off = value(result, "Lq_H") / m.Lq_H - 1.0, wide = sd(result, "Lq_H") / m.Lq_H;
        std::printf("time constant %g us: L_q %+.4f +- %.4f\n", 1e6 * time_constant_s, off, wide);
        bool noted = false;
        for (const std::string& note : result.notes)
            noted = noted || note.find("filtered by a time") != std::string::npos;
        TEST_ASSERT_TRUE(noted == (time_constant_s > 0.0));
        if (time_constant_s == 0.0) {
            TEST_ASSERT_TRUE(std::abs(off) < 3 * wide && wide < 2e-3);
            continue;
        }
        TEST_ASSERT_TRUE(off > 0.01 && off < 2 * wide && wide < 3 * off + 0.05);
    }
}

void wrong_input_throws(void)
{
    Run run;
    run.rows = 99, run.substeps = 2;
    const dqw::Log shorter = machine::simulate({}, run);
    run.rows = 200;
    const dqw::Log good = machine::simulate({}, run);
    dqw::Log no_speed = good, backward = good, steady = good, other = good;
    no_speed.w_m_rad_s.clear();
    backward.t_s[50] = backward.t_s[49];
    steady.regime = dqw::Regime::steady;
    other.machine.pole_pairs = 5;
    dqw::Log first = good;
    first.machine.pole_pairs = 4;
    const std::vector<std::vector<dqw::Log>> wrong{{},         {shorter},      {no_speed},
                                                   {backward}, {good, steady}, {first, other}};
    for (const auto& logs : wrong) {
        bool thrown = false;
        try {
            dqw::fit(logs);
        } catch (const std::invalid_argument& e) {
            thrown = std::string(e.what()).find('\n') == std::string::npos;
        }
        TEST_ASSERT_TRUE(thrown);
    }
    dqw::FitOptions unknown;
    unknown.parameters = {"L_H"};
    bool thrown = false;
    try {
        dqw::fit({first}, unknown);
    } catch (const std::invalid_argument&) {
        thrown = true;
    }
    TEST_ASSERT_TRUE(thrown);
}

void only_what_is_asked_for(void)
{
    Run run;
    run.rows = 2000, run.substeps = 10;
    dqw::Log log = machine::simulate({}, run);
    log.machine.pole_pairs = 4;
    dqw::FitOptions options;
    options.parameters = {"psi_Wb", "J_kgm2"};
    double last = 0.0;
    bool rising = true;
    options.progress = [&](double p) { rising = rising && p >= last && p <= 1.0, last = p; };
    const dqw::Result result = dqw::fit({log}, options);
    TEST_ASSERT_FALSE(machine::has(result, "R_ohm"));
    TEST_ASSERT_DOUBLE_WITHIN(2e-7, 0.02, value(result, "psi_Wb"));
    TEST_ASSERT_NOT_NULL(machine::missing(result, "J_kgm2"));
    TEST_ASSERT_TRUE(rising);
    TEST_ASSERT_EQUAL_DOUBLE(1.0, last);
}

void a_long_log(void)
{
    Run run;
    run.rows = 100000;
    run.substeps = 2;
    dqw::Log log = machine::simulate({}, run);
    machine::add_noise(log.i_d_A, 0.2, 1);
    machine::add_noise(log.i_q_A, 0.2, 2);
    const auto start = std::chrono::steady_clock::now();
    const dqw::Result result = dqw::fit({log});
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
    std::printf("%zu rows, pole pairs estimated: %.2f s\n", run.rows, took.count());
    TEST_ASSERT_TRUE(worst_error(result, {}) < 0.02);
}

}  // namespace

int main()
{
    std::setvbuf(stdout, nullptr, _IONBF, 0);
    UNITY_BEGIN();
    RUN_TEST(standard_machine);
    RUN_TEST(robot_joint);
    RUN_TEST(isotropic_machine_both_ways);
    RUN_TEST(nominal_values_do_not_matter);
    RUN_TEST(gaps_restart_the_simulation);
    RUN_TEST(periods_may_differ);
    RUN_TEST(two_logs_beat_each);
    RUN_TEST(short_stretches_are_counted);
    RUN_TEST(missing_dead_time);
    RUN_TEST(filtered_currents);
    RUN_TEST(wrong_input_throws);
    RUN_TEST(only_what_is_asked_for);
    RUN_TEST(a_long_log);
    return UNITY_END();
}
