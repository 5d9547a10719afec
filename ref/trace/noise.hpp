// What of a residual is noise: told from structure by what the channels know of each other.
#ifndef DQW_REF_TRACE_NOISE_HPP
#define DQW_REF_TRACE_NOISE_HPP

#include "ref/trace/setup.hpp"

namespace dqw {

struct Noise {
    double floor = 0.0;     ///< (E46): block RMS that the sensors' noise alone would leave, all axes together
    double raw = 0.0;       ///< the same, if all that single rows show at its scale were noise; settled: of the rows
    double followed = 0.0;  ///< (E123): part of the single rows' residual that the rows before foretell; 0: white

    /// Without what noise of few settled rows does to the fit, and so to all others.
    double of_rows() const { return raw < floor ? raw : floor; }
};

/// Dynamic and mechanical: the single rows' residual in the upper half band, where slow structure is not, told apart
/// into noise of the state's sensor (differenced) and of the input (white), with the speed sensor's own noise beside
/// them; of dynamic logs without what rows before foretell, where that is beyond kFollowed.
/// Settled: second differences of rows that follow one another, or planes through like ones, and what such noise of the
/// rows seen adds to those held out.
Noise noise_of(const TraceSetup& setup, const Point& at);

/// Why what single rows show cannot be noise, where blocks leave `rms`; empty where it may be.
std::string doubt_of(const Noise& noise, double rms);

}  // namespace dqw
#endif
