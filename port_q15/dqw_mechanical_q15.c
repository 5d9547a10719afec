#include "dqw_mechanical_q15.h"

#include <stddef.h>

#include "dqw_q15.h"

#define HALF_WINDOW 25
#define EXCITATION_Q15 66
#define READ_BLOCKS 4u
// Until so many blocks, read after powers of two as well.
#define FIRST_BLOCKS 16u
#define NOT_LEARNED INT64_MAX
// A weight whose variance fell by less than a hundredth of 10^6 was not learned: what it holds is its start value.
#define LEARNED_Q40 ((int64_t)10000 << 40)

// Signals of a pair, and inputs of the neuron: J, B, Coulomb friction where it is asked for, then the effects'.
enum { PLAIN = 4, SIGNALS = DQW_MECHANICAL_Q15_SIGNALS, INPUTS = DQW_FRICTION_Q15_VALUES };

#if DQW_EFFECT_WEIGHTS > 0
static int weights_of(const dqw_mechanical_q15 *m)
{
    return m->weights;
}

static enum dqw_status init_effects(dqw_mechanical_q15 *m, const dqw_mechanical_q15_config *c, int64_t start_q40[])
{
    if (c->effect_count > 0 && c->effects == NULL) return DQW_ERR_NULL;
    for (int k = 0; k < c->effect_count; k++) {
        const int weights = dqw_effect_weights(c->effects[k].effect);
        if (weights > DQW_EFFECT_WEIGHTS - m->weights) return DQW_ERR_SIZE;
        const enum dqw_status status = dqw_torque_init_q15(&m->effect[k], &c->effects[k], c->scale.w_full_mrad_s);
        if (status != DQW_OK) return status;
        for (int i = 0; i < weights; i++) start_q40[m->weights++] = dqw_q_quotient64(c->effects[k].start_uNm[i], c->scale.torque_full_uNm, 40);
    }
    m->effect_count = c->effect_count;
    return DQW_OK;
}

// The effects' inputs over the pair that this sample ends, sums of two, behind the plain signals.
static void pair_effects(dqw_mechanical_q15 *m, int16_t w_m_q15, uint16_t theta_m_turn, int32_t pair[])
{
    int32_t x_q15[DQW_EFFECT_WEIGHTS];
    int at = 0;
    for (int k = 0; k < m->effect_count; k++) {
        dqw_torque_at_q15(&m->effect[k], w_m_q15, theta_m_turn, x_q15 + at);
        at += dqw_effect_weights((enum dqw_effect_name)m->effect[k].effect);
    }
    for (int i = 0; i < at; i++) {
        pair[PLAIN + i] = m->x_last_q15[i] + x_q15[i];
        m->x_last_q15[i] = x_q15[i];
    }
}

// As dqw_effect_known: of weights of one effect, those whose deviation is below a quarter of the largest.
static void know_effects(const dqw_mechanical_q15 *m, dqw_friction_q15 *f)
{
    int first = DQW_FRICTION_Q15_PLAIN;
    for (int k = 0; k < m->effect_count; k++) {
        const int end = first + dqw_effect_weights((enum dqw_effect_name)m->effect[k].effect);
        int64_t largest_q40 = 0;
        for (int i = first; i < end; i++) {
            const int64_t size_q40 = f->value_q40[i] < 0 ? -f->value_q40[i] : f->value_q40[i];
            if (f->sd_q40[i] != NOT_LEARNED && size_q40 > largest_q40) largest_q40 = size_q40;
        }
        for (; first < end; first++)
            if (f->sd_q40[first] < dqw_q_floor64(largest_q40, 2)) f->known |= 1u << first;
    }
}
#else
static int weights_of(const dqw_mechanical_q15 *m)
{
    (void)m;
    return 0;
}

static enum dqw_status init_effects(dqw_mechanical_q15 *m, const dqw_mechanical_q15_config *c, int64_t start_q40[])
{
    (void)m;
    (void)c;
    (void)start_q40;
    return DQW_OK;
}

