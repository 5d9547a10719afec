// A job on a thread of its own, while the caller's thread shows progress and listens for Ctrl-C. The GIL is not held.
#ifndef DQW_PYTHON_WORKER_HPP
#define DQW_PYTHON_WORKER_HPP

#include <nanobind/nanobind.h>

#include <functional>
#include <string>
#include <vector>

#include "app/base/progress.hpp"

namespace dqw::python {

/// Runs `work` to its end; its argument tells how far it is, and throws Cancelled. `told`, unless None, is called with
/// (job, fraction) at most twenty times a second; what it raises cancels the job. Python exceptions as raise_current().
void run_job(const std::function<void(const JobProgress&)>& work, const nanobind::object& told,
             const std::vector<std::string>& tables);

}  // namespace dqw::python
#endif
