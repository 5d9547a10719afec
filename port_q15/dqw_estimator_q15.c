#include "dqw_estimator_q15.h"

#include <stddef.h>

#define HALF_WINDOW 20
#define EXCITATION_Q15 66
#define THRESHOLD_PPM 50000u
#define RANDOM_LIMIT 500u
#define ORDINAL_BLOCKS 100u
#define READ_BLOCKS 4u
// Until so many blocks, read after powers of two as well.
#define FIRST_BLOCKS 16u
#define RADIAN_Q28 268435456

// What the effects of a configuration ask for, in one place: without room for effects, nothing.
#if DQW_EFFECT_WEIGHTS > 0
static int weights_of(const dqw_estimator_q15 *e)
{
    return e->effect.weights;
}

static enum dqw_status init_effects(dqw_estimator_q15 *e)
{
    const dqw_estimator_q15_config *c = e->config;
    const dqw_effect_q15_base base = {.scale = &c->scale, .settled = c->settled, .half_window = c->half_window != 0 ? c->half_window : HALF_WINDOW};
    return dqw_effect_init_q15(&e->effect, c->effects, c->effect_count, &base);
}

// Start values of the effects' inputs, behind an axis' own `first`.
static void start_effects(const dqw_estimator_q15 *e, int64_t start_q40[], int first)
{
    for (int k = 0; k < e->effect.count; k++)
        for (int i = 0; i < dqw_effect_weights(e->effect.list[k].effect); i++)
            start_q40[first++] = dqw_effect_based_q40(&e->effect, k, i, e->effect.list[k].start_q40[i]);
}

static bool finite_for_effects(const dqw_estimator_q15 *e, const dqw_sample_q15 *s)
{
    return dqw_effect_finite_q15(&e->effect, s);
}

static bool beyond_for_effects(const dqw_estimator_q15 *e, const dqw_sample_q15 *s)
{
    return dqw_effect_saturated_q15(&e->effect, s);
}

// Signals of the pair, or of the settled row, that this sample ends, behind the plain ones: d first, then q. False where there are none yet.
static bool pair_effects(dqw_estimator_q15 *e, const dqw_sample_q15 *s, bool good, int32_t pair[])
{
    int32_t *x = pair + DQW_BLOCK_Q15_SIGNALS;
    for (int i = 0; i < 2 * DQW_EFFECT_WEIGHTS; i++) x[i] = 0;
    if (e->effect.count == 0) return true;
    bool there = good;
    if (!good)
        dqw_effect_gap_q15(&e->effect);
    else if (e->config->settled)
        dqw_effect_static_q15(&e->effect, s, x, x + weights_of(e));
    else
        there = dqw_effect_pair_q15(&e->effect, e->last_good ? &e->last : NULL, s, x, x + weights_of(e));
    dqw_effect_heat_q15(&e->effect, s->i_d_q15, s->i_q_q15);
    return there;
}

static void effect_inputs(const dqw_estimator_q15 *e, const int32_t sums[], uint16_t weight, int32_t x_d[], int32_t x_q[])
{
    const int weights = weights_of(e);
    for (int i = 0; i < weights; i++) {
        x_d[DQW_D_Q15_INPUTS + i] = dqw_effect_mean_q15(&e->effect, sums[DQW_BLOCK_Q15_SIGNALS + i], weight);
        x_q[DQW_Q_Q15_INPUTS + i] = dqw_effect_mean_q15(&e->effect, sums[DQW_BLOCK_Q15_SIGNALS + weights + i], weight);
    }
}

static uint32_t effects_excited(const dqw_estimator_q15 *e, const int32_t x_q28[], int first)
{
    const int32_t part_q15 = e->config->excitation_q15 != 0 ? e->config->excitation_q15 : EXCITATION_Q15;
    uint32_t mask = 0;
    int at = 0;
    for (int k = 0; k < e->effect.count; k++) {
        const int32_t least_q28 = (int32_t)dqw_q_round64((int64_t)e->effect.base_q28[k] * part_q15, 15);
        for (int i = 0; i < dqw_effect_weights(e->effect.list[k].effect); i++, at++)
            if (x_q28[first + at] >= least_q28 || x_q28[first + at] <= -least_q28) mask |= 1u << at;
    }
    return mask;
}
#else
static int weights_of(const dqw_estimator_q15 *e)
{
    (void)e;
    return 0;
}

static enum dqw_status init_effects(dqw_estimator_q15 *e)
{
    (void)e;
    return DQW_OK;
}

