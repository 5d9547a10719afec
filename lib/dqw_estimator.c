#include "dqw_estimator.h"

#include <math.h>
#include <stddef.h>

#include "dqw_number.h"

#define HALF_WINDOW 20
#define EXCITATION_PU 0.002f
#define THRESHOLD_PPM 50000u
// Blocks that stage 2 may take per sample of its reservoir, and that stage 3 takes before it is judged.
#define RANDOM_LIMIT 10u
#define ORDINAL_BLOCKS 100u
// No drive gives a sample of this many bases: least squares would weigh it as this squared blocks.
#define WILD 10.0f
// Stage 2: noisy samples move the weights by this much even when there is nothing left to learn.
#define RANDOM_STEP 0.5f
#define RANDOM_TOLERANCE 0.1f

static enum dqw_status check(const dqw_estimator_config *c)
{
    if (c->reservoir_d == NULL || c->reservoir_q == NULL || c->reservoir_d == c->reservoir_q) return DQW_ERR_NULL;
    if (c->reservoir < 2) return DQW_ERR_SIZE;
    if (c->regime != DQW_REGIME_DYNAMIC && c->regime != DQW_REGIME_STATIC) return DQW_ERR_RANGE;
    if (!dqw_is_positive(c->dt_s) || !dqw_is_positive(c->v_base_V) || !dqw_is_positive(c->i_base_A) || !dqw_is_positive(c->w_base_rad_s)) return DQW_ERR_RANGE;
    const float rest[] = {c->R_ohm, c->Ld_H, c->Lq_H, c->psi_Wb, c->v_limit_V, c->i_limit_A, c->excitation_pu};
    for (unsigned i = 0; i < sizeof rest / sizeof rest[0]; i++)
        if (!dqw_is_zero_or_positive(rest[i])) return DQW_ERR_RANGE;
    return DQW_OK;
}

// What the effects of a configuration ask for, in one place: without room for effects, nothing.
#if DQW_EFFECT_WEIGHTS > 0
static int weights_of(const dqw_estimator *e)
{
    return e->effect.weights;
}

static enum dqw_status init_effects(dqw_estimator *e, const dqw_estimator_config *c)
{
    const dqw_effect_base base = {c->dt_s, c->v_base_V, c->i_base_A, c->w_base_rad_s, c->pole_pairs, false};
    return dqw_effect_init(&e->effect, c->effects, c->effect_count, &base);
}

// Bases and start values of the effects' inputs, behind an axis' own `first`.
static void add_effects(const dqw_estimator *e, int first, dqw_learner_config *axis, float start[])
{
    for (int k = 0; k < e->effect.count; k++) {
        const float base = dqw_effect_input_base(&e->effect, k);
        const int weights = dqw_effect_weights(e->effect.list[k].effect);
        for (int i = 0; i < weights; i++) {
            axis->x_base[first] = base;
            start[first++] = e->effect.list[k].start[i];
        }
    }
    axis->inputs = first;
}

static bool finite_for_effects(const dqw_estimator *e, const dqw_sample *s)
{
    return dqw_effect_finite(&e->effect, s);
}

// Signals of the pair, or of the settled row, that this sample ends, behind the plain ones: d first, then q. False where there are none yet.
static bool pair_effects(dqw_estimator *e, const dqw_sample *s, bool good, float pair[])
{
    if (e->effect.count == 0) return true;
    float *x = pair + DQW_BLOCK_SIGNALS;
    bool there = good;
    if (!good)
        dqw_effect_gap(&e->effect);
    else if (e->regime == DQW_REGIME_STATIC)
        dqw_effect_static(&e->effect, s, x, x + weights_of(e));
    else
        there = dqw_effect_pair(&e->effect, e->last_good ? &e->last : NULL, s, x, x + weights_of(e));
    if (good && there) dqw_effect_dead_time(&e->effect, e->regime == DQW_REGIME_STATIC ? NULL : &e->last, s, x, x + weights_of(e));
    dqw_effect_heat(&e->effect, s->i_d_A, s->i_q_A);
    dqw_effect_warm(&e->effect, 1);
    return there;
}
#else
static int weights_of(const dqw_estimator *e)
{
    (void)e;
    return 0;
}

static enum dqw_status init_effects(dqw_estimator *e, const dqw_estimator_config *c)
{
    (void)e;
    (void)c;
    return DQW_OK;
}

