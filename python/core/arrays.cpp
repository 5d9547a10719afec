#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "block.hpp"
#include "error.hpp"
#include "table.hpp"

namespace nb = nanobind;

namespace dqw::python {
namespace {

using Array = nb::ndarray<nb::ro, nb::ndim<1>, nb::device::cpu>;

bool is_bool(nb::dlpack::dtype type)
{
    return type.code == static_cast<std::uint8_t>(nb::dlpack::dtype_code::Bool) && type.bits == 8;
}

/// How a column is copied into a block; null: it holds nothing that a number could stand for.
Copy copy_of(nb::dlpack::dtype type)
{
    using Code = nb::dlpack::dtype_code;
    const auto is = [&](Code code, int bits) {
        return type.code == static_cast<std::uint8_t>(code) && type.bits == bits;
    };
    if (type.lanes != 1) return nullptr;
    if (is(Code::Float, 64)) return copy<double>;
    if (is(Code::Float, 32)) return copy<float>;
    if (is(Code::Int, 64)) return copy<std::int64_t>;
    if (is(Code::Int, 32)) return copy<std::int32_t>;
    if (is(Code::Int, 16)) return copy<std::int16_t>;
    if (is(Code::Int, 8)) return copy<std::int8_t>;
    if (is(Code::UInt, 64)) return copy<std::uint64_t>;
    if (is(Code::UInt, 32)) return copy<std::uint32_t>;
    if (is(Code::UInt, 16)) return copy<std::uint16_t>;
    if (is(Code::UInt, 8) || is_bool(type)) return copy<std::uint8_t>;
    return nullptr;
}

class Arrays : public Blocks {
public:
    explicit Arrays(const nb::list& columns)
    {
        for (const nb::handle item : columns) {
            const auto pair = nb::cast<nb::tuple>(item);
            fields_.push_back(nb::cast<std::string>(pair[0]));
            columns_.push_back(column_of(pair[1], fields_.back()));
        }
        bool any = false;
        for (std::size_t f = 0; f < columns_.size(); ++f) {
            const Column& column = columns_[f];
            if (!column.copy) continue;
            if (any && column.array.shape(0) != rows_)
                raise_usage("column " + fields_[f] + " has " + std::to_string(column.array.shape(0)) +
                            " rows, but others have " + std::to_string(rows_) + "; expected as many in all");
            rows_ = column.array.shape(0);
            any = true;
        }
    }

    const std::vector<std::string>& fields() const override { return fields_; }
    std::size_t rows() const override { return rows_; }
    std::string no_numbers(std::size_t field) const override { return columns_[field].type; }

protected:
    std::size_t fill(double* block) override
    {
        const std::size_t n = std::min(most_rows, rows_ - at_);
        for (std::size_t f = 0; f < columns_.size(); ++f) {
            const Column& c = columns_[f];
            if (c.copy)
                c.copy(c.bytes + static_cast<std::ptrdiff_t>(at_) * c.stride, c.stride, n, block + f, fields_.size());
            else
                for (std::size_t r = 0; r < n; ++r)
                    block[f + r * fields_.size()] = std::numeric_limits<double>::quiet_NaN();
        }
        at_ += n;
        return n;
    }

private:
    struct Column {
        Array array;
        Copy copy = nullptr;
        const char* bytes = nullptr;
        std::ptrdiff_t stride = 0;  // bytes
        std::string type;           // where it holds no numbers; of truth values, which a status may be, beside copy
    };

    static Column column_of(const nb::object& what, const std::string& name)
    {
        Column column;
        if (nb::isinstance<nb::str>(what)) {
            column.type = nb::cast<std::string>(what);
            return column;
        }
        if (!nb::try_cast(what, column.array))
            raise_usage("column " + name + " is no array of one dimension; expected one number a row");
        column.copy = copy_of(column.array.dtype());
        if (!column.copy) {
            column.type = "unknown";
            return column;
        }
        if (is_bool(column.array.dtype())) column.type = "bool";
        column.bytes = static_cast<const char*>(column.array.data());
        column.stride = column.array.stride(0) * column.array.dtype().bits / 8;
        return column;
    }

    std::vector<std::string> fields_;
    std::vector<Column> columns_;
    std::size_t rows_ = 0, at_ = 0;
};

}  // namespace

Table table_of_arrays(const nb::list& columns) { return std::make_shared<Arrays>(columns); }

}  // namespace dqw::python