static void pair_effects(dqw_mechanical_q15 *m, int16_t w_m_q15, uint16_t theta_m_turn, int32_t pair[])
{
    (void)m;
    (void)w_m_q15;
    (void)theta_m_turn;
    (void)pair;
}

static void know_effects(const dqw_mechanical_q15 *m, dqw_friction_q15 *f)
{
    (void)m;
    (void)f;
}
#endif

enum dqw_status dqw_mechanical_scale_check(const dqw_mechanical_scale *scale)
{
    if (scale == NULL) return DQW_ERR_NULL;
    if (scale->torque_full_uNm < 1u || scale->torque_full_uNm > DQW_MECHANICAL_SCALE_MAX) return DQW_ERR_RANGE;
    if (scale->w_full_mrad_s < 1u || scale->w_full_mrad_s > DQW_SCALE_MAX) return DQW_ERR_RANGE;
    return scale->dt_ns >= 1u && scale->dt_ns <= 1000000000u ? DQW_OK : DQW_ERR_RANGE;
}

static int half_of(const dqw_mechanical_q15_config *c)
{
    return c->half_window != 0 ? c->half_window : HALF_WINDOW;
}

// J over torque_full dt half / w_full, the unit of its input's weight: 10^-9 kg m^2 mrad/s / (uNm ns) = 10^3.
static int64_t J_q40(const dqw_mechanical_q15_config *c)
{
    const int64_t per_torque_q20 = dqw_q_quotient64((int64_t)c->J_gmm2 * c->scale.w_full_mrad_s, (int64_t)c->scale.torque_full_uNm * half_of(c), 20);
    return dqw_q_quotient64(dqw_q_product64(per_torque_q20, 1000, 0), c->scale.dt_ns, 20);
}

// 10^-9 Nms/rad mrad/s / uNm = 10^-6
static int64_t B_q40(const dqw_mechanical_q15_config *c)
{
    return dqw_q_quotient64((int64_t)c->B_nNms_rad * c->scale.w_full_mrad_s, (int64_t)c->scale.torque_full_uNm * 1000000, 40);
}

enum dqw_status dqw_mechanical_init_q15(dqw_mechanical_q15 *m, const dqw_mechanical_q15_config *config)
{
    if (m == NULL || config == NULL) return DQW_ERR_NULL;
    const dqw_mechanical_q15_config *c = config;
    enum dqw_status status = dqw_mechanical_scale_check(&c->scale);
    if (status != DQW_OK) return status;
    if (c->excitation_q15 > DQW_SCALE_MOST_Q15) return DQW_ERR_RANGE;

    dqw_mechanical_q15 n = {.config = config};
    const bool soft = c->coulomb && c->coulomb_width_urad_s != 0;
    if (soft) n.coulomb_rate_q16 = dqw_soft_rate_q15(c->coulomb_width_urad_s, c->scale.w_full_mrad_s);
    if (soft && n.coulomb_rate_q16 == 0) return DQW_ERR_RANGE;
    int64_t start_q40[INPUTS] = {J_q40(c), B_q40(c)};
    const int first = c->coulomb ? 3 : 2;
    status = init_effects(&n, c, start_q40 + first);
    if (status == DQW_OK) status = dqw_axis_init_q15(&n.axis, first + weights_of(&n), start_q40);
    if (status == DQW_OK) status = dqw_window_init_q15(&n.window, half_of(c), PLAIN + weights_of(&n));
    if (status != DQW_OK) return status;
    dqw_gate_init(&n.gate, 0);
    const int64_t standstill_q15 = dqw_q_quotient64(c->standstill_urad_s, (int64_t)c->scale.w_full_mrad_s * 1000, 15);
    n.standstill_q15 = standstill_q15 > INT16_MAX ? INT16_MAX : (int32_t)standstill_q15;
    *m = n;
    return DQW_OK;
}