static void add_effects(const dqw_estimator *e, int first, dqw_learner_config *axis, float start[])
{
    (void)e;
    (void)start;
    axis->inputs = first;
}

static bool finite_for_effects(const dqw_estimator *e, const dqw_sample *s)
{
    (void)e;
    (void)s;
    return true;
}

static bool pair_effects(dqw_estimator *e, const dqw_sample *s, bool good, float pair[])
{
    (void)e;
    (void)s;
    (void)good;
    (void)pair;
    return true;
}
#endif

// A block's signals, and a pair's: the plain model's, then the effects' of d and of q.
#define SIGNALS (DQW_BLOCK_SIGNALS + 2 * DQW_EFFECT_WEIGHTS)
#define INPUTS (DQW_Q_INPUTS + DQW_EFFECT_WEIGHTS)

static enum dqw_status init_axis(dqw_axis *axis, dqw_learner *coarse, const dqw_learner_config *config, const float start[])
{
    enum dqw_status status = dqw_axis_init(axis, config);
    if (status == DQW_OK) status = dqw_learner_init(coarse, config);
    for (int i = 0; status == DQW_OK && i < config->inputs; i++) {
        status = dqw_learner_set_weight(&axis->neuron, i, start[i]);
        if (status == DQW_OK) status = dqw_learner_set_weight(coarse, i, start[i]);
    }
    return status;
}

enum dqw_status dqw_estimator_init(dqw_estimator *e, const dqw_estimator_config *config)
{
    if (e == NULL || config == NULL) return DQW_ERR_NULL;
    enum dqw_status status = check(config);
    if (status != DQW_OK) return status;

    const float p = (float)(config->pole_pairs != 0 ? config->pole_pairs : 1);
    const float w_base = config->w_base_rad_s;
    dqw_learner_config d = {.step_size = RANDOM_STEP, .y_base = config->v_base_V, .indicator = true};
    d.x_base[DQW_IN_R] = config->i_base_A;
    d.x_base[DQW_IN_L] = config->i_base_A * w_base * p;
    d.x_base[DQW_IN_CROSS] = config->i_base_A * w_base;
    dqw_learner_config q = d;
    q.x_base[DQW_IN_FLUX] = w_base;
    float start_d[INPUTS] = {config->R_ohm, config->Ld_H, p * config->Lq_H};
    float start_q[INPUTS] = {config->R_ohm, config->Lq_H, p * config->Ld_H, p * config->psi_Wb};

    dqw_estimator n = {0};
    status = init_effects(&n, config);
    if (status != DQW_OK) return status;
    add_effects(&n, DQW_D_INPUTS, &d, start_d);
    add_effects(&n, DQW_Q_INPUTS, &q, start_q);
    dqw_random_config random = {
        .reservoir = config->reservoir_d, .capacity = config->reservoir, .draws = config->reservoir, .seed = config->seed, .tolerance = RANDOM_TOLERANCE};
    status = init_axis(&n.d, &n.coarse_d, &d, start_d);
    if (status == DQW_OK) status = init_axis(&n.q, &n.coarse_q, &q, start_q);
    if (status == DQW_OK)
        status = dqw_window_init(&n.window, config->half_window != 0 ? config->half_window : HALF_WINDOW, DQW_BLOCK_SIGNALS + 2 * weights_of(&n));
    if (status == DQW_OK) status = dqw_random_init(&n.random_d, &random);
    random.reservoir = config->reservoir_q;
    if (status == DQW_OK) status = dqw_random_init(&n.random_q, &random);
    if (status != DQW_OK) return status;

    dqw_gate_init(&n.gate, config->stale_limit);
    dqw_stage_init(&n.stage, config->threshold_ppm != 0 ? config->threshold_ppm : THRESHOLD_PPM, RANDOM_LIMIT * config->reservoir, ORDINAL_BLOCKS);
    dqw_stage_define(&n.stage);
    n.dt_s = config->dt_s;
    n.v_limit_V = config->v_limit_V > 0.0f ? config->v_limit_V : WILD * config->v_base_V;
    n.i_limit_A = config->i_limit_A > 0.0f ? config->i_limit_A : WILD * config->i_base_A;
    n.w_limit_rad_s = WILD * config->w_base_rad_s;
    n.excitation_pu = config->excitation_pu > 0.0f ? config->excitation_pu : EXCITATION_PU;
    n.pole_pairs = config->pole_pairs;
    n.regime = config->regime;
    *e = n;
    return DQW_OK;
}

