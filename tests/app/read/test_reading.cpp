// Files as people have them: packed, piped, commented, without a header, with clocks of the day, holes and units by
// name.
#include <sys/wait.h>

#include <cmath>
#include <functional>
#include <string>

#include <fmt/format.h>

#include "app/format/formats.hpp"
#include "app/read/clock.hpp"
#include "app/read/log_reader.hpp"
#include "command.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

static std::vector<std::string> notes;

static dqw::Log read(const std::string& csv, const std::string& toml = "", const dqw::Given& given = {},
                     const std::string& format = "")
{
    const command::Folder folder;
    if (!toml.empty()) folder.write("x.toml", toml);
    dqw::ReadOptions options;
    notes.clear();
    options.notes = &notes;
    options.given = given;
    options.pole_pairs = given.pole_pairs;
    options.format = format;
    return dqw::read_log(folder.write("x.csv", csv), options);
}

static bool noted(const std::string& what)
{
    for (const auto& note : notes)
        if (note.find(what) != note.npos) return true;
    return false;
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

static const std::string steady = "v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s";
static const std::string rows = "1,2,3,4,5\n1,2,3,5,6\n1,2,4,4,7\n";

static void comments_units_and_spaces_stand_before_the_rows(void)
{
    TEST_ASSERT_EQUAL_size_t(3, read("# made by hand\n# twice\n" + steady + "\n" + rows).rows());
    const auto log = read("\xef\xbb\xbf# x\nv_d_V, v_q_V, i_d_A, i_q_A, w_m_rad_s\n[V],[V],[mA],[mA],[rpm]\n" + rows);
    TEST_ASSERT_EQUAL_size_t(3, log.rows());
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 4e-3, log.i_q_A[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 5 * 0.10471975511966, log.w_m_rad_s[0]);
    expect_refused("# x\n" + steady + "\n1,2,3,oops,5\n", "", 3, "i_q_A is \"oops\"");
    expect_refused("# nothing\n# else\n", "", 2, "comments and nothing else");
    expect_refused("1,2,3\n4,5,6\n", "", 1, "--format");
}

static void packed_and_piped_logs_are_read(void)
{
    const command::Folder folder;
    const std::string plain_text = steady + "\n" + rows, csv = folder.write("x.csv", plain_text);
    folder.write("x.toml", "[machine]\npole_pairs = 3\n");
    for (const char* program : {"gzip", "zstd"}) {
        const std::string packed = csv + (program == std::string("gzip") ? ".gz" : ".zst");
        const auto made = command::run_program({program, "-q", "-k", csv});
        if (made.code == 127) continue;
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, made.code, made.err.c_str());
        const auto log = dqw::read_log(packed);
        TEST_ASSERT_EQUAL_size_t(3, log.rows());
        TEST_ASSERT_EQUAL_DOUBLE(3, *log.machine.pole_pairs);
        const std::string bytes = command::read_file(packed);
        for (std::size_t cut = 5; cut < bytes.size(); cut += 7) try {
                dqw::read_log(folder.write("cut", bytes.substr(0, cut)));
                TEST_FAIL_MESSAGE("read");
            } catch (const dqw::InputError& error) {
                TEST_ASSERT_TRUE_MESSAGE(std::string(error.what()).find("cut off") != std::string::npos ||
                                             std::string(error.what()).find("damaged") != std::string::npos,
                                         error.what());
            }
        // Two packed files joined are one.
        folder.write("two", bytes + bytes);
        expect_refused(plain_text + plain_text, "", 5, "v_d_V");
        const auto run = command::dqwatch({"columns", "-", "--pole-pairs", "3"}, {packed, ""});
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
        TEST_ASSERT_TRUE(run.out.find("3 rows, 3 kept") != run.out.npos);
    }
    for (const char* magic : {"PAR1", "\x89HDF\r\n", "MDF     4.10", "#ROSBAG V2.0", "SQLite format 3"})
        expect_refused(std::string(magic) + "\n1,2\n", "", 1, "export it");
}

