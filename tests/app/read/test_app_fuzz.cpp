// Random damage to a valid log and machine file: the reader gives a log or an InputError of one line, nothing else.
#include <cmath>
#include <string>

#include "app/base/columns.hpp"
#include "app/read/log_reader.hpp"
#include "command.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

static std::uint64_t state;
static std::size_t draw(std::size_t below)
{
    state ^= state << 13, state ^= state >> 7, state ^= state << 17;
    return static_cast<std::size_t>(state % below);
}

static std::string damaged(std::string text)
{
    static const char* const pieces[] = {",",     ";", "\n", "\r", "\"",           "nan", "-",
                                         "1e999", "=", "[",  "\t", "\xef\xbb\xbf", ",,",  "t_s"};
    const std::size_t changes = 1 + draw(4);
    for (std::size_t i = 0; i < changes && !text.empty(); ++i) {
        const std::size_t at = draw(text.size());
        switch (draw(5)) {
        case 0: text[at] = static_cast<char>(draw(256)); break;
        case 1: text.erase(at, 1 + draw(20)); break;
        case 2: text.insert(at, pieces[draw(sizeof pieces / sizeof *pieces)]); break;
        case 3: text.insert(draw(text.size()), text.substr(at, draw(60))); break;
        default: text.resize(at); break;
        }
    }
    return text;
}

static void expect_log_or_error(const command::Folder& folder, unsigned long seed)
{
    const std::string where = "seed " + std::to_string(seed);
    try {
        std::vector<std::string> notes;
        dqw::ReadOptions options;
        options.notes = &notes;
        const dqw::Log log = dqw::read_log(folder / "x.csv", options);
        for (const auto& column : dqw::columns) {
            const auto& values = log.*(column.values);
            TEST_ASSERT_TRUE_MESSAGE(values.empty() || values.size() == log.rows(), where.c_str());
            for (const double v : values) TEST_ASSERT_TRUE_MESSAGE(std::isfinite(v), where.c_str());
        }
        TEST_ASSERT_EQUAL_size_t_MESSAGE(0, log.segments.front(), where.c_str());
        for (std::size_t s = 1; s < log.segments.size(); ++s)
            TEST_ASSERT_TRUE_MESSAGE(log.segments[s] > log.segments[s - 1] && log.segments[s] < log.rows(),
                                     where.c_str());
    } catch (const dqw::InputError& error) {
        TEST_ASSERT_TRUE_MESSAGE(std::string(error.what()).find('\n') == std::string::npos, where.c_str());
    }
}

static void a_damaged_log_is_read_or_refused(void)
{
    const command::Folder folder;
    command::Machine machine;
    command::write_log(folder / "x.csv", 60, machine);
    const std::string csv = command::read_file(folder / "x.csv");
    const std::string toml = "[machine]\npole_pairs = 4\nR_ohm = 0.5\npsi_Wb = 0.05\n[log]\nvoltage_interval = "
                             "\"previous\"\n[columns]\ni_q_A = { from = \"i_q_A\", scale = 1.0 }\n";
    for (unsigned long seed = 1; seed <= 800; ++seed) {
        state = seed * 0x9e3779b97f4a7c15ull;
        folder.write("x.csv", seed % 4 ? damaged(csv) : csv);
        folder.write("x.toml", seed % 4 ? toml : damaged(toml));
        expect_log_or_error(folder, seed);
    }
}

static void noise_is_refused(void)
{
    const command::Folder folder;
    for (unsigned long seed = 1; seed <= 100; ++seed) {
        state = seed * 0x9e3779b97f4a7c15ull;
        std::string text(draw(3000), '\0');
        for (char& c : text) c = static_cast<char>(draw(256));
        folder.write("x.csv", text);
        try {
            dqw::read_log(folder / "x.csv");
            TEST_FAIL_MESSAGE("accepted");
        } catch (const dqw::InputError&) {
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_damaged_log_is_read_or_refused);
    RUN_TEST(noise_is_refused);
    return UNITY_END();
}
