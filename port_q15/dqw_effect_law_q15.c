// dqw_effect_pair_q15(), dqw_effect_static_q15(): the laws of the electrical effects. f, g and currents are Q28 of
// their bases.
#include <stddef.h>

#include "dqw_effect_q15.h"
#include "dqw_q15.h"

#if DQW_EFFECT_WEIGHTS > 0

#define ONE_Q28 268435456
#define ONE_Q30 1073741824
#define SQRT3_2_Q30 929887697
#define THIRD_Q30 357913941
#define INV_SQRT3_Q30 619925131

// A sample as the laws see it, and where their parts go: voltage f, flux linkage g of one unit of each weight.
typedef struct moment {
    int16_t i_d_q15, i_q_q15, w_m_q15;
    int16_t cos_q15, sin_q15;     // of the electrical angle
    int32_t alpha_q28, beta_q28;  // of the currents, |.| <= 1.42; 0 where no effect needs the angle
    int32_t turn_q30;             // w_e: the angle in a period, of settled rows in parts of that at full speed; |.| < 1
    int32_t end_d_q28, end_q_q28;  // the voltage that the sample ends, as the rotor sees it then; |.| <= 1.42
    int32_t *f_d, *f_q, *g_d, *g_q;
} moment;

// a b, rounded; |a b| below 2.
static int32_t times(int32_t a_q28, int32_t b_q30)
{
    return (int32_t)dqw_q_round64((int64_t)a_q28 * b_q30, 30);
}

// From stationary to dq, a turn that keeps the length.
static void put_turned(const moment *m, int32_t alpha_q28, int32_t beta_q28, int32_t *d, int32_t *q)
{
    *d = (int32_t)dqw_q_round64((int64_t)m->cos_q15 * alpha_q28 + (int64_t)m->sin_q15 * beta_q28, 15);
    *q = (int32_t)dqw_q_round64((int64_t)m->cos_q15 * beta_q28 - (int64_t)m->sin_q15 * alpha_q28, 15);
}

// Dq image of phase quantities, zero sequence removed: of three up to 1, or of one up to 1.42, |.| <= 4/3.
static void put_phases(const moment *m, int32_t a_q28, int32_t b_q28, int32_t c_q28, int32_t *d, int32_t *q)
{
    put_turned(m, times(2 * a_q28 - b_q28 - c_q28, THIRD_Q30), times(b_q28 - c_q28, INV_SQRT3_Q30), d, q);
}

// A sensor adds o to the true current. (E53)
static void put_sensor(const moment *m, int k, const int32_t part_q30[], int32_t alpha_q28, int32_t beta_q28)
{
    int32_t o_d;
    int32_t o_q;
    put_turned(m, alpha_q28, beta_q28, &o_d, &o_q);
    m->f_d[k] = -times(o_d, part_q30[0]);
    m->f_q[k] = -times(o_q, part_q30[0]);
    m->g_d[k] = -times(o_d, part_q30[1]);
    m->g_q[k] = -times(o_q, part_q30[2]);
}

static int32_t q28(int32_t x_q30)
{
    return dqw_q_round32(x_q30, 2);
}

// A polynomial of a co-energy: the currents over the full one. (E52)
static void put_saturation(enum dqw_effect_name effect, const moment *m)
{
    const int32_t x = m->i_d_q15 * 32768;  // Q30
    const int32_t y = m->i_q_q15 * 32768;
    const int32_t x2 = times(x, x);
    const int32_t y2 = times(y, y);
    if (effect == DQW_EFFECT_SATURATION) {
        m->g_d[0] = q28(x2);
        m->g_d[1] = q28(times(x2, x));
        m->g_d[2] = q28(times(x2, x2));
        m->g_q[3] = q28(times(y2, y));
        m->g_q[4] = q28(times(times(y2, y2), y));
    } else {
        // Halves, and a quarter, of (E52)'s.
        m->g_d[0] = dqw_q_round32(y2, 3);
        m->g_q[0] = q28(times(x, y));
        m->g_d[1] = q28(times(x, y2));
        m->g_q[1] = q28(times(x2, y));
        m->g_d[2] = dqw_q_round32(times(y2, y2), 4);
        m->g_q[2] = q28(times(times(x, y), y2));
    }
}

