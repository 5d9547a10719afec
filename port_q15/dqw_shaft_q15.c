// dqw_shaft_q15: the start, and what the interrupt does. dqw_shaft_learn_q15.c has the background.
#include "dqw_shaft_q15.h"
#include "dqw_effect_kind.h"

#include <stddef.h>

#include "dqw_q15.h"

#define HALF_WINDOW 25
// By default: half a block in time and samples; full scales in quarters of the rated values; parts of a rated speed in
// mrad/s are 10 urad/s.
#define DEFAULT_HALF_NS 25000000u
#define DEFAULT_HALF_LEAST 10u
#define DEFAULT_TORQUE_QUARTERS 12u
#define DEFAULT_SPEED_QUARTERS 6u
#define DEFAULT_WIDTH_URAD_MRAD 10u
#define DT_MAX_NS 1000000000u
// What a start value is believed: a millionth of one block of full scale.
#define START_INFORMATION_Q32 4295
#define NOT_LEARNED INT64_MAX

// Where a pair has its signals; the effects' stand behind.
enum { TORQUE = 0, STEP, SPEEDS, DIRECTIONS, PLAIN, SIGNALS = DQW_SHAFT_Q15_SIGNALS, INPUTS = DQW_SHAFT_Q15_INPUTS };

// A rated value with room above it, as far as there is any. What is too large stays too large.
static uint32_t full_of(uint32_t rated, uint32_t quarters, uint32_t most)
{
    const uint64_t full = (uint64_t)rated * quarters / 4u;
    return rated > most ? rated : full < most ? (uint32_t)full : most;
}

dqw_shaft_q15_config dqw_shaft_config_default_q15(const dqw_shaft_q15_nameplate *nameplate)
{
    dqw_shaft_q15_config c = {.coulomb = false};
    if (nameplate == NULL) return c;
    c.scale.torque_full_uNm = full_of(nameplate->torque_uNm, DEFAULT_TORQUE_QUARTERS, DQW_SHAFT_TORQUE_MAX);
    c.scale.w_full_mrad_s = full_of(nameplate->w_m_mrad_s, DEFAULT_SPEED_QUARTERS, DQW_SCALE_MAX);
    c.scale.dt_ns = nameplate->dt_ns;
    c.coulomb = true;
    c.coulomb_width_urad_s = nameplate->w_m_mrad_s <= DQW_SCALE_MAX ? DEFAULT_WIDTH_URAD_MRAD * nameplate->w_m_mrad_s
                                                                    : 0u;
    const uint32_t half = nameplate->dt_ns > 0u ? (DEFAULT_HALF_NS + nameplate->dt_ns / 2u) / nameplate->dt_ns : 0u;
    c.half_window = (uint8_t)(half < DEFAULT_HALF_LEAST    ? DEFAULT_HALF_LEAST
                              : half < DQW_WINDOW_Q15_HALF ? half
                                                           : DQW_WINDOW_Q15_HALF);
    return c;
}

static enum dqw_status check(const dqw_shaft_q15_config *c)
{
    const dqw_shaft_scale *scale = &c->scale;
    if (scale->dt_ns < 1u || scale->dt_ns > DT_MAX_NS) return DQW_ERR_DT;
    if (scale->torque_full_uNm < 1u || scale->torque_full_uNm > DQW_SHAFT_TORQUE_MAX) return DQW_ERR_TORQUE_BASE;
    if (scale->w_full_mrad_s < 1u || scale->w_full_mrad_s > DQW_SCALE_MAX) return DQW_ERR_W_BASE;
    if (c->half_window > DQW_WINDOW_Q15_HALF) return DQW_ERR_HALF_WINDOW;
    if (c->excitation_q15 > DQW_SCALE_MOST_Q15) return DQW_ERR_EXCITATION;
    const bool soft = c->coulomb && c->coulomb_width_urad_s != 0;
    return soft && dqw_soft_rate_q15(c->coulomb_width_urad_s, scale->w_full_mrad_s) == 0 ? DQW_ERR_COULOMB_WIDTH
                                                                                         : DQW_OK;
}

