// dqwatch beside SimpleFOC: learns the motor's parameters and names faults while it runs. The loop must have a fixed
// period, so it is called by a timer; this one is STM32's.
#include <SimpleFOC.h>
#include <dqw.h>

static const float PERIOD_S = 200e-6f;
static const int PAIRS = 7;

BLDCMotor motor(PAIRS);
BLDCDriver3PWM driver(PA8, PA9, PA10, PB12);
LowsideCurrentSense sense(0.003f, 20.0f, PA0, PA1);
MagneticSensorSPI sensor(AS5048_SPI, PA4);
HardwareTimer timer(TIM3);

static dqw_monitor monitor;
static dqw_monitor_config config;

static void period()
{
    motor.loopFOC();
    // From here on loopFOC()'s voltage acts, turned by the angle of the currents that it has read.
    const float v = sqrtf(motor.voltage.d * motor.voltage.d + motor.voltage.q * motor.voltage.q);
    const dqw_sample s = dqw_sample_from_dq(motor.voltage.d, motor.voltage.q, motor.current.d, motor.current.q,
                                            (float)motor.sensor_direction * sensor.getVelocity(), motor.electrical_angle);
    (void)dqw_monitor_sample(&monitor, &s, v > 0.97f * driver.voltage_limit * 0.57735027f);
}

void setup()
{
    Serial.begin(115200);
    sensor.init();
    motor.linkSensor(&sensor);
    driver.voltage_power_supply = 24;
    driver.init();
    motor.linkDriver(&driver);
    sense.linkDriver(&driver);
    sense.init();
    motor.linkCurrentSense(&sense);
    motor.torque_controller = TorqueControlType::foc_current;
    motor.foc_modulation = FOCModulationType::SpaceVectorPWM;
    motor.controller = MotionControlType::torque;
    motor.LPF_current_d.Tf = 0; // currents as they were sampled: a filter would read as inductance
    motor.LPF_current_q.Tf = 0;
    motor.init();
    motor.initFOC();

    // Phase voltage and current, peak; the highest mechanical speed.
    const dqw_nameplate plate = {PERIOD_S, driver.voltage_power_supply * 0.577f, 10.0f, 200.0f, PAIRS};
    config = dqw_monitor_config_default(&plate);
    config.estimator.voltage_held = true; // the duties act at once, as a vector that the inverter holds
    const enum dqw_status status = dqw_monitor_init(&monitor, &config);
    if (status != DQW_OK) {
        Serial.println(dqw_status_text(status));
        return;
    }
    timer.setOverflow(5000, HERTZ_FORMAT);
    timer.attachInterrupt(period);
    timer.resume();
}

void loop()
{
    motor.move(0.5f);
    dqw_monitor_change change;
    if (dqw_monitor_background(&monitor) && dqw_monitor_event(&monitor, &change))
        Serial.println(dqw_fault_text(change.fault.name));
}
