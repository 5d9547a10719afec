// What the estimator says was learned.
#include "dqw_estimator_block_q15.h"
#include "dqw_q15.h"

// A smaller residual is the sampling's own, and rounding: 1e-8; of settled rows, which have no sampling, of their last
// places alone: 1e-10.
#define VARIANCE_FLOOR_Q56 720575940
#define VARIANCE_FLOOR_SETTLED_Q56 7205759
#define FEW_BLOCKS 50u
// 0.98 and -0.4, as in float.
#define LAG_MAX_Q20 1027604
#define LAG_MIN_Q20 (-419430)
#define ONE_Q20 1048576
// Usable: three deviations are below a tenth of the value.
#define USABLE_PARTS 30
// The period by which a voltage is late counts as 0 or 1 within 0.35, and a deviation of 0.16.
#define LATE_NEAR_Q20 367002
#define LATE_SD_Q20 167772
// Of what noise takes, where the answer may be any part of it; what is measured of it, at most so much: 0.58.
#define ANSWER_PART_Q31 1245540516
// Of what may stand in line with an input, what does: 0.4, squared; with that of an inductance, at right angles to the
// currents, 0.25.
#define MODEL_PART2_Q31 343597384
#define MODEL_PART2_L_Q31 134217728
#define MILLIONTH_Q32 4295u
// To so much an angle's law is off by less than a hundredth of it: 0.25.
#define LAW_HOLDS_Q40 274877906944

uint32_t dqw_estimator_unit_q15(const dqw_estimator_q15_config *config, enum dqw_parameter parameter)
{
    dqw_units_q15 u;
    if ((unsigned)parameter >= DQW_PARAMETERS || dqw_units_of_q15(config, config->scale.pole_pairs, &u) != DQW_OK)
        return 0;
    if (parameter == DQW_DEAD_TIME || parameter == DQW_DEAD_CONSTANT)
        return config->scale.v_full_mV * 100u / DQW_DEAD_TIME_Q15_PARTS * 10u;
    return u.si[parameter == DQW_PSI_Q ? DQW_PSI : parameter];
}

int32_t dqw_estimator_value_q24(const dqw_estimator_q15 *e, int weight)
{
    const int32_t w_q24 = e->w_q24[weight];
    if (weight != DQW_PSI_Q) return w_q24;
    // |w| < 2^30: products below 2^61
    return dqw_q31_sat(
        dqw_q_round64((int64_t)w_q24 * e->turn_cosine_q30 - (int64_t)e->w_q24[DQW_PSI] * e->turn_sine_q30, 30));
}

int64_t dqw_estimator_variance_q56(const dqw_estimator_q15 *e, int axis)
{
    const int64_t least = e->config->settled ? VARIANCE_FLOOR_SETTLED_Q56 : VARIANCE_FLOOR_Q56;
    return e->error_q56[axis] > least ? e->error_q56[axis] : least;
}

int64_t dqw_estimator_common_variance_q56(const dqw_estimator_q15 *e)
{
    return dqw_q_floor64(dqw_estimator_variance_q56(e, 0) + dqw_estimator_variance_q56(e, 1), 1);
}

// Blocks overlap by half, so that next ones are alike, or unlike, in what they teach a weight: that widens or narrows
// its deviation. Dead time goes with the current as R does, the flux on the other axis with the speed as the flux.
// (E61) Settled rows do not overlap: there a residual that goes on is the model's, for as long as it lasts. (E20)
int64_t dqw_estimator_inflation_q20(const dqw_estimator_q15 *e, int weight)
{
    const int k = weight >= DQW_PARAMETERS  ? weight - DQW_PARAMETERS + 4
                  : weight <= DQW_PSI       ? weight
                  : weight == DQW_DEAD_TIME ? DQW_R
                                            : DQW_PSI;
    // [READ.1] the autocorrelation of what blocks teach a weight, bounded
    if (e->score2_q68[k] <= 0) return ONE_Q20;
    const int64_t r_q20 = dqw_q_quotient64(e->score_lag_q68[k], e->score2_q68[k], 20);
    const int64_t bounded_q20 = r_q20 < LAG_MIN_Q20 ? LAG_MIN_Q20 : r_q20 > LAG_MAX_Q20 ? LAG_MAX_Q20 : r_q20;
    if (!e->config->settled) return ONE_Q20 + 2 * bounded_q20;
    return bounded_q20 > 0 ? dqw_q_quotient64(ONE_Q20 + bounded_q20, ONE_Q20 - bounded_q20, 20) : ONE_Q20;
}

