// Every bad log that can be named, to every subcommand that reads one: one line FILE:LINE and exit code 3, or it works.
#include <nlohmann/json.hpp>
#include <string>

#include "command.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

using command::Folder;
using command::Outcome;

static const char* const readers[] = {"fit", "learn", "trace"};
static const char* const estimators[] = {"fit", "learn"};

/// Exit code 3, nothing on stdout, one line on stderr that begins FILE:LINE: and holds `names`.
static void expect_refused(const Outcome& run, const std::string& file, long line, const std::string& names)
{
    const std::string begin = file + ":" + std::to_string(line) + ": ";
    TEST_ASSERT_EQUAL_INT_MESSAGE(3, run.code, (names + ": " + run.err).c_str());
    TEST_ASSERT_EQUAL_STRING_MESSAGE("", run.out.c_str(), names.c_str());
    TEST_ASSERT_TRUE_MESSAGE(run.err.compare(0, begin.size(), begin) == 0, run.err.c_str());
    TEST_ASSERT_TRUE_MESSAGE(run.err.find('\n') == run.err.size() - 1, run.err.c_str());
    TEST_ASSERT_TRUE_MESSAGE(run.err.find(names) != std::string::npos, run.err.c_str());
}

static void refused(const std::string& text, long line, const std::string& names, const std::string& toml = "")
{
    const Folder folder;
    const std::string path = folder.write("log.csv", text);
    if (!toml.empty()) folder.write("log.toml", toml);
    for (const char* reader : readers) expect_refused(command::dqwatch({reader, path}), path, line, names);
    expect_refused(command::dqwatch({"fit", "--json", path}), path, line, names);
}

/// A good log of `rows` rows as text, line `line` (from 1) passed through `change`.
template <class Change> static std::string good(std::size_t rows, std::size_t line, Change change)
{
    const Folder folder;
    command::write_log(folder / "x", rows);
    const std::string text = command::read_file(folder / "x");
    std::string out;
    std::size_t number = 0;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = text.find('\n', at);
        std::string row = text.substr(at, end - at);
        if (++number == line) change(row);
        out += row + "\n";
        at = end + 1;
    }
    return out;
}

static std::string good(std::size_t rows = 200)
{
    return good(rows, 0, [](std::string&) {});
}

/// Replaces field `index` of a row.
static void put(std::string& row, int index, const std::string& text)
{
    std::size_t at = 0;
    for (; index > 0; --index) at = row.find(',', at) + 1;
    row.replace(at, row.find(',', at) - at, text);
}

static std::string with_field(std::size_t line, int index, const std::string& text)
{
    return good(200, line, [&](std::string& row) { put(row, index, text); });
}

static void a_missing_file(void)
{
    for (const char* reader : readers) {
        expect_refused(command::dqwatch({reader, "/nowhere/log.csv"}), "/nowhere/log.csv", 0, "No such file");
        expect_refused(command::dqwatch({reader, "."}), ".", 0, "directory");
    }
}

static void a_missing_machine_file(void)
{
    const Folder folder;
    const std::string path = folder.write("log.csv", good());
    for (const char* reader : readers)
        expect_refused(command::dqwatch({reader, path, "--machine", "/nowhere.toml"}), "/nowhere.toml", 0,
                       "No such file");
    expect_refused(command::dqwatch({"fit", path, "--machine", path}), path, 1, "TOML");
}

static void an_unreadable_machine_file(void)
{
    const Folder folder;
    const std::string path = folder.write("log.csv", good()),
                      toml = folder.write("log.toml", "[machine]\nname = \"x\"\nR_ohm = -1\n");
    for (const char* reader : readers) expect_refused(command::dqwatch({reader, path}), toml, 3, "R_ohm");
    folder.write("log.toml", "[machine]\npole_pairs = 2.5\n");
    for (const char* reader : readers) expect_refused(command::dqwatch({reader, path}), toml, 2, "pole_pairs");
    folder.write("log.toml", "[machine\n");
    for (const char* reader : readers) expect_refused(command::dqwatch({reader, path}), toml, 1, "TOML");
}

