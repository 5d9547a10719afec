// Vendors' logs: each sample of DATA's folder vendor is read as what its README says, values, rows and reasons.
#include <cmath>
#include <string>

#include "app/base/least_squares.hpp"
#include "app/format/formats.hpp"
#include "app/read/log_reader.hpp"
#include "command.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

static dqw::Survey survey;

struct Given {
    std::optional<double> p = {}, gear = {}, v_dc_V = {}, period_s = {};
};

static std::string sample(const std::string& name)
{
    return command::environment("DATA", "../shared/data") + "/vendor/" + name;
}

static bool absent() { return !std::filesystem::exists(sample("README.md")); }

#define NEED_SAMPLES()                                                                                                 \
    if (absent()) TEST_IGNORE_MESSAGE("no vendors' logs: set DATA")

static dqw::Log read(const std::string& name, const Given& given = {}, const std::string& format = "")
{
    survey = {};
    dqw::ReadOptions options;
    options.survey = &survey;
    options.pole_pairs = given.p;
    options.given.gear = given.gear, options.given.v_dc_V = given.v_dc_V, options.given.period_s = given.period_s;
    options.format = format;
    return dqw::read_log(sample(name), options);
}

static double mean(const std::vector<double>& x)
{
    double sum = 0;
    for (const double v : x) sum += v;
    return sum / static_cast<double>(x.size());
}

static void expect_read(const char* format, std::size_t rows, std::size_t kept, const char* regime)
{
    TEST_ASSERT_EQUAL_STRING(format, survey.format.c_str());
    TEST_ASSERT_EQUAL_size_t(rows, survey.rows_in_file);
    TEST_ASSERT_EQUAL_size_t(kept, survey.rows_kept);
    TEST_ASSERT_EQUAL_STRING(regime, survey.regime.c_str());
}

struct Machine {
    double R_ohm, Ld_H, Lq_H, psi_Wb;
};

/// Settled rows by least squares; `averaged`: the speed of the interval before the row, of two instants.
static Machine settled(const dqw::Log& log, double p, bool averaged, bool one_L)
{
    dqw::LeastSquares<4> fit;
    for (std::size_t k = averaged; k < log.rows(); ++k) {
        const double w = p * (averaged ? 0.5 * (log.w_m_rad_s[k] + log.w_m_rad_s[k - 1]) : log.w_m_rad_s[k]);
        const double d = log.i_d_A[k], q = log.i_q_A[k];
        if (one_L) {
            fit.add({d, -w * q, 0, 0}, log.v_d_V[k]);
            fit.add({q, w * d, 0, w}, log.v_q_V[k]);
            fit.add({0, 0, 1, 0}, 0);
        } else {
            fit.add({d, 0, -w * q, 0}, log.v_d_V[k]);
            fit.add({q, w * d, 0, w}, log.v_q_V[k]);
        }
    }
    std::array<double, 4> x, sd;
    fit.solve(x, sd);
    return {x[0], x[1], one_L ? x[1] : x[2], x[3]};
}

static void vesc_files_hold_motor_a(void)
{
    NEED_SAMPLES();
    const struct {
        const char *name, *format;
        std::size_t rows, kept;
        double R_percent, L_percent;
    } files[] = {
        {"SYNTHETIC_vesc_tool_rt.csv", "vesc_tool", 36, 36, 2, 2},
        {"SYNTHETIC_vescstate_plotjuggler.csv", "plotjuggler", 38, 28, 2, 2},
        {"SYNTHETIC_vesc_express_log.csv", "vesc_log", 32, 31, 10, 10},
        {"SYNTHETIC_mesc_status_json.txt", "mesc_status", 30, 30, 10, 10},
    };
    for (const auto& file : files) {
        const dqw::Log log = read(file.name, {7});
        expect_read(file.format, file.rows, file.kept, "polled");
        // MESC's values are instants, as its speed is.
        const Machine m = settled(log, 7, file.format != std::string("mesc_status"), true);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.05 * file.R_percent / 100, 0.05, m.R_ohm, file.name);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(4e-3 * 0.005, 4e-3, m.psi_Wb, file.name);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(40e-6 * file.L_percent / 100, 40e-6, m.Lq_H, file.name);
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 36123.4, read("SYNTHETIC_vesc_tool_rt.csv", {7}).t_s.front());
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 27.35, read("SYNTHETIC_mesc_status_json.txt", {7}).temp_winding_C.front());
}

