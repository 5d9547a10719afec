// `trace` on good logs and on poor ones: what it writes, what it says, how it refuses.
// Plain only: long, and what it runs others run under the sanitizers.
#include <sys/stat.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "command.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

using command::Folder;
using command::Outcome;
using nlohmann::json;

/// The plain machine's log as text; each row passed through `change`.
template <class Change> static std::string log_text(std::size_t rows, Change change)
{
    const command::Machine machine;
    std::string text = "t_s,v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s\n";
    for (std::size_t k = 0; k < rows; ++k) {
        command::Machine::Row r = machine.row(k);
        change(k, r);
        char line[200];
        std::snprintf(line, sizeof line, "%.6f,%.7g,%.7g,%.7g,%.7g,%.7g\n", static_cast<double>(k) * machine.dt_s,
                      r.v_d_V, r.v_q_V, r.i_d_A, r.i_q_A, r.w_m_rad_s);
        text += line;
    }
    return text;
}

/// Some noise on v, the same each time.
static double noise(std::size_t k, unsigned salt)
{
    std::uint64_t z = (k + 1) * 0x9E3779B97F4A7C15u + salt * 0xD1B54A32D192ED03u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return 0.3 * (static_cast<double>((z ^ (z >> 31)) >> 11) / 9007199254740992.0 - 0.5);
}

static std::string noisy(std::size_t rows)
{
    return log_text(rows,
                    [](std::size_t k, command::Machine::Row& r) { r.v_d_V += noise(k, 1), r.v_q_V += noise(k, 2); });
}

/// A constant 2 V on d and -3 V on q, known before the tracer saw it.
static std::string offset(std::size_t rows, unsigned seed = 1)
{
    return log_text(rows, [seed](std::size_t k, command::Machine::Row& r) {
        r.v_d_V += 2 + noise(k, seed), r.v_q_V += -3 + noise(k, seed + 1);
    });
}

static json traced(std::vector<std::string> args)
{
    args.insert(args.begin(), "trace");
    args.push_back("--json");
    const Outcome run = command::dqwatch(args);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
    return json::parse(run.out);
}

static void expect_fit(const json& fit)
{
    TEST_ASSERT_TRUE(fit.at("heldout_rms").is_number());
    for (const auto& [name, entry] : fit.at("parameters").items())
        TEST_ASSERT_TRUE_MESSAGE(
            entry.at("value").is_number() && (entry.value("given", false) || entry.at("sd").is_number()), name.c_str());
}

static void expect_schema(const json& j)
{
    TEST_ASSERT_EQUAL_STRING("dqwatch.trace/1", j.at("schema").get<std::string>().c_str());
    for (const char* name : {"verdict", "regime", "unit"}) TEST_ASSERT_TRUE(j.at(name).is_string());
    TEST_ASSERT_TRUE(j.at("rows").is_number_integer());
    TEST_ASSERT_TRUE(j.at("heldout_rows").get<long>() > 0 && j.at("heldout_rows") < j.at("rows"));
    TEST_ASSERT_TRUE(j.at("noise_floor").is_number());
    for (const char* name : {"before", "after"}) {
        expect_fit(j.at(name));
        expect_fit(j.at("learner").at(name));
    }
    for (const json& e : j.at("effects")) {
        TEST_ASSERT_TRUE(e.at("name").is_string() && e.at("heldout_rms_after").is_number() &&
                         e.at("confusable_with").is_array());
        TEST_ASSERT_TRUE(!e.at("parameters").empty());
    }
    for (const json& r : j.at("rejected"))
        TEST_ASSERT_TRUE(!r.at("name").get<std::string>().empty() && !r.at("why").get<std::string>().empty());
}

