// The paper's experiments, repeated: what `dqwatch paper` prints, as numbers.
#ifndef DQW_APP_PAPER_EXPERIMENT_HPP
#define DQW_APP_PAPER_EXPERIMENT_HPP

#include <array>
#include <cstddef>
#include <vector>

#include "app/paper/data.hpp"
#include "app/paper/figures.hpp"

namespace dqw {

constexpr int kPaperSeeds = 20;
constexpr int kPaperDraws = 50;                    ///< (section 4.2) samples drawn in an epoch, ...
constexpr int kPaperIterations = 250;              ///< ... in 5 epochs
constexpr std::size_t kPaperOrdinalSamples = 100;  ///< (section 5.1)

/// Largest errors over rows or seeds, percent; both axes together.
struct Worst {
    double noise_percent = 0, L = 0, p = 0, psi = 0;
};

/// The Ordinal Learner at one noise level. Values of the first seed in ohm; worst errors and mean biases of all,
/// percent.
struct OrdinalRow {
    double noise_percent = 0;
    std::size_t samples = 0;
    double R = 0;                                ///< mean of both axes' readings from the weight of x
    std::array<double, 4> reading{};             ///< d from x, d from z^-1 y, q from x, q from z^-1 y
    double worst = 0, worst_x = 0, worst_z = 0;  ///< of R; of the readings from x; of those from z^-1 y
    std::array<double, 4> pair_bias{};           ///< plain regression on measured pairs, mean error, as `reading`
};

struct PaperResults {
    PaperMachine machine{};
    std::size_t samples = 0;
    std::vector<Table1Row> table1;  ///< one for each row of kPaperTable1
    std::array<Worst, 3> paper_worst{}, our_worst{};
    std::array<OrdinalRow, 3> ordinal{};
    double backward_R_ohm = 0;  ///< the noise-free weights read with the backward difference
    /// Iterations after which every weight stays within 1 % of its end: Figs 6 to 9.
    std::array<int, 4> settled{};
    std::size_t ordinal_iterations = 0;  ///< samples shown until converged
    double whole_over_subset_iterations = 0, whole_over_subset_time = 0;
    std::vector<Figure> figures;
};

/// Runs everything. Deterministic but for the ratio of times.
PaperResults paper_results();

}  // namespace dqw
#endif
