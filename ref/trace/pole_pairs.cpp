#include "ref/trace/pole_pairs.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace dqw {
namespace {

// Of a model that lacks something the real ones were off by up to 1.5; each number costs a trace.
constexpr int kNearest = 4;
// Of what any other number leaves: a wrong one may be explained by effects that are not there, to a floor that they
// are part of.
constexpr double kClearly = 0.75;

bool tells_all(const TraceResult& r) { return r.verdict == "clean" || r.verdict == "explained"; }

/// Traces under whole numbers, the best so far.
class Trials {
public:
    Trials(const std::vector<Log>& logs, const TraceOptions& options) : logs_(logs), options_(options) {}

    void of(int p)
    {
        if (p < 1 || left_.count(p) > 0) return;
        TraceOptions with = options_;
        with.pole_pairs = p;
        TraceResult r = trace(logs_, with);
        left_[p] = r.after.heldout_rms;
        if (!tells_all(r) || (found() && !(left_[p] < left_[right_]))) return;
        right_ = p, best_ = std::move(r);
    }

    bool found() const { return right_ > 0; }
    int right() const { return right_; }
    TraceResult& best() { return best_; }

    bool clear() const
    {
        return found() && std::all_of(left_.begin(), left_.end(), [this](const auto& other) {
                   return other.first == right_ || left_.at(right_) < kClearly * other.second;
               });
    }

private:
    const std::vector<Log>& logs_;
    const TraceOptions& options_;
    std::map<int, double> left_;  ///< of rows held out, by the number
    int right_ = 0;
    TraceResult best_;
};

}  // namespace

TraceResult under_whole_pole_pairs(const std::vector<Log>& logs, const TraceOptions& options, TraceResult as_it_stands)
{
    if (tells_all(as_it_stands)) return as_it_stands;
    Trials trials(logs, options);
    const double real = as_it_stands.real_pole_pairs;
    const int below = static_cast<int>(std::floor(real));
    const bool down = real - below < 0.5;
    // Nearest first: two on either side.
    for (int k = 0; k < kNearest && !trials.found(); ++k)
        trials.of((k % 2 == 0) == down ? below - k / 2 : below + 1 + k / 2);
    for (int last = 0; trials.right() != last;) {
        last = trials.right();
        trials.of(last - 1), trials.of(last + 1);
    }
    if (!trials.clear()) return as_it_stands;
    TraceResult r = std::move(trials.best());
    r.notes.push_back("pole pairs found: " + std::to_string(trials.right()) +
                      ", the one whole number under which nothing of the log remains unexplained");
    return r;
}

}  // namespace dqw
