// As many passes over electrical logs as their effects need.
#ifndef DQW_APP_LEARN_PASSES_HPP
#define DQW_APP_LEARN_PASSES_HPP

#include <functional>
#include <vector>

#include "app/learn/parts.hpp"
#include "app/learn/signals.hpp"

namespace dqw {

/// Pairs in half a block of an electrical log: short enough for the angle with which an effect comes and goes.
std::uint16_t half_window_of(const std::vector<Log>& logs, const std::vector<TraceInput>& inputs, double pole_pairs);

/// Shows all rows of electrical logs to an estimator, and its blocks to whoever asked: `missing` at each gap, `take` a
/// sample, and whether it is held out, true where it learned; `now` the values then. Returns the samples held out.
template <class Missing, class Take, class Now>
std::uint32_t over_rows(const std::vector<Log>& logs, const LearnOptions& options,
                        const std::vector<TraceInput>& inputs, double pole_pairs, Missing missing, Take take, Now now)
{
    std::size_t done = 0;
    std::uint32_t heldout = 0;
    const std::size_t total = all_rows(logs);
    for (const Log& log : logs) {
        const SampleSource sample(log, pole_pairs, inputs);
        walk(log, done, total, options, missing, [&](std::size_t k, bool held) {
            // What is held out is not learned, but it heats.
            if (held && inputs.empty()) return;
            heldout += held ? 1U : 0U;
            if (take(sample(k), held) && options.block)
                options.block(log.t_s.empty() ? static_cast<double>(k) : log.t_s[k], now());
        });
    }
    return heldout;
}

/// Says of which rows a result is; returns what is asked of it.
Asked begin_result(const std::vector<Log>& logs, const LearnOptions& options, Result& result);

/// Of R, L_d, L_q, psi as learned. Without pole pairs they are those of one pair, and the residual needs no more.
PlainModel plain_model(std::uint16_t pole_pairs, const std::array<double, 4>& values);

/// One pass of some learners over the logs with everything decided: the inputs' shapes, the pole pairs and whether they
/// were given.
using Pass = std::function<Learned(const std::vector<Log>&, const LearnOptions&, const std::vector<TraceInput>&,
                                   double pole_pairs, bool p_given)>;
/// As many passes over electrical logs as their effects need, and the residual.
Learned learn_in_passes(const std::vector<Log>& logs, const LearnOptions& options, const Pass& pass);

}  // namespace dqw
#endif
