#include "dqw_fault_q15.h"

#include <stdbool.h>

#include "dqw_fault_kind.h"
#include "dqw_q15.h"

// A pattern must explain this part of what changed, squared: 0.6.
#define EXPLAINED_MIN_Q15 19661
// What one factor for R, L, flux and dead time may leave of them, squared: 16, and a fiftieth of what it explains.
#define SCALE_LEFT_Q20 16777216
#define SCALE_LEFT_PARTS 50
// And 20 where a map's weights are known.
#define SCALE_LEFT_MAP_Q20 20971520
// What a second pattern must leave more, squared, before it counts as told apart: odds of e^2, for what stays is taken
// to move by 0.7 of its unit; and a hundredth of the whole, as patterns are no better known.
#define APART_Q20 2097152
#define APART_PARTS 100
#define ONE_Q15 32768
#define ONE_Q24 16777216
// A change of so many units is one of so many: squares of fourteen fit. A pattern's part of a sign, the same.
#define MOST_Q10 268435456
#define MOST_Q20 1099511627776

// Cosine and sine of twice the angle of phase a, b, c.
static const int32_t PHASE_RE_Q24[3] = {ONE_Q24, -ONE_Q24 / 2, -ONE_Q24 / 2};
static const int32_t PHASE_IM_Q24[3] = {0, -14529495, 14529495};

static void turned(int64_t pattern_q24[], int at, int32_t re_q24, int32_t im_q24, int phase)
{
    const int64_t re = PHASE_RE_Q24[phase];
    const int64_t im = PHASE_IM_Q24[phase];
    pattern_q24[at] = dqw_q_round64(re_q24 * re - im_q24 * im, 24);
    pattern_q24[at + 1] = dqw_q_round64(re_q24 * im + im_q24 * re, 24);
}

// What one unit of a fault changes. False for a phase that it does not have.
static bool pattern_of(enum dqw_fault_name name, int phase, dqw_fault_machine_q15 m, int64_t p[])
{
    for (int i = 0; i < DQW_SIGNS; i++) p[i] = 0;
    switch (name) {
    case DQW_FAULT_DEMAGNETISATION: p[DQW_SIGN_PSI] = -ONE_Q24; break;
    case DQW_FAULT_ENCODER_OFFSET: p[DQW_SIGN_ANGLE] = ONE_Q24; break;
    case DQW_FAULT_INVERTER_FAULT: p[DQW_SIGN_DEAD_TIME] = ONE_Q24; break;
    case DQW_FAULT_RESISTANCE_RISE: p[DQW_SIGN_R] = ONE_Q24; break;
    // R alone says nothing, for it comes down where dead time goes up.
    case DQW_FAULT_VOLTAGE_SCALE:
        p[DQW_SIGN_R] = p[DQW_SIGN_LD] = p[DQW_SIGN_LQ] = p[DQW_SIGN_PSI] = ONE_Q24;
        p[DQW_SIGN_DEAD_TIME] = m.dead_time_q24;
#if DQW_MAP_WEIGHTS > 0
        p[DQW_SIGN_MAP_D] = p[DQW_SIGN_MAP_Q] = ONE_Q24;
#endif
        break;
    case DQW_FAULT_TURN_SHORT:
        turned(p, DQW_SIGN_SHORT_RE, ONE_Q24, 0, phase);
        p[DQW_SIGN_PSI] = -dqw_q_product64(m.short_q40, m.R_q24, -40);
        return true;
    case DQW_FAULT_PHASE_CONNECTION:
        turned(p, DQW_SIGN_RESISTANCE_RE, ONE_Q24, 0, phase);
        p[DQW_SIGN_R] = dqw_q_quotient64(ONE_Q24, m.R_q24, 24);
        return true;
    case DQW_FAULT_CURRENT_GAIN:
        turned(p, DQW_SIGN_RESISTANCE_RE, m.R_q24 > INT32_MIN ? -m.R_q24 : INT32_MAX,
               dqw_q_times32(m.speed_q24, m.L_q24, -24), phase);
        turned(p, DQW_SIGN_REACTANCE_RE, m.L_q24, 0, phase);
        p[DQW_SIGN_R] = p[DQW_SIGN_LD] = p[DQW_SIGN_LQ] = -ONE_Q24;
        return true;
    default: return false;
    }
    return phase == 0;
}

// a / b 2^n; 0 where b is not known.
static int64_t over(int64_t a, int32_t b, int n, int64_t most)
{
    if (b == INT32_MAX) return 0;
    const int64_t ratio = dqw_q_quotient64(a, b, n);
    return ratio > most ? most : ratio < -most ? -most : ratio;
}

// What a pattern explains of all changes, squared, Q20; 0 where it would have the wrong sign.
static int64_t explained_q20(const int64_t z_q10[], const int64_t p_q24[], const int32_t unit_q24[], bool either)
{
    int64_t zp_q10 = 0;
    int64_t pp_q10 = 0;
    for (int i = 0; i < DQW_SIGNS; i++) {
        // |z| <= 2^28, |p| <= 2^40: products below 2^48 and 2^50
        const int64_t q_q20 = over(p_q24[i], unit_q24[i], 20, MOST_Q20);
        zp_q10 += dqw_q_product64(z_q10[i], q_q20, -20);
        pp_q10 += dqw_q_product64(q_q20, q_q20, -30);
    }
    if (pp_q10 <= 0 || (zp_q10 < 0 && !either)) return 0;
    return dqw_q_product64(zp_q10, dqw_q_quotient64(zp_q10, pp_q10, 30), -20);
}