static void clocks_are_understood(void)
{
    double t = 0;
    TEST_ASSERT_TRUE(dqw::parse_clock("1970-01-02T00:00:01.5", t));
    TEST_ASSERT_EQUAL_DOUBLE(86401.5, t);
    TEST_ASSERT_TRUE(dqw::parse_clock("2024-02-29 12:00:00Z", t));
    TEST_ASSERT_EQUAL_DOUBLE(1709208000.0, t);
    TEST_ASSERT_TRUE(dqw::parse_clock("2024-02-29T12:00:00.25+02:00", t));
    TEST_ASSERT_EQUAL_DOUBLE(1709208000.25 - 7200, t);
    TEST_ASSERT_TRUE(dqw::parse_clock("23:59:59.5", t));
    TEST_ASSERT_EQUAL_DOUBLE(86399.5, t);
    for (const char* wrong : {"", "12:00", "2024-13-01T00:00:00", "2024-01-01", "aa:bb:cc", "12:61:00", "1:2:3"})
        TEST_ASSERT_FALSE_MESSAGE(dqw::parse_clock(wrong, t), wrong);
    std::string text = "t_s," + steady + "\n";
    for (int k = 0; k < 60; ++k) {
        const int ms = 86399500 + 20 * k;
        text += std::to_string(ms % 86400000) + "," + std::to_string(k) + ",2,3," + std::to_string(k % 7) + ",5\n";
    }
    const auto log = read(text, "[columns]\nt_s = { from = \"t_s\", unit = \"ms\" }\n");
    TEST_ASSERT_EQUAL_size_t(60, log.rows());
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 86399.5 + 59 * 0.02, log.t_s.back());
    TEST_ASSERT_TRUE(noted("midnight"));
}

static void percent_signs_and_whole_seconds_are_no_trouble(void)
{
    const auto log = read("v_d_V,duty,i_d_A,i_q_A,w_m_rad_s\n0,50%,1,2,3\n0, 25 %,1,2,4\n0,10%,1,2,5\n",
                          "[columns]\nv_q_V = { from = \"duty\", unit = \"% of v_dc\" }\n", {{}, {}, 48, {}});
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 24, log.v_q_V[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 12, log.v_q_V[1]);
    std::string text =
        "v_in:Input:V:2:0:0;erpm:ERPM::0:0:0;id:id:A:2:0:0;iq:iq:A:2:0:0;vd:vd:V:2:0:0;vq:vq:V:2:0:0;t_day:"
        "Time:s:0:0:1\n";
    for (int k = 0; k < 100; ++k)
        text += "48;" + std::to_string(1000 + k) + ";0;1;0;2;" + std::to_string(k / 50) + "\n";
    TEST_ASSERT_TRUE(read(text, "", {7, {}, {}, {}}).t_s.empty());
    TEST_ASSERT_TRUE(noted("whole seconds"));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 99 * 0.02, read(text, "", {7, {}, {}, 0.02}).t_s.back());
}