static bool beyond(float x, float limit)
{
    return limit > 0.0f && fabsf(x) > limit;
}

static uint32_t admit(dqw_estimator *e, const dqw_sample *s, bool saturated)
{
    const dqw_gate_sample g = {
        .finite = isfinite(s->v_d_V) && isfinite(s->v_q_V) && isfinite(s->i_d_A) && isfinite(s->i_q_A) && isfinite(s->w_m_rad_s) && finite_for_effects(e, s),
        .saturated = saturated || beyond(s->v_d_V, e->v_limit_V) || beyond(s->v_q_V, e->v_limit_V) || beyond(s->i_d_A, e->i_limit_A) ||
                     beyond(s->i_q_A, e->i_limit_A) || beyond(s->w_m_rad_s, e->w_limit_rad_s),
        .repeated = e->has_last && s->i_d_A == e->last.i_d_A && s->i_q_A == e->last.i_q_A && s->w_m_rad_s == e->last.w_m_rad_s,
    };
    return dqw_gate_check(&e->gate, g);
}

// Inputs large enough to teach their weight.
static uint32_t excited(const dqw_learner *l, const float x[], float threshold_pu)
{
    uint32_t mask = 0;
    for (int i = 0; i < l->inputs; i++)
        if (fabsf(x[i]) * l->x_scale[i] >= threshold_pu) mask |= 1u << i;
    return mask;
}

static uint32_t ppm(float ratio)
{
    return ratio < 4000.0f ? (uint32_t)(ratio * 1e6f) : 4000000000u;
}

float dqw_estimator_relative_residual(const dqw_estimator *e)
{
    const float v2 = e->d.target_pu2 + e->q.target_pu2;
    return v2 > 0.0f ? sqrtf((e->d.error_pu2 + e->q.error_pu2 + e->parameters.misfit_pu2) / v2) : 0.0f;
}

static uint32_t learn(dqw_estimator *e, dqw_block *b, const float signals[])
{
    // [EST.1] regressors of both axes
    float x_d[INPUTS];
    float x_q[INPUTS];
    const int weights = weights_of(e);
    if (e->regime == DQW_REGIME_DYNAMIC) dqw_model_correct(b, &e->parameters, e->dt_s);
    dqw_model_inputs(b, x_d, x_q);
    for (int i = 0; i < weights; i++) {
        x_d[DQW_D_INPUTS + i] = signals[DQW_BLOCK_SIGNALS + i];
        x_q[DQW_Q_INPUTS + i] = signals[DQW_BLOCK_SIGNALS + weights + i];
    }

    // [EST.2] what can be learned from this block
    const uint32_t mask_d = excited(&e->d.neuron, x_d, e->excitation_pu);
    const uint32_t mask_q = excited(&e->q.neuron, x_q, e->excitation_pu);
    uint32_t event = dqw_gate_block(e->excited, mask_d, 0, DQW_D_INPUTS);
    event |= dqw_gate_block(e->excited, mask_q, DQW_D_INPUTS, DQW_Q_INPUTS);
    if (weights > 0) event |= dqw_gate_block(e->excited, mask_d >> DQW_D_INPUTS | mask_q >> DQW_Q_INPUTS, DQW_D_INPUTS + DQW_Q_INPUTS, (uint32_t)weights);
    if (mask_d == 0 && mask_q == 0) return event;
    if (e->gate.blocks < UINT32_MAX) e->gate.blocks++;

    // [EST.3] stage 2 remembers, every stage learns in order
    if (e->stage.name == DQW_STAGE_RANDOM) {
        dqw_random_put(&e->random_d, x_d, DQW_D_INPUTS + weights, b->v_d_V);
        dqw_random_put(&e->random_q, x_q, DQW_Q_INPUTS + weights, b->v_q_V);
    }
    if (mask_d != 0) (void)dqw_axis_learn(&e->d, x_d, b->v_d_V, mask_d);
    if (mask_q != 0) (void)dqw_axis_learn(&e->q, x_q, b->v_q_V, mask_q);
    e->parameters = dqw_model_read(&e->d, &e->q, e->pole_pairs, e->regime == DQW_REGIME_STATIC ? DQW_WEIGHT_COMMON : DQW_WEIGHT_EACH);

    // [EST.4] which stage
    const float v2 = e->d.target_pu2 + e->q.target_pu2;
    const dqw_stage_input in = {
        .random_converged = e->random_d.converged && e->random_q.converged,
        .residual_ppm = ppm(dqw_estimator_relative_residual(e)),
        .residual_recent_ppm = ppm(v2 > 0.0f ? sqrtf((e->d.recent_pu2 + e->q.recent_pu2) / v2) : 0.0f),
    };
    (void)dqw_stage_step(&e->stage, in);
    return event | DQW_EVENT_LEARNED;
}

