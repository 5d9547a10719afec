#include "app/base/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace dqw {

Progress::Progress(std::string label, JobProgress instead)
    : label_(std::move(label)), instead_(std::move(instead)), terminal_(::isatty(STDERR_FILENO) == 1),
      start_(std::chrono::steady_clock::now()), last_(start_)
{
}

Progress::~Progress() { wipe(); }

void Progress::wipe()
{
    if (!drawn_) return;
    std::fputs("\r\x1b[K", stderr);
    std::fflush(stderr);
    drawn_ = false;
}

void Progress::update(double fraction)
{
    using namespace std::chrono_literals;
    if (instead_) return instead_(label_, fraction);
    if (!terminal_) return;
    const auto now = std::chrono::steady_clock::now();
    if (now - start_ < 1s || now - last_ < 100ms) return;
    last_ = now;
    drawn_ = true;
    constexpr int width = 30;
    const double part = std::clamp(fraction, 0.0, 1.0);
    const auto full = static_cast<std::size_t>(part * width);
    const std::string bar = std::string(full, '#') + std::string(width - full, '.');
    const double left_s = part > 0.02 ? std::chrono::duration<double>(now - start_).count() * (1 - part) / part : 0;
    const std::string text = fmt::format("\r{} [{}] {:3.0f} %{}\x1b[K", label_, bar, 100 * part,
                                         left_s >= 1 ? fmt::format(", {:.0f} s left", left_s) : "");
    std::fputs(text.c_str(), stderr);
    std::fflush(stderr);
}

}  // namespace dqw
