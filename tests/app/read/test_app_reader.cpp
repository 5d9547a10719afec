// From a CSV file to a log in memory: columns, regimes, gaps, intervals, notes.
#include <algorithm>
#include <string>
#include <utility>

#include "app/base/columns.hpp"
#include "app/read/log_reader.hpp"
#include "command.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

static std::vector<std::string> notes;

static dqw::Log read(const std::string& csv, const std::string& toml = "", bool plain_only = false)
{
    const command::Folder folder;
    if (!toml.empty()) folder.write("x.toml", toml);
    dqw::ReadOptions options;
    notes.clear();
    options.notes = &notes;
    options.plain_only = plain_only;
    return dqw::read_log(folder.write("x.csv", csv), options);
}

static bool noted(const std::string& what)
{
    for (const auto& note : notes)
        if (note.find(what) != std::string::npos) return true;
    return false;
}

static std::string dynamic_rows(int rows, int gap_before = -1)
{
    std::string text = "t_s,v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s\n";
    for (int k = 0; k < rows; ++k) {
        const double t_s = 1e-3 * (k + (gap_before >= 0 && k >= gap_before ? 500 : 0));
        text += std::to_string(t_s) + "," + std::to_string(k) + "," + std::to_string(k + 0.5) + "," +
                std::to_string(k % 7) + "," + std::to_string(k % 5) + "," + std::to_string(10 + k % 3) + "\n";
    }
    return text;
}

static void expect_refused(const std::string& csv, const std::string& toml, std::size_t line, const std::string& names)
{
    try {
        read(csv, toml);
        TEST_FAIL_MESSAGE(("accepted: " + names).c_str());
    } catch (const dqw::InputError& error) {
        TEST_ASSERT_TRUE_MESSAGE(std::string(error.what()).find(names) != std::string::npos, error.what());
        TEST_ASSERT_EQUAL_size_t_MESSAGE(line, error.line, error.what());
    }
}

static void columns_come_in_any_order_and_others_are_named(void)
{
    const auto log = read("note,i_q_A,v_q_V,v_d_V,i_d_A,w_m_rad_s\nfirst,1,2,3,4,5\n\"a,b\",1,2,3,4,5\n,1.5,2,3,4,6\n");
    TEST_ASSERT_TRUE(log.regime == dqw::Regime::steady);
    TEST_ASSERT_EQUAL_size_t(3, log.rows());
    TEST_ASSERT_EQUAL_DOUBLE(1.5, log.i_q_A[2]);
    TEST_ASSERT_EQUAL_DOUBLE(3, log.v_d_V[1]);
    TEST_ASSERT_TRUE(log.t_s.empty());
    TEST_ASSERT_TRUE(noted("columns not used: note"));
}

static void the_machine_file_renames_and_scales(void)
{
    const auto log = read("vd,v_q_V,id,Iq_mA,w_m_rad_s\n1,2,3,4000,5\n1,2,3,-4,6\n1,2,3,0,6\n",
                          "[columns]\nv_d_V = \"vd\"\ni_d_A = { from = \"id\", scale = -1 }\ni_q_A = { from = "
                          "\"Iq_mA\", scale = 0.001 }\n");
    TEST_ASSERT_EQUAL_DOUBLE(-3, log.i_d_A[0]);
    TEST_ASSERT_EQUAL_DOUBLE(4, log.i_q_A[0]);
    TEST_ASSERT_EQUAL_DOUBLE(-0.004, log.i_q_A[1]);
}

static void a_field_that_the_machine_file_names_must_be_there(void)
{
    const std::string csv = "v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s\n1,2,3,4,5\n1,2,3,4,6\n1,2,3,5,6\n";
    expect_refused(csv, "[columns]\n\ni_d_A = \"nope\"\n", 3, "x.csv has no column \"nope\"");
    expect_refused(csv, "[columns]\ni_d_A = { from = \"i_d_A\", times = \"none\" }\n", 2, "no column \"none\"");
}