// Place of a current among a table's nodes, Q15: none below 0 or beyond the last.
static int32_t place_q15(int16_t i_q15, int32_t cells_q24, int32_t below, int32_t nodes)
{
    const int32_t x = (int32_t)dqw_q_round64((int64_t)i_q15 * cells_q24, 24) + below * 32768;
    const int32_t end = (nodes - 1) * 32768;
    return x < 0 ? 0 : x < end ? x : end;
}

// The node before it, one that another follows.
static int32_t node_of(int32_t x_q15, int32_t nodes)
{
    const int32_t k = dqw_q_floor32(x_q15, 15);
    return k < nodes - 1 ? k : nodes - 2;
}

static int32_t lerp_q28(int32_t a_q28, int32_t b_q28, int32_t part_q15)
{
    return a_q28 + (int32_t)dqw_q_round64((int64_t)(b_q28 - a_q28) * part_q15, 15);
}

// Between four nodes of a table: two of one row, two of the next.
static int32_t between_q28(const int16_t *a, const int16_t *b, int32_t u_q15, int32_t v_q15)
{
    return lerp_q28(lerp_q28(a[0] * 8192, a[2] * 8192, v_q15), lerp_q28(b[0] * 8192, b[2] * 8192, v_q15), u_q15);
}

// The bend of a flux map: between four nodes of its table, beyond it what stands at its edge. (E165)
static void put_flux_map(const int16_t *map, const int32_t part_q24[], const moment *m)
{
    const int32_t nodes = map[2];
    const int32_t x = place_q15(m->i_d_q15, part_q24[0], map[1], map[0]);
    const int32_t y = place_q15((int16_t)(m->i_q_q15 < 0 ? -m->i_q_q15 : m->i_q_q15), part_q24[1], 0, nodes);
    const int32_t k = node_of(x, map[0]);
    const int32_t n = node_of(y, nodes);
    const int32_t u = x - k * 32768;
    const int32_t v = y - n * 32768;
    const int16_t *a = map + DQW_EFFECT_MAP_HEAD + 2 * (ptrdiff_t)(k * nodes + n);
    const int16_t *b = a + 2 * (ptrdiff_t)nodes;
    const int32_t q = between_q28(a + 1, b + 1, u, v);
    m->g_d[0] = between_q28(a, b, u, v);
    m->g_q[1] = m->i_q_q15 < 0 ? -q : q;
}

// tanh of a phase current over the width, wrong by 3e-6: the third order around the nearest eighth. Beyond 8 it is 1.
static int32_t soft_sign_q28(int32_t i_q28, int32_t per_width, unsigned fraction)
{
    static const int32_t tanh_q30[] = {
        0,          133523019,  262979411,  384783327,  496194519,  595496917,  681985995,  755812887,  817755498,
        868980407,  910837623,  944706725,  971895537,  993582944,  1010794288, 1024398298, 1035116732, 1043540415,
        1050147544, 1055321814, 1059369036, 1062531689, 1065001270, 1066928539, 1068431906, 1069604193, 1070518060,
        1071230320, 1071785356, 1072217818, 1072554741, 1072817210, 1073021665, 1073180922, 1073304968, 1073401585,
        1073476836, 1073535446, 1073581093, 1073616644, 1073644333, 1073665897, 1073682692, 1073695771, 1073705958,
        1073713891, 1073720070, 1073724882, 1073728629, 1073731548, 1073733821, 1073735591, 1073736970, 1073738044,
        1073738880, 1073739531, 1073740038, 1073740433, 1073740741, 1073740980, 1073741167, 1073741312, 1073741426,
        1073741514, 1073741582};
    // |i| <= 1.42 times 2^31
    const int32_t x_q28 = dqw_q31_sat(dqw_q_round64((int64_t)i_q28 * per_width, fraction));
    const uint32_t size_q28 = x_q28 < 0 ? (uint32_t)(-(int64_t)x_q28) : (uint32_t)x_q28;
    const uint32_t k = (size_q28 + (1u << 24)) >> 25;
    const int32_t off_q30 = (int32_t)(size_q28 - (k << 25)) * 4;  // within 1/16
    // t + h (1 - t^2) (1 - h (t + h (1/3 - t^2)))
    const int32_t t = tanh_q30[k];
    const int32_t t2 = times(t, t);
    const int32_t bend = times(off_q30, t + times(off_q30, THIRD_Q30 - t2));
    const int32_t y = q28(t + times(times(off_q30, ONE_Q30 - t2), ONE_Q30 - bend));
    return x_q28 < 0 ? -y : y;
}

