// Polled logs look by look: by how much each parameter of a stretch differs from what the log's head gave.
#ifndef DQW_REF_FIT_POLLED_LOOKS_HPP
#define DQW_REF_FIT_POLLED_LOOKS_HPP

#include <array>
#include <vector>

#include "ref/log/log.hpp"

namespace dqw {

/// R, L_d, L_q, psi, in SI.
constexpr std::size_t kLooked = 4;

/// Deviations: `sd` is a look's own, `lasting` may be the same in all looks.
struct PolledLook {
    double from_s = 0.0, to_s = 0.0;
    double rows = 0.0;            ///< that it is worth
    double i_A = 0.0, v_V = 0.0;  ///< RMS current and voltage
    double worse = 1.0;           ///< mean square that it leaves, over the head's
    std::array<double, kLooked> change{}, sd{}, lasting{};
};

struct PolledLooks {
    std::array<bool, kLooked> known{};  ///< told by the head: L_d is not where it was taken to be L_q
    std::array<double, kLooked> head{}, head_sd{};
    std::vector<PolledLook> looks;
    double head_V = 0.0;           ///< residual of the head, RMS of an axis
    bool holds_dead_time = false;  ///< R holds what an inverter loses
    bool follows = false;          ///< (E153): current follows speed, neither R nor psi is known
};

/// A log that is polled, or settled points with time, in stretches of at least `least_s` and of 30 rows worth; what is
/// left over is the last one's. What all looks are judged by comes from the log's first `head_s` alone.
///
/// Source   (E156) in docs/EQUATIONS.md
/// Throws   std::invalid_argument where the head's rows are too few, or of one kind
PolledLooks polled_looks(const Log& log, double least_s, double head_s);

}  // namespace dqw
#endif
