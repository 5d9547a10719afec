// Monitor and Estimator: a row or a block at a time.
#ifndef DQW_PYTHON_STREAMS_HPP
#define DQW_PYTHON_STREAMS_HPP

#include <nanobind/nanobind.h>

namespace dqw::python {

void bind_streams(nanobind::module_& m);

}  // namespace dqw::python
#endif
