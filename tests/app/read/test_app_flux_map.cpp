// Flux maps written, read back, refused by the row, and compared.
#include <cmath>
#include <functional>
#include <string>

#include "app/base/input_error.hpp"
#include "app/read/flux_map.hpp"
#include "app/report/compare_maps.hpp"
#include "app/trace/flux_map.hpp"
#include "command.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

namespace {

using command::Folder;
using dqw::FluxMap;

/// psi_d = 0.1 + 2e-3 i_d, psi_q = 5e-3 i_q, each weakened by a cubic.
FluxMap known(double scale)
{
    FluxMap map;
    for (int k = -4; k <= 4; ++k) map.i_d_A.push_back(k), map.i_q_A.push_back(1.5 * k);
    for (double d : map.i_d_A)
        for (double q : map.i_q_A)
            map.nodes.push_back({scale * (0.1 + 2e-3 * d - 5e-6 * d * d * d), scale * (5e-3 * q - 1e-5 * q * q * q),
                                 1e-4, 2e-4, 0, 0, 0, d < 3.5});
    return map;
}

void written_and_read_it_is_the_same()
{
    const Folder folder;
    const FluxMap map = known(1.0), read = dqw::read_flux_map(folder.write("map.csv", dqw::flux_map_csv(map)));
    TEST_ASSERT_EQUAL_size_t(map.nodes.size(), read.nodes.size());
    for (std::size_t k = 0; k < map.nodes.size(); ++k) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, map.nodes[k].psi_d_Wb, read.nodes[k].psi_d_Wb);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, map.nodes[k].psi_q_Wb, read.nodes[k].psi_q_Wb);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, map.nodes[k].sd_q_Wb, read.nodes[k].sd_q_Wb);
        TEST_ASSERT_EQUAL_INT(map.nodes[k].seen, read.nodes[k].seen);
    }
    // Of a cubic the line between neighbours is off by its third part.
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 2e-3 - 5e-6, read.at(4, 4).L_dd_H);
}

void refused(const std::string& text, std::size_t line, const char* why)
{
    const Folder folder;
    const std::string path = folder.write("map.csv", text);
    try {
        dqw::read_flux_map(path);
    } catch (const dqw::InputError& error) {
        TEST_ASSERT_EQUAL_size_t_MESSAGE(line, error.line, error.what());
        TEST_ASSERT_TRUE_MESSAGE(std::string(error.what()).find(why) != std::string::npos, error.what());
        return;
    }
    TEST_FAIL_MESSAGE(why);
}

/// A grid of 3 by 3 whose row `row`, from 0, is `text`; or without it.
std::string grid(std::size_t row, const std::string& text)
{
    std::string out = "i_q_A,i_d_A,psi_d_Wb,psi_q_Wb\n";
    for (int d = -1; d <= 1; ++d)
        for (int q = -1; q <= 1; ++q) {
            const std::size_t here = static_cast<std::size_t>(3 * (d + 1) + q + 1);
            if (here != row)
                out += std::to_string(q) + "," + std::to_string(d) + "," + std::to_string(0.1 + 0.01 * d) + "," +
                       std::to_string(0.02 * q) + "\n";
            else if (!text.empty())
                out += text + "\n";
        }
    return out;
}

void what_is_no_map_is_refused_by_its_row()
{
    refused("", 1, "empty");
    refused("i_d_A,i_q_A,psi_d_Wb\n0,0,1\n", 1, "no column psi_q_Wb");
    refused("i_d_A,i_q_A,psi_d_Wb,psi_q_Wb\n", 1, "no points");
    refused(grid(4, "0,0,nan,0"), 6, "psi_d_Wb is 'nan'");
    refused(grid(4, "0,0,0.1"), 6, "psi_q_Wb is ''");
    refused(grid(4, "0,0,0.1,x"), 6, "psi_q_Wb is 'x'");
    refused(grid(4, ""), 6, "not a full grid");
    refused(grid(8, ""), 9, "not a full grid");
    refused(grid(4, "-1,0,0.1,0"), 6, "is there twice (line 5)");
    refused(grid(4, "0,0,0.08,0"), 6, "not monotone: psi_d_Wb does not rise with i_d_A from line 3 on");
    refused(grid(5, "1,0,0.1,-0.001"), 7, "not monotone: psi_q_Wb does not rise with i_q_A from line 6 on");
    refused("i_d_A,i_q_A,psi_d_Wb,psi_q_Wb\n0,0,1,0\n0,1,1,1\n1,0,2,0\n1,1,2,1\n", 5, "2 by 2 points is too coarse");
    const Folder folder;
    TEST_ASSERT_EQUAL_size_t(9, dqw::read_flux_map(folder.write("m.csv", grid(99, ""))).nodes.size());
}

void a_weaker_magnet_shows()
{
    const FluxMap healthy = known(1.0);
    const dqw::MapComparison same = dqw::compare_maps(healthy, known(1.0)),
                             weak = dqw::compare_maps(healthy, known(0.95));
    // The last column but one lies beside what was not seen.
    TEST_ASSERT_EQUAL_size_t(72 - 9, same.nodes);
    TEST_ASSERT_FALSE(same.differ());
    TEST_ASSERT_TRUE(weak.differ());
    // i_d from -4 to 2 A: its mean is -1, that of its cubes -13.
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, -0.05 * (0.1 - 2e-3 + 13 * 5e-6), weak.axis[0].mean_Wb);
    TEST_ASSERT_TRUE(weak.axis[0].most_deviations > 30 && weak.axis[0].beyond_three == 1.0);
    FluxMap silent = healthy;
    for (dqw::FluxNode& n : silent.nodes) n.sd_d_Wb = n.sd_q_Wb = 0;
    TEST_ASSERT_FALSE(dqw::compare_maps(silent, silent).deviations);
}

