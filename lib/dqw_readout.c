// dqw_model_read(): what the weights of two neurons say together of one machine.
#include <math.h>

#include "dqw_model.h"

enum { R = 0, LD, LQ, PSI, BASE };
// Parameters, and inputs of one axis, with every effect that there is room for.
#define N (BASE + DQW_EFFECT_WEIGHTS)
#define INPUTS (DQW_Q_INPUTS + DQW_EFFECT_WEIGHTS)

// Pole pairs are taken for an integer when every other integer is this many deviations away, ...
#define EVIDENCE_SD 4.0f
// ... and the estimate itself lies this close to one.
#define EVIDENCE_DISTANCE 0.25f
#define POLE_PAIRS_MAX 100.0f
// Pivots of the scaled information matrix below this say that a direction was never learned.
#define PIVOT_MIN 1e-5f
// A parameter that is tied to a direction never learned by more than this, per unit-diagonal weight, is not learned either.
#define TIE_MAX 1e-3f
// Bound on the part of a weight that noise on its regressor may have taken.
#define SHRUNK_MAX 0.1f

// Information of an axis' weights, per unit of its bases: P^-1 = V' D^-1 V with V = U^-1, less what the start values
// brought, per unit of residual variance.
static void information(const dqw_axis *a, int n, float info[INPUTS][INPUTS])
{
    float v[INPUTS][INPUTS] = {{0}};
    for (int j = 0; j < n; j++) {
        v[j][j] = 1.0f;
        for (int i = j - 1; i >= 0; i--)
            for (int m = i + 1; m <= j; m++) v[i][j] -= a->gain.u[DQW_GAIN_U(i, m)] * v[m][j];
    }
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            info[i][j] = i == j ? -1.0f / DQW_AXIS_P0 : 0.0f;
            for (int m = 0; m < n; m++) info[i][j] += v[m][i] * v[m][j] / a->gain.d[m];
        }
}

// One axis' part of the normal equations in SI weights scaled by `unit`. to[i] is the parameter that weight i stands
// for, factor[i] how many of it: p for the cross and flux weights.
static void add_axis(const dqw_axis *a, int n, float info[INPUTS][INPUTS], float variance_pu2, const int to[], const float factor[], const float unit[N],
                     float m[N][N], float rhs[N])
{
    float jac[INPUTS];
    const float s = 1.0f / variance_pu2;
    for (int i = 0; i < n; i++) jac[i] = factor[i] * unit[to[i]] / (a->neuron.y_base * a->neuron.x_scale[i]);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            m[to[i]][to[j]] += jac[i] * (s * info[i][j]) * jac[j];
            rhs[to[i]] += jac[i] * (s * info[i][j]) * a->neuron.w_pu[j];
        }
}

// What one machine's parameters, SI, add to an axis' sum of squared residuals, per unit.
static float axis_misfit(const dqw_axis *a, int n, float info[INPUTS][INPUTS], const int to[], const float factor[], const float value[N])
{
    float off[INPUTS];
    for (int i = 0; i < n; i++) off[i] = a->neuron.w_pu[i] - factor[i] * value[to[i]] / (a->neuron.y_base * a->neuron.x_scale[i]);
    float sum = 0.0f;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) sum += off[i] * info[i][j] * off[j];
    return fmaxf(sum, 0.0f);
}

// Inverse of a symmetric positive matrix by Gauss-Jordan on its unit-diagonal form; a row whose pivot vanishes is left
// out and its diagonal set to infinity.
static void invert(float m[N][N], int size)
{
    float scale[N];
    bool out[N] = {false};
    for (int i = 0; i < size; i++) {
        out[i] = !(m[i][i] > 0.0f) || !isfinite(m[i][i]);
        scale[i] = out[i] ? 0.0f : 1.0f / sqrtf(m[i][i]);
    }
    for (int i = 0; i < size; i++)
        for (int j = 0; j < size; j++) m[i][j] *= scale[i] * scale[j];
    for (int k = 0; k < size; k++) {
        if (out[k] || !(m[k][k] > PIVOT_MIN)) {
            out[k] = true;
            continue;
        }
        const float pivot = 1.0f / m[k][k];
        m[k][k] = 1.0f;
        for (int j = 0; j < size; j++) m[k][j] *= pivot;
        for (int i = 0; i < size; i++) {
            if (i == k) continue;
            const float f = m[i][k];
            m[i][k] = 0.0f;
            for (int j = 0; j < size; j++) m[i][j] -= f * m[k][j];
        }
    }
    // A pivot's row now tells, in the columns left out, how it depends on them.
    bool tied[N] = {false};
    for (int i = 0; i < size; i++)
        for (int j = 0; j < size; j++)
            if (!out[i] && out[j] && fabsf(m[i][j]) > TIE_MAX) tied[i] = true;
    for (int i = 0; i < size; i++)
        for (int j = 0; j < size; j++) {
            m[i][j] *= scale[i] * scale[j];
            if (i == j && tied[i]) m[i][j] = INFINITY;
            if (out[i] || out[j]) m[i][j] = i == j ? INFINITY : 0.0f;
        }
}

