// The text files of an ODrive dynamometer: speed, torque and efficiency alone, or a list of named values.
#include "app/base/input_error.hpp"
#include "app/format/formats.hpp"

namespace dqw {
namespace {

void describe(Import& in)
{
    in.take(col_w_m, std::size_t{0}, "rpm");
    in.take(col_torque, std::size_t{1}, "Nm");
    in.gaps = true;
    in.voltage = "none";
    in.notes.push_back("rpm, Nm and efficiency in percent, no time and no current: nothing electrical to learn");
}

bool is_list(const Head& head)
{
    if (head.fields.empty()) return false;
    for (const auto& row : head.rows)
        if (row.size() == 2 && row[0].find("motor resistance (Ohm)") != std::string::npos) return true;
    return false;
}

void refuse(Import& in)
{
    throw InputError(in.head.path, in.head.line + 1,
                     "a list of resistances and inductances, no log; expected rows of measurements");
}

}  // namespace

/// Never found by itself: three columns of numbers may be anything.
const Format odrive_dyno = {
    "odrive_dyno", "ODrive dynamometer, data.txt", {}, [](const Head&) { return false; }, describe};
const Format odrive_dyno_list = {
    "odrive_dyno_list", "ODrive dynamometer, motor_param.csv (no log)", {}, is_list, refuse};

}  // namespace dqw
