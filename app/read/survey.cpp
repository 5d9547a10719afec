#include "app/read/survey.hpp"

#include <algorithm>

#include "app/base/text.hpp"

namespace dqw {

std::vector<Survey::Column> surveyed_columns(const Import& import, const Log& log, const ColumnSet& has)
{
    std::vector<Survey::Column> all;
    for (const ColumnInfo& info : columns) {
        const auto& source = import.columns[info.id];
        if (!source) continue;
        const Expression& x = source->expression;
        Survey::Column column;
        column.name = info.name, column.rule = x.text, column.unit = source->unit, column.needs = source->needs;
        for (const std::size_t f : x.fields) {
            const std::string name = printable(import.head.fields[f]);
            if (std::find(column.from.begin(), column.from.end(), name) == column.from.end())
                column.from.push_back(name);
        }
        if (x.linear() && x.offset == 0.0 && column.from.size() == 1) column.factor = x.scale;
        const auto& values = log.*(info.values);
        column.kept = has[info.id] && !values.empty();
        if (column.kept) {
            const auto [least, largest] = std::minmax_element(values.begin(), values.end());
            column.first = values.front(), column.least = *least, column.largest = *largest;
        }
        all.push_back(std::move(column));
    }
    return all;
}

std::string how_to_give(const std::string& need)
{
    if (need == "pole pairs") return "pole pairs: --pole-pairs N, or pole_pairs under [machine]";
    if (need == "gear") return "gear, turns of the rotor for one of the output: --gear N, or gear under [machine]";
    if (need == "v_dc") return "voltage of the DC link: --v-dc V, or v_dc_V under [machine]";
    if (need == "period") return "seconds from row to row: --period S, or period_s under [log]";
    if (need == "line or phase")
        return "what RMS volts are of: v_q_V = { from = \"…\", unit = \"V RMS line\" } under [columns], or \"V RMS\" "
               "of a "
               "phase";
    return need;
}

void count_left_out(std::vector<LeftOut>& all, const std::string& why, std::size_t line)
{
    for (LeftOut& reason : all)
        if (reason.why == why) {
            ++reason.rows;
            return;
        }
    all.push_back({why, 1, line});
}

}  // namespace dqw
