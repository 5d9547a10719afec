// dqw_effect_gather(), dqw_effect_inputs(): the laws of the electrical effects. The interrupt gathers of each weight
// two numbers, from which the background makes its inputs on both axes: what a block says anyway, and what divides, is
// not gathered.
#include <math.h>
#include <stddef.h>

#include "dqw_effect.h"
#include "dqw_transform.h"

#if DQW_EFFECT_WEIGHTS > 0

#define SQRT3 1.7320508f

// Temperature differences of this size are the base of what the sample's temperature brings.
#define HEAT_BASE_K 50.0f
// A voltage one period late differs from the right one by no more than this part of the base, as a rule.
#define DELAY_BASE 0.1f

// What is gathered of an effect.
enum law {
    END = 0,
    SATURATION,
    CROSS_SATURATION,
    WINDING,
    WINDING_STATE,
    MAGNET,
    MAGNET_STATE,
    LATE,
    HARMONICS,
    OFFSET,
    GAIN_MISMATCH,
    SKIN,
    IMBALANCE,
    MAP,
    // The block says it all.
    NO_WEIGHT,
    ONE_WEIGHT,
    TWO_WEIGHTS
};

// What one unit of a weight brings at the machine's bases: a first factor, and what it is multiplied by.
enum { ONE, HEAT, FIRST, Z, L_V, FLUX, STEP, BY_W = 8, BY_W2 = 24, BY_I = 32 };

// An electrical effect: what is gathered of it, and its base. Its law is dqw_effect_gather_pair() and effect_inputs().
static const struct {
    uint8_t law, base;
} rows[DQW_EFFECT_NAMES] = {
    [DQW_EFFECT_DEAD_TIME] = {ONE_WEIGHT, ONE},
    [DQW_EFFECT_SATURATION] = {SATURATION, ONE | BY_W},
    [DQW_EFFECT_CROSS_SATURATION] = {CROSS_SATURATION, BY_W},
    [DQW_EFFECT_WINDING_TEMPERATURE] = {WINDING, HEAT | BY_I},
    [DQW_EFFECT_MAGNET_TEMPERATURE] = {MAGNET, HEAT | BY_W},
    [DQW_EFFECT_IRON_LOSS] = {LATE, L_V | BY_W},
    [DQW_EFFECT_FLUX_HARMONICS] = {HARMONICS, FIRST | BY_W},
    [DQW_EFFECT_CURRENT_OFFSET] = {OFFSET, Z},
    [DQW_EFFECT_CURRENT_GAIN_MISMATCH] = {GAIN_MISMATCH, Z | BY_I},
    [DQW_EFFECT_ANGLE_OFFSET] = {ONE_WEIGHT, FLUX | BY_W},
    [DQW_EFFECT_DELAY] = {LATE, STEP},
    [DQW_EFFECT_SKIN_EFFECT] = {SKIN, BY_W2 | BY_I},
    [DQW_EFFECT_PHASE_RESISTANCE_IMBALANCE] = {IMBALANCE, BY_I},
    [DQW_EFFECT_VOLTAGE_OFFSET] = {TWO_WEIGHTS, ONE},
    [DQW_EFFECT_FLUX_MAP] = {MAP, FIRST | BY_W},
};

static enum law law_of(const dqw_effect *e, enum dqw_effect_name name)
{
    if (dqw_effect_weights_of(e, name) == 0) return NO_WEIGHT;
    const enum law law = (enum law)rows[name].law;
    const bool state = law == WINDING ? (e->heating & 1u) != 0 : law == MAGNET && (e->heating & 2u) != 0;
    return state ? (enum law)(law + 1) : law;
}

float dqw_effect_input_base(const dqw_effect *e, int index)
{
    const float *s = e->list[index].shape;
    const float w_e = e->poles * e->base.w_m_rad_s;
    const float i = e->base.i_A;
    const unsigned by = rows[e->list[index].effect].base;
    float base = 1.0f;
    switch (by & 7u) {
    case HEAT: base = s[1] > 0.0f ? 1.0f : HEAT_BASE_K; break;
    case FIRST: base = s[0]; break;
    case Z: base = s[0] + fmaxf(s[1], s[2]) * w_e; break;
    case L_V: base = fmaxf(s[1], s[2]) * e->base.v_V; break;
    case FLUX: base = s[2] + fabsf(s[1] - s[0]) * i; break;
    case STEP: base = DELAY_BASE * e->base.v_V; break;
    default: break;
    }
    if ((by & BY_W) != 0) base *= w_e;
    if ((by & BY_W2) == BY_W2) base *= w_e;
    return (by & BY_I) != 0 ? base * i : base;
}