static void a_known_dead_time_is_found_and_written_down(void)
{
    const Folder folder;
    const Outcome sim = command::dqwatch({"sim", "servo", "--out", folder / "", "--set", "duration_s=1", "--set",
                                          "nonideal.dead_time_V=4", "--set", "nonideal.dead_time_width_A=0.2"});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, sim.code, sim.err.c_str());
    const std::string dir = folder / "a/b";
    const json j = traced({folder / "servo.csv", "--out", dir});
    expect_schema(j);
    TEST_ASSERT_EQUAL_STRING("explained", j.at("verdict").get<std::string>().c_str());
    TEST_ASSERT_EQUAL_size_t_MESSAGE(1, j.at("effects").size(), j.at("effects").dump().c_str());
    const json& effect = j.at("effects").at(0);
    TEST_ASSERT_EQUAL_STRING("dead_time", effect.at("name").get<std::string>().c_str());
    // 4.05 V, 0.90 ohm; 1.35 V before and 0.18 V after.
    TEST_ASSERT_DOUBLE_WITHIN(0.12, 4, effect.at("parameters").at("voltage_V").at("value").get<double>());
    TEST_ASSERT_DOUBLE_WITHIN(0.03, 0.9, j.at("after").at("parameters").at("R_ohm").at("value").get<double>());
    // Of the same rows the learners know no more than the reference.
    for (const char* when : {"before", "after"})
        for (const auto& [name, entry] : j.at("learner").at(when).at("parameters").items())
            if (!entry.value("given", false))
                TEST_ASSERT_TRUE_MESSAGE(entry.at("sd").get<double>() >=
                                             j.at(when).at("parameters").at(name).at("sd").get<double>(),
                                         name.c_str());
    for (const json& fits : {j, j.at("learner")})
        TEST_ASSERT_TRUE(fits.at("after").at("heldout_rms").get<double>() <
                         0.2 * fits.at("before").at("heldout_rms").get<double>());
    TEST_ASSERT_EQUAL_STRING(j.dump().c_str(), json::parse(command::read_file(dir + "/trace.json")).dump().c_str());
    const std::string page = command::read_file(dir + "/report.html");
    TEST_ASSERT_TRUE(page.find("The inverter loses") != std::string::npos &&
                     page.rfind("</html>\n") == page.size() - 8);
    TEST_ASSERT_TRUE(command::read_file(dir + "/dqw_model_config.h")
                         .find("config->dead_time_width_A = DQW_MODEL_DEAD_TIME_WIDTH_A;") != std::string::npos);
}

static void the_text_says_it_in_a_sentence(void)
{
    const Folder folder;
    const std::string path = folder.write("log.csv", offset(4000));
    const Outcome run = command::dqwatch({"trace", path, "--pole-pairs", "4", "--out", folder / "o"});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
    TEST_ASSERT_EQUAL_size_t(0, run.out.find("A constant voltage is in the log: "));
    for (const char* part : {" V in d, ", "(voltage offset)", "explained: dynamic, 4000 rows", "noise floor",
                             "learners in firmware", "v_q_V", "not taken"})
        TEST_ASSERT_TRUE_MESSAGE(run.out.find(part) != std::string::npos, part);
    const std::string wrote = "note: wrote " + folder / "o/trace.json" + ", " + (folder / "o/report.html") + ", ";
    TEST_ASSERT_TRUE_MESSAGE(run.err.find(wrote) != std::string::npos, run.err.c_str());
}

/// Firmware has no clock for heat that goes with time: the current that warms is null, and what reads the answer says why
/// it leaves it out.
static void heat_that_goes_with_time_is_not_learned(void)
{
    const Folder folder;
    folder.write("log.csv", noisy(2000));
    folder.write("log.toml", "[log]\nregime = \"dynamic\"\n[machine]\npole_pairs = 4\n");
    for (const bool by_time : {false, true}) {
        folder.write("heat.json",
                     std::string("{\"inputs\": [{\"effect\": \"winding_temperature\", \"shape\": [25, 0.2, ") +
                         (by_time ? "null" : "8") + "], \"weights\": [0.1]}]}");
        const Outcome learned = command::dqwatch({"learn", folder / "log.csv", "--config", folder / "heat.json"});
        TEST_ASSERT_TRUE_MESSAGE(learned.code != 3, learned.err.c_str());
        TEST_ASSERT_EQUAL_INT_MESSAGE(by_time,
                                      (learned.out + learned.err).find("its heat goes with time") != std::string::npos,
                                      learned.out.c_str());
    }
}