static void an_empty_file(void) { refused("", 1, "empty file"); }
static void an_empty_first_line(void) { refused("\n" + good(), 1, "header"); }
static void a_header_only(void) { refused("t_s,v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s\n", 1, "no data"); }

static void a_missing_column(void)
{
    const char* const names[] = {"t_s", "v_d_V", "v_q_V", "i_d_A", "i_q_A", "w_m_rad_s"};
    for (int c = 0; c < 6; ++c) {
        const std::string toml = "[log]\nregime = \"dynamic\"\n";
        const std::string text = good(200, 1, [&](std::string& row) { put(row, c, "other"); });
        refused(text, 1, std::string("missing column ") + names[c], toml);
        refused(text, 1, "other", toml);
    }
    refused("a,b\n1,2\n", 1, "a, b");
}

static void a_duplicate_column(void)
{
    refused(good(200, 1, [](std::string& row) { put(row, 2, "v_d_V"); }), 1, "v_d_V");
}

static void text_in_a_number(void)
{
    refused(with_field(57, 3, "abc"), 57, "i_d_A is \"abc\"");
    refused(with_field(201, 0, "12:30"), 201, "t_s is \"12:30\"");
    refused(with_field(2, 5, "10 rad/s"), 2, "w_m_rad_s is \"10 rad/s\"");
    refused(with_field(3, 1, ""), 3, "v_d_V is empty");
    refused(with_field(3, 1, std::string("\0\x01", 2)), 3, "\\x00\\x01");
}

static void nan_and_infinity(void)
{
    for (const char* bad : {"nan", "NaN", "-nan", "inf", "-Infinity", "1e999"})
        refused(with_field(57, 2, bad), 57, "v_q_V is \"" + std::string(bad) + "\"");
}

static void rows_of_unequal_length(void)
{
    refused(good(200, 57, [](std::string& row) { row.erase(row.rfind(',')); }), 57, "5 fields");
    refused(good(200, 57, [](std::string& row) { row += ",1"; }), 57, "7 fields");
    refused(good(200, 200, [](std::string& row) { row.erase(12); }), 200, "expected 6");
    refused(good(200, 201, [](std::string& row) { row += ",1"; }), 201, "7 fields");
    refused(good(200, 201, [](std::string& row) { row[12] = 'x'; }), 201, "expected a number");
}

/// A controller that lost power: its last row goes, and the log counts as without it.
static void a_truncated_file(void)
{
    const Folder folder;
    const std::string text = good();
    const std::size_t last = text.rfind('\n', text.size() - 2) + 1;
    const std::string whole = folder.write("whole.csv", text.substr(0, last));
    const auto fitted = [](const std::string& path) {
        const Outcome run = command::dqwatch({"fit", path, "--json"});
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
        return nlohmann::json::parse(run.out);
    };
    const nlohmann::json expected = fitted(whole).at("parameters");
    std::string half = text.substr(last, 14);
    for (const std::string& cut :
         {text.substr(0, text.rfind(',')), text.substr(0, last) + half, text.substr(0, last) + half + "\n",
          text.substr(0, last) + half + "\n\n", text.substr(0, text.rfind(',') + 1), text.substr(0, last + 1) + "-"}) {
        const nlohmann::json said = fitted(folder.write("cut.csv", cut));
        TEST_ASSERT_EQUAL_STRING(expected.dump().c_str(), said.at("parameters").dump().c_str());
        TEST_ASSERT_TRUE_MESSAGE(said.at("notes").dump().find("line 201: the log ends within it") != std::string::npos,
                                 said.at("notes").dump().c_str());
    }
}