void dqw_effect_plan(dqw_effect *e)
{
    float *last = e->last;
    for (int k = 0; k < e->count; k++) {
        const enum law law = law_of(e, e->list[k].effect);
        if (law == OFFSET || law == GAIN_MISMATCH) last[2] = 0.5f * e->base.dt_s * e->list[k].shape[0];
        if (law == HARMONICS) {
            last[4] = 1.5f;
            last[5] = 0.5f;
        }
        if (law == MAP) {
            last[2] = 1.0f / e->list[k].shape[1];
            last[3] = 1.0f / e->list[k].shape[2];
        }
        e->law[k] = (uint8_t)law;
        last += 2 * (ptrdiff_t)dqw_effect_weights_of(e, e->list[k].effect);
    }
    e->law[e->count] = END;
}

// The analyser does not follow a list of laws: what one begins in a cell, and in `last`, was cleared for all.
// NOLINTBEGIN(clang-analyzer-core.uninitialized.Assign,clang-analyzer-core.NullDereference)

// The sum of a number over both ends of a pair. It is kept in `last`: two a weight.
DQW_INLINE float both(float *last, float x)
{
    const float two = x + *last;
    *last = x;
    return two;
}

// Speeds at both ends of a pair.
typedef struct speeds {
    float now, before;
} speeds;

DQW_INLINE speeds speeds_of(const dqw_sample *before, const dqw_sample *s)
{
    const speeds w = {s->w_m_rad_s, before->w_m_rad_s};
    return w;
}

// Half the angles that they turn by in a period.
DQW_INLINE speeds turns_of(const dqw_effect *e, const dqw_sample *before, const dqw_sample *s)
{
    const float half = e->turn_4 + e->turn_4;
    const speeds turn = {half * s->w_m_rad_s, half * before->w_m_rad_s};
    return turn;
}

// Two products into a cell.
DQW_INLINE void gather_two(dqw_window_cell *cell, float a, float x, float b, float y)
{
    float all = cell->sum;
    all += a * x;
    all += b * y;
    cell->sum = all;
    cell->fall += all;
}

// A flux linkage along one axis: its step, and what turns with the rotor.
DQW_INLINE void add_flux(dqw_window_cell *step_cell, dqw_window_cell *turn_cell, float *last, speeds w, float g)
{
    const float old = *last;
    *last = g;
    dqw_window_gather(step_cell, g - old);
    gather_two(turn_cell, w.now, g, w.before, old);
}

// A number of both ends on each axis.
DQW_INLINE void add_two(dqw_window_cell cell[], float last[], float x, float y)
{
    dqw_window_gather(&cell[0], both(&last[0], x));
    dqw_window_gather(&cell[1], both(&last[1], y));
}

// Powers of the currents. (E52)
DQW_INLINE void add_saturation(dqw_window_cell cell[], float last[], speeds w, float x, float y)
{
    const float x2 = x * x;
    const float y2 = y * y;
    const float y3 = y2 * y;
    add_flux(&cell[0], &cell[1], &last[0], w, x2);
    add_flux(&cell[2], &cell[3], &last[1], w, x2 * x);
    add_flux(&cell[4], &cell[5], &last[2], w, x2 * x2);
    add_flux(&cell[7], &cell[6], &last[3], w, y3);
    add_flux(&cell[9], &cell[8], &last[4], w, y3 * y2);
}

// A flux linkage along both axes: its inputs times the period.
DQW_INLINE void add_fluxes(dqw_window_cell cell[], float last[], speeds turn, float g_d, float g_q)
{
    const float old_d = last[0];
    const float old_q = last[1];
    last[0] = g_d;
    last[1] = g_q;
    dqw_window_gather(&cell[0], g_d - old_d - turn.now * g_q - turn.before * old_q);
    dqw_window_gather(&cell[1], g_q - old_q + turn.now * g_d + turn.before * old_d);
}

// (E52)'s, of x y^2 half. No constants in the laws: a compiler would load those of all for each.
DQW_INLINE void add_cross_saturation(dqw_window_cell cell[], float last[], speeds turn, float x, float y)
{
    const float y2 = y * y;
    const float xy = x * y;
    const float xy_2 = xy + xy;
    const float xy3_2 = xy_2 * y2;
    add_fluxes(&cell[0], &last[0], turn, y2, xy_2);
    add_fluxes(&cell[2], &last[2], turn, x * y2, x * xy);
    add_fluxes(&cell[4], &last[4], turn, y2 * y2, xy3_2 + xy3_2);
}

