// `monitor` on simulated logs with and without a fault: its events, what it says, the page it writes.
// Plain only: long, and what it runs others run under the sanitizers.
#include <cmath>
#include <cstdio>
#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "monitor_command.hpp"
#include "sharp_edges.hpp"
#include "slow_edges.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

using command::Folder;
using command::Outcome;
using monitor_command::count;
using monitor_command::holds;
using monitor_command::monitor;
using nlohmann::json;

/// A joint with 0.24 V of dead time; each of `sets` is a --set. Returns the log's path.
static std::string joint(const Folder& folder, const std::vector<std::string>& sets)
{
    std::vector<std::string> args = {"sim", "joint_24v", "--out", folder / ""};
    std::vector<std::string> all = {"duration_s=4", "nonideal.dead_time_V=0.24", "nonideal.dead_time_width_A=0.05"};
    all.insert(all.end(), sets.begin(), sets.end());
    for (const std::string& set : all) args.insert(args.end(), {"--set", set});
    const Outcome run = command::dqwatch(args);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
    return folder / "joint_24v.csv";
}

/// A fault that comes within 0.1 s from 2 s on.
static std::vector<std::string> fault(const std::string& key, const std::string& size)
{
    return {key + "=" + size, key + ".t_start_s=2", key + ".t_end_s=2.1"};
}

/// The last line of `text`: what could be seen, its schema checked.
static json sensitivity(const std::string& text)
{
    TEST_ASSERT_TRUE(text.size() > 1 && text.back() == '\n');
    const std::size_t before = text.rfind('\n', text.size() - 2);
    const json j = json::parse(text.substr(before == std::string::npos ? 0 : before + 1));
    TEST_ASSERT_EQUAL_STRING("dqwatch.sensitivity/1", j.at("schema").get<std::string>().c_str());
    TEST_ASSERT_TRUE(j.at("t_s").is_number());
    TEST_ASSERT_EQUAL_size_t(13, j.at("parameters").size());
    for (const auto& [name, p] : j.at("parameters").items()) {
        TEST_ASSERT_TRUE_MESSAGE(p.at("watched").get<bool>() != p.contains("why"), name.c_str());
        TEST_ASSERT_TRUE_MESSAGE(!p.at("watched").get<bool>() || p.at("least_change").get<double>() > 0, name.c_str());
    }
    return j.at("parameters");
}

/// Every line of `text` but the last as an event, its schema checked.
static std::vector<json> events(const std::string& whole)
{
    (void)sensitivity(whole);
    const std::size_t last = whole.rfind('\n', whole.size() - 2);
    const std::string text = whole.substr(0, last == std::string::npos ? 0 : last + 1);
    std::vector<json> all;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = text.find('\n', at);
        TEST_ASSERT_TRUE(end != std::string::npos);
        const json j = json::parse(text.substr(at, end - at));
        at = end + 1;
        for (const char* key : {"t_s", "value", "sd", "confidence", "since_s"})
            TEST_ASSERT_TRUE_MESSAGE(j.at(key).is_number(), key);
        TEST_ASSERT_EQUAL_STRING("dqwatch.event/1", j.at("schema").get<std::string>().c_str());
        TEST_ASSERT_TRUE(j.at("parameter").is_string() && j.at("fault").is_string());
        TEST_ASSERT_TRUE(j.at("confidence").get<double>() >= 0 && j.at("confidence").get<double>() <= 1);
        TEST_ASSERT_TRUE(j.at("since_s").get<double>() <= j.at("t_s").get<double>());
        all.push_back(j);
    }
    return all;
}

static json one_event(const std::string& text)
{
    const std::vector<json> all = events(text);
    TEST_ASSERT_EQUAL_size_t_MESSAGE(1, all.size(), text.c_str());
    return all[0];
}

