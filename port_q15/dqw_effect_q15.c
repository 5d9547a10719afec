#include "dqw_effect_q15.h"
#include "dqw_effect_kind.h"

#include <stddef.h>

#include "dqw_q15.h"

#if DQW_EFFECT_WEIGHTS > 0

#define ONE_Q28 268435456
#define ONE_Q30 1073741824
#define ONE_Q40 ((int64_t)1 << 40)
// 50 K of 327.68 K, and a tenth of the full voltage: what usual inputs are.
#define HEAT_Q28 40960000
#define DELAY_Q28 26843546
#define TAU_MOST_US 1000000000000u
// Currents that a law divides by lie within 1/64 and 16 of the full one: their fifth powers then keep ten bits of Q40,
// and fit.
#define LEAST_PART 64u
#define MOST_PARTS 16u
// A width of 2^-15 of the full current is a last place.
#define WIDTH_PART 32768u
// R, L, psi and what is made of them need no more bits in Q40.
#define MOST_BITS 58u

// What a weight is divided by when it is read: nothing; of settled rows the angle; its square; a base that the
// machine's own values make.
enum weight { PLAIN, PER_ANGLE, PER_ANGLE_2, OWN_IRON, OWN_SENSOR, OWN_GAIN, OWN_ANGLE, OWN_MAP };

// An electrical effect: its weight. Its shape is take_shape(), its law put() in dqw_effect_law_q15.c.
static const uint8_t rows[DQW_EFFECT_NAMES] = {
    [DQW_EFFECT_DEAD_TIME] = PLAIN,
    [DQW_EFFECT_SATURATION] = PER_ANGLE,
    [DQW_EFFECT_CROSS_SATURATION] = PER_ANGLE,
    [DQW_EFFECT_WINDING_TEMPERATURE] = PLAIN,
    [DQW_EFFECT_MAGNET_TEMPERATURE] = PER_ANGLE,
    [DQW_EFFECT_IRON_LOSS] = OWN_IRON,
    [DQW_EFFECT_FLUX_HARMONICS] = PER_ANGLE,
    [DQW_EFFECT_CURRENT_OFFSET] = OWN_SENSOR,
    [DQW_EFFECT_CURRENT_GAIN_MISMATCH] = OWN_GAIN,
    [DQW_EFFECT_ANGLE_OFFSET] = OWN_ANGLE,
    [DQW_EFFECT_DELAY] = PER_ANGLE,
    [DQW_EFFECT_SKIN_EFFECT] = PER_ANGLE_2,
    [DQW_EFFECT_PHASE_RESISTANCE_IMBALANCE] = PLAIN,
    [DQW_EFFECT_VOLTAGE_OFFSET] = PLAIN,
    [DQW_EFFECT_FLUX_MAP] = OWN_MAP,
};

static int64_t size(int64_t x)
{
    return x < 0 ? -x : x;
}

static int64_t larger(int64_t a, int64_t b)
{
    return a > b ? a : b;
}

static bool is_temperature(enum dqw_effect_name name)
{
    return name == DQW_EFFECT_WINDING_TEMPERATURE || name == DQW_EFFECT_MAGNET_TEMPERATURE;
}

// Electrical angle a period at full speed, rad: below 1.
static int64_t angle_q40(const dqw_scale *s)
{
    return dqw_q_quotient64((int64_t)s->w_full_mrad_s * s->dt_ns, 1000000000000, 40) * s->pole_pairs;
}

// Bounded, so that sums of two fit: what needs so many bits is refused.
static int64_t bounded(int64_t x_q40)
{
    const int64_t most = (int64_t)1 << 60;
    return x_q40 < most ? x_q40 : most;
}

// Flux linkage in the inputs' unit: v dt, of settled rows v / w_e.
static int64_t flux_q40(const dqw_scale *s, bool settled, int64_t of_v_dt_q40)
{
    return bounded(settled ? dqw_q_product64(of_v_dt_q40, angle_q40(s), -40) : of_v_dt_q40);
}

