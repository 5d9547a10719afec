// The data turned into the magnet's own frame: back by the time that the angle is late, and by the angle that the
// encoder is found to be off. (E102) The speed as the angle has it. (E107)
#include <math.h>

#include "dqw_estimator_block.h"
#include "dqw_segment.h"
#include "dqw_transform.h"

// An angle below this, or below so many of its deviations, is not worth turning by; of so many blocks it is known.
#define LEAST_RAD 0.01f
#define KNOWN_SD 4.0f
#define KNOWN_BLOCKS 500u
#define FIRST_SEGMENTS 3u
// What a fault's onset makes of the flux does not stay: an encoder that is off does.
#define LASTING_BLOCKS 100u
// A speed that a loop takes from the angle is late. Blocks over which that is a mean, that it needs, and deviations
// beyond which it is so; an angle that is further ahead than acos 0.9 is another sensor's fault.
#define LAG_BLOCKS 4096u
#define LAG_FEW 100u
#define LAG_SD 5.0f
#define LAG_LEAST 0.1f  // of half a window
#define LAG_MOTION 0.5f
#define AHEAD_COSINE 0.9f

static void turn(float x[2], float c, float n)
{
    const float d = x[0];
    x[0] = c * d + n * x[1];
    x[1] = c * x[1] - n * d;
}

static bool has_effects(const dqw_estimator *e)
{
#if DQW_EFFECT_WEIGHTS > 0
    return e->effect.count > 0;
#else
    (void)e;
    return false;
#endif
}

// How late the speed is, where that is beyond doubt, and the speed's changes are more motion than noise, which does not
// last: that many times those would bring more of the noise than it mends, and what is over next to nothing may be
// anything.
static float lag_s_of(const dqw_estimator *e)
{
    const float blocks = e->blocks < LAG_BLOCKS ? (float)e->blocks : (float)LAG_BLOCKS;
    const bool sure = e->blocks >= LAG_FEW &&
                      e->lag_num * e->lag_num * blocks > LAG_SD * LAG_SD * e->lag_rest * e->lag_by;
    const bool moves = e->lag_den > LAG_MOTION * e->lag_by;
    const float lag_s = sure && moves ? e->lag_num / e->lag_den : 0.0f;
    // Not what the angle itself may be late by.
    return lag_s > LAG_LEAST * (float)e->window.half * e->config->dt_s ? lag_s : 0.0f;
}

bool dqw_estimator_keep_pace(dqw_estimator *e, dqw_estimator_block *b, const float advance[2], float w_m_rad_s)
{
    const float half_s = (float)e->window.half * e->config->dt_s;
    float *before = e->w_before_rad_s;
    const float faster = w_m_rad_s - before[0];
    const float earlier = before[1] - before[2];
    e->paced = e->elapsed == 1 && b->whole ? (e->paced < 3 ? (uint8_t)(e->paced + 1) : e->paced) : 0;
    before[2] = before[1];
    before[1] = before[0];
    before[0] = w_m_rad_s;
    // Without an angle there is no advance.
    const bool known = advance[0] * advance[0] + advance[1] * advance[1] > 0.5f;
    if (e->paced == 3 && known && e->pole_pairs != 0 && !e->config->settled) {
        // [TUR.1] by how much the angle is ahead of the speed; judged by the change two halves before, whose noise is
        // another
        const float p = (float)e->pole_pairs;
        float c;
        float n;
        dqw_cosine_sine(p * w_m_rad_s * half_s, &c, &n);
        if (advance[0] * c + advance[1] * n > AHEAD_COSINE) {
            const float ahead = (advance[1] * c - advance[0] * n) / p;
            const float rest = ahead - lag_s_of(e) * faster;
            e->lag_num += (ahead * earlier - e->lag_num) * (1.0f / (float)LAG_BLOCKS);
            e->lag_den += (faster * earlier - e->lag_den) * (1.0f / (float)LAG_BLOCKS);
            e->lag_rest += (rest * rest - e->lag_rest) * (1.0f / (float)LAG_BLOCKS);
            e->lag_by += (earlier * earlier - e->lag_by) * (1.0f / (float)LAG_BLOCKS);
        }
    }

    // [TUR.2] the block's speeds as of so much later; where pairs are missing nobody knows how they change
    const float more = lag_s_of(e) * faster / half_s;
    if (more == 0.0f) return true;
    b->sum[8] += 2.0f * more;
    b->sum[6] += more * b->sum[2];
    b->sum[7] += more * b->sum[3];
    return e->paced != 0;
}

