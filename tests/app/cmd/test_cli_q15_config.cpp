// The header that `learn --arith q15` and `trace` write for port_q15/: it compiles as strict C99, the estimator takes
// it, and what its comments say of formats is so. That of `monitor` makes a firmware tell what the command told.
// Plain only: long, and what it runs others run under the sanitizers.
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "app/firmware/q15_config.hpp"
#include "app/q15/fixed_point.hpp"
#include "command.hpp"
#include "mapped_drive.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

using command::Folder;
using nlohmann::json;

static void near(double expected, double value, double relative, const std::string& what)
{
    const std::string text = what + " is " + std::to_string(value) + ", expected " + std::to_string(expected);
    TEST_ASSERT_TRUE_MESSAGE(std::abs(value / expected - 1) <= relative, text.c_str());
}

/// The first number behind `words`, then the `more`-th after it.
static double number(const std::string& text, const std::string& words, int more = 0)
{
    const std::size_t at = text.find(words);
    TEST_ASSERT_TRUE_MESSAGE(at != std::string::npos, (words + " in\n" + text).c_str());
    const char* next = text.c_str() + at + words.size();
    for (int k = 0;; ++k) {
        next += std::strcspn(next, "0123456789\n");
        char* end = nullptr;
        const double x = std::strtod(next, &end);
        if (k == more) return x;
        next = end;
    }
}

/// Compiles `program` with the header in `folder` and all of port_q15/, and returns what it prints. `sizes`: options
/// more.
static std::string ran(const Folder& folder, const std::string& program, const std::string& argument = "",
                       const std::string& sizes = "")
{
    folder.write("main.c",
                 "#include \"dqw_q15_config.h\"\n#include \"dqw_q15_config.h\"\n#include <stdio.h>\n" + program);
    const auto build = command::run_program(
        {"sh", "-c",
         "${CC:-cc} $1 -std=c99 -pedantic -Wall -Wextra -Wconversion -Wsign-conversion -Wshadow -Werror -Ilib "
         "-Iport_q15 -I\"$0\" \"$0/main.c\" port_q15/*.c lib/dqw_gate.c lib/dqw_stage.c lib/dqw_change.c "
         "lib/dqw_watch.c "
         "lib/dqw_effect_name.c -lm -o \"$0/main\"",
         folder / "", sizes});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, build.code, build.err.c_str());
    const auto run = command::run_program(argument.empty() ? std::vector<std::string>{folder / "main"}
                                                           : std::vector<std::string>{folder / "main", argument});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
    return run.out;
}

static const std::string estimator =
    "static const dqw_estimator_q15_config config = {DQW_Q15_ESTIMATOR, .stale_limit = 10};\n"
    "static dqw_estimator_q15 e;\n";
static const std::string print_estimator =
    "    printf(\"estimator %d stale %u full %u %u %u dt %u p %u nominal %u %u %u %u half %u settled %d\\n\", "
    "(int)dqw_estimator_init_q15(&e, &config),\n"
    "           (unsigned)config.stale_limit, (unsigned)config.scale.v_full_mV, (unsigned)config.scale.i_full_mA, "
    "(unsigned)config.scale.w_full_mrad_s,\n"
    "           (unsigned)config.scale.dt_ns, (unsigned)config.scale.pole_pairs, (unsigned)config.R_uohm, "
    "(unsigned)config.Ld_nH, (unsigned)config.Lq_nH,\n"
    "           (unsigned)config.psi_nWb, (unsigned)config.half_window, (int)config.settled);\n";

