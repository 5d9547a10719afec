// Flux maps of logs of one machine that bends, healthy and with a fault, compared: the judges are the simulator's fault
// and the co-energy that its iron is made of.
// Plain only: long, four logs are traced.
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "app/read/flux_map.hpp"
#include "app/report/compare_maps.hpp"
#include "app/trace/flux_map.hpp"
#include "bent_iron.h"
#include "ref/trace/trace.hpp"
#include "simulated.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

namespace {

using dqw::FluxMap;
using dqw::MapComparison;

constexpr double kPsi_Wb = 0.12, kR_ohm = 0.9;

/// The scenario's machine, as iron bends it.
std::string iron()
{
    std::string out = "i_d_A,i_q_A,psi_d_Wb,psi_q_Wb\n";
    for (int d = -14; d <= 14; ++d)
        for (int q = -14; q <= 14; ++q) {
            double psi[2];
            bent_flux(d, q, psi);
            out += std::to_string(d) + "," + std::to_string(q) + "," + std::to_string(kPsi_Wb + 2.2e-3 * d + psi[0]) +
                   "," + std::to_string(2.8e-3 * q + psi[1]) + "\n";
        }
    return out;
}

/// Of one second of steps at 1 % noise, written and read back.
FluxMap map_of(std::vector<std::string> settings)
{
    const command::Folder folder;
    const std::vector<std::string> all = {"machine.flux_map=" + folder.write("iron.csv", iron()),
                                          "profile.shaft=imposed",
                                          "profile.control=current",
                                          "profile.i_d_A=-3.5",
                                          "profile.i_d_A.random=4",
                                          "profile.i_d_A.random_hold_s=0.05",
                                          "profile.i_q_A.random=9",
                                          "profile.i_q_A.random_hold_s=0.031",
                                          "duration_s=1",
                                          "noise=0.01",
                                          "noise.w=0.0005"};
    settings.insert(settings.begin(), all.begin(), all.end());
    const dqw::TraceResult r = dqw::trace({simulated("servo", settings, Beside::nothing)},
                                          {{"saturation", "cross_saturation", "turn_short"}, {}});
    TEST_ASSERT_FALSE(r.map.empty());
    return dqw::read_flux_map(folder.write("map.csv", dqw::flux_map_csv(r.map)));
}

const FluxMap& healthy()
{
    static const FluxMap map = map_of({"seed=801"});
    return map;
}

MapComparison with(const FluxMap& other)
{
    const MapComparison c = dqw::compare_maps(healthy(), other);
    std::printf("%s", dqw::compare_maps_text(c).c_str());
    TEST_ASSERT_TRUE(c.nodes > 60);
    return c;
}

void two_logs_of_a_healthy_machine_do_not_differ()
{
    const MapComparison c = with(map_of({"seed=802"}));
    TEST_ASSERT_FALSE(c.differ());
    for (const dqw::AxisDifference& axis : c.axis) {
        TEST_ASSERT_TRUE(axis.beyond_two < 0.1 && axis.beyond_three < 0.02);
        TEST_ASSERT_TRUE(axis.rms_percent > 0.005 && axis.rms_percent < 0.4);
    }
    TEST_ASSERT_EQUAL_DOUBLE(0.0, c.shorted.deviations);
}

void a_weaker_magnet_shows_on_its_axis()
{
    const MapComparison c = with(map_of({"seed=803", "nonideal.demagnetisation=0.04"}));
    TEST_ASSERT_TRUE(c.differ());
    TEST_ASSERT_DOUBLE_WITHIN(0.1 * 0.04 * kPsi_Wb, -0.04 * kPsi_Wb, c.axis[0].mean_Wb);
    TEST_ASSERT_TRUE(c.axis[0].beyond_three > 0.9 && c.axis[0].most_deviations > 5);
    TEST_ASSERT_TRUE(c.axis[1].beyond_three < 0.1);
    TEST_ASSERT_FALSE(c.shorts());
}

/// (E120): a share of the turns, through a resistance.
void shorted_turns_show_beside_the_same_iron()
{
    constexpr double kShare = 0.06, kThrough_ohm = 0.3, kG_S = kShare * kShare / (kThrough_ohm + kShare * kR_ohm);
    const FluxMap map = map_of({"seed=804", "nonideal.turn_short=0.06", "nonideal.turn_short_ohm=0.3"});
    const MapComparison c = with(map), back = dqw::compare_maps(map, healthy());
    TEST_ASSERT_TRUE(c.differ() && c.shorts());
    TEST_ASSERT_TRUE(c.shorted.deviations > 5);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, c.shorted.deviations, back.shorted.deviations);
    TEST_ASSERT_DOUBLE_WITHIN(3 * map.shorted.sd_S, kG_S, c.shorted.change_S);
    TEST_ASSERT_TRUE(map.shorted.sd_S > 0.002 * kG_S && map.shorted.sd_S < 0.2 * kG_S);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 0.0, map.shorted.axis_rad);
    TEST_ASSERT_FALSE(c.bends_apart());
    TEST_ASSERT_TRUE(c.axis[0].rms_percent < 1 && c.axis[1].rms_percent < 1);
    TEST_ASSERT_EQUAL_size_t(0, dqw::compare_maps_sentence(c).find("Shorted turns differ by "));
    TEST_ASSERT_TRUE(dqw::compare_maps_sentence(c).find("first none, second as if by ") != std::string::npos);
}

}  // namespace

int main()
{
    UNITY_BEGIN();
    RUN_TEST(two_logs_of_a_healthy_machine_do_not_differ);
    RUN_TEST(a_weaker_magnet_shows_on_its_axis);
    RUN_TEST(shorted_turns_show_beside_the_same_iron);
    return UNITY_END();
}