static void a_healthy_machine_raises_no_event(void)
{
    const Folder folder;
    const std::string log = joint(folder, {"duration_s=6"});
    const Outcome machine = monitor({log, "--json", "--out", folder / "o"});
    TEST_ASSERT_EQUAL_size_t(0, events(machine.out).size());
    const Outcome text = monitor({log, "--out", folder / "o"});
    holds(text.out, "in service since 0.");
    holds(text.out, "refused  no sample");
    holds(text.out, "events   0");
    for (const char* name : {"R_ohm", "Ld_H", "Lq_H", "psi_Wb", "dead_time_V", "angle_rad", "offset_A",
                             "phase_resistance_ohm", "gain", "short_S", "residual_V"})
        holds(text.out, std::string("\n") + name + " ");
    holds(command::read_file(folder / "o/monitor.html"), "No parameter left its healthy band");
}

/// The columns of a log's `text` of these names, rows passed through `change`.
template <class Change> static std::string some_columns(const std::string& text, std::size_t columns, Change change)
{
    std::string out;
    std::size_t row = 0;
    for (std::size_t at = 0; at < text.size(); ++row) {
        const std::size_t end = text.find('\n', at);
        std::size_t cut = at;
        for (std::size_t c = 0; c < columns; ++c) cut = std::min(end, text.find(',', cut + (c > 0 ? 1 : 0)));
        if (row == 0 || change(row)) out.append(text, at, cut - at).append("\n");
        at = end + 1;
    }
    return out;
}

// What would be told, and what is not watched and why: lines, text and page, in both arithmetics.
static void what_could_be_seen_is_said(void)
{
    const Folder folder;
    const std::string log = joint(folder, {"duration_s=3"});
    // Bands of the joint, parts of the healthy values; a quarter more is told for sure, of ripples that are not alike
    // 16/15 of that. (E178)
    const std::vector<std::pair<const char*, double>> bands = {{"R_ohm", 0.04 * 0.5},
                                                               {"Ld_H", 0.06 * 1e-3},
                                                               {"Lq_H", 0.06 * 1.4e-3},
                                                               {"psi_Wb", 0.012 * 0.02},
                                                               {"angle_rad", 0.02},
                                                               {"gain", 0.03 * 16 / 15},
                                                               {"phase_resistance_ohm", 0.03 * 0.5 * 16 / 15},
                                                               {"temperature_K", 110}};
    for (const char* arith : {"float", "q15"}) {
        const std::vector<std::string> args = {log, "--arith", arith, "--out", folder / "o"};
        std::vector<std::string> as_json = args;
        as_json.emplace_back("--json");
        const json seen = sensitivity(monitor(as_json).out);
        for (const auto& [name, band] : bands) {
            TEST_ASSERT_TRUE_MESSAGE(seen.at(name).at("watched").get<bool>(), name);
            // Temperature has a limit, not a band.
            const double told = std::string(name) == "temperature_K" ? band : 1.25 * band;
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.03 * told, told, seen.at(name).at("least_change").get<double>(), name);
        }
        TEST_ASSERT_FALSE(seen.at("friction_Nm").at("watched").get<bool>());
        TEST_ASSERT_TRUE(seen.at("friction_Nm").at("least_change").is_null());
        holds(seen.at("friction_Nm").at("why").get<std::string>(), "the motion does not teach it: reversals");
        const std::string text = monitor(args).out, page = command::read_file(folder / "o/monitor.html");
        holds(text, "would be told\n");
        holds(text, "±300 µWb\n");
        holds(text, "above 11");
        holds(text, "\nnot watched at ");
        holds(text, "\n  friction_Nm: the motion does not teach it: reversals");
        holds(page, ">would be told<");
        holds(page, "Not watched at ");
        holds(page, "Friction</th><td>the motion does not teach it: reversals");
    }
    // A log that ends at rest still says what was seen before it.
    std::string rest = command::read_file(log);
    for (int k = 1; k <= 6000; ++k) {
        char line[200];
        const double noise = 1e-3 * (k % 2 == 0 ? 1 : -1);
        std::snprintf(line, sizeof line, "%.6f,%.4g,%.4g,%.4g,%.4g,%.4g,0\n", 3 + 5e-5 * (k - 1), noise, -noise, noise,
                      noise * (k % 3), -noise);
        rest += line;
    }
    const std::string ends = folder.write("rest.csv", some_columns(rest, 7, [](std::size_t) { return true; }));
    const std::string out =
        monitor({ends, "--machine", folder / "joint_24v.toml", "--json", "--out", folder / "o"}).out;
    for (const auto& [name, band] : bands)
        TEST_ASSERT_TRUE_MESSAGE(sensitivity(out).at(name).at("watched").get<bool>(), (name + out).c_str());
}

