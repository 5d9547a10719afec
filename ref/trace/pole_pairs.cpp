#include "ref/trace/pole_pairs.hpp"

#include <cmath>
#include <map>
#include <optional>

namespace dqw {
namespace {

// Of a model that lacks something the real ones were off by up to 1.5; each number costs a trace.
constexpr int kNearest = 4;

bool tells_all(const TraceResult& r) { return r.verdict == "clean" || r.verdict == "explained"; }

}  // namespace

TraceResult under_whole_pole_pairs(const std::vector<Log>& logs, const TraceOptions& options, TraceResult as_it_stands)
{
    if (tells_all(as_it_stands)) return as_it_stands;
    std::map<int, std::optional<TraceResult>> tried;
    int right = 0, count = 0;
    const auto trial = [&](int p) {
        if (p < 1 || tried.count(p) > 0) return;
        TraceOptions with = options;
        with.pole_pairs = p;
        TraceResult r = trace(logs, with);
        const bool told = tells_all(r);
        if (told) right = p, ++count;
        tried[p] = told ? std::optional<TraceResult>(std::move(r)) : std::nullopt;
    };
    const double real = as_it_stands.real_pole_pairs;
    const int below = static_cast<int>(std::floor(real));
    // Nearest first: two on either side.
    const bool down = real - below < 0.5;
    for (int k = 0; k < kNearest && count == 0; ++k) {
        const int away = k / 2;
        trial((k % 2 == 0) == down ? below - away : below + 1 + away);
    }
    if (count == 1) {
        const int found = right;
        trial(found - 1), trial(found + 1), right = found;
    }
    if (count != 1) return as_it_stands;
    TraceResult r = std::move(*tried[right]);
    r.notes.push_back("pole pairs found: " + std::to_string(right) +
                      ", the one whole number under which nothing of the log remains unexplained");
    return r;
}

}  // namespace dqw
