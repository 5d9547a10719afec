// LOG.toml: what is taken, what is noted, what is refused and where.
#include <cmath>
#include <string>

#include "app/base/input_error.hpp"
#include "app/read/machine_file.hpp"
#include "command.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

static dqw::MachineFile read(const std::string& text)
{
    const command::Folder folder;
    return dqw::read_machine_file(folder.write("m.toml", text));
}

static void everything_documented_is_read(void)
{
    const auto file = read(
        "# Source: here, MIT.\n[machine]\nname = \"m\"\npole_pairs = 4\nR_ohm = 0.37\nLd_H = 0.326e-3\nLq_H = "
        "1e-3\npsi_Wb = 0.02\n"
        "J_kgm2 = 4e-5\nB_Nms_rad = 2e-5\ntorque_constant_Nm_A = 0.12\n[log]\nregime = \"steady\"\nvoltage_interval = "
        "\"previous\"\n"
        "[columns]\ni_q_A = { from = \"Iq_mA\", scale = 0.001 }\nt_s = \"time\"\nv_d_V = { scale = 2 }\n");
    TEST_ASSERT_EQUAL_STRING("m", file.machine.name.c_str());
    TEST_ASSERT_EQUAL_DOUBLE(4, *file.machine.pole_pairs);
    TEST_ASSERT_EQUAL_DOUBLE(0.37, *file.machine.R_ohm);
    TEST_ASSERT_EQUAL_DOUBLE(0.12, *file.machine.torque_constant_Nm_A);
    TEST_ASSERT_TRUE(file.regime == dqw::Regime::steady);
    TEST_ASSERT_TRUE(file.voltage_previous);
    TEST_ASSERT_EQUAL_STRING("Iq_mA", file.sources[dqw::col_i_q].name.c_str());
    TEST_ASSERT_EQUAL_DOUBLE(0.001, file.sources[dqw::col_i_q].scale);
    TEST_ASSERT_EQUAL_STRING("time", file.sources[dqw::col_t].name.c_str());
    TEST_ASSERT_EQUAL_STRING("v_d_V", file.sources[dqw::col_v_d].name.c_str());
    TEST_ASSERT_EQUAL_size_t(1, file.public_sources.size());
    TEST_ASSERT_EQUAL_STRING("here, MIT.", file.public_sources[0].c_str());
    TEST_ASSERT_EQUAL_size_t(0, file.notes.size());
}

static void what_the_simulator_says_of_its_drive_is_no_note(void)
{
    for (const char* angle : {"encoder", "observer"})
        TEST_ASSERT_EQUAL_size_t(0, read(std::string("[log]\nregime = \"dynamic\"\nmodulation = \"centred\"\nangle = "
                                                     "\"") +
                                         angle + "\"\nperiod_s = 5e-05\n")
                                        .notes.size());
    TEST_ASSERT_EQUAL_DOUBLE(0.1, read("[log]\nvoltage_error_V = 0.1\n").voltage_error_V);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, read("[log]\nregime = \"steady\"\n").voltage_error_V);
    TEST_ASSERT_TRUE(read("[log]\nregime = \"polled\"\n").regime == dqw::Regime::polled);
    TEST_ASSERT_EQUAL_DOUBLE(0.002, read("[log]\nvoltage_scale = 0.002\n").voltage_scale);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, read("[log]\nvoltage_scale = 0\n").voltage_scale);
    // 2^-11 over the root of 12
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, std::ldexp(1.0, -11) / std::sqrt(12.0), read("").voltage_scale);
}

static void unknown_keys_are_one_note(void)
{
    const auto file = read("[machine]\ncolour = 1\n[extra]\nx = 1\n[log]\nwho = 1\n[columns]\nspeed = \"n\"\nt_s = { "
                           "from = \"t\", colour = \"s\" }\n");
    TEST_ASSERT_EQUAL_size_t(1, file.notes.size());
    for (const char* key : {"machine.colour", "extra", "log.who", "columns.speed", "columns.t_s.colour"})
        TEST_ASSERT_TRUE_MESSAGE(file.notes[0].find(key) != std::string::npos, key);
}