static void lost_flux_is_one_event_in_lines_text_and_page(void)
{
    const Folder folder;
    const std::string log = joint(folder, fault("nonideal.demagnetisation", "0.05"));
    const json e = one_event(monitor({log, "--json", "--out", folder / "o"}).out);
    TEST_ASSERT_EQUAL_STRING("psi_Wb", e.at("parameter").get<std::string>().c_str());
    TEST_ASSERT_EQUAL_STRING("demagnetisation", e.at("fault").get<std::string>().c_str());
    TEST_ASSERT_FALSE(e.contains("phase"));
    // 18.98 mWb at 2.50 s, since 2.03 s, with 0.99.
    TEST_ASSERT_DOUBLE_WITHIN(0.5, 2.5, e.at("t_s").get<double>());
    // To a segment of 0.35 s.
    TEST_ASSERT_DOUBLE_WITHIN(0.36, 2.05, e.at("since_s").get<double>());
    TEST_ASSERT_DOUBLE_WITHIN(0.1e-3, 19.0e-3, e.at("value").get<double>());
    TEST_ASSERT_DOUBLE_WITHIN(0.1e-3, 20.0e-3, e.at("healthy").get<double>());
    TEST_ASSERT_TRUE(e.at("sd").get<double>() > 5e-6 && e.at("sd").get<double>() < 2e-4);
    TEST_ASSERT_TRUE(e.at("confidence").get<double>() > 0.8);

    const std::string out = monitor({log, "--out", folder / "o"}).out, line = out.substr(0, out.find('\n'));
    char begin[60];
    const int length = std::snprintf(begin, sizeof begin, "%.3f s  demagnetisation: psi_Wb ",
                                     e.at("t_s").get<double>());
    TEST_ASSERT_EQUAL_size_t_MESSAGE(0, line.find(begin), line.c_str());
    TEST_ASSERT_DOUBLE_WITHIN(0.005, 1e3 * e.at("value").get<double>(), std::stod(line.substr(length)));
    std::snprintf(begin, sizeof begin, ", since %.3f s, confidence %.2f", e.at("since_s").get<double>(),
                  e.at("confidence").get<double>());
    holds(line, begin);
    holds(out, "events   1");

    const std::string page = command::read_file(folder / "o/monitor.html");
    std::snprintf(begin, sizeof begin, "named at %.3f", e.at("t_s").get<double>());
    holds(page, "The magnets have lost flux (demagnetisation)");
    holds(page, "1 event</span>");
    TEST_ASSERT_EQUAL_size_t(1, count(page, "class=\"pin\""));
}