static void a_clean_log_names_nothing(void)
{
    const Folder folder;
    TEST_ASSERT_EQUAL_INT(0, command::dqwatch({"sim", "servo", "--out", folder / "", "--set", "duration_s=1"}).code);
    const json j = traced({folder / "servo.csv", "--out", folder / "o"});
    expect_schema(j);
    TEST_ASSERT_EQUAL_STRING("clean", j.at("verdict").get<std::string>().c_str());
    TEST_ASSERT_TRUE(j.at("effects").empty());
}

static void only_what_is_named_is_tried(void)
{
    const Folder folder;
    const std::string path = folder.write("log.csv", offset(4000));
    const json j = traced(
        {path, "--pole-pairs", "4", "--out", folder / "o", "--effect", "delay", "--effect", "iron_loss"});
    for (const json& e : j.at("effects")) TEST_ASSERT_TRUE(e.at("name") == "delay" || e.at("name") == "iron_loss");
    for (const json& r : j.at("rejected"))
        TEST_ASSERT_TRUE_MESSAGE(r.at("name") == "delay" || r.at("name") == "iron_loss", r.dump().c_str());
}

static void several_logs_are_traced_jointly(void)
{
    const Folder folder;
    const std::string a = folder.write("a.csv", offset(4000)), b = folder.write("b.csv", offset(4000, 3));
    const json j = traced({a, b, "--pole-pairs", "4", "--out", folder / "o"});
    TEST_ASSERT_EQUAL_INT(8000, j.at("rows").get<int>());
    TEST_ASSERT_EQUAL_size_t(2, j.at("logs").size());
    TEST_ASSERT_EQUAL_STRING("voltage_offset", j.at("effects").at(0).at("name").get<std::string>().c_str());
}

/// Whatever is not tested is named with the reason.
static void expect_untested(const json& j, const char* effect, const char* reason)
{
    for (const json& r : j.at("rejected"))
        if (r.at("name") == effect) {
            TEST_ASSERT_TRUE_MESSAGE(r.at("why").get<std::string>().find(reason) != std::string::npos,
                                     r.dump().c_str());
            return;
        }
    TEST_FAIL_MESSAGE((std::string(effect) + " is not among the rejected: " + j.at("rejected").dump()).c_str());
}

/// Exit code 3, one line that begins with the file's name, and nothing written.
static void expect_refused(const Folder& folder, const std::string& path, std::vector<std::string> args,
                           const std::string& reason)
{
    std::vector<std::string> all = {args[0], path, "--pole-pairs", "4", "--out", folder / "refused"};
    all.insert(all.end(), args.begin() + 1, args.end());
    const Outcome run = command::dqwatch(all);
    TEST_ASSERT_EQUAL_INT_MESSAGE(3, run.code, (path + reason + run.err).c_str());
    TEST_ASSERT_TRUE_MESSAGE(run.err.find(folder / "") == 0 && run.err.find('\n') == run.err.size() - 1,
                             run.err.c_str());
    TEST_ASSERT_TRUE_MESSAGE(run.err.find(reason) != std::string::npos, run.err.c_str());
    TEST_ASSERT_EQUAL_STRING("", run.out.c_str());
    TEST_ASSERT_FALSE(std::filesystem::exists(folder / "refused/trace.json"));
}

/// `text` with the line of that number, the header's being 1, changed to `line`.
static std::string with_line(std::string text, int number, const std::string& line)
{
    std::size_t from = 0;
    for (; number > 1; --number) from = text.find('\n', from) + 1;
    return text.replace(from, text.find('\n', from) - from, line);
}

static std::string settled(std::size_t rows)
{
    const command::Machine m;
    std::string text = "v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s\n";
    for (std::size_t k = 0; k < rows; ++k) {
        const double d = -4 + static_cast<double>(k % 9), q = -5 + static_cast<double>(k / 9 % 11),
                     w = 50 + 10 * static_cast<double>(k % 7);
        const double v_d = m.R_ohm * d - m.p * w * m.Lq_H * q + 2 + noise(k, 1),
                     v_q = m.R_ohm * q + m.p * w * (m.Ld_H * d + m.psi_Wb) - 3 + noise(k, 2);
        text += std::to_string(v_d) + "," + std::to_string(v_q) + "," + std::to_string(d) + "," + std::to_string(q) +
                "," + std::to_string(w) + "\n";
    }
    return text;
}

