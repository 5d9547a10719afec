// What the tracer takes for noise, against what the true machine leaves of the simulator's own log.
#include <algorithm>
#include <cmath>
#include <complex>
#include <random>

#include "ref/log/residual.hpp"
#include "ref/search/solve.hpp"
#include "ref/trace/noise.hpp"
#include "ref/trace/trace.hpp"
#include "simulated.hpp"
#include "unity.h"

extern "C" void setUp(void) {}
extern "C" void tearDown(void) {}

namespace {

using dqw::Log;
using dqw::Noise;

struct Judged {
    Noise noise;
    double left = 0.0;  ///< block RMS of the true machine
};

template <class Change> Judged judged(const std::vector<std::string>& settings, Change change)
{
    std::vector<Log> logs{simulated("servo", settings, Beside::nothing)};
    change(logs[0]);
    const auto setup = dqw::trace_setup(logs, {});
    dqw::Point at = setup->starts.front();
    at.base = Eigen::Vector4d(0.9, 2.2e-3, 2.8e-3, 0.12);
    dqw::PlainModel truth;
    truth.pole_pairs = setup->pole_pairs;
    truth.R_ohm = 0.9, truth.Ld_H = 2.2e-3, truth.Lq_H = 2.8e-3, truth.psi_Wb = 0.12;
    dqw::Result result;
    dqw::report_residual(logs, truth, result);
    return {dqw::noise_of(*setup, at), result.residual_rms};
}

/// Blocks asked for alone are those of the whole report, to the last digit: a late voltage looks back over six rows,
/// and threads share the rows.
void some_blocks_are_those_of_all()
{
    std::vector<Log> logs{simulated("servo", {"duration_s=1"}, Beside::nothing)};
    const auto setup = dqw::trace_setup(logs, {});
    dqw::Point at = setup->starts.front();
    at.base = Eigen::Vector4d(0.9, 2.2e-3, 2.8e-3, 0.12);
    dqw::Input late{dqw::Law::delay};
    at.terms.push_back({late, {5.5}});
    const std::vector<dqw::ReportBlock> all = setup->full->report(at, 0);
    for (const std::size_t apart : {std::size_t{1}, std::size_t{2}, std::size_t{7}}) {
        const std::size_t n = all[0].end - all[0].begin;
        const std::vector<dqw::ReportBlock> some = setup->full->report_some(
            at, [&](const Log&, std::size_t begin, std::size_t) { return begin / n % apart == 0; });
        TEST_ASSERT_EQUAL_UINT64((all.size() + apart - 1) / apart, some.size());
        for (std::size_t k = 0; k < some.size(); ++k) {
            TEST_ASSERT_EQUAL_UINT64(all[k * apart].begin, some[k].begin);
            TEST_ASSERT_EQUAL_MEMORY(all[k * apart].residual, some[k].residual, sizeof some[k].residual);
            TEST_ASSERT_EQUAL_MEMORY(all[k * apart].measured, some[k].measured, sizeof some[k].measured);
        }
    }
    std::size_t k = 0;
    setup->full->report_each({at, at}, 0, [&](const std::vector<dqw::ReportBlock>& b) {
        for (const dqw::ReportBlock& of : b) TEST_ASSERT_EQUAL_MEMORY(all[k].residual, of.residual, sizeof of.residual);
        ++k;
    });
    TEST_ASSERT_EQUAL_UINT64(all.size(), k);
}

void unchanged(Log&) {}

/// Of every channel alone: the floor is what the true machine leaves, and nothing is foretold.
void white_noise_is_noise()
{
    for (const char* noise : {"noise=0.01", "noise=0.03"}) {
        const Judged j = judged({"duration_s=1", noise}, unchanged);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.12, 1.0, j.left / j.noise.floor, noise);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.005, 0.0, j.noise.followed, noise);
        TEST_ASSERT_EQUAL_STRING("", dqw::doubt_of(j.noise, j.left).c_str());
    }
}

/// Means over five rows: what is noise of a row stands in five.
void filtered_currents_are_told()
{
    const Judged j = judged({"duration_s=1"}, [](Log& l) {
        for (auto* i : {&l.i_d_A, &l.i_q_A}) {
            const std::vector<double> raw = *i;
            for (std::size_t k = 4; k < raw.size(); ++k)
                (*i)[k] = 0.2 * (raw[k] + raw[k - 1] + raw[k - 2] + raw[k - 3] + raw[k - 4]);
        }
    });
    TEST_ASSERT_TRUE_MESSAGE(j.noise.followed > 0.2 && j.noise.followed < 1.0,
                             std::to_string(j.noise.followed).c_str());
    TEST_ASSERT_TRUE(j.noise.floor < j.noise.raw);
}

