// A measured log, or all those of one machine, as `make measured` treats it: fitted, traced, written down.
#ifndef DQW_BENCH_MEASURED_HPP
#define DQW_BENCH_MEASURED_HPP

#include <optional>
#include <string>
#include <vector>

#include "app/trace/report.hpp"
#include "ref/log/result.hpp"

namespace measured {

struct Entry {
    std::string name;  ///< file name, or "all 3 of MACHINE"
    std::vector<dqw::Log> logs;
    dqw::Result result;
    std::optional<dqw::TraceReport> report;
    std::string picture;  ///< file name of its report's first screen; empty: none
    std::vector<std::string> sources, problems;
};

/// Cells of a Markdown table may hold no bar and no line end.
std::string cell(std::string text);
std::string row(const std::vector<std::string>& cells);

/// Traces an entry's logs and runs the learners over them, as `dqwatch trace` does. Throws std::invalid_argument.
dqw::TraceReport traced(const std::vector<dqw::Log>& logs);

/// Before and after of all entries: two tables each of the electrical and of the mechanical ones.
std::string traced_tables(const std::vector<Entry>& entries);

/// The lines of a list on what the trace of one entry found, and its picture.
std::string traced_lines(const Entry& entry);

/// The whole document.
std::string document(const std::vector<Entry>& entries, const std::vector<std::string>& unread);

}  // namespace measured
#endif