void dqw_estimator_turn_block(const dqw_estimator *e, dqw_estimator_block *b)
{
    if (has_effects(e)) return;
    // [TUR.3] the angle that the encoder is off, and what the rotor turns while the angle is late
    float c = e->turn_cosine;
    float n = e->turn_sine;
    if (e->config->angle_late_s != 0.0f && e->pole_pairs != 0) {
        // Of a sum of two speeds.
        const float w_e = 0.5f * (float)e->pole_pairs * b->sum[DQW_BLOCK_SIGNALS - 1];
        float late_c;
        float late_n;
        dqw_cosine_sine(w_e * e->config->angle_late_s, &late_c, &late_n);
        const float both = c * late_c - n * late_n;
        n = n * late_c + c * late_n;
        c = both;
    }
    if (n == 0.0f && c > 0.0f) return;

    // [TUR.4] every vector of the block by both
    // v, i, di, w i; behind the speed dead time's two.
    for (int i = 0; i < DQW_BLOCK_SIGNALS - 1; i += 2) turn(&b->sum[i], c, n);
    for (int i = DQW_BLOCK_SIGNALS; i < DQW_PLAIN_SIGNALS; i += 2) turn(&b->sum[i], c, n);
    turn(b->v_step_V, c, n);
    const float cosine = b->cosine;
    b->cosine = cosine * c - b->sine * n;
    b->sine = b->sine * c + cosine * n;
}

// A voltage that acts in another period than is said turns the frame too: does that leave less than half of the flux
// across? What an encoder's angle leaves of unlike inductances reads as late as well. (E90)
static bool by_the_voltage(const dqw_estimator *e)
{
    const enum dqw_voltage_acts acts = dqw_estimator_voltage_acts(e);
    const bool next = e->config->voltage_next;
    if (acts == DQW_VOLTAGE_NOT_KNOWN || (acts == DQW_VOLTAGE_NEXT) == next) return false;
    const float across = e->w_pu[DQW_PSI_Q];
    const float left = next ? across + e->late_w[DQW_PSI_Q] : across - e->late_w[DQW_PSI_Q];
    return fabsf(left) < 0.5f * fabsf(across);
}

void dqw_estimator_turn_on(dqw_estimator *e)
{
    if (has_effects(e) || !dqw_estimator_has_flux_q(e) || e->config->settled || e->blocks < KNOWN_BLOCKS) return;
    // Later it is a change, and to be told as one.
    if (e->config->follow && e->segment.segments >= FIRST_SEGMENTS && e->across == 0) return;
    // [TUR.5] is there flux across, beyond doubt
    const float psi = e->w_pu[DQW_PSI];
    const float across = e->w_pu[DQW_PSI_Q];
    const float unit = dqw_estimator_unit(e, DQW_PSI_Q);
    const float sd = dqw_estimator_read(e, DQW_PSI_Q).sd;
    if (!(fabsf(across) > LEAST_RAD * psi) || !(fabsf(across) * unit > KNOWN_SD * sd)) {
        e->across = 0;
        return;
    }
    if (++e->across < LASTING_BLOCKS) return;
    e->across = 0;
    if (by_the_voltage(e)) return;

    // [TUR.6] from now on all flux is along d
    const float all = sqrtf(psi * psi + across * across);
    const float c = psi / all;
    const float n = -across / all;
    const float before = e->turn_cosine;
    e->turn_cosine = before * c - e->turn_sine * n;
    e->turn_sine = e->turn_sine * c + before * n;
    e->w_pu[DQW_PSI] = all;
    e->w_pu[DQW_PSI_Q] = 0.0f;
    dqw_segment_restart(&e->segment);

    // [TUR.7] what was learned is of another frame: unlike inductances are to it a resistance and a coupling
    const float widest = 1.0f / dqw_estimator_common_variance(e);
    const float L = e->w_pu[DQW_LD] > e->w_pu[DQW_LQ] ? e->w_pu[DQW_LD] : e->w_pu[DQW_LQ];
    for (int i = DQW_R; i <= DQW_LQ; i++) dqw_gain_grow(&e->gain, i, n * n * L * L * widest);
}