// The same of a covariance, wider where the rows are few.
static int64_t variance_q56(const dqw_estimator_q15 *e, int weight, int64_t cov_q40)
{
    return dqw_q_product64(dqw_q_product64(cov_q40, dqw_estimator_common_variance_q56(e), -40),
                           dqw_estimator_inflation_q20(e, weight), -20);
}

// Of two squares up to 2^62, bounded as they are.
static int64_t sum_q56(int64_t a, int64_t b)
{
    const int64_t most = (int64_t)1 << 61;
    return dqw_q_within64(a, most) + dqw_q_within64(b, most);
}

// Squared, INT64_MAX where nothing was learned.
static int64_t noise_q56(const dqw_estimator_q15 *e, int weight)
{
    // [READ.2] a deviation is its covariance times the residual's variance, wider where the rows are few
    // Rows less weights: of few settled ones each counts.
    // Where no leg rests there is one weight less.
    const int n = dqw_estimator_inputs_q15(e) - (dqw_estimator_has_constant_q15(e) ? 0 : 1);
    const int rows = 2 * (int)e->blocks;
    int freedom = rows;
    for (uint32_t left = e->learned; left != 0; left &= left - 1u) freedom--;
    if ((e->learned >> weight & 1u) == 0 || freedom < (e->config->settled ? 1 : 2 * n)) return INT64_MAX;
    return dqw_q_product64(variance_q56(e, weight, e->cov_q40[weight]), dqw_q_quotient64(rows, freedom, 24), -24);
}

static int32_t root_q24(const dqw_estimator_q15 *e, int weight, int64_t v_q56)
{
    if (v_q56 == INT64_MAX) return INT32_MAX;
    // The root of 2^62 at most, Q28
    return dqw_q_floor32((int32_t)dqw_q_root64((uint64_t)v_q56 >> 2), 3u + dqw_estimator_shift_q15(e, weight));
}

int32_t dqw_estimator_noise_sd_q24(const dqw_estimator_q15 *e, int weight)
{
    return root_q24(e, weight, noise_q56(e, weight));
}

// Deviation of a square's mean over the stretches that were, as a part of it.
static uint32_t stretches_tell_q30(const dqw_estimator_q15 *e)
{
    return dqw_q_root64((uint64_t)dqw_lasting_part_q30(e, dqw_estimator_stretch_q15(e)) << 30);
}

dqw_lasting_q15 dqw_estimator_lasting_q15(const dqw_estimator_q15 *e)
{
    // [READ.3] what lasts of the residual, above what noise makes of so many products
    const int64_t all_q56 = dqw_estimator_common_variance_q56(e);
    dqw_lasting_q15 l = {0, 0, all_q56, 0};
    if (e->config->settled || e->blocks <= DQW_LASTING_FROM_Q15) return l;
    const int64_t two = dqw_q_size64(e->residual.lasting_q38[0]);
    const int64_t three = dqw_q_size64(e->residual.lasting_q38[1]);
    // Two deviations of the mean of a block's four products of white errors, whose neighbours overlap: 1.2, squared.
    const uint32_t parts_q30 = (uint32_t)dqw_lasting_part_q30(e, 1) / 25u * 36u;
    const int64_t noise = dqw_q_product64(all_q56, dqw_q_root64((uint64_t)parts_q30 << 30), -30);
    const int64_t turning_q56 = (int64_t)e->residual.lasting_q38[2] * 262144 - noise;
    if (turning_q56 > 0) l.turning_q56 = turning_q56;
    const int64_t fast_q56 = (two > three ? two : three) * 262144 - noise;
    if (fast_q56 > 0) l.fast_q56 = fast_q56;
    // The same of a stretch's two, whose blocks overlap: 1.5.
    const int64_t of_stretch_q56 = dqw_q_quotient64(dqw_q_product64(all_q56, 3, -1), dqw_estimator_stretch_q15(e), 0);
    const int64_t slow_q56 = (int64_t)e->residual.slow_q38 * 262144 -
                             dqw_q_product64(of_stretch_q56, stretches_tell_q30(e), -30);
    if (slow_q56 > 0) l.slow_q56 = slow_q56;
    return l;
}

