// Columns of Python's as rows: arrays of one dimension by name, or an Arrow C stream.
#ifndef DQW_PYTHON_TABLE_HPP
#define DQW_PYTHON_TABLE_HPP

#include <nanobind/nanobind.h>

#include <memory>

#include "app/read/row_source.hpp"

namespace dqw::python {

/// What a table is read from; read once. Made and destroyed with the GIL held, read without.
using Table = std::shared_ptr<RowSource>;

/// What Python holds.
struct TableHandle {
    Table table;
};

/// `columns`: a list of (name, array); in place of an array the name of its type, where that holds no numbers. The
/// arrays are kept, not copied. Raises UsageError on unlike lengths.
Table table_of_arrays(const nanobind::list& columns);

/// `capsule`: what __arrow_c_stream__() gives; it is used up. `rows`: how many there are, 0 where that is not known.
/// Raises UsageError on a stream that was released.
Table table_of_stream(const nanobind::object& capsule, std::size_t rows);

}  // namespace dqw::python
#endif
