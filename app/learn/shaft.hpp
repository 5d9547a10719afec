// What the mechanical learners share in float and fixed point: the signals of the logs, and what is said of what was
// learned.
#ifndef DQW_APP_LEARN_SHAFT_HPP
#define DQW_APP_LEARN_SHAFT_HPP

#include <cstdint>
#include <string>
#include <vector>

#include "app/learn/parts.hpp"
#include "dqw_gate.h"

namespace dqw {

/// What the learners are shown of mechanical logs.
struct ShaftLogs {
    std::vector<TraceInput> inputs;            ///< effects, their shapes completed
    std::vector<std::vector<double>> torques;  ///< Nm, one list a log
    std::string source;                        ///< where they are from
    double torque_constant_Nm_A = 0.0;         ///< as the machine file says; else 0
    double largest_torque_Nm = 0.0;            ///< 1 where there is none: a base only must not divide by zero
    double largest_w_rad_s = 0.0;              ///< the same
    std::uint16_t half_window = 0;             ///< pairs
};

/// Throws std::invalid_argument for effects that these logs or this build of the learners cannot have.
ShaftLogs shaft_logs(const std::vector<Log>& logs, const LearnOptions& options);

/// A value as it was read; an infinite sd: it was never learned.
struct ShaftValue {
    double value = 0.0, sd = 0.0;
    bool known = false;
};

/// What was learned of a shaft.
struct ShaftRead {
    ShaftValue J_kgm2, B_Nms_rad, torque_constant_Nm_A;
    std::vector<InputRead> inputs;  ///< in the order of ShaftLogs::inputs
};

/// Fills all of `learned` but its unit.
void report_shaft(const std::vector<Log>& logs, const LearnOptions& options, const ShaftLogs& shaft,
                  const ShaftRead& read, const dqw_gate& gate, Learned& learned);

}  // namespace dqw
#endif
