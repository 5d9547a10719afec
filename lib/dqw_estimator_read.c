// What the estimator says was learned.
#include <math.h>

#include "dqw_estimator_block.h"
#include "dqw_number.h"

// A smaller residual is the sampling's own, and rounding.
#define VARIANCE_FLOOR_PU2 1e-8f
// Settled rows have no sampling: single precision's rounding.
#define VARIANCE_FLOOR_SETTLED_PU2 1e-13f
// Autocorrelation that a deviation takes over: one that never falls would make it infinite. Noise of the currents alone
// comes to -1/2, the overlap of triangles' slopes, and 1 + 2 r to nothing.
#define LAG_MAX 0.98f
#define LAG_MIN -0.4f
// Three deviations are below a tenth.
#define USABLE_SD (0.1f / 3.0f)
// The period by which a voltage is late counts as 0 or 1 within this, this deviation, and after so many blocks.
#define LATE_NEAR 0.35f
#define LATE_SD 0.16f
#define FEW_BLOCKS 50u
// Blocks over which statistics are means: a variance is then known to sqrt(2 / 1000), 4.5 %; of what lasts, over more.
#define MEMORY 1000.0f
#define LASTING_MEMORY 4096.0f
// Two deviations of the mean of a block's four products of white errors, whose neighbours overlap.
#define LASTING_NOISE 1.2f
// The same of a stretch's two, whose blocks overlap.
#define SLOW_NOISE 1.5f
// Shorter than an operating point, longer than what turns with the rotor; in blocks.
#define STRETCH_S 0.03f
#define STRETCH_LEAST 4.0f
#define STRETCH_MOST 200.0f
// An axis' rows weigh up to 8 times what both would: one that is followed ever closer would be all that is learned.
#define QUIETEST (1.0f / 64.0f)
// Of what may stand in line with an input, what does; with that of an inductance, at right angles to the currents.
#define MODEL_PART 0.4f
#define MODEL_PART_L 0.25f
// To so much an angle's law is off by 2 % of it.
#define LAW_HOLDS_RAD 0.25f
// Of what noise takes, where the answer may be any part of it; what is measured of it, at most so much.
#define ANSWER_PART 0.58f
// Squared it is finite.
#define SD_MOST 1e18f

float dqw_estimator_value(const dqw_estimator *e, int weight)
{
    float w = e->w_pu[weight];
    if (weight == DQW_PSI_Q) w = w * e->turn_cosine - e->w_pu[DQW_PSI] * e->turn_sine;
    return w * dqw_estimator_unit(e, weight);
}

float dqw_estimator_variance(const dqw_estimator *e, int axis)
{
    const float least = e->config->settled ? VARIANCE_FLOOR_SETTLED_PU2 : VARIANCE_FLOOR_PU2;
    return e->error_pu2[axis] > least ? e->error_pu2[axis] : least;
}

float dqw_estimator_common_variance(const dqw_estimator *e)
{
    return 0.5f * (dqw_estimator_variance(e, DQW_AXIS_D) + dqw_estimator_variance(e, DQW_AXIS_Q));
}

// Blocks overlap by half, so that next ones are alike, or unlike, in what they teach a weight: that widens or narrows
// its deviation. Dead time goes with the current as R does, the flux on the other axis with the speed as the flux.
// (E61) Settled rows do not overlap: there a residual that goes on is the model's, for as long as it lasts. (E20)
static float inflation(const dqw_estimator *e, int i)
{
    const int score = i >= DQW_PARAMETERS  ? i - DQW_PARAMETERS + 4
                      : i <= DQW_PSI       ? i
                      : i == DQW_DEAD_TIME ? DQW_R
                                           : DQW_PSI;
    // [READ.1] the autocorrelation of what blocks teach a weight, bounded
    if (!(e->score2[score] > 0.0f)) return 1.0f;
    const float r = e->score_lag[score] / e->score2[score];
    const float bounded = r < LAG_MIN ? LAG_MIN : r > LAG_MAX ? LAG_MAX : r;
    if (!e->config->settled) return 1.0f + 2.0f * bounded;
    return bounded > 0.0f ? (1.0f + bounded) / (1.0f - bounded) : 1.0f;
}

