// Columns to rows, some hundred rows at a time.
#ifndef DQW_PYTHON_BLOCK_HPP
#define DQW_PYTHON_BLOCK_HPP

#include <cstddef>
#include <cstring>
#include <vector>

#include "app/read/row_source.hpp"

namespace dqw::python {

/// Copies n values that are `stride` bytes apart to every `step`-th number of `to`.
using Copy = void (*)(const char* from, std::ptrdiff_t stride, std::size_t n, double* to, std::size_t step);

template <class T> void copy(const char* from, std::ptrdiff_t stride, std::size_t n, double* to, std::size_t step)
{
    for (std::size_t r = 0; r < n; ++r) {
        // A frame's column may stand at any address.
        T value;
        std::memcpy(&value, from + static_cast<std::ptrdiff_t>(r) * stride, sizeof value);
        to[r * step] = static_cast<double>(value);
    }
}

/// Rows out of blocks that fill() makes.
class Blocks : public RowSource {
public:
    const double* next() override
    {
        if (row_ == filled_) {
            block_.resize(most_rows * fields().size());
            filled_ = fill(block_.data());
            row_ = 0;
            if (filled_ == 0) return nullptr;
        }
        return block_.data() + fields().size() * row_++;
    }

protected:
    static constexpr std::size_t most_rows = 512;
    /// The next rows, one after the other, most_rows at most; how many. 0 at the end.
    virtual std::size_t fill(double* block) = 0;

private:
    std::vector<double> block_;
    std::size_t row_ = 0, filled_ = 0;
};

}  // namespace dqw::python
#endif
