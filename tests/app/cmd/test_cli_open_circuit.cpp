// A power analyser's RMS volts of an open circuit, against the flux and its coefficient that they were made of.
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "command.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

using command::Folder;
using command::Outcome;
using nlohmann::json;

static const double pi = 3.14159265358979323846, psi_Wb = 0.05, beta_per_K = -9e-4;

static bool has(const std::string& text, const std::string& part) { return text.find(part) != text.npos; }

/// Between lines, or of a phase; `unit` empty: nobody says which. `lack`: by which part more at the highest speed than
/// at rest.
static std::string table(const Folder& folder, const std::string& name, double temp_C, bool lines,
                         const std::string& unit, double lack = 0)
{
    std::string csv = "SO_N_HM [1/min],M_HMmess [Nm],PA1_URMS_1_gMW [V],T_MOTOR [°C]\n";
    for (int n = 1; n <= 12; ++n) {
        const double w_e = 3 * 500.0 * n * pi / 30, noise = 1 + 1e-4 * std::sin(7.0 * n + temp_C);
        const double peak = w_e * psi_Wb * (1 + beta_per_K * (temp_C - 25)) * noise * (1 + lack * n / 12);
        csv += std::to_string(500 * n) + ",-0.5," + std::to_string(peak / std::sqrt(2) * (lines ? std::sqrt(3) : 1)) +
               "," + std::to_string(temp_C) + "\n";
    }
    if (!unit.empty())
        folder.write(name + ".toml", "[columns]\nv_q_V = { from = \"PA1_URMS_1_gMW [V]\", unit = \"" + unit + "\" }\n");
    return folder.write(name + ".csv", csv);
}

static double flux(const std::string& log)
{
    const Outcome run = command::dqwatch({"fit", log, "--pole-pairs", "3", "--json"});
    TEST_ASSERT_TRUE_MESSAGE(run.code == 0 || run.code == 4, run.err.c_str());
    TEST_ASSERT_TRUE_MESSAGE(has(run.err, "read as an open circuit"), run.err.c_str());
    const json said = json::parse(run.out);
    TEST_ASSERT_FALSE(said.at("parameters").contains("R_ohm"));
    return said.at("parameters").at("psi_Wb").at("value");
}

static void volts_of_lines_and_of_phases_give_one_flux(void)
{
    const Folder folder;
    TEST_ASSERT_DOUBLE_WITHIN(1e-4 * psi_Wb, psi_Wb, flux(table(folder, "lines", 25, true, "V RMS line")));
    TEST_ASSERT_DOUBLE_WITHIN(1e-4 * psi_Wb, psi_Wb, flux(table(folder, "phases", 25, false, "V RMS")));
}

static void whose_volts_is_asked_for(void)
{
    const Folder folder;
    const Outcome run = command::dqwatch({"fit", table(folder, "x", 25, true, ""), "--pole-pairs", "3"});
    TEST_ASSERT_EQUAL_INT(3, run.code);
    TEST_ASSERT_TRUE_MESSAGE(has(run.err, "V RMS line"), run.err.c_str());
}

static void two_temperatures_give_the_coefficient(void)
{
    const Folder folder;
    const Outcome run = command::dqwatch({"trace", table(folder, "cold", 20, true, "V RMS line"),
                                          table(folder, "hot", 65, true, "V RMS line"), "--pole-pairs", "3", "--json",
                                          "--out", folder / "o"});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
    const json effects = json::parse(run.out).at("effects");
    TEST_ASSERT_EQUAL_size_t(1, effects.size());
    TEST_ASSERT_EQUAL_STRING("magnet_temperature", effects[0].at("name").get<std::string>().c_str());
    const double beta = effects[0].at("parameters").at("beta_per_K").at("value");
    TEST_ASSERT_DOUBLE_WITHIN(0.01 * std::fabs(beta_per_K), beta_per_K, beta);
}

/// RMS volts that are called volts.
static void rms_taken_as_a_peak_is_told(void)
{
    const Folder folder;
    for (const char* unit : {"V", "V RMS"}) {
        const Outcome run = command::dqwatch({"fit", table(folder, "x", 25, true, unit), "--pole-pairs", "3"});
        TEST_ASSERT_EQUAL_INT_MESSAGE(unit == std::string("V"), has(run.err, "is taken as a peak"), run.err.c_str());
    }
}

/// RMS amperes of a shorted machine, mapped by hand, beside its open circuit.
static void a_short_circuit_beside_it_gives_R_and_L(void)
{
    const Folder folder;
    std::string csv = "rpm,amps\n";
    for (int n = 1; n <= 24; ++n) {
        const double w = 3 * 20 * std::pow(1.25, n) * pi / 30, q = w * psi_Wb * 0.01 / (1e-4 + w * w * 1e-8);
        csv += std::to_string(20 * std::pow(1.25, n)) + "," +
               std::to_string(q * std::hypot(1, w * 0.01) / std::sqrt(2)) + "\n";
    }
    const std::string log = folder.write("short.csv", csv);
    folder.write("short.toml", "[columns]\nw_m_rad_s = { from = \"rpm\", unit = \"rpm\" }\nv_d_V = { value = 0 }\n"
                               "v_q_V = { value = 0 }\ni_d_A = { value = 0 }\n"
                               "i_q_A = { from = \"amps\", unit = \"A RMS\" }\n");
    const std::string open = table(folder, "open", 25, true, "V RMS line");
    const Outcome run = command::dqwatch({"fit", open, log, "--pole-pairs", "3", "--json"});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, (run.err + run.out).c_str());
    const json said = json::parse(run.out).at("parameters");
    TEST_ASSERT_DOUBLE_WITHIN(0.01 * 0.01, 0.01, said.at("R_ohm").at("value").get<double>());
    TEST_ASSERT_DOUBLE_WITHIN(0.01 * 1e-4, 1e-4, said.at("Ld_H").at("value").get<double>());
    for (const char* other : {"learn", "trace", "compare"}) {
        const Outcome refused = command::dqwatch({other, log, "--pole-pairs", "3", "--out", folder / "o"});
        TEST_ASSERT_EQUAL_INT_MESSAGE(3, refused.code, refused.err.c_str());
        TEST_ASSERT_TRUE_MESSAGE(has(refused.err, "a short circuit"), refused.err.c_str());
    }
}

