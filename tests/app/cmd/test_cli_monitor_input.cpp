// `monitor` on logs that teach it little, on poor ones and with wrong usage; and its page as a browser sees it.
#include <nlohmann/json.hpp>
#include <string>

#include "monitor_command.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

using command::Folder;
using command::Outcome;
using monitor_command::count;
using monitor_command::holds;
using monitor_command::monitor;
using monitor_command::noisy;
using nlohmann::json;

static void effects_that_a_log_cannot_have_are_named(void)
{
    const Folder folder;
    command::write_log(folder / "log.csv", 6000);
    const Outcome run = monitor({folder / "log.csv", "--pole-pairs", "4", "--effect", "flux_harmonics", "--effect",
                                 "saturation", "--effect", "load_torque", "--effect", "dead_time", "--out",
                                 folder / "o"});
    holds(run.err, "note: learned as well: saturation\n");
    holds(run.err, "not used: flux_harmonics; it needs theta_e_rad or theta_m_rad");
    holds(run.err, "not used: load_torque; ");
    const std::string trace =
        R"({"inputs": [{"effect": "iron_loss", "shape": [1, 1, 1]}, {"effect": "winding_temperature", "shape": [25, 0, 1]}],
        "after": {"parameters": {"R_ohm": {"value": 0.5}, "pole_pairs": {"value": 4}}}})";
    const Outcome configured = monitor(
        {folder / "log.csv", "--config", folder.write("trace.json", trace), "--out", folder / "o"});
    holds(configured.err, "note: learned as well: iron_loss\n");
    holds(configured.err, "not used: winding_temperature; it needs a temperature");
    holds(configured.err, "note: Ld_H, Lq_H, psi_Wb not said");
    // A shape that means nothing is refused, and why.
    const std::string wrong = R"({"inputs": [{"effect": "saturation", "shape": [-1]}]})";
    const Outcome refused = command::dqwatch({"monitor", folder / "log.csv", "--pole-pairs", "4", "--config",
                                              folder.write("wrong.json", wrong), "--out", folder / "o"});
    TEST_ASSERT_EQUAL_INT(3, refused.code);
    holds(refused.err, "the learners refuse this: ");
}

static void a_log_that_teaches_nothing_says_what_would_help(void)
{
    const Folder folder;
    std::string still = "t_s,v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s\n";
    for (int k = 0; k < 4000; ++k)
        still += std::to_string(k * 1e-4) + ",-2.4,21.5,0," + (k % 2 ? "2" : "2.01") + ",100\n";
    const Outcome run = monitor({folder.write("log.csv", still), "--pole-pairs", "4", "--out", folder / "o"});
    holds(run.err, "note: not in service: ");
    holds(run.err, "what would help: ");
    holds(run.err, "L_d");
    // Nobody gave a flux map.
    TEST_ASSERT_TRUE_MESSAGE(run.err.find("flux map") == std::string::npos, run.err.c_str());
    const std::string page = command::read_file(folder / "o/monitor.html");
    holds(page, "not in service</span>");
    holds(page, "The monitor did not enter service");
    command::write_log(folder / "brief.csv", 60);
    monitor({folder / "brief.csv", "--pole-pairs", "4", "--json", "--out", folder / "o"});
    // What is not known has no row.
    const Outcome brief = monitor({folder / "brief.csv", "--pole-pairs", "4", "--out", folder / "o"});
    for (const char* name : {"offset_A", "phase_resistance_ohm", "gain", "short_S"})
        TEST_ASSERT_EQUAL_size_t_MESSAGE(0, count(brief.out, name), brief.out.c_str());
}

static void expect_refused(const std::string& path, long line, const std::string& reason,
                           const std::vector<std::string>& more = {})
{
    std::vector<std::string> args = {"monitor", path};
    args.insert(args.end(), more.begin(), more.end());
    const Outcome run = command::dqwatch(args);
    const std::string begin = path + ":" + std::to_string(line) + ": ";
    TEST_ASSERT_EQUAL_INT_MESSAGE(3, run.code, (reason + run.err).c_str());
    TEST_ASSERT_EQUAL_STRING("", run.out.c_str());
    TEST_ASSERT_EQUAL_size_t_MESSAGE(0, run.err.find(begin), run.err.c_str());
    TEST_ASSERT_TRUE_MESSAGE(run.err.find('\n') == run.err.size() - 1, run.err.c_str());
    holds(run.err, reason);
}

