// One call at a time on an object whose work is done without the GIL.
#ifndef DQW_PYTHON_GUARD_HPP
#define DQW_PYTHON_GUARD_HPP

#include <unistd.h>

#include <atomic>

#include "error.hpp"

namespace dqw::python {

/// Which process is at work on an object; 0: none.
using Busy = std::atomic<::pid_t>;

class Guard {
public:
    /// Raises UsageError where another thread is at work on it, or was when the process was forked.
    explicit Guard(Busy& busy) : busy_(busy)
    {
        ::pid_t none = 0;
        if (busy_.compare_exchange_strong(none, ::getpid())) return;
        if (none == ::getpid()) raise_usage("in use by another thread; expected one call at a time");
        raise_usage("the process was forked in the middle of a call on this; expected a state() taken before");
    }
    ~Guard() { busy_ = 0; }
    Guard(const Guard&) = delete;
    Guard& operator=(const Guard&) = delete;

private:
    Busy& busy_;
};

}  // namespace dqw::python
#endif
