// A result in a data sheet's numbers: identities between them, and each controller's own use of its settings.
#include "app/report/datasheet.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

static dqw::Result known()
{
    dqw::Result r;
    r.parameters = {{"R_ohm", 0.05, 0.001, false},
                    {"Ld_H", 30e-6, 1e-7, false},
                    {"Lq_H", 50e-6, 1e-7, false},
                    {"psi_Wb", 4e-3, 1e-5, false},
                    {"pole_pairs", 7, 0, true}};
    return r;
}

static void the_speed_constant_is_of_line_to_line_peak_volts(void)
{
    const auto numbers = dqw::datasheet_numbers(known());
    TEST_ASSERT_EQUAL_size_t(3, numbers.size());
    // Back-EMF of phases a and b over a turn, at 1000 rpm.
    double peak = 0.0;
    const double w_m = 1000 * 2 * M_PI / 60;
    for (int k = 0; k < 3600; ++k) {
        const double theta = 2 * M_PI * k / 3600;
        const double a = -7 * w_m * 4e-3 * std::sin(theta), b = -7 * w_m * 4e-3 * std::sin(theta - 2 * M_PI / 3);
        peak = std::fmax(peak, std::fabs(a - b));
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 1000 / peak, numbers[0].value);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, numbers[0].value * 1e-5 / 4e-3, numbers[0].sd);
    // Power at both sides of the air gap is the same.
    const double i_q = 3.0, v_q = 7 * w_m * 4e-3;
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.5 * v_q * i_q / w_m / i_q, numbers[1].value);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.1, numbers[2].value);
    // ODrive's documentation: torque constant = 8.27 / Kv.
    TEST_ASSERT_DOUBLE_WITHIN(0.01, 8.27, numbers[0].value * numbers[1].value);
}

static void heat_is_told_against_what_the_machine_file_has(void)
{
    dqw::Machine cold;
    cold.R_ohm = 0.05 / (1 + 0.0039 * 40), cold.psi_Wb = 4e-3 / (1 - 0.001 * 25);
    const auto numbers = dqw::datasheet_numbers(known(), cold);
    TEST_ASSERT_EQUAL_size_t(5, numbers.size());
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 40, numbers[3].value);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.001 / (0.0039 * *cold.R_ohm), numbers[3].sd);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 25, numbers[4].value);
    // A magnet may lose half as much, so the deviation holds half of it, and psi's own.
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, std::hypot(12.5, 1e-5 / (0.001 * *cold.psi_Wb)), numbers[4].sd);
    TEST_ASSERT_TRUE(dqw::datasheet_text(known(), cold).find("by R 40 ± 6 K warmer") != std::string::npos);
    cold.R_ohm = 0.0;
    TEST_ASSERT_EQUAL_size_t(4, dqw::datasheet_numbers(known(), cold).size());
}

static void settings_are_in_each_controllers_own_words(void)
{
    const auto json = dqw::datasheet_json(known());
    const auto& vesc = json.at("settings").at("VESC");
    TEST_ASSERT_EQUAL_STRING("si_motor_poles 14", vesc.at(0).get<std::string>().c_str());
    TEST_ASSERT_EQUAL_STRING("foc_motor_r 0.05", vesc.at(1).get<std::string>().c_str());
    TEST_ASSERT_EQUAL_STRING("foc_motor_l 4e-05", vesc.at(2).get<std::string>().c_str());
    TEST_ASSERT_EQUAL_STRING("foc_motor_ld_lq_diff 2e-05", vesc.at(3).get<std::string>().c_str());
    TEST_ASSERT_EQUAL_STRING("foc_motor_flux_linkage 0.004", vesc.at(4).get<std::string>().c_str());
    TEST_ASSERT_EQUAL_STRING("conf set motor.Kv 196.9",
                             json.at("settings").at("moteus").at(2).get<std::string>().c_str());
    TEST_ASSERT_EQUAL_STRING("odrv0.axis0.motor.config.torque_constant = 0.042",
                             json.at("settings").at("ODrive 0.5").at(3).get<std::string>().c_str());
    TEST_ASSERT_EQUAL_STRING("BLDCMotor motor(7, 0.05f, 196.9f, 4e-05f);",
                             json.at("settings").at("SimpleFOC").at(0).get<std::string>().c_str());
}

static void what_is_not_known_is_left_out(void)
{
    dqw::Result r = known();
    r.parameters.erase(r.parameters.begin() + 3);
    TEST_ASSERT_EQUAL_size_t(1, dqw::datasheet_numbers(r).size());
    TEST_ASSERT_EQUAL_STRING("BLDCMotor motor(7, 0.05f, NOT_SET, 4e-05f);",
                             dqw::controller_settings(r)[3].lines[0].c_str());
    r.parameters[0].sd = 0.01;
    TEST_ASSERT_EQUAL_size_t(1, dqw::datasheet_numbers(r).size());
    TEST_ASSERT_EQUAL_STRING("BLDCMotor motor(7, NOT_SET, NOT_SET, 4e-05f);",
                             dqw::controller_settings(r)[3].lines[0].c_str());
    r.parameters.pop_back();
    TEST_ASSERT_EQUAL_size_t(0, dqw::controller_settings(r).size());
    TEST_ASSERT_EQUAL_STRING("", dqw::datasheet_text({}).c_str());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_speed_constant_is_of_line_to_line_peak_volts);
    RUN_TEST(heat_is_told_against_what_the_machine_file_has);
    RUN_TEST(settings_are_in_each_controllers_own_words);
    RUN_TEST(what_is_not_known_is_left_out);
    return UNITY_END();
}
