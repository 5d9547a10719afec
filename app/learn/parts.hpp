// What the electrical and the mechanical learners share.
#ifndef DQW_APP_LEARN_PARTS_HPP
#define DQW_APP_LEARN_PARTS_HPP

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "app/base/effect_names.hpp"
#include "app/learn/learn.hpp"
#include "app/q15/fixed_point.hpp"
#include "dqw.h"
#include "dqw_estimator_q15.h"
#include "dqw_number.h"
#include "ref/log/wanted.hpp"

namespace dqw {

struct Asked {
    const std::vector<std::string>& names;
    std::vector<std::string> defaults;
    bool operator()(const char* name) const
    {
        const auto& list = names.empty() ? defaults : names;
        return std::find(list.begin(), list.end(), name) != list.end();
    }
};

std::size_t all_rows(const std::vector<Log>& logs);

/// Least part of its base that an input teaches from.
constexpr double kExcitation_pu = 0.002;

/// Runs over the same logs, each from what the one before knows: the most of them.
constexpr int kMostRuns = 4;
/// Statistics of the residual from the run before count as so many blocks: above the fifty after which the estimators
/// believe them.
constexpr std::uint16_t kBlocksCarried = 60;
/// How far a dt/L may be off, either way, with which a run began: else its noise and its pairs were weighed wrongly.
constexpr double kStepRatio = 1.25;

/// Did a run begin with the dt/L of both axes and the pole pairs that it ended with?
template <class Step>
bool runs_agree(const Step (&began)[2], double began_poles, const Step (&ended)[2], double ended_poles)
{
    if (began_poles != ended_poles) return false;
    for (int axis = 0; axis < 2; ++axis) {
        const double a = static_cast<double>(began[axis]), b = static_cast<double>(ended[axis]);
        if (a > kStepRatio * b || b > kStepRatio * a) return false;
    }
    return true;
}

/// The options of run n of several: progress is told as a part of them all, blocks of the first run that learns; that
/// it was heard is kept in `heard`.
LearnOptions options_of_run(const LearnOptions& options, int n, bool& heard);
/// The options of a run that tells nothing.
LearnOptions quiet(LearnOptions options);

/// Pairs in half a block.
std::uint16_t half_window(double span_s, double dt_s, int least);

/// A nominal value to start from: the machine file's, else the options', else 0.
float nominal(const Machine& machine, const Machine& start, std::optional<double> Machine::*value);

/// Notes what the gate kept out; `heldout` samples were refused on purpose.
void note_gate(const dqw_gate& gate, std::uint32_t heldout, Result& result);

/// The inputs for lib/, in their order.
std::vector<dqw_effect_config> lists_of(const std::vector<TraceInput>& inputs);
/// Throws std::invalid_argument where their weights are more than this build of lib/ has room for. In float dead time
/// needs none.
void check_room(const std::vector<TraceInput>& inputs);

/// A value as it was read, SI; an infinite sd: it was never learned.
struct Read {
    double value = 0.0, sd = INFINITY;
    /// Known where the deviation is below a quarter of the value: what a report may still name.
    bool known() const { return value > 0.0 && sd < kKnownRatio * value; }
};
inline Read read_of(float value, float sd, double unit = 1.0)
{
    return {static_cast<double>(value) * unit, sd < DQW_UNKNOWN ? static_cast<double>(sd) * unit : INFINITY};
}
inline Read read_of(std::int64_t value_q40, std::int64_t sd_q40, double unit)
{
    return {si(value_q40, unit), sd_q40 == INT64_MAX ? INFINITY : si(sd_q40, unit)};
}
inline Read read_of(const dqw_reading& r) { return read_of(r.value, r.sd); }
inline Read read_of(const dqw_reading_q15& r, double unit) { return read_of(r.value_q40, r.sd_q40, unit); }

/// What was read of one input: the learned weights, their deviations, and a bit for each that is known.
struct InputRead {
    TraceInput input;
    std::vector<double> sd;
    std::uint32_t known = 0;
};
/// From the port's own numbers, of which 1 stands for `unit`; a bit of `known` for each.
template <class Number>
InputRead input_read(const TraceInput& input, int known, const Number* weights, const Number* sd, double unit)
{
    InputRead out{input, {}, static_cast<std::uint32_t>(known)};
    out.input.weights.clear();
    for (int i = 0; i < dqw_effect_weights(*effect_named(input.effect)); ++i) {
        const Read r = read_of(weights[i], sd[i], unit);
        out.input.weights.push_back(r.value);
        out.sd.push_back(r.sd);
    }
    return out;
}

/// Fills `effects` and `inputs` of `learned`; an effect of which no weight is known goes to not_identifiable. Inputs of
/// one name are one effect.
void put_effects(const std::vector<InputRead>& read, Learned& learned);

/// Calls step(row, heldout) for all rows of a log, and gap() before each segment and at both ends of what is held out.
template <class Gap, class Step>
void walk(const Log& log, std::size_t& done, std::size_t total, const LearnOptions& options, Gap gap, Step step)
{
    constexpr std::size_t kProgressRows = 65536;
    std::size_t next_segment = 0;
    bool was_heldout = false;
    const std::size_t rows = log.rows();
    for (std::size_t k = 0; k < rows; k++) {
        const bool heldout = options.heldout_row != nullptr && (*options.heldout_row)[done] != 0;
        bool jump = heldout != was_heldout;
        if (next_segment < log.segments.size() && k == log.segments[next_segment]) {
            jump = true;
            next_segment++;
        }
        if (jump) gap();
        was_heldout = heldout;
        step(k, heldout);
        done++;
        ask_at(done);
        if (options.progress && done % kProgressRows == 0)
            options.progress(static_cast<double>(done) / static_cast<double>(total));
    }
}

}  // namespace dqw
#endif