static void time_that_does_not_increase(void)
{
    refused(with_field(57, 0, "-1"), 57, "increase");
    refused(good(200, 2, [](std::string& row) { put(row, 0, "1e300"); }), 3, "increase");
}

// No converter samples that fast; from 5e-23 s on a block of a millisecond has more rows than there are whole numbers.
static void time_in_no_unit(void)
{
    for (const char* unit : {"e-13", "e-24", "e-27", "e-320"}) {
        std::string text = "t_s,v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s\n";
        for (int k = 0; k < 400; ++k)
            text += std::to_string(k) + unit + "," + std::to_string(k * 37 % 20) + "," + std::to_string(k * 53 % 20) +
                    "," + std::to_string(k * 11 % 7) + "," + std::to_string(k * 29 % 5) + "," +
                    std::to_string(100 + k % 30) + "\n";
        const Folder folder;
        const std::string path = folder.write("log.csv", text);
        folder.write("log.toml", "[machine]\npole_pairs = 4\nR_ohm = 0.4\nLd_H = 1e-3\nLq_H = 1e-3\npsi_Wb = 0.02\n");
        for (const char* reader : {"fit", "learn", "trace", "monitor", "compare"})
            expect_refused(command::dqwatch({reader, path, "--out", folder / "out"}, {}, 20), path, 2,
                           "expected seconds");
    }
}

static void too_few_rows(void) { refused(good(20), 21, "20 rows"); }

/// A trace leaves out the start of each piece, and nothing is left of these.
static void pieces_too_short_to_trace(void)
{
    const std::string all = good(6000);
    std::string text;
    std::size_t number = 0;
    for (std::size_t at = 0, end; (end = all.find('\n', at)) != std::string::npos; at = end + 1)
        if (number++ % 60 < 50) text += all.substr(at, end + 1 - at);
    const Folder folder;
    const std::string path = folder.write("log.csv", text);
    expect_refused(command::dqwatch({"trace", path, "--out", folder / "out"}), path, 5001,
                   "too short to hold some out");
}

static void binary_junk(void)
{
    refused(std::string("\x7f"
                        "ELF\0\0\0\1,2",
                        10),
            1, "NUL");
    refused("\xff\xfet\0_\0s\0", 1, "UTF-16");
    std::string noise;
    for (unsigned i = 0; i < 100000; ++i) noise += static_cast<char>(1 + (i * 2654435761u >> 24) % 255);
    const Folder folder;
    const std::string path = folder.write("log.csv", noise);
    for (const char* reader : readers) TEST_ASSERT_EQUAL_INT(3, command::dqwatch({reader, path}).code);
}

static void a_line_of_10_MB(void)
{
    refused(good() + std::string(10000000, '7') + "\n", 202, "1 MiB");
    refused(std::string(10000000, 'x'), 1, "1 MiB");
}

static void a_header_of_10000_columns(void)
{
    std::string header;
    for (int i = 0; i < 10000; ++i) header += "c" + std::to_string(i) + ",";
    refused(header + "t_s\n", 1, "columns");
}

static void lines_that_end_with_cr_alone(void)
{
    std::string text = good();
    for (char& c : text)
        if (c == '\n') c = '\r';
    refused(text, 1, "CR");
}

static void a_decimal_comma(void)
{
    std::string text = good();
    for (char& c : text) c = c == ',' ? ';' : c;
    text.replace(text.find(".000"), 1, ",");
    refused(text, 2, "decimal point");
}

