// What the estimator does in the interrupt: admit a sample, gather it, hand blocks over.
#include "dqw_estimator_q15.h"

#include <stddef.h>

#include "dqw_modulation.h"
#include "dqw_q15.h"

// Slopes of dead time's input in their sum.
#define SLOPES_SHIFT 10u
#define ONE_Q15 32768
#define SQRT3_2_Q31 1859775393
#define SQRT3_Q14 28378
#define THIRD_Q15 10923
#define INV_SQRT3_Q15 18919

// The effects' inputs of the pair, or of the settled row, that this sample ends: d first, then q. False where there is
// none yet.
static bool pair_effects(dqw_estimator_q15 *e, const dqw_sample_q15 *s, bool good, int32_t pair[])
{
    bool there = good;
#if DQW_EFFECT_WEIGHTS > 0
    if (e->effect.count == 0) return good;
    int32_t *x = pair + DQW_PLAIN_Q15_SIGNALS;
    if (!good)
        dqw_effect_gap_q15(&e->effect);
    else if (e->config->settled)
        dqw_effect_static_q15(&e->effect, s, x, x + e->effect.weights);
    else
        there = dqw_effect_pair_q15(&e->effect, e->last_good ? &e->last : NULL, s, x, x + e->effect.weights);
    dqw_effect_heat_q15(&e->effect, s->i_d_q15, s->i_q_q15);
#else
    (void)e;
    (void)s;
    (void)pair;
#endif
    return there;
}

static uint32_t admit(dqw_estimator_q15 *e, const dqw_sample_q15 *s, bool saturated)
{
    const dqw_sample_q15 *l = &e->last;
    dqw_gate_sample g = {
        .finite = !e->config->angle || dqw_scale_is_direction(s->cosine_q15, s->sine_q15),
        .saturated = saturated || dqw_scale_beyond(s->v_d_q15) || dqw_scale_beyond(s->v_q_q15) ||
                     dqw_scale_beyond(s->i_d_q15) || dqw_scale_beyond(s->i_q_q15) || dqw_scale_beyond(s->w_m_q15),
        .repeated = e->has_last && s->i_d_q15 == l->i_d_q15 && s->i_q_q15 == l->i_q_q15 && s->w_m_q15 == l->w_m_q15,
    };
#if DQW_EFFECT_WEIGHTS > 0
    g.finite = g.finite && dqw_effect_finite_q15(&e->effect, s);
    g.saturated = g.saturated || dqw_effect_saturated_q15(&e->effect, s);
#endif
    return dqw_gate_check(&e->gate, g);
}

// The voltage of a vector that stands still while the frame turns, seen from the frame after so many halves of a
// period; what leaves the full scale counts as beyond it.
static void turn_back(const dqw_estimator_q15 *e, int32_t halves, dqw_sample_q15 *x)
{
    const int32_t halves_w_q15 = halves * x->w_m_q15;
    // Below 1.5 rad, its square below 2.25: wrong by less than 3e-4 there, by a last place at 1 rad
    const int32_t turn_q15 = (int32_t)dqw_q_floor64((int64_t)e->turn_q28 * halves_w_q15, 29);
    const int32_t turn2_q15 = (int32_t)((uint32_t)turn_q15 * (uint32_t)turn_q15 >> 15);
    // 1/4!, 1/6!, 1/5! and 1/7!, the small ones as 91 and 13 parts of 2^16
    const int32_t fourth_q15 = turn2_q15 * (1365 - (turn2_q15 * 91 >> 16)) >> 15;
    const int32_t fifth_q15 = turn2_q15 * (273 - (turn2_q15 * 13 >> 16)) >> 15;
    // The mean over a period of what turns by: the sine of half its angle over that angle, one or a third of this one.
    // (E89)
    const int32_t mean_q15 = ONE_Q15 - (turn2_q15 * (halves == 1 ? 5461 : 607) >> 15);
    const int32_t straight = ONE_Q15 - dqw_q_round32(turn2_q15 * (ONE_Q15 / 2 - fourth_q15), 15);
    const int32_t across = dqw_q_round32(turn_q15 * (ONE_Q15 - (turn2_q15 * (5461 - fifth_q15) >> 15)), 15);
    const int32_t cosine = dqw_q_round32(straight * mean_q15, 15);
    const int32_t sine = dqw_q_round32(across * mean_q15, 15);
    const int16_t v_d = x->v_d_q15;
    x->v_d_q15 = dqw_q15_sat(dqw_q_round32(cosine * v_d + sine * x->v_q_q15, 15));
    x->v_q_q15 = dqw_q15_sat(dqw_q_round32(cosine * x->v_q_q15 - sine * v_d, 15));
}