static int32_t direction(const dqw_mechanical_q15 *m, int16_t w_q15)
{
    if (!m->config->coulomb || (w_q15 <= m->standstill_q15 && w_q15 >= -m->standstill_q15)) return 0;
    if (m->coulomb_rate_q16 != 0) return dqw_soft_sign_q15(m->coulomb_rate_q16, w_q15);
    return w_q15 > 0 ? 32768 : -32768;
}

static int32_t mean(int32_t sum, int32_t part_q30, unsigned less)
{
    return dqw_q31_sat(dqw_q_round64((int64_t)sum * part_q30, less));
}

static uint32_t learn(dqw_mechanical_q15 *m, const int32_t sums[], uint16_t weight)
{
    // [MEC.1] the block's inputs, and which of them can teach their weight
    const dqw_mechanical_q15_config *c = m->config;
    // One over the weight is good to 1e-5, and the same for target and inputs: weights do not see it.
    const int32_t part_q30 = (int32_t)(1073741824u / weight);
    int32_t x_q28[INPUTS];
    int inputs = 0;
    // The step in half a block, so that it keeps its digits: |sum part half| < 2^(46 + 7).
    x_q28[inputs++] = dqw_q31_sat(dqw_q_round64((int64_t)sums[1] * part_q30 * half_of(c), 17));
    x_q28[inputs++] = mean(sums[2], part_q30, 18);
    if (c->coulomb) x_q28[inputs++] = mean(sums[3], part_q30, 18);
    for (int i = 0; i < weights_of(m); i++) x_q28[inputs++] = mean(sums[PLAIN + i], part_q30, 18);
    const int32_t least_q28 = (c->excitation_q15 != 0 ? c->excitation_q15 : EXCITATION_Q15) * 8192;
    uint32_t mask = 0;
    for (int i = 0; i < inputs; i++)
        if (x_q28[i] >= least_q28 || x_q28[i] <= -least_q28) mask |= 1u << i;
    const uint32_t event = mask != (1u << inputs) - 1u ? (uint32_t)DQW_EVENT_UNEXCITED : 0u;
    if (mask == 0) return event;

    // [MEC.2] one neuron for all of the shaft
    if (m->gate.blocks < UINT32_MAX) m->gate.blocks++;
    (void)dqw_axis_learn_q15(&m->axis, x_q28, mean(sums[0], part_q30, 17), mask);
    const uint32_t blocks = m->gate.blocks;
    const uint32_t every = c->read_blocks != 0 ? c->read_blocks : READ_BLOCKS;
    if (blocks % every == 0 || (blocks < FIRST_BLOCKS && (blocks & (blocks - 1u)) == 0)) dqw_mechanical_read_q15(m);
    return event | DQW_EVENT_LEARNED;
}

// A block for the background.
static uint32_t hand_over(dqw_mechanical_q15 *m)
{
    int32_t lost[SIGNALS];
    uint16_t weight;
    const bool taken = m->pending;
    const uint32_t event = dqw_window_end_q15(&m->window, taken ? lost : m->sums, &weight);
    if (event == DQW_EVENT_LEARNED && taken) {
        if (m->missed < UINT16_MAX) m->missed++;
    } else if (event == DQW_EVENT_LEARNED) {
        m->weight = weight;
        m->pending = true;
    } else if (event == DQW_EVENT_INCOMPLETE && m->gate.incomplete < UINT32_MAX) {
        m->gate.incomplete++;
    }
    return event;
}