static void a_dynamic_log()
{
    const Folder folder;
    const command::Machine m;
    command::write_log(folder / "joint.csv", 10000, m);
    const auto run = command::dqwatch(
        {"learn", folder / "joint.csv", "--arith", "q15", "--json", "--pole-pairs", "4", "--out", folder / ""});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
    const std::string header = command::read_file(folder / "dqw_q15_config.h");
    const std::string out = ran(folder,
                                estimator + "int main(void)\n{\n" + print_estimator +
                                    "    printf(\"unit %u %u %u %u\\n\", (unsigned)dqw_estimator_unit_q15(&config, "
                                    "DQW_R), (unsigned)dqw_estimator_unit_q15(&config, DQW_LD),\n"
                                    "           (unsigned)dqw_estimator_unit_q15(&config, DQW_LQ), "
                                    "(unsigned)dqw_estimator_unit_q15(&config, DQW_PSI));\n"
                                    "    return 0;\n}\n");
    near(10, number(out, "stale"), 0, "stale limit");
    TEST_ASSERT_EQUAL_MESSAGE(0, static_cast<int>(number(out, "estimator")), out.c_str());

    // Full scales hold the log's largest, with 1 % above it; nominal values are those learned.
    double largest[3] = {0, 0, 0};
    for (std::size_t k = 0; k < m.period; ++k) {
        const auto r = m.row(k);
        largest[0] = std::fmax(largest[0], std::fmax(std::abs(r.v_d_V), std::abs(r.v_q_V)));
        largest[1] = std::fmax(largest[1], std::fmax(std::abs(r.i_d_A), std::abs(r.i_q_A)));
        largest[2] = std::fmax(largest[2], std::abs(r.w_m_rad_s));
    }
    for (int k = 0; k < 3; ++k)
        near(1010 * largest[k], number(out, "full", k), 2e-4, "full scale " + std::to_string(k));
    near(1e5, number(out, "dt"), 1e-9, "dt");
    near(4, number(out, " p "), 0, "pole pairs");
    near(20, number(out, "half"), 0, "half a window");
    const json parameters = json::parse(run.out).at("parameters");
    const char* const names[] = {"R_ohm", "Ld_H", "Lq_H", "psi_Wb"};
    const double whole[] = {1e6, 1e9, 1e9, 1e9};
    for (int k = 0; k < 4; ++k) {
        near(whole[k] * parameters.at(names[k]).at("value").get<double>(), number(out, "nominal", k), 1e-5, names[k]);
        near(number(out, "nominal", k), number(out, "unit", k), 1e-9, names[k]);
    }

    // What the comments say, from the definitions: a signal is x_q15 full / 32768, a parameter's unit is made of the
    // full scales.
    const double V = 1e-3 * number(out, "full", 0), A = 1e-3 * number(out, "full", 1),
                 W = 1e-3 * number(out, "full", 2);
    const std::string signal[] = {"// v_d_q15, v_q_q15 ", "// i_d_q15, i_q_q15 ", "// w_m_q15 "};
    const double full[] = {V, A, W};
    for (int k = 0; k < 3; ++k) {
        near(15, number(header, signal[k]), 0, signal[k] + "Q");
        near(full[k], number(header, signal[k], 1), 1e-5, signal[k] + "full");
        near(full[k] / 32768, number(header, signal[k], 2), 1e-3, signal[k] + "last place");
    }
    const std::string parameter[] = {"\n// R ", "\n// L_d ", "\n// L_q ", "\n// psi "};
    for (int k = 0; k < 4; ++k) {
        const double nominal = number(out, "nominal", k) / whole[k];
        near(nominal, number(header, parameter[k], 0), 1e-5, parameter[k]);
        near(nominal / std::pow(2, 40), number(header, parameter[k], 1), 1e-3, parameter[k]);
    }
}

/// Settled rows of the same machine: no period.
static void settled_rows()
{
    const Folder folder;
    const command::Machine m;
    std::string log = "v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s\n";
    for (int k = 0; k < 40; ++k) {
        const double d = -3 + k % 4, q = -4 + k % 9, w = 40 + 7 * (k % 7);
        log += std::to_string(m.R_ohm * d - m.p * w * m.Lq_H * q) + "," +
               std::to_string(m.R_ohm * q + m.p * w * (m.Ld_H * d + m.psi_Wb)) + "," + std::to_string(d) + "," +
               std::to_string(q) + "," + std::to_string(w) + "\n";
    }
    folder.write("points *_ of a.csv", log);
    const auto run = command::dqwatch(
        {"trace", folder / "points *_ of a.csv", "--pole-pairs", "4", "--out", folder / ""});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
    const std::string out = ran(folder, estimator + "int main(void)\n{\n" + print_estimator + "    return 0;\n}\n");
    TEST_ASSERT_EQUAL_MESSAGE(0, static_cast<int>(number(out, "estimator")), out.c_str());
    TEST_ASSERT_EQUAL_MESSAGE(1, static_cast<int>(number(out, "settled")), out.c_str());
    near(1e6 * m.R_ohm, number(out, "nominal", 0), 1e-3, "R");
    near(1e9 * m.Ld_H, number(out, "nominal", 1), 1e-3, "L_d");
}

