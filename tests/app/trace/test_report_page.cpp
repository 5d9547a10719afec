// What a trace's report says: the JSON object, sentences, thinning, and a page that no name in a file can break out of.
// Plain only: long, and what it runs others run under the sanitizers.
#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>

#include "app/base/text.hpp"
#include "app/page/assets.hpp"
#include "app/page/html.hpp"
#include "app/page/thin.hpp"
#include "app/report/report.hpp"
#include "app/trace/advice.hpp"
#include "app/trace/page.hpp"
#include "app/trace/plots.hpp"
#include "app/trace/verdict.hpp"
#include "ref/effect/effect.hpp"
#include "trace_sample.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

using nlohmann::json;

static std::size_t count(const std::string& text, const std::string& part)
{
    std::size_t n = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + part.size())) ++n;
    return n;
}

static void holds(const std::string& text, const std::string& part)
{
    TEST_ASSERT_TRUE_MESSAGE(text.find(part) != std::string::npos, (part + " in " + text).c_str());
}

static void json_has_the_documented_fields(void)
{
    auto report = trace_sample::report("partly_explained", 100);
    report.learner_before = report.trace.before, report.learner_after = report.trace.after;
    report.learner_after->heldout_rms = 0.17;
    const json j = json::parse(dqw::json_text(dqw::trace_json(report)));
    TEST_ASSERT_EQUAL_STRING("dqwatch.trace/1", j.at("schema").get<std::string>().c_str());
    TEST_ASSERT_EQUAL_STRING("partly_explained", j.at("verdict").get<std::string>().c_str());
    TEST_ASSERT_EQUAL_STRING("dynamic", j.at("regime").get<std::string>().c_str());
    TEST_ASSERT_EQUAL_STRING("V", j.at("unit").get<std::string>().c_str());
    TEST_ASSERT_EQUAL_INT(2000, j.at("rows").get<int>());
    TEST_ASSERT_EQUAL_INT(1000, j.at("heldout_rows").get<int>());
    TEST_ASSERT_EQUAL_DOUBLE(0.15, j.at("noise_floor").get<double>());
    TEST_ASSERT_EQUAL_DOUBLE(1.53, j.at("before").at("heldout_rms").get<double>());
    TEST_ASSERT_EQUAL_DOUBLE(2.83, j.at("before").at("parameters").at("R_ohm").at("value").get<double>());
    TEST_ASSERT_EQUAL_DOUBLE(0.012, j.at("after").at("parameters").at("R_ohm").at("sd").get<double>());
    TEST_ASSERT_TRUE(j.at("after").at("parameters").at("pole_pairs").at("given").get<bool>());
    TEST_ASSERT_EQUAL_DOUBLE(0.17, j.at("learner").at("after").at("heldout_rms").get<double>());
    TEST_ASSERT_EQUAL_DOUBLE(1.21, j.at("learner").at("after").at("parameters").at("R_ohm").at("value").get<double>());
    const json &dead_time = j.at("effects").at(0), &iron = j.at("effects").at(1);
    TEST_ASSERT_EQUAL_STRING("dead_time", dead_time.at("name").get<std::string>().c_str());
    TEST_ASSERT_EQUAL_DOUBLE(3.61, dead_time.at("parameters").at("voltage_V").at("value").get<double>());
    TEST_ASSERT_EQUAL_DOUBLE(0.1, dead_time.at("parameters").at("voltage_V").at("sd").get<double>());
    TEST_ASSERT_EQUAL_DOUBLE(0.16, dead_time.at("heldout_rms_after").get<double>());
    TEST_ASSERT_TRUE(dead_time.at("confusable_with").is_array() && dead_time.at("confusable_with").empty());
    TEST_ASSERT_EQUAL_STRING("delay", iron.at("confusable_with").at(1).get<std::string>().c_str());
    TEST_ASSERT_EQUAL_STRING("saturation", j.at("rejected").at(0).at("name").get<std::string>().c_str());
    TEST_ASSERT_EQUAL_STRING("no temperature column", j.at("rejected").at(1).at("why").get<std::string>().c_str());
    TEST_ASSERT_TRUE(j.at("rejected").at(1).at("heldout_rms").is_null());
    TEST_ASSERT_EQUAL_DOUBLE(0.31, j.at("inputs").at(0).at("shape").at(0).get<double>());
}

