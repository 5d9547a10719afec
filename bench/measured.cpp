// Fits every measured log of a folder, alone and together with the others of its machine, and writes the result as Markdown:
//     measured DATA docs/measured.md
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>

#include "columns.hpp"
#include "fit.hpp"
#include "log_reader.hpp"
#include "machine_file.hpp"
#include "output.hpp"
#include "quantity.hpp"
#include "text.hpp"

namespace fs = std::filesystem;

namespace {

struct Entry {
    std::string name;  ///< file name, or "the 3 logs together"
    std::vector<dqw::Log> logs;
    dqw::Result result;
    std::vector<std::string> sources, problems;
};

/// Cells of a Markdown table may hold no bar and no line end.
std::string cell(std::string text)
{
    for (char& c : text)
        if (c == '|' || c == '\n' || c == '\r') c = '/';
    return text;
}

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
        if (a.axis == axis) return a.rms > 0 || a.percent > 0 ? fmt::format("{:.3g} {} ({:.3g} %)", a.rms, result.residual_unit, a.percent) : "0";
    return "–";
}

std::string row(const Entry& e)
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
    std::string line = "|";
    for (const auto& c : cells) line += " " + cell(c) + " |";
    return line + "\n";
}

bool is_map(const std::string& path)
{
    std::string header;
    std::getline(std::ifstream(path), header);
    return header.find("psi_d_Wb") != header.npos;
}

/// Paths of this machine have no place in a document.
std::string without(const std::string& dir, std::string text)
{
    for (std::size_t at; (at = text.find(dir)) != text.npos;) text.erase(at, dir.size());
    return text;
}

void fit_into(Entry& entry, const std::string& dir)
{
    try {
        entry.result = dqw::fit(entry.logs);
    } catch (const std::exception& error) {
        entry.problems.push_back(without(dir, error.what()));
    }
}

std::string document(const std::vector<Entry>& entries, const std::vector<std::string>& unread)
{
    std::string out = "<!-- make measured -->\n# Measured logs\n\n`make measured` fits every log of `DATA` by the plain model and writes this page. Each "
                      "estimate is followed by its\n"
                      "standard deviation; a dash stands for what the log cannot tell. A residual is in volts (Nm) and in per cent of the RMS of\n"
                      "that axis' voltage (of the torque), over the blocks that DESIGN.md defines.\n";
    for (const bool mechanical : {false, true}) {
        std::string rows;
        for (const Entry& e : entries)
            if (e.problems.empty() && (e.result.regime == dqw::Regime::mechanical) == mechanical) rows += row(e);
        if (rows.empty()) continue;
        out += mechanical ? "\n## Mechanical\n\n| log | regime | rows | J | B | K_t | residual |\n| --- | --- | --: | --: | --: | --: | --: |\n"
                          : "\n## Electrical\n\n| log | regime | rows | R | L_d | L_q | ψ | pole pairs | residual | v_d | v_q |\n"
                            "| --- | --- | --: | --: | --: | --: | --: | --: | --: | --: | --: |\n";
        out += rows;
    }
    out += "\n## Machines, sources and notes\n";
    for (const Entry& e : entries) {
        const std::string& machine = e.logs.front().machine.name;
        out += fmt::format("\n### {}\n\n- Machine: {}\n", e.name, machine.empty() ? "not stated" : machine);
        for (const auto& source : e.sources) out += "- Source: " + source + "\n";
        for (const auto& n : e.result.not_identifiable)
            out += fmt::format("- Not identifiable: `{}`: {}{}\n", n.name, n.why, n.excitation.empty() ? "" : "; what would help: " + n.excitation);
        for (const auto& note : e.result.notes) out += "- Note: " + note + "\n";
        for (const auto& problem : e.problems) out += "- **Not fitted**: " + problem + "\n";
    }
    if (!unread.empty()) out += "\n## Not read\n\n";
    for (const auto& line : unread) out += "- " + line + "\n";
    return out;
}

int run(const std::string& data, const std::string& out)
{
    std::vector<std::string> paths;
    std::error_code error;
    for (const auto& file : fs::directory_iterator(data, error))
        if (file.path().extension() == ".csv" && !is_map(file.path().string())) paths.push_back(file.path().string());
    if (paths.empty()) {
        fmt::print("measured: no logs in DATA={}; {} stays as it is. Set DATA to a folder of logs (*.csv, and *.toml beside them).\n", data, out);
        return 0;
    }
    std::sort(paths.begin(), paths.end());
    const std::string dir = (fs::path(data) / "").string();

    std::vector<Entry> entries;
    std::vector<std::string> unread;
    std::map<std::string, std::vector<std::size_t>> machines;
    for (const auto& path : paths) {
        Entry entry;
        entry.name = fs::path(path).stem().string();
        std::vector<std::string> notes;
        dqw::ReadOptions read;
        read.plain_only = true;
        read.notes = &notes;
        try {
            entry.logs.push_back(dqw::read_log(path, read));
            entry.sources = dqw::machine_file_of(path, "").public_sources;
        } catch (const dqw::InputError& problem) {
            dqw::complain(problem.what());
            unread.push_back(without(dir, problem.what()));
            continue;
        }
        fit_into(entry, dir);
        for (auto& note : notes) note = without(dir, note);
        entry.result.notes.insert(entry.result.notes.begin(), notes.begin(), notes.end());
        const dqw::Log& log = entry.logs.front();
        if (!log.machine.name.empty()) machines[log.machine.name + "/" + dqw::name_of(log.regime)].push_back(entries.size());
        fmt::print("{}: {}, {}\n", entry.name, dqw::name_of(log.regime), dqw::counted(log.rows(), "row"));
        entries.push_back(std::move(entry));
    }
    for (const auto& [key, members] : machines) {
        if (members.size() < 2) continue;
        Entry joint;
        joint.name = fmt::format("all {} of {}", members.size(), entries[members.front()].logs.front().machine.name);
        for (const std::size_t m : members) joint.logs.push_back(entries[m].logs.front());
        fit_into(joint, dir);
        fmt::print("{}\n", joint.name);
        entries.push_back(std::move(joint));
    }
    if (entries.empty()) return 1;
    bool fine = unread.empty();
    for (const Entry& e : entries) {
        for (const auto& problem : e.problems) dqw::complain(e.name + ": " + problem);
        fine = fine && e.problems.empty();
    }
    dqw::OutputFile file(out);
    file.write(document(entries, unread));
    file.close();
    fmt::print("wrote {}\n", out);
    return fine ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv)
{
    if (argc != 3) {
        std::fputs("usage: measured DATA OUT.md\n", stderr);
        return 2;
    }
    try {
        return run(argv[1], argv[2]);
    } catch (const std::exception& error) {
        dqw::complain(std::string("measured: ") + error.what());
        return 1;
    }
}
