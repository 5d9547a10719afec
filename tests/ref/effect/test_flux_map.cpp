// A flux map's law against its own co-energy by differences, and the least current against closed forms.
#include <cmath>
#include <vector>

#include "ref/effect/flux_map.hpp"
#include "ref/effect/plane.hpp"
#include "ref/trace/flux_map.hpp"
#include "ref/trace/trace.hpp"
#include "unity.h"

extern "C" void setUp(void) {}
extern "C" void tearDown(void) {}

namespace {

using dqw::FluxMap;
using dqw::FluxNode;

constexpr std::array<double, 4> kShape = {-9.0, 4.0, 7.0, 0.0};
constexpr int kMost = dqw::kCrossWeights;

using Flux = void (*)(const std::array<double, 4>&, double, double, double[], double[]);
using Inductance = std::array<double, 3> (*)(const std::array<double, 4>&, const double[], double, double);

struct Law {
    Flux flux;
    Inductance inductance;
    int weights;
};
constexpr Law kLaws[] = {{dqw::own_flux, dqw::own_inductance, dqw::kOwnWeights},
                         {dqw::cross_flux, dqw::cross_inductance, dqw::kCrossWeights}};

/// Of the sum of the weights 1, -2, 3, ...
void sum(const Law& law, double i_d, double i_q, double& psi_d, double& psi_q)
{
    double d[kMost], q[kMost];
    law.flux(kShape, i_d, i_q, d, q);
    psi_d = psi_q = 0.0;
    for (int j = 0; j < law.weights; ++j) {
        const double w = (j % 2 == 0 ? 1.0 : -1.0) * (j + 1);
        psi_d += w * d[j], psi_q += w * q[j];
    }
}

void slopes_are_those_of_one_co_energy()
{
    constexpr double kStep = 1e-5;
    for (const Law& law : kLaws)
        for (double i_d : {-11.0, -8.3, -2.2, 0.4, 3.1, 6.0})
            for (double i_q : {-8.1, -3.3, 0.7, 2.9, 9.2}) {
                double weights[kMost], d0, q0, d1, q1;
                for (int j = 0; j < law.weights; ++j) weights[j] = (j % 2 == 0 ? 1.0 : -1.0) * (j + 1);
                const std::array<double, 3> L = law.inductance(kShape, weights, i_d, i_q);
                const double near = 1e-6 * (1.0 + std::abs(L[0]) + std::abs(L[1]) + std::abs(L[2]));
                sum(law, i_d - kStep, i_q, d0, q0), sum(law, i_d + kStep, i_q, d1, q1);
                TEST_ASSERT_DOUBLE_WITHIN(near, L[0], (d1 - d0) / (2 * kStep));
                TEST_ASSERT_DOUBLE_WITHIN(near, L[1], (q1 - q0) / (2 * kStep));
                sum(law, i_d, i_q - kStep, d0, q0), sum(law, i_d, i_q + kStep, d1, q1);
                TEST_ASSERT_DOUBLE_WITHIN(near, L[1], (d1 - d0) / (2 * kStep));
                TEST_ASSERT_DOUBLE_WITHIN(near, L[2], (q1 - q0) / (2 * kStep));
            }
}

void nothing_is_added_at_zero_current_and_both_sides_of_q_are_alike()
{
    for (const Law& law : kLaws) {
        double d[kMost], q[kMost], d_other[kMost], q_other[kMost];
        law.flux(kShape, 0.0, 0.0, d, q);
        for (int j = 0; j < law.weights; ++j) {
            double unit[kMost] = {};
            unit[j] = 1.0;
            TEST_ASSERT_EQUAL_DOUBLE(0.0, d[j]);
            TEST_ASSERT_EQUAL_DOUBLE(0.0, q[j]);
            for (double L : law.inductance(kShape, unit, 0.0, 0.0)) TEST_ASSERT_EQUAL_DOUBLE(0.0, L);
        }
        law.flux(kShape, -3.0, 5.0, d, q), law.flux(kShape, -3.0, -5.0, d_other, q_other);
        for (int j = 0; j < law.weights; ++j) {
            TEST_ASSERT_EQUAL_DOUBLE(d[j], d_other[j]);
            TEST_ASSERT_EQUAL_DOUBLE(q[j], -q_other[j]);
        }
    }
}

/// Each of the eight is needed: no other combination of them is the same flux.
void axis_bends_in_its_cells_and_no_further()
{
    double weights[dqw::kOwnWeights];
    for (int j = 0; j < dqw::kOwnWeights; ++j) weights[j] = 1.0;
    const std::array<double, 3> edge = dqw::own_inductance(kShape, weights, 4.0, 7.0),
                                beyond = dqw::own_inductance(kShape, weights, 40.0, 70.0);
    // Cells of 9/6 and 4/2 A: the wider holds for both, so two of 2 A lie right of zero; of i_q eight of 7/8 A.
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 2.0 / 2.0, edge[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 8.0 / (7.0 / 8.0), edge[2]);
    TEST_ASSERT_EQUAL_DOUBLE(edge[0], beyond[0]);
    TEST_ASSERT_EQUAL_DOUBLE(edge[2], beyond[2]);
}

/// psi_d = psi + L_d i_d + a i_q^2, psi_q = L_q i_q + 2 a i_d i_q
FluxMap quadratic(double psi, double Ld, double Lq, double a)
{
    FluxMap map;
    for (int k = -10; k <= 10; ++k) map.i_d_A.push_back(k), map.i_q_A.push_back(k);
    for (double d : map.i_d_A)
        for (double q : map.i_q_A)
            map.nodes.push_back(
                {psi + Ld * d + a * q * q, Lq * q + 2 * a * d * q, 0, 0, Ld, 2 * a * q, Lq + 2 * a * d, true});
    return map;
}

void between_nodes_a_quadratic_is_exact()
{
    const FluxMap map = quadratic(0.1, 2e-3, 5e-3, -1e-4);
    for (double d : {-9.7, -0.25, 3.5})
        for (double q : {-6.6, 0.5, 9.1}) {
            const FluxNode at = dqw::between(map, d, q);
            TEST_ASSERT_DOUBLE_WITHIN(1e-14, 0.1 + 2e-3 * d - 1e-4 * q * q, at.psi_d_Wb);
            TEST_ASSERT_DOUBLE_WITHIN(1e-14, 5e-3 * q - 2e-4 * d * q, at.psi_q_Wb);
            TEST_ASSERT_TRUE(at.seen);
        }
    TEST_ASSERT_FALSE(dqw::between(map, 10.5, 0.0).seen);
}

void least_current_is_that_of_the_closed_form()
{
    const double psi = 0.1, Ld = 2e-3, Lq = 8e-3, p = 3.0;
    const auto least = dqw::mtpa(quadratic(psi, Ld, Lq, 0.0), p);
    // The largest of the grid's circles leave it.
    TEST_ASSERT_TRUE(least.size() > 10 && least.size() < 25);
    for (const dqw::LeastCurrent& at : least) {
        const double k = psi / (4.0 * (Lq - Ld)), i_d = k - std::sqrt(k * k + 0.5 * at.i_A * at.i_A);
        TEST_ASSERT_DOUBLE_WITHIN(0.01 * at.i_A, i_d, at.i_d_A);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, at.i_A, std::hypot(at.i_d_A, at.i_q_A));
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.5 * p * (psi + (Ld - Lq) * at.i_d_A) * at.i_q_A, at.torque_Nm);
    }
    const double T = 1.5 * p * psi * 7.3;
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 7.3, dqw::current_without_d(quadratic(psi, Ld, Lq, 0.0), p, T));
    TEST_ASSERT_DOUBLE_IS_NAN(dqw::current_without_d(quadratic(psi, Ld, Lq, 0.0), p, 2.0 * T));
}

