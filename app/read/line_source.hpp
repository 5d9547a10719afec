// Lines of a file in bounded memory.
#ifndef DQW_APP_READ_LINE_SOURCE_HPP
#define DQW_APP_READ_LINE_SOURCE_HPP

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace dqw {

/// Reads a file, pipe or device line by line; throws InputError. Memory: at most 1 MiB, the longest line accepted.
class LineSource {
public:
    static constexpr std::size_t longest_line_bytes = std::size_t{1} << 20;

    /// Opens `path`; a directory is refused.
    explicit LineSource(const std::string& path);
    ~LineSource();
    LineSource(const LineSource&) = delete;
    LineSource& operator=(const LineSource&) = delete;

    /// The next line without its LF or CRLF, valid until the next call; false at the end.
    bool next(std::string_view& line);

    /// Number of the line that next() gave last; from 1.
    std::size_t line_number() const { return line_; }
    /// Bytes consumed by the lines given so far.
    std::uint64_t bytes_consumed() const { return consumed_; }
    /// Size of a regular file; 0 of a pipe or device.
    std::uint64_t file_bytes() const { return file_bytes_; }

private:
    bool fill();

    std::string path_;
    int fd_ = -1;
    std::vector<char> buffer_;
    std::size_t begin_ = 0, end_ = 0, line_ = 0;
    std::uint64_t consumed_ = 0, file_bytes_ = 0;
    bool at_end_ = false;
};

}  // namespace dqw
#endif
