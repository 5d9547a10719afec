// Rows that are numbers already: columns of a frame in memory, where a file would have lines.
#ifndef DQW_APP_READ_ROW_SOURCE_HPP
#define DQW_APP_READ_ROW_SOURCE_HPP

#include <cstddef>
#include <string>
#include <vector>

namespace dqw {

class RowSource {
public:
    RowSource() = default;
    RowSource(const RowSource&) = delete;
    RowSource& operator=(const RowSource&) = delete;
    virtual ~RowSource() = default;
    virtual const std::vector<std::string>& fields() const = 0;
    /// The next row's numbers, one a field, valid until the next call; NaN where there is none. Null at the end.
    virtual const double* next() = 0;
    /// 0: not known before the end.
    virtual std::size_t rows() const { return 0; }
    /// The type of a field that holds no numbers; empty where it does.
    virtual std::string no_numbers(std::size_t field) const = 0;
};

}  // namespace dqw
#endif