static void a_gap_in_time_works_with_a_note(void)
{
    const Folder folder;
    std::string text = good(2000);
    const std::string late = good(4000);
    std::size_t at = 0;
    for (int line = 0; line < 3001; ++line) at = late.find('\n', at) + 1;
    const std::string path = folder.write("log.csv", text + late.substr(at));
    for (const char* reader : estimators) {
        const Outcome run = command::dqwatch({reader, path, "--pole-pairs", "4", "--json"});
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
        TEST_ASSERT_TRUE_MESSAGE(run.err.find("1 gap in time") != std::string::npos, run.err.c_str());
        TEST_ASSERT_TRUE_MESSAGE(run.err.find("before line 2002") != std::string::npos, run.err.c_str());
        const auto json = nlohmann::json::parse(run.out);
        TEST_ASSERT_TRUE(json.at("notes").dump().find("1 gap in time") != std::string::npos);
        TEST_ASSERT_EQUAL_INT(3000, json.at("rows").get<int>());
        TEST_ASSERT_DOUBLE_WITHIN(0.01 * 0.5, 0.5, json.at("parameters").at("R_ohm").at("value").get<double>());
    }
}

static void constant_signals_are_not_identifiable(void)
{
    const Folder folder;
    std::string text = "t_s,v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s\n", zero = text;
    for (int k = 0; k < 2000; ++k) {
        const std::string time = std::to_string(k * 1e-4);
        text += time + ",-2.4,21.5,0,2,100\n";
        zero += time + ",0,0,0,0,0\n";
    }
    for (const std::string& log : {text, zero}) {
        const std::string path = folder.write("log.csv", log);
        folder.write("log.toml", "[log]\nregime = \"dynamic\"\n[machine]\npole_pairs = 4\n");
        for (const char* reader : estimators) {
            const Outcome run = command::dqwatch({reader, path, "--json"});
            TEST_ASSERT_EQUAL_INT_MESSAGE(4, run.code, (std::string(reader) + run.err + run.out).c_str());
            const auto json = nlohmann::json::parse(run.out);
            TEST_ASSERT_TRUE(json.at("not_identifiable").size() > 0);
            for (const auto& item : json.at("not_identifiable")) {
                TEST_ASSERT_FALSE(json.at("parameters").contains(item.at("name").get<std::string>()));
                TEST_ASSERT_FALSE(item.at("why").get<std::string>().empty());
            }
        }
    }
}

static void logs_that_do_not_belong_together(void)
{
    const Folder folder;
    const std::string a = folder.write("a.csv", good()), b = folder.write("b.csv", good()),
                      c = folder.write("c.csv", good());
    folder.write("a.toml", "[machine]\npole_pairs = 4\n");
    folder.write("b.toml", "[log]\nregime = \"steady\"\n");
    folder.write("c.toml", "[machine]\npole_pairs = 3\n");
    for (const char* reader : readers) {
        expect_refused(command::dqwatch({reader, a, b}), b, 1, "one regime");
        expect_refused(command::dqwatch({reader, a, c}), c, 1, "one machine");
        expect_refused(command::dqwatch({reader, a, folder / "none.csv"}), folder / "none.csv", 0, "No such file");
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_missing_file);
    RUN_TEST(a_missing_machine_file);
    RUN_TEST(an_unreadable_machine_file);
    RUN_TEST(an_empty_file);
    RUN_TEST(an_empty_first_line);
    RUN_TEST(a_header_only);
    RUN_TEST(a_missing_column);
    RUN_TEST(a_duplicate_column);
    RUN_TEST(text_in_a_number);
    RUN_TEST(nan_and_infinity);
    RUN_TEST(rows_of_unequal_length);
    RUN_TEST(a_truncated_file);
    RUN_TEST(time_that_does_not_increase);
    RUN_TEST(time_in_no_unit);
    RUN_TEST(too_few_rows);
    RUN_TEST(pieces_too_short_to_trace);
    RUN_TEST(binary_junk);
    RUN_TEST(a_line_of_10_MB);
    RUN_TEST(a_header_of_10000_columns);
    RUN_TEST(lines_that_end_with_cr_alone);
    RUN_TEST(a_decimal_comma);
    RUN_TEST(a_gap_in_time_works_with_a_note);
    RUN_TEST(constant_signals_are_not_identifiable);
    RUN_TEST(logs_that_do_not_belong_together);
    return UNITY_END();
}
