// How sure a weight is, in double, from (E61), (E103) and (E106): for the readings of both arithmetics. All per unit:
// of the weight, of the voltage, squared where the names say so.
#ifndef KNOWN_WEIGHT_H
#define KNOWN_WEIGHT_H

#include <math.h>
#include <stdbool.h>

#include "dqw_test.h"

/// What the estimator holds.
typedef struct known_state {
    double error2[2], floor2;       ///< residual of d and q, never taken for less
    double lasting2[3], slow2;      ///< what lasts, as it was gathered; the third, of six a turn, with its sign
    double calm_fast2, calm_slow2;  ///< while nothing seems to change
    int blocks, stretch, weights;   ///< learned; in a stretch; inputs in all
    int learned;                    ///< weights of which anything was learned
    int segments, since;            ///< in all; since a weight was found changed
    int opened;                     ///< times that one was
    double voltage_error;           ///< that the user allows for
    double voltage_scale;           ///< deviation of its scale, as a part
    bool settled;
    bool forgets;  ///< a start (E194)
} known_state;

/// And of one weight.
typedef struct known_weight {
    double w, cov, score2, lag, alone2, slow_alone2, band;
    bool learned, leans, in_q;  ///< an observer's angle leans with it; its voltage error counts on q
    bool is_L;                  ///< an inductance
} known_weight;

typedef struct known_sd {
    double noise, change, value;  ///< INFINITY: not known
} known_sd;

static inline double known_common(const known_state *s)
{
    return (fmax(s->error2[0], s->floor2) + fmax(s->error2[1], s->floor2)) / 2;
}

/// (E61), (E20)
static inline double known_noise2(const known_state *s, const known_weight *w)
{
    const int rows = 2 * s->blocks;
    const int freedom = rows - s->learned;
    if (!w->learned || freedom < (s->settled ? 1 : 2 * s->weights)) return INFINITY;
    const double r = w->score2 > 0 ? fmax(-0.4, fmin(0.98, w->lag / w->score2)) : 0;
    const double c = !s->settled ? 1 + 2 * r : r > 0 ? (1 + r) / (1 - r) : 1;
    return known_common(s) * w->cov * c * rows / freedom;
}

/// (E103): the part of a mean that one of so many stretches is.
static inline double known_part(const known_state *s, double stretch)
{
    const double looks = (s->blocks - 50) / stretch;
    return fmax(s->forgets ? 4 / (looks + 3) : 2 / (looks + 1), stretch / 4096);
}

/// (E103): of the residual, f^2 and s^2.
static inline void known_lasting(const known_state *s, double *fast2, double *slow2)
{
    *fast2 = *slow2 = 0;
    if (s->settled || s->blocks <= 50) return;
    const double N = s->stretch;
    *fast2 = fmax(0, fmax(fabs(s->lasting2[0]), fabs(s->lasting2[1])) - 1.2 * known_common(s) * sqrt(known_part(s, 1)));
    *slow2 = fmax(0, s->slow2 - 1.5 * known_common(s) / N * sqrt(known_part(s, N)));
}

/// The same of what turns six times with the rotor: of a value alone.
static inline double known_turning(const known_state *s)
{
    return s->settled || s->blocks <= 50 ? 0 : s->lasting2[2] - 1.2 * known_common(s) * sqrt(known_part(s, 1));
}

/// h^2 of (E103).
static inline double known_model2(const known_state *s, const known_weight *w, double fast2, double slow2)
{
    if (fast2 + slow2 <= 0) return 0;
    if (w->alone2 <= 0) return INFINITY;
    const double slowly = fmin(w->alone2, w->slow_alone2);
    const double quickly = fmax(w->alone2 - slowly, slowly * sqrt(known_part(s, s->stretch)));
    return (slow2 * slowly + fast2 * quickly) / (w->alone2 * w->alone2);
}

/// (E106)
static inline double known_hidden2(const known_state *s, const known_weight *w, double fast2, double slow2, double part)
{
    const double h2 = known_model2(s, w, fast2, slow2);
    return (w->leans ? 1 : part * part) * h2 + w->band * fmin(w->band, sqrt(h2));
}

