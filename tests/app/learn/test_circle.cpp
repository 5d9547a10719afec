// The whole circle of Fig. 1: threshold missed, the log traced, the Learners defined anew with what was found,
// threshold met; and the header in which firmware gets it.
// Plain only: long, and what it runs others run under the sanitizers.
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <string>

#include "app/base/effect_names.hpp"
#include "app/firmware/model_config.hpp"
#include "app/learn/trace.hpp"
#include "command.hpp"
#include "dqw.h"
#include "ref/trace/trace.hpp"
#include "simulated.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

namespace {

void between(double low, double value, double high, const std::string& what)
{
    const std::string text = what + " is " + std::to_string(value) + ", bounds " + std::to_string(low) + " .. " +
                             std::to_string(high);
    TEST_ASSERT_TRUE_MESSAGE(value >= low && value <= high, text.c_str());
}

double value_of(const std::vector<dqw::Estimate>& list, const std::string& name)
{
    for (const auto& e : list)
        if (e.name == name) return e.value;
    return std::nan("");
}

dqw_sample sample_of(const dqw::Log& log, std::size_t k)
{
    const auto f = [](double x) { return static_cast<float>(x); };
    return dqw_sample_from_dq(f(log.v_d_V[k]), f(log.v_q_V[k]), f(log.i_d_A[k]), f(log.i_q_A[k]), f(log.w_m_rad_s[k]),
                              f(std::remainder(log.theta_e_rad[k], 6.283185307179586)));
}

/// Runs until the estimator has gone back, or the log ends.
void run(dqw_estimator& e, const dqw::Log& log)
{
    for (std::size_t k = 0; k < log.rows(); ++k) {
        const dqw_sample s = sample_of(log, k);
        if (dqw_estimator_sample(&e, &s, false) & DQW_EVENT_BLOCK) (void)dqw_estimator_background(&e);
        if (e.stage.name == DQW_STAGE_DOMAIN) return;
    }
}

dqw_nameplate nameplate_of(const dqw::Log& log) { return {static_cast<float>(log.dt_s), 150.0F, 15.0F, 200.0F, 4}; }

void the_circle_closes()
{
    const dqw::Log log = simulated("servo",
                                   {"nonideal.dead_time_V=4", "nonideal.dead_time_width_A=0.3", "noise=0.005"});
    const dqw_nameplate plate = nameplate_of(log);
    dqw_estimator_config config = dqw_estimator_config_default(&plate);
    config.threshold_ppm = 10000;
    config.dead_time_width_A = 0.0F;
    dqw_estimator e;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_init(&e, &config));

    // Threshold missed.
    run(e, log);
    TEST_ASSERT_EQUAL_INT(DQW_STAGE_DOMAIN, e.stage.name);
    TEST_ASSERT_EQUAL_INT(DQW_BACK_THRESHOLD, e.stage.back);
    between(1.2, static_cast<double>(dqw_estimator_read(&e, DQW_R).value) / 0.9, 3.0, "R over the true R, before");

    // Traced, without a hint.
    const dqw::TraceResult traced = dqw::trace({log});
    TEST_ASSERT_EQUAL_STRING("explained", traced.verdict.c_str());
    TEST_ASSERT_EQUAL_size_t(1, traced.inputs.size());
    TEST_ASSERT_EQUAL_STRING("dead_time", traced.inputs[0].effect.c_str());