float dqw_estimator_noise_sd(const dqw_estimator *e, int weight)
{
    // [READ.2] a deviation is its covariance times the residual's variance, wider where the rows are few
    // Rows less weights: of few settled ones each counts.
    const float rows = 2.0f * (float)e->blocks;
    float freedom = rows;
    for (uint32_t left = e->learned; left != 0; left &= left - 1u) freedom -= 1.0f;
    // Where no leg rests there is one weight less.
    const int weights = e->inputs - (dqw_estimator_has_constant(e) ? 0 : 1);
    const float least = e->config->settled ? 1.0f : 2.0f * (float)weights;
    if ((e->learned >> weight & 1u) == 0 || freedom < least) return DQW_UNKNOWN;
    const float v = dqw_gain_covariance(&e->gain, weight, weight) * dqw_estimator_common_variance(e) *
                    inflation(e, weight) * (rows / freedom);
    return sqrtf(v) * dqw_estimator_unit(e, weight);
}

// A mean weighs its looks with their number while they are few, or with its third power where a start is forgotten.
static float part_of(const dqw_estimator *e, float looks, float memory)
{
    const float part = dqw_estimator_forgets(e) ? 4.0f / (looks + 3.0f) : 2.0f / (looks + 1.0f);
    return part > 1.0f / memory ? part : 1.0f / memory;
}

float dqw_estimator_part(const dqw_estimator *e)
{
    return part_of(e, (float)e->blocks, MEMORY);
}

float dqw_lasting_part(const dqw_estimator *e, float stretch)
{
    return part_of(e, (float)(e->blocks - DQW_LASTING_FROM) / stretch, LASTING_MEMORY / stretch);
}

int dqw_estimator_stretch(const dqw_estimator *e)
{
    const float blocks = STRETCH_S / ((float)e->window.half * e->config->dt_s);
    return blocks < STRETCH_LEAST ? (int)STRETCH_LEAST : blocks > STRETCH_MOST ? (int)STRETCH_MOST : (int)blocks;
}

dqw_lasting dqw_estimator_lasting(const dqw_estimator *e)
{
    // [READ.3] what lasts of the residual, above what noise makes of so many products
    const float all = dqw_estimator_common_variance(e);
    dqw_lasting l = {0.0f, 0.0f, all, 0.0f};
    if (e->config->settled || e->blocks <= DQW_LASTING_FROM) return l;
    const float two = fabsf(e->lasting_pu2[0]);
    const float three = fabsf(e->lasting_pu2[1]);
    const float noise = LASTING_NOISE * all * sqrtf(dqw_lasting_part(e, 1.0f));
    l.fast_pu2 = dqw_noise_variance((two > three ? two : three) - noise);
    l.turning_pu2 = dqw_noise_variance(e->lasting_pu2[2] - noise);
    const float n = (float)dqw_estimator_stretch(e);
    l.slow_pu2 = dqw_noise_variance(e->slow_pu2 - SLOW_NOISE * all / n * sqrtf(dqw_lasting_part(e, n)));
    return l;
}

float dqw_estimator_witness_pu2(const dqw_estimator *e)
{
    return MODEL_PART * MODEL_PART * e->calm.fast_pu2 / (1.0f + (float)e->segment.since);
}

float dqw_estimator_model_pu(const dqw_estimator *e, int weight, const dqw_lasting *l)
{
    // Each in line with its own part of the input: what is fast of one that is slow, no less than so many stretches
    // tell.
    const float alone = e->alone_pu2[weight];
    if (!(l->fast_pu2 + l->slow_pu2 > 0.0f)) return 0.0f;
    if (!(alone > 0.0f)) return DQW_UNKNOWN;
    const float slowly = e->slow_alone_pu2[weight] < alone ? e->slow_alone_pu2[weight] : alone;
    const float told = slowly * sqrtf(dqw_lasting_part(e, (float)dqw_estimator_stretch(e)));
    const float quickly = told > alone - slowly ? told : alone - slowly;
    return sqrtf(l->slow_pu2 * slowly + l->fast_pu2 * quickly) / alone;
}