static int64_t L_q40(const dqw_effect_q15 *e, uint32_t L_nH)
{
    const dqw_scale *s = e->scale;
    return flux_q40(s, e->settled, dqw_scale_L_q40(s, L_nH));
}

static int64_t psi_q40(const dqw_effect_q15 *e, uint32_t psi_nWb)
{
    const dqw_scale *s = e->scale;
    return flux_q40(s, e->settled, dqw_scale_psi_q40(s, psi_nWb));
}

static int64_t R_q40(const dqw_effect_q15 *e, const dqw_effect_q15_config *c)
{
    return bounded(dqw_scale_R_q40(e->scale, c->R_uohm));
}

// What an input is divided by where the machine's own values are in it, so that it stays below 1.
static int64_t own_base_q40(const dqw_effect_q15 *e, const dqw_effect_q15_config *c)
{
    const int64_t R = R_q40(e, c);
    const int64_t L = larger(L_q40(e, c->Ld_nH), L_q40(e, c->Lq_nH));
    switch ((enum weight)rows[c->effect]) {
    case OWN_IRON: return bounded(dqw_q_product64(2 * L, ONE_Q40 + R, -40));
    case OWN_SENSOR: return larger(R, L);
    case OWN_GAIN: return 2 * larger(R, L);
    case OWN_MAP: return psi_q40(e, c->psi_nWb);
    case OWN_ANGLE: return psi_q40(e, c->psi_nWb) + size(L_q40(e, c->Lq_nH) - L_q40(e, c->Ld_nH));
    default: return ONE_Q40;
    }
}

// a / b with 30 or 31 bits, and how many of them are fraction.
static int32_t ratio(uint64_t a, uint64_t b, uint8_t *fraction)
{
    const int n = 30 + (int)dqw_q_bits64((int64_t)b) - (int)dqw_q_bits64((int64_t)a);
    *fraction = (uint8_t)n;
    return dqw_q31_sat(dqw_q_quotient64((int64_t)a, (int64_t)b, n));
}

static int32_t part(int64_t a_q40, int64_t b_q40)
{
    return dqw_q31_sat(dqw_q_quotient64(a_q40, b_q40, 30));
}

static uint64_t i_full_uA(const dqw_scale *s)
{
    return (uint64_t)s->i_full_mA * 1000u;
}

static uint64_t unit_uA(const dqw_effect_q15 *e, const dqw_effect_q15_config *c)
{
    return c->i_uA != 0 ? c->i_uA : i_full_uA(e->scale);
}

static bool is_unit(const dqw_effect_q15 *e, uint64_t i_uA)
{
    const uint64_t full = i_full_uA(e->scale);
    return i_uA * LEAST_PART >= full && i_uA <= full * MOST_PARTS;
}

// A full current is at most 127 of a flux map's cells.
static bool is_cell(const dqw_effect_q15 *e, uint32_t cell_uA)
{
    return cell_uA > 0 && (uint64_t)cell_uA * 127u >= i_full_uA(e->scale);
}

static int32_t cells_q24(const dqw_effect_q15 *e, uint32_t cell_uA)
{
    return dqw_q31_sat(dqw_q_quotient64((int64_t)i_full_uA(e->scale), cell_uA, 24));
}

