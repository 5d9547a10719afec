// The beginning of a log: preamble, header, line of units, and the first rows, which are read again.
#ifndef DQW_APP_READ_OPENING_HPP
#define DQW_APP_READ_OPENING_HPP

#include <deque>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "app/format/formats.hpp"
#include "app/read/line_source.hpp"

namespace dqw {

/// Lines of rows behind a head that has been looked at. Refuses binary data and other encodings; throws InputError.
class Opening {
public:
    static constexpr std::size_t most_fields = 4096;

    explicit Opening(const std::string& path);

    Head head;
    const Format* json = nullptr;  ///< the format that has turned JSON into lines

    /// The next line of a row, valid until the next call; false at the end.
    bool next(std::string_view& line);
    std::size_t line_number() const { return line_; }
    const LineSource& source() const { return *source_; }

private:
    bool read(std::string& line);
    void convert(const std::string& path, const std::string& first, std::size_t number);
    void read_header(const std::string& path, std::string line);
    void look_at_rows();

    std::unique_ptr<LineSource> source_;
    std::deque<std::pair<std::string, std::size_t>> seen_;  // lines to be read again, with their numbers
    std::string line_text_;
    std::size_t line_ = 0;
};

}  // namespace dqw
#endif
