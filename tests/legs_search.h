// Which legs switch, as (E101) decides it after a round, in double: for the searches of both arithmetics.
#ifndef LEGS_SEARCH_H
#define LEGS_SEARCH_H

#include "dqw_modulation_name.h"
#include "dqw_test.h"

enum { LEGS = 4, LEGS_GO_ON = -1, LEGS_LEADS = 10 };  ///< LEGS_LEADS + m: m leads from here on, and all begins anew

/// ratio[m]: what m left over what the leader left beside it.
static inline int legs_verdict(int leader, int rounds, const double ratio[LEGS])
{
    int best = 0;
    double least = INFINITY;
    for (int m = 1; m < LEGS; m++)
        if (m != leader && ratio[m] < least) best = m, least = ratio[m];
    double next = INFINITY;
    for (int m = 1; m < LEGS; m++)
        if (m != leader && m != best) next = fmin(next, ratio[m]);
    if (leader == DQW_MODULATION_CENTRED) {
        if (rounds < 2) return LEGS_GO_ON;
        if (least >= 0.8) return DQW_MODULATION_CENTRED;
        if (least <= 0.7 || least <= 0.6 * next) return LEGS_LEADS + best;
        return rounds < 4 ? LEGS_GO_ON : DQW_MODULATION_CENTRED;
    }
    const bool clear = ratio[DQW_MODULATION_CENTRED] > 1.25;
    if (clear && least > 1) return leader;
    if (rounds < 2) return LEGS_GO_ON;
    if (!clear) return DQW_MODULATION_CENTRED;
    if (least < 0.8) return best;
    return rounds < 4 ? LEGS_GO_ON : leader;
}

/// The rival of a trial, the first one being 1: those that do not lead, in turn.
static inline int legs_rival(int leader, int trial)
{
    int rivals[LEGS];
    int n = 0;
    for (int m = 0; m < LEGS; m++)
        if (m != leader) rivals[n++] = m;
    return rivals[(trial - 1) % n];
}

/// Ratios about all that decides, none so near that rounding would.
static inline void legs_drawn(test_random *r, double ratio[LEGS])
{
    static const double about[] = {0.6, 0.7, 0.8, 1, 1.25};
    for (int m = 0; m < LEGS; m++)
        ratio[m] = about[random_bits(r) % 5] *
                   (random_bits(r) % 2 ? random_uniform(r, 0.9, 0.999) : random_uniform(r, 1.001, 1.1));
    // What is far below the next best.
    if (random_bits(r) % 3 == 0) ratio[1 + random_bits(r) % 3] = 0.75, ratio[1 + random_bits(r) % 3] = 1.3;
}

#endif
