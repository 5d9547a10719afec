// Several logs of one machine.
#ifndef DQW_APP_JOB_LOGS_HPP
#define DQW_APP_JOB_LOGS_HPP

#include <stdexcept>
#include <string>
#include <vector>

#include "app/base/input_error.hpp"
#include "app/job/options.hpp"
#include "app/learn/inputs.hpp"
#include "app/read/log_reader.hpp"
#include "ref/log/log.hpp"

namespace dqw {

/// What the command line says of reading logs.
ReadOptions read_options(const Options& options);

/// The effects of a trace.json, or of its text, and those in `names` that it lacks.
LearnConfig asked_effects(const Options& options, const std::vector<std::string>& names);

/// The table that stands for a log of this name; null where it is a file.
RowSource* table_of(const Options& options, const std::string& log);

/// Reads logs of one machine and one regime, for a joint estimate: what one machine file says holds for all. Without
/// `all_columns` only those of a plain fit are kept, and with `angle` the electrical angle. Unless `polled`
/// of a polled log its settled rows, as settled points. Throws InputError.
std::vector<Log> read_logs(const std::vector<std::string>& paths, const Options& options, bool all_columns,
                           std::vector<std::string>& notes, bool angle = false, bool polled = false);

/// What an estimator says of a log, which it may begin with the log's name, behind the log's last line. What is doubted
/// of its columns goes with it: that may be why.
InputError refused(const Log& log, std::string what);

/// Does `work` with logs; what it refuses by std::invalid_argument is an InputError of the first, which stands for all.
template <class Work> auto with_logs(const std::vector<Log>& logs, const Work& work)
{
    try {
        return work();
    } catch (const std::invalid_argument& error) {
        throw refused(logs.front(), error.what());
    }
}

/// Brings a speed forward that is late beside the logs' angle, in place, and says so; `firmware`: that it must as well.
/// `known_s`: by how much, where that is known already. (E193)
void bring_speed_forward(std::vector<Log>& logs, bool firmware, std::vector<std::string>& notes,
                         std::optional<double> known_s = {});

}  // namespace dqw
#endif