static void poor_logs_are_refused_in_one_line(void)
{
    const Folder folder;
    command::write_log(folder / "good.csv", 2000);
    const std::string good = command::read_file(folder / "good.csv"), head = "t_s,v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s\n";
    std::string locked = "v_d_V,v_q_V,i_d_A,i_q_A\n", settled = "v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s\n",
                shaft = "t_s,torque_Nm,w_m_rad_s\n";
    for (int k = 0; k < 100; ++k) {
        locked += std::to_string(k) + ",0,1,0\n", settled += "1,2," + std::to_string(k) + ",1,10\n";
        shaft += std::to_string(1e-3 * k) + ",1," + std::to_string(10 + k) + "\n";
    }
    std::string ten = good, nan = good, renamed = good;
    std::size_t end = 0;
    for (int line = 0; line < 11; ++line) end = ten.find('\n', end) + 1;
    ten.resize(end);
    nan.replace(nan.find(',', end) + 1, 3, "nan");
    renamed.replace(renamed.find("i_q_A"), 5, "other");
    const std::vector<std::string> p = {"--pole-pairs", "4", "--out", folder / "o"};
    expect_refused("/nowhere/log.csv", 0, "No such file", p);
    expect_refused(folder.write("a.csv", ""), 1, "an empty file", p);
    expect_refused(folder.write("a.csv", head), 1, "no data", p);
    expect_refused(folder.write("a.csv", renamed), 1, "missing column i_q_A", p);
    expect_refused(folder.write("a.csv", ten), 11, "10 rows only", p);
    expect_refused(folder.write("a.csv", nan), 12, "\"nan", p);
    expect_refused(folder.write("a.csv", locked), 1, "a standstill log; expected a dynamic one", p);
    expect_refused(folder.write("a.csv", settled), 1, "a steady log without t_s; expected a time", p);
    expect_refused(folder.write("a.csv", shaft), 1, "a mechanical log; expected a dynamic one", p);
    expect_refused(folder / "good.csv", 1, "expected --pole-pairs N", {"--out", folder / "o"});
    TEST_ASSERT_FALSE(std::filesystem::exists(folder / "o/monitor.html"));
    const std::string broken = folder.write("broken.json", "{\n\"inputs\": 3");
    const Outcome config = command::dqwatch({"monitor", folder / "good.csv", "--pole-pairs", "4", "--config", broken});
    TEST_ASSERT_EQUAL_INT(3, config.code);
    TEST_ASSERT_EQUAL_size_t_MESSAGE(0, config.err.find(broken + ":2: "), config.err.c_str());
}

static void wrong_usage_is_exit_code_2(void)
{
    for (const std::vector<std::string>& args :
         std::vector<std::vector<std::string>>{{"monitor"},
                                               {"monitor", "a.csv", "--effect", "gremlins"},
                                               {"monitor", "a.csv", "--arith", "q7"},
                                               {"monitor", "a.csv", "b.csv"},
                                               {"monitor", "a.csv", "--parameters", "R_ohm"}}) {
        const Outcome run = command::dqwatch(args);
        TEST_ASSERT_EQUAL_INT_MESSAGE(2, run.code, run.err.c_str());
        TEST_ASSERT_EQUAL_STRING("", run.out.c_str());
        TEST_ASSERT_TRUE(run.err.find('\n') == run.err.size() - 1);
    }
    const Outcome help = command::dqwatch({"monitor", "--help"});
    TEST_ASSERT_EQUAL_INT(0, help.code);
    for (const char* option :
         {"--json", "--out", "--pole-pairs", "--machine", "--effect", "--config", "--arith", "monitor.html"})
        holds(help.out, option);
}

static void what_cannot_be_written_is_exit_code_1(void)
{
    const Folder folder;
    command::write_log(folder / "log.csv", 2000);
    const std::string file = folder.write("file", "");
    for (const std::string& dir : {file, std::string("/proc/nowhere")}) {
        const Outcome run = command::dqwatch({"monitor", folder / "log.csv", "--pole-pairs", "4", "--out", dir});
        TEST_ASSERT_EQUAL_INT(1, run.code);
        holds(run.err, dir);
        TEST_ASSERT_EQUAL_STRING("", run.out.c_str());
    }
    std::filesystem::create_directory(folder / "full");
    std::filesystem::create_symlink("/dev/full", folder / "full/monitor.html");
    const Outcome full = command::dqwatch(
        {"monitor", folder / "log.csv", "--pole-pairs", "4", "--out", folder / "full"});
    TEST_ASSERT_EQUAL_INT(1, full.code);
    holds(full.err, "No space left");
}

