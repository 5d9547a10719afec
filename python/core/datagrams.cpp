#include "datagrams.hpp"

#include <poll.h>
#include <sys/socket.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace nb = nanobind;

namespace dqw::python {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t largest_datagram = 65536;
// A flood holds the lock no longer.
constexpr int most_at_once = 1024;
constexpr int wait_ms = 100;
constexpr auto pause = 2ms;

class Datagrams {
public:
    /// `most_bytes` wait here; `socket` stays the caller's, and open until close().
    Datagrams(int socket, std::size_t most_bytes) : socket_(socket), most_(most_bytes), thread_([this] { run(); }) {}
    ~Datagrams() { close(); }
    Datagrams(const Datagrams&) = delete;
    Datagrams& operator=(const Datagrams&) = delete;

    /// What has come, a line's end behind each; how many were dropped so far, by the kernel and here; the last error.
    nb::tuple take()
    {
        std::string data;
        std::uint64_t dropped = 0;
        int error = 0;
        {
            const std::lock_guard<std::mutex> lock(mutex_);
            data.swap(waiting_);
            dropped = left_ + kernel_dropped_;
            std::swap(error, error_);
        }
        return nb::make_tuple(nb::bytes(data.data(), data.size()), dropped, error);
    }

    void close()
    {
        ended_ = true;
        const nb::gil_scoped_release release;
        if (thread_.joinable()) thread_.join();
    }

private:
    void run()
    {
        std::vector<char> buffer(largest_datagram);
        while (!ended_) {
            pollfd ready{socket_, POLLIN, 0};
            if (::poll(&ready, 1, wait_ms) <= 0) continue;
            gather(buffer);
            // Many a turn: waking costs more than a datagram.
            std::this_thread::sleep_for(pause);
        }
    }

    void gather(std::vector<char>& buffer)
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        for (int k = 0; k < most_at_once; ++k) {
            alignas(cmsghdr) char control[64];
            iovec to{buffer.data(), buffer.size()};
            msghdr message{};
            message.msg_iov = &to;
            message.msg_iovlen = 1;
            message.msg_control = control;
            message.msg_controllen = sizeof control;
            const ssize_t size = ::recvmsg(socket_, &message, MSG_DONTWAIT);
            if (size < 0) {
                if (errno != EAGAIN && errno != EINTR) error_ = errno;
                return;
            }
            count_dropped(message);
            if (waiting_.size() + static_cast<std::size_t>(size) >= most_) {
                ++left_;
                continue;
            }
            waiting_.append(buffer.data(), static_cast<std::size_t>(size)).push_back('\n');
        }
    }

    void count_dropped(msghdr& message)
    {
#ifdef SO_RXQ_OVFL
        for (cmsghdr* c = CMSG_FIRSTHDR(&message); c; c = CMSG_NXTHDR(&message, c)) {
            if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SO_RXQ_OVFL) continue;
            std::uint32_t dropped = 0;
            std::memcpy(&dropped, CMSG_DATA(c), sizeof dropped);
            kernel_dropped_ = dropped;
        }
#else
        static_cast<void>(message);
#endif
    }

    const int socket_;
    const std::size_t most_;
    std::mutex mutex_;
    std::string waiting_;
    std::uint64_t left_ = 0, kernel_dropped_ = 0;
    int error_ = 0;
    std::atomic<bool> ended_{false};
    std::thread thread_;  // last: it uses all others
};

}  // namespace

void bind_datagrams(nb::module_& m)
{
    nb::class_<Datagrams>(m, "Datagrams")
        .def(nb::init<int, std::size_t>())
        .def("take", &Datagrams::take)
        .def("close", &Datagrams::close);
}

}  // namespace dqw::python