dqw_lasting_q15 dqw_estimator_calm_q15(const dqw_estimator_q15 *e)
{
    const uint32_t *root_q28 = e->residual.calm_q28;
    // Of squares below 2^62
    const dqw_lasting_q15 l = {
        (int64_t)((uint64_t)root_q28[0] * root_q28[0]), (int64_t)((uint64_t)root_q28[1] * root_q28[1]),
        (int64_t)((uint64_t)root_q28[2] * root_q28[2]), (int64_t)((uint64_t)root_q28[3] * root_q28[3])};
    return l;
}

int64_t dqw_estimator_witness_q56(const dqw_estimator_q15 *e)
{
    const dqw_lasting_q15 calm = dqw_estimator_calm_q15(e);
    // 0.4, squared
    return dqw_q_quotient64(calm.fast_q56, 25 * (1 + (int64_t)e->segment.since), 2);
}

// Squared, INT64_MAX where nobody knows.
static int64_t model_q56(const dqw_estimator_q15 *e, int weight, const dqw_lasting_q15 *l)
{
    // Each in line with its own part of the input: what is fast of one that is slow, no less than so many stretches
    // tell, and a last place.
    const uint32_t alone_q31 = e->residual.alone_q31[weight];
    const uint32_t slow_q31 = e->residual.slow_alone_q31[weight];
    if (l->fast_q56 == 0 && l->slow_q56 == 0) return 0;
    if (alone_q31 == 0) return INT64_MAX;
    const uint32_t slowly_q31 = slow_q31 < alone_q31 ? slow_q31 : alone_q31;
    const uint32_t told_q31 = (uint32_t)(((uint64_t)slowly_q31 * stretches_tell_q30(e)) >> 30) + 1u;
    const uint32_t quickly_q31 = told_q31 > alone_q31 - slowly_q31 ? told_q31 : alone_q31 - slowly_q31;
    // As much as twice all of the larger one: 2^49 by 2^32 by 2^-18
    const int64_t both_q69 = dqw_q_product64(l->slow_q56, slowly_q31, -18) +
                             dqw_q_product64(l->fast_q56, quickly_q31, -18);
    return dqw_q_quotient64(dqw_q_quotient64(both_q69, alone_q31, 31), alone_q31, 18);
}

int32_t dqw_estimator_model_q28(const dqw_estimator_q15 *e, int weight, const dqw_lasting_q15 *l)
{
    const int64_t square_q56 = model_q56(e, weight, l);
    // The root of 2^62 at most
    const uint32_t root_q28 = dqw_q_root64((uint64_t)square_q56);
    return square_q56 == INT64_MAX ? INT32_MAX : root_q28 < INT32_MAX ? (int32_t)root_q28 : INT32_MAX - 1;
}

// Half a lasting error's size, or its scatter between segments where that is known, squared: what no residual shows;
// and what an opening so many segments ago has left open, of one operating point as much as segments scatter. (E106)
static int64_t hidden_q56(const dqw_estimator_q15 *e, int weight, const dqw_lasting_q15 *l, int32_t in_line_q31,
                          uint16_t opened)
{
    const int64_t model = model_q56(e, weight, l);
    if (model == INT64_MAX) return INT64_MAX;
    const bool leans = e->config->observed && weight <= DQW_LQ;
    const int64_t part = leans ? model : dqw_q_product64(model, in_line_q31, -31);
    int64_t band_q28 = weight < DQW_FOLLOWED ? e->segment.band_q28[weight] : 0;
#if DQW_MAP_WEIGHTS > 0
    band_q28 = dqw_q31_sat(dqw_estimator_counted_q15(e, weight, band_q28, 1));
#endif
    const int64_t band = band_q28 * band_q28;
    const int64_t hides = sum_q56(part, band <= model ? band : band_q28 * dqw_q_root64((uint64_t)model));
    const int64_t open_q28 = opened > 0 ? dqw_q31_sat(DQW_TOOK_BANDS_Q15 * band_q28) / opened : 0;
    return sum_q56(hides, open_q28 * open_q28);
}