/// As a browser sees it: no complaint, no request, every plot drawn.
static const char* const probe = R"(<pre id="probe"></pre><script>
(() => {
  const drawn = [...document.querySelectorAll(".plot")].map((place) => {
    let blue = 0;
    for (const canvas of place.querySelectorAll("canvas")) {
      if (!canvas.width || !canvas.height) continue;
      const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
      for (let k = 0; k < data.length; k += 4) blue += data[k + 3] > 40 && data[k + 2] > data[k] + 60;
    }
    return blue;
  });
  document.getElementById("probe").textContent =
    JSON.stringify({ drawn, requests: performance.getEntriesByType("resource").length, content: document.documentElement.scrollWidth });
})();
</script>)";

static void the_page_opens_offline_and_no_name_breaks_out(void)
{
    const Folder folder;
    std::filesystem::create_directory(folder / "o");
    const std::string log = folder.write("<script>alert(1)<!--.csv", noisy(30000));
    const Outcome run = monitor({log, "--pole-pairs", "4", "--out", folder / "o"});
    holds(run.out, "in service since");
    std::string page = command::read_file(folder / "o/monitor.html");
    holds(page, "default-src 'none'");
    holds(page, "&lt;script&gt;alert(1)&lt;!--");
    TEST_ASSERT_EQUAL_size_t(3, count(page, "<script"));
    TEST_ASSERT_EQUAL_size_t(page.size() - 8, page.rfind("</html>\n"));
    const std::string body = page.substr(page.find("<body>"), page.find("<script") - page.find("<body>"));
    for (const char* tag : {"header", "main", "section", "div", "table", "thead", "tbody", "tr", "figure", "figcaption",
                            "span", "p", "ul", "li", "h2"})
        TEST_ASSERT_EQUAL_size_t_MESSAGE(count(body, std::string("<") + tag + " ") +
                                             count(body, std::string("<") + tag + ">"),
                                         count(body, std::string("</") + tag + ">"), tag);
    for (const char* reference : {"src=", "href=", "<link", "<iframe", "url("})
        TEST_ASSERT_EQUAL_size_t_MESSAGE(0, count(body, reference), reference);
    // 0.3 MB.
    TEST_ASSERT_TRUE(page.size() > 150000 && page.size() < 1500000);
    if (command::sanitized() || command::run_program({"chromium", "--version"}).code != 0) return;
    page.insert(page.rfind("</body>"), probe);
    folder.write("probed.html", page);
    const Outcome seen = command::run_program(
        {"chromium", "--headless=new", "--no-sandbox", "--no-first-run", "--disable-gpu", "--disable-dev-shm-usage",
         "--disable-extensions", "--user-data-dir=" + (folder / "profile"), "--enable-logging=stderr",
         "--virtual-time-budget=2000", "--window-size=1280,800", "--dump-dom", "file://" + (folder / "probed.html")});
    TEST_ASSERT_TRUE_MESSAGE(seen.err.find("CONSOLE") == std::string::npos, seen.err.c_str());
    const std::size_t from = seen.out.find("<pre id=\"probe\">") + 16;
    const json j = json::parse(seen.out.substr(from, seen.out.find("</pre>", from) - from));
    TEST_ASSERT_EQUAL_INT(0, j.at("requests").get<int>());
    TEST_ASSERT_TRUE(j.at("content").get<int>() <= 1280);
    // R, L_d, L_q, flux, temperature, residual, and the first again.
    TEST_ASSERT_EQUAL_size_t(7, j.at("drawn").size());
    for (const json& blue : j.at("drawn")) TEST_ASSERT_TRUE_MESSAGE(blue.get<int>() > 100, j.dump().c_str());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(effects_that_a_log_cannot_have_are_named);
    RUN_TEST(a_log_that_teaches_nothing_says_what_would_help);
    RUN_TEST(poor_logs_are_refused_in_one_line);
    RUN_TEST(wrong_usage_is_exit_code_2);
    RUN_TEST(what_cannot_be_written_is_exit_code_1);
    RUN_TEST(the_page_opens_offline_and_no_name_breaks_out);
    return UNITY_END();
}
