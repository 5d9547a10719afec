// PlotJuggler's CSV export: series by their paths; an empty cell is no sample at this time.
#include "app/format/formats.hpp"
#include "app/format/vesc_state.hpp"

namespace dqw {
namespace {

bool by_slash(const Head& head)
{
    if (head.fields.empty() || head.fields[0] != "time") return false;
    for (const std::string& field : head.fields)
        if (field.find('/') != field.npos) return true;
    return false;
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
