// What examples/simplefoc takes from STM32's Arduino core.
#ifndef ARDUINO_H
#define ARDUINO_H

#include <math.h>
#include <stdint.h>

struct Print {
    void begin(unsigned long baud);
    void println(const char *text);
};
extern Print Serial;
enum { PA0, PA1, PA4, PA8, PA9, PA10, PB12 };
struct TIM_TypeDef;
extern TIM_TypeDef *const TIM3;
enum TimerFormat_t { TICK_FORMAT, MICROSEC_FORMAT, HERTZ_FORMAT };
typedef void (*callback_function_t)();
class HardwareTimer {
public:
    explicit HardwareTimer(TIM_TypeDef *instance);
    void setOverflow(uint32_t value, TimerFormat_t format = TICK_FORMAT);
    void attachInterrupt(callback_function_t callback);
    void resume();
};
void setup();
void loop();

#endif
