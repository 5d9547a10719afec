// A joint whose pairs of samples hold exactly, in double, behind an inverter whose legs lose a voltage while they
// switch, some of which rest; seen by a drive whose angle is off, or late. For the estimators.
#ifndef RESTING_JOINT_H
#define RESTING_JOINT_H

#include "dqw_estimator.h"
#include "dqw_test.h"

#define RESTING_DT_S 5e-5
#define RESTING_LINK_V 60.0

typedef struct resting_joint {
    double machine[4];  ///< R, L_d, L_q, flux
    enum dqw_modulation modulation;
    double dead_V;      ///< what a switching leg loses with the sign of its current,
    double constant_V;  ///< and whichever way it flows
    double width_A;     ///< of the sign
    double off_rad;     ///< the drive's angle ahead of the magnet's,
    double late_s;      ///< and behind it by what the rotor turns in this time
} resting_joint;

static const double RESTING_MACHINE[4] = {0.5, 1.0e-3, 1.5e-3, 0.020};
enum { RESTING_POLES = 4 };

typedef struct resting_state {
    double i_A[2], w_m_rad_s, theta_rad;
} resting_state;

// Currents, speed and angle in closed form.
static inline resting_state resting_state_at(double k)
{
    const double t = k * RESTING_DT_S;
    const resting_state s = {{1.5 * sin(2 * PI * 37 * t) + 1.2 * sin(2 * PI * 171 * t + 1) - 0.8,
                              4.0 * sin(2 * PI * 13 * t + 2) + 0.5 + 1.0 * sin(2 * PI * 229 * t)},
                             140 * sin(2 * PI * 3 * t) + 20,
                             RESTING_POLES * (140 / (2 * PI * 3) * (1 - cos(2 * PI * 3 * t)) + 20 * t)};
    return s;
}

static inline void resting_turn(double x[2], double by_rad)
{
    const double d = x[0];
    x[0] = cos(by_rad) * d - sin(by_rad) * x[1];
    x[1] = sin(by_rad) * d + cos(by_rad) * x[1];
}

// A phase's part of a dq vector in a frame at this angle.
static inline double resting_phase(const double x[2], double theta_rad, int phase)
{
    return x[0] * cos(theta_rad - phase * 2 * PI / 3) - x[1] * sin(theta_rad - phase * 2 * PI / 3);
}

// Legs that a modulator holds on a rail, by the duties that it makes of voltages as parts of the link's: the lowest
// phase on the lower rail, the highest on the upper one, or whichever is the nearer.
static inline unsigned resting_legs(enum dqw_modulation modulation, const double v[3])
{
    const double low = fmin(v[0], fmin(v[1], v[2]));
    const double high = fmax(v[0], fmax(v[1], v[2]));
    double shift;
    switch (modulation) {
    case DQW_MODULATION_CLAMPED_LOW: shift = -0.5 - low; break;
    case DQW_MODULATION_CLAMPED_HIGH: shift = 0.5 - high; break;
    case DQW_MODULATION_CLAMPED_60: shift = -low > high ? -0.5 - low : 0.5 - high; break;
    default: return 0;
    }
    unsigned legs = 0;
    for (int p = 0; p < 3; p++) {
        const double duty = 0.5 + v[p] + shift;
        if (duty < 1e-12 || duty > 1 - 1e-12) legs |= 1u << p;
    }
    return legs;
}

// What the legs that switch lose, as dq in a frame at this angle.
static inline void resting_loss(const resting_joint *j, const resting_state *middle, unsigned legs, double loss_V[2])
{
    loss_V[0] = loss_V[1] = 0.0;
    for (int p = 0; p < 3; p++) {
        if ((legs >> p & 1u) != 0) continue;
        const double lost = j->dead_V * tanh(resting_phase(middle->i_A, middle->theta_rad, p) / j->width_A) +
                            j->constant_V;
        loss_V[0] += 2.0 / 3 * lost * cos(middle->theta_rad - p * 2 * PI / 3);
        loss_V[1] -= 2.0 / 3 * lost * sin(middle->theta_rad - p * 2 * PI / 3);
    }
}

// Of a mask: none, one, and now and then two legs, whatever the voltages are.
static inline unsigned resting_mask(long k)
{
    static const uint8_t masks[] = {1, 4, 0, 2, 6, 1, 2, 4};
    return masks[k / 37 % 8];
}

// The sample at k, with the voltage that the drive commands from then on; *made where that is what these legs make of
// it: between two legs there may be none.
static inline dqw_sample resting_sample(const resting_joint *j, long k, bool *made)
{
    const resting_state now = resting_state_at((double)k);
    const resting_state next = resting_state_at((double)k + 1);
    const resting_state middle = resting_state_at((double)k + 0.5);
    const double *m = j->machine;
    const double wi_d = RESTING_POLES * 0.5 * (now.w_m_rad_s * now.i_A[0] + next.w_m_rad_s * next.i_A[0]);
    const double wi_q = RESTING_POLES * 0.5 * (now.w_m_rad_s * now.i_A[1] + next.w_m_rad_s * next.i_A[1]);
    const double w_e = RESTING_POLES * 0.5 * (now.w_m_rad_s + next.w_m_rad_s);
    const double v_V[2] = {m[0] * 0.5 * (now.i_A[0] + next.i_A[0]) + m[1] * (next.i_A[0] - now.i_A[0]) / RESTING_DT_S -
                               m[2] * wi_q,
                           m[0] * 0.5 * (now.i_A[1] + next.i_A[1]) + m[2] * (next.i_A[1] - now.i_A[1]) / RESTING_DT_S +
                               m[1] * wi_d + w_e * m[3]};
    // Which leg rests follows from the command, and the command from what the others lose.
    unsigned legs = j->modulation == DQW_MODULATION_MASK ? resting_mask(k) : 0;
    double command_V[2];
    *made = false;
    for (int tries = 0; tries < 4 && !*made; tries++) {
        double loss_V[2];
        resting_loss(j, &middle, legs, loss_V);
        double phase[3];
        for (int axis = 0; axis < 2; axis++) command_V[axis] = v_V[axis] + loss_V[axis];
        for (int p = 0; p < 3; p++) phase[p] = resting_phase(command_V, middle.theta_rad, p) / RESTING_LINK_V;
        const unsigned said = j->modulation == DQW_MODULATION_MASK ? legs : resting_legs(j->modulation, phase);
        *made = said == legs;
        legs = said;
    }
    const double off_rad = j->off_rad - RESTING_POLES * now.w_m_rad_s * j->late_s;
    double i_A[2] = {now.i_A[0], now.i_A[1]};
    resting_turn(i_A, -off_rad);
    resting_turn(command_V, -off_rad);
    const dqw_sample s = {.v_d_V = (float)command_V[0],
                          .v_q_V = (float)command_V[1],
                          .i_d_A = (float)i_A[0],
                          .i_q_A = (float)i_A[1],
                          .w_m_rad_s = (float)now.w_m_rad_s,
                          .cosine = (float)cos(now.theta_rad + off_rad),
                          .sine = (float)sin(now.theta_rad + off_rad),
                          .resting = (uint8_t)(j->modulation == DQW_MODULATION_MASK ? legs : 0)};
    return s;
}

#endif
