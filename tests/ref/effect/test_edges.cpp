// A dead time at the pulses' edges, against legs of switches and diodes that are followed in small steps.
#include <cmath>

#include "ref/effect/edges.hpp"
#include "ref/effect/pulses.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

namespace {

constexpr double kT_s = 1e-4, kLink_V = 48.0, kLd_H = 60e-6, kLq_H = 90e-6;

/// Legs whose currents are slopes of voltages alone, from a machine turned by `angle`.
dqw::Pulsed period_of(double angle_rad, const double (&i_A)[3], const double (&duty)[3], const double (&emf_V)[3])
{
    dqw::Pulsed p{};
    p.link_V = kLink_V, p.period_s = kT_s;
    for (int k = 0; k < 3; ++k) {
        p.i_A[k] = i_A[k], p.duty[k] = duty[k];
        for (int n = 0; n < 3; ++n) {
            const double a = 2.0 * M_PI / 3.0 * k - angle_rad, b = 2.0 * M_PI / 3.0 * n - angle_rad;
            p.per_H[k][n] = 2.0 / 3.0 * (std::cos(a) * std::cos(b) / kLd_H + std::sin(a) * std::sin(b) / kLq_H);
        }
    }
    for (int k = 0; k < 3; ++k)
        for (int n = 0; n < 3; ++n) p.slope_A[k] += kT_s * p.per_H[k][n] * (kLink_V * duty[n] - emf_V[n]);
    return p;
}

/// Each leg's mean loss of one volt, its switches open for a dead time at either edge: small steps, the current of an
/// open leg held at zero where either rail would drive it back.
void followed(const dqw::Pulsed& p, const double (&emf_V)[3], double loss_V, double (&lost)[3])
{
    constexpr int kSteps = 200000;
    const double dead = loss_V / p.link_V, h = 1.0 / kSteps;
    double i[3] = {p.i_A[0], p.i_A[1], p.i_A[2]}, sum[3] = {};
    for (int step = 0; step < kSteps; ++step) {
        const double t = (step + 0.5) * h;
        double v[3];
        bool open[3];
        for (int n = 0; n < 3; ++n) {
            const double rise = 0.5 * (1.0 - p.duty[n]), fall = 0.5 * (1.0 + p.duty[n]);
            const bool switches = p.duty[n] > 0.0 && p.duty[n]<1.0, high = p.duty[n]> 0.0 && t > rise && t < fall;
            open[n] = switches && ((t > rise && t < rise + dead) || (t > fall && t < fall + dead));
            v[n] = open[n] ? (i[n] > 0.0 ? 0.0 : p.link_V) : high ? p.link_V : 0.0;
        }
        for (int n = 0; n < 3; ++n) {
            if (!open[n]) continue;
            const auto after = [&](double own_V) {
                double slope = 0.0;
                for (int m = 0; m < 3; ++m) slope += p.per_H[n][m] * ((m == n ? own_V : v[m]) - emf_V[m]);
                return i[n] + h * p.period_s * slope;
            };
            const double low = after(0.0), high = after(p.link_V);
            if (low < 0.0 && high > 0.0) v[n] = -low / (high - low) * p.link_V;
        }
        for (int n = 0; n < 3; ++n) {
            double slope = 0.0;
            for (int m = 0; m < 3; ++m) slope += p.per_H[n][m] * (v[m] - emf_V[m]);
            i[n] += h * p.period_s * slope, sum[n] += h * v[n];
        }
    }
    for (int n = 0; n < 3; ++n) lost[n] = (p.duty[n] * p.link_V - sum[n]) / loss_V;
}

void compare(const dqw::Pulsed& p, const double (&emf_V)[3], double loss_V, double within)
{
    double lost[3];
    followed(p, emf_V, loss_V, lost);
    const dqw::EdgeLoss found = dqw::lost_at_edges(p, loss_V, 0.0);
    // What all three lose is none of a phase's.
    const double all = (found.mean[0] + found.mean[1] + found.mean[2] - lost[0] - lost[1] - lost[2]) / 3.0;
    for (int n = 0; n < 3; ++n) TEST_ASSERT_DOUBLE_WITHIN(within, lost[n], found.mean[n] - all);
}

/// Currents through zero in steps, so that each edge is met while the current is on either side, and within what a dead
/// time takes of it. Ripple alone is 8 A, a dead time takes 0.4 A.
void the_sign_at_each_edge()
{
    const double duty[3] = {0.62, 0.47, 0.31}, emf_V[3] = {6.0, -1.0, -5.0};
    for (double i_A = -9.0; i_A < 9.0; i_A += 0.37)
        compare(period_of(0.4, {i_A, 0.3 - 0.4 * i_A, -0.3 - 0.6 * i_A}, duty, emf_V), emf_V, 0.48, 0.01);
}

/// Legs that switch within one dead time of each other decide each other's loss.
void edges_within_a_dead_time()
{
    const double duty[3] = {0.506, 0.5, 0.47}, emf_V[3] = {0.2, 0.1, -0.3};
    for (double i_A = -2.0; i_A < 2.0; i_A += 0.07)
        compare(period_of(1.1, {i_A, 1.7 - i_A, -1.7}, duty, emf_V), emf_V, 0.48, 0.03);
}

/// A leg that rests has no edge, but where it begins to.
void a_leg_that_rests()
{
    const double duty[3] = {1.0, 0.8, 0.4}, emf_V[3] = {10.0, 2.0, -12.0};
    for (double i_A = -3.0; i_A < 3.0; i_A += 0.31) {
        dqw::Pulsed p = period_of(0.2, {5.0, i_A, -5.0 - i_A}, duty, emf_V);
        compare(p, emf_V, 0.48, 0.01);
        TEST_ASSERT_EQUAL_DOUBLE(0.0, dqw::lost_at_edges(p, 0.48, 0.0).mean[0]);
        p.rises = 0;
        TEST_ASSERT_EQUAL_DOUBLE(1.0, dqw::lost_at_edges(p, 0.48, 0.0).mean[0]);
        p.rises = -1, p.falls = 0;
        TEST_ASSERT_EQUAL_DOUBLE(0.0, dqw::lost_at_edges(p, 0.48, 0.0).mean[0]);
    }
}

/// A pulse shorter than the dead time is lost as a whole, and no more: 0.48 V are a hundredth of the period.
void pulses_shorter_than_the_dead_time()
{
    const double duty[3] = {0.9, 0.4, 0.004}, emf_V[3] = {20.0, -1.0, -19.0};
    for (const double i_A : {-30.0, 30.0}) {
        const dqw::Pulsed p = period_of(0.3, {-0.5 * i_A, -0.5 * i_A, i_A}, duty, emf_V);
        compare(p, emf_V, 0.48, 0.01);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, i_A > 0.0 ? 0.4 : -1.0, dqw::lost_at_edges(p, 0.48, 0.0).mean[2]);
    }
}

