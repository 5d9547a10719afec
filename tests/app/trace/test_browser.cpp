// The report in a real browser, headless Chromium: it draws without complaint, asks for nothing, and fits the screen.
// Plain only: runs other programs.
#include <nlohmann/json.hpp>
#include <string>

#include "app/trace/page.hpp"
#include "command.hpp"
#include "trace_sample.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

using command::Folder;
using command::Outcome;
using nlohmann::json;

/// A stub that a snap leaves behind answers no version.
static bool has_browser()
{
    static const bool has = command::run_program({"chromium", "--version"}).code == 0;
    return has;
}

/// Runs at the end of the page, after all is drawn: counts what the canvases show, points at the first plot, zooms it
/// and back.
static const char* const probe = R"(<pre id="probe"></pre><script>
(() => {
  const result = { width: innerWidth, height: innerHeight, content: document.documentElement.scrollWidth, requests: performance.getEntriesByType("resource").length, plots: [] };
  const verdict = document.getElementById("verdict").getBoundingClientRect();
  result.verdict = [verdict.top, verdict.bottom, verdict.left, verdict.right];
  const colours = (canvas) => {
    const seen = { orange: 0, blue: 0 };
    if (!canvas.width || !canvas.height) return seen;
    const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
    for (let k = 0; k < data.length; k += 4) {
      if (data[k + 3] < 40) continue;
      if (data[k] > data[k + 2] + 60) seen.orange++;
      if (data[k + 2] > data[k] + 60) seen.blue++;
    }
    return seen;
  };
  for (const place of document.querySelectorAll(".plot")) {
    const total = { orange: 0, blue: 0, bottom: place.getBoundingClientRect().bottom };
    for (const canvas of place.querySelectorAll("canvas")) {
      const seen = colours(canvas);
      total.orange += seen.orange, total.blue += seen.blue;
    }
    total.labels = [...place.querySelectorAll(".dygraph-xlabel, .dygraph-ylabel")].map((e) => e.textContent);
    result.plots.push(total);
  }
  const first = document.querySelector(".plot"), canvases = first.querySelectorAll("canvas"), top = canvases[canvases.length - 1];
  const ticks = () => [...first.querySelectorAll(".dygraph-axis-label-x")].map((e) => e.textContent).join(" ");
  const at = (target, type, part) => {
    const box = top.getBoundingClientRect();
    const x = box.left + part * box.width, y = box.top + box.height / 2;
    target.dispatchEvent(new MouseEvent(type, { bubbles: true, cancelable: true, view: window, button: 0, clientX: x, clientY: y, screenX: x, screenY: y }));
  };
  const key = first.parentElement.querySelector(".key");
  result.key = key.textContent;
  at(top, "mousemove", 0.6);
  result.hovered = key.textContent;
  result.ticks = [ticks()];
  at(top, "mousedown", 0.5), at(document, "mousemove", 0.6), at(document, "mousemove", 0.7), at(document, "mouseup", 0.7);
  result.ticks.push(ticks());
  at(top, "mousedown", 0.5), at(document, "mouseup", 0.5), at(top, "dblclick", 0.5);
  result.ticks.push(ticks());
  document.getElementById("probe").textContent = JSON.stringify(result);
  if (parent !== window) parent.postMessage(JSON.stringify(result), "*");
})();
</script>)";

/// Windows are 500 pixels wide at least; a frame in one may be narrower.
static const char* const frame = R"(<!DOCTYPE html><pre id="probe"></pre><script>
onmessage = (e) => { document.getElementById("probe").textContent = e.data; };
</script><iframe src="report.html" width="WIDTH" height="800" style="border: 0"></iframe>)";

/// What the probe saw of `page` in a window of `width` x 800; fails on any complaint on the console.
static json look(const std::string& page, int width, const std::string& option = "--disable-extensions")
{
    static const Folder folder;
    std::string probed = page, framed = frame;
    probed.insert(probed.rfind("</body>"), probe);
    folder.write("report.html", probed);
    framed.replace(framed.find("WIDTH"), 5, std::to_string(width));
    folder.write("frame.html", framed);
    const std::string file = width < 500 ? "frame.html" : "report.html",
                      size = "--window-size=" + std::to_string(width) + ",800";
    const Outcome run = command::run_program(
        {"chromium", "--headless=new", "--no-sandbox", "--no-first-run", "--disable-gpu", "--hide-scrollbars",
         "--disable-dev-shm-usage", "--user-data-dir=" + (folder / "profile"), "--enable-logging=stderr",
         "--virtual-time-budget=2000", size, option, "--dump-dom", "file://" + (folder / file)});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
    const std::size_t complaint = run.err.find("CONSOLE");
    TEST_ASSERT_TRUE_MESSAGE(complaint == std::string::npos,
                             run.err.substr(complaint == std::string::npos ? 0 : complaint, 300).c_str());
    const std::string open = "<pre id=\"probe\">";
    const std::size_t at = run.out.find(open);
    TEST_ASSERT_TRUE_MESSAGE(at != std::string::npos, "the page did not come to its end");
    const std::size_t from = at + open.size();
    return json::parse(run.out.substr(from, run.out.find("</pre>", from) - from));
}

