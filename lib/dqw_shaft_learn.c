// dqw_shaft: the background. It learns what the interrupt handed over, and reads.
#include <math.h>
#include <stddef.h>

#include "dqw_effect.h"
#include "dqw_gain.h"
#include "dqw_gate.h"
#include "dqw_number.h"
#include "dqw_window.h"
#include "dqw_shaft.h"

#define EXCITATION_PU 0.002f
// A weight whose variance is above this was not learned, it fell by less than a hundred times: what it holds is its
// start value.
#define LEARNED_VARIANCE 1e4f
// Blocks over which the residual's statistics are means: a plain sum would stop growing in single precision.
#define MEMORY 65536u
// Single precision cannot tell a smaller residual from rounding.
#define VARIANCE_FLOOR_PU2 1e-13f
// Beyond this, autocorrelation says that the model is wrong, not that the data are few.
#define LAG_MAX 0.98f
// An error beyond this many bases is refused: least squares would weigh it as this squared others, and never forget it.
#define BLOCK_MAX_PU 1e5f
// Three deviations below a tenth.
#define USABLE (0.1f / 3.0f)

// The block's inputs and target, per unit.
static void inputs_of(const dqw_shaft *s, const float block[DQW_SHAFT_SIGNALS], float x[DQW_SHAFT_INPUTS], float *y)
{
    const dqw_shaft_config *c = s->config;
    *y = block[0] / c->torque_base_Nm;
    x[DQW_J] = block[1] * (float)s->window.half / c->w_base_rad_s;
    x[DQW_B] = 0.5f * block[2] / c->w_base_rad_s;
    // Behind the torque, and without the direction where it is not learned.
    const int behind = c->coulomb ? 1 : 2;
    for (int i = DQW_COULOMB; i < s->inputs; i++) x[i] = 0.5f * block[behind + i];
}

static void follow(float *mean, float x, float n)
{
    *mean += (x - *mean) / n;
}

// Residual statistics of a block whose error was e_pu, and `after` once the weights were corrected.
static void judge(dqw_shaft *s, float e_pu, float after, float y)
{
    if (s->gate.blocks < UINT32_MAX) s->gate.blocks++;
    const float n = (float)(s->gate.blocks < MEMORY ? s->gate.blocks : MEMORY);
    // The sum of e^2 (1 - k x) is that of the final weights' residuals.
    follow(&s->error_pu2, e_pu * after, n);
    follow(&s->lag_pu2, after * s->error_last_pu, n);
    follow(&s->target_pu2, y * y, n);
    s->error_last_pu = after;
}

static bool learn(dqw_shaft *s, const float block[DQW_SHAFT_SIGNALS])
{
    // [SHAFT.3] the block's inputs, and which of them can teach their weight
    float x[DQW_SHAFT_INPUTS] = {0};
    float y;
    inputs_of(s, block, x, &y);
    const float least = s->config->excitation_pu > 0.0f ? s->config->excitation_pu : EXCITATION_PU;
    float taught[DQW_SHAFT_INPUTS] = {0};
    float e_pu = y;
    uint32_t excited = 0;
    for (int i = 0; i < s->inputs; i++) {
        e_pu -= s->w_pu[i] * x[i];
        if (!(fabsf(x[i]) >= least)) continue;
        taught[i] = x[i];
        excited |= 1u << i;
    }
    // Through the gate come steps below 7e4 bases, and all else below 10; of what is no number the error is none.
    const bool sound = dqw_within(e_pu, BLOCK_MAX_PU);
    s->excited = sound ? excited : 0u;
    if (!sound && s->skipped < UINT32_MAX) s->skipped++;
    if (s->excited == 0) return false;

    // [SHAFT.4] correct the weights of one neuron by all that was learned
    float k_pu[DQW_SHAFT_INPUTS] = {0};
    dqw_gain_step(&s->gain, taught, k_pu);
    float left = 1.0f;
    for (int i = 0; i < s->inputs; i++) {
        s->w_pu[i] += k_pu[i] * e_pu;
        left -= k_pu[i] * taught[i];
    }
    // Rounding alone makes it negative.
    judge(s, e_pu, left > 0.0f ? e_pu * left : 0.0f, y);
    return true;
}

bool dqw_shaft_background(dqw_shaft *s)
{
    if (!dqw_handover_waits(&s->window.over)) return false;
    float block[DQW_SHAFT_SIGNALS];
    float sum[2];
    const uint32_t event = dqw_window_join(&s->window, &s->rise, block, sum);
    dqw_handover_release(&s->window.over);
    if (event == DQW_EVENT_INCOMPLETE && s->gate.incomplete < UINT32_MAX) s->gate.incomplete++;
    return event == DQW_EVENT_BLOCK && learn(s, block);
}

static float variance_pu2(const dqw_shaft *s)
{
    const float n = (float)s->gate.blocks;
    const float freedom = n - (float)s->inputs;
    float v = freedom < 1.0f ? 1.0f : s->error_pu2 * (n / freedom);
    v = v > VARIANCE_FLOOR_PU2 ? v : VARIANCE_FLOOR_PU2;
    if (!(s->error_pu2 > VARIANCE_FLOOR_PU2)) return v;
    float r = s->lag_pu2 / s->error_pu2;
    r = r < 0.0f ? 0.0f : r > LAG_MAX ? LAG_MAX : r;
    return v * (1.0f + r) / (1.0f - r);
}

// Weight i in SI, and its deviation. What single precision cannot hold is not known.
static void read_weight(const dqw_shaft *s, int i, float *value, float *sd)
{
    const float unit = i == DQW_J ? s->J_unit_kgm2 : i == DQW_B ? s->B_unit_Nms_rad : s->config->torque_base_Nm;
    const float p = dqw_gain_covariance(&s->gain, i, i);
    *value = s->w_pu[i] * unit;
    *sd = p < LEARNED_VARIANCE ? sqrtf(p * variance_pu2(s)) * unit : DQW_UNKNOWN;
    if (!dqw_is_finite(*value)) *value = 0.0f, *sd = DQW_UNKNOWN;
    if (!dqw_within(*sd, DQW_UNKNOWN)) *sd = DQW_UNKNOWN;
}

dqw_reading dqw_shaft_read(const dqw_shaft *s, enum dqw_shaft_parameter which)
{
    dqw_reading r = {0.0f, DQW_UNKNOWN, DQW_UNKNOWN, false};
    const int i = (int)which;
    if (i < 0 || i > DQW_COULOMB || (i == DQW_COULOMB && !s->config->coulomb)) return r;
    read_weight(s, i, &r.value, &r.sd);
    r.sd_change = r.sd;
    r.usable = r.sd < USABLE * r.value;
    return r;
}

#if DQW_EFFECT_WEIGHTS > 0
int dqw_shaft_read_effect(const dqw_shaft *s, int index, float weights[], float sd[])
{
    const dqw_shaft_config *c = s->config;
    if (index < 0 || index >= c->effect_count) return DQW_ERR_SIZE;
    int first = s->inputs - s->weights;
    for (int k = 0; k < index; k++) first += dqw_effect_weights(c->effects[k].effect);
    const int n = dqw_effect_weights(c->effects[index].effect);
    float learned[DQW_EFFECT_STARTS];
    for (int i = 0; i < n; i++) {
        read_weight(s, first + i, &weights[i], &sd[i]);
        // A start value says nothing of the effect's size.
        learned[i] = sd[i] < DQW_UNKNOWN ? weights[i] : 0.0f;
    }
    return (int)dqw_effect_known(learned, sd, n);
}
#endif