// To within 1, a last place or two of 2^-28 are nothing.
static int32_t within_one(int32_t x_q30)
{
    return x_q30 > ONE_Q30 ? ONE_Q30 : x_q30 < -ONE_Q30 ? -ONE_Q30 : x_q30;
}

// Cosine and sine of n times the angle, Q30, n <= DQW_EFFECT_Q15_ORDERS: |z| to 1 within 3e-4, its powers stay below
// 1.04.
static void put_power(const moment *m, unsigned n, int32_t *cosine, int32_t *sine)
{
    // (1 + x)^(-1/2), |x| < 0.1
    const int32_t x = (int32_t)((int64_t)m->cos_q15 * m->cos_q15 + (int64_t)m->sin_q15 * m->sin_q15 - ONE_Q30);
    const int32_t by = ONE_Q30 - dqw_q_round32(x, 1) + times(times(x, x), 402653184);
    const int32_t z_c = times(m->cos_q15 * 32768, by);
    const int32_t z_s = times(m->sin_q15 * 32768, by);
    int32_t c = ONE_Q30;
    int32_t s = 0;
    for (unsigned bit = 1u << 6; bit > 0; bit >>= 1) {
        int32_t next = (int32_t)dqw_q_round64((int64_t)c * c - (int64_t)s * s, 30);
        s = (int32_t)dqw_q_round64((int64_t)c * s, 29);
        c = next;
        if ((n & bit) == 0) continue;
        next = (int32_t)dqw_q_round64((int64_t)c * z_c - (int64_t)s * z_s, 30);
        s = (int32_t)dqw_q_round64((int64_t)s * z_c + (int64_t)c * z_s, 30);
        c = next;
    }
    *cosine = within_one(c);
    *sine = within_one(s);
}

// Temperature above T_0 in parts of 327.68 K, or half the heating state.
static int32_t warmth_q28(const dqw_effect_q15 *e, const dqw_effect_q15_config *c, int16_t temp_cC, int state)
{
    if (c->tau_us > 0) return (int32_t)dqw_q_round64(e->heat_q60[state], 33);
    return (temp_cC - c->T_0_cC) * 8192;
}

static void put(const dqw_effect_q15 *e, int k, const moment *m, const dqw_sample_q15 *s)
{
    const dqw_effect_q15_config *c = &e->list[k];
    const int32_t *p = e->part_q30[k];
    const int32_t half = dqw_q_round32(m->alpha_q28, 1);
    const int32_t side = times(m->beta_q28, SQRT3_2_Q30);
    switch (c->effect) {
    case DQW_EFFECT_DEAD_TIME:
        if (e->dead_time_apart) break;
        put_phases(m, soft_sign_q28(m->alpha_q28, p[0], e->shift[k]), soft_sign_q28(side - half, p[0], e->shift[k]),
                   soft_sign_q28(-half - side, p[0], e->shift[k]), m->f_d, m->f_q);
        break;
    case DQW_EFFECT_SATURATION:
    case DQW_EFFECT_CROSS_SATURATION: put_saturation(c->effect, m); break;
    case DQW_EFFECT_WINDING_TEMPERATURE: {
        const int32_t h = warmth_q28(e, c, s->temp_winding_cC, 0);
        m->f_d[0] = times(h, m->i_d_q15 * 32768);
        m->f_q[0] = times(h, m->i_q_q15 * 32768);
        break;
    }
    case DQW_EFFECT_MAGNET_TEMPERATURE: m->g_d[0] = warmth_q28(e, c, s->temp_magnet_cC, 1); break;
    case DQW_EFFECT_IRON_LOSS:
        m->g_d[0] = times(m->i_d_q15 * 8192, p[1]) - times(m->end_d_q28, p[0]);
        m->g_q[0] = times(m->i_q_q15 * 8192, p[3]) - times(m->end_q_q28, p[2]);
        break;
    case DQW_EFFECT_FLUX_HARMONICS: {
        int32_t cosine;
        int32_t sine;
        put_power(m, c->order, &cosine, &sine);
        m->g_d[0] = m->g_q[2] = q28(cosine);
        m->g_d[1] = m->g_q[3] = q28(sine);
        break;
    }
    case DQW_EFFECT_CURRENT_OFFSET:
        put_sensor(m, 0, p, ONE_Q28, 0);
        put_sensor(m, 1, p, 0, ONE_Q28);
        break;
    case DQW_EFFECT_CURRENT_GAIN_MISMATCH:
        put_sensor(m, 0, p, m->alpha_q28, -m->beta_q28);
        put_sensor(m, 1, p, m->beta_q28, m->alpha_q28);
        break;
    case DQW_EFFECT_ANGLE_OFFSET:
        m->g_d[0] = times(m->i_q_q15 * 8192, p[0]);
        m->g_q[0] = times(m->i_d_q15 * 8192, p[0]) - q28(p[1]);
        break;
    case DQW_EFFECT_SKIN_EFFECT: {
        const int32_t w2_q30 = m->w_m_q15 * m->w_m_q15;
        m->f_d[0] = times(w2_q30, m->i_d_q15 * 8192);
        m->f_q[0] = times(w2_q30, m->i_q_q15 * 8192);
        break;
    }
    case DQW_EFFECT_PHASE_RESISTANCE_IMBALANCE:
        put_phases(m, m->alpha_q28, 0, 0, &m->f_d[0], &m->f_q[0]);
        put_phases(m, 0, side - half, 0, &m->f_d[1], &m->f_q[1]);
        break;
    case DQW_EFFECT_FLUX_MAP: put_flux_map(c->map, p, m); break;
    case DQW_EFFECT_VOLTAGE_OFFSET: m->f_d[0] = m->f_q[1] = ONE_Q28; break;
    default: break;
    }
}

