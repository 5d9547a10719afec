// Is the speed in rad/s, as it should be, or in rpm? Judged by physics, not by the size of the numbers where that can
// be.
#ifndef DQW_APP_READ_SPEED_UNIT_HPP
#define DQW_APP_READ_SPEED_UNIT_HPP

#include <optional>
#include <string>

#include "app/read/voltage_fit.hpp"
#include "ref/log/log.hpp"

namespace dqw {

/// The evidence that w_m is in rpm, for a warning; nothing where it is in rad/s or cannot be told.
///
/// In order, the first that can tell decides: the angle's own speed; torque times speed against electrical power; pole
/// pairs as L on w over L on di/dt; the induced voltage, or the inertia, against the machine file's nominal values.
/// Failing all, a speed above 2000 rad/s (19 100 rpm).
std::optional<std::string> evidence_of_rpm(const SpeedProbe& probe, const Machine& machine);

}  // namespace dqw
#endif