static void faults_have_their_names_and_phases(void)
{
    const struct {
        const char *key, *size, *name, *parameter, *phase;
        double value, within;
    } cases[] = {
        {"nonideal.turn_short", "0.05", "turn_short", "short_S", "a", 0.0267, 0.005},
        {"nonideal.current_gain_b", "0.1", "current_gain", "gain", "b", 0.095, 0.03},
        {"nonideal.angle_offset_rad", "0.05", "encoder_offset", "angle_rad", "", 0.05, 0.008},
        {"nonideal.phase_connection_ohm", "0.1", "phase_connection", "phase_resistance_ohm", "a", 0.07, 0.02},
        {"nonideal.current_offset_alpha_A", "0.3", "current_offset", "offset_A", "", 0.28, 0.04},
    };
    for (const auto& c : cases) {
        const Folder folder;
        std::vector<std::string> sets = fault(c.key, c.size);
        sets.insert(sets.end(), {"nonideal.turn_short_ohm=0.05", "duration_s=3.5"});
        const json e = one_event(monitor({joint(folder, sets), "--json", "--out", folder / "o"}).out);
        TEST_ASSERT_EQUAL_STRING(c.name, e.at("fault").get<std::string>().c_str());
        TEST_ASSERT_EQUAL_STRING(c.phase, e.value("phase", "").c_str());
        // A fault is seen in several channels; the one furthest out tells.
        const bool own = e.at("parameter").get<std::string>() == c.parameter;
        if (own) TEST_ASSERT_DOUBLE_WITHIN(c.within, c.value, e.at("value").get<double>());
        TEST_ASSERT_DOUBLE_WITHIN(0.8, 2.8, e.at("t_s").get<double>());

        // The same in whole numbers; one look is 16 ms.
        const json q = one_event(
            monitor({folder / "joint_24v.csv", "--arith", "q15", "--json", "--out", folder / "o"}).out);
        TEST_ASSERT_EQUAL_STRING(c.name, q.at("fault").get<std::string>().c_str());
        TEST_ASSERT_EQUAL_STRING(c.phase, q.value("phase", "").c_str());
        // An opening may be a segment earlier or later.
        TEST_ASSERT_DOUBLE_WITHIN(0.4, e.at("t_s").get<double>(), q.at("t_s").get<double>());
        TEST_ASSERT_DOUBLE_WITHIN(0.1, e.at("confidence").get<double>(), q.at("confidence").get<double>());
        if (!own || q.at("parameter").get<std::string>() != c.parameter) continue;
        TEST_ASSERT_DOUBLE_WITHIN(c.within, c.value, q.at("value").get<double>());
        // What lasts of the residual may be just below notice in one of them.
        const double wider = q.at("sd").get<double>() / e.at("sd").get<double>();
        TEST_ASSERT_TRUE(wider > 0.25 && wider < 4.0);
    }
}

// Faults that grow from 1 s on, when healthy values are only just being learned: what is told as healthy is what was
// before, within a band.
static void what_grows_while_healthy_is_learned_is_not_taken_in(void)
{
    const struct {
        const char *scenario, *parameter, *fault, *phase;
        double healthy, band;
    } cases[] = {
        {"fault_demagnetisation", "psi_Wb", "demagnetisation", "", 0.12, 0.012 * 0.12},
        {"fault_phase_connection", "phase_resistance_ohm", "phase_connection", "a", 0.0, 0.03 * 0.9 / 3},
        {"fault_turn_short", "short_S", "turn_short", "a", 0.0, 0.003 / (3 * 0.9)},
    };
    for (const auto& c : cases) {
        const Folder folder;
        TEST_ASSERT_EQUAL_INT(0, command::dqwatch({"sim", c.scenario, "--out", folder / ""}).code);
        for (const char* arith : {"float", "q15"}) {
            const json e = one_event(
                monitor({folder / c.scenario + ".csv", "--arith", arith, "--json", "--out", folder / "o"}).out);
            TEST_ASSERT_EQUAL_STRING(c.parameter, e.at("parameter").get<std::string>().c_str());
            TEST_ASSERT_EQUAL_STRING(c.fault, e.at("fault").get<std::string>().c_str());
            TEST_ASSERT_EQUAL_STRING(c.phase, e.value("phase", "").c_str());
            TEST_ASSERT_DOUBLE_WITHIN(c.band, c.healthy, e.at("healthy").get<double>());
            TEST_ASSERT_TRUE(e.at("t_s").get<double>() < 3.0);
        }
    }
}

// A friction is half the difference of two directions: it takes 32 reversals to be known, and as many to be another.
static void a_worn_bearing_is_told(void)
{
    const Folder folder;
    TEST_ASSERT_EQUAL_INT(0, command::dqwatch({"sim", "fault_bearing", "--out", folder / ""}).code);
    for (const char* arith : {"float", "q15"}) {
        const json e = one_event(
            monitor({folder / "fault_bearing.csv", "--arith", arith, "--json", "--out", folder / "o"}).out);
        TEST_ASSERT_EQUAL_STRING("bearing_wear", e.at("fault").get<std::string>().c_str());
        TEST_ASSERT_DOUBLE_WITHIN(7.0, 22.0, e.at("t_s").get<double>());
        // 1e-3 Nms/rad at 71 rad/s, what the stretches beside a reversal have; 0.8 Nm and as much again come in.
        TEST_ASSERT_DOUBLE_WITHIN(0.02, 0.071, e.at("healthy").get<double>());
        TEST_ASSERT_TRUE(e.at("value").get<double>() > 0.5 && e.at("value").get<double>() < 0.071 + 0.871 + 0.1);
    }
}