// (x, y) seen from a frame that has turned on: |.| <= 1.42.
static void put_seen(int16_t x_q15, int16_t y_q15, int32_t cos_q30, int32_t sin_q30, int32_t *d_q28, int32_t *q_q28)
{
    *d_q28 = (int32_t)dqw_q_round64((int64_t)cos_q30 * x_q15 + (int64_t)sin_q30 * y_q15, 17);
    *q_q28 = (int32_t)dqw_q_round64((int64_t)cos_q30 * y_q15 - (int64_t)sin_q30 * x_q15, 17);
}

// The voltage of the last row, as the rotor sees it at this sample, and what this row's is more than it; `last` NULL: a
// settled row, whose voltage was always there.
static void put_voltages(dqw_effect_q15 *e, const dqw_sample_q15 *last, const dqw_sample_q15 *s, moment *m)
{
    if (last == NULL) {
        m->end_d_q28 = s->v_d_q15 * 8192;
        m->end_q_q28 = s->v_q_q15 * 8192;
        e->late_d_q28 = -times(m->turn_q30, s->v_q_q15 * 8192);
        e->late_q_q28 = times(m->turn_q30, s->v_d_q15 * 8192);
        return;
    }
    // Half the turn, below 0.5: to its eighth power.
    const int32_t h = dqw_q_round32(m->turn_q30, 1);
    const int32_t h2 = times(h, h);
    const int32_t sine = times(h, ONE_Q30 + times(h2, -178956971 + times(h2, 8947849 - times(h2, 213044))));
    const int32_t cosine = ONE_Q30 + times(h2, -536870912 + times(h2, 44739243 - times(h2, 1491308)));
    put_seen(last->v_d_q15, last->v_q_q15, cosine, sine, &m->end_d_q28, &m->end_q_q28);
    int32_t old_d;
    int32_t old_q;
    put_seen(last->v_d_q15, last->v_q_q15, ONE_Q30 - 2 * times(sine, sine), 2 * times(sine, cosine), &old_d, &old_q);
    e->late_d_q28 = s->v_d_q15 * 8192 - old_d;
    e->late_q_q28 = s->v_q_q15 * 8192 - old_q;
}

// To the fraction of the window's sums; a settled row's is 28.
static int32_t coarse(const dqw_effect_q15 *e, int32_t x_q28)
{
    return e->fraction < 28u ? dqw_q_round32(x_q28, 28u - e->fraction) : x_q28;
}

