// Apps of one-wheeled boards: Float Control's CSV and Floaty's JSON.
#include <nlohmann/json.hpp>

#include "app/base/input_error.hpp"
#include "app/format/formats.hpp"
#include "app/format/json.hpp"

namespace dqw {
namespace {

void describe_control(Import& in)
{
    in.take(col_t, "Time(s)", "s");
    in.take(col_w_m, "ERPM", "erpm");
    in.take(col_i_q, "I-Motor", "A");
    in.take(col_v_dc, "Voltage", "V");
    in.take(col_temp_winding, "T-Mot", "C");
    in.drop("Motor-Fault", is_not_zero, "Motor-Fault is not 0");
    in.host_clock = true;
    in.regime = Regime::mechanical;
    in.voltage = "none: duty in whole percent is too coarse for one";
    in.notes.push_back("i_q_A is I-Motor, which is i_q where no field is weakened");
}

bool floaty_to_csv(const std::string& path, const std::string& text, CsvText& csv)
{
    const nlohmann::json root = nlohmann::json::parse(text, nullptr, false);
    if (!root.is_object() || !root.contains("logs") || !root["logs"].is_array()) return false;
    const char* const names[] = {"timestamp", "dutyCycle", "batteryVolts",  "motorCurrent",
                                 "motorTemp", "speed",     "controllerTemp"};
    std::string header;
    for (const char* name : names) header += (header.empty() ? "" : ",") + std::string(name);
    csv.add(header, 1);
    for (const auto& entry : root["logs"]) {
        if (!entry.is_object()) throw InputError(path, 1, "an entry of \"logs\" is no object; expected one a row");
        std::string row;
        for (const char* name : names) {
            const auto found = entry.find(name);
            row += (found == entry.end() ? std::string() : json_cell(*found)) + ",";
        }
        row.pop_back();
        csv.add(row, 1);
    }
    return true;
}

void describe_floaty(Import& in)
{
    in.take(col_t, "timestamp", "ms");
    in.take(col_i_q, "motorCurrent", "A");
    in.take(col_v_dc, "batteryVolts", "V");
    in.take(col_temp_winding, "motorTemp", "C");
    in.host_clock = true;
    in.regime = Regime::mechanical;
    in.voltage = "none";
    in.notes.push_back("no motor's speed in the file: the board's is none without the wheel's size");
}

}  // namespace

const Format float_control = {"float_control",
                              "Float Control CSV",
                              {"Time(s)", "State", "ERPM", "I-Motor", "Voltage"},
                              nullptr,
                              describe_control};
const Format floaty = {"floaty", "Floaty JSON",   {"timestamp", "dutyCycle", "batteryVolts", "motorCurrent"},
                       nullptr,  describe_floaty, floaty_to_csv};

}  // namespace dqw
