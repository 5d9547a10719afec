// Lines of a file in bounded memory.
#ifndef DQW_APP_READ_LINE_SOURCE_HPP
#define DQW_APP_READ_LINE_SOURCE_HPP

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "app/read/byte_source.hpp"

namespace dqw {

/// Reads a file, pipe or device line by line, unpacked; throws InputError. Memory: at most 1 MiB, the longest line
/// accepted, and what unpacks.
class LineSource {
public:
    static constexpr std::size_t longest_line_bytes = std::size_t{1} << 20;

    /// Opens `path`, "-" for standard input; a directory is refused.
    explicit LineSource(const std::string& path) : path_(path), bytes_(open_bytes(path)), buffer_(first_bytes) {}
    /// Lines of `text`, which were these lines of `path`.
    LineSource(const std::string& path, std::string text, std::vector<std::size_t> lines)
        : path_(path), bytes_(bytes_of(std::move(text))), lines_(std::move(lines)), buffer_(first_bytes)
    {
    }

    /// The next line without its LF or CRLF, valid until the next call; false at the end.
    bool next(std::string_view& line);
    /// True where next() gives a line without waiting for more.
    bool ready() const;
    /// Whether the line that next() gave last had no end: the last of a file that was cut off, or not ended.
    bool unended() const { return unended_; }
    /// All that is left, as it stands; throws where it is more than `most_bytes`.
    std::string rest(std::size_t most_bytes);

    /// Number of the line that next() gave last; from 1.
    std::size_t line_number() const { return line_ > 0 && line_ <= lines_.size() ? lines_[line_ - 1] : line_; }
    /// Bytes consumed by the lines given so far.
    std::uint64_t bytes_consumed() const { return consumed_; }
    /// Size of a regular file; 0 of a pipe, a device, a packed file.
    std::uint64_t file_bytes() const { return bytes_->size(); }

private:
    bool fill();

    static constexpr std::size_t first_bytes = std::size_t{1} << 18;

    std::string path_;
    std::unique_ptr<ByteSource> bytes_;
    std::vector<std::size_t> lines_;
    std::vector<char> buffer_;
    std::size_t begin_ = 0, end_ = 0, line_ = 0;
    std::uint64_t consumed_ = 0;
    bool at_end_ = false, unended_ = false;
};

}  // namespace dqw
#endif