static void an_angle_and_a_machine_file_are_no_must(void)
{
    const Folder folder;
    const std::string log = joint(folder, fault("nonideal.demagnetisation", "0.1"));
    const auto all = [](std::size_t) { return true; };
    const std::string angle = folder.write("angle.csv", some_columns(command::read_file(log), 7, all)),
                      bare = folder.write("bare.csv", some_columns(command::read_file(log), 6, all));

    const Outcome first = monitor({angle, "--json", "--out", folder / "o"});
    holds(first.err, "pole pairs found: 4, from the electrical angle");
    TEST_ASSERT_EQUAL_STRING("demagnetisation", one_event(first.out).at("fault").get<std::string>().c_str());
    holds(first.err, "R_ohm, Ld_H, Lq_H, psi_Wb not said: learning starts from the log's first 2 s");
    holds(first.err, "friction is not watched: no J_kgm2");

    const Outcome second = monitor({bare, "--machine", folder / "joint_24v.toml", "--out", folder / "o"});
    holds(second.err, "no theta_e_rad or theta_m_rad");
    TEST_ASSERT_TRUE(second.err.find("not said") == std::string::npos);
    // Without the ripple it may be taken for shorted turns, and the residual be further out.
    holds(second.out, "events   1");
    holds(second.out, " mWb  17.");
    const std::string page = command::read_file(folder / "o/monitor.html");
    // No value, and why: once.
    const std::string why = ": the configuration does not ask for it: there is no theta_e_rad or theta_m_rad\n";
    holds(second.out, "  dead_time_V, angle_rad, offset_A, phase_resistance_ohm, gain, short_S" + why);
    TEST_ASSERT_EQUAL_size_t(1, count(page, "Dead time, encoder angle"));
    for (const char* name : {"dead_time_V", "short_S"})
        TEST_ASSERT_EQUAL_size_t_MESSAGE(1, count(second.out, name), name);
    for (const char* name : {"dead_time_V", "Encoder angle", "short_S"})
        TEST_ASSERT_EQUAL_size_t_MESSAGE(0, count(page, name), name);
    holds(page, "no theta_e_rad or theta_m_rad");
}

static void events_keep_the_logs_time(void)
{
    const Folder folder;
    const std::string key = "nonideal.demagnetisation";
    const std::string log = joint(folder, {"duration_s=4", key + "=0.05", key + ".t_start_s=3", key + ".t_end_s=3.1"});
    // 0.26 s are missing before the fault.
    const std::string gap = folder.write("gap.csv", some_columns(command::read_file(log), 7, [](std::size_t row) {
                                             return row < 34000 || row > 40000 - 800;
                                         }));
    const Outcome run = monitor({gap, "--machine", folder / "joint_24v.toml", "--json", "--out", folder / "o"});
    const json e = one_event(run.out);
    holds(run.err, "1 gap in time");
    TEST_ASSERT_DOUBLE_WITHIN(0.36, 3.05, e.at("since_s").get<double>());
    TEST_ASSERT_DOUBLE_WITHIN(0.3, 3.9, e.at("t_s").get<double>());
}

// Sampling that stands still for 0.1 s, time running on, is no fault of the machine.
static void frozen_rows_are_counted_and_told_nothing(void)
{
    const Folder folder;
    const std::string text = command::read_file(joint(folder, {"duration_s=4"}));
    std::string out, frozen;
    std::size_t row = 0;
    for (std::size_t at = 0; at < text.size(); ++row) {
        const std::size_t end = text.find('\n', at), comma = text.find(',', at);
        if (row == 50000) frozen = text.substr(comma, end - comma);
        out += row > 50000 && row <= 52000 ? text.substr(at, comma - at) + frozen : text.substr(at, end - at);
        out += '\n';
        at = end + 1;
    }
    const std::string log = folder.write("frozen.csv", out);
    for (const char* arith : {"float", "q15"}) {
        const Outcome run = monitor(
            {log, "--machine", folder / "joint_24v.toml", "--arith", arith, "--out", folder / "o"});
        holds(run.out, "events   0");
        holds(run.out, "1991 stuck");
    }
}

