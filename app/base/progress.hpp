// A progress bar on stderr, for jobs of more than a second, on a terminal only.
#ifndef DQW_APP_BASE_PROGRESS_HPP
#define DQW_APP_BASE_PROGRESS_HPP

#include <chrono>
#include <functional>
#include <string>

namespace dqw {

/// Shows one bar for one job; the destructor wipes it off the line.
class Progress {
public:
    explicit Progress(std::string label);
    ~Progress();
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    /// Draws 0..1, at most ten times a second, and not in the first second.
    void update(double fraction);

    /// Takes it off the line, for other text; the next update draws it again.
    void wipe();

    /// For callers that take a function.
    std::function<void(double)> callback()
    {
        return [this](double fraction) { update(fraction); };
    }

private:
    std::string label_;
    bool terminal_, drawn_ = false;
    std::chrono::steady_clock::time_point start_, last_;
};

}  // namespace dqw
#endif