static std::string shaft(std::size_t rows)
{
    std::string text = "t_s,torque_Nm,w_m_rad_s\n";
    for (std::size_t k = 0; k < rows; ++k)
        text += std::to_string(1e-3 * static_cast<double>(k)) + "," + std::to_string(1 + noise(k, 1)) + "," +
                std::to_string(10 + 1e-3 * noise(k, 2)) + "\n";
    return text;
}

static void poor_logs_are_refused_in_one_line(void)
{
    const Folder folder;
    const std::string good = noisy(2000), header = good.substr(0, good.find('\n') + 1);
    // Ten rows, then a tenth of a second without any.
    const std::string ridden = log_text(2000, [](std::size_t, command::Machine::Row&) {});
    std::string gaps = header;
    std::size_t row = 0;
    for (std::size_t at = header.size(); at < ridden.size(); ++row) {
        const std::size_t comma = ridden.find(',', at), end = ridden.find('\n', at) + 1;
        gaps += std::to_string(1e-4 * static_cast<double>(row) + 0.1 * static_cast<double>(row / 10)) +
                ridden.substr(comma, end - comma);
        at = end;
    }
    const struct {
        std::string text;
        const char* reason;
    } cases[] = {
        {"", ":1: an empty file"},
        {header, ":1: a header and no data"},
        {header.substr(0, header.size() - 1), ":1: a header and no data"},
        {header + "0,1,2,3,4,5\n", ":2: 1 row only"},
        {with_line(good, 57, "0.0055,nan,1,1,1,1"), ":57: v_d_V is \"nan\""},
        {with_line(good, 57, "0.0055,1,-inf,1,1,1"), ":57: v_q_V is \"-inf\""},
        {with_line(good, 57, "0.0055,1,1,,1,1"), ":57: i_d_A is empty"},
        {with_line(good, 57, "0.0055,1,1,1,1e300,1"), ":57: i_q_A is 1e+300"},
        {with_line(good, 57, "0.0055,1,1,1,1,-2e18"), ":57: w_m_rad_s is -2e+18"},
        {gaps, "in even pieces"},
        {settled(5), "to hold some out"},
        {shaft(100), "to hold some out"},
    };
    for (const auto& c : cases) expect_refused(folder, folder.write("log.csv", c.text), {"trace"}, c.reason);
    const std::string a = folder.write("a.csv", good), b = folder.write("b.csv", settled(400)),
                      c = folder.write("c.csv", shaft(2000));
    expect_refused(folder, a, {"trace", b}, "b.csv:1: a steady log");
    expect_refused(folder, a, {"trace", c}, "c.csv:1: a mechanical log");
    expect_refused(folder, a, {"trace", "--effect", "coulomb_friction"},
                   "a.csv:1: coulomb_friction is of a mechanical");
    expect_refused(folder, c, {"trace", "--effect", "dead_time"}, "c.csv:1: dead_time is of an electrical");
}