static void slow_channels_are_held_and_nothing_else(void)
{
    const std::string header = steady + ",v_dc_V,temp_winding_C\n";
    const auto log = read(header + "1,2,3,4,5,,\n1,2,3,4,6,48,25\n1,2,3,4,7,,26\n1,2,3,4,8,47,\n");
    TEST_ASSERT_EQUAL_size_t(4, log.rows());
    const double v_dc[] = {48, 48, 48, 47}, temp[] = {25, 25, 26, 26};
    for (int k = 0; k < 4; ++k) {
        TEST_ASSERT_EQUAL_DOUBLE(v_dc[k], log.v_dc_V[k]);
        TEST_ASSERT_EQUAL_DOUBLE(temp[k], log.temp_winding_C[k]);
    }
    expect_refused(steady + "\n1,2,3,4,5\n1,2,,4,5\n", "", 3, "i_d_A is empty");
    // A file that is mapped has holes of its own: rows are left out and counted, never filled.
    const auto holes = read("a,v_q_V,i_d_A,i_q_A,w_m_rad_s\n1,2,3,4,5\n,2,3,4,6\n2,2,3,4,7\n3,2,3,4,8\n",
                            "[columns]\nv_d_V = \"a\"\n");
    TEST_ASSERT_EQUAL_size_t(3, holes.rows());
    TEST_ASSERT_EQUAL_DOUBLE(7, holes.w_m_rad_s[1]);
    TEST_ASSERT_TRUE(noted("1 row left out, the first at line 3: no value of a"));
    TEST_ASSERT_EQUAL_size_t(
        2, read(header + "0,0,0,0,0,0,\n1,2,3,4,5,48,20\n1,2,3,4,6,48,20\n1,2,3,4,7,48,20\n").rows() - 1);
}

static void units_are_said_by_name(void)
{
    const dqw::Given given = {7, 9, 48, {}};
    const std::string csv =
        "vd,duty,id,iq,speed,angle,temp\n-1,0.5,10,2000,630,16384,300\n-1,0.25,10,2000,630,16384,300"
        "\n-1,-0.5,10,2000,630,16384,300\n";
    const std::string common =
        "[columns]\nv_d_V = { from = \"vd\", unit = \"mV\", offset = 0.5 }\nv_q_V = { from = "
        "\"duty\", unit = \"duty\" }\ni_d_A = { from = \"id\", times = \"duty\" }\ni_q_A = { from "
        "= \"iq\", unit = \"mA\" }\ntemp_winding_C = { from = \"temp\", unit = \"K\" }\n"
        "theta_e_rad = { from = \"angle\", unit = \"16-bit turns\" }\ntorque_Nm = { value = 2 }\n";
    const double pi = 3.14159265358979323846;
    const struct {
        const char* unit;
        double w;
    } speeds[] = {{"rad/s", 630},
                  {"rpm", 630 * pi / 30},
                  {"erpm", 630 * pi / 30 / 7},
                  {"electrical rad/s", 90},
                  {"Hz", 630 * 2 * pi / 7},
                  {"turns/s", 630 * 2 * pi},
                  {"deg/s", 630 * pi / 180},
                  {"rad/s output", 630 * 9},
                  {"rpm output", 630 * 9 * pi / 30}};
    for (const auto& speed : speeds) {
        const auto log = read(csv, common + "w_m_rad_s = { from = \"speed\", unit = \"" + speed.unit + "\" }\n", given);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-9 * speed.w, speed.w, log.w_m_rad_s[0], speed.unit);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, -0.0005, log.v_d_V[0]);
        const double v = 0.5 * 48 / std::sqrt(3.0);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, std::sqrt(v * v - 0.0005 * 0.0005), log.v_q_V[0]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, -log.v_q_V[0], log.v_q_V[2]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, 5, log.i_d_A[0]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, 2, log.i_q_A[0]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, pi / 2, log.theta_e_rad[0]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, 26.85, log.temp_winding_C[0]);
        TEST_ASSERT_EQUAL_DOUBLE(2, log.torque_Nm[1]);
        TEST_ASSERT_EQUAL_DOUBLE(48, log.v_dc_V[1]);
    }
    expect_refused(csv, common + "w_m_rad_s = { from = \"speed\", unit = \"erpm\" }\n", 1,
                   "pole pairs: --pole-pairs N");
    expect_refused(csv, common + "w_m_rad_s = { from = \"speed\", unit = \"rpm output\" }\n", 1, "--gear N");
    expect_refused(csv, common + "w_m_rad_s = { from = \"speed\" }\n", 1, "--v-dc V");
    expect_refused(csv, "[columns]\nw_m_rad_s = { from = \"speed\", unit = \"knots\" }\n", 2, "expected rad/s, ");
}

