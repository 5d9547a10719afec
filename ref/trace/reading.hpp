// Other ways to read a record than its columns say: signs turned, columns exchanged, rows apart.
#ifndef DQW_REF_TRACE_READING_HPP
#define DQW_REF_TRACE_READING_HPP

#include <optional>

#include "ref/trace/setup.hpp"

namespace dqw {

/// A reading under which the plain model, fitted anew, makes more sense of the log.
struct Reading {
    enum class Kind { as_is, signs, rows, filter } kind = Kind::as_is;
    std::string how;          ///< "with the signs of v_d and i_d turned"
    bool previous = false;    ///< each voltage is that of the period before its row
    double part = 1.0;        ///< of the block residual that the log as it is leaves
    double t = 0.0;           ///< of the stretches' log ratios, (E45)
    double pole_pairs = 0.0;  ///< as they come out, where nobody gave them; else 0
    int rows_before = 0;      ///< that each voltage is taken from
};

/// (E122). All signs and exchanges of columns, rows up to three apart, and filters of the currents, each by one least
/// squares of the block residual; the best that makes physical sense and that is no chance. Dynamic and steady logs;
/// else nothing.
std::optional<Reading> other_reading(const TraceSetup& setup);

/// Whether columns are turned or exchanged beyond what an effect of the catalogue makes of a log, or the speed is not
/// the angle's: no law then has what it needs.
bool is_misread(const TraceSetup& setup);

}  // namespace dqw
#endif