// An error of the voltage that the user allows for, all of it in line with the input, squared: half on each axis.
static int64_t of_voltage_q56(const dqw_estimator_q15 *e, int weight)
{
    const dqw_estimator_q15_config *c = e->config;
    if (c->voltage_error_mV == 0) return 0;
    const int64_t error_q28 = dqw_q_within64(dqw_q_quotient64(c->voltage_error_mV, c->scale.v_full_mV, 28),
                                             (int64_t)1 << 30);
    const int64_t square_q56 = error_q28 * error_q28;
    // Settled rows forget nothing: one over P is the sum of both axes' powers.
    if (c->settled) return dqw_q_product64(dqw_q_product64(e->cov_q40[weight], square_q56, -40), e->blocks, 0);
    const int64_t alone_q31 = e->residual.alone_q31[weight];
    if (alone_q31 == 0) return INT64_MAX;
    // A quiet axis' rows weigh more: there the error is, but for the flux, which has its own.
    const int64_t d_q56 = dqw_estimator_variance_q56(e, 0);
    const int64_t q_q56 = dqw_estimator_variance_q56(e, 1);
    const bool in_q = weight == DQW_PSI || (q_q56 < d_q56 && (weight != DQW_PSI_Q || dqw_estimator_seeks_q15(e)));
    const int64_t weight_q24 = dqw_q_quotient64(dqw_estimator_common_variance_q56(e), in_q ? q_q56 : d_q56, 24);
    const int64_t most_q24 = (int64_t)64 << 24;
    const int64_t by_q24 = weight_q24 < most_q24 ? weight_q24 : most_q24;
    return dqw_q_product64(dqw_q_quotient64(square_q56, alone_q31, 30), by_q24, -24);
}

// Noise of the currents that a controller answers goes with the voltage, and what is taken out for noise is taken for
// its answer as well: an inductance may be off by a part of it, and the flux by what goes with that. (E188)
static int64_t of_answer_q56(const dqw_estimator_q15 *e, int weight)
{
    const int64_t *a = e->normal.a_q32;
    int64_t square_q56 = 0;
    for (int L = DQW_LD; L <= DQW_LQ; L++) {
        const int64_t noisy = e->residual.noisy_q35[L - DQW_LD];
        const int64_t clear = (int64_t)e->residual.alone_q31[L] * 16 - noisy;
        if (noisy == 0 || (weight != L && weight != DQW_PSI)) continue;
        // Where half of it and more is noise, nothing of it may be the machine's, and the other axis says how large that
        // can be.
        const int64_t w_q24 = dqw_estimator_size_q24(e, L);
        const int64_t other_q24 = dqw_estimator_size_q24(e, L == DQW_LD ? DQW_LQ : DQW_LD);
        const int64_t most_q24 = other_q24 > w_q24 ? other_q24 : w_q24;
        const int64_t measured_q31 = (int64_t)e->answered_q15 * 65536;
        const int64_t part_q31 = measured_q31 < ANSWER_PART_Q31 ? measured_q31 : ANSWER_PART_Q31;
        int64_t off_q28 = clear > noisy ? dqw_q_product64(w_q24, dqw_q_quotient64(noisy, clear, 31), -31) : most_q24;
        off_q28 = dqw_q_product64(off_q28, clear > noisy ? part_q31 : ANSWER_PART_Q31, -27);
        if (L != weight) {
            const int64_t both = a[L < weight ? DQW_NORMAL_A(L, weight) : DQW_NORMAL_A(weight, L)];
            off_q28 = dqw_q_product64(off_q28, dqw_q_quotient64(both, a[DQW_NORMAL_A(weight, weight)], 24), -24);
        }
        const int64_t bounded_q28 = dqw_q31_sat(off_q28);
        square_q56 = sum_q56(square_q56, bounded_q28 * bounded_q28);
    }
    return square_q56;
}