static void phases_are_turned(void)
{
    // One instant: d 3, q 4 A at 0.7 rad; d -1, q 10 V.
    const double a = 0.7, c = std::cos(a), s = std::sin(a), r3 = std::sqrt(3.0);
    const auto phase = [&](double d, double q, int n) {
        const double alpha = d * c - q * s, beta = d * s + q * c;
        return n == 0 ? alpha : n == 1 ? -alpha / 2 + r3 / 2 * beta : -alpha / 2 - r3 / 2 * beta;
    };
    const double va = phase(-1, 10, 0), vb = phase(-1, 10, 1), vc = phase(-1, 10, 2);
    char row[400];
    std::snprintf(row, sizeof row, "%.12g,%.12g,%.12g,%.12g,%.12g,%.12g,%.12g,%.12g,%.12g,0.7,100\n", phase(3, 4, 0),
                  phase(3, 4, 1), phase(3, 4, 2), va, vb, vc, va - vb, vb - vc, vc - va);
    const std::string csv = std::string("ia,ib,ic,va,vb,vc,vab,vbc,vca,theta_e_rad,w_m_rad_s\n") + row + row + row;
    for (const char* i : {"[\"ia\", \"ib\", \"ic\"]", "[\"ia\", \"ib\"]"})
        for (const char* v : {"[\"va\", \"vb\", \"vc\"]", "[\"va\", \"vb\"]", "[\"vab\", \"vbc\"], kind = \"line\"",
                              "[\"vab\", \"vbc\", \"vca\"], kind = \"line\""}) {
            const auto log = read(csv, std::string("[columns]\ni_dq_A = { from = ") + i + " }\nv_dq_V = { from = " + v +
                                           " }\n");
            TEST_ASSERT_DOUBLE_WITHIN(1e-9, 3, log.i_d_A[1]);
            TEST_ASSERT_DOUBLE_WITHIN(1e-9, 4, log.i_q_A[1]);
            TEST_ASSERT_DOUBLE_WITHIN(1e-9, -1, log.v_d_V[1]);
            TEST_ASSERT_DOUBLE_WITHIN(1e-9, 10, log.v_q_V[1]);
        }
    expect_refused(csv, "[columns]\ni_dq_A = { from = [\"ia\", \"iz\"] }\n", 1, "no column \"iz\"");
    expect_refused(csv, "[columns]\ni_dq_A = { from = [\"ia\"] }\n", 2, "expected 2 or 3");
    expect_refused(csv, "[columns]\ni_dq_A = { from = [\"ia\", \"ib\"], kind = \"line\" }\n", 2, "kind is \"line\"");
}

static void a_wrong_unit_is_warned_of_with_the_line_that_corrects_it(void)
{
    const command::Machine machine;
    std::string text = "t_s,v_d_V,v_q_V,i_d_A,iq,w_m_rad_s\n";
    for (std::size_t k = 0; k < 2000; ++k) {
        const auto r = machine.row(k);
        char line[200];
        std::snprintf(line, sizeof line, "%.9g,%.12g,%.12g,%.12g,%.12g,%.12g\n", 1e-4 * static_cast<double>(k), r.v_d_V,
                      r.v_q_V, 1e3 * r.i_d_A, 2e3 * r.i_q_A, r.w_m_rad_s);
        text += line;
    }
    const std::string half = "[columns]\ni_q_A = { from = \"iq\", scale = 0.5 }\n";
    read(text, half);
    TEST_ASSERT_TRUE(noted("warning: "));
    TEST_ASSERT_TRUE(noted("i_d_A = { from = \"i_d_A\", unit = \"mA\" }, i_q_A = { from = \"iq\", scale = 0.5, unit = "
                           "\"mA\" } under [columns]"));
    read(text, "[columns]\ni_d_A = { from = \"i_d_A\", unit = \"mA\" }\ni_q_A = { from = \"iq\", scale = 0.5, unit = "
               "\"mA\" }\n");
    TEST_ASSERT_FALSE(noted("warning: "));
}