static json fitted(const std::string& log)
{
    return json::parse(command::dqwatch({"fit", log, "--pole-pairs", "3", "--json"}).out).at("parameters").at("psi_Wb");
}

static json traced(const std::vector<std::string>& logs, const std::string& out)
{
    std::vector<std::string> words{"trace", "--pole-pairs", "3", "--json", "--out", out};
    words.insert(words.end(), logs.begin(), logs.end());
    const Outcome run = command::dqwatch(words);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
    return json::parse(run.out);
}

/// What neighbours share is the deviation: of a line from 0 to 1 % about the fit, whose square weighs by the speed's.
static void what_goes_with_speed_is_in_the_deviation(void)
{
    const Folder folder;
    const std::string plain = table(folder, "plain", 25, true, "V RMS line"),
                      lacks = table(folder, "lacks", 25, true, "V RMS line", -0.01);
    TEST_ASSERT_TRUE(fitted(plain).at("sd").get<double>() < 2e-4 * psi_Wb);
    double mean = 0, of_all = 0, sum = 0;
    for (int n = 1; n <= 12; ++n) mean += n * n * (1 - 0.01 * n / 12), of_all += n * n;
    mean /= of_all;
    for (int n = 1; n < 12; ++n) sum += (1 - 0.01 * n / 12 - mean) * (1 - 0.01 * (n + 1) / 12 - mean) / 11;
    const json found = fitted(lacks);
    TEST_ASSERT_DOUBLE_WITHIN(1e-4 * psi_Wb, mean * psi_Wb, found.at("value").get<double>());
    TEST_ASSERT_DOUBLE_WITHIN(0.1 * std::sqrt(sum) * psi_Wb, std::sqrt(sum) * psi_Wb, found.at("sd").get<double>());
    const json trace = traced({lacks}, folder / "t");
    for (const json& fit : {trace.at("after"), trace.at("learner").at("after")})
        TEST_ASSERT_DOUBLE_WITHIN(0.2 * std::sqrt(sum) * psi_Wb, std::sqrt(sum) * psi_Wb,
                                  fit.at("parameters").at("psi_Wb").at("sd").get<double>());
}

/// A magnet that lags: by what it moves unseen within a log it may be off.
static void a_sensor_beside_the_magnet_is_told_and_counts(void)
{
    const Folder folder;
    const json trace = traced(
        {table(folder, "cold", 20, true, "V RMS line", 0.002), table(folder, "hot", 65, true, "V RMS line", -0.007)},
        folder / "o");
    const json beta = trace.at("effects").at(0).at("parameters").at("beta_per_K");
    const double expected = std::hypot(0.002, 0.007) / 45;
    TEST_ASSERT_DOUBLE_WITHIN(0.2 * expected, expected, beta.at("sd").get<double>());
    TEST_ASSERT_DOUBLE_WITHIN(2 * expected, beta_per_K, beta.at("value").get<double>());
    TEST_ASSERT_TRUE_MESSAGE(has(trace.at("notes").dump(), "no thermometer is on the magnet"),
                             trace.at("notes").dump().c_str());
}

static void an_option_that_changes_nothing_is_told(void)
{
    const Folder folder;
    const std::string log = table(folder, "x", 25, true, "V RMS line");
    const Outcome idle = command::dqwatch({"fit", log, "--pole-pairs", "3", "--gear", "9"});
    TEST_ASSERT_TRUE_MESSAGE(has(idle.err, "--gear changes nothing"), idle.err.c_str());
    std::string csv = "v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s,v_dc_V\n";
    for (int k = 1; k < 10; ++k)
        csv += std::to_string(-k) + "," + std::to_string(2 * k) + ",0," + std::to_string(k % 4) + "," +
               std::to_string(10 * k) + ",48\n";
    const std::string own = folder.write("own.csv", csv);
    const Outcome link = command::dqwatch({"columns", own, "--v-dc", "24"});
    TEST_ASSERT_FALSE(has(link.err, "--gear"));
    TEST_ASSERT_TRUE_MESSAGE(has(link.err + link.out, "--v-dc changes nothing"), (link.err + link.out).c_str());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(volts_of_lines_and_of_phases_give_one_flux);
    RUN_TEST(whose_volts_is_asked_for);
    RUN_TEST(two_temperatures_give_the_coefficient);
    RUN_TEST(rms_taken_as_a_peak_is_told);
    RUN_TEST(a_short_circuit_beside_it_gives_R_and_L);
    RUN_TEST(what_goes_with_speed_is_in_the_deviation);
    RUN_TEST(a_sensor_beside_the_magnet_is_told_and_counts);
    RUN_TEST(an_option_that_changes_nothing_is_told);
    return UNITY_END();
}