// Shape of entry k to the parts of its law and to its usual input; false where it means nothing.
static bool take_shape(dqw_effect_q15 *e, int k)
{
    const dqw_effect_q15_config *c = &e->list[k];
    int32_t *p = e->part_q30[k];
    const int64_t T_q28 = dqw_q_floor32(e->turn_q30, 2);
    const int64_t L_d = L_q40(e, c->Ld_nH);
    const int64_t L_q = L_q40(e, c->Lq_nH);
    const int64_t R = R_q40(e, c);
    const int64_t base = own_base_q40(e, c);
    const bool fits = base > 0 && dqw_q_bits64(L_d) <= MOST_BITS && dqw_q_bits64(L_q) <= MOST_BITS &&
                      dqw_q_bits64(R) <= MOST_BITS && dqw_q_bits64(base) <= MOST_BITS;
    int64_t usual_q28 = ONE_Q28;
    bool good = true;
    switch (c->effect) {
    case DQW_EFFECT_DEAD_TIME:
        good = (uint64_t)c->i_uA * WIDTH_PART >= i_full_uA(e->scale) && c->i_uA > 0;
        if (good) p[0] = ratio(i_full_uA(e->scale), c->i_uA, &e->shift[k]);
        break;
    case DQW_EFFECT_SATURATION:
    case DQW_EFFECT_CROSS_SATURATION:
        good = is_unit(e, c->i_uA);
        usual_q28 = c->effect == DQW_EFFECT_SATURATION ? T_q28 : T_q28 / 2;
        break;
    case DQW_EFFECT_WINDING_TEMPERATURE:
    case DQW_EFFECT_MAGNET_TEMPERATURE: {
        const uint64_t row_ns = c->row_us != 0 ? (uint64_t)c->row_us * 1000u : e->scale->dt_ns;
        const uint64_t tau_ns = c->tau_us * 1000u;
        good = c->tau_us <= TAU_MOST_US && (c->tau_us == 0 || is_unit(e, unit_uA(e, c)));
        if (good && c->tau_us > 0) p[0] = ratio(row_ns < tau_ns ? row_ns : tau_ns, tau_ns, &e->shift[k]);
        usual_q28 = c->tau_us > 0 ? ONE_Q28 / 2 : HEAT_Q28;
        if (c->effect == DQW_EFFECT_MAGNET_TEMPERATURE) usual_q28 = dqw_q_product64(usual_q28, T_q28, -28);
        break;
    }
    case DQW_EFFECT_IRON_LOSS:
        // The step that the iron's current makes is at most half a unit.
        good = fits && (e->settled || R <= base);
        p[0] = part(L_d, base);
        p[1] = part(dqw_q_product64(L_d, R, -40), base);
        p[2] = part(L_q, base);
        p[3] = part(dqw_q_product64(L_q, R, -40), base);
        p[4] = e->settled ? 0 : part(R, 2 * base);
        usual_q28 = dqw_q_quotient64(T_q28, 2 * (ONE_Q40 + R), 40);
        break;
    case DQW_EFFECT_FLUX_HARMONICS:
        good = c->order > 0 && c->order <= DQW_EFFECT_Q15_ORDERS;
        usual_q28 = T_q28 * c->order < ONE_Q28 ? T_q28 * c->order : ONE_Q28;
        break;
    case DQW_EFFECT_CURRENT_OFFSET:
    case DQW_EFFECT_CURRENT_GAIN_MISMATCH:
        good = fits;
        p[0] = part(R, base);
        p[1] = part(L_d, base);
        p[2] = part(L_q, base);
        usual_q28 = dqw_q_quotient64(R + dqw_q_product64(larger(L_d, L_q), T_q28, -28), base, 28);
        break;
    case DQW_EFFECT_ANGLE_OFFSET:
        good = fits;
        p[0] = part(L_q - L_d, base);
        p[1] = part(psi_q40(e, c->psi_nWb), base);
        usual_q28 = T_q28;
        break;
    case DQW_EFFECT_FLUX_MAP:
        good = fits && is_cell(e, c->cell_d_uA) && is_cell(e, c->cell_q_uA) && dqw_effect_is_map(c->map);
        if (good) p[0] = cells_q24(e, c->cell_d_uA);
        if (good) p[1] = cells_q24(e, c->cell_q_uA);
        usual_q28 = T_q28;
        break;
    case DQW_EFFECT_DELAY:
        p[4] = ONE_Q30;
        usual_q28 = DELAY_Q28;
        break;
    default: break;
    }
    e->base_q28[k] = dqw_q31_sat(usual_q28);
    return good;
}

