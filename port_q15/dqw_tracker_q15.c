// What the tracker does in the interrupt: admit a sample, gather it, hand blocks over.
#include "dqw_tracker_q15.h"

#include <stddef.h>

#include "dqw_q15.h"
#include "dqw_tracker_rows_q15.h"

#define HALF_WINDOW 20
#define DRIFT_MOST_PPM 1000000u
// Slopes of dead time's input in their sum.
#define SLOPES_SHIFT 10u
#define ONE_Q15 32768
#define ONE_Q24 16777216
#define SQRT3_2_Q31 1859775393
#define THIRD_Q15 10923
#define INV_SQRT3_Q15 18919
// Three widths must be a quarter of a thousandth of the full current, or their inverse does not fit.
#define WIDTH3_LEAST_Q28 65537
// Start variance over the residual's: (3 nominal values / 0.01)^2.
#define START_COV_Q40 ((int64_t)90000 << 40)
#define START_INFORMATION_Q32 47722

void dqw_tracker_start_q15(dqw_tracker_q15 *t)
{
    static const int64_t prior_q32[DQW_TRACK_Q15_WEIGHTS] = {START_INFORMATION_Q32, START_INFORMATION_Q32, START_INFORMATION_Q32,
                                                             START_INFORMATION_Q32, START_INFORMATION_Q32, START_INFORMATION_Q32};
    static const int64_t zero_q40[DQW_TRACK_Q15_WEIGHTS] = {0};
    (void)dqw_normal_init_q15(&t->normal, DQW_TRACK_Q15_WEIGHTS, prior_q32, zero_q40);
    for (int i = 0; i < DQW_TRACK_Q15_WEIGHTS; i++) {
        t->w_q24[i] = i <= DQW_TRACK_PSI_Q15 ? ONE_Q24 : 0;
        t->cov_q40[i] = START_COV_Q40;
        t->excess_q10[i] = 0;
    }
    for (int i = 0; i < DQW_TRACK_Q15_SCORES; i++) {
        t->score2_q68[i] = t->score_lag_q68[i] = 0;
        t->score_last_q34[i] = 0;
    }
    dqw_tracker_nominal_q15 n;
    (void)dqw_tracker_nominal_of_q15(t->config, &n);
    for (int axis = 0; axis < 2; axis++) t->step_q15[axis] = dqw_q15_sat(dqw_q31_sat(dqw_q_quotient64((int64_t)1 << 40, n.L_q40[axis], 15)));
    t->error_q56[0] = t->error_q56[1] = 0;
    t->blocks = 0;
    t->learned = 0;
}

enum dqw_status dqw_tracker_init_q15(dqw_tracker_q15 *t, const dqw_tracker_q15_config *config)
{
    if (t == NULL || config == NULL) return DQW_ERR_NULL;
    const dqw_tracker_q15_config *c = config;
    const enum dqw_status scale = dqw_scale_check(&c->scale);
    if (scale != DQW_OK) return scale;
    dqw_tracker_nominal_q15 nominal;
    if (c->excitation_q15 > DQW_SCALE_MOST_Q15 || c->drift_ppm > DRIFT_MOST_PPM || !dqw_tracker_nominal_of_q15(c, &nominal)) return DQW_ERR_RANGE;

    dqw_window_q15 window;
    const enum dqw_status status = dqw_window_init_q15(&window, c->half_window != 0 ? c->half_window : HALF_WINDOW, DQW_TRACK_Q15_SIGNALS);
    if (status != DQW_OK) return status;
    if (nominal.width_q40 >= (int64_t)1 << 44) return DQW_ERR_RANGE;
    const int64_t width3_q28 = dqw_q_floor64(3 * nominal.width_q40, 12);
    if (nominal.width_q40 > 0 && (width3_q28 < WIDTH3_LEAST_Q28 || width3_q28 > INT32_MAX)) return DQW_ERR_RANGE;

