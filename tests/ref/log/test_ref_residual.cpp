// The reported residual against a plain reading of its definition.
// Plain only: long, and what it runs others run under the sanitizers.
#include <cstdio>

#include "ref/log/residual.hpp"
#include "ref/machine.hpp"
#include "unity.h"

extern "C" void setUp(void) {}
extern "C" void tearDown(void) {}

using machine::Plant;
using machine::Run;

namespace {

dqw::PlainModel wrong_model()
{
    dqw::PlainModel model;
    model.pole_pairs = 4, model.R_ohm = 0.7, model.Ld_H = 0.8e-3, model.Lq_H = 1.5e-3, model.psi_Wb = 0.021;
    return model;
}

/// v minus the model's v over blocks of n rows, means of the currents by the trapezoidal rule.
void naive(const dqw::Log& log, const dqw::PlainModel& m, std::size_t n, double& rms_d, double& rms_q)
{
    double dd = 0.0, qq = 0.0, blocks = 0.0;
    for (std::size_t s = 0; s < log.segments.size(); ++s) {
        const std::size_t end = s + 1 < log.segments.size() ? log.segments[s + 1] : log.rows();
        for (std::size_t k = log.segments[s]; k + n < end; k += n) {
            double d = 0.0, q = 0.0;
            for (std::size_t r = k; r < k + n; ++r) {
                d += log.v_d_V[r], q += log.v_q_V[r];
                for (std::size_t e : {r, r + 1}) {
                    const double w = m.pole_pairs * log.w_m_rad_s[e];
                    d -= 0.5 * (m.R_ohm * log.i_d_A[e] - w * m.Lq_H * log.i_q_A[e]);
                    q -= 0.5 * (m.R_ohm * log.i_q_A[e] + w * (m.Ld_H * log.i_d_A[e] + m.psi_Wb));
                }
            }
            const double rows = static_cast<double>(n), span_s = rows * log.dt_s;
            d = d / rows - m.Ld_H * (log.i_d_A[k + n] - log.i_d_A[k]) / span_s;
            q = q / rows - m.Lq_H * (log.i_q_A[k + n] - log.i_q_A[k]) / span_s;
            dd += d * d, qq += q * q, blocks += 1.0;
        }
    }
    rms_d = std::sqrt(dd / blocks), rms_q = std::sqrt(qq / blocks);
}

double rms(const std::vector<double>& x)
{
    double sum = 0.0;
    for (double v : x) sum += v * v;
    return std::sqrt(sum / static_cast<double>(x.size()));
}

/// Slow enough that the voltage hardly turns within a period. 10 kHz: 20 rows; 50 kHz: 1 ms, 50 rows.
void dynamic_blocks(void)
{
    for (double dt_s : {1e-4, 2e-5}) {
        Run run;
        run.rows = 4021, run.dt_s = dt_s, run.substeps = 4;
        run.speed_rad_s = [](double t) { return 10 + 5 * std::sin(9 * t); };
        dqw::Log log = machine::simulate({}, run);
        log.segments = {0, 1010, 2500};
        dqw::Result result;
        dqw::report_residual({log}, wrong_model(), result);
        double d = 0.0, q = 0.0;
        naive(log, wrong_model(), dt_s > 5e-5 ? 20 : 50, d, q);
        TEST_ASSERT_EQUAL_STRING("V", result.residual_unit.c_str());
        TEST_ASSERT_EQUAL_STRING("d", result.axes[0].axis.c_str());
        TEST_ASSERT_EQUAL_STRING("q", result.axes[1].axis.c_str());
        TEST_ASSERT_DOUBLE_WITHIN(1e-3 * d, d, result.axes[0].rms);
        TEST_ASSERT_DOUBLE_WITHIN(1e-3 * q, q, result.axes[1].rms);
        TEST_ASSERT_DOUBLE_WITHIN(1e-3 * d, std::sqrt(0.5 * (d * d + q * q)), result.residual_rms);
        TEST_ASSERT_DOUBLE_WITHIN(0.05 * result.axes[1].percent, 100 * q / rms(log.v_q_V), result.axes[1].percent);
    }
}

/// The right model leaves next to nothing even where the rotor turns by 0.27 rad in a period.
void fast_machine_leaves_nothing(void)
{
    Run run;
    run.rows = 4000, run.v_d_V = run.v_q_V = 1.0, run.substeps = 20;
    run.speed_rad_s = [](double) { return 130.0; };
    const Plant m{0.1, 50e-6, 70e-6, 0.004, 21};
    const dqw::Log log = machine::simulate(m, run);
    dqw::PlainModel model;
    model.pole_pairs = m.p, model.R_ohm = m.R_ohm, model.Ld_H = m.Ld_H, model.Lq_H = m.Lq_H, model.psi_Wb = m.psi_Wb;
    dqw::Result result;
    dqw::report_residual({log}, model, result);
    std::printf("d %.3f %%, q %.3f %% of the voltage\n", result.axes[0].percent, result.axes[1].percent);
    TEST_ASSERT_TRUE(result.axes[0].percent < 0.5);
    TEST_ASSERT_TRUE(result.axes[1].percent < 0.05);
}

void unknown_terms_count_as_zero(void)
{
    Run run;
    run.rows = 500, run.substeps = 2;
    const dqw::Log log = machine::simulate({}, run);
    dqw::PlainModel model;
    model.pole_pairs = 4;
    model.R_ohm = model.Ld_H = model.Lq_H = model.psi_Wb = std::nan("");
    dqw::Result result;
    dqw::report_residual({log}, model, result);
    double sum = 0.0;
    for (std::size_t k = 0; k + 20 < 500; k += 20) {
        double mean = 0.0;
        for (std::size_t r = k; r < k + 20; ++r) mean += log.v_q_V[r] / 20.0;
        sum += mean * mean;
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, std::sqrt(sum / 24.0), result.axes[1].rms);
}

void rows_of_settled_points(void)
{
    dqw::Log log;
    log.regime = dqw::Regime::steady;
    log.i_d_A = {1, -2}, log.i_q_A = {3, 4}, log.w_m_rad_s = {100, 200}, log.v_d_V = {-0.1, -0.2}, log.v_q_V = {9, 20};
    dqw::Result result;
    const dqw::PlainModel m = wrong_model();
    dqw::report_residual({log}, m, result);
    double d = 0.0, q = 0.0;
    for (std::size_t k = 0; k < 2; ++k) {
        const double w = 4 * log.w_m_rad_s[k];
        d += std::pow(log.v_d_V[k] - 0.7 * log.i_d_A[k] + w * 1.5e-3 * log.i_q_A[k], 2);
        q += std::pow(log.v_q_V[k] - 0.7 * log.i_q_A[k] - w * (0.8e-3 * log.i_d_A[k] + 0.021), 2);
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, std::sqrt(d / 2), result.axes[0].rms);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, std::sqrt(q / 2), result.axes[1].rms);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, std::sqrt((d + q) / 4), result.residual_rms);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 100 * std::sqrt(q / 2) / rms(log.v_q_V), result.axes[1].percent);
    // At standstill the speed column, if any, is not used.
    log.regime = dqw::Regime::standstill;
    dqw::report_residual({log}, m, result);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, std::sqrt((std::pow(-0.1 - 0.7, 2) + std::pow(-0.2 + 1.4, 2)) / 2),
                              result.axes[0].rms);
    log.v_d_V.clear(), log.i_d_A.clear();
    dqw::report_residual({log}, m, result);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, result.axes[0].rms);
}