// The sample with the voltage that acts from it on, seen in the rotating frame.
static void adapt(dqw_estimator_q15 *e, dqw_sample_q15 *x)
{
    const int16_t v_d_q15 = x->v_d_q15;
    const int16_t v_q_q15 = x->v_q_q15;
    const bool next = e->config->voltage_next;
    if (next) {
        x->v_d_q15 = e->commanded ? e->command_d_q15 : 0;
        x->v_q_q15 = e->commanded ? e->command_q_q15 : 0;
        e->command_d_q15 = v_d_q15;
        e->command_q_q15 = v_q_q15;
        const uint8_t resting = x->resting;
        x->resting = e->command_resting;
        e->command_resting = resting;
    }
    if (e->config->voltage_held) turn_back(e, next ? 3 : 1, x);
    // A voltage that came beyond the scale is refused with its sample.
    if (dqw_scale_beyond(v_d_q15) || dqw_scale_beyond(v_q_q15)) x->v_d_q15 = INT16_MAX;
}

// Dead time's input at a sample.
typedef struct {
    int32_t d_q15, q_q15;
    int32_t sign_q15[3];  // of the phases' currents
} dead_input;

// A pair's, of its two samples: what follows the currents late is taken ahead by as much of its own step. (E60)
// |now - before| below 2.7, the lead up to 4. Steps of pairs behind each other add up to one: however many pairs are
// refused between them, a block of 200 with three quarters of them stays below 2^31.
static int32_t joined(const dqw_estimator_q15 *e, int32_t before_q15, int32_t now_q15)
{
    return before_q15 + now_q15 + dqw_q_floor32((now_q15 - before_q15) * e->lead_q12, 12);
}

// tanh to 1e-3, bounded by 1, of a current: its continued fraction to the fifth term, with u the current over 3.6
// widths.
static int32_t soft_sign(int32_t most, int32_t per_most, int32_t i_q28)
{
    const int32_t size_q28 = i_q28 < 0 ? -i_q28 : i_q28;
    const uint32_t u_q15 = (uint32_t)((uint64_t)((int64_t)(size_q28 > most ? most : size_q28) * per_most) >>
                                      32);  // <= 1
    const uint32_t u2_q15 = u_q15 * u_q15 >> 15;
    // u (3.6 + 5.184 u^2 + 0.63985 u^4), and 1 + 5.76 u^2 + 2.66606 u^4: up to 9.43
    const uint32_t above_q13 = 29491u + ((42467u + (5242u * u2_q15 >> 15)) * u2_q15 >> 15);
    const uint32_t below_q15 = 32768u + (((188744u + (87361u * u2_q15 >> 15)) >> 2) * u2_q15 >> 13);
    // The quotient is 1 at most: the product is below 2^30
    const int32_t y_q15 = (int32_t)((above_q13 * u_q15 >> 14) * dqw_q16_inverse(below_q15) >> 15);
    return i_q28 < 0 ? -y_q15 : y_q15;
}

// A vector's part along (x, y), Q28: |.| <= 1.42.
static int32_t along(int32_t a_q28, int16_t x_q15, int32_t b_q28, int16_t y_q15)
{
    return (int32_t)dqw_q_floor64((int64_t)a_q28 * x_q15 + (int64_t)b_q28 * y_q15, 15);
}

static int32_t follow(int32_t slow_q28, int16_t now_q15, int32_t part_q15)
{
    // |now - slow| <= 2^29
    return slow_q28 + (int32_t)dqw_q_floor64((int64_t)(now_q15 * 8192 - slow_q28) * part_q15, 15);
}