    // In place: a small core's stack has no room for a second one.
    const dqw_tracker_q15 zero = {.config = NULL};
    *t = zero;
    t->config = config;
    t->follow_q15 = ONE_Q15;
    t->window = window;
    if (nominal.width_q40 > 0) {
        t->width3_q28 = (int32_t)width3_q28;
        t->per_width3 = dqw_q31_sat(dqw_q_quotient64(1, width3_q28, 47));
    }
    dqw_tracker_start_q15(t);
    dqw_gate_init(&t->gate, c->stale_limit);
    dqw_noise_init_q15(&t->noise);
    return DQW_OK;
}

static uint32_t admit(dqw_tracker_q15 *t, const dqw_sample_q15 *s, bool saturated)
{
    const dqw_sample_q15 *l = &t->last;
    const dqw_gate_sample g = {
        .finite = !t->config->angle || dqw_scale_is_direction(s->cosine_q15, s->sine_q15),
        .saturated = saturated || dqw_scale_beyond(s->v_d_q15) || dqw_scale_beyond(s->v_q_q15) || dqw_scale_beyond(s->i_d_q15) ||
                     dqw_scale_beyond(s->i_q_q15) || dqw_scale_beyond(s->w_m_q15),
        .repeated = t->has_last && s->i_d_q15 == l->i_d_q15 && s->i_q_q15 == l->i_q_q15 && s->w_m_q15 == l->w_m_q15,
    };
    return dqw_gate_check(&t->gate, g);
}