static void the_verdict_is_one_sentence_with_units(void)
{
    const auto sentence = [](const char* verdict) {
        return dqw::verdict_sentence(trace_sample::report(verdict, 100).trace);
    };
    TEST_ASSERT_EQUAL_STRING(
        "The inverter loses 3.6 ± 0.1 V per phase (dead time). Without it, R reads 2.83 Ω instead of 1.21 Ω.",
        sentence("explained").c_str());
    holds(sentence("partly_explained"), "Without them, R reads");
    holds(sentence("clean"), "0.16 V");
    holds(sentence("clean"), "Nothing is missing");
    // Of a catalogue that was not tried, it does not say so.
    auto blind = trace_sample::report("clean", 100).trace;
    for (auto& r : blind.rejected) r.heldout_rms = std::nan("");
    holds(dqw::verdict_sentence(blind), "What is missing is not known, no effect could be tested");
    blind.rejected.push_back({"delay", "explains nothing", 0.16});
    holds(dqw::verdict_sentence(blind), "Nothing is missing");
    holds(dqw::verdict_remark(blind), "2 of 3 effects could not be tested");
    holds(sentence("unexplained"), "1.5 V, 10 times the log's own noise");
    const std::string remark = dqw::verdict_remark(trace_sample::report("partly_explained", 100).trace);
    holds(remark, "iron loss from angle offset or delay");
    holds(remark, "A line at 37 Hz");
    TEST_ASSERT_EQUAL_STRING("", dqw::verdict_remark(trace_sample::report("explained", 100).trace).c_str());
}

static void what_is_not_usable_is_said_in_the_first_line(void)
{
    auto report = trace_sample::report("explained", 100);
    TEST_ASSERT_EQUAL_STRING(dqw::verdict_sentence(report.trace).c_str(), dqw::verdict_line(report.trace).c_str());
    report.trace.after.parameters = {{"R_ohm", 1.2, 0.01, false}, {"Ld_H", 2e-3, 1e-3, false}};
    const std::string line = dqw::verdict_sentence(report.trace) + " Parameters not usable: L_d.";
    TEST_ASSERT_EQUAL_STRING(line.c_str(), dqw::verdict_line(report.trace).c_str());
    TEST_ASSERT_EQUAL_STRING(line.c_str(), dqw::trace_json(report).at("sentence").get<std::string>().c_str());
    const std::string text = dqw::trace_text(report);
    TEST_ASSERT_EQUAL_STRING(line.c_str(), text.substr(0, text.find('\n')).c_str());
    holds(dqw::report_page(report, dqw::Extent::first_screen), "Parameters not usable: L_d.");
}

static void advice_says_what_to_log_next(void)
{
    TEST_ASSERT_EQUAL_size_t(0, dqw::advice_of(trace_sample::report("clean", 100).trace).size());
    auto trace = trace_sample::report("partly_explained", 100).trace;
    const std::vector<std::string> advice = dqw::advice_of(trace);
    TEST_ASSERT_EQUAL_size_t(1, advice.size());
    holds(advice[0], "iron loss or angle offset or delay: ");
    holds(advice[0], "; such a log: dqwatch sim servo --set nonideal.iron_loss_S=0.002 && dqwatch trace servo.csv");
    // What no log of this kind tells has none, and what is not usable has its excitation.
    trace.after.parameters = {{"Ld_H", 2e-3, 1e-3, false}};
    holds(dqw::advice_of(trace).back(), "L_d: steps or a random signal on i_d");
    trace.after.parameters.push_back({"psi_Wb", 0.1, 1e-4, false, true});
    holds(dqw::advice_of(trace).back(), "the pole pairs, --pole-pairs N");
    const json j = dqw::trace_json({trace, {}, {}, {}});
    TEST_ASSERT_EQUAL_STRING("this is its product with the pole pairs, which are not known",
                             j.at("after").at("parameters").at("psi_Wb").at("why").get<std::string>().c_str());
    TEST_ASSERT_EQUAL_size_t(3, j.at("advice").size());
    TEST_ASSERT_EQUAL_DOUBLE(trace.effects[0].confidence, j.at("effects").at(0).at("confidence").get<double>());
}

