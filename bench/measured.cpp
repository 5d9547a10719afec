// Fits and traces every measured log of a folder, alone and together with the others of its machine, and writes the
// result as Markdown:
//     measured DATA docs/measured.md REPORTS
// REPORTS gets the report of each entry that has a picture.
#include "measured.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "app/base/columns.hpp"
#include "app/base/output.hpp"
#include "app/base/text.hpp"
#include "app/read/log_reader.hpp"
#include "app/read/machine_file.hpp"
#include "app/trace/page.hpp"
#include "ref/fit/fit.hpp"

namespace fs = std::filesystem;

namespace {

using measured::Entry;

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

void examine(Entry& entry, const std::string& dir)
{
    try {
        entry.result = dqw::fit(entry.logs);
        entry.report = measured::traced(entry.logs);
    } catch (const std::exception& error) {
        entry.problems.push_back(without(dir, error.what()));
    }
}

/// Letters, digits and what joins them.
std::string file_name(const std::string& name)
{
    std::string out;
    for (const char c : name)
        if (std::isalnum(static_cast<unsigned char>(c)))
            out += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
        else if (!out.empty() && out.back() != '_')
            out += '_';
    return out.substr(0, 48);
}

/// A picture of each machine's first log, and of all its logs together.
void write_reports(std::vector<Entry>& entries, const std::string& folder)
{
    std::error_code ignored;
    fs::remove_all(folder, ignored);
    dqw::make_directory(folder);
    std::set<std::string> seen;
    for (Entry& e : entries) {
        const dqw::Log& log = e.logs.front();
        if (!e.report || (e.logs.size() == 1 && !log.machine.name.empty() && !seen.insert(log.machine.name).second))
            continue;
        e.picture = file_name(e.name) + ".png";
        dqw::OutputFile file(dqw::path_in(folder, file_name(e.name) + ".html"));
        file.write(dqw::report_page(*e.report));
        file.close();
    }
}

int run(const std::string& data, const std::string& out, const std::string& reports)
{
    std::vector<std::string> paths;
    std::error_code error;
    for (const auto& file : fs::directory_iterator(data, error))
        if (file.path().extension() == ".csv" && !is_map(file.path().string())) paths.push_back(file.path().string());
    if (paths.empty()) {
        dqw::complain(fmt::format("measured: no logs in DATA={}; {} stays as it is. Set DATA to a folder of logs "
                                  "(*.csv, and *.toml beside them).",
                                  data, out));
        return 1;
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
        read.notes = &notes;
        try {
            entry.logs.push_back(dqw::read_log(path, read));
            entry.sources = dqw::machine_file_of(path, "").public_sources;
        } catch (const dqw::InputError& problem) {
            dqw::complain(problem.what());
            unread.push_back(without(dir, problem.what()));
            continue;
        }
        examine(entry, dir);
        for (auto& note : notes) note = without(dir, note);
        entry.result.notes.insert(entry.result.notes.begin(), notes.begin(), notes.end());
        const dqw::Log& log = entry.logs.front();
        if (!log.machine.name.empty())
            machines[log.machine.name + "/" + dqw::name_of(log.regime)].push_back(entries.size());
        fmt::print("{}: {}, {}\n", entry.name, dqw::name_of(log.regime), dqw::counted(log.rows(), "row"));
        entries.push_back(std::move(entry));
    }
    for (const auto& [key, members] : machines) {
        if (members.size() < 2) continue;
        Entry joint;
        joint.name = fmt::format("all {} of {}", members.size(), entries[members.front()].logs.front().machine.name);
        for (const std::size_t m : members) joint.logs.push_back(entries[m].logs.front());
        examine(joint, dir);
        fmt::print("{}\n", joint.name);
        entries.push_back(std::move(joint));
    }
    if (entries.empty()) return 1;
    bool fine = unread.empty();
    for (const Entry& e : entries) {
        for (const auto& problem : e.problems) dqw::complain(e.name + ": " + problem);
        fine = fine && e.problems.empty();
    }
    write_reports(entries, reports);
    dqw::OutputFile file(out);
    file.write(measured::document(entries, unread));
    file.close();
    fmt::print("wrote {}\n", out);
    return fine ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv)
{
    if (argc != 4) {
        std::fputs("usage: measured DATA OUT.md REPORTS\n", stderr);
        return 2;
    }
    try {
        return run(argv[1], argv[2], argv[3]);
    } catch (const std::exception& error) {
        dqw::complain(std::string("measured: ") + error.what());
        return 1;
    }
}