void command_compares_maps()
{
    const Folder folder;
    const std::string a = folder.write("a.csv", dqw::flux_map_csv(known(1.0))),
                      b = folder.write("b.csv", dqw::flux_map_csv(known(0.95))),
                      bad = folder.write("c.csv", grid(4, ""));
    TEST_ASSERT_TRUE(
        command::dqwatch({"compare", "--out", folder / "out", "--map", a, b}).out.find("The maps differ.") == 0);
    const std::string page = command::read_file(folder / "out/compare.html");
    // Two of what differs, four of each map.
    std::size_t figures = 0;
    for (std::size_t at = page.find("<figure"); at != std::string::npos; at = page.find("<figure", at + 1)) ++figures;
    TEST_ASSERT_EQUAL_size_t(10, figures);
    for (const char* what : {"First: a.csv", "Second: b.csv", "Δψ_q over i_q", "The maps differ."})
        TEST_ASSERT_TRUE_MESSAGE(page.find(what) != std::string::npos, what);
    TEST_ASSERT_TRUE(command::dqwatch({"compare", "--json", "--out", folder / "out", "--map", a, b})
                         .out.find("dqwatch.compare_map/1") != std::string::npos);
    TEST_ASSERT_EQUAL_INT(3, command::dqwatch({"compare", "--map", a, bad}).code);
    TEST_ASSERT_EQUAL_INT(2, command::dqwatch({"compare", "--map", a}).code);
    TEST_ASSERT_EQUAL_INT(2, command::dqwatch({"compare"}).code);
    TEST_ASSERT_EQUAL_INT(3, command::dqwatch({"sim", "servo", "--set", "machine.flux_map=" + bad}).code);
}

void learn_takes_the_map_that_the_machine_file_names()
{
    const Folder folder;
    TEST_ASSERT_EQUAL_INT(
        0,
        command::dqwatch({"sim", "servo", "--set", "duration_s=0.5", "--set", "noise=0", "--out", folder / ""}).code);
    const std::string log = folder / "servo.csv", toml = command::read_file(folder / "servo.toml");
    const auto learned = [&](const std::string& map) {
        std::string with = toml;
        with.insert(with.find("[machine]\n") + 10, "flux_map = \"" + map + "\"\n");
        return command::dqwatch({"learn", log, "--machine", folder.write("with.toml", with)});
    };
    folder.write("a.csv", dqw::flux_map_csv(known(1.0))), folder.write("bad.csv", grid(4, ""));
    // This machine does not bend, and its magnet is another: no weight is told.
    const auto good = learned("a.csv");
    TEST_ASSERT_EQUAL_INT_MESSAGE(4, good.code, good.err.c_str());
    TEST_ASSERT_TRUE_MESSAGE(good.out.find("flux_map: none of its weights") != std::string::npos, good.out.c_str());
    TEST_ASSERT_TRUE_MESSAGE(good.err.find("ψ is 0.12 Wb, in the flux map 0.1 Wb") != std::string::npos,
                             good.err.c_str());
    for (const char* map : {"bad.csv", "none.csv"}) {
        const auto bad = learned(map);
        TEST_ASSERT_EQUAL_INT(3, bad.code);
        TEST_ASSERT_TRUE_MESSAGE(bad.err.find(map) != std::string::npos, bad.err.c_str());
    }
    TEST_ASSERT_EQUAL_INT(3, learned("").code);
}

void what_gives_no_map_says_which_currents_to_drive()
{
    dqw::TraceResult trace;
    TEST_ASSERT_EQUAL_STRING("", dqw::flux_map_text(trace).c_str());
    trace.effects.push_back({"cross_saturation", {}, 0.0, {}, ""});
    TEST_ASSERT_EQUAL_size_t(0, dqw::flux_map_text(trace).find("no flux map: "));
    TEST_ASSERT_TRUE(dqw::flux_map_text(trace).find("drive i_d and i_q") != std::string::npos);
    // Nine blocks of ten at one current, and nine at two.
    dqw::TraceResult one;
    for (int k = 0; k < 10; ++k) one.blocks.i_d_A.push_back(k == 0 ? 0.0 : -3.0), one.blocks.i_q_A.push_back(4.0);
    TEST_ASSERT_TRUE(dqw::flux_map_text(one).find("hardly more than one current (i_d −3 A, i_q 4 A); drive i_d") !=
                     std::string::npos);
    one.regime = dqw::Regime::standstill;
    TEST_ASSERT_EQUAL_STRING("", dqw::flux_map_text(one).c_str());
    one.regime = dqw::Regime::dynamic, one.blocks.i_q_A[1] = -4.0;
    TEST_ASSERT_EQUAL_STRING("", dqw::flux_map_text(one).c_str());
}

}  // namespace

int main()
{
    UNITY_BEGIN();
    RUN_TEST(written_and_read_it_is_the_same);
    RUN_TEST(what_is_no_map_is_refused_by_its_row);
    RUN_TEST(a_weaker_magnet_shows);
    RUN_TEST(command_compares_maps);
    RUN_TEST(learn_takes_the_map_that_the_machine_file_names);
    RUN_TEST(what_gives_no_map_says_which_currents_to_drive);
    return UNITY_END();
}
