// Every format round trip: written by a writer of its own, found by itself, and the same values come back; then cut,
// doubled, shuffled and mixed with foreign rows, which is read or refused in one line.
#include <algorithm>
#include <cstring>
#include <set>

#include "app/format/formats.hpp"
#include "app/read/log_reader.hpp"
#include "command.hpp"
#include "vendor_writers.hpp"

// Its macros spoil fmt's names.
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

static dqw::ReadOptions options_of(dqw::Survey& survey)
{
    dqw::ReadOptions options;
    options.survey = &survey;
    options.pole_pairs = vendor::p;
    options.given.gear = vendor::gear;
    options.given.v_dc_V = vendor::v_dc;
    return options;
}

static std::string put(const command::Folder& folder, const vendor::Written& w, const std::string& text)
{
    folder.write("x.toml", w.toml);
    return folder.write(std::string("x.") + w.extension, text);
}

static void expect_column(const vendor::Written& w, const char* name, const std::vector<double>& got,
                          double (*of)(const vendor::Row&), double half_step)
{
    // Rows that are none stand before the first kept one, or are one in the middle.
    const std::size_t missing = w.rows.size() - got.size();
    TEST_ASSERT_TRUE_MESSAGE(got.size() <= w.rows.size() && missing <= 6, (std::string(w.format) + name).c_str());
    std::size_t bad = 0;
    double worst = 0;
    for (std::size_t k = 0; k < got.size(); ++k) {
        const double off = std::fabs(got[k] - of(w.rows[k + (missing == 1 && k < 3 ? 0 : missing)]));
        worst = std::max(worst, off);
        bad += !(off <= 1.01 * half_step + 1e-6 * std::fabs(got[k]));
    }
    TEST_ASSERT_EQUAL_size_t_MESSAGE(0, bad, fmt::format("{} {}: {:g}", w.format, name, worst).c_str());
}

static void what_was_written_is_read(void)
{
    const command::Folder folder;
    for (const vendor::Written& w : vendor::all()) {
        dqw::Survey survey;
        dqw::ReadOptions options = options_of(survey);
        if (std::strcmp(w.format, "simplefoc") == 0) options.given.period_s = 0.02;
        const dqw::Log log = dqw::read_log(put(folder, w, w.text), options);
        TEST_ASSERT_EQUAL_STRING(w.format, survey.format.c_str());
        const auto asks = [&](char c) { return std::strchr(w.columns, c) != nullptr; };
        using vendor::Row;
        if (asks('t')) {
            std::vector<double> since(log.t_s);
            for (double& t : since) t -= log.t_s.front();
            expect_column(
                w, "t", since, [](const Row& r) { return r.t; }, 1e-5);
        }
        if (asks('v')) {
            expect_column(
                w, "v_d", log.v_d_V, [](const Row& r) { return r.v_d; }, w.volt);
            expect_column(
                w, "v_q", log.v_q_V, [](const Row& r) { return r.v_q; }, w.volt);
        }
        if (asks('d'))
            expect_column(
                w, "i_d", log.i_d_A, [](const Row& r) { return r.i_d; }, w.ampere);
        if (asks('q'))
            expect_column(
                w, "i_q", log.i_q_A, [](const Row& r) { return r.i_q; }, w.ampere);
        if (asks('w'))
            expect_column(
                w, "w", log.w_m_rad_s, [](const Row& r) { return r.w; }, w.speed);
        if (asks('T'))
            expect_column(
                w, "temp", log.temp_winding_C, [](const Row& r) { return r.temp; }, 0.05);
        if (asks('M'))
            expect_column(
                w, "torque", log.torque_Nm, [](const Row& r) { return r.torque; }, 1e-6);
    }
}

/// A log that ends within a row is the log without that row; JSON of one object cannot be.
static void a_cut_last_row_is_left_out(void)
{
    const command::Folder folder;
    int cut_logs = 0;
    for (const vendor::Written& w : vendor::all()) {
        const std::size_t last = w.text.rfind('\n', w.text.size() - 2) + 1;
        dqw::Survey survey;
        dqw::ReadOptions options = options_of(survey);
        if (std::strcmp(w.format, "simplefoc") == 0) options.given.period_s = 0.02;
        if (std::strcmp(w.format, "mesc_log") == 0 || std::strcmp(w.format, "floaty") == 0) continue;
        const dqw::Log without = dqw::read_log(put(folder, w, w.text.substr(0, last)), options);
        const dqw::Log cut = dqw::read_log(put(folder, w, w.text.substr(0, last + 4)), options);
        TEST_ASSERT_EQUAL_size_t_MESSAGE(without.rows(), cut.rows(), w.format);
        TEST_ASSERT_TRUE_MESSAGE(without.w_m_rad_s == cut.w_m_rad_s, w.format);
        ++cut_logs;
    }
    TEST_ASSERT_TRUE(cut_logs > 20);
}

