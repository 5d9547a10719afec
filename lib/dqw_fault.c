#include "dqw_fault.h"

#include <stdbool.h>

#include "dqw_fault_kind.h"
#include "dqw_number.h"

// A pattern must explain this part of what changed, squared.
#define EXPLAINED_MIN 0.6f
// What one factor for R, L, flux and dead time may leave of them, squared: five deviations' chance of 99 %, and a part
// of it.
#define SCALE_LEFT 16.0f
#define SCALE_LEFT_PART 0.02f
// And of two more where a map's weights are known.
#define SCALE_LEFT_MAP 20.0f
// What a second pattern must leave more, squared, before it counts as told apart: odds of e^2, for what stays is taken
// to move by 0.7 of its unit; and a hundredth of the whole, as patterns are no better known.
#define APART 2.0f
#define APART_PART 0.01f

// Cosine and sine of twice the angle of phase a, b, c.
static const float PHASE_RE[3] = {1.0f, -0.5f, -0.5f};
static const float PHASE_IM[3] = {0.0f, -0.8660254f, 0.8660254f};

static void turned(float pattern[], int at, float re, float im, int phase)
{
    pattern[at] = re * PHASE_RE[phase] - im * PHASE_IM[phase];
    pattern[at + 1] = re * PHASE_IM[phase] + im * PHASE_RE[phase];
}

// What one unit of a fault changes. False for a phase that it does not have.
static bool pattern_of(enum dqw_fault_name name, int phase, dqw_fault_machine m, float p[])
{
    for (int i = 0; i < DQW_SIGNS; i++) p[i] = 0.0f;
    switch (name) {
    case DQW_FAULT_DEMAGNETISATION: p[DQW_SIGN_PSI] = -1.0f; break;
    case DQW_FAULT_ENCODER_OFFSET: p[DQW_SIGN_ANGLE] = 1.0f; break;
    case DQW_FAULT_INVERTER_FAULT: p[DQW_SIGN_DEAD_TIME] = 1.0f; break;
    case DQW_FAULT_RESISTANCE_RISE: p[DQW_SIGN_R] = 1.0f; break;
    // R alone says nothing, for it comes down where dead time goes up.
    case DQW_FAULT_VOLTAGE_SCALE:
        p[DQW_SIGN_R] = p[DQW_SIGN_LD] = p[DQW_SIGN_LQ] = p[DQW_SIGN_PSI] = 1.0f;
        p[DQW_SIGN_DEAD_TIME] = m.dead_time_V;
#if DQW_MAP_WEIGHTS > 0
        p[DQW_SIGN_MAP_D] = p[DQW_SIGN_MAP_Q] = 1.0f;
#endif
        break;
    case DQW_FAULT_TURN_SHORT:
        turned(p, DQW_SIGN_SHORT_RE, 1.0f, 0.0f, phase);
        p[DQW_SIGN_PSI] = -m.R_ohm;
        return true;
    case DQW_FAULT_PHASE_CONNECTION:
        turned(p, DQW_SIGN_RESISTANCE_RE, 1.0f, 0.0f, phase);
        p[DQW_SIGN_R] = 1.0f / m.R_ohm;
        return true;
    case DQW_FAULT_CURRENT_GAIN:
        turned(p, DQW_SIGN_RESISTANCE_RE, -m.R_ohm, m.w_e_rad_s * m.L_H, phase);
        turned(p, DQW_SIGN_REACTANCE_RE, m.L_H, 0.0f, phase);
        p[DQW_SIGN_R] = p[DQW_SIGN_LD] = p[DQW_SIGN_LQ] = -1.0f;
        return true;
    default: return false;
    }
    return phase == 0;
}

// What a pattern explains of all changes, squared; 0 where it would have the wrong sign.
static float explained_by(const float p[], const float z[], const float unit[], bool either)
{
    float zp = 0.0f;
    float pp = 0.0f;
    for (int i = 0; i < DQW_SIGNS; i++) {
        const float q = p[i] / unit[i];
        zp += z[i] * q;
        pp += q * q;
    }
    return !(pp > 0.0f) || (zp < 0.0f && !either) ? 0.0f : zp * zp / pp;
}

// A flux that alone is known well is not enough. An observer's L_q may say so too, but contradicts nothing: the
// pattern loses it.
static bool is_scale(float p[], const float z[], const float unit[], bool observed)
{
    if (observed) p[DQW_SIGN_LQ] = 0.0f;
    const float said = explained_by(p, z, unit, true);
    float left = -said;
    for (int i = DQW_SIGN_R; i <= DQW_SIGN_DEAD_TIME; i++)
        if (p[i] != 0.0f) left += z[i] * z[i];
    float most = SCALE_LEFT;
#if DQW_MAP_WEIGHTS > 0
    const float map = z[DQW_SIGN_MAP_D] * z[DQW_SIGN_MAP_D] + z[DQW_SIGN_MAP_Q] * z[DQW_SIGN_MAP_Q];
    left += map;
    if (map > 0.0f) most = SCALE_LEFT_MAP;
#endif
    return left < most + SCALE_LEFT_PART * said;
}

dqw_fault_verdict dqw_fault_name_it(const float change[], const float unit[], dqw_fault_machine machine)
{
    // [NAM.1] every change in units of what means nothing
    float z[DQW_SIGNS];
    float whole = 0.0f;
    for (int i = 0; i < DQW_SIGNS; i++) {
        z[i] = change[i] / unit[i];
        whole += z[i] * z[i];
    }
    dqw_fault_verdict best = {.name = DQW_FAULT_UNKNOWN, .confidence = 0.0f, .phase = 0};
    if (!(whole > 0.0f) || !dqw_is_finite(whole)) return best;

    // [NAM.2] what each fault's pattern explains of it
    float most = 0.0f;
    float next = 0.0f;
    for (int k = DQW_FAULT_OVER_TEMPERATURE; k < DQW_FAULT_UNKNOWN; k++) {
        const enum dqw_fault_name name = (enum dqw_fault_name)k;
        // Where ripples are not known, patterns with one are another fault's.
        if (dqw_fault_ripples(name) && !(unit[DQW_SIGN_SHORT_RE] < DQW_UNKNOWN)) continue;
        float p[DQW_SIGNS];
        float explained = 0.0f;
        uint8_t at = 0;
        if (name == DQW_FAULT_CURRENT_OFFSET) {
            explained = z[DQW_SIGN_OFFSET_RE] * z[DQW_SIGN_OFFSET_RE] + z[DQW_SIGN_OFFSET_IM] * z[DQW_SIGN_OFFSET_IM];
        } else {
            for (int phase = 0; phase < 3; phase++) {
                if (!pattern_of(name, phase, machine, p)) continue;
                const float said = explained_by(p, z, unit, dqw_fault_either_sign(name));
                if (!(said > explained)) continue;
                explained = said;
                at = (uint8_t)phase;
            }
        }
        if (name == DQW_FAULT_VOLTAGE_SCALE && !is_scale(p, z, unit, machine.observed)) continue;
        if (explained > most) {
            next = most;
            most = explained;
            best.name = name;
            best.phase = at;
        } else if (explained > next) {
            next = explained;
        }
    }

    // [NAM.3] an explanation counts by what it leaves, and by how far the next one stays behind
    const float part = most / whole;
    const float lead = (most - next) / (APART + APART_PART * whole);
    best.confidence = part * (lead < 1.0f ? 0.5f + 0.5f * lead : 1.0f);
    if (part < EXPLAINED_MIN) {
        best.name = DQW_FAULT_UNKNOWN;
        best.confidence = 1.0f - part;
        best.phase = 0;
    }
    return best;
}