// f + w_e J g and g of every weight.
static void evaluate(dqw_effect_q15 *e, const dqw_sample_q15 *last, const dqw_sample_q15 *s, int32_t a_d[],
                     int32_t a_q[], int32_t g_d[], int32_t g_q[])
{
    moment m = {.i_d_q15 = s->i_d_q15, .i_q_q15 = s->i_q_q15, .w_m_q15 = s->w_m_q15};
    m.turn_q30 = (int32_t)dqw_q_round64((int64_t)e->turn_q30 * s->w_m_q15, 15);
    if (e->needs_angle) {
        m.cos_q15 = s->cosine_q15;
        m.sin_q15 = s->sine_q15;
        m.alpha_q28 = q28(m.cos_q15 * m.i_d_q15 - m.sin_q15 * m.i_q_q15);
        m.beta_q28 = q28(m.sin_q15 * m.i_d_q15 + m.cos_q15 * m.i_q_q15);
    }
    if (e->needs_last) put_voltages(e, last, s, &m);
    for (int i = 0; i < e->weights; i++) a_d[i] = a_q[i] = g_d[i] = g_q[i] = 0;
    m.f_d = a_d;
    m.f_q = a_q;
    m.g_d = g_d;
    m.g_q = g_q;
    for (int k = 0; k < e->count; k++) {
        put(e, k, &m, s);
        const int weights = dqw_effect_weights_of_q15(e, e->list[k].effect);
        m.f_d += weights;
        m.f_q += weights;
        m.g_d += weights;
        m.g_q += weights;
    }
    for (int i = 0; i < e->weights; i++) {
        a_d[i] = coarse(e, a_d[i] - times(g_q[i], m.turn_q30));
        a_q[i] = coarse(e, a_q[i] + times(g_d[i], m.turn_q30));
        g_d[i] = coarse(e, g_d[i]);
        g_q[i] = coarse(e, g_q[i]);
    }
}

// What depends on the change of voltage at the start of a period holds for all of it: a delay; and the current that
// iron takes, whose step the samples before and after do not show.
static void add_late(const dqw_effect_q15 *e, int32_t d[], int32_t q[])
{
    int at = 0;
    for (int k = 0; k < e->count; k++) {
        // 2.42 times 2, or half of that; 0 of the others.
        const int32_t twice_q30 = e->part_q30[k][4];
        if (twice_q30 != 0) {
            d[at] += 2 * coarse(e, times(e->late_d_q28, twice_q30));
            q[at] += 2 * coarse(e, times(e->late_q_q28, twice_q30));
        }
        at += dqw_effect_weights_of_q15(e, e->list[k].effect);
    }
}

bool dqw_effect_pair_q15(dqw_effect_q15 *e, const dqw_sample_q15 *last, const dqw_sample_q15 *s, int32_t d[],
                         int32_t q[])
{
    if (e->count == 0) return true;
    int32_t a_d[DQW_EFFECT_WEIGHTS], a_q[DQW_EFFECT_WEIGHTS], g_d[DQW_EFFECT_WEIGHTS], g_q[DQW_EFFECT_WEIGHTS];
    const bool pair = last != NULL && e->has_sample;
    e->has_sample = last != NULL || !e->needs_last;
    if (!e->has_sample) return false;

    // The pair: what its first sample began, ...
    if (pair) {
        for (int i = 0; i < e->weights; i++) {
            d[i] = e->a_d[i];
            q[i] = e->a_q[i];
        }
        if (e->needs_last) add_late(e, d, q);
    }

    // ... and this one ends
    evaluate(e, last, s, a_d, a_q, g_d, g_q);
    for (int i = 0; i < e->weights; i++) {
        if (pair) {
            // Below 2 (2 + 2) in all: the slopes' sums are exact.
            d[i] += a_d[i] + 2 * (g_d[i] - e->g_d[i]);
            q[i] += a_q[i] + 2 * (g_q[i] - e->g_q[i]);
        }
        e->a_d[i] = a_d[i];
        e->a_q[i] = a_q[i];
        e->g_d[i] = g_d[i];
        e->g_q[i] = g_q[i];
    }
    return pair;
}

void dqw_effect_static_q15(dqw_effect_q15 *e, const dqw_sample_q15 *s, int32_t d[], int32_t q[])
{
    if (e->count == 0) return;
    int32_t g_d[DQW_EFFECT_WEIGHTS], g_q[DQW_EFFECT_WEIGHTS];
    evaluate(e, NULL, s, d, q, g_d, g_q);
    for (int i = 0; i < e->weights; i++) {
        d[i] *= 2;
        q[i] *= 2;
    }
    if (e->needs_last) add_late(e, d, q);
}

#else
typedef int dqw_effect_q15_has_no_laws;
#endif
