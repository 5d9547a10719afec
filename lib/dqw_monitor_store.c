// What was learned as healthy, out of a monitor and back into one after a power cycle.
#include <stddef.h>

#include "dqw_hash.h"
#include "dqw_monitor_channel.h"

// With a flux map's weights it holds more.
#define VERSION (DQW_MAP_WEIGHTS > 0 ? 2u : 1u)
// The coldest that a machine is switched on at, below cold.
#define COLDER_K 40.0f
// So far above its limit a winding is known to be too hot.
#define HOTTER_K 10.0f

static uint32_t hash_of_effects(uint32_t hash, const dqw_estimator_config *c)
{
#if DQW_EFFECT_WEIGHTS > 0
    for (int k = 0; k < c->effect_count; k++) {
        hash = dqw_hash_add(hash, (uint32_t)c->effects[k].effect);
        hash = dqw_hash_bytes(hash, c->effects[k].shape, sizeof c->effects[k].shape);
        if (c->effects[k].effect == DQW_EFFECT_FLUX_MAP)
            hash = dqw_hash_bytes(hash, c->effects[k].map, dqw_effect_map_bytes(c->effects[k].map));
    }
#else
    (void)c;
#endif
    return hash;
}

// Of what gives the healthy values their meaning: the machine and its bases, what a sample is, what is learned.
static uint32_t hash_of(const dqw_monitor *m)
{
    const dqw_estimator_config *c = &m->config->estimator;
    const float values[] = {c->dt_s, c->v_base_V, c->i_base_A,          c->w_base_rad_s, c->R_ohm,         c->Ld_H,
                            c->Lq_H, c->psi_Wb,   c->dead_time_width_A, c->angle_late_s, m->config->J_kgm2};
    const bool flags[] = {c->angle,        c->encoder_offset,   c->noise_on_inputs,     c->voltage_next,
                          c->voltage_held, c->speed_electrical, m->config->commissioned};
    uint32_t hash = dqw_hash_bytes(dqw_hash_begin(), values, sizeof values);
    for (unsigned i = 0; i < sizeof flags / sizeof flags[0]; i++) hash = dqw_hash_add(hash, flags[i] ? 1u : 0u);
    hash = dqw_hash_add(hash, (uint32_t)c->modulation);
    hash = dqw_hash_add(hash, c->pole_pairs);
    hash = dqw_hash_add(hash, m->estimator.window.half);
    return hash_of_effects(hash, c);
}

static uint32_t check_of(const dqw_monitor_stored *s)
{
    uint32_t hash = dqw_hash_add(dqw_hash_add(dqw_hash_begin(), s->version), s->config);
    // Its fields leave no padding.
    hash = dqw_hash_bytes(hash, &s->healthy, sizeof s->healthy);
    for (int i = 0; i < DQW_WATCH_TEMPERATURE; i++) hash = dqw_hash_add(hash, s->looks[i]);
    for (unsigned i = 0; i < sizeof s->unused; i++) hash = dqw_hash_add(hash, s->unused[i]);
    return hash;
}

bool dqw_monitor_store(const dqw_monitor *m, dqw_monitor_stored *stored)
{
    if (m == NULL || stored == NULL || dqw_monitor_why(m) != DQW_WHY_IN_SERVICE || !dqw_watch_stands(&m->watch))
        return false;
    dqw_monitor_stored s = {.version = VERSION, .config = hash_of(m), .healthy = m->healthy};
    for (int i = 0; i < DQW_WATCH_TEMPERATURE; i++) s.looks[i] = m->watch.looks[i];
    s.check = check_of(&s);
    *stored = s;
    return true;
}

static float between(float x, float low, float high)
{
    return x < low ? low : x > high ? high : x;
}

// The machine is compared with what was stored. Of R and flux only what no heat explains is a change: it may have been
// switched off hot and on cold, and its magnet may still be as hot as it was. (E94)
static void enter_as_stored(dqw_monitor *m)
{
    const float alpha = dqw_monitor_alpha(m);
    const float beta = DQW_MONITOR_SLACK * dqw_monitor_beta(m);
    const float half_band = 0.5f * dqw_monitor_band(m, DQW_WATCH_PSI);
    const float limit_K = dqw_monitor_band(m, DQW_WATCH_TEMPERATURE);
    // [STO.1] R between the coldest start and a limit that is passed
    m->healthy.weight[DQW_R] = between(dqw_estimator_value(&m->estimator, DQW_R),
                                       m->healthy.cold_R_ohm * (1.0f - alpha * COLDER_K),
                                       m->healthy.cold_R_ohm * (1.0f + alpha * (limit_K + HOTTER_K)));

    // [STO.2] the flux between what the magnet loses where it is as hot as it was, and gains where it is cold
    const float rise = dqw_monitor_rise_K(m, m->healthy.weight[DQW_R]);
    const float hot = rise > m->healthy.hottest_K ? rise : m->healthy.hottest_K;
    const float cold = rise < 0.0f ? -rise : 0.0f;
    m->healthy.weight[DQW_PSI] = between(dqw_estimator_value(&m->estimator, DQW_PSI),
                                         m->healthy.cold_psi_Wb * (1.0f - beta * hot - half_band),
                                         m->healthy.cold_psi_Wb * (1.0f + beta * cold + half_band));
    dqw_watch_follow(&m->watch, DQW_WATCH_R, m->estimator.number);
    dqw_watch_follow(&m->watch, DQW_WATCH_PSI, m->estimator.number);
}

enum dqw_status dqw_monitor_restore(dqw_monitor *m, const dqw_monitor_stored *stored)
{
    if (m == NULL || stored == NULL) return DQW_ERR_NULL;
    const dqw_monitor_stored *s = stored;
    if (s->version != VERSION) return DQW_ERR_STORE_VERSION;
    if (s->check != check_of(s)) return DQW_ERR_STORE_DAMAGED;
    if (s->config != hash_of(m)) return DQW_ERR_STORE_CONFIG;
    m->healthy = s->healthy;
    dqw_watch_restore(&m->watch, s->looks);
    m->enter_as_stored = enter_as_stored;
    return DQW_OK;
}