void least_current_ends_where_the_log_does()
{
    FluxMap map = quadratic(0.1, 2e-3, 8e-3, 0.0);
    for (std::size_t d = 0; d < map.i_d_A.size(); ++d)
        for (std::size_t q = 0; q < map.i_q_A.size(); ++q)
            map.nodes[d * map.i_q_A.size() + q].seen = map.i_d_A[d] > -2.5;
    const auto least = dqw::mtpa(map, 3.0);
    TEST_ASSERT_TRUE(!least.empty());
    for (const dqw::LeastCurrent& at : least) TEST_ASSERT_TRUE(at.i_d_A >= -2.5);
    for (FluxNode& node : map.nodes) node.seen = false;
    TEST_ASSERT_TRUE(dqw::mtpa(map, 3.0).empty());
    TEST_ASSERT_TRUE(dqw::mtpa({}, 3.0).empty());
}

/// Beyond what was seen a map may bend too far; its own reader would refuse it.
void what_would_fall_is_made_to_rise()
{
    dqw::FluxMap map;
    for (int k = -3; k <= 3; ++k) map.i_d_A.push_back(k), map.i_q_A.push_back(2 * k);
    for (const double d : map.i_d_A)
        for (const double q : map.i_q_A)
            map.nodes.push_back(
                {0.1 + 0.01 * d - 0.002 * d * d, 0.02 * q - 6e-4 * q * q * q, 1e-4, 1e-4, 0.01, 0, 0.02, true});
    const dqw::FluxMap before = map;
    dqw::make_monotone(map);
    for (std::size_t d = 0; d < 7; ++d)
        for (std::size_t q = 0; q < 7; ++q) {
            const dqw::FluxNode &now = map.at(d, q), &then = before.at(d, q);
            if (d > 0) TEST_ASSERT_TRUE(now.psi_d_Wb - map.at(d - 1, q).psi_d_Wb > 0.0499 * 0.01);
            if (q > 0) TEST_ASSERT_TRUE(now.psi_q_Wb - map.at(d, q - 1).psi_q_Wb > 0.0499 * 0.02 * 2);
            // Of d the last alone fell, of q both ends; by how much is in the deviation.
            TEST_ASSERT_EQUAL_INT(d == 6, now.psi_d_Wb != then.psi_d_Wb);
            TEST_ASSERT_EQUAL_INT(q == 0 || q == 6, now.psi_q_Wb != then.psi_q_Wb);
            TEST_ASSERT_DOUBLE_WITHIN(1e-12, std::hypot(1e-4, now.psi_d_Wb - then.psi_d_Wb), now.sd_d_Wb);
            TEST_ASSERT_DOUBLE_WITHIN(1e-12, std::hypot(1e-4, now.psi_q_Wb - then.psi_q_Wb), now.sd_q_Wb);
        }
}