uint32_t dqw_estimator_step(dqw_estimator *e, const dqw_sample *s, bool saturated)
{
    uint32_t event = admit(e, s, saturated);
    const bool good = event == 0;
    dqw_block b;
    float pair[SIGNALS] = {0};
    const bool has_effects = pair_effects(e, s, good, pair);
    if (e->regime == DQW_REGIME_STATIC) {
        if (good) {
            b = dqw_model_static(s);
            event = learn(e, &b, pair);
        }
    } else {
        float mean[SIGNALS];
        const bool paired = good && e->last_good && has_effects;
        if (paired) {
            b = dqw_model_pair(&e->last, s, e->dt_s);
            const float signals[] = {b.v_d_V, b.v_q_V, b.i_d_A, b.i_q_A, b.di_d_A_s, b.di_q_A_s, b.wi_d_A_rad_s, b.wi_q_A_rad_s, b.w_m_rad_s};
            for (int i = 0; i < DQW_BLOCK_SIGNALS; i++) pair[i] = signals[i];
        }
        const uint32_t window = dqw_window_step(&e->window, paired ? pair : NULL, mean);
        if (window == DQW_EVENT_LEARNED) {
            const dqw_block block = {mean[0], mean[1], mean[2], mean[3], mean[4], mean[5], mean[6], mean[7], mean[8]};
            b = block;
            event |= learn(e, &b, mean);
        } else if (window == DQW_EVENT_INCOMPLETE) {
            event |= window;
            if (e->gate.incomplete < UINT32_MAX) e->gate.incomplete++;
        }
    }
    // Staleness compares with whatever came last; a pair needs both of its samples good.
    e->has_last = true;
    e->last_good = good;
    e->last = *s;
    e->events |= event;
    return event;
}

void dqw_estimator_gap(dqw_estimator *e)
{
    e->has_last = e->last_good = false;
#if DQW_EFFECT_WEIGHTS > 0
    dqw_effect_gap(&e->effect);
#endif
    dqw_window_restart(&e->window);
}

enum dqw_status dqw_estimator_define(dqw_estimator *e, const dqw_estimator_config *config)
{
    if (e == NULL) return DQW_ERR_NULL;
    const dqw_gate gate = e->gate;
    uint32_t excited[DQW_GATE_INPUTS];
    for (int i = 0; i < DQW_GATE_INPUTS; i++) excited[i] = e->excited[i];
    const dqw_stage stage = e->stage;
    const uint32_t events = e->events;
    const enum dqw_status status = dqw_estimator_init(e, config);
    if (status != DQW_OK) return status;
    e->gate = gate;
    for (int i = 0; i < DQW_GATE_INPUTS; i++) e->excited[i] = excited[i];
    e->gate.stale_limit = config->stale_limit;
    e->stage.back = stage.back;
    e->stage.times_back = stage.times_back;
    e->stage.residual_ppm = stage.residual_ppm;
    e->events = events;
    return DQW_OK;
}

#if DQW_EFFECT_WEIGHTS > 0
int dqw_estimator_effect(const dqw_estimator *e, int index, float weights[], float sd[])
{
    if (index < 0 || index >= e->effect.count) return DQW_ERR_SIZE;
    int first = 0;
    for (int k = 0; k < index; k++) first += dqw_effect_weights(e->effect.list[k].effect);
    const int n = dqw_effect_weights(e->effect.list[index].effect);
    for (int i = 0; i < n; i++) {
        weights[i] = e->parameters.effect[first + i];
        sd[i] = e->parameters.effect_sd[first + i];
    }
    return (int)dqw_effect_known(weights, sd, n);
}
#endif

bool dqw_estimator_background(dqw_estimator *e)
{
    if (e->stage.name != DQW_STAGE_RANDOM) return e->random_d.converged && e->random_q.converged;
    const bool d = dqw_random_epoch(&e->random_d, &e->coarse_d);
    const bool q = dqw_random_epoch(&e->random_q, &e->coarse_q);
    return d && q;
}