static void start_effects(const dqw_estimator_q15 *e, int64_t start_q40[], int first)
{
    (void)e;
    (void)start_q40;
    (void)first;
}

static bool finite_for_effects(const dqw_estimator_q15 *e, const dqw_sample_q15 *s)
{
    (void)e;
    (void)s;
    return true;
}

static bool beyond_for_effects(const dqw_estimator_q15 *e, const dqw_sample_q15 *s)
{
    (void)e;
    (void)s;
    return false;
}

static bool pair_effects(dqw_estimator_q15 *e, const dqw_sample_q15 *s, bool good, int32_t pair[])
{
    (void)e;
    (void)s;
    (void)good;
    (void)pair;
    return true;
}

static void effect_inputs(const dqw_estimator_q15 *e, const int32_t sums[], uint16_t weight, int32_t x_d[], int32_t x_q[])
{
    (void)e;
    (void)sums;
    (void)weight;
    (void)x_d;
    (void)x_q;
}

static uint32_t effects_excited(const dqw_estimator_q15 *e, const int32_t x_q28[], int first)
{
    (void)e;
    (void)x_q28;
    (void)first;
    return 0;
}
#endif

// A block's signals, and a pair's: the plain model's, then the effects' of d and of q.
#define SIGNALS (DQW_BLOCK_Q15_SIGNALS + 2 * DQW_EFFECT_WEIGHTS)
#define D_INPUTS (DQW_D_Q15_INPUTS + DQW_EFFECT_WEIGHTS)
#define Q_INPUTS (DQW_Q_Q15_INPUTS + DQW_EFFECT_WEIGHTS)

static int signals_of(const dqw_estimator_q15 *e)
{
    return DQW_BLOCK_Q15_SIGNALS + 2 * weights_of(e);
}

enum dqw_status dqw_estimator_init_q15(dqw_estimator_q15 *e, const dqw_estimator_q15_config *config)
{
    if (e == NULL || config == NULL) return DQW_ERR_NULL;
    const dqw_estimator_q15_config *c = config;
    enum dqw_status status = dqw_scale_check(&c->scale);
    if (status != DQW_OK) return status;
    const int64_t angle_q28 = dqw_scale_angle_q28(&c->scale);
    const int64_t p = c->scale.pole_pairs != 0 ? c->scale.pole_pairs : 1;
    if (c->excitation_q15 > DQW_SCALE_MOST_Q15 || angle_q28 < 1 || angle_q28 * p >= RADIAN_Q28) return DQW_ERR_RANGE;

    dqw_estimator_q15 n = {.config = config};
    const int64_t cross = angle_q28 * p;
    status = init_effects(&n);
    if (status != DQW_OK) return status;
    int64_t start_d[D_INPUTS] = {dqw_scale_R_q40(&c->scale, c->R_uohm), dqw_scale_L_q40(&c->scale, c->Ld_nH),
                                 dqw_q_product64(dqw_scale_L_q40(&c->scale, c->Lq_nH), cross, -28)};
    int64_t start_q[Q_INPUTS] = {dqw_scale_R_q40(&c->scale, c->R_uohm), dqw_scale_L_q40(&c->scale, c->Lq_nH),
                                 dqw_q_product64(dqw_scale_L_q40(&c->scale, c->Ld_nH), cross, -28),
                                 dqw_q_product64(dqw_scale_psi_q40(&c->scale, c->psi_nWb), cross, -28)};
    start_effects(&n, start_d, DQW_D_Q15_INPUTS);
    start_effects(&n, start_q, DQW_Q_Q15_INPUTS);
    status = dqw_axis_init_q15(&n.d, DQW_D_Q15_INPUTS + weights_of(&n), start_d);
    if (status == DQW_OK) status = dqw_axis_init_q15(&n.q, DQW_Q_Q15_INPUTS + weights_of(&n), start_q);
    if (status == DQW_OK) status = dqw_window_init_q15(&n.window, c->half_window != 0 ? c->half_window : HALF_WINDOW, signals_of(&n));
    if (status != DQW_OK) return status;

    dqw_gate_init(&n.gate, c->stale_limit);
    dqw_stage_init(&n.stage, c->threshold_ppm != 0 ? c->threshold_ppm : THRESHOLD_PPM, RANDOM_LIMIT, ORDINAL_BLOCKS);
    dqw_stage_define(&n.stage);
    const int32_t excitation = c->excitation_q15 != 0 ? c->excitation_q15 : EXCITATION_Q15;
    n.slope_least_q28 = dqw_q31_sat(dqw_q_product64(excitation * (int64_t)8192, cross, -28));
    *e = n;
    return DQW_OK;
}