// What an inverter with dead time takes from each phase per volt of it, as dq. (E51)
static void dead_time(dqw_estimator_q15 *e, const dqw_sample_q15 *s, dead_input *x)
{
    if (e->wide_q28 == 0) {
        *x = (dead_input){.d_q15 = 0};
        return;
    }
    // Noise wider than the step would smooth it: so the noisier the currents, the slower they are followed here.
    const int32_t part_q15 = e->last_good ? e->follow_q15 : ONE_Q15;
    e->slow_d_q28 = follow(e->slow_d_q28, s->i_d_q15, part_q15);
    e->slow_q_q28 = follow(e->slow_q_q28, s->i_q_q15, part_q15);
    const int16_t cosine = s->cosine_q15;
    const int16_t sine = s->sine_q15;
    const int32_t alpha = along(e->slow_d_q28, cosine, -e->slow_q_q28, sine);
    const int32_t beta = (int32_t)dqw_q_floor64(
        (int64_t)along(e->slow_d_q28, sine, e->slow_q_q28, cosine) * SQRT3_2_Q31, 31);
    const int32_t half = dqw_q_floor32(alpha, 1);
    const int32_t a = soft_sign(e->wide_q28, e->per_wide, alpha);
    const int32_t b = soft_sign(e->wide_q28, e->per_wide, beta - half);
    const int32_t c = soft_sign(e->wide_q28, e->per_wide, -half - beta);
    x->sign_q15[0] = a;
    x->sign_q15[1] = b;
    x->sign_q15[2] = c;
    // |.| <= 4/3, products below 2^30.5
    const int32_t lost_alpha = dqw_q_round32((2 * a - b - c) * THIRD_Q15, 15);
    const int32_t lost_beta = dqw_q_round32((b - c) * INV_SQRT3_Q15, 15);
    x->d_q15 = dqw_q_round32(cosine * lost_alpha + sine * lost_beta, 15);
    x->q_q15 = dqw_q_round32(cosine * lost_beta - sine * lost_alpha, 15);
    // How much of it the current's noise moves, on average: what tanh gains at this current, 1 - tanh^2 of what it
    // gains at none. One sample in four, and never the one that ends a block, is enough.
    if ((e->window.at & 3u) != 1u) return;
    const uint32_t squares_q13 = (uint32_t)(a * a >> 17) + (uint32_t)(b * b >> 17) + (uint32_t)(c * c >> 17);
    const uint32_t slope_q15 = 32768u - (squares_q13 * (4u * 10923u) >> 15);
    if (e->slopes >> SLOPES_SHIFT != 0)
        e->slope_q15 -= e->slope_q15 >> SLOPES_SHIFT;
    else
        e->slopes++;
    e->slope_q15 += slope_q15;
}

// Legs that rested in the period that s ends; c and n twice the direction in its middle, nearly.
static uint8_t resting(const dqw_estimator_q15 *e, int32_t c, int32_t n)
{
    const dqw_sample_q15 *l = &e->last;
    if (e->modulation == (uint8_t)DQW_MODULATION_MASK) return l->resting & 7u;
    const int32_t cosine = dqw_q_floor32(c, 1);
    const int32_t sine = dqw_q_floor32(n, 1);
    // A direction is below 1.05, a voltage below 1.42: sums below 2^31, and what is left below 1.5
    const int32_t alpha_q15 = dqw_q_floor32(cosine * l->v_d_q15 - sine * l->v_q_q15, 15);
    const int32_t beta_q15 = dqw_q_floor32(sine * l->v_d_q15 + cosine * l->v_q_q15, 15);
    const int32_t side_q15 = dqw_q_floor32(beta_q15 * SQRT3_Q14, 14);
    const int32_t v[3] = {2 * alpha_q15, side_q15 - alpha_q15, -side_q15 - alpha_q15};
    return dqw_modulation_resting((enum dqw_modulation)e->modulation, v);
}

