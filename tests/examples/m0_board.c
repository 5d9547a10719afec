// examples/stm32_m0 on a Cortex-M0 under QEMU, at a simulated motor: what the interrupt and a block of the
// background take there, and whether it has learned. Its file is included, so that its monitor can be read.
#include "examples/stm32_m0/foc_q15_loop.c"
#include "tests/target/count.h"
#include "tests/target/say.h"

enum { ROWS = 36000 };
static const float R_OHM = 0.5f, LD_H = 1.0e-3f, LQ_H = 1.4e-3f, PSI_WB = 0.02f;

static struct {
    float i_d_A, i_q_A, w_m_rad_s, theta_e_rad;
    uint32_t dice;
} m = {.dice = 1u};

static TIM_TypeDef timer = {.ARR = 3000};
TIM_HandleTypeDef htim1 = {&timer};
ADC_HandleTypeDef hadc;
UART_HandleTypeDef huart1;
static volatile uint16_t *dma;
static float next_d_V, next_q_V;  // decided in this period, acting in the next

HAL_StatusTypeDef HAL_ADC_Start_DMA(ADC_HandleTypeDef *adc, uint32_t *data, uint32_t length)
{
    (void)adc;
    (void)length;
    dma = (volatile uint16_t *)data;
    return HAL_OK;
}

HAL_StatusTypeDef HAL_UART_Transmit(UART_HandleTypeDef *uart, const uint8_t *data, uint16_t size, uint32_t timeout)
{
    (void)uart;
    (void)timeout;
    if (size > 2) say_text((const char *)data);
    return HAL_OK;
}

// A sine and cosine of any angle, to 1e-6: no C library here.
static void turn(float angle, float *c, float *s)
{
    const float half = angle / 64.0f, square = half * half;
    float cosine = 1.0f - square * (0.5f - square / 24.0f),
          sine = half * (1.0f - square * (1.0f / 6.0f - square / 120.0f));
    for (int i = 0; i < 6; i++) {
        const float doubled = 2.0f * sine * cosine;
        cosine = cosine * cosine - sine * sine;
        sine = doubled;
    }
    *c = cosine;
    *s = sine;
}

static int16_t part(float x, float full) { return (int16_t)(x / full * 32768.0f); }

static foc_q15 decided;

void current_loop(foc_q15 *now)
{
    decided.i_alpha_q15 = now->i_alpha_q15;
    decided.i_beta_q15 = now->i_beta_q15;
    decided.link_q15 = now->link_q15;
    *now = decided;
}

// The loop's work, outside of what is counted: angle, speed, every 25 periods a coin on each axis.
static void decide(int k)
{
    float c, s;
    turn(m.theta_e_rad, &c, &s);
    if (k % 25 == 0) m.dice = m.dice * 1664525u + 1013904223u;
    next_d_V = (m.dice >> 30) & 1u ? 0.0f : -4.0f;
    next_q_V = (float)PAIRS * m.w_m_rad_s * PSI_WB + ((m.dice >> 31) & 1u ? 4.0f : 0.0f);
    decided = (foc_q15){.cosine_q15 = part(c, 1.0001f),
                        .sine_q15 = part(s, 1.0001f),
                        .w_m_q15 = part(m.w_m_rad_s, 600.0f),
                        .v_alpha_q15 = part(c * next_d_V - s * next_q_V, 24.0f),
                        .v_beta_q15 = part(s * next_d_V + c * next_q_V, 24.0f),
                        .duty_q15 = {16384, 16384, 16384}};
}

int main(void)
{
    if (!foc_q15_start()) return 1;
    uint32_t interrupt = 0, block = 0, blocks = 0;
    uint64_t sum = 0;
    float alpha_V = 0.0f, beta_V = 0.0f;
    for (int k = 0; k < ROWS; k++) {
        float c, s;
        turn(m.theta_e_rad, &c, &s);
        const float i_alpha = c * m.i_d_A - s * m.i_q_A, i_beta = s * m.i_d_A + c * m.i_q_A;
        const float i_b = -0.5f * i_alpha + 0.8660254f * i_beta;
        dma[0] = (uint16_t)(2048.5f + i_alpha * (2048.0f / 20.0f));
        dma[1] = (uint16_t)(2048.5f + i_b * (2048.0f / 20.0f));
        dma[2] = 4095;
        m.w_m_rad_s = k / 4000 % 2 ? 12.0f : 20.0f;
        decide(k);
        count_start();
        HAL_ADC_ConvCpltCallback(&hadc);
        const uint32_t took = count_stop();
        if (took > interrupt) interrupt = took;
        count_start();
        foc_q15_background();
        const uint32_t spent = count_stop();
        if (spent > 2000) {
            blocks++;
            sum += spent;
            if (spent > block) block = spent;
        }
        // The voltage of the period before, held still while the rotor turns: twenty steps of the motor.
        const float w_e = (float)PAIRS * m.w_m_rad_s, step_s = (float)PERIOD_ns * 1e-9f / 20.0f;
        for (int n = 0; n < 20; n++) {
            turn(m.theta_e_rad, &c, &s);
            const float v_d = c * alpha_V + s * beta_V, v_q = c * beta_V - s * alpha_V;
            const float d = (v_d - R_OHM * m.i_d_A + w_e * LQ_H * m.i_q_A) / LD_H;
            const float q = (v_q - R_OHM * m.i_q_A - w_e * (LD_H * m.i_d_A + PSI_WB)) / LQ_H;
            m.i_d_A += step_s * d;
            m.i_q_A += step_s * q;
            m.theta_e_rad += w_e * step_s;
            if (m.theta_e_rad > 6.2831853f) m.theta_e_rad -= 6.2831853f;
        }
        float c0, s0;
        turn(m.theta_e_rad - w_e * (float)PERIOD_ns * 1e-9f, &c0, &s0);
        alpha_V = c0 * next_d_V - s0 * next_q_V;
        beta_V = s0 * next_d_V + c0 * next_q_V;
    }
    say_value("interrupt_worst", interrupt);
    say_value("blocks", blocks);
    say_value("block_mean", blocks ? (uint32_t)(sum / blocks) : 0u);
    say_value("block_worst", block);
    static const uint32_t truth[] = {500000u, 1000000u, 1400000u, 20000000u};
    for (int i = 0; i < 4; i++) {
        const dqw_reading_q15 r = dqw_monitor_read_q15(&monitor, (enum dqw_monitor_channel)i);
        const uint32_t unit = dqw_estimator_unit_q15(&config.estimator, (enum dqw_parameter)i);
        const float ratio = (float)r.value_q40 / 1099511627776.0f * (float)unit / (float)truth[i];
        say_value(r.usable ? "usable_permille" : "not_usable", (uint32_t)(1000.0f * ratio + 0.5f));
    }
    return 0;
}