static int64_t now_hidden_q56(const dqw_estimator_q15 *e, int weight)
{
    dqw_lasting_q15 now = dqw_estimator_lasting_q15(e);
    if (now.turning_q56 > now.fast_q56) now.fast_q56 = now.turning_q56;
    const int32_t in_line_q31 = weight == DQW_LD || weight == DQW_LQ ? MODEL_PART2_L_Q31 : MODEL_PART2_Q31;
    const int64_t hides = hidden_q56(e, weight, &now, in_line_q31, e->residual.opened > 0 ? e->segment.since : 0);
    const int64_t more = of_voltage_q56(e, weight);
    if (hides == INT64_MAX || more == INT64_MAX) return INT64_MAX;
    return sum_q56(sum_q56(hides, more), e->config->settled ? 0 : of_answer_q56(e, weight));
}

int32_t dqw_estimator_sd_q24(const dqw_estimator_q15 *e, int weight)
{
    return dqw_estimator_sd_since_q24(e, weight, e->segment.since);
}

int32_t dqw_estimator_sd_since_q24(const dqw_estimator_q15 *e, int weight, uint16_t since)
{
    const int64_t noise = noise_q56(e, weight);
    if (noise == INT64_MAX) return INT32_MAX;
    const dqw_lasting_q15 lasts = dqw_estimator_knows_calm_q15(e) ? dqw_estimator_calm_q15(e)
                                                                  : dqw_estimator_lasting_q15(e);
    const int64_t hides = hidden_q56(e, weight, &lasts, MODEL_PART2_Q31, 0);
    const int64_t met = 1 + (int64_t)since;
    return root_q24(e, weight, hides == INT64_MAX ? INT64_MAX : sum_q56(noise, dqw_q_quotient64(hides, met, 0)));
}

// Every weight is volts for something: in volts a part too large all are that part too large, and nothing shows it.
static int32_t of_scale_q24(const dqw_estimator_q15 *e, int weight)
{
    return dqw_q_times32(dqw_estimator_value_q24(e, weight), (int32_t)(e->config->voltage_scale_ppm * MILLIONTH_Q32),
                         -32);
}

// As it is now, of a deviation as noise makes it. What is not known is as long as it can be, whatever is added.
static int32_t with_hidden_q24(const dqw_estimator_q15 *e, int weight, int32_t sd_q24)
{
    const int32_t seen_q24 = dqw_q_length32(sd_q24, root_q24(e, weight, now_hidden_q56(e, weight)));
    return dqw_q_length32(seen_q24, of_scale_q24(e, weight));
}

#if DQW_EFFECT_WEIGHTS > 0
// By how much an inductance or the flux is more in the magnet's frame than in that of an angle that is off, to second
// order, and what that angle's deviation and the order beyond make of it. (E184)
static int64_t beyond_frame_q40(const dqw_estimator_q15 *e, enum dqw_parameter parameter, int32_t *sd_q24)
{
    *sd_q24 = 0;
    for (int k = 0; k < e->effect.count; k++) {
        int64_t angle_q40 = 0;
        int64_t angle_sd_q40 = 0;
        if (e->effect.list[k].effect != DQW_EFFECT_ANGLE_OFFSET || parameter < DQW_LD || parameter > DQW_PSI) continue;
        if (dqw_estimator_read_effect_q15(e, k, &angle_q40, &angle_sd_q40) == 0) return 0;
        const enum dqw_parameter other = parameter == DQW_LD ? DQW_LQ : DQW_LD;
        const int64_t w_q24 = dqw_estimator_value_q24(e, (int)parameter);
        // Each has its own unit. |w| < 2^30: products below 2^62
        const int64_t others_q24 = dqw_q_quotient64((int64_t)dqw_estimator_value_q24(e, (int)other) *
                                                        dqw_estimator_unit_q15(e->config, other),
                                                    dqw_estimator_unit_q15(e->config, parameter), 0);
        const int64_t turned_q24 = parameter == DQW_PSI ? dqw_q_floor64(w_q24, 1) : w_q24 - others_q24;
        const int64_t size_q40 = dqw_q_size64(angle_q40);
        const int64_t part_q40 = dqw_q_product64(size_q40, size_q40, -40);
        const int64_t more_q40 = dqw_q_product64(turned_q24, part_q40, -24);
        // [READ.5] beyond what the law holds for the whole of it may be wrong
        if (size_q40 >= LAW_HOLDS_Q40) {
            *sd_q24 = dqw_q31_sat(dqw_q_size64(dqw_q_floor64(more_q40, 16)));
            return 0;
        }
        const int64_t beyond_q40 = dqw_q_product64(size_q40, part_q40, -41);
        const int64_t slope_q24 = dqw_q_size64(dqw_q_product64(turned_q24, size_q40, -39));
        *sd_q24 = dqw_q31_sat(dqw_q_product64(slope_q24, angle_sd_q40 + beyond_q40, -40));
        return more_q40;
    }
    return 0;
}
#endif