static void expect_plots(const json& seen, std::size_t plots, bool after)
{
    TEST_ASSERT_EQUAL_size_t(plots, seen.at("plots").size());
    for (const json& plot : seen.at("plots")) {
        // 100 pixels are a line across the least of them.
        TEST_ASSERT_TRUE_MESSAGE(plot.at("orange").get<int>() > 100, plot.dump().c_str());
        TEST_ASSERT_TRUE_MESSAGE(!after || plot.at("blue").get<int>() > 100, plot.dump().c_str());
        TEST_ASSERT_EQUAL_size_t(2, plot.at("labels").size());
        for (const json& label : plot.at("labels"))
            TEST_ASSERT_TRUE_MESSAGE(label.get<std::string>().back() == ']', label.dump().c_str());
    }
}

static void expect_offline(const json& seen) { TEST_ASSERT_EQUAL_INT(0, seen.at("requests").get<int>()); }

static void the_first_screen_has_the_verdict_and_the_key_picture(void)
{
    if (!has_browser()) TEST_IGNORE_MESSAGE("no chromium here; make tools installs it");
    auto report = trace_sample::report("explained", 3000);
    report.learner_before = report.trace.before, report.learner_after = report.trace.after;
    const json seen = look(dqw::report_page(report), 1280);
    TEST_ASSERT_EQUAL_INT(1280, seen.at("width").get<int>());
    expect_offline(seen);
    expect_plots(seen, 1 + 2 * (2 + 5 + 2), true);
    const auto box = seen.at("verdict").get<std::vector<double>>();
    TEST_ASSERT_TRUE(box[0] >= 0 && box[1] > box[0] + 15 && box[1] < 200 && box[2] >= 0 && box[3] <= 1280);
    TEST_ASSERT_TRUE(seen.at("plots").at(0).at("bottom").get<double>() < 800);
    TEST_ASSERT_TRUE(seen.at("plots").at(1).at("bottom").get<double>() > 800);
}

static void the_plots_zoom_and_tell_values(void)
{
    if (!has_browser()) TEST_IGNORE_MESSAGE("no chromium here; make tools installs it");
    const json seen = look(dqw::report_page(trace_sample::report("explained", 3000)), 1280);
    const auto text = [&](const char* name) { return seen.at(name).get<std::string>(); };
    TEST_ASSERT_TRUE_MESSAGE(text("key").find_first_of("0123456789") == std::string::npos, text("key").c_str());
    TEST_ASSERT_TRUE_MESSAGE(text("hovered").find_first_of("0123456789") != std::string::npos, text("hovered").c_str());
    const auto ticks = seen.at("ticks").get<std::vector<std::string>>();
    TEST_ASSERT_TRUE_MESSAGE(ticks[0] != ticks[1], ticks[1].c_str());
    TEST_ASSERT_EQUAL_STRING(ticks[0].c_str(), ticks[2].c_str());
}

static void every_verdict_draws(void)
{
    if (!has_browser()) TEST_IGNORE_MESSAGE("no chromium here; make tools installs it");
    for (const char* verdict : {"clean", "partly_explained", "unexplained"}) {
        const json seen = look(dqw::report_page(trace_sample::report(verdict, 700)), 1280);
        expect_offline(seen);
        expect_plots(seen, 1 + 2 * (2 + 5 + 2), std::string(verdict) == "partly_explained");
        TEST_ASSERT_TRUE(seen.at("verdict").at(1).get<double>() < 200);
    }
}

static void a_narrow_and_a_dark_window_do(void)
{
    if (!has_browser()) TEST_IGNORE_MESSAGE("no chromium here; make tools installs it");
    const json seen = look(dqw::report_page(trace_sample::report("partly_explained", 700)), 400,
                           "--blink-settings=preferredColorScheme=0");
    TEST_ASSERT_EQUAL_INT(400, seen.at("width").get<int>());
    // Nothing wider than the window: tables scroll by themselves.
    TEST_ASSERT_TRUE(seen.at("content").get<int>() <= 400);
    TEST_ASSERT_TRUE(seen.at("verdict").at(1).get<double>() < 800);
    expect_plots(seen, 1 + 2 * (2 + 5 + 2), true);
}

static void hostile_names_run_nothing(void)
{
    if (!has_browser()) TEST_IGNORE_MESSAGE("no chromium here; make tools installs it");
    const std::string evil =
        "</script><script>console.error('ran')</script><img src=x onerror=\"console.error('ran')\">";
    auto report = trace_sample::report("partly_explained", 200);
    report.logs = {evil};
    report.trace.notes = {evil};
    report.trace.rest_signature = report.trace.rejected[0].why = report.trace.effects[0].parameters[0].name = evil;
    expect_offline(look(dqw::report_page(report), 1280));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_first_screen_has_the_verdict_and_the_key_picture);
    RUN_TEST(the_plots_zoom_and_tell_values);
    RUN_TEST(every_verdict_draws);
    RUN_TEST(a_narrow_and_a_dark_window_do);
    RUN_TEST(hostile_names_run_nothing);
    return UNITY_END();
}
