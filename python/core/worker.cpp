#include "worker.hpp"

#include <unistd.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>

#include "error.hpp"
#include "ref/log/wanted.hpp"

namespace nb = nanobind;

namespace dqw::python {
namespace {

/// Shared with the thread, which may outlive the caller in a process that was forked off.
struct Job {
    std::mutex mutex;
    std::condition_variable changed;
    bool done = false;
    std::exception_ptr failed;
    std::string name;
    double fraction = 0.0;
    std::atomic<bool> cancelled{false};
};

void work_on(Job& job, const std::function<void(const JobProgress&)>& work)
{
    const JobProgress tell = [&job](const std::string& name, double fraction) {
        if (job.cancelled) throw Cancelled();
        const std::lock_guard<std::mutex> lock(job.mutex);
        job.name = name;
        job.fraction = fraction;
    };
    std::exception_ptr failed;
    still_wanted = [&job] {
        if (job.cancelled) throw Cancelled();
    };
    try {
        work(tell);
    } catch (...) {
        failed = std::current_exception();
    }
    {
        const std::lock_guard<std::mutex> lock(job.mutex);
        job.failed = failed;
        job.done = true;
    }
    job.changed.notify_all();
}

/// True where the job has ended; the GIL is held before and after.
bool wait(Job& job, bool to_the_end)
{
    using namespace std::chrono_literals;
    const nb::gil_scoped_release release;
    std::unique_lock<std::mutex> lock(job.mutex);
    const auto done = [&job] { return job.done; };
    if (!to_the_end) return job.changed.wait_for(lock, 50ms, done);
    job.changed.wait(lock, done);
    return true;
}

/// False where the caller wants no more: a Python exception is set.
bool goes_on(Job& job, const nb::object& told)
{
    if (PyErr_CheckSignals() != 0) return false;
    if (told.is_none()) return true;
    std::string name;
    double fraction = 0.0;
    {
        const std::lock_guard<std::mutex> lock(job.mutex);
        name = job.name, fraction = job.fraction;
    }
    if (name.empty()) return true;
    PyObject* answer = PyObject_CallFunction(told.ptr(), "sd", name.c_str(), fraction);
    Py_XDECREF(answer);
    return answer != nullptr;
}

}  // namespace

void run_job(const std::function<void(const JobProgress&)>& work, const nb::object& told,
             const std::vector<std::string>& tables)
{
    const auto job = std::make_shared<Job>();
    const ::pid_t begun_by = ::getpid();
    std::thread thread([job, work] { work_on(*job, work); });
    bool wanted = true;
    while (!wait(*job, !wanted)) {
        wanted = goes_on(*job, told);
        if (::getpid() != begun_by) {
            // The thread is the other process'.
            thread.detach();
            if (wanted) raise_usage("the process was forked in the middle of this call; the work goes on in the other");
            throw nb::python_error();
        }
        if (!wanted) job->cancelled = true;
    }
    {
        const nb::gil_scoped_release release;
        thread.join();
    }
    if (!wanted) throw nb::python_error();
    if (!job->failed) return;
    try {
        std::rethrow_exception(job->failed);
    } catch (...) {
        raise_current(tables);
    }
}

}  // namespace dqw::python
