#include "app/read/unit_warnings.hpp"

#include <fmt/format.h>

#include "app/base/text.hpp"
#include "app/read/column_doubts.hpp"
#include "app/read/speed_unit.hpp"

namespace dqw {
namespace {

std::string source_name(const Import& import, Column c)
{
    const auto& fields = import.columns[c]->expression.fields;
    return shown(fields.empty() ? columns[c].name : import.head.fields[fields[0]], 200);
}

/// With what the machine file says already.
std::string corrected(const std::string& correction, const ColumnSource& source)
{
    const std::string scale = "scale = ";
    if (source.scale == 1.0) return correction;
    if (correction.compare(0, scale.size(), scale) != 0)
        return fmt::format("{}{:g}, {}", scale, source.scale, correction);
    return fmt::format("{}{:.5g}", scale, source.scale * std::stod(correction.substr(scale.size())));
}

std::string warning_of(const Doubt& doubt, const Import& import, const MachineFile& machine)
{
    std::vector<std::string> names, lines;
    for (const Column c : doubt.columns) {
        names.emplace_back(columns[c].name);
        lines.push_back(fmt::format("{} = {{ from = {}, {} }}", columns[c].name, source_name(import, c),
                                    corrected(doubt.correction, machine.sources[c])));
    }
    const std::string of = fmt::format("warning: {}: {}: ", import.head.path, list(names));
    if (doubt.correction.empty() && doubt.columns.front() == col_theta_e)
        return of + fmt::format("it is {}: {}; correct --pole-pairs, or pole_pairs under [machine]", doubt.looks_like,
                                doubt.evidence);
    if (doubt.correction.empty())
        return of + fmt::format("it reads with {}: {}; put scale = -1, or the other axis' name, under [columns] of the "
                                "machine file",
                                doubt.looks_like, doubt.evidence);
    return of + fmt::format("the numbers look like {}: {}; if so, put {} under [columns] of the machine file",
                            doubt.looks_like, doubt.evidence, list(lines));
}

}  // namespace

std::vector<std::string> unit_warnings(const SpeedProbe& probe, const Import& import, const MachineFile& machine)
{
    std::vector<std::string> warnings;
    bool of_speed = false;
    for (const Doubt& doubt : column_doubts(probe, machine.machine)) {
        of_speed = of_speed || doubt.of_time_or_speed();
        warnings.push_back(warning_of(doubt, import, machine));
    }
    if (of_speed) return warnings;
    if (const auto evidence = evidence_of_rpm(probe, machine.machine))
        warnings.push_back(fmt::format(
            "warning: {}: w_m_rad_s: the numbers look like rpm, not rad/s: {}; if so, put w_m_rad_s = {{ "
            "from = {}, scale = {:.6f} }} under [columns] of the machine file",
            import.head.path, *evidence, source_name(import, col_w_m), 0.1047197551 * machine.sources[col_w_m].scale));
    return warnings;
}

}  // namespace dqw