/// What learning found of an effect, as a firmware takes it: shape and start values are those that it printed.
static void effects_that_were_asked_for()
{
    const Folder folder;
    const auto sim = command::dqwatch({"sim", "effect_dead_time", "--set", "duration_s=1", "--out", folder / ""});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, sim.code, sim.err.c_str());
    const auto run = command::dqwatch({"learn", folder / "effect_dead_time.csv", "--arith", "q15", "--effect",
                                       "dead_time", "--effect", "voltage_offset", "--json", "--out", folder / ""});
    const json effect = json::parse(run.out).at("effects").at(0);
    TEST_ASSERT_EQUAL_STRING("dead_time", effect.at("name").get<std::string>().c_str());
    const std::string out = ran(folder, "static const dqw_effect_q15_config effects[] = {DQW_Q15_EFFECTS};\n"
                                        "static const dqw_estimator_q15_config config = {DQW_Q15_ESTIMATOR, .effects = "
                                        "effects, .effect_count = DQW_Q15_EFFECT_COUNT};\n"
                                        "static dqw_estimator_q15 e;\n"
                                        "int main(void)\n{\n    const int status = (int)dqw_estimator_init_q15(&e, "
                                        "&config);\n    printf(\"estimator %d effects %d weights %d width %u "
                                        "start %.9g full %u\\n\", status,\n"
                                        "           (int)config.effect_count, (int)e.effect.weights, "
                                        "(unsigned)effects[0].i_uA, (double)effects[0].start_q40[0],\n"
                                        "           (unsigned)config.scale.v_full_mV);\n    return 0;\n}\n");
    TEST_ASSERT_EQUAL_MESSAGE(0, static_cast<int>(number(out, "estimator")), out.c_str());
    near(2, number(out, "effects"), 0, "effects");
    // Dead time has a weight of the estimator's own.
    near(2, number(out, "weights"), 0, "weights");
    const json& parameters = effect.at("parameters");
    near(1e6 * parameters.at("width_A").at("value").get<double>(), number(out, "width"), 1e-5, "width");
    near(parameters.at("voltage_V").at("value").get<double>(),
         number(out, "start") / std::pow(2, 40) * 1e-3 * number(out, "full"), 1e-5, "dead time");
}