dqw_reading_q15 dqw_estimator_read_q15(const dqw_estimator_q15 *e, enum dqw_parameter parameter)
{
    dqw_reading_q15 r = {.value_q40 = 0, .sd_q40 = INT64_MAX, .sd_change_q40 = INT64_MAX, .usable = false};
    if ((unsigned)parameter >= DQW_PARAMETERS) return r;
    const bool seeks = dqw_estimator_seeks_q15(e);
    if (!seeks || parameter <= DQW_PSI) r.value_q40 = (int64_t)dqw_estimator_value_q24(e, (int)parameter) * 65536;
    // What these rows cannot tell without the pole pairs.
    if (e->pole_pairs == 0 && parameter != DQW_R && (e->config->settled || parameter > DQW_LQ)) return r;
    const int32_t change_q24 = dqw_estimator_sd_q24(e, (int)parameter);
    int32_t sd_q24 = with_hidden_q24(e, (int)parameter, dqw_estimator_noise_sd_q24(e, (int)parameter));
#if DQW_EFFECT_WEIGHTS > 0
    int32_t frame_sd_q24;
    r.value_q40 += beyond_frame_q40(e, parameter, &frame_sd_q24);
    sd_q24 = dqw_q_length32(sd_q24, frame_sd_q24);
#endif
    if (change_q24 != INT32_MAX) r.sd_change_q40 = (int64_t)change_q24 * 65536;
    if (sd_q24 == INT32_MAX || dqw_estimator_observer_hides_q15(e, (int)parameter)) return r;
    r.sd_q40 = (int64_t)sd_q24 * 65536;
    const bool either_sign = parameter >= DQW_DEAD_TIME;
    // A stage that begins anew learns nothing: what it has is of a model that did not fit.
    r.usable = e->stage.name != DQW_STAGE_DOMAIN &&
               r.sd_q40 * USABLE_PARTS < (either_sign ? dqw_q_size64(r.value_q40) : r.value_q40);
    return r;
}

uint16_t dqw_estimator_pole_pairs_q15(const dqw_estimator_q15 *e)
{
    return e->pole_pairs;
}

uint32_t dqw_estimator_residual_q28(const dqw_estimator_q15 *e)
{
    const int64_t both_q56 = e->error_q56[0] + e->error_q56[1];
    return both_q56 > 0 ? dqw_q_root64((uint64_t)both_q56) : 0;
}

uint32_t dqw_estimator_recent_q27(const dqw_estimator_q15 *e)
{
    return dqw_q_root64((uint64_t)e->recent_q54);
}

uint32_t dqw_estimator_recent_ppm_q15(const dqw_estimator_q15 *e)
{
    return (uint32_t)(((uint64_t)dqw_estimator_recent_q27(e) * 1000000) >> 27);  // up to 32 millions
}

int64_t dqw_estimator_beside_late_q24(const dqw_estimator_q15 *e, int weight)
{
    const int n = dqw_estimator_inputs_q15(e);
    dqw_normal_q15 m = e->normal;
    dqw_solution_q15 s;
    dqw_normal_solve_q15(&m, dqw_normal_nought_q40, &s);
    if (s.cov_q40[n] == INT64_MAX) return 0;
    // The target's sum is above what the late voltage explains; twice is enough.
    const int64_t periods_q32 = dqw_q_product64(s.cov_q40[n], m.b_q32[n], -40);
    m.c_q32 = dqw_q_size64(dqw_q_product64(periods_q32, m.b_q32[n], -31)) + 16;
    dqw_normal_solve_q15(&m, dqw_normal_nought_q40, &s);
    return dqw_q_round64(s.w_q40[weight], 16);
}

