// `dqwatch columns` and `dqwatch formats`: snapshots of vendors' samples, JSON, and what --write makes of a log.
// SNAPSHOTS=1 in the environment writes them anew.
#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

#include "command.hpp"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

namespace fs = std::filesystem;
using command::Outcome;

static const char* const snapshots = "tests/app/cmd/columns.txt";

static fs::path folder() { return fs::path(command::environment("DATA", "../shared/data")) / "vendor"; }

static std::vector<fs::path> samples()
{
    std::vector<fs::path> found;
    std::error_code error;
    for (const auto& file : fs::directory_iterator(folder(), error))
        if (file.path().extension() != ".md") found.push_back(file.path());
    std::sort(found.begin(), found.end());
    return found;
}

/// The samples' folder taken off, and long lists of unused fields cut.
static std::string shortened(std::string text)
{
    const std::string from = folder().string() + "/";
    for (auto at = text.find(from); at != text.npos; at = text.find(from)) text.erase(at, from.size());
    std::string out;
    for (std::size_t begin = 0; begin < text.size();) {
        const std::size_t end = std::min(text.find('\n', begin), text.size());
        std::string line = text.substr(begin, end - begin);
        if (line.size() > 200) line = line.substr(0, 200) + " …";
        out += line + "\n";
        begin = end + 1;
    }
    return out;
}

static void each_sample_is_told_as_its_snapshot(void)
{
    if (samples().empty()) TEST_IGNORE_MESSAGE("no vendors' logs: set DATA");
    std::string all;
    for (const fs::path& sample : samples()) {
        const Outcome run = command::dqwatch({"columns", sample.string(), "--pole-pairs", "7"});
        all += shortened(run.err + run.out) + "exit code " + std::to_string(run.code) + "\n\n";
    }
    if (command::environment("SNAPSHOTS", "") == "1") std::ofstream(snapshots, std::ios::binary) << all;
    const std::string expected = command::read_file(snapshots);
    std::size_t at = 0, line = 1;
    while (at < std::min(all.size(), expected.size()) && all[at] == expected[at]) line += all[at++] == '\n';
    const std::string differs = std::string(snapshots) + ":" + std::to_string(line) + ": \"" +
                                all.substr(at, std::min(all.find('\n', at), all.size()) - at) + "\"";
    TEST_ASSERT_TRUE_MESSAGE(all == expected, differs.c_str());
}

static void the_json_has_what_the_text_has(void)
{
    const command::Folder here;
    const std::string log = here.write(
        "x.csv", "timestamp,d_A,mode,motor_temp_C,q_A,velocity\n1,0,0,1,1,1\n2,0,10,1,1,1\n3,0,10,1,1,1\n");
    const Outcome run = command::dqwatch({"columns", log, "--json"});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
    const auto json = nlohmann::json::parse(run.out);
    TEST_ASSERT_EQUAL_STRING("dqwatch.columns/1", json.at("schema").get<std::string>().c_str());
    TEST_ASSERT_EQUAL_STRING("moteus_stats", json.at("format").get<std::string>().c_str());
    TEST_ASSERT_EQUAL_INT(3, json.at("rows").get<int>());
    TEST_ASSERT_EQUAL_INT(2, json.at("rows_kept").get<int>());
    TEST_ASSERT_EQUAL_INT(2, json.at("dropped")[0].at("first_line").get<int>());
    TEST_ASSERT_TRUE(json.at("regime").is_null());
    TEST_ASSERT_TRUE(!json.at("missing").empty() && json.at("warnings").empty());
    for (const auto& column : json.at("columns"))
        if (column.at("name") == "w_m_rad_s") {
            TEST_ASSERT_EQUAL_STRING("turns/s output", column.at("unit").get<std::string>().c_str());
            TEST_ASSERT_EQUAL_STRING("gear", column.at("needs")[0].get<std::string>().c_str());
        } else if (column.at("name") == "i_q_A") {
            TEST_ASSERT_EQUAL_DOUBLE(1, column.at("factor").get<double>());
            TEST_ASSERT_EQUAL_STRING("q_A", column.at("from")[0].get<std::string>().c_str());
        }
    const auto formats = nlohmann::json::parse(command::dqwatch({"formats", "--json"}).out).at("formats");
    TEST_ASSERT_EQUAL_STRING("dqwatch", formats.back().at("name").get<std::string>().c_str());
    const Outcome text = command::dqwatch({"formats"});
    for (const auto& format : formats)
        TEST_ASSERT_TRUE(text.out.find(format.at("about").get<std::string>()) != text.out.npos);
}