// Half a lasting error's size, or its scatter between segments where that is known: what no residual shows; and what an
// opening so many segments ago has left open, of one operating point as much as segments scatter. (E106)
static float hidden(const dqw_estimator *e, int weight, const dqw_lasting *l, float in_line, uint16_t opened)
{
    const float model = dqw_estimator_model_pu(e, weight, l);
    if (!(model < DQW_UNKNOWN)) return DQW_UNKNOWN;
    const bool leans = e->config->observed && weight <= DQW_LQ;
    const float part = leans ? model : in_line * model;
    const float band = weight < DQW_FOLLOWED ? e->segment.band_pu[weight] : 0.0f;
    const float open = opened > 0 ? DQW_TOOK_BANDS * band / (float)opened : 0.0f;
    return sqrtf(part * part + band * (band < model ? band : model) + open * open) * dqw_estimator_unit(e, weight);
}

static float with(float noise, float hides)
{
    return noise < DQW_UNKNOWN && hides < DQW_UNKNOWN ? sqrtf(noise * noise + hides * hides) : DQW_UNKNOWN;
}

// An error of the voltage that the user allows for, all of it in line with the input: half its square on each axis.
static float of_voltage(const dqw_estimator *e, int weight)
{
    const float error_pu = e->config->voltage_error_V / e->config->v_base_V;
    if (!(error_pu > 0.0f)) return 0.0f;
    const float alone = e->alone_pu2[weight];
    if (!e->config->settled && !(alone > 0.0f)) return DQW_UNKNOWN;
    // Settled rows forget nothing: one over P is the sum of both axes' powers.
    // A quiet axis' rows weigh more: there the error is, but for the flux, which has its own.
    const float v_d = dqw_estimator_variance(e, DQW_AXIS_D);
    const float v_q = dqw_estimator_variance(e, DQW_AXIS_Q);
    const bool in_q = weight == DQW_PSI || (v_q < v_d && (weight != DQW_PSI_Q || e->pole_pairs == 0));
    const float part = e->config->settled ? dqw_gain_covariance(&e->gain, weight, weight) * (float)e->blocks
                                          : 0.5f / (dqw_estimator_axis_part(e, in_q ? DQW_AXIS_Q : DQW_AXIS_D) * alone);
    const float sd = error_pu * sqrtf(part) * dqw_estimator_unit(e, weight);
    return sd < SD_MOST ? sd : DQW_UNKNOWN;
}

// Every weight is volts for something: in volts a part too large all are that part too large, and nothing shows it.
static float of_scale(const dqw_estimator *e, int weight)
{
    return 1e-6f * (float)e->config->voltage_scale_ppm * fabsf(dqw_estimator_value(e, weight));
}

// Noise of the currents that a controller answers goes with the voltage, and what is taken out for noise is taken for
// its answer as well: an inductance may be off by a part of it, and the flux by what goes with that. (E188)
static float of_answer(const dqw_estimator *e, int weight)
{
    if (weight < DQW_LD || weight > DQW_PSI) return 0.0f;
    float square_pu2 = 0.0f;
    for (int L = DQW_LD; L <= DQW_LQ; L++) {
        const float noisy = e->noisy_pu2[L - DQW_LD];
        if (!(noisy > 0.0f) || (weight != L && weight != DQW_PSI)) continue;
        const float clear = e->alone_pu2[L] - noisy;
        const float with_L = dqw_gain_covariance(&e->gain, weight, L) / dqw_gain_covariance(&e->gain, L, L);
        const float w_pu = fabsf(e->w_pu[L]);
        const float other_pu = fabsf(e->w_pu[L == DQW_LD ? DQW_LQ : DQW_LD]);
        // Where half of it and more is noise, nothing of it may be the machine's, and the other axis says how large that
        // can be.
        const float part = e->answered < ANSWER_PART ? e->answered : ANSWER_PART;
        const float most_pu = other_pu > w_pu ? other_pu : w_pu;
        const float off_pu = (clear > noisy ? part * w_pu * noisy / clear : ANSWER_PART * most_pu) * with_L;
        square_pu2 += off_pu * off_pu;
    }
    return sqrtf(square_pu2) * dqw_estimator_unit(e, weight);
}