static int half_of(const dqw_shaft_q15_config *c)
{
    return c->half_window != 0 ? c->half_window : HALF_WINDOW;
}

// J over torque_full dt half / w_full, the unit of its input's weight: 10^-9 kg m^2 mrad/s / (uNm ns) = 10^3.
static int64_t J_q40(const dqw_shaft_q15_config *c)
{
    const int64_t per_torque_q20 = dqw_q_quotient64((int64_t)c->J_gmm2 * c->scale.w_full_mrad_s,
                                                    (int64_t)c->scale.torque_full_uNm * half_of(c), 20);
    return dqw_q_quotient64(dqw_q_product64(per_torque_q20, 1000, 0), c->scale.dt_ns, 20);
}

// 10^-9 Nms/rad mrad/s / uNm = 10^-6
static int64_t B_q40(const dqw_shaft_q15_config *c)
{
    return dqw_q_quotient64((int64_t)c->B_nNms_rad * c->scale.w_full_mrad_s,
                            (int64_t)c->scale.torque_full_uNm * 1000000, 40);
}

static enum dqw_status init_effects(dqw_shaft_q15 *s, const dqw_shaft_q15_config *c)
{
#if DQW_EFFECT_WEIGHTS > 0
    if (c->effect_count > 0 && c->effects == NULL) return DQW_ERR_EFFECT_LIST;
    for (int k = 0; k < c->effect_count; k++) {
        const dqw_torque_q15_config *e = &c->effects[k];
        const int weights = dqw_effect_weights(e->effect);
        if (!dqw_effect_is_mechanical(e->effect)) return DQW_ERR_EFFECT_NAME;
        if (weights > DQW_EFFECT_WEIGHTS - s->weights) return DQW_ERR_EFFECT_ROOM;
        if (dqw_torque_init_q15(&s->effect[k], e, c->scale.w_full_mrad_s) != DQW_OK) return DQW_ERR_EFFECT_SHAPE;
        for (int i = 0; i < weights; i++, s->inputs++)
            s->w_q40[s->inputs] = s->start_q40[s->inputs] = dqw_q_quotient64(e->start_uNm[i], c->scale.torque_full_uNm,
                                                                             40);
        s->weights = (uint8_t)(s->weights + weights);
    }
    s->effect_count = c->effect_count;
#else
    (void)s;
    (void)c;
#endif
    return DQW_OK;
}

static void pair_effects(dqw_shaft_q15 *s, int16_t w_m_q15, uint16_t theta_m_turn, int32_t pair[SIGNALS])
{
#if DQW_EFFECT_WEIGHTS > 0
    int32_t x_q15[DQW_EFFECT_WEIGHTS];
    int at = 0;
    for (int k = 0; k < s->effect_count; k++) {
        dqw_torque_at_q15(&s->effect[k], w_m_q15, theta_m_turn, x_q15 + at);
        at += dqw_effect_weights((enum dqw_effect_name)s->effect[k].effect);
    }
    for (int i = 0; i < at; i++) {
        pair[PLAIN + i] = s->x_last_q15[i] + x_q15[i];
        s->x_last_q15[i] = x_q15[i];
    }
#else
    (void)s;
    (void)w_m_q15;
    (void)theta_m_turn;
    (void)pair;
#endif
}

enum dqw_status dqw_shaft_init_q15(dqw_shaft_q15 *s, const dqw_shaft_q15_config *config)
{
    if (s == NULL || config == NULL) return DQW_ERR_NULL;
    const dqw_shaft_q15_config *c = config;
    enum dqw_status status = check(c);
    if (status != DQW_OK) return status;

