// Inertia and friction of a polled log, against the shaft whose torque made its currents.
#include <cmath>
#include <cstdio>
#include <random>
#include <string>

#include "polled_drive.hpp"
#include "ref/fit/fit.hpp"
#include "unity.h"

extern "C" void setUp(void) {}
extern "C" void tearDown(void) {}

namespace {

const double J = 2e-4, B = 5e-4, C = 0.06, R = 0.3, L = 5e-4, psi = 0.015, p = 5;

struct State {
    double w, dw, i_d, di_d, i_q, di_q;
};

/// Speeds in closed form, currents by the shaft's equation.
State at(double t, double shift, double load_Nm)
{
    const double K = 1.5 * p * psi;
    State s{};
    double ddw = 0.0, load = 0.0, dload = 0.0;
    s.w = 60;
    for (const auto& [size, f] : {std::pair(30.0, 2.1), std::pair(14.0, 0.67)}) {
        s.w += size * std::sin(f * t + shift), s.dw += size * f * std::cos(f * t + shift);
        ddw -= size * f * f * std::sin(f * t + shift);
    }
    load = load_Nm * std::sin(1.3 * t), dload = load_Nm * 1.3 * std::cos(1.3 * t);
    s.i_q = (J * s.dw + B * s.w + C + load) / K, s.di_q = (J * ddw + B * s.dw + dload) / K;
    s.i_d = std::sin(1.13 * t + shift), s.di_d = 1.13 * std::cos(1.13 * t + shift);
    return s;
}

dqw::Log drawn(unsigned seed, double load_Nm, double noise_rad_s)
{
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    dqw::Log log;
    log.path = "drawn", log.regime = dqw::Regime::polled, log.machine.pole_pairs = p, log.dt_s = 0.05;
    double t = 0.0;
    for (int k = 0; k < 1200; ++k) {
        // Polls come late now and then.
        const double step = k % 50 == 7 ? 0.065 : 0.05;
        const int parts = 60;
        std::array<double, 4> mean{};
        for (int j = 0; j <= parts; ++j) {
            const double weight = (j == 0 || j == parts ? 1.0 : j % 2 == 1 ? 4.0 : 2.0) / (3.0 * parts);
            const State s = at(t + step * j / parts, seed, load_Nm);
            mean[0] += weight * (R * s.i_d + L * s.di_d - p * s.w * L * s.i_q);
            mean[1] += weight * (R * s.i_q + L * s.di_q + p * s.w * (L * s.i_d + psi));
            mean[2] += weight * s.i_d, mean[3] += weight * s.i_q;
        }
        t += step;
        log.t_s.push_back(t), log.v_d_V.push_back(mean[0]), log.v_q_V.push_back(mean[1]);
        log.i_d_A.push_back(mean[2]), log.i_q_A.push_back(mean[3]);
        log.w_m_rad_s.push_back(at(t, seed, load_Nm).w + noise_rad_s * normal(random));
    }
    return log;
}

const std::vector<std::string> kShaft{"J_kgm2", "B_Nms_rad"};

void no_load_gives_inertia_and_friction(void)
{
    int within = 0, all = 0;
    for (unsigned seed = 1; seed <= 8; ++seed) {
        const dqw::Result r = dqw::fit({drawn(seed, 0.0, 0.3)}, {kShaft, {}});
        double found[2] = {}, coulomb = 0.0, sd = 0.0;
        for (const dqw::Estimate& e : r.parameters)
            for (std::size_t j = 0; j < 2; ++j)
                if (e.name == kShaft[j]) {
                    found[j] = e.value, ++all;
                    within += std::abs(e.value - (j == 0 ? J : B)) < 2 * e.sd;
                    TEST_ASSERT_TRUE(e.sd > 1e-4 * e.value && e.sd < 0.1 * e.value);
                }
        for (const std::string& note : r.notes) std::sscanf(note.c_str(), "Coulomb friction %lf ± %lf", &coulomb, &sd);
        std::printf("J %.3g, B %.3g, Coulomb %.4g ± %.2g mNm\n", found[0], found[1], coulomb, sd);
        TEST_ASSERT_DOUBLE_WITHIN(0.03 * J, J, found[0]);
        TEST_ASSERT_DOUBLE_WITHIN(0.03 * B, B, found[1]);
        TEST_ASSERT_DOUBLE_WITHIN(0.03 * 1e3 * C, 1e3 * C, coulomb);
    }
    TEST_ASSERT_TRUE(within >= 0.8 * all);
}

/// The same machine the other way round.
dqw::Log backwards(dqw::Log log)
{
    for (auto* x : {&log.w_m_rad_s, &log.i_q_A, &log.v_q_V})
        for (double& v : *x) v = -v;
    return log;
}

std::string coulomb_of(const std::vector<dqw::Log>& logs)
{
    for (const std::string& note : dqw::fit(logs, {kShaft, {}}).notes)
        if (note.find("Coulomb") == 0) return note;
    return "";
}

/// One way round a constant load is the same.
void friction_of_one_way_is_not_usable(void)
{
    const std::string one = coulomb_of({drawn(5, 0.0, 0.3)}),
                      both = coulomb_of({drawn(5, 0.0, 0.3), backwards(drawn(6, 0.0, 0.3))});
    TEST_ASSERT_TRUE_MESSAGE(one.find("not usable: the log turns one way") != one.npos, one.c_str());
    TEST_ASSERT_TRUE_MESSAGE(one.find("take the load off") != one.npos, one.c_str());
    TEST_ASSERT_TRUE_MESSAGE(both.find("Coulomb friction") == 0 && both.find("not usable") == both.npos, both.c_str());
}

void a_load_is_refused(void)
{
    const dqw::Result r = dqw::fit({drawn(3, 0.1, 0.3)}, {kShaft, {}});
    std::size_t loads = 0;
    for (const auto& n : r.not_identifiable)
        loads += n.why.find("a load") != std::string::npos &&
                 n.excitation.find("take the load off") != std::string::npos;
    TEST_ASSERT_EQUAL_size_t(2, loads);
    for (const dqw::Estimate& e : r.parameters) TEST_ASSERT_TRUE(e.name != "J_kgm2" && e.name != "B_Nms_rad");
}

void who_does_not_ask_is_not_told(void)
{
    for (const dqw::Estimate& e : dqw::fit({drawn(4, 0.0, 0.3)}).parameters)
        TEST_ASSERT_TRUE(e.name != "J_kgm2" && e.name != "B_Nms_rad");
}

}  // namespace

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(no_load_gives_inertia_and_friction);
    RUN_TEST(friction_of_one_way_is_not_usable);
    RUN_TEST(a_load_is_refused);
    RUN_TEST(who_does_not_ask_is_not_told);
    return UNITY_END();
}