static void every_format_has_a_writer(void)
{
    std::set<std::string> written = {"dqwatch", "odrive_dyno", "odrive_dyno_list", "test_bench"};  // have real samples
    for (const vendor::Written& w : vendor::all()) written.insert(w.format);
    for (const dqw::Format* format : dqw::formats())
        TEST_ASSERT_TRUE_MESSAGE(written.count(format->name), format->name);
}

static std::uint64_t state;
static std::size_t draw(std::size_t below)
{
    state ^= state << 13, state ^= state >> 7, state ^= state << 17;
    return static_cast<std::size_t>(state % below);
}

static std::vector<std::string> lines_of(const std::string& text)
{
    std::vector<std::string> lines;
    for (std::size_t from = 0; from < text.size();) {
        const std::size_t end = std::min(text.find('\n', from), text.size() - 1);
        lines.push_back(text.substr(from, end + 1 - from));
        from = end + 1;
    }
    return lines;
}

static std::string damaged(const std::string& text, const std::string& foreign)
{
    std::vector<std::string> lines = lines_of(text);
    const std::vector<std::string> others = lines_of(foreign);
    const std::size_t changes = 1 + draw(3);
    for (std::size_t n = 0; n < changes && !lines.empty(); ++n) {
        const std::size_t at = draw(lines.size());
        switch (draw(8)) {
        case 0: lines[at].resize(draw(lines[at].size() + 1)); break;
        case 1: lines.insert(lines.begin() + static_cast<long>(at), lines[at]); break;
        case 2: std::swap(lines[at], lines[draw(lines.size())]); break;
        case 3: lines.insert(lines.begin() + static_cast<long>(at), others[draw(others.size())]); break;
        case 4: lines.erase(lines.begin() + static_cast<long>(at)); break;
        case 5: lines.resize(at); break;
        case 6:
            for (std::size_t k = lines.size() - 1; k > 1; --k) std::swap(lines[k], lines[1 + draw(k)]);
            break;
        default:
            if (!lines[at].empty()) lines[at][draw(lines[at].size())] = static_cast<char>(draw(256));
        }
    }
    std::string out;
    for (const std::string& line : lines) out += line;
    return out;
}

static void a_damaged_file_is_read_or_refused_in_one_line(void)
{
    const command::Folder folder;
    const auto all = vendor::all();
    std::size_t read = 0, refused = 0;
    for (std::size_t f = 0; f < all.size(); ++f)
        for (unsigned long seed = 1; seed <= 60; ++seed) {
            state = (seed + 1000 * f) * 0x9e3779b97f4a7c15ull;
            const std::string where = fmt::format("{} seed {}", all[f].format, seed);
            const std::string path = put(folder, all[f], damaged(all[f].text, all[draw(all.size())].text));
            dqw::Survey survey;
            dqw::ReadOptions options = options_of(survey);
            if (seed % 2) options.survey = nullptr;
            try {
                const dqw::Log log = dqw::read_log(path, options);
                for (const auto& column : dqw::columns) {
                    const auto& values = log.*(column.values);
                    TEST_ASSERT_TRUE_MESSAGE(values.empty() || values.size() == log.rows() || log.rows() == 0,
                                             where.c_str());
                    for (const double v : values) TEST_ASSERT_TRUE_MESSAGE(std::isfinite(v), where.c_str());
                }
                ++read;
            } catch (const dqw::InputError& error) {
                const std::string what = error.what();
                TEST_ASSERT_TRUE_MESSAGE(what.find('\n') == what.npos && what.find(path + ":") == 0, where.c_str());
                ++refused;
            }
        }
    // Both happen, or the damage does not reach the reader.
    TEST_ASSERT_TRUE(read > 200 && refused > 200);
}

static void a_format_may_be_forced_on_any_file(void)
{
    const command::Folder folder;
    const auto all = vendor::all();
    for (const vendor::Written& w : all)
        for (const dqw::Format* format : dqw::formats()) {
            dqw::Survey survey;
            dqw::ReadOptions options = options_of(survey);
            options.format = format->name;
            const std::string where = fmt::format("{} as {}", w.format, format->name);
            try {
                dqw::read_log(put(folder, w, w.text), options);
            } catch (const dqw::InputError& error) {
                const std::string what = error.what();
                TEST_ASSERT_TRUE_MESSAGE(what.find('\n') == what.npos && what.find(folder / "x.") == 0, where.c_str());
                TEST_ASSERT_TRUE_MESSAGE(std::strcmp(w.format, format->name) != 0, (where + what).c_str());
            }
        }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(what_was_written_is_read);
    RUN_TEST(a_cut_last_row_is_left_out);
    RUN_TEST(every_format_has_a_writer);
    RUN_TEST(a_damaged_file_is_read_or_refused_in_one_line);
    RUN_TEST(a_format_may_be_forced_on_any_file);
    return UNITY_END();
}
