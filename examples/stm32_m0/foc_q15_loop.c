// dqwatch in a loop on STM32's HAL, on a Cortex-M0 in whole numbers. Timer 1 makes centred PWM and triggers the ADC at
// its update, the ADC's DMA fills adc_counts; the loop of your own is current_loop(). Compile port_q15/ and of lib/
// what docs/INTEGRATION.md names, with -DDQW_EFFECT_WEIGHTS=0 -ffunction-sections and --gc-sections.
#include <stm32f0xx_hal.h>

#include "dqw_monitor_q15.h"
#include "dqw_text.h"
#include "foc_q15_loop.h"

extern ADC_HandleTypeDef hadc;
extern TIM_HandleTypeDef htim1;
extern UART_HandleTypeDef huart1;

// 4 kHz and blocks of 50 periods: what a core of 48 MHz has the time for (docs/INTEGRATION.md).
// What 32768 stands for: the board's full scales, which nothing reaches in operation.
enum { V_FULL_mV = 24000, I_FULL_mA = 20000, W_FULL_mrad_s = 600000, PERIOD_ns = 250000, PAIRS = 4 };

static volatile uint16_t adc_counts[3];  // phases a and b, centred on 2048; the link, 4095 = V_FULL_mV
static dqw_monitor_q15 monitor;
static dqw_monitor_q15_config config;

static int16_t bounded(int32_t x) { return (int16_t)(x > 32767 ? 32767 : x < -32767 ? -32767 : x); }

// The HAL calls it when the DMA has both currents and the link: once a period.
void HAL_ADC_ConvCpltCallback(ADC_HandleTypeDef *adc)
{
    if (adc != &hadc) return;
    foc_q15 now;
    const int32_t a = ((int32_t)adc_counts[0] - 2048) * 16, b = ((int32_t)adc_counts[1] - 2048) * 16;
    now.i_alpha_q15 = bounded(a);
    now.i_beta_q15 = bounded((a + 2 * b) * 18919 / 32768);  // over the root of 3
    now.link_q15 = bounded((int32_t)adc_counts[2] * 8);
    current_loop(&now);  // your FOC: angle, speed, and from them the voltage that it decides
    const uint32_t top = __HAL_TIM_GET_AUTORELOAD(&htim1);
    __HAL_TIM_SET_COMPARE(&htim1, TIM_CHANNEL_1, (top * now.duty_q15[0]) >> 15);
    __HAL_TIM_SET_COMPARE(&htim1, TIM_CHANNEL_2, (top * now.duty_q15[1]) >> 15);
    __HAL_TIM_SET_COMPARE(&htim1, TIM_CHANNEL_3, (top * now.duty_q15[2]) >> 15);

    const dqw_sample_q15 s = dqw_sample_from_alphabeta_q15(now.v_alpha_q15, now.v_beta_q15, now.i_alpha_q15,
                                                           now.i_beta_q15, now.w_m_q15, now.cosine_q15, now.sine_q15);
    (void)dqw_monitor_sample_q15(&monitor, &s, now.limited);
}

static void say(const char *text)
{
    uint16_t length = 0;
    while (text[length] != 0) length++;
    (void)HAL_UART_Transmit(&huart1, (const uint8_t *)text, length, 100);
    (void)HAL_UART_Transmit(&huart1, (const uint8_t *)"\r\n", 2, 100);
}

// In main(), before the timer starts.
bool foc_q15_start(void)
{
    const dqw_nameplate_q15 plate = {PERIOD_ns, V_FULL_mV, I_FULL_mA, W_FULL_mrad_s, PAIRS};
    config = dqw_monitor_config_default_q15(&plate);
    // As the signals are scaled, not half as much again.
    config.estimator.scale = (dqw_scale){V_FULL_mV, I_FULL_mA, W_FULL_mrad_s, PERIOD_ns, PAIRS};
    // The background takes milliseconds a block on this core, so long a block must last. Ripples of phases and sensors
    // are then watched below 24 rad/s alone.
    config.estimator.half_window = 50;
    config.estimator.voltage_next = true;  // the preloaded compare registers act from the next update on
    config.estimator.voltage_held = true;  // as a vector that the inverter holds
    const enum dqw_status status = dqw_monitor_init_q15(&monitor, &config);
    if (status != DQW_OK) say(dqw_status_text(status));
    return status == DQW_OK && HAL_ADC_Start_DMA(&hadc, (uint32_t *)adc_counts, 3) == HAL_OK;
}

// In main()'s loop.
void foc_q15_background(void)
{
    dqw_monitor_change_q15 change;
    if (!dqw_monitor_background_q15(&monitor) || !dqw_monitor_event_q15(&monitor, &change)) return;
    say(dqw_fault_text(change.fault.name));
}
