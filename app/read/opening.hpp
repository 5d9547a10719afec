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
#include "app/read/row_source.hpp"

namespace dqw {

/// Lines of rows behind a head that has been looked at. Refuses binary data and other encodings; throws InputError.
class Opening {
public:
    static constexpr std::size_t most_fields = 4096;

    explicit Opening(const std::string& path);
    /// Of a table in memory, which must outlive it; its rows come by the other next().
    Opening(const std::string& name, RowSource& rows);

    Head head;
    const Format* json = nullptr;  ///< the format that has turned JSON into lines

    /// The next line of a row, valid until the next call; false at the end.
    bool next(std::string_view& line);
    /// True where next() gives a line without waiting for more.
    bool ready() const { return is_table() || !seen_.empty() || source_->ready(); }
    /// Whether the line that next() gave last has no end of its own; whether but blank lines come, and what comes is
    /// lost.
    bool was_unended() const { return seen_.empty() && source_->unended(); }
    bool was_last();
    /// The next row of a table; null at its end. Row k, from 0, is line k + 2, as if below a header.
    const double* next();
    bool is_table() const { return table_ != nullptr; }
    std::size_t line_number() const { return line_; }
    /// Bytes of a file taken so far, or rows of a table, and of how many; 0: not known.
    std::uint64_t taken() const { return table_ ? line_ : source_->bytes_consumed(); }
    std::uint64_t in_all() const { return table_ ? table_->rows() : source_->file_bytes(); }

private:
    bool read(std::string& line);
    void convert(const std::string& path, const std::string& first, std::size_t number);
    void read_header(const std::string& path, std::string line);
    void look_at_rows();

    std::unique_ptr<LineSource> source_;
    RowSource* table_ = nullptr;
    std::deque<std::vector<double>> seen_rows_;
    std::vector<double> row_;
    std::deque<std::pair<std::string, std::size_t>> seen_;  // lines to be read again, with their numbers
    std::string line_text_;
    std::size_t line_ = 0;
};

}  // namespace dqw
#endif
