// Lines, fields and numbers of a CSV file.
#include <clocale>
#include <string>

#include "app/base/input_error.hpp"
#include "app/base/text.hpp"
#include "app/read/csv.hpp"
#include "app/read/line_source.hpp"
#include "command.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

static void separator_is_the_most_frequent_outside_quotes(void)
{
    TEST_ASSERT_EQUAL_CHAR(',', dqw::separator_of("a,b,c"));
    TEST_ASSERT_EQUAL_CHAR(';', dqw::separator_of("a;b;c"));
    TEST_ASSERT_EQUAL_CHAR(';', dqw::separator_of("\"a,b,c,d\";b;c"));
    TEST_ASSERT_EQUAL_CHAR('\t', dqw::separator_of("a\tb"));
    TEST_ASSERT_EQUAL_CHAR(',', dqw::separator_of("alone"));
}

static void fields_lose_quotes_and_spaces(void)
{
    const auto fields = dqw::split(" a , \"b,\"\"c\" ,, d ", ',');
    TEST_ASSERT_EQUAL_size_t(4, fields.size());
    TEST_ASSERT_EQUAL_STRING("a", fields[0].c_str());
    TEST_ASSERT_EQUAL_STRING("b,\"c", fields[1].c_str());
    TEST_ASSERT_EQUAL_STRING("", fields[2].c_str());
    TEST_ASSERT_EQUAL_STRING("d", fields[3].c_str());
    TEST_ASSERT_EQUAL_size_t(1, dqw::split("", ',').size());
    TEST_ASSERT_EQUAL_size_t(1, dqw::split("\"open", ',').size());
}

static void numbers_are_read_whatever_the_locale(void)
{
    // Debian's C.UTF-8 has a point; where a comma locale is installed, it is tried.
    std::setlocale(LC_ALL, "de_DE.UTF-8");
    const struct {
        const char* text;
        double value;
    } good[] = {{"1.5", 1.5}, {"-2e-3", -0.002}, {"+4", 4},     {" 7 ", 7},
                {".5", 0.5},  {"5.", 5},         {"1e-400", 0}, {"-0", 0}};
    for (const auto& g : good) {
        double value = -1;
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, static_cast<int>(dqw::parse_number(g.text, value)), g.text);
        TEST_ASSERT_EQUAL_DOUBLE_MESSAGE(g.value, value, g.text);
    }
    std::setlocale(LC_ALL, "C");
}

static void what_is_no_number_is_told_apart(void)
{
    const struct {
        const char* text;
        dqw::NumberError error;
    } bad[] = {{"", dqw::NumberError::empty},
               {"  ", dqw::NumberError::empty},
               {"abc", dqw::NumberError::text},
               {"1.5V", dqw::NumberError::text},
               {"nan", dqw::NumberError::not_finite},
               {"-NaN", dqw::NumberError::not_finite},
               {"inf", dqw::NumberError::not_finite},
               {"-Infinity", dqw::NumberError::not_finite},
               {"1e999", dqw::NumberError::not_finite},
               {"1,5", dqw::NumberError::decimal_comma},
               {"0x10", dqw::NumberError::text},
               {"1 2", dqw::NumberError::text},
               {"+-1", dqw::NumberError::text},
               {"--1", dqw::NumberError::text},
               {"1e", dqw::NumberError::text},
               {"+", dqw::NumberError::text},
               {"-", dqw::NumberError::text}};
    for (const auto& b : bad) {
        double value = 0;
        TEST_ASSERT_EQUAL_INT_MESSAGE(static_cast<int>(b.error), static_cast<int>(dqw::parse_number(b.text, value)),
                                      b.text);
    }
}

static void lines_come_whole_across_buffers(void)
{
    const command::Folder folder;
    std::string text;
    for (int i = 0; i < 30000; ++i)
        text += std::string(static_cast<std::size_t>(i % 97), 'x') + (i % 3 ? "\n" : "\r\n");
    text += "last";
    dqw::LineSource lines(folder.write("lines", text));
    std::string_view line;
    for (std::size_t i = 0; i < 30000; ++i) {
        TEST_ASSERT_TRUE(lines.next(line));
        TEST_ASSERT_EQUAL_size_t(i % 97, line.size());
        TEST_ASSERT_EQUAL_size_t(i + 1, lines.line_number());
    }
    TEST_ASSERT_TRUE(lines.next(line));
    TEST_ASSERT_EQUAL_STRING("last", std::string(line).c_str());
    TEST_ASSERT_FALSE(lines.next(line));
    TEST_ASSERT_EQUAL_UINT64(lines.file_bytes(), lines.bytes_consumed());
}

static void a_line_above_1_MiB_is_refused(void)
{
    const command::Folder folder;
    dqw::LineSource lines(folder.write("long", "head\n" + std::string(3 << 20, '7') + "\n"));
    std::string_view line;
    TEST_ASSERT_TRUE(lines.next(line));
    try {
        lines.next(line);
        TEST_FAIL_MESSAGE("accepted");
    } catch (const dqw::InputError& error) {
        TEST_ASSERT_EQUAL_size_t(2, error.line);
    }
}

static void foreign_bytes_are_shown_safely(void)
{
    TEST_ASSERT_EQUAL_STRING("\"a\\x1b[31m\"", dqw::shown("a\x1b[31m").c_str());
    TEST_ASSERT_EQUAL_STRING("\"aaaa…\"", dqw::shown("aaaaaaa", 4).c_str());
    // Whole characters; of bytes that are none three less at most.
    TEST_ASSERT_EQUAL_STRING("\"aaa…\"", dqw::shown("aaa°", 4).c_str());
    TEST_ASSERT_EQUAL_size_t(1 + 7 + 4, dqw::shown(std::string(20, '\x80'), 10).size());
    TEST_ASSERT_EQUAL_STRING("°C", dqw::as_utf8("\xb0"
                                                "C")
                                       .c_str());
    TEST_ASSERT_EQUAL_STRING("ÿ°C", dqw::as_utf8("\xff\xb0"
                                                 "C")
                                        .c_str());
    TEST_ASSERT_EQUAL_STRING("°C", dqw::as_utf8("°C").c_str());
    TEST_ASSERT_EQUAL_STRING("a, b … and 1 more", dqw::list({"a", "b", "c"}, 2).c_str());
    TEST_ASSERT_EQUAL_STRING("1 row", dqw::counted(1, "row").c_str());
    TEST_ASSERT_EQUAL_STRING("2 rows", dqw::counted(2, "row").c_str());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(separator_is_the_most_frequent_outside_quotes);
    RUN_TEST(fields_lose_quotes_and_spaces);
    RUN_TEST(numbers_are_read_whatever_the_locale);
    RUN_TEST(what_is_no_number_is_told_apart);
    RUN_TEST(lines_come_whole_across_buffers);
    RUN_TEST(a_line_above_1_MiB_is_refused);
    RUN_TEST(foreign_bytes_are_shown_safely);
    return UNITY_END();
}