static const std::string firmware = R"(#include <math.h>
#include <stdlib.h>
#ifdef DQW_Q15_MONITOR_EFFECTS
static const dqw_effect_q15_config monitor_effects[] = {DQW_Q15_MONITOR_EFFECTS};
#endif
static const dqw_monitor_q15_config config = {DQW_Q15_MONITOR};
static dqw_monitor_q15 m;
static float column(char **at) { const float x = (float)strtod(*at, at); ++*at; return x; }
static int16_t part(float x, uint32_t full) { return (int16_t)floor((double)x / (1e-3 * full) * 32768.0 + 0.5); }
int main(int argc, char *argv[])
{
    char line[1000];
    FILE *log = argc == 2 ? fopen(argv[1], "r") : NULL;
    if (log == NULL || dqw_monitor_init_q15(&m, &config) != DQW_OK || fgets(line, sizeof line, log) == NULL) return 2;
    const dqw_scale *f = &config.estimator.scale;
    while (fgets(line, sizeof line, log) != NULL) {
        char *at = line;
        (void)column(&at);
        dqw_sample_q15 s = {0};
        s.v_d_q15 = part(column(&at), f->v_full_mV);
        s.v_q_q15 = part(column(&at), f->v_full_mV);
        s.i_d_q15 = part(column(&at), f->i_full_mA);
        s.i_q_q15 = part(column(&at), f->i_full_mA);
        s.w_m_q15 = part(column(&at), f->w_full_mrad_s);
        const double theta_rad = (double)column(&at);
        s = dqw_sample_from_dq_q15(s.v_d_q15, s.v_q_q15, s.i_d_q15, s.i_q_q15, s.w_m_q15,
                                   (uint16_t)(lround(theta_rad / 6.283185307179586 * 65536.0) & 65535));
        dqw_monitor_change_q15 e;
        (void)dqw_monitor_sample_q15(&m, &s, false);
        if (!dqw_monitor_background_q15(&m) || !dqw_monitor_event_q15(&m, &e)) continue;
        printf("event fault %d channel %d time %.9g value %.12g confidence %.9g\n", (int)e.fault.name, (int)e.parameter, (double)e.sample * 1e-9 * f->dt_ns,
               (double)e.value_q40 / 1099511627776.0 * (e.parameter == DQW_WATCH_PSI ? 1e-9 * config.estimator.psi_nWb : 1.0), e.fault.confidence_q15 / 32768.0);
    }
    (void)fclose(log);
    return 0;
}
)";

/// A firmware with the header that `monitor` wrote, and the log's samples as 16 bits, tells what `monitor` told, to the
/// last bit.
static void as_the_header_says(const Folder& folder, const std::string& log, const char* fault, dqw_fault_name fault_at,
                               const char* parameter, dqw_monitor_channel channel)
{
    const auto run = command::dqwatch({"monitor", log, "--arith", "q15", "--json", "--out", folder / ""});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
    // The last line says what could be seen.
    const json event = json::parse(run.out.substr(0, run.out.find('\n')));
    std::filesystem::rename(folder / "dqw_q15_monitor.h", folder / "dqw_q15_config.h");
    // With as many weights as it asks for.
    const std::string header = command::read_file(folder / "dqw_q15_config.h"), word = "DQW_EFFECT_WEIGHTS=";
    const std::size_t asks = header.find(word);
    TEST_ASSERT_TRUE(asks != std::string::npos);
    const std::string sizes = "-D" +
                              header.substr(asks, header.find_first_not_of("0123456789", asks + word.size()) - asks);
    const std::string out = ran(folder, firmware, log, sizes);
    TEST_ASSERT_EQUAL_STRING(fault, event.at("fault").get<std::string>().c_str());
    TEST_ASSERT_EQUAL_STRING(parameter, event.at("parameter").get<std::string>().c_str());
    near(fault_at, number(out, "fault"), 0, "fault");
    near(channel, number(out, "channel"), 0, "channel");
    near(event.at("t_s").get<double>(), number(out, "time"), 1e-5, "time");
    near(event.at("value").get<double>(), number(out, "value"), 1e-6, parameter);
    near(event.at("confidence").get<double>(), number(out, "confidence"), 1e-6, "confidence");
}

static void a_monitors_whole_configuration()
{
    const Folder folder;
    std::vector<std::string> args = {"sim", "joint_24v", "--out", folder / ""};
    for (const char* set : {"duration_s=3.2", "nonideal.dead_time_V=0.24", "nonideal.dead_time_width_A=0.05",
                            "nonideal.demagnetisation=0.05", "nonideal.demagnetisation.t_start_s=2",
                            "nonideal.demagnetisation.t_end_s=2.1"})
        args.insert(args.end(), {"--set", set});
    TEST_ASSERT_EQUAL_INT(0, command::dqwatch(args).code);
    as_the_header_says(folder, folder / "joint_24v.csv", "demagnetisation", DQW_FAULT_DEMAGNETISATION, "psi_Wb",
                       DQW_WATCH_PSI);
}

