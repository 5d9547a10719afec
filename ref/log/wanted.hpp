// Long loops ask now and then whether anybody still waits for their end.
#ifndef DQW_REF_LOG_WANTED_HPP
#define DQW_REF_LOG_WANTED_HPP

#include <cstddef>
#include <functional>

namespace dqw {

/// What this thread's loops call, and threads that it starts; it ends them by throwing. Empty: somebody always waits.
inline thread_local std::function<void()> still_wanted;

/// Calls it once in 65536 rows, of which the loop takes `step` at a time.
inline void ask_at(std::size_t row, std::size_t step = 1)
{
    if (row % 65536 < step && still_wanted) still_wanted();
}

}  // namespace dqw
#endif