static void a_format_nearly_there_says_what_differs(void)
{
    expect_refused("ms_today;input_voltage;erpm;d_axis_current;q_axis_current;\n1;2;3;4;5;\n", "", 1,
                   "nearly vesc_tool (VESC Tool, real-time CSV): \"duty_cycle\" missing");
    expect_refused(
        "T;I1;I2;I3;V1;V2;V3;I_tot;V_zero;Phase\n0;2048;2050;2047;1;2;3;4;5;0\n1;2048;2050;2047;1;2;3;4;5;9\n"
        "2;2048;2050;2047;1;2;3;4;5;9\n",
        "", 2, "raw ADC counts");
    expect_refused(
        "T;I1;I2;I3;V1;V2;V3;I_tot;V_zero;Phase\n0;1.5;1;1;1;2;3;4;5;0\n1;1;1;1;1;2;3;4;5;0\n2;1;1;1;1;2;3;4;"
        "5;0\n",
        "", 2, "Phase is 0");
    expect_refused("{\"a\": 1}\n", "", 1, "JSON of no format known");
    expect_refused("1651 1 0 0 100\n", "", 1, "Code Composer");
}

static void stamps_that_go_back_are_left_out_while_few(void)
{
    std::string head = "time,/s/avg_id,/s/avg_iq,/s/avg_vd,/s/avg_vq,/s/current_motor,/s/duty_cycle,/s/speed\n", text;
    for (int k = 0; k < 40; ++k)
        text += std::to_string(0.02 * (k == 20 ? 3 : k)) + ",0,1,0,2,1,0.1," + std::to_string(1000 + k) + "\n";
    TEST_ASSERT_EQUAL_size_t(39, read(head + text, "[machine]\npole_pairs = 7\n").rows());
    TEST_ASSERT_TRUE(noted("1 row left out, the first at line 22"));
    std::string back;
    for (int k = 0; k < 40; ++k) back += std::to_string(0.02 * (k % 2 ? k : 40 - k)) + ",0,1,0,2,1,0.1,1000\n";
    expect_refused(head + back, "[machine]\npole_pairs = 7\n", 3, "expected time to increase");
}

static void stamps_that_repeat_are_left_out_or_too_coarse(void)
{
    const std::string head = "t_s,v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s\n", machine = "[machine]\npole_pairs = 4\n";
    const auto rows_of = [](auto&& stamp) {
        std::string text;
        for (int k = 0; k < 100; ++k) text += fmt::format("{},1,2,{},1,{}\n", stamp(k), 0.1 * (k % 7), 100 + k);
        return text;
    };
    const std::string once = head + rows_of([](int k) { return fmt::format("{:.4f}", 1e-4 * (k == 50 ? 49 : k)); });
    const dqw::Log left = read(once, machine);
    TEST_ASSERT_EQUAL_size_t(99, left.rows());
    TEST_ASSERT_TRUE(noted("1 row left out, the first at line 52: its stamp is not after the row before"));
    TEST_ASSERT_EQUAL_size_t(2, left.segments.size());
    // Two recordings, one behind the other, that meet a step apart: no neighbours. Refused, but where columns are named.
    const std::string two = head + rows_of([](int k) { return fmt::format("{:.4f}", 1e-4 * (k < 9 ? k : k - 9)); });
    expect_refused(two, machine, 11, "t_s is 0 after 0.0008");
    const dqw::Log joined = read(two, machine + "[columns]\nt_s = { from = \"t_s\", unit = \"s\" }\n");
    TEST_ASSERT_EQUAL_size_t(91, joined.rows());
    TEST_ASSERT_EQUAL_size_t(2, joined.segments.size());
    TEST_ASSERT_EQUAL_size_t(9, joined.segments[1]);
    // Stamps that are coarser than the rows' steps by a fiftieth: what is left of these is even, and wrong.
    expect_refused(head + rows_of([](int k) { return fmt::format("{:.6f}", 1.02e-4 * std::floor(k / 1.02)); }), machine,
                   3, "2 of 100 stamps are the row before's; expected time to increase from row to row; --period S");
    // Ten rows to a stamp: what an exporter that rounds to milliseconds leaves.
    const std::string rounded = head + rows_of([](int k) { return fmt::format("{:.3f}", 1e-4 * k); });
    expect_refused(rounded, machine, 3, "--period S takes rows that are even as S apart");
    dqw::Given even;
    even.period_s = 1e-4;
    const dqw::Log log = read(rounded, machine, even);
    TEST_ASSERT_EQUAL_size_t(100, log.rows());
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1e-4, log.dt_s);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 99e-4, log.t_s.back());
    TEST_ASSERT_TRUE(noted("rows are taken 0.0001 s apart, whatever t_s says"));
}

