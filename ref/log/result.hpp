// What a fit or a learner reports: the data behind the schema dqwatch.parameters/1.
#ifndef DQW_REF_LOG_RESULT_HPP
#define DQW_REF_LOG_RESULT_HPP

#include <cstddef>
#include <string>
#include <vector>

#include "ref/log/log.hpp"

namespace dqw {

/// A parameter, named as in the schema: R_ohm Ld_H Lq_H psi_Wb pole_pairs J_kgm2 B_Nms_rad torque_constant_Nm_A.
struct Estimate {
    std::string name;
    double value = 0.0;
    double sd = 0.0;
    bool given = false;             ///< said by the user, not estimated; sd is then meaningless
    bool times_pole_pairs = false;  ///< its product with the pole pairs, which are not known
    bool observed = false;          ///< an observer's angle does not tell it
};

/// Why an estimate of the machine is not usable; empty where it is known, of the right sign, and three deviations are
/// below a tenth of it.
std::string why_not_usable(const Estimate& estimate);

/// Why an observer's angle does not tell a parameter, its inductance along q; empty where it does, or the angle is an
/// encoder's. And what would.
///
/// Source   (E106) in docs/EQUATIONS.md
std::string why_observed(bool observed, const std::string& name);
constexpr const char* kForObserved = "an encoder's angle";

/// A parameter that the log cannot determine. It has no value.
struct NotIdentifiable {
    std::string name;
    std::string why;         ///< the cause in this log, with figures where they help
    std::string excitation;  ///< what the next log should contain
};

/// Block residual of one axis ("d", "q" or "torque"), as the design defines it.
struct AxisResidual {
    std::string axis;
    double rms = 0.0;      ///< V or Nm
    double percent = 0.0;  ///< of the RMS of that axis' voltage (torque)
};

struct Result {
    std::size_t rows = 0;
    Regime regime = Regime::dynamic;
    std::vector<Estimate> parameters;
    std::vector<Estimate> dead_time;  ///< voltage_V, where a polled log tells it from R
    std::vector<NotIdentifiable> not_identifiable;
    double real_pole_pairs = 0.0;  ///< as fitted, where no whole number stands out; 0: not fitted
    double residual_rms = 0.0;     ///< over all blocks and axes
    std::string residual_unit = "V";
    std::vector<AxisResidual> axes;
    std::vector<std::string> notes;  ///< one line each: gaps, skipped rows, what was assumed
};

}  // namespace dqw
#endif