// Cosine and sine of n times the angle. The weights of q have the same. In last[4] and last[5] are 3/2 and 1/2.
DQW_INLINE void add_harmonics(dqw_window_cell cell[], float last[], speeds w, unsigned n, float c, float s)
{
    // To length 1, to first order: what a sensor's amplitude is off by would count n times.
    const float by = last[4] - last[5] * (c * c + s * s);
    float z_c = by * c;
    float z_s = by * s;
    bool begun = false;
    for (;;) {
        if ((n & 1u) != 0) {
            const float next = begun ? c * z_c - s * z_s : z_c;
            s = begun ? c * z_s + s * z_c : z_s;
            c = next;
            begun = true;
        }
        n >>= 1;
        if (n == 0) break;
        const float square = z_c * z_c - z_s * z_s;
        z_s = z_c * z_s;
        z_s += z_s;
        z_c = square;
    }
    add_flux(&cell[0], &cell[1], &last[0], w, c);
    add_flux(&cell[2], &cell[3], &last[1], w, s);
}

// In nodes, none below 0 or beyond the last.
DQW_INLINE float within(float x, int nodes)
{
    const float end = (float)(nodes - 1);
    const float low = x > 0.0f ? x : 0.0f;
    return low < end ? low : end;
}

// The node before x, one that another follows.
DQW_INLINE int node_of(float x, int nodes)
{
    const int k = (int)x;
    return k < nodes - 1 ? k : nodes - 2;
}

DQW_INLINE float lerp(float a, float b, float part)
{
    return a + part * (b - a);
}

// Between four nodes of a table, at currents in cells; beyond it what stands at its edge. (E165)
DQW_INLINE void add_flux_map(dqw_window_cell cell[], float last[], speeds w, const int16_t *map, float i_d, float i_q)
{
    const int nodes = map[2];
    const float x = within(i_d * last[2] + (float)map[1], map[0]);
    const float y = within(fabsf(i_q) * last[3], nodes);
    const int k = node_of(x, map[0]);
    const int n = node_of(y, nodes);
    const float u = x - (float)k;
    const float v = y - (float)n;
    const int16_t *a = map + DQW_EFFECT_MAP_HEAD + 2 * (ptrdiff_t)(k * nodes + n);
    const int16_t *b = a + 2 * (ptrdiff_t)nodes;
    const float g_d = lerp(lerp(a[0], a[2], v), lerp(b[0], b[2], v), u);
    const float g_q = lerp(lerp(a[1], a[3], v), lerp(b[1], b[3], v), u);
    add_flux(&cell[0], &cell[1], &last[0], w, g_d);
    add_flux(&cell[3], &cell[2], &last[1], w, i_q < 0.0f ? -g_q : g_q);
}

// Three products into a cell.
DQW_INLINE void gather_three(dqw_window_cell *cell, float a, float x, float b, float y, float c, float z)
{
    float sum = cell->sum;
    sum += a * x;
    sum += b * y;
    sum += c * z;
    cell->sum = sum;
    cell->fall += sum;
}

// A sensor adds (d, -q) to the true current, and that turned by a quarter: up to signs the inputs times the period. In
// last[2] is R dt/2. (E53)
DQW_INLINE void add_sensor(dqw_window_cell cell[], float last[], const float shape[], float turn, float d, float q)
{
    const float L_d = shape[1];
    const float L_q = shape[2];
    const float R = last[2];
    const float old_d = last[0];
    const float old_q = last[1];
    last[0] = d;
    last[1] = q;
    const float turn_d = turn * L_d;
    const float turn_q = turn * L_q;
    const float step_d = d - old_d;
    const float step_q = q - old_q;
    const float both_d = d + old_d;
    const float both_q = q + old_q;
    gather_three(&cell[0], R, both_d, L_d, step_d, turn_q, both_q);
    gather_three(&cell[1], R, both_q, L_q, step_q, -turn_d, both_d);
    gather_three(&cell[2], R, both_q, L_d, step_q, -turn_q, both_d);
    gather_three(&cell[3], R, both_d, L_q, step_d, turn_d, both_q);
}