uint32_t dqw_mechanical_step_q15(dqw_mechanical_q15 *m, int16_t torque_q15, int16_t w_m_q15, uint16_t theta_m_turn, bool saturated)
{
    // [MEC.3] may this sample be learned
    const dqw_gate_sample g = {.finite = true, .saturated = saturated || dqw_scale_beyond(torque_q15) || dqw_scale_beyond(w_m_q15)};
    uint32_t event = dqw_gate_check(&m->gate, g);

    // [MEC.4] the pair that it ends
    int32_t pair[SIGNALS] = {0};
    const bool good = event == 0;
    const bool paired = good && m->has_last;
    const int32_t direction_q15 = good ? direction(m, w_m_q15) : 0;
    if (paired) {
        pair[0] = m->torque_last_q15;
        pair[1] = w_m_q15 - m->w_last_q15;
        pair[2] = w_m_q15 + m->w_last_q15;
        pair[3] = direction_q15 + m->direction_last_q15;
    }
    if (good) pair_effects(m, w_m_q15, theta_m_turn, pair);
    dqw_window_add_q15(&m->window, paired ? pair : NULL, SIGNALS);
    m->has_last = good;
    m->torque_last_q15 = torque_q15;
    m->w_last_q15 = w_m_q15;
    m->direction_last_q15 = direction_q15;

    // [MEC.5] a block, where half a window is full
    if (dqw_window_full_q15(&m->window)) event |= hand_over(m);
    m->events |= event;
    return event;
}

void dqw_mechanical_gap_q15(dqw_mechanical_q15 *m)
{
    m->has_last = false;
    dqw_window_restart_q15(&m->window);
}

static const volatile bool *waits(const dqw_mechanical_q15 *m)
{
    return &m->pending;
}

uint32_t dqw_mechanical_background_q15(dqw_mechanical_q15 *m)
{
    if (!*waits(m)) return 0;
    // Volatile, as the flag that guards them.
    const volatile int32_t *from = m->sums;
    int32_t sums[SIGNALS];
    for (int i = 0; i < SIGNALS; i++) sums[i] = from[i];
    const uint16_t weight = *(const volatile uint16_t *)&m->weight;
    *(volatile bool *)&m->pending = false;
    const uint32_t event = learn(m, sums, weight);
    m->events |= event;
    return event;
}

// Root of a variance, per unit, and a covariance. Both are scaled to where the root has 30 bits.
static int64_t root_q40(int64_t variance_q56, int64_t cov_q40)
{
    if (variance_q56 <= 0 || cov_q40 <= 0) return 0;
    // An even number of bits, from Q96.
    const int less = ((int)dqw_q_bits64(variance_q56) + (int)dqw_q_bits64(cov_q40) - 60) / 2;
    const uint32_t root = dqw_q_root64((uint64_t)dqw_q_product64(variance_q56, cov_q40, -2 * less));
    return dqw_q_scale64(root, less - 8);
}

void dqw_mechanical_read_q15(dqw_mechanical_q15 *m)
{
    dqw_solution_q15 s;
    dqw_axis_solve_q15(&m->axis, &s);
    const int64_t variance_q56 = dqw_q_product64(dqw_axis_variance_q56(&m->axis, &s), dqw_axis_inflation_q20(&m->axis), -20);
    dqw_friction_q15 f = {.known = 0};
    f.sd_q40[DQW_COULOMB_Q15] = NOT_LEARNED;
    for (int i = 0; i < m->axis.normal.inputs; i++) {
        const int at = i < DQW_COULOMB_Q15 || m->config->coulomb ? i : i + 1;
        const bool learned = s.cov_q40[i] < LEARNED_Q40;
        f.value_q40[at] = s.w_q40[i];
        f.sd_q40[at] = learned ? root_q40(variance_q56, s.cov_q40[i]) : NOT_LEARNED;
    }
    // The weight of a step in half a block is J of one period over as many periods.
    f.value_q40[DQW_J_Q15] = dqw_q_product64(f.value_q40[DQW_J_Q15], half_of(m->config), 0);
    if (f.sd_q40[DQW_J_Q15] != NOT_LEARNED) f.sd_q40[DQW_J_Q15] = dqw_q_product64(f.sd_q40[DQW_J_Q15], half_of(m->config), 0);
    for (int i = DQW_J_Q15; i <= DQW_COULOMB_Q15; i++)
        if (f.value_q40[i] > 0 && f.sd_q40[i] < dqw_q_floor64(f.value_q40[i], 2)) f.known |= 1u << i;
    know_effects(m, &f);
    m->friction = f;
}