static void what_is_no_trace_starts_no_learner(void)
{
    const Folder folder;
    const std::string log = folder.write("log.csv", offset(4000)), still = folder.write("settled.csv", settled(400));
    traced({log, "--pole-pairs", "4", "--out", folder / "o"});
    const std::string good = command::read_file(folder / "o/trace.json");
    for (const std::string& text :
         {std::string(), good.substr(0, good.size() / 2), good.substr(0, good.size() - 3), noisy(3),
          std::string("[1, 2]"), std::string(R"({"schema": "dqwatch.result/1", "parameters": {}})"),
          std::string(R"({"inputs": [{"effect": "gremlins"}]})"),
          std::string(R"({"schema": "dqwatch.trace/99", "inputs": []})")})
        for (const char* command : {"learn", "fit"})
            expect_refused(folder, log, {command, "--config", folder.write("broken.json", text)}, "broken.json:");
    expect_refused(folder, log, {"learn", "--config", folder / "absent.json"}, "absent.json:0: ");
    expect_refused(folder, log, {"learn", "--config", folder / "o"}, "is a directory");
    // A shape that cannot be, and effects that these logs cannot have.
    expect_refused(
        folder, log,
        {"learn", "--config", folder.write("x.json", R"({"inputs": [{"effect": "dead_time", "shape": [-1]}]})")},
        "its width is not above 0 A");
    for (const char* command : {"learn", "fit"}) {
        expect_refused(folder, log, {command, "--effect", "cogging_torque"}, "cogging_torque is");
        expect_refused(folder, still, {command, "--effect", "flux_harmonics"}, "angle column");
    }
    TEST_ASSERT_EQUAL_INT(
        0, command::dqwatch({"learn", log, "--pole-pairs", "4", "--config", folder / "o/trace.json"}).code);
}

static void one_operating_point_says_what_cannot_be_tested(void)
{
    const Folder folder;
    std::string text = "v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s\n";
    for (std::size_t k = 0; k < 400; ++k)
        text += std::to_string(-2.4 + noise(k, 1)) + "," + std::to_string(21.0 + noise(k, 2)) + ",-1," +
                std::to_string(2 + 1e-3 * noise(k, 3)) + ",100\n";
    const std::string path = folder.write("log.csv", text);
    const json j = traced({path, "--pole-pairs", "4", "--out", folder / "o"});
    TEST_ASSERT_TRUE_MESSAGE(j.at("effects").empty(), j.at("effects").dump().c_str());
    for (const char* effect : {"skin_effect", "delay", "angle_offset"}) expect_untested(j, effect, "change");
    expect_untested(j, "flux_harmonics", "angle");
    for (const json& r : j.at("rejected")) TEST_ASSERT_TRUE(r.at("heldout_rms").is_null());
    // The learners can tell nothing either, so there is no number of theirs.
    TEST_ASSERT_TRUE(j.at("learner").empty());
    TEST_ASSERT_TRUE(j.at("notes").dump().find("no learners") != std::string::npos);
    const std::string page = command::read_file(folder / "o/report.html"),
                      out = command::dqwatch({"trace", path, "--pole-pairs", "4", "--out", folder / "o"}).out;
    for (const std::string& said : {page, out}) {
        TEST_ASSERT_TRUE(said.find("no effect could be tested on this log") != std::string::npos);
        TEST_ASSERT_TRUE(said.find("not tested: one operating point: neither the currents nor the speed change") !=
                         std::string::npos);
    }
}

static void unknown_pole_pairs_are_in_no_table(void)
{
    const Folder folder;
    const std::string path = folder.write("log.csv", settled(600));
    const Outcome run = command::dqwatch({"trace", path, "--out", folder / "o"});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
    TEST_ASSERT_TRUE_MESSAGE(run.err.find("the pole pairs are not known") != std::string::npos, run.err.c_str());
    const json j = json::parse(command::read_file(folder / "o/trace.json"));
    for (const json& fits : {j, j.at("learner")})
        for (const char* name : {"before", "after"}) {
            TEST_ASSERT_FALSE(fits.at(name).at("parameters").contains("pole_pairs"));
            // Four times 50 mWb.
            TEST_ASSERT_DOUBLE_WITHIN(name[0] == 'a' ? 0.002 : 0.1, 0.2,
                                      fits.at(name).at("parameters").at("psi_Wb").at("value").get<double>());
        }
    const json& psi = j.at("after").at("parameters").at("psi_Wb");
    TEST_ASSERT_FALSE(psi.at("usable").get<bool>());
    TEST_ASSERT_EQUAL_STRING("this is its product with the pole pairs, which are not known",
                             psi.at("why").get<std::string>().c_str());
    TEST_ASSERT_TRUE(run.out.find("\np ") == std::string::npos);
    // No machine has these as they are, so firmware starts from nothing.
    const std::string config = command::read_file(folder / "o/dqw_model_config.h");
    TEST_ASSERT_TRUE(config.find("DQW_MODEL_R_OHM 0.5") != std::string::npos &&
                     config.find("DQW_EFFECT_VOLTAGE_OFFSET") != std::string::npos);
    for (const char* name : {"DQW_MODEL_PSI_WB", "DQW_MODEL_LD_H", "DQW_MODEL_POLE_PAIRS"})
        TEST_ASSERT_TRUE_MESSAGE(config.find(name) == std::string::npos, name);
}