static void take_needs(dqw_effect_q15 *e, const dqw_effect_q15_config *c)
{
    const unsigned needs = dqw_effect_needs(c->effect);
    const bool measured = c->tau_us == 0;
    const bool apart = c->effect == DQW_EFFECT_DEAD_TIME && e->dead_time_apart;
    e->needs_angle = e->needs_angle || ((needs & DQW_NEEDS_ANGLE) != 0 && !apart);
    e->needs_winding = e->needs_winding || ((needs & DQW_NEEDS_WINDING) != 0 && measured);
    e->needs_magnet = e->needs_magnet || ((needs & DQW_NEEDS_MAGNET) != 0 && measured);
    e->needs_last = e->needs_last || (needs & DQW_NEEDS_LAST) != 0;
}

enum dqw_status dqw_effect_init_q15(dqw_effect_q15 *e, const dqw_effect_q15_config *list, int count,
                                    const dqw_effect_q15_base *base)
{
    if (e == NULL || base == NULL || base->scale == NULL) return DQW_ERR_NULL;
    if (count < 0 || (count > 0 && list == NULL)) return DQW_ERR_EFFECT_LIST;
    if (count > 0 && base->scale->pole_pairs == 0) return DQW_ERR_EFFECT_POLE_PAIRS;
    const uint32_t h = base->half_window;
    // 8 h (h + 1) 2^fraction <= 2^31
    const int fraction = base->settled ? 28 : 28 - (int)dqw_q_bits64((int64_t)(h * (h + 1u)) - 1);
    dqw_effect_q15 n = {.list = list,
                        .scale = base->scale,
                        .settled = base->settled,
                        .dead_time_apart = base->dead_time_apart,
                        .fraction = (uint8_t)fraction};
    n.turn_q30 = base->settled || count == 0 ? ONE_Q30 : dqw_q31_sat(dqw_q_floor64(angle_q40(base->scale), 10));
    int windings = 0;
    int magnets = 0;
    int apart = 0;
    for (int k = 0; k < count; k++) {
        if (dqw_effect_weights(list[k].effect) == 0 || dqw_effect_is_mechanical(list[k].effect))
            return DQW_ERR_EFFECT_NAME;
        const int weights = dqw_effect_weights_of_q15(&n, list[k].effect);
        apart += weights == 0;
        if (apart > 1) return DQW_ERR_EFFECT_TWICE;
        if (weights > DQW_EFFECT_WEIGHTS - n.weights) return DQW_ERR_EFFECT_ROOM;
        if (!take_shape(&n, k)) return DQW_ERR_EFFECT_SHAPE;
        take_needs(&n, &list[k]);
        n.weights = (uint8_t)(n.weights + weights);
        n.count++;
        windings += list[k].effect == DQW_EFFECT_WINDING_TEMPERATURE;
        magnets += list[k].effect == DQW_EFFECT_MAGNET_TEMPERATURE;
    }
    if (windings > 1 || magnets > 1) return DQW_ERR_EFFECT_TWICE;
    *e = n;
    return DQW_OK;
}

bool dqw_effect_finite_q15(const dqw_effect_q15 *e, const dqw_sample_q15 *s)
{
    if (e->needs_winding && s->temp_winding_cC == INT16_MIN) return false;
    return !e->needs_magnet || s->temp_magnet_cC != INT16_MIN;
}

bool dqw_effect_saturated_q15(const dqw_effect_q15 *e, const dqw_sample_q15 *s)
{
    if (!e->needs_winding && !e->needs_magnet) return false;
    for (int k = 0; k < e->count; k++) {
        const dqw_effect_q15_config *c = &e->list[k];
        if (!is_temperature(c->effect) || c->tau_us > 0) continue;
        const int32_t rise = (c->effect == DQW_EFFECT_WINDING_TEMPERATURE ? s->temp_winding_cC : s->temp_magnet_cC) -
                             c->T_0_cC;
        if (rise > INT16_MAX || rise < -INT16_MAX) return true;
    }
    return false;
}