    // Defined anew, threshold met.
    const dqw_effect_config effect = dqw::effect_config(traced.inputs[0]);
    config.dead_time_width_A = effect.shape[0];
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_estimator_define(&e, &config));
    TEST_ASSERT_EQUAL_INT(DQW_STAGE_RANDOM, e.stage.name);
    run(e, log);
    TEST_ASSERT_EQUAL_INT(DQW_STAGE_IN_SERVICE, e.stage.name);
    TEST_ASSERT_EQUAL_UINT32(1, e.stage.times_back);
    const dqw_reading voltage = dqw_estimator_read(&e, DQW_DEAD_TIME);
    TEST_ASSERT_TRUE(voltage.usable);
    between(3.95, static_cast<double>(voltage.value), 4.05, "dead time, V");
    between(0.99, static_cast<double>(dqw_estimator_read(&e, DQW_R).value) / 0.9, 1.01, "R over the true R, after");

    // The same on rows that were not learned.
    const dqw::TraceFit before = dqw::learn_fit({log}, traced, false);
    const dqw::TraceFit after = dqw::learn_fit({log}, traced, true);
    between(0.9, before.heldout_rms / traced.before.heldout_rms, 1.2, "learners' residual over the tracer's, before");
    between(0.9, after.heldout_rms / traced.after.heldout_rms, 1.2, "learners' residual over the tracer's, after");
    between(5.0, before.heldout_rms / after.heldout_rms, 100.0, "residual before over after");
    between(0.99, value_of(after.parameters, "R_ohm") / 0.9, 1.01, "R over the true R on training rows");
    TEST_ASSERT_EQUAL_size_t(2, after.axes.size());
    between(0.01, after.axes[1].percent, 1.0, "residual on q, %");
}

/// Runs until the monitor has gone back, or the log ends. Returns the second it ended at.
double run(dqw_monitor& m, const dqw::Log& log)
{
    for (std::size_t k = 0; k < log.rows(); ++k) {
        const dqw_sample s = sample_of(log, k);
        if (dqw_monitor_sample(&m, &s, false) & DQW_EVENT_BLOCK) (void)dqw_monitor_background(&m);
        if (dqw_monitor_stage(&m) == DQW_STAGE_DOMAIN) return log.t_s[k];
    }
    return log.t_s.back();
}

// A flux that ripples six times a turn by a tenth of itself: more than 5 % of the voltage stay unexplained without it.
void the_way_back_of_a_monitor_leads_into_service()
{
    const dqw::Log log = simulated("servo", {"nonideal.flux_harmonic_6d_Wb=0.012", "nonideal.flux_harmonic_6q_Wb=0.012",
                                             "noise=0.005", "duration_s=4"});
    const dqw_nameplate plate = nameplate_of(log);
    dqw_monitor_config config = dqw_monitor_config_default(&plate);
    dqw_monitor m;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_monitor_init(&m, &config));

    // Threshold missed; the log that is written then is traced.
    const double back_s = run(m, log);
    TEST_ASSERT_EQUAL_STRING(dqw_why_text(DQW_WHY_THRESHOLD), dqw_why_text(dqw_monitor_why(&m)));
    between(0.3, back_s, 3.0, "second of the way back");
    between(0.05, 1e-6 * m.estimator.stage.residual_ppm, 0.08, "residual then");
    const dqw::TraceResult traced = dqw::trace({log});
    TEST_ASSERT_EQUAL_STRING("explained", traced.verdict.c_str());
    TEST_ASSERT_EQUAL_size_t(1, traced.inputs.size());
    TEST_ASSERT_EQUAL_STRING("flux_harmonics", traced.inputs[0].effect.c_str());

    // Defined anew with what it found: in service, and nothing is wrong with the machine.
    const dqw_effect_config effect = dqw::effect_config(traced.inputs[0]);
    config.estimator.effects = &effect;
    config.estimator.effect_count = 1;
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_monitor_define(&m, &config));
    TEST_ASSERT_EQUAL_INT(DQW_STAGE_RANDOM, dqw_monitor_stage(&m));
    (void)run(m, log);
    TEST_ASSERT_EQUAL_STRING(dqw_why_text(DQW_WHY_IN_SERVICE), dqw_why_text(dqw_monitor_why(&m)));
    TEST_ASSERT_EQUAL_UINT32(1, m.estimator.stage.times_back);
    dqw_monitor_change none;
    TEST_ASSERT_FALSE(dqw_monitor_event(&m, &none));
    float weights[DQW_EFFECT_STARTS], sd[DQW_EFFECT_STARTS];
    const int known = dqw_estimator_read_effect(&m.estimator, 0, weights, sd);
    TEST_ASSERT_TRUE((known & 1) != 0 && (known & 8) != 0);
    between(11.8e-3, static_cast<double>(weights[0]), 12.2e-3, "cosine of d, Wb");
    between(11.8e-3, std::fabs(static_cast<double>(weights[3])), 12.2e-3, "sine of q, Wb");
    const struct {
        enum dqw_monitor_channel channel;
        double truth, within;
    } values[] = {{DQW_WATCH_R, 0.9, 0.01},
                  {DQW_WATCH_LD, 2.2e-3, 0.008},
                  {DQW_WATCH_LQ, 2.8e-3, 0.006},
                  {DQW_WATCH_PSI, 0.12, 0.002}};
    for (const auto& v : values)
        between(1.0 - v.within, static_cast<double>(dqw_monitor_read(&m, v.channel).value) / v.truth, 1.0 + v.within,
                dqw_parameter_text(v.channel));
}

