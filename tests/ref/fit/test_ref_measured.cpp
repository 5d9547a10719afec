// Measured logs, where they are at hand ($DATA, else ../shared/data): what the plain model makes of them.
// Plain only: long, and what it runs others run under the sanitizers.
#include <cstdio>
#include <fstream>
#include <map>
#include <sstream>

#include "ref/fit/fit.hpp"
#include "ref/machine.hpp"
#include "ref/trace/named.hpp"
#include "unity.h"

extern "C" void setUp(void) {}
extern "C" void tearDown(void) {}

using machine::sd;
using machine::value;

namespace {

std::string path_of(const char* name)
{
    const char* folder = std::getenv("DATA");
    return std::string(folder != nullptr ? folder : "../shared/data") + "/" + name + ".csv";
}

bool absent(const char* name) { return !std::ifstream(path_of(name)).good(); }

/// Numbers and known columns only; gaps are where a period exceeds 1.5 times the median.
dqw::Log load(const char* name, dqw::Regime regime)
{
    dqw::Log log;
    log.path = path_of(name);
    log.regime = regime;
    std::map<std::string, std::vector<double>*> known{{"t_s", &log.t_s},
                                                      {"v_d_V", &log.v_d_V},
                                                      {"v_q_V", &log.v_q_V},
                                                      {"i_d_A", &log.i_d_A},
                                                      {"i_q_A", &log.i_q_A},
                                                      {"w_m_rad_s", &log.w_m_rad_s},
                                                      {"torque_Nm", &log.torque_Nm},
                                                      {"torque_cmd_Nm", &log.torque_cmd_Nm}};
    std::ifstream file(log.path);
    std::string line, cell;
    std::getline(file, line);
    std::vector<std::vector<double>*> columns;
    for (std::istringstream header(line); std::getline(header, cell, ',');) columns.push_back(known[cell]);
    while (std::getline(file, line)) {
        std::size_t j = 0;
        for (std::istringstream row(line); std::getline(row, cell, ','); ++j)
            if (columns[j] != nullptr) columns[j]->push_back(std::stod(cell));
    }
    if (log.t_s.size() > 1) log.dt_s = log.t_s[1] - log.t_s[0];
    return log;
}

void show(const char* name, const dqw::Result& result)
{
    std::printf("%s:", name);
    for (const auto& p : result.parameters) std::printf(" %s %.5g (%.2g)", p.name.c_str(), p.value, p.sd);
    for (const auto& n : result.not_identifiable) std::printf(" %s?", n.name.c_str());
    for (const auto& a : result.axes)
        std::printf("; %s %.4g %s, %.2f %%", a.axis.c_str(), a.rms, result.residual_unit.c_str(), a.percent);
    std::printf("\n");
}

#define NEED(name)                                                                                                     \
    if (absent(name)) TEST_IGNORE_MESSAGE(name " is not there")

void inverter_sweeps(void)
{
    for (const char* name : {"inverter_sweep_d_axis_a", "inverter_sweep_d_axis_b", "inverter_sweep_d_axis_c",
                             "inverter_sweep_beta_axis_a"}) {
        if (absent(name)) TEST_IGNORE_MESSAGE(name);
        const dqw::Result result = dqw::fit({load(name, dqw::Regime::standstill)});
        show(name, result);
        TEST_ASSERT_DOUBLE_WITHIN(0.2, 2.9, value(result, "R_ohm"));
        TEST_ASSERT_TRUE(sd(result, "R_ohm") > 0.02 && sd(result, "R_ohm") < 0.5);
        TEST_ASSERT_DOUBLE_WITHIN(1.5, 25.3, result.axes[0].percent);
    }
}

void grid_at_3000_rpm(void)
{
    NEED("dq_grid_3000rpm");
    dqw::Log log = load("dq_grid_3000rpm", dqw::Regime::steady);
    log.machine.pole_pairs = 4;
    const dqw::Result result = dqw::fit({log});
    show("dq_grid_3000rpm", result);
    TEST_ASSERT_EQUAL_size_t(5, result.parameters.size());
    TEST_ASSERT_DOUBLE_WITHIN(0.3, 4.1, result.axes[0].percent);
    TEST_ASSERT_DOUBLE_WITHIN(0.06, 0.4, result.axes[1].percent);
    TEST_ASSERT_DOUBLE_WITHIN(0.0003, 0.0163, value(result, "psi_Wb"));
}

void motorcycle(void)
{
    NEED("motorcycle_laps_practice");
    dqw::Log log = load("motorcycle_laps_practice", dqw::Regime::steady);
    log.machine.pole_pairs = 1;
    const dqw::Result result = dqw::fit({log});
    show("motorcycle_laps_practice", result);
    TEST_ASSERT_DOUBLE_WITHIN(0.4, 13.8, result.axes[0].percent);
    TEST_ASSERT_DOUBLE_WITHIN(0.3, 7.6, result.axes[1].percent);
    TEST_ASSERT_DOUBLE_WITHIN(0.003, 0.0646, value(result, "psi_Wb"));
}

void standstill_heating(void)
{
    NEED("standstill_heating_20A");
    const dqw::Result result = dqw::fit({load("standstill_heating_20A", dqw::Regime::standstill)});
    show("standstill_heating_20A", result);
    TEST_ASSERT_DOUBLE_WITHIN(0.15, 4.2, result.axes[1].percent);
    TEST_ASSERT_DOUBLE_WITHIN(0.01, 0.363, value(result, "R_ohm"));
}

/// Friction that the model lacks ends in B (the nameplate's is 7e-5) and in J (1.2e-4), and remains as residual.
void servo(void)
{
    std::vector<dqw::Log> logs;
    for (const char* name : {"servo_friction_neg_0p045_1", "servo_friction_neg_0p045_2", "servo_friction_neg_0p045_3",
                             "servo_friction_pos_0p06_1", "servo_friction_pos_0p06_2", "servo_friction_pos_0p06_3"}) {
        if (absent(name)) TEST_IGNORE_MESSAGE(name);
        logs.push_back(load(name, dqw::Regime::mechanical));
        logs.back().machine.torque_constant_Nm_A = 0.0458;
        const dqw::Result result = dqw::fit({logs.back()});
        show(name, result);
        TEST_ASSERT_TRUE(value(result, "B_Nms_rad") > 1.5e-4 && value(result, "B_Nms_rad") < 3.5e-4);
        TEST_ASSERT_TRUE(value(result, "J_kgm2") > 2e-4 && value(result, "J_kgm2") < 5e-4);
        TEST_ASSERT_TRUE(result.axes[0].percent > 10.0 && result.axes[0].percent < 25.0);
    }
    const dqw::Result joint = dqw::fit(logs);
    show("the six jointly", joint);
    TEST_ASSERT_EQUAL_size_t(120000, joint.rows);
    TEST_ASSERT_DOUBLE_WITHIN(0.4e-4, 2.29e-4, value(joint, "B_Nms_rad"));
    // With what it lacks, beside the nameplate.
    const dqw::Result named = dqw::fit_effects(logs, {"coulomb_friction", "direction_asymmetry"}, {}).result;
    show("with its dry friction", named);
    for (const auto& [name, nameplate] : {std::pair{"J_kgm2", 1.2e-4}, std::pair{"B_Nms_rad", 7.03e-5}}) {
        TEST_ASSERT_DOUBLE_WITHIN(3.0 * sd(named, name), nameplate, value(named, name));
        TEST_ASSERT_TRUE(sd(named, name) < 0.15 * nameplate);
    }
}

}  // namespace

int main()
{
    UNITY_BEGIN();
    RUN_TEST(inverter_sweeps);
    RUN_TEST(grid_at_3000_rpm);
    RUN_TEST(motorcycle);
    RUN_TEST(standstill_heating);
    RUN_TEST(servo);
    return UNITY_END();
}
