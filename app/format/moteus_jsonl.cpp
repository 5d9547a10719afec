// moteus tview's JSONL: channels interleaved, currents and voltages in different ones, joined by the nearest stamp.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "app/base/input_error.hpp"
#include "app/base/text.hpp"
#include "app/format/formats.hpp"
#include "app/format/json.hpp"

namespace dqw {
namespace {

struct Sample {
    double t_s;
    nlohmann::json data;
    std::size_t line;
};

std::string cell(const nlohmann::json& data, const char* name)
{
    const auto found = data.find(name);
    return found == data.end() ? "" : json_cell(*found);
}

bool to_csv(const std::string& path, const std::string& text, CsvText& csv)
{
    const JsonLine first = first_object(text);
    if (!first.object.is_object() || !first.object.contains("channel") || !first.object.contains("data")) return false;
    std::vector<Sample> stats, control;
    std::string controller;
    std::size_t cut = 0;
    each_line(text, [&](const std::string& line, std::size_t number, bool ended) {
        nlohmann::json object = nlohmann::json::parse(line, nullptr, false);
        if (object.is_discarded() && !ended) {
            cut = number;
            return;
        }
        if (!object.is_object() || !object.contains("channel") || !object["channel"].is_string() ||
            !object.contains("timestamp") || !object["timestamp"].is_number() || !object.contains("data") ||
            !object["data"].is_object())
            throw InputError(path, number, shown(line) + " is no entry of tview; expected channel, timestamp, data");
        const std::string from = object.contains("controller") ? object["controller"].dump() : "";
        const std::string channel = object["channel"].get<std::string>();
        if (channel != "servo_stats" && channel != "servo_control") return;
        if (controller.empty()) controller = from;
        if (from != controller)
            throw InputError(
                path, number,
                fmt::format("controller {} beside {}; expected one, in a file of its own", from, controller));
        (channel == "servo_stats" ? stats : control)
            .push_back({object["timestamp"].get<double>(), std::move(object["data"]), number});
    });
    std::vector<const char*> names;
    for (const char* name : {"mode", "d_A", "q_A", "velocity", "bus_V", "filt_bus_V", "motor_temp_C", "torque_Nm"})
        if (!stats.empty() && stats.front().data.contains(name)) names.push_back(name);
    std::string header = "timestamp";
    for (const char* name : names) header += std::string(",") + name;
    csv.add(header + ",control.d_V,control.q_V", first.number);
    std::size_t near = 0;
    for (const Sample& s : stats) {
        std::string row = fmt::format("{:.9f}", s.t_s);
        for (const char* name : names) row += "," + cell(s.data, name);
        while (near + 1 < control.size() &&
               std::fabs(control[near + 1].t_s - s.t_s) <= std::fabs(control[near].t_s - s.t_s))
            ++near;
        row += control.empty() ? ",," : "," + cell(control[near].data, "d_V") + "," + cell(control[near].data, "q_V");
        csv.add(row, s.line);
    }
    if (cut > 0) csv.add(kCutRow, cut);
    return true;
}

void describe(Import& in)
{
    moteus_stats.describe(in);
    in.settled_only = in.known(col_v_d);
}

}  // namespace

/// Its rows are those of servo_stats with the voltages beside them.
const Format moteus_jsonl = {
    "moteus_jsonl", "moteus tview, JSONL", {"timestamp", "control.d_V"}, [](const Head&) { return false; }, describe,
    to_csv};

}  // namespace dqw