// tanh to 2.4 %, bounded by 1, of a current: with u a third of it in widths, u (3 + u^2) / (1 + 3 u^2).
static int32_t soft_sign(const dqw_tracker_q15 *t, int32_t i_q28)
{
    const int32_t most = t->width3_q28;
    const int32_t bounded_q28 = i_q28 > most ? most : i_q28 < -most ? -most : i_q28;
    const int32_t u_q15 = (int32_t)dqw_q_floor64((int64_t)bounded_q28 * t->per_width3, 32);  // |u| <= 1
    const int32_t u2_q15 = (int32_t)((uint32_t)(u_q15 * u_q15) >> 15);
    const int32_t above_q14 = dqw_q_round32(u_q15 * ((3 << 13) + (u2_q15 >> 2)), 14);  // |.| <= 4
    const int32_t inverse_q16 = (int32_t)dqw_q16_inverse((uint32_t)(ONE_Q15 + 3 * u2_q15));
    return dqw_q_round32(above_q14 * inverse_q16, 15);  // the quotient is 1 at most: |.| <= 2^30
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
static void dead_time(dqw_tracker_q15 *t, const dqw_sample_q15 *s, int32_t *d_q15, int32_t *q_q15)
{
    if (t->width3_q28 == 0) {
        *d_q15 = *q_q15 = 0;
        return;
    }
    // Noise wider than the step would smooth it: so the noisier the currents, the slower they are followed here.
    const int32_t part_q15 = t->last_good ? t->follow_q15 : ONE_Q15;
    t->slow_d_q28 = follow(t->slow_d_q28, s->i_d_q15, part_q15);
    t->slow_q_q28 = follow(t->slow_q_q28, s->i_q_q15, part_q15);
    const int16_t cosine = s->cosine_q15;
    const int16_t sine = s->sine_q15;
    const int32_t alpha = along(t->slow_d_q28, cosine, -t->slow_q_q28, sine);
    const int32_t beta = (int32_t)dqw_q_floor64((int64_t)along(t->slow_d_q28, sine, t->slow_q_q28, cosine) * SQRT3_2_Q31, 31);
    const int32_t half = dqw_q_floor32(alpha, 1);
    const int32_t a = soft_sign(t, alpha);
    const int32_t b = soft_sign(t, beta - half);
    const int32_t c = soft_sign(t, -half - beta);
    // |.| <= 4/3, products below 2^30.5
    const int32_t lost_alpha = dqw_q_round32((2 * a - b - c) * THIRD_Q15, 15);
    const int32_t lost_beta = dqw_q_round32((b - c) * INV_SQRT3_Q15, 15);
    *d_q15 = dqw_q_round32(cosine * lost_alpha + sine * lost_beta, 15);
    *q_q15 = dqw_q_round32(cosine * lost_beta - sine * lost_alpha, 15);
    // How much of it the current's noise moves, on average: what tanh gains at this current, 1 - tanh^2 of what it gains at none. One
    // sample in four, and never the one that ends a block, is enough.
    if ((t->window.at & 3u) != 1u) return;
    const uint32_t squares_q13 = (uint32_t)(a * a >> 17) + (uint32_t)(b * b >> 17) + (uint32_t)(c * c >> 17);
    const uint32_t slope_q15 = 32768u - (squares_q13 * (4u * 10923u) >> 15);
    if (t->slopes >> SLOPES_SHIFT != 0)
        t->slope_q15 -= t->slope_q15 >> SLOPES_SHIFT;
    else
        t->slopes++;
    t->slope_q15 += slope_q15;
}

// The pair that a sample ends, as sums and steps. (E13)
static void gather(dqw_tracker_q15 *t, const dqw_sample_q15 *s, int32_t dead_d_q15, int32_t dead_q_q15)
{
    const dqw_sample_q15 *l = &t->last;
    int32_t pair[DQW_TRACK_Q15_SIGNALS];
    dqw_model_pair_q15(l, s, pair);
    pair[DQW_BLOCK_Q15_SIGNALS] = dead_d_q15 + t->dead_d_q15;
    pair[DQW_BLOCK_Q15_SIGNALS + 1] = dead_q_q15 + t->dead_q_q15;
    dqw_window_add_q15(&t->window, pair, DQW_TRACK_Q15_SIGNALS);
    // Steps less what the voltage made of them.
    dqw_noise_step_q15(&t->noise, pair[4] - dqw_q_round32(t->step_q15[0] * l->v_d_q15, 15), pair[5] - dqw_q_round32(t->step_q15[1] * l->v_q_q15, 15),
                       s->w_m_q15 - l->w_m_q15);
}

static uint32_t end_half(dqw_tracker_q15 *t, int16_t cosine_q15, int16_t sine_q15)
{
    int32_t lost[DQW_TRACK_Q15_SIGNALS];
    const bool taken = t->pending;
    uint16_t weight = 0;
    const uint32_t event = dqw_window_end_q15(&t->window, taken ? lost : t->block, &weight);
    if (event == DQW_EVENT_LEARNED && taken) {
        if (t->missed < UINT8_MAX) t->missed++;
    } else if (event == DQW_EVENT_LEARNED) {
        t->weight = weight;
        t->block_cosine_q15 = t->half_cosine_q15;
        t->block_sine_q15 = t->half_sine_q15;
        t->pending = true;
    } else if (event == DQW_EVENT_INCOMPLETE && t->gate.incomplete < UINT32_MAX) {
        t->gate.incomplete++;
    }
    t->half_cosine_q15 = cosine_q15;
    t->half_sine_q15 = sine_q15;
    t->halves++;
    return event;
}

uint32_t dqw_tracker_sample_q15(dqw_tracker_q15 *t, const dqw_sample_q15 *s, bool saturated)
{
    // [TRK.1] may this sample be learned
    uint32_t event = admit(t, s, saturated);
    const bool good = event == 0;
    int32_t dead_d_q15 = 0;
    int32_t dead_q_q15 = 0;
    if (good) dead_time(t, s, &dead_d_q15, &dead_q_q15);

    // [TRK.2] the pair that it ends, into the window
    if (t->window.at == 0) t->means = dqw_noise_means_of_q15(&t->noise);
    if (good && t->last_good) {
        gather(t, s, dead_d_q15, dead_q_q15);
    } else {
        dqw_window_add_q15(&t->window, NULL, DQW_TRACK_Q15_SIGNALS);
        dqw_noise_gap_q15(&t->noise);
    }

    // [TRK.3] a block for the background
    if (dqw_window_full_q15(&t->window)) event |= end_half(t, good ? s->cosine_q15 : 0, good ? s->sine_q15 : 0);
    t->has_last = true;
    t->last_good = good;
    t->last = *s;
    t->dead_d_q15 = dead_d_q15;
    t->dead_q_q15 = dead_q_q15;
    return event;
}

void dqw_tracker_gap_q15(dqw_tracker_q15 *t, uint32_t periods)
{
    t->halves += (t->window.at + periods) / t->window.half;
    // Equal to nothing.
    t->has_last = t->last_good = false;
    dqw_noise_gap_q15(&t->noise);
    dqw_window_restart_q15(&t->window);
}