    dqw_shaft_q15 n = {.config = config};
    n.w_q40[DQW_J] = n.start_q40[DQW_J] = J_q40(c);
    n.w_q40[DQW_B] = n.start_q40[DQW_B] = B_q40(c);
    n.inputs = c->coulomb ? DQW_COULOMB + 1 : DQW_COULOMB;
    if (c->coulomb && c->coulomb_width_urad_s != 0)
        n.coulomb_rate_q16 = dqw_soft_rate_q15(c->coulomb_width_urad_s, c->scale.w_full_mrad_s);
    status = init_effects(&n, c);
    if (status == DQW_OK) status = dqw_window_init_q15(&n.window, half_of(c), PLAIN + n.weights);
    if (status != DQW_OK) return status;
    int64_t information_q32[INPUTS];
    for (int i = 0; i < n.inputs; i++) information_q32[i] = START_INFORMATION_Q32;
    if (dqw_normal_init_q15(&n.normal, n.inputs, information_q32, n.start_q40) != DQW_OK) return DQW_ERR_UNIT;
    for (int i = 0; i < n.inputs; i++) n.sd_q40[i] = NOT_LEARNED;
    dqw_gate_init(&n.gate, 0);
    const int64_t standstill_q15 = dqw_q_quotient64(c->standstill_urad_s, (int64_t)c->scale.w_full_mrad_s * 1000, 15);
    n.standstill_q15 = standstill_q15 > INT16_MAX ? INT16_MAX : (int32_t)standstill_q15;
    *s = n;
    return DQW_OK;
}

enum dqw_status dqw_shaft_define_q15(dqw_shaft_q15 *s, const dqw_shaft_q15_config *config)
{
    return dqw_shaft_init_q15(s, config);
}

static int32_t direction(const dqw_shaft_q15 *s, int16_t w_q15)
{
    if (!s->config->coulomb || (w_q15 <= s->standstill_q15 && w_q15 >= -s->standstill_q15)) return 0;
    if (s->coulomb_rate_q16 != 0) return dqw_soft_sign_q15(s->coulomb_rate_q16, w_q15);
    return w_q15 > 0 ? 32768 : -32768;
}

// One pair, NULL where it is none; half a window that is full goes to the background, unless it still has the one
// before.
static uint32_t gather(dqw_shaft_q15 *s, const int32_t pair[])
{
    dqw_window_q15 *w = &s->window;
    if (pair == NULL) {
        dqw_window_refuse_q15(w);
    } else {
        dqw_window_q15_cell *cell = dqw_window_cells_q15(w);
        for (int i = 0; i < w->signals; i++) dqw_window_gather_q15(&cell[i], pair[i]);
        dqw_window_count_q15(w);
    }
    if (!dqw_window_full_q15(w)) return 0;
    if (dqw_window_turn_q15(w)) return DQW_EVENT_BLOCK;
    if (s->missed < UINT32_MAX) s->missed++;
    return DQW_EVENT_MISSED;
}

uint32_t dqw_shaft_sample_q15(dqw_shaft_q15 *s, int16_t torque_q15, int16_t w_m_q15, uint16_t theta_m_turn,
                              bool saturated)
{
    // [SHAFT.1] may this sample be learned
    const dqw_gate_sample g = {.finite = true,
                               .saturated = saturated || dqw_scale_beyond(torque_q15) || dqw_scale_beyond(w_m_q15)};
    const uint32_t refused = dqw_gate_check(&s->gate, g);
    const bool paired = refused == 0 && s->has_last;
    s->has_last = refused == 0;

    // [SHAFT.2] the pair that it ends
    int32_t pair[SIGNALS];
    if (refused == 0) {
        const int32_t now_q15 = direction(s, w_m_q15);
        pair[TORQUE] = s->torque_last_q15;
        pair[STEP] = w_m_q15 - s->w_last_q15;
        pair[SPEEDS] = w_m_q15 + s->w_last_q15;
        pair[DIRECTIONS] = now_q15 + s->direction_last_q15;
        pair_effects(s, w_m_q15, theta_m_turn, pair);
        s->torque_last_q15 = torque_q15;
        s->w_last_q15 = w_m_q15;
        s->direction_last_q15 = now_q15;
    }
    return refused | gather(s, paired ? pair : NULL);
}

void dqw_shaft_missing_q15(dqw_shaft_q15 *s, uint32_t periods)
{
    s->has_last = false;
    if (periods == 1u) {
        const dqw_gate_sample none = {.finite = false};
        (void)dqw_gate_check(&s->gate, none);
        (void)gather(s, NULL);
    } else {
        dqw_window_restart_q15(&s->window);
    }
}