/// Settled points of a machine in white noise, currents and speed drawn.
Log few_points(unsigned seed, const Eigen::Vector4d& machine, double noise_V, int points = 15)
{
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> part(-1.0, 1.0);
    Log log;
    log.path = "few points", log.regime = dqw::Regime::steady, log.machine.pole_pairs = 4;
    for (int k = 0; k < points; ++k) {
        const double w = 100.0 + 80.0 * part(random), i_d = 8.0 * part(random), i_q = 8.0 * part(random);
        log.w_m_rad_s.push_back(w), log.i_d_A.push_back(i_d), log.i_q_A.push_back(i_q);
        log.v_d_V.push_back(machine[0] * i_d - 4.0 * w * machine[2] * i_q + noise_V * normal(random));
        log.v_q_V.push_back(machine[0] * i_q + 4.0 * w * (machine[1] * i_d + machine[3]) + noise_V * normal(random));
    }
    return log;
}

/// Four parameters of eight points seen: what these leave is less than the noise, what the others leave is more.
void few_points_have_noise_of_their_own()
{
    constexpr unsigned kLogs = 400;
    constexpr double kNoise_V = 0.3;
    const Eigen::Vector4d machine(0.9, 2.2e-3, 2.8e-3, 0.12);
    double z2 = 0.0, held2 = 0.0, unseen = 0.0, rows = 0.0;
    for (unsigned seed = 1; seed <= kLogs; ++seed) {
        const std::vector<Log> logs{few_points(seed, machine, kNoise_V)};
        const auto setup = dqw::trace_setup(logs, {});
        const dqw::Refined r = dqw::refine(*setup->full, setup->starts.front(), 12);
        TEST_ASSERT_TRUE(r.ok);
        const Eigen::VectorXd sd = dqw::spreads_of(*setup->full, r).white.diagonal().cwiseSqrt();
        z2 += (r.point.base - machine).cwiseQuotient(sd).squaredNorm() / 4.0 / kLogs;
        const Noise noise = dqw::noise_of(*setup, r.point);
        unseen += std::pow(noise.floor / noise.raw, 2) / kLogs;
        for (const dqw::FineBlock& b : setup->full->plan().blocks)
            if (b.heldout) {
                const dqw::ReportBlock left = setup->full->report(r.point, 0)[b.begin];
                for (const double residual : left.residual) held2 += residual * residual, ++rows;
            }
    }
    // z of twelve free values has ν/(ν − 2) = 1.2; with the squares as they are left it would be 1.6.
    TEST_ASSERT_DOUBLE_WITHIN(0.15, 1.2, z2);
    TEST_ASSERT_DOUBLE_WITHIN(0.08 * unseen, unseen, held2 / rows / (kNoise_V * kNoise_V));
    TEST_ASSERT_TRUE(unseen > 1.2);
}

/// Of one axis at rest, where the other has neither current nor voltage: R by five points of nine.
void one_axis_has_noise_of_its_own()
{
    constexpr unsigned kLogs = 2000;
    constexpr int kPoints = 9;
    double held2 = 0.0, unseen = 0.0, rows = 0.0;
    std::mt19937 random(1);
    std::normal_distribution<double> noise_V(0.0, 0.3);
    std::uniform_real_distribution<double> current_A(-8.0, 8.0);
    for (unsigned n = 0; n < kLogs; ++n) {
        Log log;
        log.path = "one axis", log.regime = dqw::Regime::standstill, log.machine.pole_pairs = 4;
        for (int k = 0; k < kPoints; ++k) {
            log.i_d_A.push_back(current_A(random)), log.v_d_V.push_back(0.9 * log.i_d_A.back() + noise_V(random));
            for (auto* none : {&log.i_q_A, &log.v_q_V, &log.w_m_rad_s}) none->push_back(0.0);
        }
        const std::vector<Log> logs{log};
        const auto setup = dqw::trace_setup(logs, {});
        const dqw::Refined r = dqw::refine(*setup->full, setup->starts.front(), 12);
        TEST_ASSERT_TRUE(r.ok);
        const Noise noise = dqw::noise_of(*setup, r.point);
        unseen += std::pow(noise.floor / noise.raw, 2) / kLogs;
        for (const dqw::FineBlock& b : setup->full->plan().blocks)
            if (b.heldout) held2 += std::pow(setup->full->report(r.point, 0)[b.begin].residual[0], 2), ++rows;
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.06 * unseen, unseen, held2 / rows / (0.3 * 0.3));
    TEST_ASSERT_TRUE(unseen > 1.2);
}

