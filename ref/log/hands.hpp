// Work on all cores.
#ifndef DQW_REF_LOG_HANDS_HPP
#define DQW_REF_LOG_HANDS_HPP

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "ref/log/wanted.hpp"

namespace dqw {

/// Calls work(n, own) for every n below `count`, once, on as many threads as the machine has cores. Each thread makes
/// its `own` by begin(), and its n rise. What one of them throws ends them all.
template <typename Begin, typename Work> void side_by_side(std::size_t count, Begin&& begin, Work&& work)
{
    std::atomic<std::size_t> next{0};
    std::exception_ptr failed;
    std::mutex failing;
    const auto hand = [&] {
        try {
            auto own = begin();
            for (std::size_t n = next++; n < count; n = next++) work(n, own);
        } catch (...) {
            next = count;
            const std::lock_guard<std::mutex> lock(failing);
            failed = std::current_exception();
        }
    };
    std::vector<std::thread> others;
    const std::size_t hands = std::min<std::size_t>(std::max(1U, std::thread::hardware_concurrency()), count);
    for (std::size_t k = 1; k < hands; ++k)
        others.emplace_back([&hand, asked = still_wanted] {
            still_wanted = asked;
            hand();
        });
    hand();
    for (std::thread& t : others) t.join();
    if (failed) std::rethrow_exception(failed);
}

template <typename Work> void side_by_side(std::size_t count, Work&& work)
{
    side_by_side(
        count, [] { return 0; }, [&](std::size_t n, int) { work(n); });
}

}  // namespace dqw
#endif
