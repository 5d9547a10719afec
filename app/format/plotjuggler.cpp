// PlotJuggler's CSV export: series by their paths; an empty cell is no sample at this time.
#include <algorithm>
#include <string>

#include "app/base/text.hpp"
#include "app/format/formats.hpp"
#include "app/format/vesc_state.hpp"

namespace dqw {
namespace {

/// A slash that is none of a unit: rad/s, [1/min].
bool is_path(const std::string& field)
{
    const std::string name = field.substr(0, field.find_first_of("[("));
    const std::size_t slash = name.find('/');
    const std::string behind = slash == name.npos ? "" : std::string(trimmed(name.substr(slash + 1)));
    return slash != name.npos && behind != "s" && behind != "min";
}

bool by_slash(const Head& head)
{
    return !head.fields.empty() && head.fields[0] == "time" &&
           std::any_of(head.fields.begin(), head.fields.end(), is_path);
}

void describe(Import& in)
{
    in.host_clock = true;
    in.voltage = "as its topic has it";
    if (in.head.find_ending("duty_cycle") != Head::none && in.head.find_ending("current_motor") != Head::none) {
        vesc_state(in);
    } else {
        for (const ColumnInfo& column : columns)
            in.take(column.id, in.head.find_ending(column.name), unit_names(column.id).front());
    }
    in.take(col_t, "time", "s");
}

}  // namespace

const Format plotjuggler = {
    "plotjuggler", "PlotJuggler CSV export (VescState, dqwatch's names)", {"time"}, by_slash, describe};

}  // namespace dqw