void dqw_effect_heat_q15(dqw_effect_q15 *e, int16_t i_d_q15, int16_t i_q_q15)
{
    for (int k = 0; k < e->count; k++) {
        const dqw_effect_q15_config *c = &e->list[k];
        if (!is_temperature(c->effect) || c->tau_us == 0) continue;
        // 2^31 at most; what is left of a part below 1 keeps it there.
        const int64_t square_q30 = (int64_t)((uint32_t)(i_d_q15 * i_d_q15) + (uint32_t)(i_q_q15 * i_q_q15));
        int64_t *h = &e->heat_q60[c->effect == DQW_EFFECT_WINDING_TEMPERATURE ? 0 : 1];
        // Time constants of minutes against periods of microseconds: steps are of 2^-60.
        *h += dqw_q_scale64((square_q30 - dqw_q_round64(*h, 30)) * e->part_q30[k][0], 30 - e->shift[k]);
    }
}

int32_t dqw_effect_mean_q15(const dqw_effect_q15 *e, int32_t sum, uint16_t weight)
{
    // Sums are of twice the input.
    return dqw_q31_sat(dqw_q_round64((int64_t)sum * (int32_t)((uint32_t)ONE_Q30 / weight), e->fraction + 3u));
}

static int64_t powered(const dqw_effect_q15 *e, const dqw_effect_q15_config *c, int power, int64_t w_q40)
{
    const int64_t unit_q40 = dqw_q_quotient64((int64_t)unit_uA(e, c), (int64_t)i_full_uA(e->scale), 40);
    for (int n = 0; n < power; n++) w_q40 = dqw_q_product64(w_q40, unit_q40, -40);
    return w_q40;
}

int64_t dqw_effect_restored_q40(const dqw_effect_q15 *e, int index, int i, int64_t w_q40)
{
    static const uint8_t power[] = {2, 3, 4, 3, 5};
    static const int8_t halvings[] = {-1, -1, -2};
    const dqw_effect_q15_config *c = &e->list[index];
    const int64_t angle = angle_q40(e->scale);
    int64_t w = w_q40;
    if (is_temperature(c->effect))
        w = c->tau_us > 0 ? powered(e, c, 2, dqw_q_scale64(w, -1)) : dqw_q_product64(w, 100, -15);
    if (c->effect == DQW_EFFECT_SATURATION) w = powered(e, c, power[i], w);
    if (c->effect == DQW_EFFECT_CROSS_SATURATION) w = powered(e, c, power[i], dqw_q_scale64(w, halvings[i]));
    const enum weight weight = (enum weight)rows[c->effect];
    if (weight >= OWN_IRON) return dqw_q_quotient64(w, own_base_q40(e, c), 40);
    if (weight == PER_ANGLE_2) return dqw_q_quotient64(dqw_q_quotient64(w, angle, 40), angle, 40);
    return weight != PLAIN && e->settled ? dqw_q_quotient64(w, angle, 40) : w;
}

int64_t dqw_effect_based_q40(const dqw_effect_q15 *e, int index, int i, int64_t weight_q40)
{
    return dqw_q_quotient64(weight_q40, dqw_effect_restored_q40(e, index, i, ONE_Q40), 40);
}

uint32_t dqw_effect_known_q15(const int64_t weights_q40[], const int64_t sd_q40[], int n)
{
    int64_t largest = 0;
    for (int i = 0; i < n; i++)
        if (sd_q40[i] != INT64_MAX) largest = larger(largest, size(weights_q40[i]));
    uint32_t known = 0;
    for (int i = 0; i < n; i++)
        if (sd_q40[i] < dqw_q_floor64(largest, 2)) known |= 1u << i;
    return known;
}

void dqw_effect_gap_q15(dqw_effect_q15 *e)
{
    e->has_sample = false;
}

#else
typedef int dqw_effect_q15_has_no_effects;
#endif