// A leg that rests has no dead time: out of the pair's input with it; and what the others have whatever their currents'
// signs shows. (E101)
static void leave_out(const dqw_estimator_q15 *e, const dqw_sample_q15 *s, const dead_input *x, int32_t dead_q15[])
{
    static const int16_t alpha_q15[3] = {2 * THIRD_Q15 - 1, -THIRD_Q15, -THIRD_Q15};
    static const int16_t beta_q15[3] = {0, INV_SQRT3_Q15, -INV_SQRT3_Q15};
    const int32_t c = s->cosine_q15 + e->last.cosine_q15;
    const int32_t n = s->sine_q15 + e->last.sine_q15;
    const uint32_t legs = resting(e, c, n);
    if (legs == 7u) {
        dead_q15[0] = dead_q15[1] = 0;
        return;
    }
    for (uint32_t left = legs; left != 0; left &= left - 1u) {
        const uint32_t k = (left & (0u - left)) >> 1;  // 1, 2, 4: 0, 1, 2
        // Twice the direction is below 2.1, two thirds of that below 1.4; what is left of dead time's below 2.8.
        const int32_t d_q15 = dqw_q_round32(c * alpha_q15[k] + n * beta_q15[k], 15);
        const int32_t q_q15 = dqw_q_round32(c * beta_q15[k] - n * alpha_q15[k], 15);
        // and a pair's sign below 10
        const int32_t sign_q12 = dqw_q_floor32(joined(e, e->dead_sign_q15[k], x->sign_q15[k]), 3);
        dead_q15[0] -= dqw_q_round32(sign_q12 * d_q15, 13);
        dead_q15[1] -= dqw_q_round32(sign_q12 * q_q15, 13);
        dead_q15[2] -= d_q15;
        dead_q15[3] -= q_q15;
    }
}

// The pair that a sample ends, as sums and steps. (E13)
static void gather(dqw_estimator_q15 *e, const dqw_sample_q15 *s, const dead_input *x, int32_t pair[])
{
    dqw_model_pair_q15(&e->last, s, pair);
    int32_t *dead_q15 = pair + DQW_BLOCK_Q15_SIGNALS;
    dead_q15[0] = joined(e, e->dead_d_q15, x->d_q15);
    dead_q15[1] = joined(e, e->dead_q_q15, x->q_q15);
    dead_q15[2] = dead_q15[3] = 0;
    if (e->modulation != (uint8_t)DQW_MODULATION_CENTRED && e->wide_q28 != 0) leave_out(e, s, x, dead_q15);
    const int32_t *from = pair;
    const int32_t *const end = pair + (DQW_EFFECT_WEIGHTS > 0 ? e->window.signals : DQW_PLAIN_Q15_SIGNALS);
    dqw_window_q15_cell *cell = dqw_window_cells_q15(&e->window);
    do dqw_window_gather_q15(cell++, *from++);
    while (from != end);
    dqw_window_count_q15(&e->window);
}

// Steps less what the voltage made of them.
static void step_noise(dqw_estimator_q15 *e, const dqw_sample_q15 *s, const int32_t pair[])
{
    const dqw_sample_q15 *l = &e->last;
    const int32_t made_d_q15 = dqw_q_round32(e->step_q15[0] * l->v_d_q15, 15);
    dqw_noise_step_q15(&e->noise, pair[4] - made_d_q15, pair[5] - dqw_q_round32(e->step_q15[1] * l->v_q_q15, 15),
                       s->w_m_q15 - l->w_m_q15, made_d_q15, e->window.at);
}

// Sixteen bits at a time: the smallest cores copy what need not stand on a word byte by byte.
static void copy(dqw_sample_q15 *to, const dqw_sample_q15 *from)
{
    to->v_d_q15 = from->v_d_q15;
    to->v_q_q15 = from->v_q_q15;
    to->i_d_q15 = from->i_d_q15;
    to->i_q_q15 = from->i_q_q15;
    to->w_m_q15 = from->w_m_q15;
    to->cosine_q15 = from->cosine_q15;
    to->sine_q15 = from->sine_q15;
    to->temp_winding_cC = from->temp_winding_cC;
    to->temp_magnet_cC = from->temp_magnet_cC;
    to->resting = from->resting;
}

static void keep_dead(dqw_estimator_q15 *e, const dead_input *x)
{
    e->dead_d_q15 = x->d_q15;
    e->dead_q_q15 = x->q_q15;
    for (int k = 0; k < 3; k++) e->dead_sign_q15[k] = (int16_t)x->sign_q15[k];
}

// A settled row is a block of its own: it makes a pair with itself.
static void gather_row(dqw_estimator_q15 *e, const dqw_sample_q15 *s, const dead_input *x, int32_t pair[])
{
    copy(&e->last, s);
    keep_dead(e, x);
    gather(e, s, x, pair);
}

