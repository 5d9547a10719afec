// A log that has no end yet: rows as they come, of any format, in bounded memory.
#ifndef DQW_APP_READ_LOG_STREAM_HPP
#define DQW_APP_READ_LOG_STREAM_HPP

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "app/read/log_reader.hpp"

namespace dqw {

/// Where read_log() refuses a row behind the window, it is left out and counted here, and said once; so is a clock that
/// goes back by more than a second.
class LogStream {
public:
    /// As read_log(); reads the head, waits for some rows. Throws InputError.
    LogStream(const std::string& path, const ReadOptions& options);
    ~LogStream();
    LogStream(const LogStream&) = delete;
    LogStream& operator=(const LogStream&) = delete;

    /// What the machine file says.
    const Machine& machine() const;
    const std::string& modulation() const;
    /// The log that the first `window_s` make, `fewest_rows` at least, or all where it ends before: what read_log()
    /// would make of them. Once, before next(). Throws InputError.
    Log begin(double window_s, std::size_t fewest_rows);
    /// The next rows into the columns of `rows`, from the very first on; one at least, and no more than are there
    /// without waiting. `segments`: those before which a gap stands. False at the end, or after an interrupt.
    bool next(Log& rows);
    /// Gets what happens while rows come.
    void on_note(std::function<void(const std::string&)> said);
    /// Rows that were none, by the reason.
    const std::vector<LeftOut>& left_out() const;

private:
    class Impl;
    const ReadOptions options_;
    std::unique_ptr<Impl> impl_;
};

}  // namespace dqw
#endif
