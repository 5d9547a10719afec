// dqwatch beside moteus' control loop, an object for the servo to own. In fw/bldc_servo.cc:
//   Start()                     `watch_.Start(motor_, config_, rate_config_, ...)`
//   ISR_DoTimerLowerPriority()  behind ISR_DoControl(sin_cos, data): `watch_.Sample(sin_cos, status_, control_, ...)`
//   Poll()                      `watch_.Poll()`, from the main loop
#pragma once

#include <math.h>

#include "dqw.h"
#include <fw/bldc_servo_structs.h>
#include <fw/foc.h>

namespace moteus {

class DqwatchMoteus {
public:
    /// At start and where the motor's configuration has changed, with the PWM interrupt held back. `period_s` is
    /// RateConfig's; `bus_V` and `current_A` what the supply and the board give, `rotor_Hz` the fastest turn.
    enum dqw_status Start(const BldcServoMotor& motor, float period_s, float bus_V, float current_A, float rotor_Hz)
    {
        const dqw_nameplate plate = {period_s, bus_V * 0.57735027f, current_A, 6.2831853f * rotor_Hz,
                                     static_cast<uint16_t>(motor.poles / 2)};
        config_ = dqw_monitor_config_default(&plate);
        dqw_estimator_config& e = config_.estimator;
        e.R_ohm = motor.resistance_ohm;  // where to start: moteus' own calibration
        e.Ld_H = motor.inductance_d_H;
        e.Lq_H = motor.inductance_q_H;
        e.voltage_next = true;  // the timer loads the duties at its next update,
        e.voltage_held = true;  // turned by this sample's angle
        const enum dqw_status status = dqw_monitor_init(&monitor_, &config_);
        running_ = status == DQW_OK;
        return status;
    }

    /// Behind ISR_DoControl(). `output_sign` is motor_position_config()->output.sign, which moteus gives q with;
    /// `rotor_ratio` its rotor_to_output_ratio; `velocity` the position's, revolutions of the output a second.
    void Sample(const SinCos& sin_cos, const BldcServoStatus& status, const BldcServoControl_Control& control,
                float output_sign, float rotor_ratio, float velocity)
    {
        if (!running_) return;
        switch (status.mode) {
        case kVoltageDq:
        case kCurrent:
        case kPosition:
        case kZeroVelocity:
        case kStayWithinBounds: break;
        default: dqw_monitor_missing(&monitor_, 1); return;  // no voltage that the loop knows
        }
        dqw_sample s = {};
        s.v_d_V = control.d_V;
        s.v_q_V = output_sign * control.q_V;
        s.i_d_A = status.d_A;
        s.i_q_A = output_sign * status.q_A;
        s.w_m_rad_s = 6.2831853f * output_sign * velocity / rotor_ratio;
        s.cosine = sin_cos.c;
        s.sine = sin_cos.s;
        // A leg at its limit no longer gives what d_V, q_V ask for.
        const float low = fminf(control.pwm.a, fminf(control.pwm.b, control.pwm.c));
        const float high = fmaxf(control.pwm.a, fmaxf(control.pwm.b, control.pwm.c));
        (void)dqw_monitor_sample(&monitor_, &s, low < 0.02f || high > 0.98f);
    }

    /// Every millisecond. True: `change` says what.
    bool Poll(dqw_monitor_change* change)
    {
        return running_ && dqw_monitor_background(&monitor_) && dqw_monitor_event(&monitor_, change);
    }

    dqw_reading Read(enum dqw_monitor_channel channel) const { return dqw_monitor_read(&monitor_, channel); }

private:
    dqw_monitor_config config_ = {};
    dqw_monitor monitor_ = {};
    bool running_ = false;
};

}  // namespace moteus