static void every_effect_has_a_sentence_of_its_own(void)
{
    dqw::TraceBlocks blocks;
    blocks.i_d_A = blocks.i_q_A = {1.0};
    for (const dqw::Effect& e : dqw::effects()) {
        dqw::TraceEffect found{e.name, {}, 0.0, {}, ""};
        for (const dqw::EffectParameter& p : e.parameters) found.parameters.push_back({p.name, 0.5, 0.01, false});
        if (std::string(e.name) == "cogging_torque") found.parameters.push_back({"order", 12, 0, true});
        std::string text = dqw::effect_sentence(found, blocks);
        TEST_ASSERT_TRUE_MESSAGE(text.find("The log shows") == std::string::npos && text.find('{') == std::string::npos,
                                 text.c_str());
        std::transform(text.begin(), text.end(), text.begin(),
                       [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
        holds(text, "(" + dqw::spoken(e.name) + ").");
        // Of a parameter that no sentence knows, name and value are said.
        found.parameters = {{"colour_V", 0.5, 0.01, false}};
        holds(dqw::effect_sentence(found, blocks), "colour_V = 500 ± 10 mV");
    }
}

static void a_flux_is_told_where_the_log_has_been(void)
{
    dqw::TraceBlocks blocks;
    blocks.i_d_A = {1.0, -20.0, 3.0};
    blocks.i_q_A = {0.0, 10.0, -80.0};
    // In units of 100 A: x = -0.2, y = -0.8; 0.04 (0.5 - 0.2 (0.25) + 0.04 (-1)) = 0.0164, -0.512 (-0.03 + 0.64 (0.01))
    // = 0.0120832.
    const dqw::TraceEffect own{"saturation",
                               {{"psi_d2_Wb", 0.5, 0.01, false},
                                {"psi_d3_Wb", 0.25, 0.01, false},
                                {"psi_d4_Wb", -1, 0.01, false},
                                {"psi_q3_Wb", -0.03, 0.01, false},
                                {"psi_q5_Wb", 0.01, 0.01, false},
                                {"i_base_A", 100, 0, true}},
                               0.0,
                               {},
                               ""};
    TEST_ASSERT_EQUAL_STRING("The iron saturates: it changes the flux of d by 16.4 mWb at i_d = \u221220 A, that of q "
                             "by 12.1 mWb at i_q = \u221280 A (saturation).",
                             dqw::effect_sentence(own, blocks).c_str());
    // Where i_q is largest i_d is 3 A: 0.64 (-0.02 + 0.06 (0.05) + 0.64 (0.01)) = -0.006784.
    const dqw::TraceEffect cross{"cross_saturation",
                                 {{"psi_c12_Wb", -0.02, 0.01, false},
                                  {"psi_c22_Wb", 0.05, 0.01, false},
                                  {"psi_c14_Wb", 0.01, 0.01, false},
                                  {"i_base_A", 100, 0, true}},
                                 0.0,
                                 {},
                                 ""};
    TEST_ASSERT_EQUAL_STRING("Each axis saturates the other: it changes the flux of d by \u22126.78 mWb at i_q = "
                             "\u221280 A and i_d = 3 A (cross saturation).",
                             dqw::effect_sentence(cross, blocks).c_str());
}

static void minus_signs_are_minus_signs(void)
{
    TEST_ASSERT_EQUAL_STRING("\u22121.5 V (\u2212.3), x=\u22122, dead-time 3-5 a-1 1e-05 - 7",
                             dqw::with_minus("-1.5 V (-.3), x=-2, dead-time 3-5 a-1 1e-05 - 7").c_str());
    auto report = trace_sample::report("explained", 100);
    auto& t = report.trace;
    t.before.parameters[0].value = -2.83;
    t.effects[0].parameters[0].value = -3.61;
    t.rejected[0].why = "its weight is -4 V";
    t.notes = {"from -1 A on"};
    const std::string page = dqw::report_page(report),
                      body = page.substr(page.find("<header>"), page.find("</main>") - page.find("<header>"));
    for (const char* text : {"loses \u22123.6", "reads \u22122.83", "<td>\u22122.830 ± 0.040 Ω</td>",
                             "<td>\u22123.61 ± 0.10 V</td>", "is \u22124 V", "from \u22121 A"})
        holds(body, text);
    for (std::size_t k = 1; k + 1 < body.size(); ++k)
        if (body[k] == '-' && std::isdigit(static_cast<unsigned char>(body[k + 1])))
            TEST_ASSERT_TRUE_MESSAGE(std::isalnum(static_cast<unsigned char>(body[k - 1])),
                                     body.substr(k - 20, 40).c_str());
    const json j = json::parse(dqw::json_text(dqw::trace_json(report)));
    TEST_ASSERT_EQUAL_DOUBLE(-3.61, j.at("effects").at(0).at("parameters").at("voltage_V").at("value").get<double>());
}

static void thinning_keeps_the_extremes(void)
{
    trace_sample::Noise noise;
    dqw::Columns all(3);
    for (int k = 0; k < 12345; ++k) {
        all[0].push_back(k);
        all[1].push_back(noise());
        all[2].push_back(k % 50 ? noise() : std::numeric_limits<double>::quiet_NaN());
    }
    const auto thin = dqw::extremes(all, 200);
    TEST_ASSERT_EQUAL_size_t(200, thin[0].size());
    TEST_ASSERT_TRUE(std::is_sorted(thin[0].begin(), thin[0].end()));
    // 100 buckets; each holds what a search of its rows finds.
    for (std::size_t b = 0; b < 100; ++b)
        for (std::size_t c = 1; c < 3; ++c) {
            double low = HUGE_VAL, high = -HUGE_VAL;
            for (std::size_t k = b * 12345 / 100; k < (b + 1) * 12345 / 100; ++k)
                low = std::fmin(low, all[c][k]), high = std::fmax(high, all[c][k]);
            TEST_ASSERT_EQUAL_DOUBLE(low, std::fmin(thin[c][2 * b], thin[c][2 * b + 1]));
            TEST_ASSERT_EQUAL_DOUBLE(high, std::fmax(thin[c][2 * b], thin[c][2 * b + 1]));
        }
    TEST_ASSERT_EQUAL_size_t(12345, dqw::extremes(all, 12345)[0].size());
}

static void samples_are_rows_and_lie_in_order(void)
{
    dqw::Columns all(2);
    for (int k = 0; k < 5000; ++k) all[0].push_back(k * 7919 % 5000), all[1].push_back(2.0 * all[0].back());
    const auto some = dqw::sampled(all, 300);
    TEST_ASSERT_EQUAL_size_t(300, some[0].size());
    for (std::size_t k = 0; k < 300; ++k) {
        TEST_ASSERT_EQUAL_DOUBLE(2 * some[0][k], some[1][k]);
        // No row twice.
        TEST_ASSERT_TRUE(k == 0 || some[0][k] > some[0][k - 1]);
    }
    // Half of them from either half, within five deviations.
    const auto low = std::count_if(some[0].begin(), some[0].end(), [](double x) { return x < 2500; });
    TEST_ASSERT_INT_WITHIN(44, 150, low);
    TEST_ASSERT_TRUE(some == dqw::sampled(all, 300));
    TEST_ASSERT_EQUAL_size_t(5000, dqw::sampled(all, 9999)[0].size());
}

static void bin_means_are_means(void)
{
    const dqw::Columns means = dqw::bin_means({{0, 1, 2, 3, 10}, {1, 3, 5, 7, 9}}, 2, 1);
    TEST_ASSERT_EQUAL_DOUBLE(1.5, means[0][0]);
    TEST_ASSERT_EQUAL_DOUBLE(4, means[1][0]);
    TEST_ASSERT_EQUAL_DOUBLE(9, means[1][1]);
    TEST_ASSERT_EQUAL_size_t(1, dqw::bin_means({{0, 1, 2, 3, 10}, {1, 3, 5, 7, 9}}, 2, 2)[0].size());
    TEST_ASSERT_TRUE(dqw::bin_means({{1, 1}, {2, 2}}, 2, 1)[0].empty());
}

static void every_axis_has_its_unit_and_the_key_picture_shows_the_cause(void)
{
    const auto trace = trace_sample::report("explained", 3000).trace;
    std::size_t plots = 0;
    for (const auto& group : dqw::plot_groups(trace))
        for (const dqw::Plot& plot : group.plots) {
            ++plots;
            for (const std::string& label : {plot.x_label, plot.y_label})
                TEST_ASSERT_TRUE_MESSAGE(label.back() == ']' && label.find('[') != std::string::npos, label.c_str());
            TEST_ASSERT_EQUAL_size_t(plot.series.size() + 1, plot.columns.size());
            TEST_ASSERT_TRUE(!plot.columns[0].empty() && plot.columns[0].size() <= 2000);
        }
    // Close-up and whole log, five signals, two spectra: on two axes.
    TEST_ASSERT_EQUAL_size_t(2 * (2 + 5 + 2), plots);
    TEST_ASSERT_EQUAL_STRING("i_q [A]", dqw::key_plot(trace).x_label.c_str());
    TEST_ASSERT_EQUAL_STRING("residual, q axis [V]", dqw::key_plot(trace).y_label.c_str());
}

static void what_a_log_lacks_is_not_plotted(void)
{
    auto trace = trace_sample::report("explained", 1000).trace;
    for (auto* column : {&trace.blocks.t_s, &trace.blocks.theta_e_rad, &trace.blocks.i_d_A}) column->clear();
    for (double& w : trace.blocks.w_m_rad_s) w = 100;
    trace.blocks.spectra.clear();
    trace.regime = dqw::Regime::steady;
    const auto groups = dqw::plot_groups(trace);
    TEST_ASSERT_EQUAL_size_t(2, groups.size());
    // Against i_q and the point's number.
    TEST_ASSERT_EQUAL_size_t(4, groups[1].plots.size());
    TEST_ASSERT_EQUAL_STRING("number of the point [1]", groups[1].plots[3].x_label.c_str());
    trace.blocks = {};
    TEST_ASSERT_TRUE(dqw::plot_groups(trace).empty());
    TEST_ASSERT_TRUE(dqw::key_plot(trace).series.empty());
    holds(dqw::report_page({trace, {}, {}, {"a.csv"}}), "</html>");
}

static void several_logs_stand_one_after_the_other(void)
{
    auto trace = trace_sample::report("explained", 1000).trace;
    for (std::size_t k = 500; k < 1000; ++k) trace.blocks.t_s[k] -= 1.0;
    for (const auto& group : dqw::plot_groups(trace))
        for (const dqw::Plot& plot : group.plots)
            TEST_ASSERT_TRUE_MESSAGE(std::is_sorted(plot.columns[0].begin(), plot.columns[0].end()),
                                     plot.title.c_str());
}

static void no_name_breaks_out_of_the_page(void)
{
    const std::string evil = "</script><script>alert(1)</script><img src=x onerror='alert(2)' alt=\"&\">";
    auto report = trace_sample::report("partly_explained", 200);
    auto& t = report.trace;
    report.logs = {"a/" + evil + ".csv", "<script>.csv", "\xff\xfe.csv"};
    t.notes = {evil};
    t.rest_signature = t.effects[1].separate = t.rejected[0].why = t.rejected[0].name = t.structure[0].with =
        t.rest[0].with = t.effects[0].name = evil;
    t.effects[1].confusable_with = {evil};
    t.effects[0].parameters[0].name = evil;
    const std::string page = dqw::report_page(report),
                      good = dqw::report_page(trace_sample::report("partly_explained", 200));
    for (const char* tag : {"<script", "</script", "<img"})
        TEST_ASSERT_EQUAL_size_t_MESSAGE(count(good, tag), count(page, tag), tag);
    holds(page, "&lt;/script&gt;&lt;script&gt;alert(1)");
    TEST_ASSERT_EQUAL_STRING("\"\\u003c/script>\\u003c!--\"", dqw::script_string("</script><!--").c_str());
    TEST_ASSERT_EQUAL_STRING("&lt;&gt;&amp;&quot;&#39;", dqw::escaped("<>&\"'").c_str());
}

static void the_page_asks_for_nothing_from_outside(void)
{
    std::string page = dqw::report_page(trace_sample::report("explained", 500));
    holds(page, "default-src 'none'");
    // Of the library's code a browser must judge: test_browser.cpp.
    const std::string library(dqw::dygraphs_js());
    page.erase(page.find(library), library.size());
    for (const char* reference : {"src=", "href=", "@import", "url(", "sourceMappingURL", "<link", "<iframe"})
        TEST_ASSERT_EQUAL_size_t_MESSAGE(0, count(page, reference), reference);
    // The library comes with its licence.
    holds(page, "Dan Vanderkam");
    holds(page, "Permission is hereby granted");
}

static void a_million_rows_are_a_small_page(void)
{
    // Dynamic: 20 rows a block. Settled: one.
    for (const std::size_t blocks : {std::size_t{50000}, std::size_t{1000000}}) {
        const auto report = trace_sample::report("explained", blocks);
        const std::string page = dqw::report_page(report);
        // 0.9 MB.
        TEST_ASSERT_TRUE_MESSAGE(page.size() > 400000 && page.size() < 1500000, std::to_string(page.size()).c_str());
    }
}

/// psi_d = 0.1 + 2e-3 i_d, psi_q = 5e-3 i_q; the corner of both largest currents was not seen.
static void a_map_is_drawn_where_the_log_was(void)
{
    auto report = trace_sample::report("partly_explained", 100);
    const std::string without = dqw::report_page(report);
    for (int k = -2; k <= 2; ++k) report.trace.map.i_d_A.push_back(k), report.trace.map.i_q_A.push_back(2 * k);
    for (int d = -2; d <= 2; ++d)
        for (int q = -2; q <= 2; ++q)
            report.trace.map.nodes.push_back(
                {0.1 + 2e-3 * d, 0.01 * q, 1e-3, 2e-3, 2e-3, 0, 5e-3, d < 2 || q < 2, 1e-5, 2e-5});
    const std::string page = dqw::report_page(report);
    TEST_ASSERT_EQUAL_size_t(4, count(page, "\"bands\"") - count(without, "\"bands\""));
    holds(page, "ψ_d over i_d at i_q = 0 (none), 2 (half), 4 A (most)");
    const auto groups = dqw::plot_groups(report.trace);
    const dqw::Plot& psi_d = groups.front().plots.front();
    TEST_ASSERT_EQUAL_size_t(10, psi_d.columns.size());
    TEST_ASSERT_EQUAL_STRING("ψ_d [mWb]", psi_d.y_label.c_str());
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 98, psi_d.columns[1][1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 96, psi_d.columns[2][1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 100, psi_d.columns[3][1]);
    TEST_ASSERT_DOUBLE_IS_NAN(psi_d.columns[7][4]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 104, psi_d.columns[4][4]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(json_has_the_documented_fields);
    RUN_TEST(the_verdict_is_one_sentence_with_units);
    RUN_TEST(what_is_not_usable_is_said_in_the_first_line);
    RUN_TEST(advice_says_what_to_log_next);
    RUN_TEST(every_effect_has_a_sentence_of_its_own);
    RUN_TEST(a_flux_is_told_where_the_log_has_been);
    RUN_TEST(minus_signs_are_minus_signs);
    RUN_TEST(thinning_keeps_the_extremes);
    RUN_TEST(samples_are_rows_and_lie_in_order);
    RUN_TEST(bin_means_are_means);
    RUN_TEST(every_axis_has_its_unit_and_the_key_picture_shows_the_cause);
    RUN_TEST(what_a_log_lacks_is_not_plotted);
    RUN_TEST(several_logs_stand_one_after_the_other);
    RUN_TEST(no_name_breaks_out_of_the_page);
    RUN_TEST(the_page_asks_for_nothing_from_outside);
    RUN_TEST(a_million_rows_are_a_small_page);
    RUN_TEST(a_map_is_drawn_where_the_log_was);
    return UNITY_END();
}