float dqw_estimator_sd_value(const dqw_estimator *e, int weight)
{
    dqw_lasting now = dqw_estimator_lasting(e);
    if (now.turning_pu2 > now.fast_pu2) now.fast_pu2 = now.turning_pu2;
    const float in_line = weight == DQW_LD || weight == DQW_LQ ? MODEL_PART_L : MODEL_PART;
    const float unseen = with(with(of_voltage(e, weight), of_scale(e, weight)), of_answer(e, weight));
    const float hides = hidden(e, weight, &now, in_line, e->opened > 0 ? e->segment.since : 0);
    return with(with(dqw_estimator_noise_sd(e, weight), hides), unseen);
}

float dqw_estimator_sd(const dqw_estimator *e, int weight)
{
    return dqw_estimator_sd_since(e, weight, e->segment.since);
}

float dqw_estimator_sd_since(const dqw_estimator *e, int weight, uint16_t since)
{
    const dqw_lasting lasts = dqw_estimator_knows_calm(e) ? e->calm : dqw_estimator_lasting(e);
    const float hides = hidden(e, weight, &lasts, MODEL_PART, 0);
    const float met = 1.0f + (float)since;
    return with(dqw_estimator_noise_sd(e, weight), hides < DQW_UNKNOWN ? hides / sqrtf(met) : DQW_UNKNOWN);
}

float dqw_estimator_axis_part(const dqw_estimator *e, int axis)
{
    const float part = dqw_estimator_variance(e, axis) / dqw_estimator_common_variance(e);
    return part > QUIETEST ? part : QUIETEST;
}

float dqw_estimator_residual_pu(const dqw_estimator *e)
{
    return sqrtf(dqw_noise_variance(e->error_pu2[0]) + dqw_noise_variance(e->error_pu2[1]));
}

float dqw_estimator_recent_pu(const dqw_estimator *e)
{
    return sqrtf(e->recent_pu2);
}

#if DQW_EFFECT_WEIGHTS > 0
// By how much an inductance or the flux is more in the magnet's frame than in that of an angle that is off, to second
// order, and what that angle's deviation and the order beyond make of it. (E184)
static float beyond_frame(const dqw_estimator *e, int parameter, float *sd)
{
    *sd = 0.0f;
    for (int k = 0; k < e->config->effect_count; k++) {
        float angle_rad = 0.0f;
        float angle_sd_rad = 0.0f;
        if (e->config->effects[k].effect != DQW_EFFECT_ANGLE_OFFSET || parameter < DQW_LD || parameter > DQW_PSI)
            continue;
        if (dqw_estimator_read_effect(e, k, &angle_rad, &angle_sd_rad) == 0) return 0.0f;
        const int other = parameter == DQW_LD ? DQW_LQ : DQW_LD;
        const float w = dqw_estimator_value(e, parameter);
        const float turned = parameter == DQW_PSI ? 0.5f * w : w - dqw_estimator_value(e, other);
        const float more = turned * angle_rad * angle_rad;
        // [READ.5] beyond what the law holds for the whole of it may be wrong
        if (!(fabsf(angle_rad) < LAW_HOLDS_RAD)) {
            *sd = fabsf(more);
            return 0.0f;
        }
        const float beyond_rad = 0.5f * fabsf(angle_rad) * angle_rad * angle_rad;
        *sd = 2.0f * fabsf(turned * angle_rad) * (angle_sd_rad + beyond_rad);
        return more;
    }
    return 0.0f;
}
#endif