dqw::TraceResult made(dqw::Regime regime, const std::vector<dqw::TraceInput>& inputs)
{
    dqw::TraceResult r;
    r.regime = regime;
    r.inputs = inputs;
    r.after.parameters = {{"R_ohm", 0.9, 0.01, false},
                          {"Ld_H", 2.2e-3, 1e-5, false},
                          {"pole_pairs", 4, 0, true},
                          {"J_kgm2", 2e-3, 1e-5, false}};
    return r;
}

/// Writes `header` and a program that uses it, compiles it with `compiler`, runs it and returns what it prints.
std::string compiled(const std::vector<std::string>& compiler, const std::string& extension, const std::string& header,
                     const std::string& program, const std::string& room = "12")
{
    const command::Folder folder;
    std::ofstream(folder / "dqw_model_config.h") << header;
    std::ofstream(folder / ("main." + extension))
        << "#include \"dqw_model_config.h\"\n#include \"dqw_model_config.h\"\n#include <stdio.h>\n"
        << program;
    std::vector<std::string> argv = compiler;
    for (const char* flag : {"-pedantic", "-Wall", "-Wextra", "-Wconversion", "-Wsign-conversion", "-Wdouble-promotion",
                             "-Wshadow", "-Werror", "-Ilib"})
        argv.emplace_back(flag);
    argv.push_back("-DDQW_EFFECT_WEIGHTS=" + room);
    argv.push_back("-I" + (folder / ""));
    argv.push_back(folder / ("main." + extension));
    argv.emplace_back("-o");
    argv.push_back(folder / "main");
    const auto build = command::run_program(argv);
    if (build.code != 0) return "not compiled: " + build.err;
    return command::run_program({folder / "main"}).out;
}