static void without_pole_pairs_they_are_asked_for_by_name(void)
{
    NEED_SAMPLES();
    read("SYNTHETIC_vesc_tool_rt.csv");
    TEST_ASSERT_EQUAL_STRING("", survey.regime.c_str());
    TEST_ASSERT_EQUAL_size_t(1, survey.missing.size());
    TEST_ASSERT_TRUE(survey.missing[0].find("--pole-pairs") != std::string::npos);
    try {
        dqw::read_log(sample("SYNTHETIC_vesc_tool_rt.csv"));
        TEST_FAIL_MESSAGE("read");
    } catch (const dqw::InputError& error) {
        TEST_ASSERT_TRUE_MESSAGE(std::string(error.what()).find("pole pairs: --pole-pairs N") != std::string::npos,
                                 error.what());
    }
}

static void sampled_data_is_turned_by_the_angle(void)
{
    NEED_SAMPLES();
    const dqw::Log vesc = read("SYNTHETIC_vesc_sampled_data.csv", {7});
    expect_read("vesc_sampled", 40, 40, "dynamic");
    TEST_ASSERT_DOUBLE_WITHIN(0.03, 0.0, mean(vesc.i_d_A));
    TEST_ASSERT_DOUBLE_WITHIN(0.01, 12.0, mean(vesc.i_q_A));
    TEST_ASSERT_DOUBLE_WITHIN(0.01, -0.754, mean(vesc.v_d_V));
    TEST_ASSERT_DOUBLE_WITHIN(0.02, 6.883, mean(vesc.v_q_V));
    TEST_ASSERT_DOUBLE_WITHIN(0.005 * 224.4, 15000 * 0.10471975512 / 7, mean(vesc.w_m_rad_s));
    const dqw::Log mesc = read("SYNTHETIC_mesc_fastloop.txt", {7});
    expect_read("mesc_log", 40, 40, "dynamic");
    TEST_ASSERT_DOUBLE_WITHIN(0.01, 0.0, mean(mesc.i_d_A));
    TEST_ASSERT_DOUBLE_WITHIN(0.01, 15.0, mean(mesc.i_q_A));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, -0.75, mean(mesc.v_d_V));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 5.78, mean(mesc.v_q_V));
    TEST_ASSERT_DOUBLE_WITHIN(0.02, 200 * 6.283185307 / 7, mean(mesc.w_m_rad_s));
}

static void openinverter_counts_fields_from_the_rows_end(void)
{
    NEED_SAMPLES();
    const dqw::Log motor = read("SYNTHETIC_openinverter_motor_data.csv", {4, {}, 350});
    expect_read("openinverter_motor", 36, 36, "");
    TEST_ASSERT_DOUBLE_WITHIN(0.05, -34.2, mean(motor.v_d_V));
    TEST_ASSERT_DOUBLE_WITHIN(0.05, 49.2, mean(motor.v_q_V));
    TEST_ASSERT_DOUBLE_WITHIN(0.1, -40, mean(motor.i_d_A));
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 80, mean(motor.i_q_A));
    TEST_ASSERT_DOUBLE_WITHIN(0.3, 133 * 6.283185307 / 4, mean(motor.w_m_rad_s));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 35 / 8789.0, motor.t_s.back());
    const dqw::Log web = read("SYNTHETIC_openinverter_web_log.csv", {4});
    expect_read("openinverter_web", 24, 24, "steady");
    const Machine b = settled(web, 4, false, false);
    TEST_ASSERT_DOUBLE_WITHIN(0.02 * 0.02, 0.020, b.R_ohm);
    TEST_ASSERT_DOUBLE_WITHIN(2e-6, 0.2e-3, b.Ld_H);
    TEST_ASSERT_DOUBLE_WITHIN(2e-6, 0.5e-3, b.Lq_H);
    TEST_ASSERT_DOUBLE_WITHIN(0.1e-3, 65e-3, b.psi_Wb);
    // 2024-03-18 10:15:00.123, as if in UTC.
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 1710756900.123, web.t_s.front());
}