// The current's alpha and beta along the axes.
DQW_INLINE void add_imbalance(dqw_window_cell cell[], float last[], const dqw_sample *s)
{
    const float c = s->cosine;
    const float sine = s->sine;
    const float alpha = c * s->i_d_A - sine * s->i_q_A;
    const float beta = sine * s->i_d_A + c * s->i_q_A;
    add_two(&cell[0], &last[0], c * alpha, sine * alpha);
    add_two(&cell[2], &last[2], c * beta, sine * beta);
}

// The voltage of the row before.
DQW_INLINE void add_late(dqw_window_cell cell[], float last[], const dqw_sample *before)
{
    dqw_window_gather(&cell[0], last[0]);
    dqw_window_gather(&cell[1], last[1]);
    last[0] = before->v_d_V;
    last[1] = before->v_q_V;
}

DQW_INLINE void add_magnet(dqw_window_cell cell[], float last[], float h)
{
    const float old = last[0];
    last[0] = h;
    dqw_window_gather(&cell[0], h - old);
    dqw_window_gather(&cell[1], h);
}

DQW_INLINE void add_skin(dqw_window_cell cell[], float last[], const dqw_sample *s)
{
    const float square = s->w_m_rad_s * s->w_m_rad_s;
    add_two(cell, last, square * s->i_d_A, square * s->i_q_A);
}

// True, so that it can stand for its caller's result.
bool dqw_effect_gather_pair(dqw_effect *e, const dqw_sample *before, const dqw_sample *s, dqw_window_cell *cell)
{
    const dqw_effect_config *c = e->list;
    float *last = e->last;
    const uint8_t *law = e->law;
    for (;;) {
        ptrdiff_t weights = 0;
        switch ((enum law) * law) {
        case SATURATION:
            add_saturation(cell, last, speeds_of(before, s), s->i_d_A, s->i_q_A);
            weights = 5;
            break;
        case CROSS_SATURATION:
            add_cross_saturation(cell, last, turns_of(e, before, s), s->i_d_A, s->i_q_A);
            weights = 3;
            break;
        case WINDING:
            dqw_window_gather(&cell[0], both(&last[0], s->temp_winding_C - c->shape[0]));
            weights = 1;
            break;
        case WINDING_STATE:
            dqw_window_gather(&cell[0], both(&last[0], e->heat[0]));
            weights = 1;
            break;
        case MAGNET:
            add_magnet(cell, last, s->temp_magnet_C - c->shape[0]);
            weights = 1;
            break;
        case MAGNET_STATE:
            add_magnet(cell, last, e->heat[1]);
            weights = 1;
            break;
        case LATE:
            add_late(cell, last, before);
            weights = 1;
            break;
        case HARMONICS:
            add_harmonics(cell, last, speeds_of(before, s), (unsigned)c->shape[0], s->cosine, s->sine);
            weights = 4;
            break;
        case OFFSET:
        case GAIN_MISMATCH: {
            float d = s->cosine;
            float q = s->sine;
            if (*law == GAIN_MISMATCH) {
                const float cosine = d * d - q * q;
                const float half_sine = d * q;
                const float sine = half_sine + half_sine;
                d = cosine * s->i_d_A - sine * s->i_q_A;
                q = sine * s->i_d_A + cosine * s->i_q_A;
            }
            add_sensor(cell, last, c->shape, e->turn_4 * (s->w_m_rad_s + before->w_m_rad_s), d, q);
            weights = 2;
            break;
        }
        case SKIN:
            add_skin(cell, last, s);
            weights = 1;
            break;
        case IMBALANCE:
            add_imbalance(cell, last, s);
            weights = 2;
            break;
        case MAP:
            add_flux_map(cell, last, speeds_of(before, s), c->map, s->i_d_A, s->i_q_A);
            weights = 2;
            break;
        case TWO_WEIGHTS: weights = 2; break;
        case ONE_WEIGHT: weights = 1; break;
        case NO_WEIGHT:
        case END:
        default: break;
        }
        law++;
        if (*law == END) return true;
        c++;
        cell += 2 * weights;
        last += 2 * weights;
    }
}

// NOLINTEND(clang-analyzer-core.uninitialized.Assign,clang-analyzer-core.NullDereference)

// A pair's other end, for the next one.
DQW_APART bool begin_pair(dqw_effect *e, const dqw_sample *last, const dqw_sample *s)
{
    dqw_window_cell lost[2 * DQW_EFFECT_WEIGHTS];
    for (int i = 0; i < 2 * e->weights; i++) lost[i].sum = lost[i].fall = 0.0f;
    e->has_sample = last != NULL || !e->needs_last;
    (void)dqw_effect_gather_pair(e, last != NULL ? last : s, s, lost);
    return false;
}

