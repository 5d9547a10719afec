#include "sim_polled.h"

#include <math.h>

#include "sim_random.h"

enum { LOST, REPEATED, JITTER, SPEED };

// Apart from the streams of excitation and sensors.
static uint64_t seed_of(const dqw_sim_scenario *s)
{
    return dqw_sim_random_bits(s->seed, 0x706f6c6c6564u, s->noise.seed);
}

static double rounded(double x, double step) { return step > 0 ? step * floor(x / step + 0.5) : x; }

static size_t period_of(const dqw_sim_scenario *s)
{
    return (size_t)floor(1 / (s->polled.rate_Hz * s->drive.dt_s) + 0.5);
}

// The poll needs the row of its instant, which is the one behind the interval.
static size_t polls_of(const dqw_sim_scenario *s, size_t count) { return count > 0 ? (count - 1) / period_of(s) : 0; }

static bool is_lost(const dqw_sim_scenario *s, size_t poll)
{
    return dqw_sim_random_uniform(seed_of(s), LOST, poll) < s->polled.lost_fraction;
}

size_t dqw_sim_polled_rows(const dqw_sim_scenario *s, size_t count)
{
    size_t rows = 0;
    for (size_t poll = 0; poll < polls_of(s, count); ++poll) rows += !is_lost(s, poll);
    return rows;
}

static void take_means(dqw_sim_row *row, const dqw_sim_row *from)
{
    row->v_d_V = from->v_d_V, row->v_q_V = from->v_q_V, row->i_d_A = from->i_d_A, row->i_q_A = from->i_q_A;
}

static dqw_sim_row polled(const dqw_sim_scenario *s, const dqw_sim_row *drive, size_t poll)
{
    const uint64_t seed = seed_of(s);
    const size_t period = period_of(s), instant = (poll + 1) * period;
    dqw_sim_row row = drive[instant], sum = {0};
    for (size_t k = instant - period; k < instant; ++k) {
        sum.v_d_V += drive[k].v_d_V, sum.v_q_V += drive[k].v_q_V;
        sum.i_d_A += drive[k].i_d_A, sum.i_q_A += drive[k].i_q_A;
    }
    const double n = (double)period;
    row.v_d_V = sum.v_d_V / n, row.v_q_V = sum.v_q_V / n, row.i_d_A = sum.i_d_A / n, row.i_q_A = sum.i_q_A / n;
    row.w_m_rad_s += s->polled.speed_noise_rad_s * dqw_sim_random_normal(seed, SPEED, poll);
    row.t_s += s->polled.jitter_s * dqw_sim_random_normal(seed, JITTER, poll);
    return row;
}

// What the slow link brings comes `lag` rows later; before, the tool has nothing but zeros.
static void queue(dqw_sim_row *rows, size_t count, size_t lag)
{
    const dqw_sim_row nothing = {0};
    for (size_t k = count; lag > 0 && k-- > 0;) {
        const dqw_sim_row *from = k < lag ? &nothing : &rows[k - lag];
        take_means(&rows[k], from);
        rows[k].v_dc_V = from->v_dc_V;
    }
}

static void round_to_wire(const dqw_sim_scenario *s, dqw_sim_row *row)
{
    const dqw_sim_polled *p = &s->polled;
    const double erpm = 60 / 6.283185307179586 * s->machine.pole_pairs;
    row->v_d_V = rounded(row->v_d_V, p->step_v_V), row->v_q_V = rounded(row->v_q_V, p->step_v_V);
    row->i_d_A = rounded(row->i_d_A, p->step_i_A), row->i_q_A = rounded(row->i_q_A, p->step_i_A);
    row->w_m_rad_s = rounded(row->w_m_rad_s * erpm, p->step_erpm) / erpm;
    row->v_dc_V = rounded(row->v_dc_V, p->step_v_dc_V);
}

void dqw_sim_polled_log(const dqw_sim_scenario *s, const dqw_sim_row *drive, size_t count, dqw_sim_row *rows)
{
    // No two stamps of a host are alike, whatever its jitter.
    const double tick_s = 1e-6;
    const size_t polls = polls_of(s, count), lag = (size_t)s->polled.queue_rows;
    size_t arrived = 0;
    for (size_t poll = 0; poll < polls; ++poll) {
        if (is_lost(s, poll)) continue;
        rows[arrived] = polled(s, drive, poll);
        rows[arrived].t_s = fmax(rows[arrived].t_s, arrived > 0 ? rows[arrived - 1].t_s + tick_s : 0);
        ++arrived;
    }
    queue(rows, arrived, lag);
    for (size_t k = 0; k < arrived; ++k) {
        round_to_wire(s, &rows[k]);
        // The first row that the link fills has none before it.
        if (k > lag && dqw_sim_random_uniform(seed_of(s), REPEATED, k) < s->polled.repeated_fraction)
            take_means(&rows[k], &rows[k - 1]);
    }
}