static void simplefoc_has_neither_names_nor_time(void)
{
    NEED_SAMPLES();
    const dqw::Log log = read("SYNTHETIC_simplefoc_monitor_all.txt", {7, {}, {}, 0.05});
    expect_read("simplefoc", 36, 36, "steady");
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 35 * 0.05, log.t_s.back());
    const Machine c = settled(log, 7, false, true);
    TEST_ASSERT_DOUBLE_WITHIN(0.03, 5.6, c.R_ohm);
    TEST_ASSERT_DOUBLE_WITHIN(0.05e-3, 12e-3, c.psi_Wb);
    TEST_ASSERT_DOUBLE_WITHIN(0.2e-3, 2e-3, c.Lq_H);
    const dqw::Log four = read("SYNTHETIC_simplefoc_monitor_default.txt", {7});
    expect_read("simplefoc", 36, 36, "");
    TEST_ASSERT_TRUE(four.i_q_A.empty() && four.v_d_V.empty());
    TEST_ASSERT_EQUAL_DOUBLE(2.6208, four.v_q_V.front());
    TEST_ASSERT_EQUAL_DOUBLE(2.4, four.w_m_rad_s.front());
}

static void an_old_ros_message_has_no_voltage_but_the_duty(void)
{
    NEED_SAMPLES();
    const dqw::Log log = read("SYNTHETIC_vescstate_rostopic_echo.csv", {7});
    expect_read("vesc_ros", 32, 32, "polled");
    TEST_ASSERT_TRUE(survey.voltage.find("none") == 0);
    // v_q of the same motor at the same rows: 1.978 V, of a duty in steps of 0.001 and 48 V.
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.077 * 48 / std::sqrt(3.0), log.v_q_V.front());
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.02013, log.t_s[1] - log.t_s[0]);
}

static void tmotor_files_lose_their_zero_rows_and_five_percent(void)
{
    NEED_SAMPLES();
    const dqw::Log a = read("tmotor_eff_1667828286.70403.csv", {21, 9});
    expect_read("tmotor_efficiency", 401, 395, "polled");
    const dqw::Log b = read("tmotor_eff_1667828588.0588076.csv", {21});
    expect_read("tmotor_efficiency", 368, 362, "polled");
    TEST_ASSERT_TRUE(b.torque_Nm.empty());
    const dqw::Log c = read("tmotor_Measuring_velocities_1_rps.csv", {21});
    expect_read("tmotor_velocity", 1599, 1599 - 221, "polled");
    // 0.22116 logged.
    TEST_ASSERT_DOUBLE_WITHIN(0.001, 8.568 * 0.22116, c.w_m_rad_s[299 - 222]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, -0.02617079866940486 / 9, a.torque_Nm[18 - 6]);
}

static void dynos_keep_their_rows_in_one_piece(void)
{
    NEED_SAMPLES();
    const dqw::Log a = read("moteus_dyno_futek_24_04_2021_16-07-36.csv");
    expect_read("moteus_dyno", 745, 744, "mechanical");
    TEST_ASSERT_EQUAL_size_t(1, a.segments.size());
    // No g1 in this file: 6 by the two speeds.
    double ratio = 0;
    for (const auto& column : survey.columns)
        if (column.name == "torque_Nm") ratio = *column.factor;
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 1 / 6.0, ratio);
    const dqw::Log b = read("moteus_dyno_futek_05_05_2021_12-41-03.csv");
    expect_read("moteus_dyno", 787, 786, "mechanical");
    TEST_ASSERT_EQUAL_size_t(1, b.segments.size());
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.0095367431640625 * 6.283185307, b.w_m_rad_s.front());
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, -0.04375, b.torque_Nm.front());
    for (const char* name : {"odri_speed_test1.txt", "odri_speed_test1_switch.txt"}) {
        const dqw::Log log = read(name, {12});
        TEST_ASSERT_EQUAL_STRING("odri", survey.format.c_str());
        TEST_ASSERT_EQUAL_size_t(1, log.segments.size());
        TEST_ASSERT_TRUE(log.v_dc_V.empty());
    }
    TEST_ASSERT_EQUAL_size_t(6200, survey.rows_kept);
}

