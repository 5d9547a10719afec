// Work on all cores.
#ifndef DQW_REF_LOG_HANDS_HPP
#define DQW_REF_LOG_HANDS_HPP

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

namespace dqw {

/// Calls work(n) for every n below `count`, once, in any order, on as many threads as the machine has cores.
template <typename Work> void side_by_side(std::size_t count, Work&& work)
{
    std::atomic<std::size_t> next{0};
    const auto hand = [&] {
        for (std::size_t n = next++; n < count; n = next++) work(n);
    };
    std::vector<std::thread> others;
    const std::size_t hands = std::min<std::size_t>(std::max(1U, std::thread::hardware_concurrency()), count);
    for (std::size_t k = 1; k < hands; ++k) others.emplace_back(hand);
    hand();
    for (std::thread& t : others) t.join();
}

}  // namespace dqw
#endif