bool dqw_effect_begin(dqw_effect *e, const dqw_sample *last, const dqw_sample *s)
{
    return e->count == 0 ? last != NULL : begin_pair(e, last, s);
}

static dqw_dq turned(float cosine, float sine, float d, float q)
{
    const dqw_alphabeta x = {d, q};
    return dqw_park(x, cosine, sine);
}

// From the numbers of a flux linkage along one axis.
static void flux_inputs(const dqw_effect *e, int along, float scale, float *d, float *q)
{
    float *const step = along == 0 ? d : q;
    float *const turns = along == 0 ? q : d;
    *step *= e->step_Hz * scale;
    *turns *= along == 0 ? 2.0f * e->poles_4 * scale : -2.0f * e->poles_4 * scale;
}

static void saturation_inputs(const dqw_effect *e, float unit_A, float d[], float q[])
{
    static const int along[] = {0, 0, 0, 1, 1};
    const float x = 1.0f / unit_A;
    const float power[] = {x * x, x * x * x, x * x * x * x, x * x * x, x * x * x * x * x};
    for (int i = 0; i < 5; i++) flux_inputs(e, along[i], power[i], &d[i], &q[i]);
}

// What a voltage one period late lacks; of a settled one, whose period is any time, the first order. (E51)
static dqw_dq late_V(const dqw_effect *e, const dqw_block *b, bool settled, dqw_dq before)
{
    const float turn = e->poles * b->w_m_rad_s * e->base.dt_s;
    dqw_dq late = {-turn * b->v_q_V, turn * b->v_d_V};
    if (settled) return late;
    float cosine;
    float sine;
    dqw_cosine_sine(turn, &cosine, &sine);
    const dqw_dq seen = turned(cosine, sine, before.d, before.q);
    late.d = b->v_d_V - seen.d;
    late.q = b->v_q_V - seen.q;
    return late;
}

// (E52), v as the rotor sees it half a period later.
static void iron_inputs(const dqw_effect *e, const float shape[], const dqw_block *b, bool settled, float *d, float *q)
{
    const float R = shape[0];
    dqw_dq v = {b->v_d_V, b->v_q_V};
    dqw_dq step = {0.0f, 0.0f};
    dqw_dq late = {0.0f, 0.0f};
    if (!settled) {
        const dqw_dq before = {*d, *q};
        late = late_V(e, b, false, before);
        float cosine;
        float sine;
        dqw_cosine_sine(0.5f * e->poles * b->w_m_rad_s * e->base.dt_s, &cosine, &sine);
        step = turned(cosine, sine, v.d - before.d, v.q - before.q);
        v = turned(cosine, sine, 0.5f * (v.d + before.d), 0.5f * (v.q + before.q));
    }
    *d = -shape[1] * (step.d * e->step_Hz - R * b->di_d_A_s) +
         e->poles * shape[2] * (b->w_m_rad_s * v.q - R * b->wi_q_A_rad_s) + 0.5f * R * late.d;
    *q = -shape[2] * (step.q * e->step_Hz - R * b->di_q_A_s) -
         e->poles * shape[1] * (b->w_m_rad_s * v.d - R * b->wi_d_A_rad_s) + 0.5f * R * late.q;
}