/// With a flux map as well: its table is in the header, and its weights are watched.
static void a_monitors_flux_map()
{
    const Folder folder;
    const std::string log = mapped_drive::changed(folder, "bends", {1, 0.85, 1}, 61, 5, 5);
    as_the_header_says(folder, log, "unknown", DQW_FAULT_UNKNOWN, "flux_map_q", DQW_WATCH_MAP_Q);
}

static void only_where_it_is_asked_for()
{
    const Folder folder;
    command::write_log(folder / "joint.csv", 4000);
    const auto run = command::dqwatch({"learn", folder / "joint.csv", "--pole-pairs", "4", "--out", folder / ""});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
    TEST_ASSERT_FALSE(std::filesystem::exists(folder / "dqw_q15_config.h"));
}

/// Which leg rests, and how late the angle is, go into the header, and a sample's legs into fixed point.
static void legs_that_rest_are_carried()
{
    dqw_monitor_q15_config c{};
    c.estimator.angle_late_ns = -25000;
    c.estimator.voltage_error_mV = 100;
    c.estimator.modulation = DQW_MODULATION_MASK;
    const std::string said = dqw::q15_monitor_text(c, "log.csv", {});
    TEST_ASSERT_TRUE_MESSAGE(
        said.find(", .angle_late_ns = -25000, .voltage_error_mV = 100u, .modulation = DQW_MODULATION_MASK") !=
            std::string::npos,
        said.c_str());
    c.estimator.angle_late_ns = 0;
    c.estimator.voltage_error_mV = 0;
    c.estimator.modulation = DQW_MODULATION_CENTRED;
    const std::string silent = dqw::q15_monitor_text(c, "log.csv", {});
    TEST_ASSERT_TRUE(silent.find("angle_late") == std::string::npos && silent.find("modulation") == std::string::npos &&
                     silent.find("voltage_error") == std::string::npos);
    dqw_sample s{};
    s.resting = 5;
    dqw_sample_q15 x{};
    TEST_ASSERT_TRUE(dqw::fixed(s, {10.0, 10.0, 10.0, 1e-4}, x));
    TEST_ASSERT_EQUAL_UINT8(5, x.resting);
}

/// What `learn` was told of the legs and of the angle stands in its header, and how it learned.
static void legs_and_observer_of_a_learned_log()
{
    const Folder folder;
    const auto sim = command::dqwatch({"sim", "drive_clamped_joint", "--set", "method=rk4", "--set", "duration_s=1",
                                       "--seed", "60493", "--out", folder / ""});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, sim.code, sim.err.c_str());
    const auto run = command::dqwatch({"learn", folder / "drive_clamped_joint.csv", "--arith", "q15", "--effect",
                                       "dead_time", "--json", "--out", folder / ""});
    const std::string header = command::read_file(folder / "dqw_q15_config.h");
    TEST_ASSERT_TRUE_MESSAGE(header.find(".angle = true, .modulation = DQW_MODULATION_CLAMPED_LOW\n") !=
                                 std::string::npos,
                             (run.err + header).c_str());
    const auto seen = command::dqwatch(
        {"sim", "drive_observer_joint", "--set", "method=rk4", "--set", "duration_s=1", "--out", folder / ""});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, seen.code, seen.err.c_str());
    (void)command::dqwatch({"learn", folder / "drive_observer_joint.csv", "--arith", "q15", "--out", folder / ""});
    const std::string other = command::read_file(folder / "dqw_q15_config.h");
    TEST_ASSERT_TRUE_MESSAGE(other.find(", .observed = true") != std::string::npos &&
                                 other.find("modulation") == std::string::npos,
                             other.c_str());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(legs_and_observer_of_a_learned_log);
    RUN_TEST(a_dynamic_log);
    RUN_TEST(settled_rows);
    RUN_TEST(effects_that_were_asked_for);
    RUN_TEST(a_monitors_whole_configuration);
    RUN_TEST(a_monitors_flux_map);
    RUN_TEST(only_where_it_is_asked_for);
    RUN_TEST(legs_that_rest_are_carried);
    return UNITY_END();
}
