// The simulator: whole runs, with arrays for profiles, and runs that Python steps.
#ifndef DQW_PYTHON_SIMULATE_HPP
#define DQW_PYTHON_SIMULATE_HPP

#include <nanobind/nanobind.h>

namespace dqw::python {

void bind_simulate(nanobind::module_& m);

}  // namespace dqw::python
#endif
