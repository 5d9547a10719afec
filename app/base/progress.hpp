// A progress bar on stderr, for jobs of more than a second, on a terminal only.
#ifndef DQW_APP_BASE_PROGRESS_HPP
#define DQW_APP_BASE_PROGRESS_HPP

#include <chrono>
#include <functional>
#include <string>

namespace dqw {

/// How far a job of this name is, 0..1, called on the thread that runs it; it ends the job by throwing.
using JobProgress = std::function<void(const std::string& job, double fraction)>;

/// Shows one bar for one job, or tells `instead`; the destructor wipes it off the line.
class Progress {
public:
    explicit Progress(std::string label, JobProgress instead = {});
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
    JobProgress instead_;
    bool terminal_, drawn_ = false;
    std::chrono::steady_clock::time_point start_, last_;
};

}  // namespace dqw
#endif