/// (E106): what an opening left open, as far as segments have not told it.
static inline double known_opened2(const known_state *s, const known_weight *w)
{
    return s->opened > 0 && s->since > 0 ? pow(3 * w->band / s->since, 2) : 0;
}

static inline double known_voltage2(const known_state *s, const known_weight *w)
{
    const double V2 = s->voltage_error * s->voltage_error;
    if (V2 <= 0) return 0;
    if (s->settled) return V2 * s->blocks * w->cov;
    if (w->alone2 <= 0) return INFINITY;
    return V2 * known_common(s) / fmax(s->error2[w->in_q], s->floor2) / (2 * w->alone2);
}

static inline known_sd known_of(const known_state *s, const known_weight *w)
{
    double fast2;
    double slow2;
    known_lasting(s, &fast2, &slow2);
    const double noise2 = known_noise2(s, w);
    const bool calm = s->segments >= 2;
    const double then2 = known_hidden2(s, w, calm ? s->calm_fast2 : fast2, calm ? s->calm_slow2 : slow2, 0.4);
    const double scale2 = pow(s->voltage_scale * w->w, 2);
    const double value2 = known_hidden2(s, w, fmax(fast2, known_turning(s)), slow2, w->is_L ? 0.25 : 0.4);
    const double now2 = value2 + known_opened2(s, w);
    const known_sd sd = {sqrt(noise2), sqrt(noise2 + then2 / (1 + s->since)),
                         sqrt(noise2 + now2 + known_voltage2(s, w) + scale2)};
    return sd;
}

/// A state of every kind, and weights of every kind. `size`: of a residual, squared.
static inline known_state known_drawn(test_random *r, bool settled, double floor2)
{
    known_state s = {.floor2 = floor2, .settled = settled};
    static const int blocks[] = {3, 9, 10, 11, 12, 40, 50, 51, 55, 300, 5000, 65535};
    s.blocks = blocks[random_bits(r) % 12];
    const double size = pow(10, random_uniform(r, -9, -2.7));
    for (int a = 0; a < 2; a++) {
        s.error2[a] = size * random_uniform(r, 0.3, 3);
        s.lasting2[a] = size * random_uniform(r, -1, 1);
    }
    s.lasting2[2] = size * random_uniform(r, -1, 1);
    s.slow2 = size * random_uniform(r, -0.3, 1);
    s.calm_fast2 = size * random_uniform(r, 0, 1), s.calm_slow2 = size * random_uniform(r, 0, 1);
    // Until then, and of settled points, nothing is known to last.
    if (settled || s.blocks <= 50) s.calm_fast2 = s.calm_slow2 = 0;
    if (random_bits(r) % 4 == 0) s.lasting2[0] = s.lasting2[1] = s.lasting2[2] = s.slow2 = 0;
    s.segments = (int)(random_bits(r) % 3), s.since = (int)(random_bits(r) % 5);
    s.opened = (int)(random_bits(r) % 3);
    s.voltage_error = random_bits(r) % 2 ? random_uniform(r, 0.001, 0.03) : 0;
    s.voltage_scale = random_bits(r) % 2 ? pow(10, random_uniform(r, -4, -1)) : 0;
    return s;
}

static inline known_weight weight_drawn(test_random *r)
{
    known_weight w = {.learned = random_bits(r) % 8 != 0};
    w.cov = pow(10, random_uniform(r, -3, 0));
    w.score2 = random_bits(r) % 8 == 0 ? 0 : random_uniform(r, 0.01, 1);
    w.lag = w.score2 * random_uniform(r, -1.1, 1.1);
    w.alone2 = random_bits(r) % 8 == 0 ? 0 : random_uniform(r, 0.01, 0.9);
    w.slow_alone2 = w.alone2 * random_uniform(r, 0, 1.3);
    w.band = pow(10, random_uniform(r, -4, -1));
    w.w = random_uniform(r, -2, 2);
    return w;
}

#endif
