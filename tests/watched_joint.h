// The faulty joint through a monitor.
#ifndef WATCHED_JOINT_H
#define WATCHED_JOINT_H

#include "dqw_estimator_block.h"
#include "dqw_estimator_random.h"
#include "dqw_monitor.h"
#include "dqw_watch.h"
#include "faulty_joint.h"

/// Nominal values 30 % off, with alternating signs.
static inline dqw_monitor_config config_of(void)
{
    const dqw_sim_machine *m = &dqw_sim_scenario_find("joint_24v")->machine;
    const dqw_monitor_config c = {.estimator = {.dt_s = (float)DT_S,
                                                .v_base_V = 14.0f,
                                                .i_base_A = 6.0f,
                                                .w_base_rad_s = 110.0f,
                                                .R_ohm = (float)(1.3 * m->R_ohm),
                                                .Ld_H = (float)(0.7 * m->Ld_H),
                                                .Lq_H = (float)(1.3 * m->Lq_H),
                                                .psi_Wb = (float)(0.7 * m->psi_Wb),
                                                .pole_pairs = 4,
                                                .noise_on_inputs = true,
                                                .dead_time_width_A = 0.05f,
                                                .angle = true,
                                                .encoder_offset = true,
                                                .follow = true},
                                  .J_kgm2 = (float)m->J_kgm2};
    return c;
}

static inline dqw_monitor begin(const dqw_monitor_config *c)
{
    dqw_monitor m;
    if (c->estimator.random != NULL) dqw_estimator_random_init(c->estimator.random);
    TEST_ASSERT_EQUAL_INT(DQW_OK, dqw_monitor_init(&m, c));
    return m;
}

static inline dqw_sample row_sample(int k)
{
    const dqw_sim_row *r = &rows[k];
    return dqw_sample_from_dq((float)r->v_d_V, (float)r->v_q_V, (float)r->i_d_A, (float)r->i_q_A, (float)r->w_m_rad_s,
                              (float)r->theta_e_rad);
}

typedef struct course {
    int events;
    dqw_monitor_change first;
    double first_s;     ///< when it was told
    double service_s;   ///< when it entered service, infinite: never
    double watching_s;  ///< when it first watched, after the rest
    double through_s[4];
    uint32_t whys;  ///< bit i: enum dqw_why i held after some sample
} course;

/// Service, and a rest, begin with what is now as healthy, and no reversal counted: not only from the next look on.
static inline void is_healthy_now(const dqw_monitor *m)
{
    for (int i = 0; i < DQW_WATCH_OFFSET; i++)
        HOLDS(m->healthy.weight[i] == (dqw_watch_is_map(i) ? 0.0f : dqw_estimator_value(&m->estimator, i)));
    HOLDS(m->healthy.friction_Nm == m->friction_Nm && m->watch.reversals == 0 && m->watch.alarms == 0);
    HOLDS(m->healthy.residual_pu2 == fmaxf(m->estimator.recent_pu2, 4e-6f));
}

/// The rows from..to through a monitor.
static inline course watch(dqw_monitor *m, int from, int to)
{
    course o = {.service_s = INFINITY, .watching_s = INFINITY, .through_s = {INFINITY, INFINITY, INFINITY, INFINITY}};
    for (int k = from; k < to && k < row_count; k++) {
        const dqw_sample s = row_sample(k);
        const bool waits = (dqw_monitor_sample(m, &s, false) & DQW_EVENT_BLOCK) != 0;
        const bool begins = dqw_monitor_stage(m) != DQW_STAGE_IN_SERVICE && m->enter_as_stored == NULL;
        dqw_monitor_change e;
        memset(&e, 0x5a, sizeof e);
        const bool told = dqw_monitor_background(m);
        HOLDS(waits || !told);
        HOLDS(dqw_monitor_event(m, &e) == told && !dqw_monitor_event(m, &e));
        if (waits) o.whys |= 1u << dqw_monitor_why(m);
        const enum dqw_stage_name stage = dqw_monitor_stage(m);
        // What coarse weights leave is no ripple.
        HOLDS(stage != DQW_STAGE_RANDOM || m->witness.blocks == 0);
        if ((told && dqw_monitor_why(m) == DQW_WHY_RESTS) || (begins && stage == DQW_STAGE_IN_SERVICE))
            is_healthy_now(m);
        if (!isfinite(o.through_s[stage])) o.through_s[stage] = k * DT_S;
        if (stage == DQW_STAGE_IN_SERVICE && !isfinite(o.service_s)) o.service_s = k * DT_S;
        if (waits && !isfinite(o.watching_s) && dqw_monitor_why(m) == DQW_WHY_IN_SERVICE) o.watching_s = k * DT_S;
        if (!told) continue;
        HOLDS(stage == DQW_STAGE_IN_SERVICE);
        if (o.events++ == 0) o.first = e, o.first_s = k * DT_S;
    }
    return o;
}

#endif