void the_header_compiles_and_says_what_was_found()
{
    const std::vector<std::string> c = {command::environment("CC", "cc"), "-std=c99"};
    const std::vector<std::string> cxx = {command::environment("CXX", "c++"), "-std=c++11"};
    const std::string program =
        "int main(void)\n{\n    dqw_monitor_config m = dqw_monitor_config();\n    dqw_estimator_config c = "
        "m.estimator;\n"
        "    m.estimator.encoder_offset = c.encoder_offset = true;\n"
        "    dqw_model_config_apply(&c);\n    dqw_model_config_apply_monitor(&m);\n"
        "    printf(\"%u %.4f %.3f %d\", (unsigned)c.pole_pairs, (double)c.R_ohm, (double)c.dead_time_width_A, "
        "(int)c.encoder_offset);\n"
        "    for (int i = 0; i < c.effect_count; i++) printf(\" %d %.3f %.3f\", (int)c.effects[i].effect, "
        "(double)c.effects[i].shape[0], (double)c.effects[i].start[0]);\n"
        "    printf(\" | %u %.3f %d\", (unsigned)m.estimator.effect_count, (double)m.estimator.dead_time_width_A, "
        "(int)m.estimator.encoder_offset);\n    return 0;\n}\n";
    std::string in_c = "static dqw_monitor_config zero;\n" + program;
    in_c.replace(in_c.find("dqw_monitor_config()"), 20, "zero");
    const std::string nasty = "/tmp/a*/b\nc\\.csv";
    // What a monitor watches by itself stands behind the rest.
    const auto with = made(dqw::Regime::dynamic, {{"dead_time", {0.3, 0.26}, {4.0}},
                                                  {"angle_offset", {2e-3, 3e-3, 0.1}, {0.05}},
                                                  {"saturation", {12.0}, {-1e-3, 0, 0, -2e-3, 0}}});
    const auto without = made(dqw::Regime::dynamic, {});
    const std::string found = "4 0.9000 0.300 0 2 12.000 -0.001 10 0.002 0.050 | 1 0.300 1";
    TEST_ASSERT_EQUAL_STRING(found.c_str(), compiled(c, "c", dqw::model_config_text(with, {nasty}), in_c).c_str());
    TEST_ASSERT_EQUAL_STRING(found.c_str(),
                             compiled(cxx, "cpp", dqw::model_config_text(with, {nasty}), program).c_str());
    TEST_ASSERT_EQUAL_STRING("4 0.9000 0.000 1 | 0 0.000 1",
                             compiled(c, "c", dqw::model_config_text(without), in_c).c_str());
    TEST_ASSERT_EQUAL_STRING("4 0.9000 0.000 1 | 0 0.000 1",
                             compiled(cxx, "cpp", dqw::model_config_text(without), program).c_str());
    dqw::TraceInput map{"flux_map", {0.25, 1.0, 2.0}, {1.0, 1.0}};
    map.map = {2, 1, 2, 1, 2, 3, 4, 5, 6, 7, 8};
    for (const bool plus : {false, true})
        TEST_ASSERT_EQUAL_STRING(
            ("4 0.9000 0.000 1 " + std::to_string(DQW_EFFECT_FLUX_MAP) + " 0.250 1.000 | 1 0.000 1").c_str(),
            compiled(plus ? cxx : c, plus ? "cpp" : "c", dqw::model_config_text(made(dqw::Regime::dynamic, {map})),
                     plus ? program : in_c)
                .c_str());
    // A library without room for them is refused by name.
    const std::string refused = compiled(c, "c", dqw::model_config_text(with), in_c, "3");
    TEST_ASSERT_TRUE_MESSAGE(refused.find("DQW_EFFECT_WEIGHTS=6") != std::string::npos, refused.c_str());
}

void the_header_of_a_shaft()
{
    const std::vector<std::string> c = {command::environment("CC", "cc"), "-std=c99"};
    const std::string program = "static dqw_shaft_config c;\nint main(void)\n{\n    dqw_model_config_apply(&c);\n"
                                "    printf(\"%.4f %u %d\", (double)c.J_kgm2, (unsigned)c.effect_count, "
                                "(int)c.effects[0].effect);\n    return 0;\n}\n";
    const auto found = made(dqw::Regime::mechanical, {{"coulomb_friction", {1.0}, {0.1}}});
    TEST_ASSERT_EQUAL_STRING(("0.0020 1 " + std::to_string(DQW_EFFECT_COULOMB_FRICTION)).c_str(),
                             compiled(c, "c", dqw::model_config_text(found), program).c_str());
}

void every_name_is_the_librarys()
{
    TEST_ASSERT_EQUAL_size_t(DQW_EFFECT_NAMES - 1, dqw::effect_names().size());
    for (std::size_t i = 0; i < dqw::effect_names().size(); ++i)
        TEST_ASSERT_EQUAL_INT_MESSAGE(static_cast<int>(i) + 1, *dqw::effect_named(dqw::effect_names()[i]),
                                      dqw::effect_names()[i].c_str());
}

}  // namespace

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(every_name_is_the_librarys);
    RUN_TEST(the_header_compiles_and_says_what_was_found);
    RUN_TEST(the_header_of_a_shaft);
    RUN_TEST(the_circle_closes);
    RUN_TEST(the_way_back_of_a_monitor_leads_into_service);
    return UNITY_END();
}