static void apps_and_benches_are_read_for_what_they_are(void)
{
    NEED_SAMPLES();
    const dqw::Log app = read("floatcontrol_demo.csv", {15});
    expect_read("float_control", 285, 285, "");
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 142 * 0.104719755119660 / 15, app.w_m_rad_s[1]);
    for (const char* name : {"edrive_oc_20C_result.csv", "edrive_oc_65C_result.csv"}) {
        const dqw::Log bench = read(name);
        expect_read("test_bench", 11, 11, "");
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, 300 * 0.104719755119660, bench.w_m_rad_s.front());
    }
}

static void what_is_no_log_is_refused_with_the_reason(void)
{
    NEED_SAMPLES();
    const struct {
        const char *name, *why;
    } files[] = {{"odrive_dyno_motor_param.csv", ":2: a list of resistances"},
                 {"odrive_dyno_data.txt", ":1: 3 numbers a line and no header"}};
    for (const auto& file : files) try {
            read(file.name);
            TEST_FAIL_MESSAGE(file.name);
        } catch (const dqw::InputError& error) {
            TEST_ASSERT_TRUE_MESSAGE(std::string(error.what()).find(file.why) != std::string::npos, error.what());
        }
    const dqw::Log told = read("odrive_dyno_data.txt", {}, "odrive_dyno");
    TEST_ASSERT_EQUAL_size_t(341, told.rows());
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 101 * 0.104719755119660, told.w_m_rad_s.front());
}

/// Whatever lies there, with what its machine file says; vendors' with their pole pairs. One has its d axis turned.
static void no_right_log_is_warned_of(void)
{
    NEED_SAMPLES();
    const std::string data = command::environment("DATA", "../shared/data");
    std::size_t logs = 0;
    for (const char* folder : {"", "/foreign", "/vendor"})
        for (const auto& file : std::filesystem::directory_iterator(data + folder)) {
            const std::string name = file.path().filename().string();
            if (file.is_directory() || file.path().extension() == ".toml" || file.path().extension() == ".md") continue;
            std::vector<std::string> notes;
            dqw::Survey made;
            dqw::ReadOptions options;
            options.survey = &made, options.notes = &notes;
            const bool actuator = name.find("tmotor") == 0, inverter = name.find("openinverter") != name.npos;
            if (std::string("/vendor") == folder) options.pole_pairs = actuator ? 21 : inverter ? 4 : 7;
            options.given.gear = 9;
            if (inverter) options.given.v_dc_V = 350;
            try {
                dqw::read_log(file.path().string(), options);
                ++logs;
            } catch (const dqw::InputError&) {
            }
            bool warned = false;
            for (const std::string& note : notes) warned = warned || note.find("warning: ") == 0;
            TEST_ASSERT_TRUE_MESSAGE(warned == (name == "us_sign_d.csv"), name.c_str());
        }
    TEST_ASSERT_TRUE(logs > 40);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(vesc_files_hold_motor_a);
    RUN_TEST(without_pole_pairs_they_are_asked_for_by_name);
    RUN_TEST(sampled_data_is_turned_by_the_angle);
    RUN_TEST(openinverter_counts_fields_from_the_rows_end);
    RUN_TEST(simplefoc_has_neither_names_nor_time);
    RUN_TEST(an_old_ros_message_has_no_voltage_but_the_duty);
    RUN_TEST(tmotor_files_lose_their_zero_rows_and_five_percent);
    RUN_TEST(dynos_keep_their_rows_in_one_piece);
    RUN_TEST(apps_and_benches_are_read_for_what_they_are);
    RUN_TEST(what_is_no_log_is_refused_with_the_reason);
    RUN_TEST(no_right_log_is_warned_of);
    return UNITY_END();
}