/// A log in another program's columns, and the canonical one made of it, are fitted alike.
static void what_is_written_is_the_same_log(void)
{
    const command::Folder here;
    command::Machine machine;
    command::Style style;
    style.separator = ';', style.speed_factor = machine.p * 30 / 3.14159265358979323846;
    command::write_log(here / "x.csv", 400, machine, style);
    here.write("x.toml",
               "[machine]\npole_pairs = 4\nR_ohm = 0.4\n[log]\nmodulation = \"centred\"\n[columns]\nw_m_rad_s = { "
               "from = \"w_m_rad_s\", unit = \"erpm\" }\n");
    const std::string out = here / "out";
    const Outcome run = command::dqwatch({"columns", here / "x.csv", "--write", "--out", out});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
    const auto fitted = [&](const std::string& log) {
        const Outcome fit = command::dqwatch({"fit", log, "--json"});
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, fit.code, fit.err.c_str());
        return nlohmann::json::parse(fit.out).at("parameters");
    };
    const auto before = fitted(here / "x.csv"), after = fitted(out + "/x_canonical.csv");
    for (const char* name : {"R_ohm", "Ld_H", "Lq_H", "psi_Wb"})
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-9 * before.at(name).at("value").get<double>(),
                                          before.at(name).at("value").get<double>(),
                                          after.at(name).at("value").get<double>(), name);
    TEST_ASSERT_DOUBLE_WITHIN(0.02 * machine.psi_Wb, machine.psi_Wb, after.at("psi_Wb").at("value").get<double>());
}

/// What is proposed of a header, one column a line, its unit behind it and `?` where the header says none.
static std::string proposed(const std::string& header)
{
    const command::Folder here;
    std::string rows = header + "\n";
    const auto fields = static_cast<std::size_t>(std::count(header.begin(), header.end(), ',')) + 1;
    for (int k = 1; k <= 3; ++k) {
        for (std::size_t f = 0; f < fields; ++f) rows += (f ? "," : "") + std::to_string(k);
        rows += "\n";
    }
    const Outcome run = command::dqwatch({"columns", here.write("x.csv", rows), "--json"});
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run.code, run.err.c_str());
    const auto json = nlohmann::json::parse(run.out);
    std::string out;
    if (!json.contains("proposed")) return out;
    for (const auto& p : json.at("proposed"))
        out += p.at("name").get<std::string>() + " = " + p.at("toml").get<std::string>() +
               (p.at("unit_guessed").get<bool>() ? " ?" : "") +
               (p.contains("needs") ? " needs " + p.at("needs").get<std::string>() : "") + "\n";
    return out;
}

static void a_header_of_common_names_is_proposed_for(void)
{
    TEST_ASSERT_EQUAL_STRING("t_s = { from = \"Time [s]\", unit = \"s\" }\n"
                             "v_d_V = { from = \"Ud (mV)\", unit = \"mV\" }\n"
                             "v_q_V = { from = \"Uq\", unit = \"V\" } ?\n"
                             "i_d_A = { from = \"i_d_meas\", unit = \"A\" } ?\n"
                             "i_q_A = { from = \"iq_A\", unit = \"A\" }\n"
                             "w_m_rad_s = { from = \"Speed [RPM]\", unit = \"rpm\" }\n"
                             "theta_e_rad = { from = \"elec_deg\", unit = \"deg\" }\n",
                             proposed("Time [s],Ud (mV),Uq,i_d_meas,i_d_ref,iq_A,Speed [RPM],elec_deg").c_str());
    TEST_ASSERT_EQUAL_STRING("w_m_rad_s = { from = \"omega_e\", unit = \"electrical rad/s\" }\n"
                             "theta_e_rad = { from = \"theta\", unit = \"rad\" } ?\n"
                             "i_dq_A = { from = [\"ia\", \"ib\", \"ic\"], unit = \"A\" } ?\n"
                             "v_dq_V = { from = [\"v_alpha\", \"v_beta\"], kind = \"alpha_beta\", unit = \"V\" } ?\n",
                             proposed("t_s,omega_e,theta,ia,ib,ic,v_alpha,v_beta").c_str());
    TEST_ASSERT_EQUAL_STRING("t_s = { from = \"time\", unit = \"s\" } ?\n"
                             "w_m_rad_s = { from = \"speed [rad/s]\", unit = \"rad/s\" }\n"
                             "i_dq_A = { from = [\"ia\", \"ib\"], unit = \"A\" } ? needs theta_e_rad\n",
                             proposed("time,Id,ia,ib,speed [rad/s],load/s").c_str());
    TEST_ASSERT_EQUAL_STRING("", proposed("identity,wheel,temperament,a\\nb").c_str());
    // A unit that is not known is told as such, and one of a speed is of the speed that its name says.
    TEST_ASSERT_EQUAL_STRING("i_d_A = { from = \"Id [kA]\", unit = \"A\" } ?\n"
                             "w_m_rad_s = { from = \"ERPM [rpm]\", unit = \"erpm\" }\n",
                             proposed("t_s,Id [kA],ERPM [rpm]").c_str());
    TEST_ASSERT_EQUAL_STRING("w_m_rad_s = { from = \"omega_e_rad_s\", unit = \"electrical rad/s\" }\n"
                             "theta_e_rad = { from = \"theta [°]\", unit = \"deg\" }\n",
                             proposed("t_s,omega_e_rad_s,theta [°]").c_str());
    TEST_ASSERT_EQUAL_STRING("w_m_rad_s = { from = \"Speed [1/min]\", unit = \"rpm\" }\n",
                             proposed("t_s,Speed [1/min]").c_str());
    TEST_ASSERT_EQUAL_STRING("w_m_rad_s = { from = \"we [r/min]\", unit = \"erpm\" }\n",
                             proposed("t_s,we [r/min]").c_str());
    // The log format's own names without their units, and a unit a thousand million times as large.
    TEST_ASSERT_EQUAL_STRING("t_s = { from = \"t\", unit = \"s\" } ?\n"
                             "v_d_V = { from = \"u_d\", unit = \"V\" } ?\n"
                             "v_q_V = { from = \"u_q [MV]\", unit = \"V\" } ?\n"
                             "i_d_A = { from = \"i_d\", unit = \"A\" } ?\n"
                             "i_q_A = { from = \"i_q\", unit = \"A\" } ?\n"
                             "w_m_rad_s = { from = \"w_m\", unit = \"rad/s\" } ?\n",
                             proposed("t,u_d,u_q [MV],i_d,i_q,w_m").c_str());
    // One byte a character, as Latin-1 has it.
    TEST_ASSERT_EQUAL_STRING("t_s = { from = \"Time [µs]\", unit = \"µs\" }\n"
                             "theta_e_rad = { from = \"theta [°]\", unit = \"deg\" }\n",
                             proposed("Time [\xb5s],theta [\xb0]").c_str());
    // What TOML cannot name, or the reader would find twice, is none; nor are phases of several units.
    TEST_ASSERT_EQUAL_STRING("i_q_A = { from = \"iq\", unit = \"A\" } ?\n", proposed("Time [\x01s],id,iq,id").c_str());
    TEST_ASSERT_EQUAL_STRING("", proposed("t_s,ia [mA],ib [A]").c_str());
    TEST_ASSERT_EQUAL_STRING("", proposed("t_s,v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s,theta").c_str());
}