static void dqwatchs_names_may_have_other_units(void)
{
    const auto log = read("v_d_mV,v_q_V,i_d_mA,i_q_A,w_m_rpm\n1,2,3,4,60\n1,2,30,4,60\n2,2,3,5,120\n");
    TEST_ASSERT_EQUAL_DOUBLE(0.001, log.v_d_V[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.03, log.i_d_A[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 4 * 3.14159265358979, log.w_m_rad_s[2]);
    TEST_ASSERT_TRUE(noted("i_d_A is read from \"i_d_mA\""));
    // A column of its own unit comes first, and a reference is no current.
    TEST_ASSERT_EQUAL_DOUBLE(
        7, read("i_d_mA,v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s\n9,1,2,7,4,5\n9,1,2,7,4,5\n9,1,2,7,4,6\n").i_d_A[0]);
    expect_refused("v_d_V,v_q_V,i_d,i_q_A,w_m_rad_s\n1,2,3,4,5\n", "", 1,
                   "column \"i_d\" says no unit: under [columns] of the machine file i_d_A = \"i_d\"");
    expect_refused(
        "v_d,v_q_V,i_d,i_q_A,w_m_rad_s\n1,2,3,4,5\n", "", 1,
        "columns \"v_d\", \"i_d\" say no unit: under [columns] of the machine file v_d_V = \"v_d\", i_d_A = \"i_d\"");
    expect_refused("v_d_V,v_q_V,i_d_mA,i_d_mA,i_q_A,w_m_rad_s\n1,2,3,4,5,6\n", "", 1, "both stand for i_d_A");
    // What a log may lack refuses none, and a line of units says what a name does not.
    TEST_ASSERT_EQUAL_size_t(3,
                             read("v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s,torque\n1,2,7,4,5,1\n1,2,7,4,5,1\n1,2,7,4,6,1\n",
                                  "[columns]\ntemp_winding_C = \"none\"\n")
                                 .rows());
    TEST_ASSERT_TRUE(noted("no column \"none\": temp_winding_C is left out"));
    TEST_ASSERT_EQUAL_DOUBLE(
        0.007, read("v_d,v_q,i_d,i_q,w_m_rad_s\nV,V,mA,A,rad/s\n1,2,7,4,5\n1,2,7,4,5\n1,2,7,4,6\n").i_d_A[0]);
}

/// One row of these has a current of 5000, two others a speed of -900: no motor's.
static void rows_that_no_motor_has_are_left_out(void)
{
    std::string text = "t_s,v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s\n";
    for (int k = 0; k < 3000; ++k)
        text += std::to_string(1e-4 * k) + "," + std::to_string(k % 11) + ",5," +
                (k == 400 ? "5000" : std::to_string(k % 7)) + "," + std::to_string(k % 5) + "," +
                (k == 700 || k == 701 ? "-900" : std::to_string(10 + k % 3)) + "\n";
    const auto log = read(text);
    TEST_ASSERT_EQUAL_size_t(2997, log.rows());
    TEST_ASSERT_TRUE(noted("3 rows left out, the first at line 402: ten times beyond"));
    TEST_ASSERT_EQUAL_size_t(3, log.segments.size());
    TEST_ASSERT_EQUAL_size_t(400, log.segments[1]);
    TEST_ASSERT_EQUAL_size_t(699, log.segments[2]);
    TEST_ASSERT_TRUE(noted("the first before line 403"));
    TEST_ASSERT_EQUAL_DOUBLE(6, *std::max_element(log.i_d_A.begin(), log.i_d_A.end()));
    TEST_ASSERT_EQUAL_DOUBLE(10, *std::min_element(log.w_m_rad_s.begin(), log.w_m_rad_s.end()));
}

/// Pulses of one row that measure an inductance: a voltage is behind each current.
static void currents_that_a_voltage_makes_stay(void)
{
    std::string text = "t_s,v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s\n";
    for (int k = 0; k < 20000; ++k) {
        const bool up = k % 2000 == 1000, down = k % 2000 == 1001;
        text += std::to_string(5e-5 * k) + "," +
                (up      ? "6"
                 : down  ? "-6"
                 : k % 2 ? "0.02"
                         : "-0.02") +
                ",0.01," +
                (down    ? "3"
                 : k % 3 ? "0.01"
                         : "-0.01") +
                ",0.01," + std::to_string(0.01 * (k % 3)) + "\n";
    }
    TEST_ASSERT_EQUAL_size_t(20000, read(text).rows());
}

/// A pulse of ten rows is what a motor may do, however far beyond the others.
static void a_pulse_stays(void)
{
    std::string text = "t_s,v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s\n";
    for (int k = 0; k < 12000; ++k)
        text += std::to_string(1e-4 * k) + ",1,5," + (k >= 400 && k < 410 ? "500" : "1") + ",2," +
                std::to_string(10 + k % 3) + "\n";
    TEST_ASSERT_EQUAL_size_t(12000, read(text).rows());
}

static void a_standstill_log_stands_still(void)
{
    std::string text = "t_s,v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s\n";
    for (int k = 0; k < 100; ++k) text += std::to_string(1e-3 * k) + "," + std::to_string(k % 3) + ",5,1,2,50\n";
    // 5 pole pairs at 50 rad/s: a radian within four steps
    expect_refused(text, "[log]\nregime = \"standstill\"\n[machine]\npole_pairs = 5\n", 7, "an electrical radian");
    TEST_ASSERT_EQUAL_size_t(100, read(text).rows());
    // Rows seconds apart, and the offset of a sensor over a minute, are no motion.
    for (const auto& [step_s, w] : {std::pair{1.0, 0.1}, std::pair{0.01, 0.005}}) {
        std::string still = "t_s,v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s\n";
        for (int k = 0; k < 6000; ++k)
            still += std::to_string(step_s * k) + "," + std::to_string(k % 3) + ",5,1,2," + std::to_string(w) + "\n";
        TEST_ASSERT_EQUAL_size_t(6000,
                                 read(still, "[log]\nregime = \"standstill\"\n[machine]\npole_pairs = 5\n").rows());
    }
}

static void one_field_may_serve_two_columns(void)
{
    const auto log = read("v_d_V,v_q_V,i,w_m_rad_s\n1,2,3,4\n1,2,4,5\n1,2,3,6\n",
                          "[columns]\ni_d_A = { from = \"i\", scale = 2 }\ni_q_A = \"i\"\n");
    TEST_ASSERT_EQUAL_DOUBLE(8, log.i_d_A[1]);
    TEST_ASSERT_EQUAL_DOUBLE(4, log.i_q_A[1]);
}

static void the_regime_is_found_from_the_columns(void)
{
    TEST_ASSERT_TRUE(read(dynamic_rows(60)).regime == dqw::Regime::dynamic);
    TEST_ASSERT_TRUE(noted("regime taken as dynamic"));
    TEST_ASSERT_TRUE(read("v_d_V,v_q_V,i_d_A,i_q_A\n1,2,3,4\n1,2,3,5\n").regime == dqw::Regime::standstill);
    TEST_ASSERT_TRUE(read("v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s\n1,2,3,4,0\n1,2,3,5,-0\n").regime ==
                     dqw::Regime::standstill);
    std::string rest = "t_s,w_m_rad_s,torque_Nm\n", uneven = "t_s,v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s\n", slow = uneven;
    double t_s = 0;
    for (int k = 0; k < 50; ++k) {
        rest += std::to_string(0.01 * k) + "," + std::to_string(k) + ",1\n";
        t_s += k % 4 ? 0.001 : 3.0;
        uneven += std::to_string(t_s) + ",1,2,3,4,5\n";
        slow += std::to_string(2 * k) + ",1,2,3,4,5\n";
    }
    TEST_ASSERT_TRUE(read(rest).regime == dqw::Regime::mechanical);
    TEST_ASSERT_TRUE(read(uneven).regime == dqw::Regime::steady);
    TEST_ASSERT_TRUE(read(slow).regime == dqw::Regime::steady);
    TEST_ASSERT_EQUAL_size_t(1, read(uneven).segments.size());
    TEST_ASSERT_TRUE(read(slow, "[log]\nregime = \"dynamic\"\n").regime == dqw::Regime::dynamic);
    TEST_ASSERT_FALSE(noted("regime taken"));
}

static void an_angle_that_moves_is_no_standstill(void)
{
    expect_refused("v_d_V,v_q_V,i_d_A,i_q_A,theta_e_rad\n1,2,3,4,0\n1,2,3,5,1\n", "", 1, "w_m_rad_s");
}

static void missing_columns_are_named_with_those_there(void)
{
    expect_refused("t_s,v_d_V,i_d_A,i_q_A,w_m_rad_s\n1,2,3,4,5\n", "", 1, "missing column v_q_V");
    expect_refused("t_s,v_d_V,i_d_A,i_q_A,w_m_rad_s\n1,2,3,4,5\n", "", 1, "t_s, v_d_V, i_d_A, i_q_A, w_m_rad_s");
    expect_refused("a,b\n1,2\n", "", 1, "the file has a, b");
    expect_refused("t_s,w_m_rad_s,i_q_A\n1,2,3\n", "", 1, "torque_constant_Nm_A");
    expect_refused("t_s,w_m_rad_s\n1,2\n", "[log]\nregime = \"mechanical\"\n", 1, "torque_Nm");
    expect_refused("v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s\n1,2,3,4,5\n", "[log]\nregime = \"dynamic\"\n", 1, "t_s");
    expect_refused("v_d_V,v_q_V,i_d_A,w_m_rad_s\n1,2,3,4\n", "[columns]\ni_q_A = \"Iq\"\n", 2,
                   "no column \"Iq\", but v_d_V, v_q_V, i_d_A, w_m_rad_s");
}

static void a_gap_begins_a_segment(void)
{
    const auto log = read(dynamic_rows(100, 60));
    TEST_ASSERT_EQUAL_size_t(100, log.rows());
    TEST_ASSERT_EQUAL_size_t(2, log.segments.size());
    TEST_ASSERT_EQUAL_size_t(60, log.segments[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1e-3, log.dt_s);
    TEST_ASSERT_TRUE(noted("1 gap in time"));
    TEST_ASSERT_TRUE(noted("before line 62"));
}

static void blank_lines_are_counted_and_shift_no_line_number(void)
{
    std::string text = dynamic_rows(60);
    text.insert(text.find('\n') + 1, "\n  \n");
    TEST_ASSERT_EQUAL_size_t(60, read(text + "\n\n\r\n").rows());
    TEST_ASSERT_TRUE(noted("2 blank lines"));
    text.insert(0, "");
    expect_refused(text + "oops,1,2,3,4,5\n", "", 64, "t_s");
    std::string gap = dynamic_rows(100, 60);
    gap.insert(gap.find('\n') + 1, "\n");
    read(gap);
    TEST_ASSERT_TRUE(noted("before line 63"));
}

static void previous_voltages_move_up_a_row_in_each_segment(void)
{
    const auto log = read(dynamic_rows(100, 60), "[log]\nvoltage_interval = \"previous\"\n");
    TEST_ASSERT_EQUAL_size_t(98, log.rows());
    TEST_ASSERT_EQUAL_size_t(59, log.segments[1]);
    TEST_ASSERT_EQUAL_DOUBLE(1, log.v_d_V[0]);
    TEST_ASSERT_EQUAL_DOUBLE(0, log.i_d_A[0]);
    TEST_ASSERT_EQUAL_DOUBLE(59, log.v_d_V[58]);
    TEST_ASSERT_EQUAL_DOUBLE(61, log.v_d_V[59]);
    TEST_ASSERT_EQUAL_DOUBLE(0.56, log.t_s[59]);
    TEST_ASSERT_TRUE(noted("2 rows at the ends"));
}

static void only_what_a_plain_fit_uses_is_kept_on_request(void)
{
    const std::string csv =
        "v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s,temp_winding_C\n1,2,3,4,5,25\n1,2,3,4,6,25\n1,2,3,4,6,25\n";
    TEST_ASSERT_EQUAL_size_t(3, read(csv).temp_winding_C.size());
    TEST_ASSERT_EQUAL_size_t(0, read(csv, "", true).temp_winding_C.size());
    TEST_ASSERT_TRUE(noted("temp_winding_C"));
    // A log is valid or not, whoever reads it.
    try {
        read("v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s,temp_winding_C\n1,2,3,4,5,inf\n1,2,3,4,6,25\n1,2,3,4,6,25\n", "", true);
        TEST_FAIL_MESSAGE("accepted");
    } catch (const dqw::InputError& error) {
        TEST_ASSERT_EQUAL_size_t(2, error.line);
    }
}

static void a_slow_channel_is_held_where_it_is_nan(void)
{
    const std::string head = "v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s,temp_winding_C\n";
    for (const char* nan : {"nan", "NaN", "-nan"}) {
        const dqw::Log log = read(head + "1,2,3,4,5," + nan + "\n1,2,3,4,6,25\n1,2,3,4,6," + nan + "\n1,2,3,4,6,27\n");
        TEST_ASSERT_EQUAL_size_t(4, log.temp_winding_C.size());
        for (const std::size_t k : {0u, 1u, 2u}) TEST_ASSERT_EQUAL_DOUBLE(25, log.temp_winding_C[k]);
        TEST_ASSERT_EQUAL_DOUBLE(27, log.temp_winding_C[3]);
    }
    expect_refused(head + "1,2,3,4,5,25\n1,2,3,nan,6,25\n1,2,3,4,6,25\n", "", 3, "i_q_A is \"nan\"");
}

static void too_few_rows_are_refused(void)
{
    expect_refused(dynamic_rows(39), "", 40, "39 rows");
    expect_refused("v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s\n1,2,3,4,5\n1,2,3,4,5\n", "", 3, "2 rows");
}

static void ten_thousand_columns_are_refused(void)
{
    std::string header;
    for (int i = 0; i < 10000; ++i) header += "c" + std::to_string(i) + ",";
    expect_refused(header + "t_s\n", "", 1, "10001 columns");
}

static void quoted_numbers_and_trailing_separators_work(void)
{
    const auto log = read("\"v_d_V\";\"v_q_V\"; i_d_A ;i_q_A;w_m_rad_s;\n\"1\";2; 3 ;4;5;\n1;2;3;4;6\n1;2;3;4;6;\n");
    TEST_ASSERT_EQUAL_size_t(3, log.rows());
    TEST_ASSERT_EQUAL_DOUBLE(3, log.i_d_A[0]);
    expect_refused("v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s\n1,2,3,4,5,\n", "", 2, "6 fields");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(columns_come_in_any_order_and_others_are_named);
    RUN_TEST(the_machine_file_renames_and_scales);
    RUN_TEST(one_field_may_serve_two_columns);
    RUN_TEST(a_field_that_the_machine_file_names_must_be_there);
    RUN_TEST(dqwatchs_names_may_have_other_units);
    RUN_TEST(rows_that_no_motor_has_are_left_out);
    RUN_TEST(currents_that_a_voltage_makes_stay);
    RUN_TEST(a_pulse_stays);
    RUN_TEST(a_standstill_log_stands_still);
    RUN_TEST(the_regime_is_found_from_the_columns);
    RUN_TEST(an_angle_that_moves_is_no_standstill);
    RUN_TEST(missing_columns_are_named_with_those_there);
    RUN_TEST(a_gap_begins_a_segment);
    RUN_TEST(blank_lines_are_counted_and_shift_no_line_number);
    RUN_TEST(previous_voltages_move_up_a_row_in_each_segment);
    RUN_TEST(only_what_a_plain_fit_uses_is_kept_on_request);
    RUN_TEST(a_slow_channel_is_held_where_it_is_nan);
    RUN_TEST(too_few_rows_are_refused);
    RUN_TEST(ten_thousand_columns_are_refused);
    RUN_TEST(quoted_numbers_and_trailing_separators_work);
    return UNITY_END();
}