static uint32_t admit(dqw_estimator_q15 *e, const dqw_sample_q15 *s, bool saturated)
{
    const dqw_gate_sample g = {
        .finite = finite_for_effects(e, s),
        .saturated = saturated || dqw_scale_beyond(s->v_d_q15) || dqw_scale_beyond(s->v_q_q15) || dqw_scale_beyond(s->i_d_q15) ||
                     dqw_scale_beyond(s->i_q_q15) || dqw_scale_beyond(s->w_m_q15) || beyond_for_effects(e, s),
        .repeated = e->has_last && s->i_d_q15 == e->last.i_d_q15 && s->i_q_q15 == e->last.i_q_q15 && s->w_m_q15 == e->last.w_m_q15,
    };
    return dqw_gate_check(&e->gate, g);
}

// Inputs large enough to teach their weight.
static uint32_t excited(const dqw_estimator_q15 *e, const int32_t x_q28[], int inputs)
{
    const int32_t usual_q28 = (e->config->excitation_q15 != 0 ? e->config->excitation_q15 : EXCITATION_Q15) * 8192;
    uint32_t mask = 0;
    for (int i = 0; i < inputs; i++) {
        const int32_t least_q28 = i == 1 ? e->slope_least_q28 : usual_q28;
        if (x_q28[i] >= least_q28 || x_q28[i] <= -least_q28) mask |= 1u << i;
    }
    return mask;
}

static uint32_t all_of(int inputs)
{
    return (1u << inputs) - 1u;
}

// Parts per million that the square root of a over b is.
static uint32_t ppm(int64_t a_q56, int64_t b_q56)
{
    if (b_q56 <= 0 || a_q56 <= 0) return 0;
    const int64_t ratio_q40 = dqw_q_quotient64(a_q56, b_q56, 40);
    // A million over 2^20 is 0.95367.
    return (uint32_t)(((uint64_t)dqw_q_root64((uint64_t)ratio_q40) * 1000000u) >> 20);
}

void dqw_estimator_read_q15(dqw_estimator_q15 *e)
{
    e->parameters = dqw_model_read_q15(&e->d, &e->q, &e->config->scale, e->config->settled);
}

static uint32_t learn(dqw_estimator_q15 *e, dqw_block_q15 *b, const int32_t sums[], uint16_t weight)
{
    // [EST.1] regressors of both axes
    int32_t x_d[D_INPUTS];
    int32_t x_q[Q_INPUTS];
    if (!e->config->settled) dqw_model_correct_q15(b, &e->parameters, &e->config->scale);
    dqw_model_inputs_q15(b, x_d, x_q);
    effect_inputs(e, sums, weight, x_d, x_q);

    // [EST.2] what can be learned from this block
    const uint32_t own_d = excited(e, x_d, DQW_D_Q15_INPUTS);
    const uint32_t own_q = excited(e, x_q, DQW_Q_Q15_INPUTS);
    const uint32_t effects_d = effects_excited(e, x_d, DQW_D_Q15_INPUTS);
    const uint32_t effects_q = effects_excited(e, x_q, DQW_Q_Q15_INPUTS);
    const bool all = own_d == all_of(DQW_D_Q15_INPUTS) && own_q == all_of(DQW_Q_Q15_INPUTS) && (effects_d | effects_q) == all_of(weights_of(e));
    uint32_t event = all ? 0u : (uint32_t)DQW_EVENT_UNEXCITED;
    const uint32_t mask_d = own_d | effects_d << DQW_D_Q15_INPUTS;
    const uint32_t mask_q = own_q | effects_q << DQW_Q_Q15_INPUTS;
    if (mask_d == 0 && mask_q == 0) return event;
    if (e->gate.blocks < UINT32_MAX) e->gate.blocks++;

    // [EST.3] stage 2 remembers, every stage learns in order
    if (mask_d != 0) (void)dqw_axis_learn_q15(&e->d, x_d, b->v_d, mask_d);
    if (mask_q != 0) (void)dqw_axis_learn_q15(&e->q, x_q, b->v_q, mask_q);
    const uint32_t blocks = e->gate.blocks;
    const uint32_t every = e->config->read_blocks != 0 ? e->config->read_blocks : READ_BLOCKS;
    if (blocks % every == 0 || (blocks < FIRST_BLOCKS && (blocks & (blocks - 1u)) == 0)) dqw_estimator_read_q15(e);

    // [EST.4] which stage
    const int64_t v2_q56 = e->d.target_q56 + e->q.target_q56;
    const dqw_stage_input in = {
        .random_converged = true,
        .residual_ppm = ppm(e->d.error_q56 + e->q.error_q56, v2_q56),
        .residual_recent_ppm = ppm(e->d.recent_q56 + e->q.recent_q56, v2_q56),
    };
    (void)dqw_stage_step(&e->stage, in);
    return event | DQW_EVENT_LEARNED;
}

