// docs/measured.md: what the plain model makes of every measured log, and all that is known of each.
#include <fmt/format.h>

#include "app/base/columns.hpp"
#include "app/base/quantity.hpp"
#include "measured.hpp"

namespace measured {
namespace {

std::string estimate(const dqw::Result& result, const std::string& name)
{
    for (const dqw::Estimate& e : result.parameters) {
        if (e.name != name) continue;
        return dqw::with_sd(dqw::quantity(name, e.value, e.given ? 0.0 : e.sd)) + (e.given ? " (given)" : "");
    }
    return "–";
}

std::string percent(const dqw::Result& result, const std::string& axis)
{
    for (const dqw::AxisResidual& a : result.axes)
        if (a.axis == axis)
            return a.rms > 0 || a.percent > 0
                       ? fmt::format("{:.3g} {} ({:.3g} %)", a.rms, result.residual_unit, a.percent)
                       : "0";
    return "–";
}

std::string fit_row(const Entry& e)
{
    const dqw::Result& r = e.result;
    std::vector<std::string> cells = {e.name};
    if (r.regime == dqw::Regime::mechanical) {
        for (const char* name : {"J_kgm2", "B_Nms_rad", "torque_constant_Nm_A"}) cells.push_back(estimate(r, name));
        cells.push_back(percent(r, "torque"));
    } else {
        for (const char* name : {"R_ohm", "Ld_H", "Lq_H", "psi_Wb", "pole_pairs"}) cells.push_back(estimate(r, name));
        cells.push_back(fmt::format("{:.3g} {}", r.residual_rms, r.residual_unit));
        cells.push_back(percent(r, "d"));
        cells.push_back(percent(r, "q"));
    }
    cells.insert(cells.begin() + 1, {dqw::name_of(r.regime), std::to_string(r.rows)});
    return row(cells);
}

}  // namespace

std::string cell(std::string text)
{
    for (char& c : text)
        if (c == '|' || c == '\n' || c == '\r') c = '/';
    return text;
}

std::string row(const std::vector<std::string>& cells)
{
    std::string line = "|";
    for (const auto& c : cells) line += " " + cell(c) + " |";
    return line + "\n";
}

std::string document(const std::vector<Entry>& entries, const std::vector<std::string>& unread)
{
    std::string out = "<!-- make measured -->\n# Measured logs\n\n`make measured` fits every log of `DATA` by the "
                      "plain model, traces what that lacks, and "
                      "writes this page. Each estimate is\n"
                      "followed by its standard deviation; a dash stands for what the log cannot tell. A residual is "
                      "in volts (Nm) and in per cent of\n"
                      "the RMS of that axis' voltage (of the torque), over the blocks that DESIGN.md defines.\n\n## "
                      "Fitted: the plain model, all rows\n";
    for (const bool mechanical : {false, true}) {
        std::string rows;
        for (const Entry& e : entries)
            if (e.problems.empty() && (e.result.regime == dqw::Regime::mechanical) == mechanical) rows += fit_row(e);
        if (rows.empty()) continue;
        out += mechanical ? "\n### Mechanical\n\n| log | regime | rows | J | B | K_t | residual |\n| --- | --- | --: | "
                            "--: | --: | --: | --: |\n"
                          : "\n### Electrical\n\n| log | regime | rows | R | L_d | L_q | ψ | pole pairs | residual | "
                            "v_d | v_q |\n"
                            "| --- | --- | --: | --: | --: | --: | --: | --: | --: | --: | --: |\n";
        out += rows;
    }
    out += traced_tables(entries) + "\n## Each log\n";
    for (const Entry& e : entries) {
        const std::string& machine = e.logs.front().machine.name;
        out += fmt::format("\n### {}\n\n- Machine: {}\n", e.name, machine.empty() ? "not stated" : machine);
        for (const auto& source : e.sources) out += "- Source: " + source + "\n";
        out += traced_lines(e);
        for (const auto& n : e.result.not_identifiable)
            out += fmt::format("- Not identifiable: `{}`: {}{}\n", n.name, n.why,
                               n.excitation.empty() ? "" : "; what would help: " + n.excitation);
        for (const auto& note : e.result.notes) out += "- Note: " + note + "\n";
        for (const auto& problem : e.problems) out += "- **Not done**: " + problem + "\n";
    }
    if (!unread.empty()) out += "\n## Not read\n\n";
    for (const auto& line : unread) out += "- " + line + "\n";
    return out;
}

}  // namespace measured