void mechanical_blocks(void)
{
    dqw::Log log;
    log.regime = dqw::Regime::mechanical;
    log.dt_s = 1e-3;
    for (int k = 0; k < 501; ++k) {
        const double t = 1e-3 * k;
        log.t_s.push_back(t);
        log.w_m_rad_s.push_back(100 * t * t);
        log.torque_Nm.push_back(0.01 + 0.02 * t);
    }
    dqw::PlainModel m;
    m.J_kgm2 = 1e-4, m.B_Nms_rad = 2e-4;
    dqw::Result result;
    dqw::report_residual({log}, m, result);
    double sum = 0.0;
    for (int b = 0; b < 10; ++b) {
        const double t0 = 0.05 * b, t1 = t0 + 0.05, mid = 0.5 * (t0 + t1);
        const double mean_w = 100 * (t1 * t1 * t1 - t0 * t0 * t0) / 3 / 0.05;
        sum += std::pow(0.01 + 0.02 * mid - 1e-4 * 200 * mid - 2e-4 * mean_w, 2);
    }
    TEST_ASSERT_EQUAL_size_t(1, result.axes.size());
    TEST_ASSERT_EQUAL_STRING("Nm", result.residual_unit.c_str());
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, std::sqrt(sum / 10), result.residual_rms);
}

void source_of_the_torque(void)
{
    dqw::Log log;
    log.i_q_A = {1, 2}, log.torque_cmd_Nm = {5, 6}, log.torque_Nm = {7, 8};
    std::string source;
    TEST_ASSERT_EQUAL_DOUBLE(7.0, dqw::torque_of(log, 0.1, source)[0]);
    TEST_ASSERT_EQUAL_STRING("torque_Nm", source.c_str());
    log.torque_Nm.clear();
    TEST_ASSERT_EQUAL_DOUBLE(0.2, dqw::torque_of(log, 0.1, source)[1]);
    TEST_ASSERT_EQUAL_DOUBLE(6.0, dqw::torque_of(log, 0.0, source)[1]);
    TEST_ASSERT_EQUAL_STRING("torque_cmd_Nm", source.c_str());
    log.torque_cmd_Nm.clear();
    TEST_ASSERT_TRUE(dqw::torque_of(log, std::nan(""), source).empty());
}

}  // namespace

int main()
{
    UNITY_BEGIN();
    RUN_TEST(dynamic_blocks);
    RUN_TEST(fast_machine_leaves_nothing);
    RUN_TEST(unknown_terms_count_as_zero);
    RUN_TEST(rows_of_settled_points);
    RUN_TEST(mechanical_blocks);
    RUN_TEST(source_of_the_torque);
    return UNITY_END();
}
