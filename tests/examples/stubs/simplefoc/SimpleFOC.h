// What examples/simplefoc takes from SimpleFOC, with its names, types and signatures.
#ifndef SIMPLEFOC_H
#define SIMPLEFOC_H

#include <Arduino.h>

#define NOT_SET -12345.0f
#define _NC ((int)NOT_SET)

struct DQ_s {
    float d;
    float q;
};
typedef DQ_s DQVoltage_s;
typedef DQ_s DQCurrent_s;

enum Direction : int8_t { CW = 1, CCW = -1, UNKNOWN = 0 };
enum MotionControlType : uint8_t { torque = 0x00, velocity = 0x01 };
enum TorqueControlType : uint8_t { voltage = 0x00, dc_current = 0x01, foc_current = 0x02 };
enum FOCModulationType : uint8_t { SinePWM = 0x00, SpaceVectorPWM = 0x01 };

class Sensor {
public:
    virtual float getVelocity();
};
struct MagneticSensorSPIConfig_s {
    int spi_mode;
};
extern MagneticSensorSPIConfig_s AS5048_SPI;
class MagneticSensorSPI : public Sensor {
public:
    MagneticSensorSPI(MagneticSensorSPIConfig_s config, int cs, long clock_speed = static_cast<long>(NOT_SET));
    void init();
};
class BLDCDriver {
public:
    virtual int init() = 0;
    float voltage_power_supply;
    float voltage_limit;
};
class BLDCDriver3PWM : public BLDCDriver {
public:
    BLDCDriver3PWM(int phA, int phB, int phC, int en1 = _NC, int en2 = _NC, int en3 = _NC);
    int init() override;
};
class CurrentSense {
public:
    virtual int init() = 0;
    void linkDriver(BLDCDriver *driver);
};
class LowsideCurrentSense : public CurrentSense {
public:
    LowsideCurrentSense(float shunt_resistor, float gain, int pinA, int pinB, int pinC = _NC);
    int init() override;
};
class LowPassFilter {
public:
    float Tf;
};
class FOCMotor {
public:
    int init();
    virtual int initFOC();
    virtual void loopFOC();
    virtual void move(float target = NOT_SET);
    void linkSensor(Sensor *sensor);
    void linkCurrentSense(CurrentSense *current_sense);
    float electrical_angle;
    DQVoltage_s voltage;
    DQCurrent_s current;
    FOCModulationType foc_modulation;
    TorqueControlType torque_controller;
    MotionControlType controller;
    LowPassFilter LPF_current_q, LPF_current_d;
    Direction sensor_direction;
};
class BLDCMotor : public FOCMotor {
public:
    explicit BLDCMotor(int pp, float R = NOT_SET, float KV = NOT_SET, float L_q = NOT_SET, float L_d = NOT_SET);
    void linkDriver(BLDCDriver *driver);
};

#endif