/// Before a segment has ended weights stand for one another, and the speed's first step multiplies the residual: neither
/// is a fault of a drive that was switched on half a second ago. (E63)
static void what_has_just_been_switched_on_is_no_fault(void)
{
    const Folder folder;
    const std::vector<std::string> both = {"inverter.dead_time_s=3.97728e-07",
                                           "method=rk4",
                                           "duration_s=2",
                                           "profile.speed_rad_s=272.509",
                                           "profile.speed_rad_s.wave=136.254",
                                           "profile.speed_rad_s.wave_period_s=0.809835",
                                           "profile.speed_rad_s.shape=square",
                                           "profile.load_Nm.random=0.468283",
                                           "profile.load_Nm.random_hold_s=0.113729",
                                           "profile.i_d_A=-4.37251",
                                           "profile.i_d_A.random=0",
                                           "sensing.speed_bandwidth_rad_s=300",
                                           "inverter.dead_side=both",
                                           "sensing.observer=true",
                                           "noise.step_theta_m_rad=0",
                                           "sensing.observer_load_rad_A=2.74832e-05",
                                           "sensing.observer_noise_rad=0.0223224",
                                           "sensing.observer_corner_rad_s=100",
                                           "sensing.observer_bandwidth_rad_s=500"};
    // Without the rest a dead time of -34 mV is taken for healthy, and then a residual of 75 mV.
    for (const std::vector<std::string>& rest :
         {std::vector<std::string>{"nonideal.iron_loss_S=0", "nonideal.iron_hysteresis_S_rad_s=0", "sensing.filter_s=0",
                                   "sensing.observer_lag_s=2.05858e-06"},
          std::vector<std::string>{}}) {
        std::vector<std::string> args = {"sim", "drive_clamped_fast", "--seed", "522576", "--out", folder / ""};
        for (const auto& sets : {kIdealSwitches, both, rest})
            for (const std::string& set : sets) args.insert(args.end(), {"--set", set});
        const Outcome sim = command::dqwatch(args);
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, sim.code, sim.err.c_str());
        for (const char* arith : {"float", "q15"}) {
            const Outcome run = monitor({folder / "drive_clamped_fast.csv", "--arith", arith, "--out", folder / "o"});
            holds(run.out, "in service since");
            holds(run.out, "events   0");
        }
    }
}

/// Slow edges lose voltage over a wide range of currents: with the usual width R reads 38 % too large. What widths an
/// octave apart make of R is in its deviation.
static void dead_time_has_the_width_that_leaves_least(void)
{
    const Folder folder;
    std::vector<std::string> args = {"sim", "drive_clamped", "--out", folder / ""};
    for (const std::string& set : kSlowEdges) args.insert(args.end(), {"--set", set});
    TEST_ASSERT_EQUAL_INT(0, command::dqwatch(args).code);
    const Outcome run = monitor({folder / "drive_clamped.csv", "--out", folder / "o"});
    holds(run.err, "dead_time: a width of 1.2");
    holds(run.err, "the speed is 1.3");
    double healthy = 0.0, R_mohm = 0.0, sd_mohm = 0.0;
    const std::size_t at = run.out.find("\nR_ohm");
    TEST_ASSERT_TRUE(at != std::string::npos &&
                     std::sscanf(run.out.c_str() + at + 6, "%lf mΩ %lf ± %lf", &healthy, &R_mohm, &sd_mohm) == 3);
    TEST_ASSERT_DOUBLE_WITHIN(0.05 * 900, 900, healthy);
    TEST_ASSERT_DOUBLE_WITHIN(2.0 * sd_mohm, 900, R_mohm);
    TEST_ASSERT_TRUE(3.0 * sd_mohm < 0.1 * 900);
}