dqw_reading dqw_estimator_read(const dqw_estimator *e, enum dqw_parameter parameter)
{
    dqw_reading r = {.value = 0.0f, .sd = DQW_UNKNOWN, .sd_change = DQW_UNKNOWN, .usable = false};
    if ((unsigned)parameter >= DQW_PARAMETERS) return r;
    r.value = dqw_estimator_value(e, (int)parameter);
    // What these rows cannot tell without the pole pairs.
    if (e->pole_pairs == 0 && parameter != DQW_R && (e->config->settled || parameter > DQW_LQ)) return r;
    r.sd_change = dqw_estimator_sd(e, (int)parameter);
    r.sd = dqw_estimator_sd_value(e, (int)parameter);
#if DQW_EFFECT_WEIGHTS > 0
    float frame_sd;
    r.value += beyond_frame(e, (int)parameter, &frame_sd);
    r.sd = with(r.sd, frame_sd);
#endif
    if (dqw_estimator_observer_hides(e, (int)parameter)) r.sd = DQW_UNKNOWN;
    const bool either_sign = parameter >= DQW_DEAD_TIME;
    const float size = either_sign ? fabsf(r.value) : r.value;
    // A stage that begins anew learns nothing: what it has is of a model that did not fit.
    r.usable = e->stage.name != DQW_STAGE_DOMAIN && r.sd < USABLE_SD * size;
    return r;
}

uint16_t dqw_estimator_pole_pairs(const dqw_estimator *e)
{
    return e->pole_pairs;
}

// By how many periods the voltage acts later than it is said to, and its deviation. (E90)
static void late(const dqw_estimator *e, float *periods, float *sd)
{
    const bool known = e->late_pu2 > 0.0f && e->blocks >= FEW_BLOCKS;
    *periods = known ? e->late_error_pu2 / e->late_pu2 : 0.0f;
    const float part = dqw_estimator_part(e);
    *sd = known ? sqrtf(dqw_estimator_common_variance(e) * part / e->late_pu2 * inflation(e, DQW_R)) : DQW_UNKNOWN;
}

enum dqw_voltage_acts dqw_estimator_voltage_acts(const dqw_estimator *e)
{
    float periods;
    float sd;
    late(e, &periods, &sd);
    // [READ.4] the period by which it is late is 0 or 1, or nobody knows
    const bool next = e->config->voltage_next;
    if (!(sd < LATE_SD)) return DQW_VOLTAGE_NOT_KNOWN;
    if (fabsf(periods) < LATE_NEAR) return next ? DQW_VOLTAGE_NEXT : DQW_VOLTAGE_NOW;
    if (!next && fabsf(periods - 1.0f) < LATE_NEAR) return DQW_VOLTAGE_NEXT;
    if (next && fabsf(periods + 1.0f) < LATE_NEAR) return DQW_VOLTAGE_NOW;
    return DQW_VOLTAGE_NOT_KNOWN;
}

#if DQW_EFFECT_WEIGHTS > 0
int dqw_estimator_read_effect(const dqw_estimator *e, int index, float weights[], float sd[])
{
    if (index < 0 || index >= e->config->effect_count) return DQW_ERR_SIZE;
    const dqw_effect_config *list = e->config->effects;
    int first = DQW_PARAMETERS;
    for (int k = 0; k < index; k++) first += dqw_effect_weights_of(&e->effect, list[k].effect);
    if (list[index].effect == DQW_EFFECT_DEAD_TIME) first = DQW_DEAD_TIME;
    const int n = dqw_effect_weights(list[index].effect);
    for (int i = 0; i < n; i++) {
        weights[i] = dqw_estimator_value(e, first + i);
        sd[i] = dqw_estimator_sd_value(e, first + i);
    }
    // The law is of a small angle: what is learned lies between its sine and its tangent. (E184)
    if (list[index].effect == DQW_EFFECT_ANGLE_OFFSET) {
        const float w = fabsf(weights[0]);
        sd[0] = with(sd[0], w * w * w * (1.0f / 3.0f));
    }
    return (int)dqw_effect_known(weights, sd, n);
}
#endif