static void logs_without_current_or_speed_are_traced(void)
{
    const Folder folder;
    const auto shortened = [](auto change) {
        return log_text(2000, [=](std::size_t k, command::Machine::Row& r) { change(k, r); });
    };
    const std::string open = shortened([](std::size_t k, command::Machine::Row& r) {
        r = {noise(k, 1), 0.2 * r.w_m_rad_s + noise(k, 2), 0, 0, r.w_m_rad_s};
    });
    const json turning = traced({folder.write("open.csv", open), "--pole-pairs", "4", "--out", folder / "o"});
    for (const char* effect : {"dead_time", "saturation", "iron_loss"})
        expect_untested(turning, effect, "the currents do not change");
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, 0.05, turning.at("after").at("parameters").at("psi_Wb").at("value").get<double>());
    const std::string nothing = shortened([](std::size_t, command::Machine::Row& r) { r = {}; });
    TEST_ASSERT_TRUE(traced({folder.write("nothing.csv", nothing), "--pole-pairs", "4", "--out", folder / "o"})
                         .at("effects")
                         .empty());
    const json constant = traced({folder.write("shaft.csv", shaft(2000)), "--out", folder / "o"});
    expect_untested(constant, "stribeck_friction", "the speed");
}

static void a_dead_time_at_standstill_is_found(void)
{
    const Folder folder;
    std::string text = "v_d_V,v_q_V,i_d_A,i_q_A\n";
    // Along the axis of a phase: it loses V, the two others half their current with V each, 2/3 (V + V) on the axis.
    for (std::size_t k = 0; k < 600; ++k) {
        const double i = -10 + 20 * static_cast<double>(k) / 599;
        const double lost = 2 / 3.0 * (std::tanh(i / 0.3) + std::tanh(0.5 * i / 0.3));
        text += std::to_string(0.5 * i + 4 * lost + 0.1 * noise(k, 1)) + "," + std::to_string(0.1 * noise(k, 2)) + "," +
                std::to_string(i) + ",0\n";
    }
    const json j = traced({folder.write("log.csv", text), "--out", folder / "o"});
    TEST_ASSERT_EQUAL_STRING("standstill", j.at("regime").get<std::string>().c_str());
    TEST_ASSERT_EQUAL_size_t_MESSAGE(1, j.at("effects").size(), j.at("effects").dump().c_str());
    TEST_ASSERT_EQUAL_STRING("dead_time", j.at("effects").at(0).at("name").get<std::string>().c_str());
    TEST_ASSERT_DOUBLE_WITHIN(0.08, 4,
                              j.at("effects").at(0).at("parameters").at("voltage_V").at("value").get<double>());
    TEST_ASSERT_DOUBLE_WITHIN(0.01, 0.5, j.at("after").at("parameters").at("R_ohm").at("value").get<double>());
}

static void a_log_of_nothing_is_not_clean(void)
{
    const Folder folder;
    std::string text = "t_s,v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s\n";
    for (int k = 0; k < 2000; ++k) text += std::to_string(k * 1e-4) + ",0,0,0,0,0\n";
    const json j = traced({folder.write("log.csv", text), "--pole-pairs", "4", "--out", folder / "o"});
    TEST_ASSERT_EQUAL_STRING("unexplained", j.at("verdict").get<std::string>().c_str());
    TEST_ASSERT_EQUAL_size_t(0, j.at("effects").size());
}