/// Edges that no current of the log leaves are as good as a resistance, and nothing but a fit with a width of its own
/// shows that R, 0.9 ohm, is not known.
static void what_slow_edges_hide_is_not_known(void)
{
    const Folder folder;
    std::vector<std::string> args = {"sim", "drive_clamped", "--out", folder / ""};
    std::vector<std::string> settings = sharp_edges();
    for (const char* set :
         {"seed=60552", "inverter.dead_time_s=6.9e-7", "inverter.node_F=4.8e-9", "inverter.modulation=centred",
          "profile.speed_rad_s=-2.5", "profile.speed_rad_s.wave=84", "profile.speed_rad_s.wave_period_s=3.3",
          "profile.load_Nm.random=2", "profile.load_Nm.random_hold_s=0.18", "profile.i_d_A.random=2.9",
          "profile.i_d_A.random_hold_s=0.065", "duration_s=5"})
        settings.emplace_back(set);
    for (const std::string& set : settings) args.insert(args.end(), {"--set", set});
    TEST_ASSERT_EQUAL_INT(0, command::dqwatch(args).code);
    // The second run takes from the first one's store what no residual shows.
    for (int n = 0; n < 2; ++n) {
        const Outcome run = monitor({folder / "drive_clamped.csv", "--out", folder / "o", "--store", folder / "store"});
        double healthy = 0.0, R_ohm = 0.0, sd_ohm = 0.0;
        const std::size_t at = run.out.find("\nR_ohm");
        TEST_ASSERT_TRUE(at != std::string::npos &&
                         std::sscanf(run.out.c_str() + at + 6, "%lf Ω %lf ± %lf", &healthy, &R_ohm, &sd_ohm) == 3);
        TEST_ASSERT_TRUE_MESSAGE(R_ohm > 1.2 && 3.0 * sd_ohm > 0.9 * R_ohm, run.out.c_str());
        holds(run.out, "events   0");
    }
}

/// A speed that a loop tells is late. Rows that are missing where it turns round say nothing of how it changed.
static void a_gap_while_a_late_speed_turns_round_is_no_event(void)
{
    const Folder folder;
    std::vector<std::string> args = {"sim", "drive_clamped_joint", "--set", "method=rk4", "--out", folder / ""};
    for (const char* set :
         {"seed=496628", "duration_s=6", "inverter.dead_time_s=4e-7", "inverter.modulation=centred",
          "inverter.dead_side=both", "nonideal.iron_loss_S=0", "sensing.filter_s=0",
          "sensing.speed_bandwidth_rad_s=750", "profile.speed_rad_s=-19.4", "profile.speed_rad_s.wave=55.6",
          "profile.speed_rad_s.wave_period_s=3.99", "profile.speed_rad_s.shape=square", "profile.load_Nm.random=0.17",
          "profile.load_Nm.random_hold_s=0.0757", "profile.i_d_A.random=1.5", "profile.i_d_A.random_hold_s=0.031"})
        args.insert(args.end(), {"--set", set});
    const Outcome sim = command::dqwatch(args);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, sim.code, sim.err.c_str());
    const std::string text = command::read_file(folder / "drive_clamped_joint.csv");
    std::string out;
    int missing = 0;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = text.find('\n', at);
        double v_q_V = 0.0;
        const bool full = std::sscanf(text.c_str() + at, "%*f,%*f,%lf", &v_q_V) == 1 && std::fabs(v_q_V) > 12.7;
        if (!full) out += text.substr(at, end - at + 1);
        missing += full ? 1 : 0;
        at = end + 1;
    }
    TEST_ASSERT_TRUE(missing > 5 && missing < 50);
    const std::string log = folder.write("gap.csv", out);
    for (const char* arith : {"float", "q15"}) {
        const Outcome run = monitor(
            {log, "--machine", folder / "drive_clamped_joint.toml", "--arith", arith, "--out", folder / "o"});
        holds(run.out, "events   0");
    }
}