// Relative variance of the ratio of the cross weight to the axis' own inductance weight.
static float ratio_variance(const dqw_axis *a)
{
    if (!isfinite(dqw_axis_weight_sd(a, DQW_IN_L)) || !isfinite(dqw_axis_weight_sd(a, DQW_IN_CROSS))) return INFINITY;
    const float l = a->neuron.w_pu[DQW_IN_L];
    const float x = a->neuron.w_pu[DQW_IN_CROSS];
    const float ll = dqw_gain_covariance(&a->gain, DQW_IN_L, DQW_IN_L) / (l * l);
    const float xx = dqw_gain_covariance(&a->gain, DQW_IN_CROSS, DQW_IN_CROSS) / (x * x);
    const float lx = dqw_gain_covariance(&a->gain, DQW_IN_L, DQW_IN_CROSS) / (l * x);
    return (ll + xx - 2.0f * lx) * dqw_axis_variance_pu2(a) * dqw_axis_inflation(a);
}

// p from the cross weights: (p Lq / Ld)(p Ld / Lq) = p^2, whatever the saliency.
static void find_pole_pairs(const dqw_axis *d, const dqw_axis *q, dqw_parameters *out)
{
    const float ratio_d = dqw_learner_weight(&d->neuron, DQW_IN_CROSS) / dqw_learner_weight(&d->neuron, DQW_IN_L);
    const float ratio_q = dqw_learner_weight(&q->neuron, DQW_IN_CROSS) / dqw_learner_weight(&q->neuron, DQW_IN_L);
    out->pole_pairs_raw = NAN;
    out->pole_pairs_raw_sd = INFINITY;
    const float p2 = ratio_d * ratio_q;
    if (!isfinite(p2) || !(p2 > 0.0f)) return;
    const float p = sqrtf(p2);
    const float sd = 0.5f * p * sqrtf(ratio_variance(d) + ratio_variance(q));
    if (!isfinite(sd)) return;
    out->pole_pairs_raw = p;
    out->pole_pairs_raw_sd = sd;
}

// Variance of one block's residual on one axis, widened by the likeness of neighbours; or that of both axes together.
static float variance(const dqw_axis *a)
{
    return dqw_axis_variance_pu2(a) * dqw_axis_inflation(a);
}

static float common_variance(const dqw_axis *d, const dqw_axis *q)
{
    const float n_d = (float)d->blocks;
    const float n_q = (float)q->blocks;
    if (!(n_d + n_q > 0.0f)) return 1.0f;
    return (n_d * variance(d) + n_q * variance(q)) / (n_d + n_q);
}

