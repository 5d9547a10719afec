// Datagrams of a socket, taken by a thread that wants no GIL.
#ifndef DQW_PYTHON_DATAGRAMS_HPP
#define DQW_PYTHON_DATAGRAMS_HPP

#include <nanobind/nanobind.h>

namespace dqw::python {

void bind_datagrams(nanobind::module_& m);

}  // namespace dqw::python
#endif