static void voltages_of_another_file_are_joined_where_nothing_moves(void)
{
    const command::Folder folder;
    std::string stats = "timestamp,d_A,mode,q_A,velocity\r\n", control = "timestamp,d_V,q_V\r\n";
    const double p = 7, R = 0.05, L = 40e-6, psi = 4e-3, turn = 6.283185307179586;
    for (int k = 0; k < 600; ++k) {
        const int level = k / 40;
        const double w = 60 + 20 * (level % 6), q = 3 + 4 * (3 * level % 5), d = -2 * (level % 3), t = 0.01 * k;
        char line[200];
        std::snprintf(line, sizeof line, "%.6f,%.9g,10,%.9g,%.12g\r\n", t + 1e-3 * (k % 3), d, q, w / turn / 9);
        stats += line;
        std::snprintf(line, sizeof line, "%.6f,%.12g,%.12g\r\n", t + 4e-3, R * d - p * w * L * q,
                      R * q + p * w * (L * d + psi));
        control += line;
    }
    const std::string a = folder.write("base_1_servo_stats.csv", stats),
                      b = folder.write("base_1_servo_control.csv", control);
    for (const auto& files : {std::vector<std::string>{a, b}, {b, a}}) {
        const auto run = command::dqwatch({"fit", files[0], files[1], "--pole-pairs", "7", "--gear", "9"});
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
        // 14 changes of level, two rows each, and what stands before the first voltage.
        TEST_ASSERT_TRUE_MESSAGE(run.out.find("572 rows") != run.out.npos, run.out.c_str());
        TEST_ASSERT_TRUE_MESSAGE(run.out.find("50.0") != run.out.npos && run.out.find("4.000") != run.out.npos,
                                 run.out.c_str());
    }
    const auto alone = command::dqwatch({"fit", b, "--pole-pairs", "7"});
    TEST_ASSERT_EQUAL_INT(3, alone.code);
}

/// openinverter's decoded log: rows of 8789 Hz that count to 256, voltages in parts of a link that sags.
static std::string motor_data(double p, const std::function<double(double)>& link_V, int lost_from, int lost_to)
{
    const double R = 0.02, L = 0.3e-3, psi = 0.065, w = 200, T = 1 / 8789.0;
    std::string text = "Time(s),count,angle,idc,i1,i2,pwm1,opmode,uq,ud,iq,id,\n";
    for (int k = 0, row = 0; k < 4000; ++k) {
        if (k >= lost_from && k < lost_to) continue;
        const double t = k * T, f = 900, g = 700, d = -40 + 20 * std::sin(f * t), q = 80 + 30 * std::sin(g * t),
                     e = p * w, h = t + T / 2;
        const double v_d = R * (-40 + 20 * std::sin(f * h)) + L * 20 * f * std::cos(f * h) -
                           e * L * (80 + 30 * std::sin(g * h)),
                     v_q = R * (80 + 30 * std::sin(g * h)) + L * 30 * g * std::cos(g * h) +
                           e * (L * (-40 + 20 * std::sin(f * h)) + psi);
        const double percent = 100 / (37637.0 / 65536 * link_V(t));
        char line[300];
        std::snprintf(line, sizeof line, "%.6g,%d,%.8g,0,0,0,0,1,%.9g,%.9g,%d,%.9g,%.9g,\n", row++ * T, k % 256,
                      std::fmod(e * t, 6.283185307179586) * 360 / 6.283185307179586, percent * v_q, percent * v_d,
                      37 * k % 256, q, d);
        text += line;
    }
    return text;
}

