// What the rooms throw, as exceptions of dqwatch.
#ifndef DQW_PYTHON_ERROR_HPP
#define DQW_PYTHON_ERROR_HPP

#include <nanobind/nanobind.h>

#include <string>
#include <vector>

namespace dqw::python {

/// The job was cancelled; on its way out of the rooms nothing but the worker catches it.
struct Cancelled {};

/// Sets the Python exception for what is being handled (call it within a catch block) and throws it. `tables`: names of
/// logs that are no files, whose lines are rows.
[[noreturn]] void raise_current(const std::vector<std::string>& tables = {});

/// Throws dqwatch.UsageError.
[[noreturn]] void raise_usage(const std::string& what);

}  // namespace dqw::python
#endif