enum dqw_voltage_acts dqw_estimator_voltage_acts_q15(const dqw_estimator_q15 *e)
{
    if (e->blocks < FEW_BLOCKS || e->config->settled) return DQW_VOLTAGE_NOT_KNOWN;
    // What the inputs leave of the late voltage, as one more of them.
    const int n = dqw_estimator_inputs_q15(e);
    static const int64_t stay_q40[DQW_NORMAL_INPUTS] = {0};
    dqw_solution_q15 s;
    dqw_normal_solve_q15(&e->normal, stay_q40, &s);
    if (s.cov_q40[n] == INT64_MAX) return DQW_VOLTAGE_NOT_KNOWN;
    const int64_t sd_q20 = dqw_q_root64((uint64_t)dqw_q_scale64(variance_q56(e, DQW_R, s.cov_q40[n]), -16));
    // The others' gradient is 0 where the weights were solved, and next to nothing since then.
    const int64_t periods_q20 = dqw_q_product64(s.cov_q40[n], e->normal.b_q32[n], -52);
    // [READ.4] the period by which it is late is 0 or 1, or nobody knows
    const bool next = e->config->voltage_next;
    if (sd_q20 >= LATE_SD_Q20) return DQW_VOLTAGE_NOT_KNOWN;
    if (dqw_q_size64(periods_q20) < LATE_NEAR_Q20) return next ? DQW_VOLTAGE_NEXT : DQW_VOLTAGE_NOW;
    if (dqw_q_size64(periods_q20 + (next ? ONE_Q20 : -ONE_Q20)) < LATE_NEAR_Q20)
        return next ? DQW_VOLTAGE_NOW : DQW_VOLTAGE_NEXT;
    return DQW_VOLTAGE_NOT_KNOWN;
}

#if DQW_EFFECT_WEIGHTS > 0
int dqw_estimator_read_effect_q15(const dqw_estimator_q15 *e, int index, int64_t weights_q40[], int64_t sd_q40[])
{
    if (index < 0 || index >= e->effect.count) return DQW_ERR_SIZE;
    const dqw_effect_q15_config *list = e->effect.list;
    int first = DQW_PARAMETERS;
    for (int k = 0; k < index; k++) first += dqw_effect_weights_of_q15(&e->effect, list[k].effect);
    const bool dead_time = list[index].effect == DQW_EFFECT_DEAD_TIME;
    const int n = dqw_effect_weights(list[index].effect);
    for (int i = 0; i < n; i++) {
        const int weight = dead_time ? DQW_DEAD_TIME : first + i;
        const int more = 16 + (int)dqw_estimator_shift_q15(e, weight);
        const int32_t sd_q24 = with_hidden_q24(e, weight, dqw_estimator_noise_sd_q24(e, weight));
        const int64_t w = dqw_q_scale64(e->w_q24[weight], more);
        const int64_t sd = dqw_q_scale64(sd_q24, more);
        weights_q40[i] = dead_time ? dqw_q_quotient64(w, DQW_DEAD_TIME_Q15_PARTS, 0)
                                   : dqw_effect_restored_q40(&e->effect, index, i, w);
        sd_q40[i] = dead_time ? dqw_q_quotient64(sd, DQW_DEAD_TIME_Q15_PARTS, 0)
                              : dqw_effect_restored_q40(&e->effect, index, i, sd);
        if (sd_q24 == INT32_MAX) sd_q40[i] = INT64_MAX;
    }
    // The law is of a small angle: what is learned lies between its sine and its tangent. (E184)
    if (list[index].effect == DQW_EFFECT_ANGLE_OFFSET && sd_q40[0] != INT64_MAX) {
        const int64_t w_q40 = dqw_q_size64(weights_q40[0]);
        const int64_t third_q40 = dqw_q_quotient64(dqw_q_product64(dqw_q_product64(w_q40, w_q40, -40), w_q40, -40), 3,
                                                   0);
        sd_q40[0] = (int64_t)dqw_q_length32(dqw_q31_sat(dqw_q_floor64(sd_q40[0], 16)),
                                            dqw_q31_sat(dqw_q_floor64(third_q40, 16))) *
                    65536;
    }
    return (int)dqw_effect_known_q15(weights_q40, sd_q40, n);
}
#endif