dqw_parameters dqw_model_read(const dqw_axis *d, const dqw_axis *q, uint16_t pole_pairs, enum dqw_model_weight weight)
{
    dqw_parameters out = {0};
    find_pole_pairs(d, q, &out);
    if (pole_pairs != 0) {
        out.pole_pairs = pole_pairs;
        out.known |= DQW_KNOWS_POLE_PAIRS;
    } else if (out.pole_pairs_raw < POLE_PAIRS_MAX) {
        const float nearest = floorf(out.pole_pairs_raw + 0.5f);
        const float off = fabsf(out.pole_pairs_raw - nearest);
        if (nearest >= 1.0f && off < EVIDENCE_DISTANCE && EVIDENCE_SD * out.pole_pairs_raw_sd < 1.0f - off) {
            out.pole_pairs = (uint16_t)nearest;
            out.known |= DQW_KNOWS_POLE_PAIRS;
        }
    }

    // Without p the cross weights stand for no inductance: each axis' own then comes from its slope alone, and the flux
    // weight is p psi, not psi.
    const bool has_p = out.pole_pairs != 0;
    const float p = has_p ? (float)out.pole_pairs : 0.0f;
    float unit[N] = {
        d->neuron.y_base * d->neuron.x_scale[DQW_IN_R],
        d->neuron.y_base * d->neuron.x_scale[DQW_IN_L],
        q->neuron.y_base * q->neuron.x_scale[DQW_IN_L],
        q->neuron.y_base * q->neuron.x_scale[DQW_IN_FLUX],
    };
    int to_d[INPUTS] = {R, LD, LQ};
    int to_q[INPUTS] = {R, LQ, LD, PSI};
    float factor_d[INPUTS] = {1.0f, 1.0f, p};
    float factor_q[INPUTS] = {1.0f, 1.0f, p, p};
    const int extra = d->neuron.inputs - DQW_D_INPUTS;
    const bool joint = has_p && extra == q->neuron.inputs - DQW_Q_INPUTS && extra > 0 && extra <= DQW_EFFECT_WEIGHTS;
    const int effects = joint ? extra : 0;
    for (int i = 0; i < effects; i++) {
        unit[BASE + i] = d->neuron.y_base * d->neuron.x_scale[DQW_D_INPUTS + i];
        to_d[DQW_D_INPUTS + i] = to_q[DQW_Q_INPUTS + i] = BASE + i;
        factor_d[DQW_D_INPUTS + i] = factor_q[DQW_Q_INPUTS + i] = 1.0f;
    }
    const int size = BASE + effects;
    float m[N][N] = {{0}};
    float rhs[N] = {0};
    float info_d[INPUTS][INPUTS] = {{0}};
    float info_q[INPUTS][INPUTS] = {{0}};
    if (has_p) {
        information(d, DQW_D_INPUTS + effects, info_d);
        information(q, DQW_Q_INPUTS + effects, info_q);
        const float both = common_variance(d, q);
        add_axis(d, DQW_D_INPUTS + effects, info_d, weight == DQW_WEIGHT_COMMON ? both : variance(d), to_d, factor_d, unit, m, rhs);
        add_axis(q, DQW_Q_INPUTS + effects, info_q, weight == DQW_WEIGHT_COMMON ? both : variance(q), to_q, factor_q, unit, m, rhs);
    } else {
        // Each weight with its marginal information: R from both axes, L_d and L_q from their own slope.
        const struct {
            const dqw_axis *a;
            int weight, to;
        } single[] = {{d, DQW_IN_R, R}, {q, DQW_IN_R, R}, {d, DQW_IN_L, LD}, {q, DQW_IN_L, LQ}};
        for (int i = 0; i < 4; i++) {
            const float sd = dqw_axis_weight_sd(single[i].a, single[i].weight) / unit[single[i].to];
            const float info = isfinite(sd) ? 1.0f / (sd * sd) : 0.0f;
            m[single[i].to][single[i].to] += info;
            rhs[single[i].to] += info * dqw_learner_weight(&single[i].a->neuron, single[i].weight) / unit[single[i].to];
        }
    }
    invert(m, size);

    const float blocks = (float)(d->blocks > q->blocks ? d->blocks : q->blocks);
    float value[N] = {0};
    float sd[N] = {0};
    for (int i = 0; i < size; i++) {
        value[i] = 0.0f;
        for (int j = 0; j < size; j++)
            if (isfinite(m[i][j])) value[i] += m[i][j] * rhs[j];
        value[i] *= unit[i];
        sd[i] = sqrtf(m[i][i]) * unit[i];
        // A regressor that is mostly noise shrinks its weight by up to n (sd / w)^2, however small the deviation gets. (E20)
        const float ratio = sd[i] / value[i];
        const bool shrunk = weight == DQW_WEIGHT_EACH && blocks * ratio * ratio > SHRUNK_MAX;
        const bool known = isfinite(value[i]) && value[i] > 0.0f && sd[i] < DQW_KNOWN_RATIO * value[i] && !shrunk;
        if (known && i < BASE) out.known |= (uint8_t)(1u << i);
    }
    if (has_p && blocks > 0.0f)
        out.misfit_pu2 = (axis_misfit(d, DQW_D_INPUTS + effects, info_d, to_d, factor_d, value) +
                          axis_misfit(q, DQW_Q_INPUTS + effects, info_q, to_q, factor_q, value)) /
                         blocks;
    out.R_ohm = value[R];
    out.Ld_H = value[LD];
    out.Lq_H = value[LQ];
    out.psi_Wb = value[PSI];
    out.R_sd_ohm = sd[R];
    out.Ld_sd_H = sd[LD];
    out.Lq_sd_H = sd[LQ];
    out.psi_sd_Wb = sd[PSI];
#if DQW_EFFECT_WEIGHTS > 0
    for (int i = 0; i < DQW_EFFECT_WEIGHTS; i++) {
        out.effect[i] = i < effects ? value[BASE + i] : 0.0f;
        out.effect_sd[i] = i < effects ? sd[BASE + i] : INFINITY;
    }
#endif
    return out;
}
