/* A motor in 30 lines, to try an installed dqwatch on: dq model, twenty Euler steps a period, random binary voltages. */
#ifndef MOTOR_H
#define MOTOR_H

#include <math.h>
#include <stdint.h>

enum { PERIODS = 8000, PAIRS = 4 };
static const float DT_S = 50e-6f, R_OHM = 0.5f, LD_H = 1.0e-3f, LQ_H = 1.4e-3f, PSI_WB = 0.02f;

typedef struct motor {
    float i_d_A, i_q_A, w_m_rad_s, theta_e_rad;
    uint32_t dice;
} motor;

/* The voltage of period k: a working point, and a coin on each axis. */
static void motor_decide(motor *m, int k, float *v_d_V, float *v_q_V)
{
    m->dice = m->dice * 1664525u + 1013904223u;
    m->w_m_rad_s = 60.0f + 40.0f * sinf(0.001f * (float)k);
    *v_d_V = -2.0f + ((m->dice >> 30) & 1u ? 2.0f : -2.0f);
    *v_q_V = 2.0f + (float)PAIRS * m->w_m_rad_s * PSI_WB + ((m->dice >> 31) & 1u ? 2.0f : -2.0f);
}

/* One period with this voltage on the rotating axes. */
static void motor_turn(motor *m, float v_d_V, float v_q_V)
{
    const float w_e = (float)PAIRS * m->w_m_rad_s, step_s = DT_S / 20.0f;
    for (int n = 0; n < 20; n++) {
        const float d = (v_d_V - R_OHM * m->i_d_A + w_e * LQ_H * m->i_q_A) / LD_H;
        const float q = (v_q_V - R_OHM * m->i_q_A - w_e * (LD_H * m->i_d_A + PSI_WB)) / LQ_H;
        m->i_d_A += step_s * d;
        m->i_q_A += step_s * q;
    }
    m->theta_e_rad = fmodf(m->theta_e_rad + w_e * DT_S, 6.2831853f);
}

#endif
