// What examples/moteus takes from moteus' fw/bldc_servo_structs.h: names, types and values as there.
#pragma once

#include <stdint.h>

namespace moteus {

struct Vec3 {
    float a = 0.0f;
    float b = 0.0f;
    float c = 0.0f;
};

enum BldcServoMode {
    kStopped = 0,
    kFault = 1,
    kEnabling = 2,
    kCalibrating = 3,
    kCalibrationComplete = 4,
    kPwm = 5,
    kVoltage = 6,
    kVoltageFoc = 7,
    kVoltageDq = 8,
    kCurrent = 9,
    kPosition = 10,
    kPositionTimeout = 11,
    kZeroVelocity = 12,
    kStayWithinBounds = 13,
    kMeasureInductance = 14,
    kBrake = 15,
    kNumModes,
};

struct BldcServoStatus {
    BldcServoMode mode = kStopped;
    float d_A = 0.0f;
    float q_A = 0.0f;
};

struct BldcServoControl_Control {
    Vec3 pwm;
    float d_V = 0.0f;
    float q_V = 0.0f;
};

struct BldcServoMotor {
    uint8_t poles = 0;
    float resistance_ohm = 0.0f;
    float inductance_d_H = 0.0f;
    float inductance_q_H = 0.0f;
};

}  // namespace moteus