// Before a half is gathered: what the background made of those before it.
static void take_given(dqw_estimator_q15 *e)
{
    if (!e->given.ready) return;
    e->step_q15[0] = e->given.step_q15[0];
    e->step_q15[1] = e->given.step_q15[1];
    e->follow_q15 = e->given.follow_q15;
    e->lead_q12 = e->given.lead_q12;
    if (e->given.noise_anew) dqw_noise_init_q15(&e->noise);
    e->given.ready = false;
}

static uint32_t end_half(dqw_estimator_q15 *e, const dqw_sample_q15 *s, bool good)
{
    e->halves++;
    if (!dqw_window_turn_q15(&e->window)) {
        if (e->missed < UINT8_MAX) e->missed++;
        return DQW_EVENT_MISSED;
    }
    dqw_estimator_q15_handed *h = &e->handed;
    const bool has_angle = good && e->config->angle;
    h->cosine_q15 = has_angle ? s->cosine_q15 : 0;
    h->sine_q15 = has_angle ? s->sine_q15 : 0;
    h->noise_q30[DQW_NOISE_ID_Q15] = e->noise.sum_q30[DQW_NOISE_ID_Q15];
    h->noise_q30[DQW_NOISE_IQ_Q15] = e->noise.sum_q30[DQW_NOISE_IQ_Q15];
    h->noise_q30[DQW_NOISE_W_Q15] = e->noise.sum_q30[DQW_NOISE_W_Q15];
    h->answer_q30 = e->noise.sum_q30[DQW_NOISE_ANSWER_Q15];
    h->rows = e->noise.rows;
    h->slope_q15 = e->slope_q15;
    h->slopes = e->slopes;
    h->follow_q15 = e->follow_q15;
    h->number = e->halves;
    take_given(e);
    return DQW_EVENT_BLOCK;
}

// A sample, or the last one again in the place of one that is missing.
static uint32_t take(dqw_estimator_q15 *e, const dqw_sample_q15 *s, uint32_t event)
{
    const bool good = event == 0;
    dead_input x;
    if (good) dead_time(e, s, &x);

    // [EST.2] the pair that it ends, into the window
    int32_t pair[DQW_ESTIMATOR_Q15_SIGNALS];
    const bool there = pair_effects(e, s, good, pair);
    if (e->config->settled) {
        if (good) gather_row(e, s, &x, pair);
    } else if (there && e->last_good) {
        gather(e, s, &x, pair);
        step_noise(e, s, pair);
    } else {
        dqw_window_refuse_q15(&e->window);
        dqw_noise_gap_q15(&e->noise);
    }
    if (good) keep_dead(e, &x);
    // [EST.3] a half for the background
    if (dqw_window_full_q15(&e->window)) event |= end_half(e, s, good);
    // A voltage that acts later is not known at the first sample.
    e->last_good = good && (!e->config->voltage_next || e->commanded);
    e->commanded = good;
    return event;
}

uint32_t dqw_estimator_sample_q15(dqw_estimator_q15 *e, const dqw_sample_q15 *sample, bool saturated)
{
    const dqw_sample_q15 *s = sample;
    dqw_sample_q15 changed;
    if (e->config->voltage_next || e->config->voltage_held) {
        copy(&changed, sample);
        adapt(e, &changed);
        s = &changed;
    }
    // [EST.1] may this sample be learned
    const uint32_t event = take(e, s, admit(e, s, saturated));
    copy(&e->last, s);
    e->has_last = true;
    return event;
}

void dqw_estimator_missing_q15(dqw_estimator_q15 *e, uint32_t periods)
{
    // Equal to nothing.
    e->has_last = false;
    if (periods == 1) {
        const dqw_gate_sample none = {.finite = false};
        (void)take(e, &e->last, dqw_gate_check(&e->gate, none));
        return;
    }
    e->halves += periods / e->window.half + (e->window.at + periods % e->window.half) / e->window.half;
    e->last_good = e->commanded = false;
#if DQW_EFFECT_WEIGHTS > 0
    dqw_effect_gap_q15(&e->effect);
#endif
    dqw_noise_gap_q15(&e->noise);
    dqw_window_restart_q15(&e->window);
}