static void a_way_back_is_told_and_learning_goes_on(void)
{
    const Folder folder;
    // A voltage that no model has: an event without a name, then stage 1.
    const std::string log = joint(folder,
                                  {"duration_s=4", "nonideal.disturbance_V=3", "nonideal.disturbance_Hz=37",
                                   "nonideal.disturbance_V.t_start_s=2", "nonideal.disturbance_V.t_end_s=2.001"});
    for (const char* arith : {"float", "q15"}) {
        const Outcome run = monitor({log, "--arith", arith, "--out", folder / "o"});
        holds(run.out, "unknown: residual_V");
        holds(run.err, "note: back to stage 1 at 3.");
        holds(run.err, "threshold 5 %");
        holds(run.out, "back to stage 1");
        holds(command::read_file(folder / "o/monitor.html"), "learned anew");
    }
}

// What the trace of a log found goes into the monitor: the way back leads into service.
static void what_a_trace_found_is_learned(void)
{
    const Folder folder;
    const Outcome sim = command::dqwatch({"sim", "servo", "--set", "duration_s=4", "--set", "noise=0.005", "--set",
                                          "nonideal.flux_harmonic_6d_Wb=0.012", "--set",
                                          "nonideal.flux_harmonic_6q_Wb=0.012", "--out", folder / ""});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, sim.code, sim.err.c_str());
    const std::string log = folder / "servo.csv";
    const Outcome without = monitor({log, "--out", folder / "o"});
    holds(without.err, "back to stage 1");
    holds(without.err, "the model lacks something, dqwatch trace tells what");
    TEST_ASSERT_TRUE(without.out.find("in service") == std::string::npos);

    TEST_ASSERT_EQUAL_INT(0, command::dqwatch({"trace", log, "--out", folder / "t"}).code);
    for (const std::vector<std::string>& with :
         {std::vector<std::string>{"--config", folder / "t/trace.json"}, {"--effect", "flux_harmonics"}}) {
        std::vector<std::string> args = {log, "--out", folder / "o"};
        args.insert(args.end(), with.begin(), with.end());
        const Outcome run = monitor(args);
        holds(run.out, "in service since 0.");
        holds(run.out, "events   0");
        TEST_ASSERT_TRUE_MESSAGE(run.err.find("not used") == std::string::npos &&
                                     run.err.find("back to stage") == std::string::npos,
                                 run.err.c_str());
    }

    // What it cannot have, it says.
    const std::string other =
        monitor({log, "--effect", "coulomb_friction", "--effect", "dead_time", "--out", folder / "o"}).err;
    holds(other, "not used: coulomb_friction");
    TEST_ASSERT_TRUE_MESSAGE(other.find("dead_time") == std::string::npos, other.c_str());
    const Outcome room = command::dqwatch({"monitor", log, "--effect", "saturation", "--effect", "cross_saturation",
                                           "--effect", "flux_harmonics", "--effect", "voltage_offset", "--out",
                                           folder / "o"});
    TEST_ASSERT_EQUAL_INT(3, room.code);
    holds(room.err, "these effects have 14 weights together; the learners have room for 12 (DQW_EFFECT_WEIGHTS)");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_healthy_machine_raises_no_event);
    RUN_TEST(what_could_be_seen_is_said);
    RUN_TEST(lost_flux_is_one_event_in_lines_text_and_page);
    RUN_TEST(faults_have_their_names_and_phases);
    RUN_TEST(what_grows_while_healthy_is_learned_is_not_taken_in);
    RUN_TEST(a_worn_bearing_is_told);
    RUN_TEST(an_angle_and_a_machine_file_are_no_must);
    RUN_TEST(events_keep_the_logs_time);
    RUN_TEST(what_a_trace_found_is_learned);
    RUN_TEST(frozen_rows_are_counted_and_told_nothing);
    RUN_TEST(what_has_just_been_switched_on_is_no_fault);
    RUN_TEST(dead_time_has_the_width_that_leaves_least);
    RUN_TEST(what_slow_edges_hide_is_not_known);
    RUN_TEST(a_gap_while_a_late_speed_turns_round_is_no_event);
    RUN_TEST(a_way_back_is_told_and_learning_goes_on);
    return UNITY_END();
}
