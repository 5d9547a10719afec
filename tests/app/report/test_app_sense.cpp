// What is taken back from an estimate, and what is warned of.
// Plain only: long, and what it runs others run under the sanitizers.
#include <cmath>
#include <random>
#include <string>

#include "app/report/sense.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

namespace {

// i_d, i_q and speed around one point, with sensor noise; `swing` moves i_q slowly on top.
dqw::Log log_at_one_point(double noise, double swing)
{
    std::mt19937_64 generator(1);
    std::normal_distribution<double> normal;
    dqw::Log log;
    log.regime = dqw::Regime::dynamic;
    for (int k = 0; k < 4000; k++) {
        log.i_d_A.push_back(-2 + noise * normal(generator));
        log.i_q_A.push_back(5 + noise * normal(generator) + swing * std::sin(0.02 * k));
        log.w_m_rad_s.push_back(100 + noise * normal(generator));
    }
    return log;
}

dqw::Result estimates()
{
    dqw::Result r;
    r.parameters = {{"R_ohm", 0.9, 0.01, false},
                    {"Ld_H", 2e-3, 1e-5, false},
                    {"psi_Wb", 0.12, 1e-3, false},
                    {"pole_pairs", 4, 0, true}};
    r.residual_rms = 0.1;
    return r;
}

bool noted(const dqw::Result& r, const std::string& what)
{
    for (const auto& note : r.notes)
        if (note.find(what) != std::string::npos) return true;
    return false;
}

void one_operating_point_tells_nothing()
{
    for (double noise : {0.0, 0.02}) {
        dqw::Result r = estimates();
        dqw::check_sense({log_at_one_point(noise, 0.0)}, r);
        TEST_ASSERT_EQUAL_size_t(1, r.parameters.size());  // the given pole pairs
        TEST_ASSERT_EQUAL_size_t(3, r.not_identifiable.size());
        TEST_ASSERT_TRUE(r.not_identifiable[0].why.find("one operating point") != std::string::npos);
    }
}

void a_moving_log_keeps_its_numbers()
{
    for (double noise : {0.0, 0.02}) {
        dqw::Result r = estimates();
        dqw::check_sense({log_at_one_point(noise, 0.05)}, r);
        TEST_ASSERT_EQUAL_size_t(4, r.parameters.size());
        TEST_ASSERT_TRUE(r.notes.empty());
    }
}

void impossible_values_are_taken_back()
{
    dqw::Result r = estimates();
    r.parameters[2].value = -0.12;
    r.parameters.push_back({"B_Nms_rad", -1e-6, 1e-7, false});
    dqw::check_sense({log_at_one_point(0.02, 1.0)}, r);
    TEST_ASSERT_EQUAL_size_t(4, r.parameters.size());
    TEST_ASSERT_EQUAL_size_t(1, r.not_identifiable.size());
    TEST_ASSERT_EQUAL_STRING("psi_Wb", r.not_identifiable[0].name.c_str());
}

void a_misfit_is_warned_of()
{
    dqw::Result r = estimates();
    r.axes = {{"d", 0.09, 4.9}, {"q", 0.11, 5.1}};
    dqw::check_sense({log_at_one_point(0.02, 1.0)}, r);
    TEST_ASSERT_TRUE(noted(r, "5.1 % of q"));
    TEST_ASSERT_FALSE(noted(r, "of d"));
}

/// An angle of four pole pairs beside a speed that is `part` of the shaft's.
void a_speed_that_slips_leaves_nothing_usable()
{
    for (const double part : {1.0, 0.99, 0.95, 0.2}) {
        dqw::Log log = log_at_one_point(0.02, 1.0);
        log.machine.pole_pairs = 4;
        double theta = 0.0;
        for (std::size_t k = 0; k < log.i_q_A.size(); ++k) {
            log.t_s.push_back(1e-4 * static_cast<double>(k));
            log.theta_e_rad.push_back(theta);
            theta = std::remainder(theta + 4 * 100 * 1e-4 / part, 2 * M_PI);
        }
        dqw::Result r = estimates();
        dqw::check_sense({log}, r);
        const bool slips = part < 0.98;
        TEST_ASSERT_EQUAL(slips, noted(r, "the speed slips"));
        TEST_ASSERT_EQUAL(slips, !dqw::why_not_usable(r.parameters[0]).empty());
        TEST_ASSERT_DOUBLE_WITHIN(1e-3 * r.parameters[2].value / part,
                                  slips ? (1 / part - 1) * r.parameters[2].value : 1e-3, r.parameters[2].sd);
        TEST_ASSERT_EQUAL_DOUBLE(0.0, r.parameters[3].sd);
    }
}

}  // namespace

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(one_operating_point_tells_nothing);
    RUN_TEST(a_moving_log_keeps_its_numbers);
    RUN_TEST(impossible_values_are_taken_back);
    RUN_TEST(a_misfit_is_warned_of);
    RUN_TEST(a_speed_that_slips_leaves_nothing_usable);
    return UNITY_END();
}
