#include "app/base/interrupt.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <stdexcept>

namespace dqw {
namespace {

// What a handler may touch: the pipe outlives every reader, so that no signal falls between a look and a wait.
volatile sig_atomic_t asked = 0;
int ends[2] = {-1, -1};

void ask(int)
{
    const int before = errno;
    asked = 1;
    (void)!::write(ends[1], "", 1);
    errno = before;
}

}  // namespace

void catch_interrupts()
{
    if (ends[0] >= 0) return;
    if (::pipe2(ends, O_CLOEXEC | O_NONBLOCK) != 0) throw std::runtime_error("no pipe for interrupts");
    struct sigaction action = {};
    action.sa_handler = ask;
    // The next one is as it was before: who asks twice does not want to wait.
    action.sa_flags = static_cast<int>(SA_RESETHAND);
    for (const int signal : {SIGINT, SIGTERM}) {
        struct sigaction was = {};
        // One that is ignored stays so: nohup, and a shell's jobs.
        if (::sigaction(signal, nullptr, &was) != 0 || was.sa_handler == SIG_IGN) continue;
        (void)::sigaction(signal, &action, nullptr);
    }
}

bool interrupted() { return asked != 0; }

bool wait_to_read(int fd)
{
    if (ends[0] < 0) return true;
    pollfd both[2] = {{fd, POLLIN, 0}, {ends[0], POLLIN, 0}};
    while (!interrupted()) {
        if (::poll(both, 2, -1) < 0) {
            if (errno == EINTR) continue;
            return true;
        }
        if (both[0].revents != 0) return !interrupted();
    }
    return false;
}

}  // namespace dqw