/// Points 1 and 2 A apart of an iron of one co-energy: between them the map is seen, beyond them it is not, and it is
/// the iron's to a thousandth.
void settled_points_are_seen_between_them()
{
    constexpr double kR = 0.25, kPsi = 0.02, kLd = 6e-4, kLq = 9e-4, kKnee_A = 7.0;
    dqw::Log log;
    log.path = "points", log.regime = dqw::Regime::steady, log.machine.pole_pairs = 4.0;
    const auto flux = [](double i_d, double i_q, double psi[2]) {
        const double x = (i_d + 4.0) / kKnee_A, y = i_q / kKnee_A, norm = std::sqrt(1.0 + x * x + y * y),
                     at = 4.0 / kKnee_A / std::sqrt(1.0 + 16.0 / (kKnee_A * kKnee_A));
        psi[0] = kPsi + kLd * kKnee_A * (x / norm - at), psi[1] = kLq * i_q + kLd * kKnee_A * y / norm;
    };
    int row = 0;
    for (const double w_m : {150.0, 300.0})
        for (int d = -6; d <= 0; ++d)
            for (int q = -3; q <= 3; ++q, ++row) {
                double psi[2];
                flux(d, 2.0 * q, psi);
                const double w = 4.0 * w_m, noise_V = 2e-4 * std::sin(12.9898 * row * row);
                log.i_d_A.push_back(d), log.i_q_A.push_back(2.0 * q), log.w_m_rad_s.push_back(w_m);
                log.v_d_V.push_back(kR * d - w * psi[1] + noise_V);
                log.v_q_V.push_back(kR * 2.0 * q + w * psi[0] - noise_V);
            }
    const dqw::TraceResult r = dqw::trace({log}, {{"saturation", "cross_saturation"}, {}});
    TEST_ASSERT_FALSE(r.map.empty());
    std::size_t between = 0;
    for (std::size_t d = 0; d < r.map.i_d_A.size(); ++d)
        for (std::size_t q = 0; q < r.map.i_q_A.size(); ++q) {
            const FluxNode& node = r.map.at(d, q);
            const double i_d = r.map.i_d_A[d], i_q = r.map.i_q_A[q];
            TEST_ASSERT_EQUAL_INT(i_d >= -6.31 && i_d <= 0.31 && std::abs(i_q) <= 6.61, node.seen);
            if (!node.seen) continue;
            double psi[2];
            flux(i_d, i_q, psi), ++between;
            TEST_ASSERT_DOUBLE_WITHIN(1e-3 * kPsi, psi[0], node.psi_d_Wb);
            TEST_ASSERT_DOUBLE_WITHIN(1e-3 * kPsi, psi[1], node.psi_q_Wb);
        }
    TEST_ASSERT_TRUE(between > 400);
}

}  // namespace

int main()
{
    UNITY_BEGIN();
    RUN_TEST(slopes_are_those_of_one_co_energy);
    RUN_TEST(nothing_is_added_at_zero_current_and_both_sides_of_q_are_alike);
    RUN_TEST(axis_bends_in_its_cells_and_no_further);
    RUN_TEST(between_nodes_a_quadratic_is_exact);
    RUN_TEST(least_current_is_that_of_the_closed_form);
    RUN_TEST(least_current_ends_where_the_log_does);
    RUN_TEST(what_would_fall_is_made_to_rise);
    RUN_TEST(settled_points_are_seen_between_them);
    return UNITY_END();
}