static void lost_messages_are_a_gap_by_their_counter(void)
{
    const auto link = [](double) { return 350.0; };
    dqw::Given given;
    given.pole_pairs = 4, given.v_dc_V = 350;
    const auto whole = read(motor_data(4, link, 0, 0), "", given),
               less = read(motor_data(4, link, 1000, 1600), "", given);
    TEST_ASSERT_EQUAL_size_t(1, whole.segments.size());
    TEST_ASSERT_EQUAL_size_t(3400, less.rows());
    TEST_ASSERT_EQUAL_size_t(2, less.segments.size());
    TEST_ASSERT_EQUAL_size_t(1000, less.segments[1]);
    // 600 lost are 88 by a counter to 256.
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 89 / 8789.0, less.t_s[1000] - less.t_s[999]);
}

static void the_links_voltage_comes_from_the_file_beside_it(void)
{
    const command::Folder folder;
    const auto link = [](double t) { return 360 - 100 * t; };
    std::string spots = "Time(s),udc,tmpm\n";
    for (int k = 0; k < 16; ++k) spots += std::to_string(0.032 * k) + "," + std::to_string(link(0.032 * k)) + ",40\n";
    const std::string motor = folder.write("a_motor_data.csv", motor_data(4, link, 0, 0)),
                      spot = folder.write("a_spot_values.csv", spots);
    for (const auto& files : {std::vector<std::string>{motor, spot}, {spot, motor}}) {
        const auto run = command::dqwatch({"fit", files[0], files[1], "--pole-pairs", "4"});
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
        TEST_ASSERT_TRUE_MESSAGE(run.err.find("314.489 to 360 V") != run.err.npos ||
                                     run.err.find("312 to 360 V") != run.err.npos,
                                 run.err.c_str());
        TEST_ASSERT_TRUE_MESSAGE(run.out.find("65.0") != run.out.npos && run.out.find("300.") != run.out.npos,
                                 run.out.c_str());
    }
    const auto constant = command::dqwatch({"fit", motor, "--pole-pairs", "4", "--v-dc", "337"});
    TEST_ASSERT_TRUE_MESSAGE(constant.out.find("65.0") == constant.out.npos, constant.out.c_str());
    TEST_ASSERT_EQUAL_INT(3, command::dqwatch({"fit", spot, spot, "--pole-pairs", "4"}).code);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(comments_units_and_spaces_stand_before_the_rows);
    RUN_TEST(packed_and_piped_logs_are_read);
    RUN_TEST(clocks_are_understood);
    RUN_TEST(percent_signs_and_whole_seconds_are_no_trouble);
    RUN_TEST(slow_channels_are_held_and_nothing_else);
    RUN_TEST(units_are_said_by_name);
    RUN_TEST(phases_are_turned);
    RUN_TEST(a_wrong_unit_is_warned_of_with_the_line_that_corrects_it);
    RUN_TEST(a_format_nearly_there_says_what_differs);
    RUN_TEST(stamps_that_go_back_are_left_out_while_few);
    RUN_TEST(stamps_that_repeat_are_left_out_or_too_coarse);
    RUN_TEST(voltages_of_another_file_are_joined_where_nothing_moves);
    RUN_TEST(lost_messages_are_a_gap_by_their_counter);
    RUN_TEST(the_links_voltage_comes_from_the_file_beside_it);
    return UNITY_END();
}
