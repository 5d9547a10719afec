// JSON lines as rows of numbers, many at a time.
#ifndef DQW_PYTHON_LINES_HPP
#define DQW_PYTHON_LINES_HPP

#include <nanobind/nanobind.h>

namespace dqw::python {

void bind_lines(nanobind::module_& m);

}  // namespace dqw::python
#endif