static const volatile bool *waits(const dqw_estimator_q15 *e)
{
    return &e->pending;
}

uint32_t dqw_estimator_background_q15(dqw_estimator_q15 *e)
{
    if (!*waits(e)) return 0;
    // Volatile, as the flag that guards them.
    const volatile int32_t *from = e->sums;
    int32_t sums[SIGNALS];
    for (int i = 0; i < SIGNALS; i++) sums[i] = from[i];
    const uint16_t weight = *(const volatile uint16_t *)&e->weight;
    *(volatile bool *)&e->pending = false;
    dqw_block_q15 b = dqw_model_block_q15(sums, weight);
    const uint32_t event = learn(e, &b, sums, weight);
    e->events |= event;
    return event;
}

// A block for the background: a window's sums, or a settled row as one.
static uint32_t hand_over(dqw_estimator_q15 *e)
{
    int32_t lost[SIGNALS];
    uint16_t weight;
    const bool taken = e->pending;
    const uint32_t event = dqw_window_end_q15(&e->window, taken ? lost : e->sums, &weight);
    if (event == DQW_EVENT_LEARNED && taken) {
        if (e->missed < UINT16_MAX) e->missed++;
    } else if (event == DQW_EVENT_LEARNED) {
        e->weight = weight;
        e->pending = true;
    } else if (event == DQW_EVENT_INCOMPLETE && e->gate.incomplete < UINT32_MAX) {
        e->gate.incomplete++;
    }
    return event;
}

static uint32_t hand_over_row(dqw_estimator_q15 *e, const dqw_sample_q15 *s, const int32_t row[])
{
    if (e->pending) {
        if (e->missed < UINT16_MAX) e->missed++;
        return DQW_EVENT_LEARNED;
    }
    dqw_model_row_q15(s, e->sums);
    for (int i = DQW_BLOCK_Q15_SIGNALS; i < SIGNALS; i++) e->sums[i] = row[i];
    e->weight = 1;
    e->pending = true;
    return DQW_EVENT_LEARNED;
}

uint32_t dqw_estimator_step_q15(dqw_estimator_q15 *e, const dqw_sample_q15 *s, bool saturated)
{
    uint32_t event = admit(e, s, saturated);
    const bool good = event == 0;
    int32_t pair[SIGNALS];
    const bool has_effects = pair_effects(e, s, good, pair);
    if (e->config->settled) {
        if (good) event = hand_over_row(e, s, pair);
    } else {
        const bool paired = good && e->last_good && has_effects;
        if (paired) dqw_model_pair_q15(&e->last, s, pair);
        dqw_window_add_q15(&e->window, paired ? pair : NULL, signals_of(e));
        if (dqw_window_full_q15(&e->window)) event |= hand_over(e);
    }
    // Staleness compares with whatever came last; a pair needs both of its samples good.
    e->has_last = true;
    e->last_good = good;
    e->last = *s;
    e->events |= event;
    return event;
}

void dqw_estimator_gap_q15(dqw_estimator_q15 *e)
{
    e->has_last = e->last_good = false;
#if DQW_EFFECT_WEIGHTS > 0
    dqw_effect_gap_q15(&e->effect);
#endif
    dqw_window_restart_q15(&e->window);
}

#if DQW_EFFECT_WEIGHTS > 0
int dqw_estimator_effect_q15(const dqw_estimator_q15 *e, int index, int64_t weights_q40[], int64_t sd_q40[])
{
    if (index < 0 || index >= e->effect.count) return DQW_ERR_SIZE;
    int first = 0;
    for (int k = 0; k < index; k++) first += dqw_effect_weights(e->effect.list[k].effect);
    const int n = dqw_effect_weights(e->effect.list[index].effect);
    for (int i = 0; i < n; i++) {
        const int64_t sd = e->parameters.effect_sd_q40[first + i];
        weights_q40[i] = dqw_effect_restored_q40(&e->effect, index, i, e->parameters.effect_q40[first + i]);
        sd_q40[i] = sd != INT64_MAX ? dqw_effect_restored_q40(&e->effect, index, i, sd) : INT64_MAX;
    }
    return (int)dqw_effect_known_q15(weights_q40, sd_q40, n);
}
#endif
