// The paper's experiment as data: taps of a simulated axis, and what the paper printed.
#ifndef DQW_APP_PAPER_DATA_HPP
#define DQW_APP_PAPER_DATA_HPP

#include <cstdint>
#include <vector>

namespace dqw {

/// Signals of one axis of Fig. 3, 301 samples each. Inputs and targets of the Random Learners in the order of dqw_tap;
/// x_V, y_A drive the Ordinal Learner: mean voltage across R and L to the next sample, and current.
struct Axis {
    std::vector<std::vector<double>> input, target;
    std::vector<double> x_V, y_A;
};

struct PaperMachine {
    double R_ohm, L_H, pole_pairs, psi_Wb, dt_s;
};

struct PaperData {
    PaperMachine machine;
    Axis d, q;
};

/// Runs the scenario paper_step, without noise, and taps it.
PaperData paper_data();

/// White noise of `fraction` times each signal's RMS, on every input and every target, independent.
Axis with_noise(const Axis& clean, double fraction, std::uint64_t seed);

double rms(const std::vector<double>& x);

/// One row of Table 1. p_q: as the paper's q-axis column; psi from the row's own columns (the printed one is ten times
/// that).
struct Table1Row {
    double noise_percent, Ld_mH, Lq_mH, p_d, p_q, flux_weight, psi_Wb;
};
extern const std::vector<Table1Row> kPaperTable1;

}  // namespace dqw
#endif
