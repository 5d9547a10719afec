// Runs the float learners of lib/ over logs, as firmware would, sample by sample. No Ceres.
#ifndef DQW_APP_LEARN_LEARN_HPP
#define DQW_APP_LEARN_LEARN_HPP

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "ref/effect/found.hpp"
#include "ref/log/log.hpp"
#include "ref/log/residual.hpp"
#include "ref/log/result.hpp"

namespace dqw {

/// A value is known where its deviation is below this part of it.
constexpr double kKnownRatio = 0.25;

struct LearnOptions {
    std::vector<std::string> parameters;  ///< asked for; empty: the regime's default
    std::vector<TraceInput> inputs;       ///< effects to learn as well; what their shapes lack is taken from the logs
    Machine start;                        ///< where the logs' machine says nothing; pole pairs count as given
    const std::vector<char>* heldout_row = nullptr;  ///< one for each row of all logs: 1 where nothing may be learned
    std::function<void(double)> progress = {};       ///< called with 0..1 now and then
    bool fixed_point = false;                        ///< port_q15/ in place of lib/
    /// A dead time that nobody asked for and the logs show: what it makes of the values is in their deviations.
    bool allow_for_hidden_loss = false;
    /// Called after each block with its time and R, L_d, L_q, psi as they are then; of a mechanical log J and B.
    std::function<void(double, const std::array<double, 4>&)> block = {};
};

/// What the learners found.
struct Learned {
    Result result;                     ///< its residual has the effects in it
    std::vector<TraceEffect> effects;  ///< those that the logs determine; the others are in result.not_identifiable
    std::vector<TraceInput> inputs;    ///< as learned, shapes completed: what `LearnOptions::inputs` asked for
    PlainModel model;                  ///< every value, also of what is not identifiable
    std::array<double, 4> unit{};  ///< of R, L_d, L_q, psi, or J, B: what 1 stands for in fixed point; zero in float
};

/// One pass of the learners over all logs, one after the other, as if each followed a gap.
/// Bases come from the logs' largest signals; nominal values only start the weights.
/// Throws std::invalid_argument (one line) for logs of different regimes or periods, too few rows, an unknown
/// parameter, or effects that these logs or this build of the learners cannot have.
Learned learn_all(const std::vector<Log>& logs, const LearnOptions& options);

/// Of a dead time that was learned, V; 0: it is not told by three deviations.
double told_loss_V(const Learned& learned);
Result learn(const std::vector<Log>& logs, const LearnOptions& options = {});

}  // namespace dqw
#endif
