// app/'s jobs for Python: each takes what is asked as a dictionary and gives texts and arrays.
#ifndef DQW_PYTHON_JOBS_HPP
#define DQW_PYTHON_JOBS_HPP

#include <nanobind/nanobind.h>

#include "app/job/options.hpp"

namespace dqw::python {

/// The options that a dictionary says; `tables`: of (name, Table). Raises TypeError on a value of another type.
Options options_of(const nanobind::dict& asked, const nanobind::list& tables);

/// Names of the tables.
std::vector<std::string> names_of(const Options& options);

/// Bytes of the rooms as text; what is no UTF-8 is replaced.
nanobind::object text_of(const std::string& bytes);

void bind_jobs(nanobind::module_& m);

}  // namespace dqw::python
#endif