// A flux that alone is known well is not enough. An observer's L_q may say so too, but contradicts nothing: the
// pattern loses it.
static bool is_scale(int64_t p_q24[], const int64_t z_q10[], const int32_t unit_q24[], bool observed)
{
    if (observed) p_q24[DQW_SIGN_LQ] = 0;
    const int64_t e_q20 = explained_q20(z_q10, p_q24, unit_q24, true);
    int64_t left_q20 = -e_q20;
    for (int i = DQW_SIGN_R; i <= DQW_SIGN_DEAD_TIME; i++)
        if (p_q24[i] != 0) left_q20 += z_q10[i] * z_q10[i];
    int64_t most_q20 = SCALE_LEFT_Q20;
#if DQW_MAP_WEIGHTS > 0
    const int64_t d_q10 = z_q10[DQW_SIGN_MAP_D];
    const int64_t q_q10 = z_q10[DQW_SIGN_MAP_Q];
    left_q20 += d_q10 * d_q10 + q_q10 * q_q10;
    if (d_q10 != 0 || q_q10 != 0) most_q20 = SCALE_LEFT_MAP_Q20;
#endif
    return left_q20 < most_q20 + e_q20 / SCALE_LEFT_PARTS;
}

dqw_fault_verdict_q15 dqw_fault_name_it_q15(const int32_t change_q24[], const int32_t unit_q24[],
                                            dqw_fault_machine_q15 machine)
{
    // [NAM.1] every change in units of what means nothing
    int64_t z_q10[DQW_SIGNS];
    int64_t whole_q20 = 0;
    for (int i = 0; i < DQW_SIGNS; i++) {
        z_q10[i] = over(change_q24[i], unit_q24[i], 10, MOST_Q10);
        whole_q20 += z_q10[i] * z_q10[i];
    }
    dqw_fault_verdict_q15 best = {.name = DQW_FAULT_UNKNOWN, .confidence_q15 = 0, .phase = 0};
    if (whole_q20 == 0) return best;

    // [NAM.2] what each fault's pattern explains of it
    int64_t most_q20 = 0;
    int64_t next_q20 = 0;
    for (int k = DQW_FAULT_OVER_TEMPERATURE; k < DQW_FAULT_UNKNOWN; k++) {
        const enum dqw_fault_name name = (enum dqw_fault_name)k;
        // Where ripples are not known, patterns with one are another fault's.
        if (dqw_fault_ripples(name) && unit_q24[DQW_SIGN_SHORT_RE] == INT32_MAX) continue;
        int64_t p_q24[DQW_SIGNS];
        int64_t explained = 0;
        uint8_t at = 0;
        if (name == DQW_FAULT_CURRENT_OFFSET) {
            explained = z_q10[DQW_SIGN_OFFSET_RE] * z_q10[DQW_SIGN_OFFSET_RE] +
                        z_q10[DQW_SIGN_OFFSET_IM] * z_q10[DQW_SIGN_OFFSET_IM];
        } else {
            for (int phase = 0; phase < 3; phase++) {
                if (!pattern_of(name, phase, machine, p_q24)) continue;
                const int64_t e_q20 = explained_q20(z_q10, p_q24, unit_q24, dqw_fault_either_sign(name));
                if (e_q20 <= explained) continue;
                explained = e_q20;
                at = (uint8_t)phase;
            }
        }
        if (name == DQW_FAULT_VOLTAGE_SCALE && !is_scale(p_q24, z_q10, unit_q24, machine.observed)) continue;
        if (explained > most_q20) {
            next_q20 = most_q20;
            most_q20 = explained;
            best.name = name;
            best.phase = at;
        } else if (explained > next_q20) {
            next_q20 = explained;
        }
    }

    // [NAM.3] an explanation counts by what it leaves, and by how far the next one stays behind
    const int32_t part_q15 = dqw_q31_sat(dqw_q_quotient64(most_q20 < whole_q20 ? most_q20 : whole_q20, whole_q20, 15));
    const int64_t apart_q20 = APART_Q20 + whole_q20 / APART_PARTS;
    const int32_t lead_q15 = dqw_q31_sat(dqw_q_quotient64(most_q20 - next_q20, apart_q20, 15));
    best.confidence_q15 = (uint16_t)(lead_q15 < ONE_Q15 ? (part_q15 * ((ONE_Q15 + lead_q15) / 2)) >> 15 : part_q15);
    if (part_q15 < EXPLAINED_MIN_Q15) {
        best.name = DQW_FAULT_UNKNOWN;
        best.confidence_q15 = (uint16_t)(ONE_Q15 - part_q15);
        best.phase = 0;
    }
    return best;
}