void doubts_stand_at_their_edges()
{
    // Of settled rows the fit's part of the floor is no reason for a doubt.
    TEST_ASSERT_EQUAL_STRING("", dqw::doubt_of({1.4, 1.0, 0.0}, 0.51).c_str());
    TEST_ASSERT_TRUE(dqw::doubt_of({1.4, 1.0, 0.0}, 0.49).find("0.49 of what") != std::string::npos);
    TEST_ASSERT_EQUAL_STRING("", dqw::doubt_of({1.0, 1.0, 0.0}, 0.51).c_str());
    TEST_ASSERT_TRUE(dqw::doubt_of({1.0, 1.0, 0.0}, 0.49).find("0.49 of what") != std::string::npos);
    TEST_ASSERT_EQUAL_STRING("", dqw::doubt_of({1.0, 1.0, 0.06}, 0.78).c_str());
    TEST_ASSERT_TRUE(dqw::doubt_of({1.0, 1.0, 0.06}, 0.76).find("0.76 of what") != std::string::npos);
    TEST_ASSERT_EQUAL_STRING("", dqw::doubt_of({1.0, 1.0, 0.24}, 1.0).c_str());
    TEST_ASSERT_TRUE(dqw::doubt_of({1.0, 1.0, 0.26}, 1.0).find("26 %") != std::string::npos);
    TEST_ASSERT_TRUE(dqw::doubt_of({0.5, 1.0, 0.1}, 1.0).find("10 %") != std::string::npos);
    TEST_ASSERT_EQUAL_STRING("", dqw::doubt_of({0.5, 1.0, 0.1}, 1.4).c_str());
}

/// Four parameters and iron's bend of five weights take up all eight values that four of eight points have: nothing is
/// left, however noisy they are. Of sixteen something is.
void a_fit_that_leaves_nothing_tells_no_deviation()
{
    for (const int points : {8, 16}) {
        const std::vector<Log> logs{few_points(1, {0.5, 1e-3, 1.5e-3, 0.05}, 0.3, points)};
        const auto setup = dqw::trace_setup(logs, {});
        dqw::Point at = setup->starts.front();
        for (const dqw::Candidate& c : setup->candidates)
            if (c.inputs.front().law == dqw::Law::saturation && at.terms.empty())
                at.terms.push_back({c.inputs.front(), {}});
        TEST_ASSERT_EQUAL_size_t(1, at.terms.size());
        const dqw::Refined r = dqw::refine(*setup->full, at, 12);
        TEST_ASSERT_TRUE(r.ok);
        const double sd_ohm = dqw::deviations(*setup->full, r)[0];
        TEST_ASSERT_EQUAL(points == 16, std::isfinite(sd_ohm) && sd_ohm > 0.0);
    }
}

/// At one speed and with one L a voltage that acts late looks like an angle that is off, and R is another, by w_e^2 L
/// times the time: whichever is named, R's deviation holds what the other says.
void what_looks_alike_stands_in_the_deviations()
{
    constexpr double kR_ohm = 0.25, kL_H = 0.7e-3, kPsi_Wb = 0.016, kLate_s = 14e-6, kSpeed = 314.0;
    std::mt19937 random(3);
    std::normal_distribution<double> noise(0.0, 2e-3);
    Log log;
    log.path = "one speed", log.regime = dqw::Regime::steady, log.machine.pole_pairs = 4;
    for (int d = 0; d < 7; ++d)
        for (int q = 0; q < 7; ++q) {
            const std::complex<double> i(-d, q), flux = kPsi_Wb + kL_H * i;
            const double w_e = 4 * kSpeed;
            const auto v = (kR_ohm * i + std::complex<double>(0.0, w_e) * flux) * std::polar(1.0, w_e * kLate_s);
            log.v_d_V.push_back(v.real() + noise(random)), log.v_q_V.push_back(v.imag() + noise(random));
            log.i_d_A.push_back(i.real()), log.i_q_A.push_back(i.imag()), log.w_m_rad_s.push_back(kSpeed);
        }
    const dqw::TraceResult r = dqw::trace({log});
    TEST_ASSERT_EQUAL_size_t(1, r.effects.size());
    const auto& alike = r.effects[0].confusable_with;
    const auto is = [&](const char* name) {
        return r.effects[0].name == name || std::find(alike.begin(), alike.end(), name) != alike.end();
    };
    TEST_ASSERT_TRUE(is("delay") && is("angle_offset"));
    const auto R = std::find_if(r.after.parameters.begin(), r.after.parameters.end(),
                                [](const dqw::Estimate& e) { return e.name == "R_ohm"; });
    TEST_ASSERT_TRUE(R != r.after.parameters.end());
    const double made = 16 * kSpeed * kSpeed * kLate_s * kL_H;
    TEST_ASSERT_TRUE_MESSAGE(R->sd > 0.5 * made && R->sd < 2.5 * made, std::to_string(R->sd).c_str());
    TEST_ASSERT_DOUBLE_WITHIN(2.0 * R->sd, kR_ohm, R->value);
}

}  // namespace

int main()
{
    UNITY_BEGIN();
    RUN_TEST(some_blocks_are_those_of_all);
    RUN_TEST(white_noise_is_noise);
    RUN_TEST(filtered_currents_are_told);
    RUN_TEST(few_points_have_noise_of_their_own);
    RUN_TEST(one_axis_has_noise_of_its_own);
    RUN_TEST(doubts_stand_at_their_edges);
    RUN_TEST(a_fit_that_leaves_nothing_tells_no_deviation);
    RUN_TEST(what_looks_alike_stands_in_the_deviations);
    return UNITY_END();
}