static void wrong_values_are_refused_with_their_line(void)
{
    const struct {
        const char* text;
        std::size_t line;
        const char* names;
    } bad[] = {
        {"[machine]\nR_ohm = -1\n", 2, "R_ohm"},
        {"[machine]\nR_ohm = 0\n", 2, "R_ohm"},
        {"[machine]\nLd_H = nan\n", 2, "Ld_H"},
        {"[machine]\nLq_H = inf\n", 2, "Lq_H"},
        {"[machine]\npsi_Wb = -0.1\n", 2, "psi_Wb"},
        {"[machine]\n\npole_pairs = 2.5\n", 3, "pole_pairs"},
        {"[machine]\npole_pairs = 0\n", 2, "pole_pairs"},
        {"[machine]\npole_pairs = -3\n", 2, "pole_pairs"},
        {"[machine]\npole_pairs = \"four\"\n", 2, "pole_pairs"},
        {"[machine]\nname = 3\n", 2, "name"},
        {"[machine]\nJ_kgm2 = []\n", 2, "J_kgm2"},
        {"machine = 3\n", 1, "machine"},
        {"[log]\nregime = \"fast\"\n", 2, "fast"},
        {"[log]\nregime = 3\n", 2, "regime"},
        {"[log]\nvoltage_interval = \"both\"\n", 2, "both"},
        {"[log]\nmodulation = 1\n", 2, "modulation"},
        {"[log]\nangle = \"resolver\"\n", 2, "encoder or observer"},
        {"[log]\nangle = 1\n", 2, "angle"},
        {"[log]\nvoltage_error_V = -0.1\n", 2, "voltage_error_V"},
        {"[log]\nvoltage_scale = -0.001\n", 2, "voltage_scale"},
        {"[log]\nvoltage_scale = 0.11\n", 2, "voltage_scale"},
        {"[log]\nvoltage_error_V = nan\n", 2, "voltage_error_V"},
        {"[log]\nvoltage_error_V = \"0.1\"\n", 2, "voltage_error_V"},
        {"[log]\nperiod_s = 0\n", 2, "period_s"},
        {"[log]\nperiod_s = -1e-4\n", 2, "period_s"},
        {"[log]\nperiod_s = \"short\"\n", 2, "period_s"},
        {"[columns]\nt_s = 3\n", 2, "t_s"},
        {"[columns]\nt_s = \"\"\n", 2, "t_s"},
        {"[columns]\nt_s = { from = 3 }\n", 2, "from"},
        {"[columns]\nt_s = { from = \"t\", scale = 0 }\n", 2, "scale"},
        {"[columns]\nt_s = { from = \"t\", scale = \"m\" }\n", 2, "scale"},
        {"[machine]\nR_ohm = 1\nR_ohm = 2\n", 3, "R_ohm"},
        {"[machine\n", 1, "TOML"},
        {"[machine]\n[=log]\n", 2, "TOML"},
        {"[machine]\n\n[\nlog]\n", 3, "TOML"},
        {"R_ohm = = 1\n", 1, "TOML"},
        {"\xff\xfe\x01", 1, "TOML"},
        // Letters that toml++ 3.3 takes for none that can be.
        {"\xd0\x90 = 1", 1, "TOML"},
        {"[machine]\nR_ohm = 1 \xc3\xa9\n", 2, "TOML"},
        {"\xe3\x80\x81 = 1", 1, "TOML"},
        {"\xef\xb4\x80 = 1", 1, "TOML"},
        // Errors that quote a newline.
        {"[machine]\nname = t\n", 2, "true"},
        {"[machine]\nname = f\r\n", 2, "false"},
    };
    for (const auto& b : bad) {
        try {
            read(b.text);
            TEST_FAIL_MESSAGE(b.text);
        } catch (const dqw::InputError& error) {
            TEST_ASSERT_EQUAL_size_t_MESSAGE(b.line, error.line, error.what());
            TEST_ASSERT_TRUE_MESSAGE(std::string(error.what()).find(b.names) != std::string::npos, error.what());
            TEST_ASSERT_TRUE_MESSAGE(std::string(error.what()).find('\n') == std::string::npos, error.what());
        }
    }
}

static void other_letters_stand_in_texts(void)
{
    const auto file = read("# \xd0\x90\n[machine] # \xc3\xa9\nname = \"\"\"\\\n  \xc3\xa9 \xd0\x90\"\"\"\n\"\xc3\xa9\" "
                           "= 1\n\"two\\nlines\" = 1\n");
    TEST_ASSERT_EQUAL_STRING("\xc3\xa9 \xd0\x90", file.machine.name.c_str());
    TEST_ASSERT_EQUAL_size_t(1, file.notes.size());
    TEST_ASSERT_TRUE_MESSAGE(file.notes[0].find("machine.\xc3\xa9") != std::string::npos, file.notes[0].c_str());
    TEST_ASSERT_TRUE_MESSAGE(file.notes[0].find("machine.two\\x0alines") != std::string::npos, file.notes[0].c_str());
}

static void a_friction_or_flux_of_zero_is_a_value(void)
{
    const auto file = read("[machine]\npsi_Wb = 0\nB_Nms_rad = 0.0\npole_pairs = 4.0\n");
    TEST_ASSERT_EQUAL_DOUBLE(0, *file.machine.psi_Wb);
    TEST_ASSERT_EQUAL_DOUBLE(0, *file.machine.B_Nms_rad);
    TEST_ASSERT_EQUAL_DOUBLE(4, *file.machine.pole_pairs);
}

static void the_file_beside_the_log_is_found_and_another_wins(void)
{
    const command::Folder folder;
    folder.write("a.toml", "[machine]\nname = \"beside\"\n");
    const std::string other = folder.write("b.toml", "[machine]\nname = \"chosen\"\n");
    TEST_ASSERT_EQUAL_STRING("beside", dqw::machine_file_of(folder / "a.csv", "").machine.name.c_str());
    TEST_ASSERT_EQUAL_STRING("chosen", dqw::machine_file_of(folder / "a.csv", other).machine.name.c_str());
    TEST_ASSERT_EQUAL_STRING("", dqw::machine_file_of(folder / "none.csv", "").path.c_str());
    for (const std::string& bad : {folder / "absent.toml", folder / ""}) {
        try {
            dqw::machine_file_of(folder / "a.csv", bad);
            TEST_FAIL_MESSAGE(bad.c_str());
        } catch (const dqw::InputError& error) {
            TEST_ASSERT_EQUAL_size_t(0, error.line);
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(everything_documented_is_read);
    RUN_TEST(what_the_simulator_says_of_its_drive_is_no_note);
    RUN_TEST(unknown_keys_are_one_note);
    RUN_TEST(wrong_values_are_refused_with_their_line);
    RUN_TEST(other_letters_stand_in_texts);
    RUN_TEST(a_friction_or_flux_of_zero_is_a_value);
    RUN_TEST(the_file_beside_the_log_is_found_and_another_wins);
    return UNITY_END();
}