/// In the machine file it reads the log as one of its own columns is read.
static void what_is_proposed_reads_the_log(void)
{
    const command::Folder here;
    command::Machine machine;
    command::write_log(here / "x.csv", 400, machine, {});
    std::string log = command::read_file(here / "x.csv");
    const std::string common = "time,ud,uq,id,iq,omega", header = log.substr(0, log.find('\n'));
    TEST_ASSERT_EQUAL_STRING("t_s,v_d_V,v_q_V,i_d_A,i_q_A,w_m_rad_s", header.substr(0, 37).c_str());
    here.write("y.csv", common + log.substr(37));
    const Outcome refused = command::dqwatch({"fit", here / "y.csv"});
    TEST_ASSERT_EQUAL_INT(3, refused.code);
    TEST_ASSERT_TRUE_MESSAGE(refused.err.find("dqwatch columns proposes which they are") != refused.err.npos,
                             refused.err.c_str());
    const std::string told = command::dqwatch({"columns", here / "y.csv"}).out;
    const std::size_t at = told.find("[columns]\n");
    TEST_ASSERT_TRUE_MESSAGE(at != told.npos, told.c_str());
    here.write("y.toml", told.substr(at));
    const auto fitted = [&](const char* name) {
        const Outcome fit = command::dqwatch({"fit", here / name, "--pole-pairs", "4", "--json"});
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, fit.code, fit.err.c_str());
        return nlohmann::json::parse(fit.out).at("parameters").at("Ld_H").at("value").get<double>();
    };
    TEST_ASSERT_EQUAL_DOUBLE(fitted("x.csv"), fitted("y.csv"));
}

/// What `columns` says is what the other subcommands read.
static void every_subcommand_takes_a_vendors_file(void)
{
    const char* const name_of_log = "tmotor_eff_1667828286.70403.csv";
    // Nothing may live that a test which is skipped does not free.
    if (!fs::exists(folder() / name_of_log)) TEST_IGNORE_MESSAGE("no vendors' logs: set DATA");
    const fs::path log = folder() / name_of_log;
    const command::Folder here;
    for (const char* name : {"fit", "learn", "compare", "trace"}) {
        const Outcome run = command::dqwatch({name, log.string(), "--pole-pairs", "21", "--out", here / "out"});
        TEST_ASSERT_TRUE_MESSAGE(run.code == 0 || run.code == 4, (std::string(name) + run.err).c_str());
        TEST_ASSERT_TRUE_MESSAGE((run.out + run.err).find("tmotor_efficiency") != run.out.npos, name);
        const Outcome asks = command::dqwatch({name, log.string()});
        TEST_ASSERT_EQUAL_INT(3, asks.code);
        TEST_ASSERT_TRUE_MESSAGE(asks.err.find("--pole-pairs N") != asks.err.npos, asks.err.c_str());
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(each_sample_is_told_as_its_snapshot);
    RUN_TEST(the_json_has_what_the_text_has);
    RUN_TEST(what_is_written_is_the_same_log);
    RUN_TEST(a_header_of_common_names_is_proposed_for);
    RUN_TEST(what_is_proposed_reads_the_log);
    RUN_TEST(every_subcommand_takes_a_vendors_file);
    return UNITY_END();
}
