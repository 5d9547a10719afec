// Numbers with units, text tables, the JSON object.
// Plain only: long, and what it runs others run under the sanitizers.
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>

#include "app/base/parameters.hpp"
#include "app/base/quantity.hpp"
#include "app/report/report.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

static void a_value_is_rounded_to_its_sd_in_one_prefix(void)
{
    const struct {
        const char* parameter;
        double value, sd;
        const char* text;
    } cases[] = {
        {"R_ohm", 0.3702, 0.0019, "370.2 ± 1.9 mΩ"},
        {"R_ohm", 2.901, 0.2, "2.90 ± 0.20 Ω"},
        {"Ld_H", 3.26e-4, 1.2e-6, "326.0 ± 1.2 µH"},
        {"psi_Wb", 0.02, 0.0, "20.00 mWb"},
        {"J_kgm2", 3.33e-4, 1.4e-5, "(333 ± 14)·10⁻⁶ kg m²"},
        {"B_Nms_rad", 1.971e-4, 3.2e-6, "197.1 ± 3.2 µNms/rad"},
        {"torque_constant_Nm_A", 0.0458, 0.0001, "45.80 ± 0.10 mNm/A"},
        {"pole_pairs", 4, 0, "4"},
        {"R_ohm", 5.233e-3, 1.33e-3, "5.2 ± 1.3 mΩ"},
        {"R_ohm", 0.99999, 0.01, "1.000 ± 0.010 Ω"},
        {"R_ohm", -0.5, 0.1, "-500 ± 100 mΩ"},
        {"R_ohm", 0.5, 1e-12, "500.0000 ± 1.0e-09 mΩ"},
        {"R_ohm", 0, 0.1, "0.00 ± 0.10 Ω"},
        {"unheard_of", 12.5, 0.5, "12.50 ± 0.50"},
    };
    for (const auto& c : cases)
        TEST_ASSERT_EQUAL_STRING(c.text, dqw::with_sd(dqw::quantity(c.parameter, c.value, c.sd)).c_str());
    TEST_ASSERT_EQUAL_STRING("369.0", dqw::number_like(dqw::quantity("R_ohm", 0.37, 0.01), "R_ohm", 0.369).c_str());
}

static void odd_numbers_have_a_text(void)
{
    for (const double v : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e300,
                           1e-300, -1e-300, 0.0})
        for (const double sd :
             {0.0, 1.0, 1e300, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()})
            for (const auto& name : dqw::known_parameters())
                TEST_ASSERT_FALSE(dqw::quantity(name, v, sd).value.empty());
}

static void a_table_counts_characters(void)
{
    TEST_ASSERT_EQUAL_STRING("a   unit\nµ     mΩ\nbb\n", dqw::table({{"a", "unit"}, {"µ", "mΩ"}, {"bb", ""}}).c_str());
}

static dqw::Result sample()
{
    dqw::Result r;
    r.rows = 20000;
    r.parameters = {{"R_ohm", 0.37, 0.002, false}, {"pole_pairs", 4, 0, true}};
    r.not_identifiable = {{"psi_Wb", "it stood still", "turn it"}};
    r.residual_rms = 0.12;
    r.axes = {{"d", 0.1, 1.5}};
    r.notes = {"a note"};
    return r;
}

static void json_has_the_documented_fields(void)
{
    dqw::Machine nominal;
    nominal.R_ohm = 0.36;
    const auto json = nlohmann::json::parse(dqw::json_text(dqw::result_json(sample(), nominal)));
    TEST_ASSERT_EQUAL_STRING("dqwatch.parameters/1", json.at("schema").get<std::string>().c_str());
    TEST_ASSERT_EQUAL_INT(20000, json.at("rows").get<int>());
    TEST_ASSERT_EQUAL_STRING("dynamic", json.at("regime").get<std::string>().c_str());
    TEST_ASSERT_EQUAL_DOUBLE(0.37, json.at("parameters").at("R_ohm").at("value").get<double>());
    TEST_ASSERT_EQUAL_DOUBLE(0.002, json.at("parameters").at("R_ohm").at("sd").get<double>());
    TEST_ASSERT_EQUAL_DOUBLE(0.36, json.at("parameters").at("R_ohm").at("nominal").get<double>());
    TEST_ASSERT_TRUE(json.at("parameters").at("pole_pairs").at("value").is_number_integer());
    TEST_ASSERT_TRUE(json.at("parameters").at("pole_pairs").at("given").get<bool>());
    TEST_ASSERT_FALSE(json.at("parameters").at("pole_pairs").contains("sd"));
    TEST_ASSERT_TRUE(json.at("effects").is_array());
    TEST_ASSERT_EQUAL_STRING("psi_Wb", json.at("not_identifiable").at(0).at("name").get<std::string>().c_str());
    TEST_ASSERT_EQUAL_STRING("it stood still", json.at("not_identifiable").at(0).at("why").get<std::string>().c_str());
    TEST_ASSERT_EQUAL_DOUBLE(0.12, json.at("residual").at("rms").get<double>());
    TEST_ASSERT_EQUAL_STRING("V", json.at("residual").at("unit").get<std::string>().c_str());
}

static void json_survives_odd_text_and_numbers(void)
{
    auto r = sample();
    r.notes = {"\xff\xfe no UTF-8", "quote \" and \n line"};
    r.residual_rms = std::numeric_limits<double>::quiet_NaN();
    r.parameters[0].sd = std::numeric_limits<double>::infinity();
    TEST_ASSERT_TRUE(nlohmann::json::accept(dqw::json_text(dqw::result_json(r, {}))));
}

static void text_names_what_is_not_identifiable(void)
{
    const std::string text = dqw::result_text(sample(), {});
    for (const char* part :
         {"R_ohm", "370.0", "2.0", "mΩ", "given", "psi_Wb: it stood still", "turn it", "0.12 V", "1.5 %"})
        TEST_ASSERT_TRUE_MESSAGE(text.find(part) != std::string::npos, part);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_value_is_rounded_to_its_sd_in_one_prefix);
    RUN_TEST(odd_numbers_have_a_text);
    RUN_TEST(a_table_counts_characters);
    RUN_TEST(json_has_the_documented_fields);
    RUN_TEST(json_survives_odd_text_and_numbers);
    RUN_TEST(text_names_what_is_not_identifiable);
    return UNITY_END();
}