static void effect_inputs(const dqw_effect *e, const dqw_effect_config *c, const dqw_block *b, bool settled, float d[],
                          float q[])
{
    const float *s = c->shape;
    switch (c->effect) {
    case DQW_EFFECT_SATURATION: saturation_inputs(e, s[0], d, q); break;
    case DQW_EFFECT_CROSS_SATURATION: {
        const float x = 1.0f / s[0];
        const float power[] = {x * x, 2.0f * x * x * x, x * x * x * x};
        for (int i = 0; i < 3; i++) {
            d[i] *= e->step_Hz * power[i];
            q[i] *= e->step_Hz * power[i];
        }
        break;
    }
    case DQW_EFFECT_WINDING_TEMPERATURE:
        q[0] = 0.5f * d[0] * b->i_q_A;
        d[0] = 0.5f * d[0] * b->i_d_A;
        break;
    case DQW_EFFECT_MAGNET_TEMPERATURE:
        d[0] *= e->step_Hz;
        q[0] *= e->poles * b->w_m_rad_s;
        break;
    case DQW_EFFECT_IRON_LOSS: iron_inputs(e, s, b, settled, d, q); break;
    case DQW_EFFECT_FLUX_HARMONICS:
        for (int i = 0; i < 2; i++) {
            flux_inputs(e, 0, 1.0f, &d[i], &q[i]);
            d[i + 2] = -q[i];
            q[i + 2] = d[i];
        }
        break;
    case DQW_EFFECT_CURRENT_OFFSET:
    case DQW_EFFECT_CURRENT_GAIN_MISMATCH:
        d[0] *= -e->step_Hz;
        q[0] *= e->step_Hz;
        d[1] *= -e->step_Hz;
        q[1] *= -e->step_Hz;
        break;
    case DQW_EFFECT_ANGLE_OFFSET: {
        const float L = s[1] - s[0];
        d[0] = L * b->di_q_A_s - e->poles * (L * b->wi_d_A_rad_s - s[2] * b->w_m_rad_s);
        q[0] = L * b->di_d_A_s + e->poles * L * b->wi_q_A_rad_s;
        break;
    }
    case DQW_EFFECT_DELAY: {
        const dqw_dq before = {d[0], q[0]};
        const dqw_dq late = late_V(e, b, settled, before);
        d[0] = late.d;
        q[0] = late.q;
        break;
    }
    case DQW_EFFECT_SKIN_EFFECT:
        d[0] *= 0.5f * e->poles * e->poles;
        q[0] *= 0.5f * e->poles * e->poles;
        break;
    case DQW_EFFECT_PHASE_RESISTANCE_IMBALANCE: {
        // Of phase b, from alpha and beta.
        const float along = 0.5f * (SQRT3 * d[1] - d[0]);
        const float across = 0.5f * (SQRT3 * q[1] - q[0]);
        d[0] *= 1.0f / 3.0f;
        q[0] *= -1.0f / 3.0f;
        d[1] = 0.5f * (across * (1.0f / SQRT3) - along * (1.0f / 3.0f));
        q[1] = 0.5f * (along * (1.0f / SQRT3) + across * (1.0f / 3.0f));
        break;
    }
    case DQW_EFFECT_VOLTAGE_OFFSET:
        d[0] = q[1] = 1.0f;
        d[1] = q[0] = 0.0f;
        break;
    case DQW_EFFECT_FLUX_MAP:
        for (int i = 0; i < 2; i++) flux_inputs(e, i, s[0] * (1.0f / 32768.0f), &d[i], &q[i]);
        break;
    default: break;
    }
}

static void inputs(const dqw_effect *e, const dqw_block *b, bool settled, float d[], float q[])
{
    for (int k = 0; k < e->count; k++) {
        effect_inputs(e, &e->list[k], b, settled, d, q);
        const int weights = dqw_effect_weights_of(e, e->list[k].effect);
        d += weights;
        q += weights;
    }
}

void dqw_effect_inputs(const dqw_effect *e, const dqw_block *b, float d[], float q[])
{
    inputs(e, b, false, d, q);
}

// The numbers that a pair adds, apart.
static void take(const dqw_effect *e, const dqw_window_cell cell[], float d[], float q[])
{
    for (ptrdiff_t i = 0; i < e->weights; i++) {
        d[i] = cell[2 * i].sum;
        q[i] = cell[2 * i + 1].sum;
    }
}

bool dqw_effect_pair(dqw_effect *e, const dqw_sample *last, const dqw_sample *s, float d[], float q[])
{
    if (e->count == 0) return true;
    dqw_window_cell cell[2 * DQW_EFFECT_WEIGHTS] = {{0.0f, 0.0f}};
    if (!dqw_effect_gather(e, last, s, cell)) return false;
    take(e, cell, d, q);
    const dqw_block b = dqw_model_pair(last, s, e->base.dt_s);
    inputs(e, &b, false, d, q);
    return true;
}

void dqw_effect_static(dqw_effect *e, const dqw_sample *s, float d[], float q[])
{
    if (e->count == 0) return;
    dqw_window_cell cell[2 * DQW_EFFECT_WEIGHTS] = {{0.0f, 0.0f}};
    (void)dqw_effect_begin(e, s, s);
    (void)dqw_effect_gather_pair(e, s, s, cell);
    take(e, cell, d, q);
    const dqw_block b = dqw_model_static(s);
    inputs(e, &b, true, d, q);
}

#else
typedef int dqw_effect_has_no_laws;
#endif