/// What a start more or less changes of a leg's loss, by difference: where the current turns at both edges the first
/// takes what the second then lacks, and a current held at zero forgets where it came from rather than turning over.
void a_start_that_is_off_is_off_by_less()
{
    constexpr double kLoss_V = 4.8, kStep_A = 1e-6;
    const double duty[3] = {0.5, 0.47, 0.52}, emf_V[3] = {0.1, -0.6, 0.5};
    int both = 0;
    for (double i_A = -9.0; i_A < 9.0; i_A += 0.113) {
        const auto lost = [&](double own_A) {
            return dqw::lost_at_edges(period_of(0.4, {own_A, 30.0, -30.0 - own_A}, duty, emf_V), kLoss_V, 0.0);
        };
        const dqw::Pulsed p = period_of(0.4, {i_A, 30.0, -30.0 - i_A}, duty, emf_V);
        const double by_start = lost(i_A).by_start[0],
                     by_difference = (lost(i_A + kStep_A).mean[0] - lost(i_A - kStep_A).mean[0]) / (2.0 * kStep_A),
                     whole = 1.0 / (kLoss_V * kT_s * p.per_H[0][0]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-6 * whole, by_difference, by_start);
        TEST_ASSERT_TRUE(by_start >= -1e-9 * whole && by_start <= (1.0 + 1e-9) * whole);
        both += by_start > 0.1 * whole;
    }
    TEST_ASSERT_GREATER_THAN(20, both);
}

/// A leg that rests stands on its rail, whatever rounds.
void a_resting_leg_has_no_duty_between()
{
    for (int k = 0; k < 1000; ++k) {
        const double v_V[3] = {std::sin(0.1 * k), std::sin(0.1 * k - 2.0), std::sin(0.1 * k + 2.0)},
                     link_V = 3.0 + std::cos(7.0 * k);
        for (const dqw::Modulation m : dqw::kModulations) {
            const int rests = dqw::resting_leg(m, v_V);
            if (rests < 0) continue;
            const double d = dqw::Duties(m, v_V, link_V).of[rests];
            TEST_ASSERT_TRUE(d == 0.0 || d == 1.0);
        }
    }
}

/// Where one edge is met within what a dead time takes, the slope is the difference's; without a link nothing is lost.
void slopes_and_no_link()
{
    const double duty[3] = {0.62, 0.47, 0.31}, emf_V[3] = {6.0, -1.0, -5.0};
    int met = 0;
    for (double i_A = -9.0; i_A < 9.0; i_A += 0.01) {
        dqw::Pulsed p = period_of(0.4, {i_A, 4.0 - 0.4 * i_A, -4.0 - 0.6 * i_A}, duty, emf_V);
        const dqw::EdgeLoss here = dqw::lost_at_edges(p, 0.48, 0.1);
        constexpr double kStep = 1e-6;
        p.i_A[0] += kStep;
        const dqw::EdgeLoss there = dqw::lost_at_edges(p, 0.48, 0.1);
        if (!(here.by_start[0] > 0.0) || !(there.by_start[0] > 0.0)) continue;
        ++met;
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, here.by_start[0], (there.mean[0] - here.mean[0]) / kStep);
    }
    TEST_ASSERT_TRUE(met > 50);
    dqw::Pulsed p = period_of(0.4, {1.0, -0.4, -0.6}, duty, emf_V);
    p.link_V = 0.0;
    for (const double mean : dqw::lost_at_edges(p, 0.48, 0.1).mean) TEST_ASSERT_EQUAL_DOUBLE(0.0, mean);
}

}  // namespace

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_sign_at_each_edge);
    RUN_TEST(edges_within_a_dead_time);
    RUN_TEST(a_leg_that_rests);
    RUN_TEST(pulses_shorter_than_the_dead_time);
    RUN_TEST(a_start_that_is_off_is_off_by_less);
    RUN_TEST(a_resting_leg_has_no_duty_between);
    RUN_TEST(slopes_and_no_link);
    return UNITY_END();
}