static void a_log_without_angle_or_temperature_is_traced(void)
{
    // No angle, no time to integrate a speed over: settled points.
    const Folder folder;
    const json j = traced({folder.write("log.csv", settled(600)), "--pole-pairs", "4", "--out", folder / "o"});
    TEST_ASSERT_EQUAL_STRING("steady", j.at("regime").get<std::string>().c_str());
    TEST_ASSERT_EQUAL_STRING("voltage_offset", j.at("effects").at(0).at("name").get<std::string>().c_str());
    expect_untested(j, "flux_harmonics", "angle");
    expect_untested(j, "current_offset", "angle");
}

static void too_few_rows_to_hold_some_out_are_refused(void)
{
    const Folder folder;
    for (const std::size_t rows : {30u, 60u}) {
        const std::string path = folder.write("log.csv", noisy(rows));
        const Outcome run = command::dqwatch({"trace", path, "--pole-pairs", "4", "--out", folder / "o"});
        const std::string begin = path + ":" + std::to_string(rows + 1) + ": ";
        TEST_ASSERT_EQUAL_INT_MESSAGE(3, run.code, run.err.c_str());
        TEST_ASSERT_EQUAL_size_t_MESSAGE(0, run.err.find(begin), run.err.c_str());
        TEST_ASSERT_TRUE_MESSAGE(run.err.find('\n') == run.err.size() - 1, run.err.c_str());
        TEST_ASSERT_FALSE(std::filesystem::exists(folder / "o/trace.json"));
    }
}

/// A constant load is a load: friction that is more one way than Coulomb friction would drive the shaft the other.
static void a_load_is_no_friction(void)
{
    const Folder folder;
    const Outcome sim = command::dqwatch({"sim", "effect_friction", "--set", "machine.coulomb_Nm=0", "--set",
                                          "nonideal.stribeck_Nm=0", "--set", "nonideal.cogging_Nm=0", "--set",
                                          "nonideal.friction_asymmetry_Nm=0", "--set", "profile.load_Nm=0.03", "--set",
                                          "noise=0.01", "--out", folder / ""});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, sim.code, sim.err.c_str());
    const Outcome run = command::dqwatch({"trace", folder / "effect_friction.csv", "--json", "--out", folder / "o"});
    const json j = json::parse(run.out);
    TEST_ASSERT_EQUAL_size_t_MESSAGE(1, j.at("effects").size(), j.at("effects").dump().c_str());
    TEST_ASSERT_EQUAL_STRING("load_torque", j.at("effects")[0].at("name").get<std::string>().c_str());
    TEST_ASSERT_TRUE_MESSAGE(j.at("effects")[0].at("confusable_with").empty(), j.at("effects").dump().c_str());
    TEST_ASSERT_DOUBLE_WITHIN(6e-4, 0.03,
                              j.at("effects")[0].at("parameters").at("torque_Nm").at("value").get<double>());
}

/// An observer's frame shows its own L_q: who reads the log calls none the machine's. (E106)
static void an_observers_angle_tells_no_inductance_along_q(void)
{
    const Folder folder;
    const Outcome sim = command::dqwatch({"sim", "drive_observer_joint", "--seed", "60540", "--set", "method=rk4",
                                          "--set", "duration_s=1", "--out", folder / ""});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, sim.code, sim.err.c_str());
    const std::string log = folder / "drive_observer_joint.csv";
    for (const char* command : {"fit", "learn"}) {
        const Outcome run = command::dqwatch(
            {command, log, "--json", "--machine", folder / "drive_observer_joint.toml"});
        const json j = json::parse(run.out);
        TEST_ASSERT_FALSE_MESSAGE(j.at("parameters").contains("Lq_H"), command);
        TEST_ASSERT_TRUE_MESSAGE(j.at("parameters").contains("psi_Wb"), command);
        TEST_ASSERT_TRUE_MESSAGE(j.at("not_identifiable").dump().find("whose own L_q") != std::string::npos, command);
    }
    const Outcome run = command::dqwatch({"trace", log, "--json", "--out", folder / "o"});
    const json j = json::parse(run.out);
    for (const char* when : {"before", "after"}) {
        const json& Lq = j.at(when).at("parameters").at("Lq_H");
        TEST_ASSERT_TRUE_MESSAGE(Lq.at("sd").is_null() && !Lq.at("usable").get<bool>(), when);
    }
    TEST_ASSERT_TRUE(j.at("sentence").get<std::string>().find("L_q") != std::string::npos);
}

