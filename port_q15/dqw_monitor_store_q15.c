// What was learned as healthy, out of a monitor and back into one after a power cycle.
#include <stddef.h>

#include "dqw_hash.h"
#include "dqw_monitor_channel_q15.h"
#include "dqw_q15.h"

// With a flux map's weights it holds more.
#define VERSION (DQW_MAP_WEIGHTS > 0 ? 2u : 1u)
// The coldest that a machine is switched on at, below cold.
#define COLDER_K 40
// So far above its limit a winding is known to be too hot.
#define HOTTER_Q24 167772160
#define MILLION 1000000

static uint32_t hash_of_effects(uint32_t hash, const dqw_estimator_q15_config *c)
{
#if DQW_EFFECT_WEIGHTS > 0
    for (int k = 0; k < c->effect_count; k++) {
        const dqw_effect_q15_config *e = &c->effects[k];
        const uint32_t shape[] = {(uint32_t)e->effect, e->i_uA,   e->R_uohm,           e->Ld_nH, e->Lq_nH,
                                  e->psi_nWb,          e->row_us, (uint32_t)e->T_0_cC, e->order, e->cell_d_uA,
                                  e->cell_q_uA};
        hash = dqw_hash_bytes(hash, shape, sizeof shape);
        hash = dqw_hash_bytes(hash, &e->tau_us, sizeof e->tau_us);
        if (e->effect == DQW_EFFECT_FLUX_MAP) hash = dqw_hash_bytes(hash, e->map, dqw_effect_map_bytes(e->map));
    }
#else
    (void)c;
#endif
    return hash;
}

// Of what gives the healthy values their meaning: the machine and its full scales, what a sample is, what is learned.
static uint32_t hash_of(const dqw_monitor_q15 *m)
{
    const dqw_estimator_q15_config *c = &m->config->estimator;
    const uint32_t values[] = {c->scale.v_full_mV,
                               c->scale.i_full_mA,
                               c->scale.w_full_mrad_s,
                               c->scale.dt_ns,
                               c->R_uohm,
                               c->Ld_nH,
                               c->Lq_nH,
                               c->psi_nWb,
                               c->dead_time_width_mA,
                               m->config->J_nkgm2,
                               (uint32_t)c->angle_late_ns};
    const bool flags[] = {c->angle,        c->encoder_offset,   c->noise_on_inputs,     c->voltage_next,
                          c->voltage_held, c->speed_electrical, m->config->commissioned};
    uint32_t hash = dqw_hash_bytes(dqw_hash_begin(), values, sizeof values);
    for (unsigned i = 0; i < sizeof flags / sizeof flags[0]; i++) hash = dqw_hash_add(hash, flags[i] ? 1u : 0u);
    hash = dqw_hash_add(hash, (uint32_t)c->modulation);
    hash = dqw_hash_add(hash, c->scale.pole_pairs);
    hash = dqw_hash_add(hash, m->estimator.window.half);
    return hash_of_effects(hash, c);
}

// All its bytes are checked: padding would be among them.
typedef char
    healthy_has_no_padding[sizeof(dqw_monitor_healthy_q15) ==
                                   sizeof(int64_t) + sizeof(int32_t) * (DQW_WATCH_OFFSET + 2 * DQW_WITNESS_INPUTS + 4)
                               ? 1
                               : -1];

static uint32_t check_of(const dqw_monitor_stored_q15 *s)
{
    uint32_t hash = dqw_hash_add(dqw_hash_add(dqw_hash_begin(), s->version), s->config);
    hash = dqw_hash_bytes(hash, &s->healthy, sizeof s->healthy);
    for (int i = 0; i < DQW_WATCH_TEMPERATURE; i++) hash = dqw_hash_add(hash, s->looks[i]);
    for (unsigned i = 0; i < sizeof s->unused; i++) hash = dqw_hash_add(hash, s->unused[i]);
    return hash;
}

bool dqw_monitor_store_q15(const dqw_monitor_q15 *m, dqw_monitor_stored_q15 *stored)
{
    if (m == NULL || stored == NULL || dqw_monitor_why_q15(m) != DQW_WHY_IN_SERVICE || !dqw_watch_stands(&m->watch))
        return false;
    dqw_monitor_stored_q15 s = {.version = VERSION, .config = hash_of(m), .healthy = m->healthy};
    for (int i = 0; i < DQW_WATCH_TEMPERATURE; i++) s.looks[i] = m->watch.looks[i];
    s.check = check_of(&s);
    *stored = s;
    return true;
}

static int32_t between(int32_t x, int32_t low, int32_t high)
{
    return x < low ? low : x > high ? high : x;
}

// The machine is compared with what was stored. Of R and flux only what no heat explains is a change: it may have been
// switched off hot and on cold, and its magnet may still be as hot as it was. (E94)
void dqw_monitor_enter_as_stored_q15(dqw_monitor_q15 *m)
{
    const int64_t alpha_ppm = dqw_monitor_alpha_ppm(m);
    const int64_t colder_q24 = dqw_q_quotient64(alpha_ppm * COLDER_K, MILLION, 24);
    const int64_t hotter_q24 = dqw_q_quotient64(
        alpha_ppm * (dqw_monitor_band_q24(m, DQW_WATCH_TEMPERATURE) + HOTTER_Q24), MILLION, 0);  // 2^20 by 2^37
    // [STO.1] R between the coldest start and a limit that is passed
    m->healthy.weight_q24[DQW_R] = between(m->estimator.w_q24[DQW_R],
                                           dqw_monitor_of_cold_q24(m->healthy.cold_R_q24, -colder_q24),
                                           dqw_monitor_of_cold_q24(m->healthy.cold_R_q24, hotter_q24));

    // [STO.2] the flux between what the magnet loses where it is as hot as it was, and gains where it is cold
    const int32_t rise = dqw_monitor_rise_q16(m, m->healthy.weight_q24[DQW_R]);
    const int32_t hot = rise > m->healthy.hottest_q16 ? rise : m->healthy.hottest_q16;
    const int64_t cold = rise < 0 ? -(int64_t)rise : 0;
    m->healthy.weight_q24[DQW_PSI] = between(
        m->estimator.w_q24[DQW_PSI],
        dqw_monitor_of_cold_q24(m->healthy.cold_psi_q24, -dqw_monitor_flux_lost_q24(m, hot)),
        dqw_monitor_of_cold_q24(m->healthy.cold_psi_q24, dqw_monitor_flux_lost_q24(m, cold)));
    dqw_watch_follow(&m->watch, DQW_WATCH_R, m->estimator.number);
    dqw_watch_follow(&m->watch, DQW_WATCH_PSI, m->estimator.number);
    m->restored = false;
}

enum dqw_status dqw_monitor_restore_q15(dqw_monitor_q15 *m, const dqw_monitor_stored_q15 *stored)
{
    if (m == NULL || stored == NULL) return DQW_ERR_NULL;
    const dqw_monitor_stored_q15 *s = stored;
    if (s->version != VERSION) return DQW_ERR_STORE_VERSION;
    if (s->check != check_of(s)) return DQW_ERR_STORE_DAMAGED;
    if (s->config != hash_of(m)) return DQW_ERR_STORE_CONFIG;
    m->healthy = s->healthy;
    dqw_watch_restore(&m->watch, s->looks);
    m->restored = true;
    return DQW_OK;
}
