// What the rows of a log determine of each column of a fit with effects, and what they do not.
#ifndef DQW_REF_TRACE_DETERMINED_HPP
#define DQW_REF_TRACE_DETERMINED_HPP

#include "ref/fit/assess.hpp"
#include "ref/trace/setup.hpp"

namespace dqw {

/// Standard deviations of a point fitted to all rows, and a verdict on each parameter of the machine.
struct Determined {
    Eigen::VectorXd sd;            ///< of each column; infinite where the rows do not determine it
    std::vector<Assessment> base;  ///< partners: columns
    /// of the columns: the machine's parameters, then effects where they begin; else empty
    std::vector<std::string> names;

    /// Adds, squared, to the deviations of all columns.
    void widen(const Eigen::VectorXd& more);
    /// Whether a weight of the effect stands out: its deviation is below three tenths of it.
    bool knows(const Point& at, const std::string& effect) const;
};

/// (E47). As assess_excited() does, a parameter counts as determined only if the simulation alone (gains 0) determines
/// it too. Costs a pass.
Determined determined_of(const TraceSetup& setup, const Refined& refined);

}  // namespace dqw
#endif