static void wrong_usage_is_exit_code_2(void)
{
    const Folder folder;
    const std::string path = folder.write("log.csv", noisy(2000));
    const Outcome unknown = command::dqwatch({"trace", path, "--effect", "gremlins"});
    TEST_ASSERT_EQUAL_INT(2, unknown.code);
    for (const char* name : {"gremlins", "dead_time", "load_torque"})
        TEST_ASSERT_TRUE_MESSAGE(unknown.err.find(name) != std::string::npos, unknown.err.c_str());
    TEST_ASSERT_TRUE(unknown.err.find('\n') == unknown.err.size() - 1);
    TEST_ASSERT_EQUAL_INT(2, command::dqwatch({"trace"}).code);
    TEST_ASSERT_EQUAL_INT(2, command::dqwatch({"trace", path, "--parameters", "R_ohm"}).code);
}

static void what_cannot_be_written_is_exit_code_1(void)
{
    const Folder folder;
    const std::string path = folder.write("log.csv", noisy(2000)), file = folder.write("file", "");
    for (const std::string& dir : {file, file + "/below", std::string("/proc/nowhere")}) {
        const Outcome run = command::dqwatch({"trace", path, "--pole-pairs", "4", "--out", dir});
        TEST_ASSERT_EQUAL_INT(1, run.code);
        TEST_ASSERT_TRUE_MESSAGE(run.err.find(dir) != std::string::npos && run.err.find('\n') == run.err.size() - 1,
                                 run.err.c_str());
        TEST_ASSERT_EQUAL_STRING("", run.out.c_str());
    }
    // A full disk: the page goes to /dev/full by way of a link.
    std::filesystem::create_directory(folder / "full");
    std::filesystem::create_symlink("/dev/full", folder / "full/report.html");
    const Outcome full = command::dqwatch({"trace", path, "--pole-pairs", "4", "--out", folder / "full"});
    TEST_ASSERT_EQUAL_INT(1, full.code);
    TEST_ASSERT_TRUE_MESSAGE(full.err.find("No space left") != std::string::npos, full.err.c_str());
}

static void a_hostile_name_stays_text(void)
{
    const Folder folder;
    const std::string path = folder.write("<script>alert(1)<!--.csv", offset(4000));
    traced({path, "--pole-pairs", "4", "--out", folder / "o"});
    const std::string page = command::read_file(folder / "o/report.html");
    TEST_ASSERT_TRUE(page.find("<script>alert") == std::string::npos &&
                     page.find("&lt;script&gt;alert(1)&lt;!--") != std::string::npos);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_known_dead_time_is_found_and_written_down);
    RUN_TEST(the_text_says_it_in_a_sentence);
    RUN_TEST(heat_that_goes_with_time_is_not_learned);
    RUN_TEST(a_clean_log_names_nothing);
    RUN_TEST(several_logs_are_traced_jointly);
    RUN_TEST(unknown_pole_pairs_are_in_no_table);
    RUN_TEST(a_log_of_nothing_is_not_clean);
    RUN_TEST(a_log_without_angle_or_temperature_is_traced);
    RUN_TEST(only_what_is_named_is_tried);
    RUN_TEST(poor_logs_are_refused_in_one_line);
    RUN_TEST(what_is_no_trace_starts_no_learner);
    RUN_TEST(logs_without_current_or_speed_are_traced);
    RUN_TEST(a_dead_time_at_standstill_is_found);
    RUN_TEST(one_operating_point_says_what_cannot_be_tested);
    RUN_TEST(too_few_rows_to_hold_some_out_are_refused);
    RUN_TEST(a_load_is_no_friction);
    RUN_TEST(an_observers_angle_tells_no_inductance_along_q);
    RUN_TEST(wrong_usage_is_exit_code_2);
    RUN_TEST(what_cannot_be_written_is_exit_code_1);
    RUN_TEST(a_hostile_name_stays_text);
    return UNITY_END();
}
